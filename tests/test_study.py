"""What a study writes: one study that holds every kind of point, checked against harness/records.md."""

from __future__ import annotations

import csv
import json
import re
import statistics
import subprocess
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import binom

from .program import CPUS, ROOT, TIMEOUT, environment, events, json_lines, program, read_png, records, run, sampling, snapshot, sweep, write_study

Record = dict[str, Any]
STAGES = ["clear", "geometry", "raster", "resolve"]
SMALL = "teapot:triangles=300"
ISAS = [isa["name"] for isa in json.loads(run("list", "isas", "--json").ok().stdout) if isa["available"]]
LIBOMP = any(Path(p).exists() for p in ("/usr/lib/x86_64-linux-gnu/libomp.so.5", "/usr/lib/aarch64-linux-gnu/libomp.so.5",
                                        "/usr/lib64/libomp.so", "/usr/lib/libomp.so"))
OWN_RUNTIME = next(b["runtime"] for b in json.loads(run("list", "backends", "--json").ok().stdout) if b["name"] == "openmp")
needs_both_runtimes = pytest.mark.skipif(not LIBOMP or OWN_RUNTIME != "libgomp", reason="needs a program of gcc's and LLVM's libomp")
needs_two_cpus = pytest.mark.skipif(CPUS < 2, reason="this machine has one CPU")


class Study:
    """A finished study: its folder, exit code and records."""

    def __init__(self, folder: Path, *tables: str, options: tuple[object, ...] = (), **variables: str) -> None:
        self.folder = folder / "out"
        self.outcome = run("study", write_study(folder / "study.toml", 'name = "small"\nquestion = "Does it work?"\nseed = 5', *tables),
                           "--out", self.folder, *options, **variables)
        assert self.outcome.code in (0, 1), self.outcome.stderr
        self.records = records(self.folder)
        self.context = json.loads((self.folder / "context.json").read_text())

    def where(self, **axes: Any) -> list[Record]:
        return [r for r in self.records if all(r["config"][axis] == value for axis, value in axes.items())]

    def the(self, **axes: Any) -> Record:
        (record,) = self.where(**axes)
        return record


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Only points that can run; 60 samples of each, so that there is a 95th percentile."""
    return Study(tmp_path_factory.mktemp("good"), sampling(60),
                 sweep(["tile_parallel", "triangle_atomics", "scanline"], ["serial", "openmp:dynamic,4", "tbb:auto"], threads=[1, min(2, CPUS)]),
                 options=("--benchmark_context=a=b,site=here",))


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Points that run, fail and are skipped, in several environments."""
    many = ["openmp:dynamic", "tbb:auto"]
    return Study(tmp_path_factory.mktemp("mixed"), sampling(6, 8, point_seconds=5),
                 sweep(["tile_parallel", "triangle_atomics"], "serial", numeric=["f32", "f64", "fixed_8"], fill=["closed", "top-left"]),
                 sweep("all_pixels", "serial", scene="confetti:triangles=20000", size="1000x1000"),
                 sweep("row_parallel", "openmp:static", threads=[1, CPUS + 1]),
                 sweep("null", "serial"),
                 sweep("row_parallel", many, threads=1, binding=["close", "spread"]),
                 sweep("row_parallel", many, threads=1, wait_policy=["active", "passive"]),
                 sweep("row_parallel", many, threads=1, runtime="libomp"),
                 sweep("tile_parallel", "serial", near="off", tile=[16, 32]),
                 sweep("scanline", "serial", cache=["warm", "cold"]),
                 sweep("bounding_box", "serial", generality=["minimal", "full"]),
                 sweep(["tile_parallel", "tile_simd"], "serial", numeric="fixed_8", isa=ISAS),
                 sweep(["scanline", "fused_tiles"], "serial", numeric="fixed_8", techniques=["none", "huge_pages+fragments", "all-streaming", "all"]))


@pytest.fixture(params=["good", "mixed"])
def study(request: pytest.FixtureRequest) -> Study:
    return request.getfixturevalue(request.param)


# The schema.

NUMBER, TEXT, LIST, WHOLE = (int, float), str, list, int
NULL = type(None)
CONFIG = {"scene": TEXT, "scene_hash": TEXT, "size": LIST, "kernel": TEXT, "numeric": TEXT, "fill": TEXT, "near": TEXT, "backend": TEXT,
          "schedule": (TEXT, NULL), "chunk": (WHOLE, NULL), "threads": WHOLE, "binding": TEXT, "wait_policy": TEXT, "runtime": TEXT,
          "tile": (WHOLE, NULL), "isa": TEXT, "output": TEXT, "cache": TEXT, "generality": TEXT, "techniques": (TEXT, NULL)}
