"""What a study writes, key by key: harness/records.md."""

from __future__ import annotations

import re
import statistics
from pathlib import Path

import pytest
from scipy.stats import binom

from .program import read_png, sampling, snapshot, sweep
from .studies import ISAS, SMALL, STAGES, Study
from .study_schema import BOUND, CONFIG, CONTEXT, COUNTED, EMBREE, END_TO_END, EVENTS, LIST, MACHINE, ORACLE, RECORD, REJECTED, VERIFY, WORK, obey


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
    untimed = {r["config"]["kernel"] for r in timed if r["loop_ms"] is None}
    assert untimed == {r["config"]["kernel"] for r in timed} & {"bounding_box"}  # a loop for each triangle: more than 64
    for r in timed:
        times = r["samples_ms"]
        assert len(times) == len(r["launches"]) == len(r["blocks"]) == len(r["stages_ms"]["raster"]) >= 6
        assert min(times) > 0 and r["frames_per_sample"] >= 1
        assert r["median_ms"] == pytest.approx(statistics.median(times), rel=1e-12)
        assert r["interval_ms"] == interval(times)
        assert (r["min_ms"], r["max_ms"]) == (min(times), max(times))
        assert r["p95_ms"] == (sorted(times)[-(-95 * len(times) // 100) - 1] if len(times) >= 59 else None)
        for i, total in enumerate(times):  # the loop is a part of its stage, and stages are parts of a sample
            if r["loop_ms"] is not None:
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


def test_same_id_for_the_same_point_and_build(tmp_path: Path, good: Study) -> None:
    again = Study(tmp_path, sampling(), sweep(["tile_parallel"], "serial"), sweep("tile_parallel", "serial", size="65x48"))
    same, other = again.records
    assert same["id"] == good.the(kernel="tile_parallel", backend="serial")["id"] != other["id"]


def test_nothing_but_the_documented_files(study: Study) -> None:
    assert {path.split("/")[0] for path in snapshot(study.folder)} - {".lock"} == {"context.json", "records.jsonl", "journal.jsonl", "images"}
