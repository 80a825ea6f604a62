"""scripts/invariant0: what it covers, that it passes kernels that are right, and that broken ones fail it."""

from __future__ import annotations

import itertools
import re
import subprocess
import tomllib
from pathlib import Path

import pytest

from .program import CPUS, ROOT, TIMEOUT, environment, program, records, run

TINY = ("--numeric", "f32", "--threads", "2", "--strength", "1")


def invariant0(*options: object) -> subprocess.CompletedProcess[str]:
    command = [ROOT / "scripts/invariant0", "--program", program(), *options]
    return subprocess.run([str(word) for word in command], env=environment(), capture_output=True, text=True, timeout=TIMEOUT, check=False)


def test_right_kernels_pass(tmp_path: Path) -> None:
    done = invariant0("--out", tmp_path, "--kernel", "tile_parallel", "--kernel", "triangle_atomics", *TINY)
    assert done.returncode == 0, done.stdout + done.stderr
    found = records(tmp_path / "records")
    assert {r["status"] for r in found} == {"ok"} and all(r["verify"]["conforms"] for r in found)
    assert all(len(r["samples_ms"]) == 1 for r in found)  # one sample a point
    summary = done.stdout.splitlines()[-1]
    assert summary.startswith("Invariant 0 holds: 0 of ") and f" in {len(found)} points (0 failed, 0 skipped)" in summary
    assert "2 kernels, 1 modes, 6 scenes," in summary and "2 thread counts" in summary and "2 fill rules" in summary
    covered, wanted = re.search(r"(\d+) of (\d+) values;", summary).groups()
    assert covered == wanted


@pytest.mark.parametrize("kernel", ["stale", "null"])
def test_broken_kernels_fail(kernel: str, tmp_path: Path) -> None:
    done = invariant0("--out", tmp_path, "--kernel", kernel, *TINY)
    assert done.returncode == 1
    lines = done.stdout.splitlines()
    assert lines[-1].startswith("Invariant 0 is NOT proved: ") and "in 0 points" in lines[-1]
    differing = int(re.search(r"(\d+) of \d+ pixels differ", lines[-1])[1])
    assert differing == sum(r["verify"]["differing_pixels"] for r in records(tmp_path / "records")) > 0
    assert any(line.startswith("FAILED ") and f"/{kernel}/f32/" in line and "differ from the specification" in line for line in lines)


def test_a_broken_kernel_among_right_ones_fails(tmp_path: Path) -> None:
    done = invariant0("--out", tmp_path, "--kernel", "scanline", "--kernel", "stale", *TINY)
    assert done.returncode == 1 and "/stale/" in done.stdout and "FAILED" in done.stdout
    assert {r["config"]["kernel"] for r in records(tmp_path / "records") if r["status"] == "ok"} == {"scanline"}


def test_more_threads_than_cpus(tmp_path: Path) -> None:
    done = invariant0("--out", tmp_path, "--kernel", "row_parallel", "--numeric", "f32", "--threads", CPUS + 2, "--strength", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    found = [r for r in records(tmp_path / "records") if r["config"]["threads"] == CPUS + 2]
    assert found and all(r["threads_observed"] == CPUS + 2 for r in found)


def test_the_design_covers_triples(tmp_path: Path) -> None:
    """Counted from the study file, without the script's own code."""
    kernels = ["scanline", "tile_parallel", "tile_simd"]
    words = [word for kernel in kernels for word in ("--kernel", kernel)]
    done = invariant0("--out", tmp_path, *words, "--numeric", "f32", "--numeric", "fixed_8", "--threads", "4", "--dry-run")
    assert done.returncode == 0 and not (tmp_path / "records").exists()
    sweeps = tomllib.loads((tmp_path / "invariant0.toml").read_text())["sweep"]
    executions = {s["execution"] for s in sweeps}
    assert {e.partition(":")[0] for e in executions} >= {"serial", "openmp"} and len(executions) > 10
    product = {(k, e, t) for k in kernels for e in executions for t in ((1,) if e == "serial" else (1, 2, 3, 4))}
    assert {(s["kernel"], s["execution"], s["threads"]) for s in sweeps} == product
    modes = {(s["kernel"], s["numeric"]) for s in sweeps}
    assert modes == set(itertools.product(kernels[:2], ["f32", "fixed_8"])) | {("tile_simd", "fixed_8")}
    isas, scenes = {s["isa"] for s in sweeps}, {s["scene"]["name"] for s in sweeps}
    wanted = {(*m, i, f) for m in modes for i in isas for f in ("closed", "top-left")}
    assert {(s["kernel"], s["numeric"], s["isa"], s["fill"]) for s in sweeps if s["scene"]["name"] in scenes} >= {
        w for w in wanted if w[0] == "tile_simd"}  # of tile_simd there is one mode, so these are triples
    assert {(s["scene"]["name"], s["execution"], s["threads"]) for s in sweeps} == {
        (n, e, t) for n in scenes for _, e, t in product}


def test_scenes_of_a_folder(tmp_path: Path) -> None:
    for name, triangles in (("small", 300), ("large", 5000)):
        (tmp_path / "models" / name).mkdir(parents=True)
        file = tmp_path / "models" / name / name
        run("scene", f"teapot:triangles={triangles}", "-o", file.with_suffix(".dat"), "--parameters", file.with_suffix(".txt")).ok()
    (tmp_path / "models/small/other.dat.xz").write_bytes(b"")
    done = invariant0("--out", tmp_path / "out", "--scenes", tmp_path / "models", "--largest", "1000", "--kernel", "scanline", *TINY)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "small" in {r["config"]["scene"] for r in records(tmp_path / "out/records")}
    assert re.search(r"left out: .*large\.dat: \d+ triangles, more than --largest 1000", done.stdout)
    assert "other.dat: only other.dat.xz is there" in done.stdout
    assert "7 scenes" in done.stdout.splitlines()[-1]


@pytest.mark.parametrize("options, word", [(("--threads", "0"), "--threads"), (("--numeric", "f33"), "f33"), (("--kernel", "nul"), "nul"),
                                           (("--scenes", "nowhere"), "nowhere"), (("--strength", "4"), "strength"), (("--bogus",), "bogus"),
                                           (("--kernel", "nul", "--numeric", "f32"), "nul")])
def test_bad_options_are_refused(options: tuple[str, ...], word: str, tmp_path: Path) -> None:
    done = invariant0("--out", tmp_path, *options)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and word in done.stderr
