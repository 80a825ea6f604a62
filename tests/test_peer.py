"""The peer, Mesa's llvmpipe, beside kernels in a study; skipped where this build or this machine has none."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, ROOT, Outcome, events, read_png, records, refused, run, sampling, sweep, write_study
from .studies import STAGES
from .study_schema import CONFIG, RECORD, obey

BOTH = [1, min(2, CPUS)]


def peer() -> dict[str, Any]:
    (entry,) = json.loads(run("list", "peers", "--json").ok().stdout)
    assert entry["name"] == "llvmpipe"
    return entry


def peers_only(**axes: Any) -> str:
    values = dict(scene="teapot:triangles=300", size="64x48", peer="llvmpipe", threads=1) | axes
    return "[[sweep]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())


def study(folder: Path, *tables: str, options: tuple[object, ...] = (), **variables: str) -> Outcome:
    return run("study", write_study(folder / "study.toml", 'name = "peers"', *tables), "--out", folder / "out", *options, **variables)


@pytest.fixture
def needs_llvmpipe() -> None:
    if not peer()["available"]:
        pytest.skip(peer()["reason"])


@pytest.fixture(scope="module")
def beside(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Kernels and the peer on one scene, on one thread and on two; numeric, fill and execution do not multiply the peer."""
    if not peer()["available"]:
        pytest.skip(peer()["reason"])
    folder = tmp_path_factory.mktemp("beside")
    study(folder, sampling(6), sweep(["tile_parallel"], ["serial", "openmp:dynamic"], scene="teapot:triangles=3000", size="160x120",
                                     peer="llvmpipe", numeric=["f32", "fixed_8"], fill=["closed", "top-left"], threads=BOTH)).ok()
    return folder / "out"


def of_peer(out: Path) -> list[dict[str, Any]]:
    return [r for r in records(out) if r["config"]["kernel"] == "llvmpipe"]


def test_list_says_what_the_peer_is() -> None:
    entry = peer()
    assert entry["bound"] and entry["bound_source"]
    shown = run("list", "peers").ok().stdout
    if entry["available"]:
        assert "llvmpipe" in entry["renderer"] and "Mesa" in entry["version"] and entry["version"] in shown
    else:
        assert entry["reason"] and entry["reason"] in shown


def test_a_peer_has_a_point_for_each_number_of_threads(beside: Path) -> None:
    found = of_peer(beside)
    assert [r["config"]["threads"] for r in found] == sorted(set(BOTH))
    for r in found:
        obey(r, RECORD, r["name"], optional=("counters",))
        obey(r["config"], CONFIG, r["name"])
        assert r["status"] == "ok" and len(r["samples_ms"]) == 6
        threads = r["config"]["threads"]
        assert r["name"] == f"teapot:triangles=3000/160x120/llvmpipe/llvmpipe/top-left/clip/llvmpipe/{threads}"
        assert {k: r["config"][k] for k in ("numeric", "fill", "backend", "schedule", "chunk", "isa", "techniques")} == {
            "numeric": "llvmpipe", "fill": "top-left", "backend": "llvmpipe", "schedule": None, "chunk": None, "isa": "jit",
            "techniques": None}
        assert r["threads_observed"] == threads and r["per_thread"] == []


def test_its_frame_is_one_stage(beside: Path) -> None:
    for r in of_peer(beside):
        assert list(r["stages_ms"]) == STAGES and [s for s in STAGES if r["stages_ms"][s] is not None] == ["raster"]
        for whole, part in zip(r["samples_ms"], r["stages_ms"]["raster"]):
            assert 0 < part <= whole


def test_it_is_verified_by_its_bound(beside: Path) -> None:
    for r in of_peer(beside):
        verify = r["verify"]
        assert verify["conforms"] is None and verify["oracle"] is None and verify["embree"] is None
        assert "llvmpipe" in verify["peer"]["renderer"] and "Mesa" in verify["peer"]["version"]
        truth = verify["end_to_end"]
        assert truth["errors"] == 0 and truth["identical"] > 0.99 * truth["pixels"]
        assert truth["pixels"] == 160 * 120 == sum(truth[k] for k in ("identical", "ambiguous", "edge_ties", "depth_ties", "errors"))
        assert verify["bound"]["bounded"] is True and "256" in verify["bound"]["text"] and verify["bound"]["source"]
        kernel = next(k for k in records(beside) if k["config"]["kernel"] == "tile_parallel" and k["config"]["fill"] == "top-left")
        assert abs(r["work"]["covered_pixels"] - kernel["work"]["covered_pixels"]) <= truth["edge_ties"]
        assert r["work"]["triangles"] == kernel["work"]["triangles"]


