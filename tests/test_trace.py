"""`rasterbench trace`: a file that Perfetto opens and that holds every iteration once, the costs, the heat map, and what is refused."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from analysis import loop_costs
from analysis import trace as analysis_trace

from .program import CPUS, ROOT, Parameters, read_png, refused, run

SIZE = ("--size", "128x96")
THREADS = min(2, CPUS)
METADATA = {"schema", "model", "scene", "size", "kernel", "numeric", "fill", "backend", "schedule", "chunk", "threads", "tile", "iterations", "unit",
            "runtime", "cpu", "frame_us", "untraced_frame_us", "loops", "loop_begin_us", "loop_end_us", "loop_us", "loop_spans_us", "chunks", "chunks_an_event",
            "chunks_found_by", "git", "image"}
COSTS = {"schema", "model", "scene_hash", "fill", "near", "isa", "techniques", "generality", "unit", "iterations", "iterations_a_cost", "columns", "tile", "size", "kernel", "numeric", "schedule", "threads", "cost_us", "stamp_us",
         "serial_us", "dispatch_us", "steal_us", "start_us", "cpu", "runtime"}


def chunks(trace: dict[str, Any]) -> list[dict[str, Any]]:
    return [event for event in trace["traceEvents"] if event["ph"] == "X"]


def check(trace: dict[str, Any], iterations: int) -> None:
    """Every iteration in one chunk, chunks of a thread one after the other, all within the loop."""
    metadata = trace["metadata"]
    assert set(metadata) == METADATA and metadata["iterations"] == iterations
    names = [event for event in trace["traceEvents"] if event["ph"] == "M"]
    assert [(e["name"], e["tid"]) for e in names] == [("thread_name", t) for t in range(metadata["threads"])]
    seen = [0] * iterations
    ends = [metadata["loop_begin_us"]] * metadata["threads"]
    for event in chunks(trace):
        assert set(event) == {"name", "cat", "ph", "ts", "dur", "pid", "tid", "args"} and event["name"] == "chunk" and event["cat"] == "raster"
        assert ends[event["tid"]] <= event["ts"] + 0.002
        ends[event["tid"]] = event["ts"] + event["dur"]
        for i in range(event["args"]["first"], event["args"]["last"] + 1):
            seen[i] += 1
    assert seen == [1] * iterations
    assert max(ends) <= metadata["loop_end_us"] + 0.002
    assert metadata["chunks"] == len(chunks(trace))


@pytest.mark.parametrize("kernel, numeric, unit, columns, iterations", [
    ("row_parallel", "f32", "row", 1, 96), ("tile_parallel", "f32", "tile", 4, 12), ("scanline", "f32", "row", 1, 6),
    ("fused_tiles", "fixed_8", "tile", 4, 12), ("triangle_atomics", "f32", "triangle", 1, None), ("all_pixels", "f32", "pixel", 128, 128 * 96)])
def test_trace_costs_and_image(tmp_path: Path, kernel: str, numeric: str, unit: str, columns: int, iterations: int | None) -> None:
    outcome = run("trace", "teapot:triangles=300", *SIZE, "--kernel", kernel, "--numeric", numeric, "--schedule", "dynamic", "--chunk", 3, "--threads", THREADS,
                  "--tile", 32, "--frames", 3, "-o", "t.json", "--costs", "c.json", "--image", "i.png", cwd=tmp_path).ok()
    assert f"openmp:dynamic,3/{THREADS}" in outcome.stdout and "wrote t.json" in outcome.stdout
    trace = json.loads((tmp_path / "t.json").read_text())
    costs = json.loads((tmp_path / "c.json").read_text())
    iterations = iterations or costs["iterations"]
    check(trace, iterations)
    assert all(event["args"]["first"] % 3 == 0 for event in chunks(trace))
    metadata = trace["metadata"]
    assert (metadata["kernel"], metadata["unit"], metadata["schedule"], metadata["chunk"], metadata["scene"]) == (kernel, unit, "dynamic", 3, None)
    assert metadata["tile"] == (32 if unit == "tile" else None) and metadata["image"]["file"] == "i.png"
    assert set(costs) == COSTS and len(costs["cost_us"]) == costs["iterations"] == iterations and costs["iterations_a_cost"] == 1
    assert (costs["unit"], costs["columns"], costs["tile"], costs["size"]) == (unit, columns, metadata["tile"], [128, 96])
    assert min(costs["cost_us"]) >= 0 < max(costs["cost_us"]) and costs["serial_us"] > 0 < costs["stamp_us"]
    assert {"openmp:static", "openmp:dynamic,1", "openmp:guided,1"} <= set(costs["dispatch_us"]) == set(costs["start_us"])
    assert read_png(tmp_path / "i.png").shape[:2] == (96, 128)


def test_every_backend_and_schedule(tmp_path: Path) -> None:
    for row in json.loads(run("list", "schedules", "--json").ok().stdout):
        backend, _, schedule = row["name"].partition(":")
        options = ("--schedule", schedule) if schedule else ()
        run("trace", "teapot:triangles=300", *SIZE, "--kernel", "row_parallel", "--backend", backend, *options, "--threads", THREADS if schedule else 1,
            "--frames", 1, "-o", "t.json", cwd=tmp_path).ok()
        trace = json.loads((tmp_path / "t.json").read_text())
        check(trace, 96)
        assert trace["metadata"]["backend"] == backend and trace["metadata"]["image"] is None


def test_a_loop_for_each_triangle_is_traced_and_has_no_costs(tmp_path: Path) -> None:
    arguments = ("trace", "teapot:triangles=300", *SIZE, "--kernel", "bounding_box", "--frames", 1, "-o", tmp_path / "t.json")
    run(*arguments).ok()
    trace = json.loads((tmp_path / "t.json").read_text())
    assert trace["metadata"]["loops"] > 1 and {event["args"]["loop"] for event in chunks(trace)} == set(range(trace["metadata"]["loops"]))
    spans = trace["metadata"]["loop_spans_us"]
    assert len(spans) == trace["metadata"]["loops"]
    for event in chunks(trace):
        begin, end = spans[event["args"]["loop"]]
        assert begin - 0.002 <= event["ts"] and event["ts"] + event["dur"] <= end + 0.002
    table = analysis_trace.threads_table(analysis_trace.read(tmp_path / "t.json")).numbers
    assert table[[f"{name}_us" for name in analysis_trace.SHARES]].sum(axis=1).to_list() == pytest.approx([spans[-1][1] - spans[0][0]] * len(table), abs=1)
    refused(run(*arguments, "--costs", tmp_path / "c.json"), "--costs")
    assert not (tmp_path / "c.json").exists()


@pytest.mark.parametrize("arguments, what", [
    (("m.dat", "-o", "m.dat"), "MODEL"), (("m.dat", "s.txt", "-o", "s.txt"), "SCENE"), (("m.dat", "-o", "t.json", "--costs", "./t.json"), "--output"),
    (("m.dat", "--costs", "a.png", "--image", "folder/../a.png"), "--costs"), (("m.dat", "--costs", "link.json"), "MODEL")])
def test_files_that_would_be_written_over_are_refused_before_anything_is(tmp_path: Path, arguments: tuple, what: str) -> None:
    (tmp_path / "folder").mkdir()
    for name in ("m.dat", "s.txt"):
        (tmp_path / name).write_text("kept")
    (tmp_path / "link.json").symlink_to("m.dat")
    refused(run("trace", *arguments, *SIZE, cwd=tmp_path), f"is the file of {what}, too")
    assert {path.name for path in tmp_path.iterdir()} == {"folder", "m.dat", "s.txt", "link.json"}
    assert (tmp_path / "m.dat").read_text() == (tmp_path / "s.txt").read_text() == "kept"


def test_more_threads_than_iterations_and_a_picture_without_triangles(tmp_path: Path) -> None:
    run("trace", "teapot:triangles=300", "--size", "64x32", "--kernel", "scanline", "--threads", THREADS, "--frames", 15, "-o", "t.json", cwd=tmp_path).ok()
    trace = json.loads((tmp_path / "t.json").read_text())
    check(trace, 2)
    Parameters(camera=(1000.0, 2.0, 4.0), near=0.5, far=0.6).write(tmp_path / "away.txt")
    for kernel in ("row_parallel", "bounding_box", "triangle_atomics"):
        done = run("trace", "teapot:triangles=300", tmp_path / "away.txt", *SIZE, "--kernel", kernel, "--frames", 1, "-o", "t.json", cwd=tmp_path)
        if done.code == 0:
            analysis_trace.read(tmp_path / "t.json")
        else:  # no visible triangle, no loop
            assert kernel == "bounding_box" and "no loop to trace" in done.stderr


@pytest.mark.parametrize("arguments, words", [
    (("--kernel", "row_paralel"), "row_parallel"),
    (("--schedule", "dynamic,2", "--chunk", 3), "--chunk"),
    (("--schedule", "auto", "--chunk", 3), "chunk"),
    (("--kernel", "tile_simd", "--numeric", "f32"), "--kernel"),
    (("--frames", 0), "--frames"),
    (("--image", "i.bmp"), "i.bmp"),
    (("-o", "nowhere/t.json"), "nowhere")])
def test_refused(tmp_path: Path, arguments: tuple, words: str) -> None:
    refused(run("trace", "teapot:triangles=300", *SIZE, *arguments, cwd=tmp_path), words)
    assert list(tmp_path.iterdir()) == []


def test_costs_can_be_compared_with_a_study_of_the_same_loop(tmp_path: Path) -> None:
    """Each axis that whatif matches is the one that a record of the same point has."""
    run("trace", "teapot:triangles=300", *SIZE, "--kernel", "row_parallel", "--threads", 1, "--frames", 1, "-o", "t.json", "--costs", "c.json", cwd=tmp_path).ok()
    costs = loop_costs.read(tmp_path / "c.json")
    assert all(costs.axes.values()) and set(costs.axes) == set(loop_costs.AXES)


def test_figures_of_a_trace(tmp_path: Path) -> None:
    run("trace", "teapot:triangles=300", *SIZE, "--kernel", "tile_parallel", "--frames", 3, "-o", "t.json", "--image", "i.png", cwd=tmp_path).ok()
    done = subprocess.run([ROOT / "scripts/python", "-m", "analysis", "trace", tmp_path / "t.json", "--out", tmp_path / "out"], cwd=ROOT, capture_output=True,
                          text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert {f"{name}.{kind}" for name in ("gantt", "thread_shares", "cost") for kind in ("png", "svg", "pdf")} <= {p.name for p in (tmp_path / "out").iterdir()}