RECORD = {"schema": WHOLE, "id": TEXT, "name": TEXT, "config": dict, "status": TEXT, "launches": LIST, "blocks": LIST, "frames_per_sample": WHOLE,
          "samples_ms": LIST, "stages_ms": dict, "loop_ms": (LIST, NULL), "median_ms": (*NUMBER, NULL), "interval_ms": (LIST, NULL), "p95_ms": (*NUMBER, NULL),
          "min_ms": (*NUMBER, NULL), "max_ms": (*NUMBER, NULL), "floor_ms": (*NUMBER, NULL), "stop": (TEXT, NULL), "verify": (dict, NULL), "work": (dict, NULL), "hardware": (dict, NULL),
          "threads_observed": (WHOLE, NULL), "runtime_observed": (TEXT, NULL), "per_thread": LIST, "raster_loop": (dict, NULL), "placement": (dict, NULL), "context": TEXT}
PLACEMENT = {"binding": (TEXT, NULL)} | dict.fromkeys(["migrations", "cpus", "cores", "packages", "numa_nodes", "samples_sharing_cpu", "samples_sharing_core"], WHOLE)
NOISE = {"windows": WHOLE, "seconds": NUMBER, "other_load_cpus": (dict, TEXT), "steal_share": (dict, TEXT), "load_average": (dict, TEXT),
         "frequency_mhz": (dict, TEXT), "throttled": (*NUMBER, TEXT), "warnings": LIST, "remarks": LIST}
VERIFY = {"conforms": bool, "checked_against": TEXT, "differing_pixels": WHOLE, "oracle": (dict, NULL), "end_to_end": dict, "embree": dict, "embree_robust": dict,
          "bound": dict}
ORACLE = {"renderer": TEXT, "within_bound": bool, "seconds": NUMBER} | dict.fromkeys(
    ["pixels", "wrong", "false_positives", "false_negatives", "exact_ties", "edge", "depth", "unexplained", "depth_out_of_bound", "unbounded", "predicted",
     "colours_changed", "colours_changed_8", "coverage_fallbacks", "depth_fallbacks"], WHOLE) | dict.fromkeys(
    ["ssim", "worst_distance_px", "max_depth_error_steps", "max_depth_error_world", "silhouette_hausdorff_px", "psnr_db"], (*NUMBER, NULL))
END_TO_END = {"renderer": TEXT, "max_depth_error_steps": (*NUMBER, NULL), "seconds": NUMBER} | dict.fromkeys(
    ["pixels", "identical", "wrong", "ambiguous", "edge_ties", "depth_ties", "unbounded", "errors", "multiprecision_pixels"], WHOLE)
EMBREE = {"version": TEXT, "first_error": (TEXT, NULL), "max_depth_difference": (*NUMBER, NULL), "build_ms": NUMBER, "trace_ms": NUMBER} | dict.fromkeys(
    ["identical", "edge_ties", "depth_ties", "errors"], WHOLE)
BOUND = {"bounded": bool, "text": TEXT, "source": TEXT}
WORK = {"triangles": WHOLE, "drawn": WHOLE, "pieces": WHOLE, "rejected": dict, "near_clipped": WHOLE, "guard_clipped": WHOLE,
        "fragments_tested": WHOLE, "fragments_covered": WHOLE, "covered_pixels": WHOLE, "bytes": WHOLE, "counted": (dict, NULL)}
COUNTED = {"sizes": (dict, NULL), "bytes": dict, "per_thread": (LIST, NULL)} | dict.fromkeys(
    ["samples_in_boxes", "fragments_tested", "edge_tests", "fragments_passed", "covered_pixels", "visible_triangles", "tiles", "tiles_touched",
     "bin_entries", "hidden_entries", "binned_fragments", "merges"], (WHOLE, NULL))
EVENTS = ["cycles", "instructions", "branches", "branch_misses", "l1d_read_misses", "llc_misses", "dtlb_read_misses", "task_clock",
          "context_switches", "page_faults"]
REJECTED = dict.fromkeys(["non_finite", "zero_area", "behind_near", "beyond_far", "off_screen", "back_facing"], WHOLE)
CONTEXT = {"schema": WHOLE, "id": TEXT, "started": TEXT, "finished": TEXT, "program": dict, "libraries": dict, "machine": dict,
           "environment": dict, "study": dict, "region": TEXT, "scenes": dict, "overrides": dict, "custom": dict, "points": dict, "images": dict, "limits": dict, "noise": dict}