def test_it_is_sampled_in_the_blocks_of_the_kernels(beside: Path) -> None:
    blocks = {(r["name"], b) for r in records(beside) for b in r["blocks"]}
    assert all((r["name"], b) in blocks for r in of_peer(beside) for b in range(6))
    order = [e["id"] for e in events(beside, "sample")]
    own = {r["id"] for r in of_peer(beside)}
    switches = sum((a in own) != (b in own) for a, b in zip(order, order[1:]))
    assert switches > 2, "the peer's samples lie together"


def test_the_context_names_its_version(beside: Path) -> None:
    context = json.loads((beside / "context.json").read_text())
    assert "llvmpipe" in context["libraries"]["llvmpipe"] and "Mesa" in context["libraries"]["llvmpipe"]


def test_the_report_calls_it_a_peer(beside: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    subprocess.run([sys.executable, "-m", "analysis", "report", beside, "--out", tmp_path / "report.html"], cwd=ROOT, check=True, capture_output=True)
    page = (tmp_path / "report.html").read_text()
    assert "llvmpipe (peer)" in page


def test_a_study_of_peers_alone(tmp_path: Path, needs_llvmpipe: None) -> None:
    study(tmp_path, sampling(6), peers_only()).ok()
    (r,) = records(tmp_path / "out")
    assert r["status"] == "ok"
    image = read_png(next((tmp_path / "out/images").glob("*.png")))
    assert image.shape == (48, 64, 3) and len({tuple(p) for row in image for p in row}) > 3


def test_it_goes_on_with_resume(tmp_path: Path, needs_llvmpipe: None) -> None:
    study(tmp_path, sampling(6), peers_only()).ok()
    journal = tmp_path / "out/journal.jsonl"
    kept = journal.read_text().splitlines()
    journal.write_text("\n".join(kept[:5]) + "\n")
    study(tmp_path, sampling(6), peers_only(), options=("--resume",)).ok()
    (r,) = records(tmp_path / "out")
    assert len(r["samples_ms"]) == 6 and r["launches"][0] != r["launches"][-1]


def test_more_threads_than_cpus_are_skipped(tmp_path: Path) -> None:
    outcome = study(tmp_path, sampling(6), peers_only(threads=CPUS + 1), options=("--dry-run",)).ok()
    assert "skipped: " in outcome.stdout
    if peer()["available"]:
        assert "needs --oversubscribe" in outcome.stdout


def test_a_machine_without_llvmpipe_is_a_visible_skip(tmp_path: Path, needs_llvmpipe: None) -> None:
    """No EGL vendor: EGL cannot be started. The kernels of the study run all the same."""
    nothing = tmp_path / "nothing.json"
    outcome = study(tmp_path, sampling(6), sweep(peer="llvmpipe", threads=1), __EGL_VENDOR_LIBRARY_FILENAMES=str(nothing)).ok()
    kernel, skipped = records(tmp_path / "out")
    assert kernel["status"] == "ok" and skipped["status"] == "skipped" and "EGL" in skipped["reason"]
    assert skipped["reason"] in outcome.stdout
    (entry,) = json.loads(run("list", "peers", "--json", __EGL_VENDOR_LIBRARY_FILENAMES=str(nothing)).ok().stdout)
    assert entry["available"] is False and "EGL" in entry["reason"]


def test_a_picture_too_large_for_it_is_a_visible_skip(tmp_path: Path, needs_llvmpipe: None) -> None:
    study(tmp_path, sampling(6), peers_only(size="65536x1")).ok()
    (r,) = records(tmp_path / "out")
    assert r["status"] == "skipped" and "pixels a side" in r["reason"]


@pytest.mark.parametrize("table, words", [(peers_only(peer="llvmpip"), ("peer", "did you mean 'llvmpipe'")),
                                          (peers_only(peer=[]), ("peer", "empty")),
                                          (peers_only(peer=3), ("peer", "string")),
                                          ('[[sweep]]\nscene = "teapot"\n', ("kernel", "is missing"))])
def test_bad_peers_are_refused(tmp_path: Path, table: str, words: tuple[str, ...]) -> None:
    refused(study(tmp_path, table), "study.toml:", *words)


def test_a_picture_with_a_peer_stays_in_one_shard(tmp_path: Path) -> None:
    axes = dict(numeric=["f32", "f64", "fixed_8"], fill=["closed", "top-left"])
    both = sweep(**axes), sweep(scene="confetti:triangles=100", **axes)
    refused(study(tmp_path, *both, peers_only(), peers_only(scene="confetti:triangles=100"), options=("--shard", "1/3", "--list")), "--shard", "2 comparisons")
    first = study(tmp_path, *both, peers_only(), peers_only(scene="confetti:triangles=100"), options=("--shard", "1/2", "--list")).ok()
    assert all(line.startswith("teapot") for line in first.stdout.splitlines()) and len(first.stdout.splitlines()) == 7
