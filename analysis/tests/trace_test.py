"""Traces: what is read, what is refused, and numbers that follow from a trace made by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import matplotlib.image
import numpy as np
import pytest

from analysis import trace
from analysis.__main__ import main
from analysis.figures.gantt import COLUMNS, covered
from analysis.load import InputError


def made(folder: Path, change: Callable[[dict[str, Any]], None] = lambda value: None, image: bool = False) -> Path:
    """Two threads in a loop from 10 to 110 us: thread 0 is in chunks for 60 + 30 us, thread 1 for 40."""
    def chunk(tid: int, ts: float, dur: float, first: int, last: int) -> dict[str, Any]:
        return {"name": "chunk", "cat": "raster", "ph": "X", "ts": ts, "dur": dur, "pid": 0, "tid": tid, "args": {"first": first, "last": last}}

    value = {"traceEvents": [{"name": "thread_name", "ph": "M", "pid": 0, "tid": 0, "args": {"name": "thread 0"}},
                             chunk(0, 10, 60, 0, 3), chunk(1, 15, 40, 4, 7), chunk(0, 75, 30, 8, 9)],
             "metadata": {"schema": 1, "model": "teapot:triangles=300", "scene": None, "size": [8, 6], "kernel": "tile_parallel", "numeric": "f32",
                          "fill": "closed", "backend": "openmp", "schedule": "dynamic", "chunk": 4, "threads": 2, "tile": 2, "iterations": 10,
                          "unit": "tile", "runtime": "libgomp", "cpu": "A CPU", "frame_us": 200.0, "untraced_frame_us": 150.0, "loops": 1,
                          "loop_begin_us": 10.0, "loop_end_us": 110.0, "loop_us": 100.0, "chunks": 3, "chunks_an_event": 1,
                          "chunks_found_by": "stamps", "git": "abc", "image": None}}
    if image:
        matplotlib.image.imsave(folder / "i.png", np.zeros((6, 8, 3)))
        value["metadata"]["image"] = {"file": "i.png", "unit": "us a tile", "low": 0, "high": 5.0, "map": "viridis", "opacity": 0.7, "shown": 1.0}
    change(value)
    path = folder / "trace.json"
    path.write_text(json.dumps(value))
    return path


def test_time_of_the_threads_adds_up(tmp_path: Path) -> None:
    numbers = trace.threads_table(trace.read(made(tmp_path))).numbers
    assert numbers[["before_us", "chunks_us", "between_us", "after_us"]].values.tolist() == [[0, 90, 5, 5], [5, 40, 0, 55]]
    assert numbers["iterations"].tolist() == [6, 4] and numbers["chunks"].tolist() == [2, 1] and numbers["longest_event_us"].tolist() == [60, 40]


def test_figures_captions_and_words(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["trace", str(made(tmp_path, image=True)), "--out", str(tmp_path / "out")]) == 0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {f"{n}.{k}" for n in ("gantt", "thread_shares", "cost") for k in ("png", "svg", "pdf", "json")} | {"threads.csv", "threads.tex", "captions.txt", ".written.json"}
    captions = (tmp_path / "out/captions.txt").read_text()
    for words in ("no sample", "no interval", "0.200 ms", "0.150 ms", "A CPU", "libgomp", "stamps", "Imbalance (longest / mean time in chunks) 1.385"):
        assert words in captions
    printed = capsys.readouterr().out
    assert "imbalance 1.385" in printed and "65.0 % of 2 x 100.0 us lie in chunks" in printed


def test_the_figures_are_never_written_over_the_image_that_is_read(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    def named(value: dict[str, Any]) -> None:
        value["metadata"]["image"]["file"] = "cost.png"

    path = made(tmp_path, image=True)
    (tmp_path / "i.png").rename(tmp_path / "cost.png")
    value = json.loads(path.read_text())
    named(value)
    path.write_text(json.dumps(value))
    before = (tmp_path / "cost.png").read_bytes()
    assert main(["trace", str(path), "--out", str(tmp_path)]) == 2
    assert "cost.png" in (said := capsys.readouterr().err) and said.count("\n") == 1
    assert sorted(f.name for f in tmp_path.iterdir()) == ["cost.png", "trace.json"]
    assert main(["trace", str(path)]) == 0 and (tmp_path / "figures/cost.png").is_file()
    assert (tmp_path / "cost.png").read_bytes() == before


def test_loops_are_shared_one_by_one(tmp_path: Path) -> None:
    """Thread 0 runs a chunk in both loops, thread 1 in the second alone; 20 us lie between them."""
    def two(value: dict[str, Any]) -> None:
        value["metadata"].update(loops=2, loop_spans_us=[[10.0, 50.0], [70.0, 110.0]], loop_us=80.0)
        value["traceEvents"] = [{"name": "chunk", "ph": "X", "ts": ts, "dur": dur, "tid": tid, "args": {"first": first, "last": first, "loop": loop}}
                                for tid, ts, dur, first, loop in ((0, 15, 30, 0, 0), (0, 72, 20, 0, 1), (1, 75, 35, 1, 1))]

    traced = trace.read(made(tmp_path, two))
    numbers = trace.threads_table(traced).numbers
    assert numbers[["before_us", "chunks_us", "between_us", "after_us", "none_us", "outside_us"]].values.tolist() == [
        [7, 50, 0, 23, 0, 20], [5, 35, 0, 0, 40, 20]]
    trace.write(traced, tmp_path / "out")


def test_a_thread_without_a_chunk_has_a_share_of_its_own(tmp_path: Path) -> None:
    def alone(value: dict[str, Any]) -> None:
        value["traceEvents"] = [e for e in value["traceEvents"] if e["tid"] == 0]

    traced = trace.read(made(tmp_path, alone))
    row = trace.threads_table(traced).numbers.iloc[1]
    assert (row["chunks_us"], row["between_us"], row["before_us"], row["after_us"], row["none_us"]) == (0, 0, 0, 0, 100)
    trace.write(traced, tmp_path / "out")


def test_many_chunks_are_drawn_as_shares_of_columns(tmp_path: Path) -> None:
    low = np.arange(0, 100, 0.02)
    share = covered(low, low + 0.01, 100)
    assert len(share) == COLUMNS and share == pytest.approx(0.5, abs=0.15) and share.mean() == pytest.approx(0.5)

    def many(value: dict[str, Any]) -> None:
        value["traceEvents"] = [{"name": "chunk", "ph": "X", "ts": 10 + 0.02 * i, "dur": 0.01, "tid": 0, "args": {"first": i, "last": i}} for i in range(4000)]
        value["metadata"]["iterations"] = 4000

    trace.write(trace.read(made(tmp_path, many)), tmp_path / "out")
    assert (tmp_path / "out/gantt.png").is_file()


@pytest.mark.parametrize("change, words", [
    (lambda v: v.pop("metadata"), "metadata: expected an object"),
    (lambda v: v["metadata"].update(schema=2), "metadata.schema: is 2"),
    (lambda v: v["metadata"].pop("cpu"), "metadata.cpu"),
    (lambda v: v["metadata"].update(threads=0), "metadata.threads"),
    (lambda v: v["metadata"].update(loop_end_us="x"), "metadata.loop_end_us"),
    (lambda v: v["metadata"].pop("chunk"), "metadata.chunk: missing"),
    (lambda v: v["metadata"].update(chunk="x"), "metadata.chunk"),
    (lambda v: v["metadata"].update(threads=10**6), "metadata.threads: expected a whole number from 1 to 65536"),
    (lambda v: v["metadata"].update(loop_end_us=10.0), "metadata.loop_end_us: is not after"),
    (lambda v: v["metadata"].update(loop_begin_us=12.0), "not within its loop"),
    (lambda v: v["metadata"].update(loop_end_us=104.0), "not within its loop"),
    (lambda v: v["metadata"].update(loops=2), "metadata.loop_spans_us: missing"),
    (lambda v: v["metadata"].update(loops=2, loop_spans_us=[[10, 110]]), "metadata.loop_spans_us: expected"),
    (lambda v: v["metadata"].update(loops=2, loop_spans_us=[[10, 60], [50, 110]]), "metadata.loop_spans_us: expected"),
    (lambda v: v["traceEvents"][1]["args"].update(loop=1), "traceEvents[1].loop"),
    (lambda v: v["traceEvents"][1]["args"].update(first=0.5), "traceEvents[1].first"),
    (lambda v: v["traceEvents"][3]["args"].update(last=10), "traceEvents[3].last"),
    (lambda v: v["traceEvents"][1]["args"].update(chunks=0), "traceEvents[1].args.chunks"),
    (lambda v: v["traceEvents"][1]["args"].update(chunks="x"), "traceEvents[1].args.chunks"),
    (lambda v: v["traceEvents"][1]["args"].update(iterations=5), "traceEvents[1].args.iterations"),
    (lambda v: v.update(traceEvents={}), "traceEvents: expected an array"),
    (lambda v: v.update(traceEvents=[]), "holds no chunk"),
    (lambda v: v["traceEvents"][1].update(tid=2), "traceEvents[1].tid"),
    (lambda v: v["traceEvents"][2].update(dur=-1), "traceEvents[2].dur"),
    (lambda v: v["traceEvents"][1]["args"].update(last=-1), "traceEvents[1].last"),
    (lambda v: v["traceEvents"][3]["args"].update(last=7), "last is below first"),
    (lambda v: v["metadata"].update(image={"file": "none.png", "unit": "us a tile", "low": 0, "high": 1, "map": "viridis", "opacity": 1, "shown": 1}), "no such file"),
    (lambda v: v["metadata"].update(image={"file": "i.png", "unit": "us a tile", "low": 0, "high": 1, "map": "vridis", "opacity": 1, "shown": 1}), "vridis")])
def test_refused(tmp_path: Path, change: Callable[[dict[str, Any]], None], words: str, capsys: pytest.CaptureFixture) -> None:
    path = made(tmp_path, change)
    with pytest.raises(InputError) as error:
        trace.read(path)
    assert words in str(error.value) and str(path) in str(error.value)
    assert main(["trace", str(path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