MACHINE = {"hostname": TEXT, "cpu": TEXT, "cpus_online": WHOLE, "cpus_allowed": LIST, "cores": WHOLE, "packages": WHOLE, "numa_nodes": WHOLE,
           "smt": bool, "caches": LIST, "topology": LIST, "memory_bytes": WHOLE, "governor": TEXT, "load_average": TEXT, "kernel": TEXT, "virtualisation": TEXT}


def obey(value: dict[str, Any], schema: dict[str, Any], what: str, optional: tuple[str, ...] = ()) -> None:
    assert set(value) - set(optional) == set(schema), what
    for key, kind in schema.items():
        good = isinstance(value[key], kind) and (kind is not WHOLE or not isinstance(value[key], bool))
        assert good, f"{what}: {key} is {value[key]!r}"


def test_records_have_the_documented_keys_and_types(study: Study) -> None:
    for r in study.records:
        obey(r, RECORD, r["name"], optional=("reason", "counters"))
        obey(r["config"], CONFIG, r["name"])
        assert r["schema"] == 1 and re.fullmatch("[0-9a-f]{32}", r["id"]) and re.fullmatch("[0-9a-f]{32}", r["config"]["scene_hash"])
        assert r["context"] == study.context["id"]
        assert ("reason" in r) == (r["status"] != "ok") and r.get("reason") != ""
        assert list(r["stages_ms"]) == STAGES
        if r["verify"] is not None:
            obey(r["verify"], VERIFY, r["name"])
            if r["verify"]["oracle"] is not None:
                obey(r["verify"]["oracle"], ORACLE, r["name"], optional=("wrong_on_snapped", "edge_on_snapped"))
            obey(r["verify"]["end_to_end"], END_TO_END, r["name"])
            for rays in ("embree", "embree_robust"):
                if "skipped" not in r["verify"][rays]:
                    obey(r["verify"][rays], EMBREE, r["name"])
            obey(r["verify"]["bound"], BOUND, r["name"])
            obey(r["work"], WORK, r["name"])
            obey(r["work"]["rejected"], REJECTED, r["name"])
        if r["status"] == "ok":
            obey(r["work"]["counted"], COUNTED, r["name"])
            obey(r["hardware"], {"per_thread": LIST, "least_share": dict, "unavailable": dict}, r["name"])
    assert len({r["id"] for r in study.records}) == len({r["name"] for r in study.records}) == len(study.records)


def test_counters_are_those_of_the_specification(study: Study) -> None:
    counted = [r for r in study.records if r["status"] == "ok"]
    for r in counted:
        work, c = r["work"], r["work"]["counted"]
        if r["config"]["kernel"] == "ray_cast":  # no screen triangles
            assert c["sizes"] is None and c["fragments_tested"] is None
            continue
        assert sum(c["sizes"].values()) == work["pieces"]
        assert c["samples_in_boxes"] == work["fragments_tested"] and c["covered_pixels"] == work["covered_pixels"]
        if c["fragments_passed"] is not None:
            assert c["fragments_passed"] == work["fragments_covered"]
        assert (c["bin_entries"] is None) == (r["config"]["kernel"] not in ("row_parallel", "tile_parallel", "tile_simd", "fused_tiles", "scanline"))
        assert (c["merges"] is None) == (r["config"]["kernel"] != "triangle_private")
        assert c["bytes"]["geometry"]["read"] == 36 * work["triangles"]
    assert any(r["work"]["counted"]["fragments_passed"] is not None for r in counted)


def test_hardware_counters_are_there_or_say_why_not(study: Study) -> None:
    assert any(r["status"] == "ok" for r in study.records)
    for r in study.records:
        if r["status"] == "ok":
            hardware = r["hardware"]
            assert sorted([*hardware["least_share"], *hardware["unavailable"]]) == sorted(EVENTS)
            assert all(reason for reason in hardware["unavailable"].values())
            for thread in hardware["per_thread"]:
                assert list(thread) == EVENTS and any(thread.values())
                assert {event for event, count in thread.items() if count is None} == set(hardware["unavailable"])


