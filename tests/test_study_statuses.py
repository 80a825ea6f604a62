"""What runs, what fails and what is skipped, each with its reason."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, run, sampling, sweep, write_study
from .studies import ISAS, Study, needs_two_cpus


def test_null_kernel_fails(mixed: Study) -> None:
    r = mixed.the(kernel="null")
    assert r["status"] == "failed" and "pixels differ" in r["reason"]
    assert r["verify"]["conforms"] is False and r["verify"]["differing_pixels"] > 100
    assert mixed.outcome.code == 1
    assert any("FAILED" in line and "/null/" in line for line in mixed.outcome.errors)
    assert [r["kernel"] for r in map(lambda r: r["config"], mixed.records) if r["kernel"] == "null"] == ["null"]


def test_null_kernel_is_hidden(good: Study, tmp_path: Path) -> None:
    assert '"null"' not in run("list", "kernels", "--json").ok().stdout
    every = write_study(tmp_path / "all.toml", sweep("all", "serial"))
    assert "/null/" not in run("study", every, "--list").ok().stdout


@pytest.mark.parametrize("axes, words", [
    ({"kernel": "triangle_atomics", "numeric": "f64", "fill": "closed"}, ["triangle_atomics", "f64"]),
    ({"kernel": "all_pixels"}, ["predicted cost", " s ", "time limit of 5 s"]),
    ({"threads": CPUS + 1}, [f"{CPUS + 1} threads on {CPUS} CPUs", "--oversubscribe"]),
    ({"backend": "tbb", "wait_policy": "passive"}, ["OpenMP"]),
    ({"backend": "tbb", "runtime": "libomp"}, ["OpenMP"]),
], ids=lambda value: " ".join(map(str, value.values())) if isinstance(value, dict) else "")
def test_skipped_with_a_reason(axes: dict[str, Any], words: list[str], mixed: Study) -> None:
    r = mixed.the(**axes)
    assert r["status"] == "skipped" and all(word in r["reason"] for word in words), r["reason"]


@pytest.mark.parametrize("axes", [{"binding": "close"}, {"binding": "spread"}, {"wait_policy": "active"}, {"wait_policy": "passive"},
                                  {"near": "off", "tile": 16}, {"near": "off", "tile": 32}, {"cache": "cold"}, {"generality": "full"}, {"threads": 1, "kernel": "row_parallel",
                                  "binding": "none", "wait_policy": "default", "runtime": "default"}], ids=str)
def test_axes_that_run(axes: dict[str, Any], mixed: Study) -> None:
    found = mixed.where(**axes)
    (r,) = [r for r in found if r["config"]["backend"] != "tbb"]
    assert r["status"] == "ok", r.get("reason")
    if "binding" in axes:  # the one axis of these that oneTBB has, too
        assert [r["status"] for r in found] == ["ok"] * len(found)


@pytest.mark.skipif(ISAS == ["baseline"], reason="streaming needs vectors")
def test_a_point_keeps_the_techniques_of_its_kernel(mixed: Study) -> None:
    """And what makes no difference makes no other point."""
    for kernel, techniques in {"scanline": ["none", "huge_pages", "streaming+huge_pages"],
                               "fused_tiles": ["none", "fragments+huge_pages", "all-streaming", "all"]}.items():
        found = mixed.where(kernel=kernel, numeric="fixed_8", isa=ISAS[-1], cache="warm")
        assert [r["config"]["techniques"] for r in found] == techniques
        assert all(r["status"] == "ok" and r["verify"]["conforms"] for r in found)
        assert len({r["id"] for r in found}) == len(techniques)


@needs_two_cpus
def test_fewer_threads_than_asked_for(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(), sweep("row_parallel", ["serial", "openmp:dynamic"], threads=[1, 2]), OMP_THREAD_LIMIT="1")
    assert study.outcome.code == 1
    r = study.the(threads=2)
    assert r["status"] == "failed" and r["reason"] == "1 of 2 threads ran" and r["threads_observed"] == 1
    assert all(r["status"] == "ok" for r in study.where(threads=1)) and len(study.where(threads=1)) == 2
    assert study.context["environment"]["OMP_THREAD_LIMIT"] == "1"


def test_oversubscribed(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(), sweep("row_parallel", ["openmp:static", "tbb:auto"], threads=CPUS + 1), options=("--oversubscribe",))
    assert study.outcome.code == 0
    assert [r["threads_observed"] for r in study.records] == [CPUS + 1] * 2