def test_config_values(study: Study) -> None:
    for r in study.records:
        c = r["config"]
        assert c["fill"] in ("closed", "top-left") and c["near"] in ("clip", "off") and c["cache"] in ("warm", "cold")
        assert c["output"] == "rgba8+f32" and len(c["size"]) == 2 and all(isinstance(side, int) for side in c["size"])
        assert c["techniques"] is not None  # peers have none, and none runs here
        assert (c["schedule"] is None) == (c["backend"] == "serial") and (c["tile"] is None) == (c["kernel"] not in ("tile_parallel", "tile_simd", "fused_tiles"))
        schedule = c["backend"] + (f":{c['schedule']}" if c["schedule"] else "") + (f",{c['chunk']}" if c["chunk"] else "")
        parts = [c["scene"], f"{c['size'][0]}x{c['size'][1]}", c["kernel"], c["numeric"], c["fill"], c["near"], schedule, str(c["threads"])]
        for key, label, usual in (("binding", "binding", "none"), ("wait_policy", "wait", "default"), ("runtime", "runtime", "default"),
                                  ("tile", "tile", 64), ("cache", "cache", "warm"), ("generality", "generality", "minimal"), ("isa", "isa", ISAS[-1])):
            if c[key] not in (usual, None):
                parts.append(f"{label}:{c[key]}")
        vectors = c["isa"] != "baseline"  # without them there is no streaming
        most = ("all" if vectors else "all-streaming") if c["kernel"] == "fused_tiles" else "streaming+huge_pages" if vectors else "huge_pages"
        if c["techniques"] != most:
            parts.append(f"techniques:{c['techniques']}")
        assert r["name"] == "/".join(parts)


def interval(samples: list[float]) -> list[float] | None:
    """Order statistics k and n+1-k with the largest k that leaves at most 2.5 % on each side."""
    n, k = len(samples), 0
    while binom.cdf(k, n, 0.5) <= 0.025:
        k += 1
    return [sorted(samples)[k - 1], sorted(samples)[n - k]] if k else None


def test_statistics_are_those_of_the_samples(study: Study) -> None:
    timed = [r for r in study.records if r["status"] == "ok"]
    assert timed
    for r in timed:
        times = r["samples_ms"]
        assert len(times) == len(r["launches"]) == len(r["blocks"]) == len(r["stages_ms"]["raster"]) >= 6
        assert min(times) > 0 and r["frames_per_sample"] >= 1
        assert r["median_ms"] == pytest.approx(statistics.median(times), rel=1e-12)
        assert r["interval_ms"] == interval(times)
        assert (r["min_ms"], r["max_ms"]) == (min(times), max(times))
        assert r["p95_ms"] == (sorted(times)[-(-95 * len(times) // 100) - 1] if len(times) >= 59 else None)
        for i, total in enumerate(times):  # the loop is a part of its stage, and stages are parts of a sample
            assert 0 < r["loop_ms"][i] <= r["stages_ms"]["raster"][i] * 1.0001
            assert sum(r["stages_ms"][s][i] for s in STAGES if r["stages_ms"][s] is not None) <= total * 1.0001


def test_points_without_a_verdict_show_no_speed(mixed: Study) -> None:
    untimed = [r for r in mixed.records if r["status"] != "ok"]
    assert {r["status"] for r in untimed} == {"failed", "skipped"}
    for r in untimed:
        assert r["samples_ms"] == r["launches"] == r["blocks"] == r["per_thread"] == []
        assert all(r[key] is None for key in ("median_ms", "interval_ms", "p95_ms", "min_ms", "max_ms", "stop"))
        assert all(not r["stages_ms"][s] for s in STAGES)


def test_good_points_are_verified(study: Study) -> None:
    for r in (r for r in study.records if r["status"] == "ok"):
        v, o, w = r["verify"], r["verify"]["oracle"], r["work"]
        pixels = r["config"]["size"][0] * r["config"]["size"][1]
        assert v["conforms"] and v["differing_pixels"] == 0 and o["within_bound"] and o["unexplained"] == 0
        assert o["pixels"] == v["end_to_end"]["pixels"] == pixels
        assert o["wrong"] == o["exact_ties"] + o["edge"] + o["depth"] + o["unbounded"]
        e = v["end_to_end"]
        assert e["errors"] == 0 and e["identical"] + e["ambiguous"] + e["wrong"] == pixels
        for rays in ("embree", "embree_robust"):
            assert sum(v[rays].get(kind, 0) for kind in ("identical", "edge_ties", "depth_ties", "errors")) in (0, pixels)
        assert 0 < w["drawn"] <= w["triangles"] and w["fragments_tested"] >= w["fragments_covered"] >= w["covered_pixels"] > 100 and w["bytes"] > 0
        assert w["drawn"] + sum(w["rejected"].values()) == w["triangles"]
        assert r["threads_observed"] == r["config"]["threads"] == len(r["per_thread"])
        assert set(r["raster_loop"]) == {"busy_mean_ms", "busy_longest_ms", "imbalance_ms", "outside_ms", "lock_wait_ms", "contended_locks",
                                         "failed_exchanges"} and min(r["raster_loop"].values()) >= 0
        assert r["raster_loop"]["busy_longest_ms"] >= r["raster_loop"]["busy_mean_ms"]
        for worker in r["per_thread"]:
            assert set(worker) == {"busy_ms", "idle_ms", "iterations", "chunks", "failed_exchanges", "contended_locks", "lock_wait_ms", "cpu", "cpus",
                                   "migrations"}
            assert 0 <= worker["lock_wait_ms"] <= worker["busy_ms"] and worker["idle_ms"] >= 0 and 0 <= worker["chunks"] <= worker["iterations"]


def test_context_has_the_documented_keys(study: Study) -> None:
    c = study.context
    obey(c, CONTEXT, "context.json")
    obey(c["machine"], MACHINE, "machine")
    assert {"version", "commit", "dirty", "compiler", "flags", "build_type"} <= set(c["program"]) and c["program"]["fast_math"] is False and isinstance(c["program"]["dirty"], bool)
    assert {"google_benchmark", "tbb", "openmp"} <= set(c["libraries"])
    assert all(set(cache) == {"level", "size_bytes", "shared_by"} for cache in c["machine"]["caches"])
    s = c["study"]
    assert (s["name"], s["question"], s["seed"], s["shard"]) == ("small", "Does it work?", 5, "1/1")
    assert s["text"] == (study.folder.parent / "study.toml").read_text() and s["file"].endswith("study.toml") and s["hash"]
    assert set(s["sampling"]) == {"target", "min_samples", "max_samples", "point_seconds", "launches", "time_limit_s"}
    for key in ("started", "finished"):
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", c[key])
    assert c["started"] <= c["finished"]
    counts = {status: sum(r["status"] == status for r in study.records) for status in ("ok", "skipped", "failed")}
    assert c["points"] == {"planned": len(study.records), "run": counts["ok"], "skipped": counts["skipped"], "failed": counts["failed"]}
    assert study.outcome.code == (1 if counts["failed"] else 0)


def test_custom_context(good: Study, mixed: Study) -> None:
    assert good.context["custom"] == {"a": "b", "site": "here"} and mixed.context["custom"] == {}


def test_pictures_of_the_scenes(study: Study) -> None:
    for scene, file in study.context["images"].items():
        assert scene == SMALL
        image = read_png(study.folder / file)
        assert image.shape == (48, 64, 3) and image.std() > 10
    assert len(study.context["images"]) == 1


# Order and completeness of the journal.

def test_blocks_are_complete_and_in_random_order(study: Study) -> None:
    """In each block every point that is not finished has exactly one sample; finished ones only as bases of others."""
    timed = {r["id"]: r for r in study.records if r["status"] == "ok"}
    finished: set[str] = set()
    orders: list[list[str]] = []
    journal = [e for e in json_lines(study.folder / "journal.jsonl") if e["event"] in ("sample", "stop")]
    for kind, group in groupby(journal, key=lambda e: (e["event"], e.get("block"))):
        ids = [e["id"] for e in group]
        if kind[0] == "stop":
            finished.update(ids)
            continue
        assert kind[1] == len(orders), "blocks are numbered in order and not interleaved"
        assert len(ids) == len(set(ids)), "a point twice in a block"
        assert set(timed) - finished <= set(ids), "an open point was left out"
        for extra in set(ids) & finished:
            assert timed[extra]["config"]["threads"] == 1
        orders.append(ids)
    assert finished == set(timed)
    assert len({tuple(order) for order in orders}) > len(orders) / 2
    assert len({order[0] for order in orders}) > 2


def test_records_repeat_the_journal(study: Study) -> None:
    taken: dict[str, list[Record]] = {}
    for e in events(study.folder, "sample"):
        taken.setdefault(e["id"], []).append(e)
    for r in (r for r in study.records if r["status"] == "ok"):
        mine = taken[r["id"]]
        assert [e["answer"]["ms"] for e in mine] == r["samples_ms"] and [e["block"] for e in mine] == r["blocks"]
        assert [e["launch"] for e in mine] == r["launches"]
        (stop,) = [e["reason"] for e in events(study.folder, "stop") if e["id"] == r["id"]]
        assert stop == r["stop"]


def test_stopping(good: Study, mixed: Study) -> None:
    assert all(r["stop"] in ("target", "max_samples") and len(r["samples_ms"]) == 60 for r in good.records)
    for r in (r for r in mixed.records if r["status"] == "ok"):
        assert r["stop"] in ("target", "max_samples") and 6 <= len(r["samples_ms"])


# What fails and what is skipped.

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


def test_other_openmp_runtime(mixed: Study) -> None:
    r = mixed.the(runtime="libomp", backend="openmp")
    assert r["status"] == ("ok" if LIBOMP else "skipped")
    assert LIBOMP or "libomp" in r["reason"]


@pytest.fixture(scope="module")
def runtimes(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Both runtimes by name, beside what has no part in them."""
    return Study(tmp_path_factory.mktemp("runtimes"), sampling(6, launches=2),
                 sweep("row_parallel", ["openmp:static", "openmp:guided,1"], threads=[min(2, CPUS)], runtime=["libgomp", "libomp"]),
                 sweep("row_parallel", ["serial", "tbb:auto"], threads=[1]))


@needs_both_runtimes
def test_records_say_which_runtime_was_observed(runtimes: Study) -> None:
    assert runtimes.outcome.code == 0
    for r in runtimes.where(backend="openmp"):
        assert r["status"] == "ok" and r["runtime_observed"] == r["config"]["runtime"]
        assert r["name"].endswith(f"/runtime:{r['config']['runtime']}")
    assert {r["runtime_observed"] for r in runtimes.where(backend="openmp")} == {"libgomp", "libomp"}
    assert {r["runtime_observed"] for r in runtimes.records if r["config"]["backend"] != "openmp"} == {None}


@needs_both_runtimes
def test_a_report_tells_the_runtimes_apart(runtimes: Study) -> None:
    for command in ("table", "report"):
        done = subprocess.run([str(ROOT / "scripts/python"), "-m", "analysis", command, str(runtimes.folder)], env=environment(),
                              capture_output=True, text=True, timeout=TIMEOUT, check=False)
        assert done.returncode == 0, done.stderr
        (table,) = (runtimes.folder / "tables").glob("points_*.tex") if command == "report" else [None]
        said = done.stdout if table is None else table.read_text()
        for schedule in ("static", "guided,1"):
            for runtime in ("libgomp", "libomp"):
                assert re.search(f"{schedule}.* runtime {runtime}", said), said
    (numbers,) = (runtimes.folder / "tables").glob("points_*.csv")
    with numbers.open() as file:
        rows = [row for row in csv.DictReader(file) if row["backend"] == "openmp"]
    assert len(rows) == 4 and all(row["runtime"] == row["runtime_observed"] for row in rows)


@needs_both_runtimes
@pytest.mark.parametrize("instead", ["libgomp", "nothing"])
def test_a_runtime_that_was_not_observed_fails_the_point(instead: str, tmp_path: Path) -> None:
    """RASTERBENCH_LIBOMP names a file that is not LLVM's runtime, or none: what runs is libgomp, whatever was asked for."""
    (library,) = re.findall(r"libgomp\S* => (\S+)", subprocess.run(["ldd", program()], capture_output=True, text=True, check=True).stdout)
    study = Study(tmp_path, sampling(), sweep("row_parallel", "openmp:static", threads=1, runtime=["libgomp", "libomp"]),
                  RASTERBENCH_LIBOMP=library if instead == "libgomp" else str(tmp_path / "none.so"))
    assert study.outcome.code == 1 and study.the(runtime="libgomp")["status"] == "ok"
    r = study.the(runtime="libomp")
    assert r["status"] == "failed" and r["reason"] == "libomp was asked for, libgomp ran the loops"
    assert r["samples_ms"] == [] and r["median_ms"] is None


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


# Where threads run.

def places_of_cores(context: dict[str, Any]) -> list[set[int]]:
    """The allowed CPUs of each core, in the order of the cores."""
    allowed, cores = set(context["machine"]["cpus_allowed"]), {}
    for place in context["machine"]["topology"]:
        if place["cpu"] in allowed:
            cores.setdefault(place["core"], set()).add(place["cpu"])
    return [cores[core] for core in sorted(cores)]


def test_topology_has_every_allowed_cpu(good: Study) -> None:
    machine = good.context["machine"]
    assert set(machine["cpus_allowed"]) <= {place["cpu"] for place in machine["topology"]}
    assert all(set(place) == {"cpu", "core", "package", "numa_node"} for place in machine["topology"])
    assert len({place["core"] for place in machine["topology"]}) == machine["cores"]


def test_every_sample_says_where_its_threads_were(study: Study) -> None:
    allowed = set(study.context["machine"]["cpus_allowed"])
    for r in study.records:
        if r["status"] != "ok":
            assert r["placement"] is None
            continue
        obey(r["placement"], PLACEMENT, r["name"])
        seen: set[int] = set()
        for thread in r["per_thread"]:
            cpus = set(map(int, thread["cpus"]))
            assert cpus <= allowed and all(1 <= n <= len(r["samples_ms"]) for n in thread["cpus"].values())
            assert thread["migrations"] >= len(cpus) - len(set(r["launches"]))  # a launch begins anywhere
            seen |= cpus
        assert r["placement"]["cpus"] == len(seen)
        assert r["placement"]["migrations"] == sum(thread["migrations"] for thread in r["per_thread"])
        assert r["placement"]["samples_sharing_cpu"] <= r["placement"]["samples_sharing_core"] <= len(r["samples_ms"])
        bound = r["config"]["binding"] != "none" and r["config"]["backend"] != "serial"
        assert r["placement"]["binding"] == ("kept" if bound else None)


@needs_two_cpus
@pytest.mark.parametrize("binding", ["close", "spread"])
def test_bound_threads_stay_in_their_places(tmp_path: Path, binding: str) -> None:
    """Under OpenMP as under oneTBB, whose binding is this program's own."""
    study = Study(tmp_path, sampling(8, launches=2), sweep("row_parallel", ["openmp:dynamic", "tbb:auto", "tbb:affinity"], threads=2, binding=binding))
    places = places_of_cores(study.context)
    expected = [0, 1 if binding == "close" else len(places) // 2] if len(places) > 1 else [0, 0]
    assert [r["status"] for r in study.records] == ["ok"] * 3, [r.get("reason") for r in study.records]
    for r in study.records:
        assert r["placement"]["binding"] == "kept" and r["threads_observed"] == 2
        for place, thread in zip(expected, r["per_thread"]):
            if thread["cpus"]:  # a worker of oneTBB that came too late for every loop was never seen
                assert set(map(int, thread["cpus"])) <= places[place]
        if len(places) > 1:
            assert r["placement"]["samples_sharing_core"] == 0


@needs_two_cpus
def test_a_binding_that_is_not_kept_fails(tmp_path: Path) -> None:
    """Threads that are told to bind and are moved on by somebody else: a library that frees them again."""
    source, library = tmp_path / "free.c", tmp_path / "free.so"
    source.write_text("""#define _GNU_SOURCE
#include <dlfcn.h>
#include <sched.h>
#include <unistd.h>
/* Every look moves the thread to the other CPU: 0, 1, 0, ... */
int sched_getcpu(void) { static __thread int looks; return looks++ % 2; }
""")
    compiled = subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], capture_output=True)
    if compiled.returncode != 0:
        pytest.skip("no C compiler")
    study = Study(tmp_path, sampling(), sweep("row_parallel", ["serial", "openmp:static"], threads=1, binding=["none", "close"]), LD_PRELOAD=str(library))
    places = places_of_cores(study.context)
    if any({0, 1} <= place for place in places):
        pytest.skip("CPUs 0 and 1 are one core")
    assert study.outcome.code == 1
    broken = study.the(backend="openmp", binding="close")
    assert broken["status"] == "failed" and "binding close was not kept: thread 0" in broken["reason"] and broken["placement"] is None
    free = study.the(backend="openmp", binding="none")
    assert free["status"] == "ok" and free["placement"]["binding"] is None and free["placement"]["migrations"] > 10


def test_two_threads_on_one_cpu_are_labelled(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(), sweep("row_parallel", "openmp:static", threads=CPUS + 1), options=("--oversubscribe",))
    (r,) = study.records
    assert r["placement"]["samples_sharing_cpu"] == len(r["samples_ms"])


# Noise.

def test_noise_is_watched(study: Study) -> None:
    noise = study.context["noise"]
    obey(noise, NOISE, "noise")
    windows = events(study.folder, "noise")
    assert noise["windows"] == len(windows) >= 1
    assert noise["seconds"] == pytest.approx(sum(w["seconds"] for w in windows))
    blocks = max(b for r in study.records for b in r["blocks"])
    spans = [w["blocks"] for w in windows]
    assert spans[0][0] == 0 and spans[-1][1] <= blocks and all(a[1] + 1 == b[0] for a, b in zip(spans, spans[1:]))
    for key in ("other_load_cpus", "steal_share", "load_average"):
        values = [w[key] for w in windows]
        assert noise[key]["median"] == pytest.approx(statistics.median(values)) and noise[key]["worst"] == max(values)
    assert all(0 <= w["steal_share"] <= 1 and 0 <= w["other_load_cpus"] for w in windows)
    said = [line for line in study.outcome.errors if line.startswith("noisy machine: ")]
    assert len(said) == bool(noise["warnings"]) and all(warning in said[0] for warning in noise["warnings"])


@needs_two_cpus
def test_other_load_is_seen_and_ones_own_is_not(tmp_path: Path) -> None:
    """Beside a program that spins; and beside none, where this machine allows to tell."""
    for name in ("quiet", "loud"):
        (tmp_path / name).mkdir()
    quiet = Study(tmp_path / "quiet", sampling(400), sweep("row_parallel", "openmp:static", threads=1, size="400x300"), options=("--time-limit", 2))
    other = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        loud = Study(tmp_path / "loud", sampling(400), sweep("row_parallel", "openmp:static", threads=1, size="400x300"), options=("--time-limit", 2))
    finally:
        other.kill()
        other.wait()
    noise = loud.context["noise"]
    assert noise["other_load_cpus"]["median"] > 0.3 and any("other programs kept" in warning for warning in noise["warnings"])
    assert any(line.startswith("noisy machine: other programs kept") for line in loud.outcome.errors)
    # The study alone keeps a CPU busy: were it counted, this would be above 0.8 on a machine without any other load.
    if quiet.context["noise"]["load_average"]["worst"] < 0.5:
        assert quiet.context["noise"]["other_load_cpus"]["median"] < 0.3


def test_unbound_threads_are_a_remark(good: Study) -> None:
    assert len(good.context["noise"]["remarks"]) == (CPUS > 1)


def test_launches_alternate(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(8, launches=2), sweep("row_parallel", ["serial", "openmp:static"], threads=1, binding=["none", "close"]))
    assert study.outcome.code == 0
    for r in (r for r in study.records if r["status"] == "ok"):
        assert r["blocks"] == list(range(8)) and r["launches"] == [0, 1] * 4


def test_time_limit_leaves_at_least_one_sample(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(5000), sweep("row_parallel", ["serial", "openmp:static"], size="400x300", threads=1), options=("--time-limit", 1))
    assert study.outcome.code == 0
    for r in study.records:
        assert (r["status"], r["stop"]) == ("ok", "time_limit") and 1 <= len(r["samples_ms"]) < 5000


def test_study_runs_on_other_scenes_and_sizes(tmp_path: Path) -> None:
    run("scene", "terrain:triangles=500", "-o", tmp_path / "land.dat", "--parameters", tmp_path / "view.txt").ok()
    study = Study(tmp_path, sampling(), sweep(), options=("--scene", f"{tmp_path}/land.dat@{tmp_path}/view.txt", "--size", "50x40", "--size", "40x30"))
    assert [(r["config"]["scene"], r["config"]["size"]) for r in study.records] == [("land@view", [50, 40]), ("land@view", [40, 30])]


def test_models_lie_beside_the_study_file(tmp_path: Path) -> None:
    for name in ("land", "view"):
        run("scene", "terrain:triangles=500", "-o", tmp_path / f"{name}.dat", "--parameters", tmp_path / f"{name}.txt").ok()
    study = Study(tmp_path, sampling(), sweep(scene=["land.dat@land.txt", "land.dat@view.txt", "view.dat"]))
    assert [r["config"]["scene"] for r in study.records] == ["land", "land@view", "view"]
    assert len({r["config"]["scene_hash"] for r in study.where(scene="land") + study.where(scene="land@view")}) == 1


def test_named_scenes_have_a_picture_each(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(), '[[sweep]]\nsize = "64x48"\nkernel = "tile_parallel"\nexecution = "serial"\n'
                  'scene = [{name = "a b", model = "teapot:triangles=300"}, {name = "a_b", model = "terrain:triangles=500"}]')
    images = study.context["images"]
    assert set(images) == {"a b", "a_b"} == {r["config"]["scene"] for r in study.records}
    assert (study.folder / images["a b"]).read_bytes() != (study.folder / images["a_b"]).read_bytes()


def test_same_id_for_the_same_point_and_build(tmp_path: Path, good: Study) -> None:
    again = Study(tmp_path, sampling(), sweep(["tile_parallel"], "serial"), sweep("tile_parallel", "serial", size="65x48"))
    same, other = again.records
    assert same["id"] == good.the(kernel="tile_parallel", backend="serial")["id"] != other["id"]


def test_nothing_but_the_documented_files(study: Study) -> None:
    assert {path.split("/")[0] for path in snapshot(study.folder)} - {".lock"} == {"context.json", "records.jsonl", "journal.jsonl", "images"}
