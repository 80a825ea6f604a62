"""A traced frame (`rasterbench trace`): who ran which chunk when, and where on the screen the time went.

Reads trace.json (harness/records.md, "rasterbench trace") and the heat map that it names. A traced frame is never a sample: its stamps
take time of their own, so that it says how a loop was dealt and not how fast it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.image import imread

from . import load, sidecars, style, text, writing
from .load import InputError, is_thread_count, is_whole
from .statistics.numbers import is_number
from .tables import Table

SHARES = {"before": "before the first chunk", "chunks": "in chunks", "between": "between chunks: handing out, and the trace's stamps",
          "after": "after the last chunk: waiting for the others", "none": "loops without a chunk of the thread", "outside": "between loops"}
ROUNDING = 0.01  # microseconds: stamps in the file have three digits behind the point


@dataclass(frozen=True)
class CostImage:
    path: Path
    pixels: np.ndarray  # as imread gives them
    unit: str
    low: float
    high: float
    map: str
    opacity: float
    shown: float  # share of the cost that lies on the picture


@dataclass(frozen=True)
class Trace:
    path: Path
    metadata: dict[str, Any]
    chunks: pd.DataFrame  # thread, begin, end (us from the frame's begin), first, last, iterations, loop, chunks
    image: CostImage | None

    @property
    def threads(self) -> int:
        return int(self.metadata["threads"])

    @property
    def span(self) -> tuple[float, float]:
        """From the begin of the first loop to the end of the last one, us."""
        return float(self.metadata["loop_begin_us"]), float(self.metadata["loop_end_us"])

    @property
    def loops(self) -> np.ndarray:
        """Begin and end of each loop, us."""
        return np.array(self.metadata.get("loop_spans_us") or [self.span], dtype=float)

    @property
    def execution(self) -> str:
        m = self.metadata
        chunk = "" if m["chunk"] is None else f",{m['chunk']}"
        return m["backend"] if m["schedule"] is None else f"{m['backend']}:{m['schedule']}{chunk}"

    @property
    def title(self) -> str:
        m = self.metadata
        return f"{m['kernel']}, {m['numeric']}, {self.execution}, {text.count(self.threads, 'thread')}, {m['model']}"

    @property
    def machine(self) -> str:
        return f"{self.metadata['cpu']}, {self.metadata['runtime']}"


def read(path: Path) -> Trace:
    value = load.parse(load.read_text(path, "no such file"), path, None)
    metadata = value.get("metadata")
    if not isinstance(metadata, dict):
        raise InputError(path, "expected an object", None, "metadata")
    if metadata.get("schema") != load.SCHEMA:
        raise InputError(path, f"is {metadata.get('schema')!r}, this program reads {load.SCHEMA}", None, "metadata.schema")
    for key in ("model", "kernel", "numeric", "backend", "unit", "runtime", "cpu", "chunks_found_by"):
        if not isinstance(metadata.get(key), str):
            raise InputError(path, "expected text", None, f"metadata.{key}")
    for key in ("loops", "iterations"):
        if not is_whole(metadata.get(key)):
            raise InputError(path, "expected a whole number above 0", None, f"metadata.{key}")
    if not is_thread_count(metadata.get("threads")):
        raise InputError(path, f"expected a whole number from 1 to {load.MOST_THREADS}", None, "metadata.threads")
    for key in ("frame_us", "untraced_frame_us", "loop_begin_us", "loop_end_us", "loop_us"):
        if not (is_number(metadata.get(key)) and metadata[key] >= 0):
            raise InputError(path, "expected a number that is not below 0", None, f"metadata.{key}")
    for key in ("schedule", "chunk"):
        if key not in metadata:
            raise InputError(path, "missing", None, f"metadata.{key}")
    if metadata["loop_end_us"] <= metadata["loop_begin_us"]:
        raise InputError(path, "is not after loop_begin_us", None, "metadata.loop_end_us")
    if not (metadata["chunk"] is None or is_whole(metadata["chunk"])):
        raise InputError(path, "expected a whole number above 0 or null", None, "metadata.chunk")
    if not (metadata["schedule"] is None or isinstance(metadata["schedule"], str)):
        raise InputError(path, "expected text or null", None, "metadata.schedule")
    _check_loops(path, metadata)
    found = Trace(path, metadata, _chunks(path, value.get("traceEvents"), metadata), _image(path, metadata.get("image")))
    outside = _outside(found)
    if outside is not None:
        raise InputError(path, f"holds a chunk of thread {outside} that is not within its loop", None, "traceEvents")
    return found


def _check_loops(path: Path, metadata: dict[str, Any]) -> None:
    spans = metadata.get("loop_spans_us")
    if spans is None and metadata["loops"] == 1:
        return
    if spans is None:
        raise InputError(path, "missing: a trace of several loops by an older version, trace again", None, "metadata.loop_spans_us")
    good = isinstance(spans, list) and len(spans) == metadata["loops"] and all(
        isinstance(span, list) and len(span) == 2 and all(map(is_number, span)) and span[0] <= span[1] for span in spans)
    if not good or any(before[1] > after[0] + ROUNDING for before, after in zip(spans, spans[1:])) or not (
            abs(spans[0][0] - metadata["loop_begin_us"]) <= ROUNDING and abs(spans[-1][1] - metadata["loop_end_us"]) <= ROUNDING):
        raise InputError(path, f"expected [begin, end] of {metadata['loops']} loops in order, from loop_begin_us to loop_end_us", None,
                         "metadata.loop_spans_us")


def _outside(trace: Trace) -> int | None:
    """The thread of the first chunk that is not within its loop."""
    chunks, spans = trace.chunks, trace.loops[trace.chunks["loop"].to_numpy()]
    bad = (chunks["begin"].to_numpy() < spans[:, 0] - ROUNDING) | (chunks["end"].to_numpy() > spans[:, 1] + ROUNDING)
    return int(chunks["thread"].to_numpy()[bad][0]) if bad.any() else None


def _chunks(path: Path, events: Any, metadata: dict[str, Any]) -> pd.DataFrame:
    threads, loops, iterations = (metadata[key] for key in ("threads", "loops", "iterations"))
    if not isinstance(events, list):
        raise InputError(path, "expected an array", None, "traceEvents")
    rows = []
    for index, event in enumerate(events):
        place = f"traceEvents[{index}]"
        if not isinstance(event, dict):
            raise InputError(path, "expected an object", None, place)
        if event.get("ph") != "X" or event.get("name") != "chunk":
            continue
        arguments = event.get("args")
        if not isinstance(arguments, dict):
            raise InputError(path, "expected an object", None, f"{place}.args")
        numbers = {"ts": event.get("ts"), "dur": event.get("dur"), "tid": event.get("tid"), "first": arguments.get("first"),
                   "last": arguments.get("last")}
        for key, number in numbers.items():
            if not is_number(number) or number < 0:
                raise InputError(path, f"expected a number that is not below 0, found {number!r}", None, f"{place}.{key}")
        if not (isinstance(numbers["tid"], int) and numbers["tid"] < threads):
            raise InputError(path, f"is {numbers['tid']!r}, there are {text.count(threads, 'thread')}", None, f"{place}.tid")
        whole = {key: arguments.get(key, standard) for key, standard in (("first", None), ("last", None), ("loop", 0))}
        for key, number in whole.items():
            if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < (loops if key == "loop" else iterations):
                raise InputError(path, f"is {number!r}, there are {loops if key == 'loop' else iterations}", None, f"{place}.{key}")
        if numbers["last"] < numbers["first"]:
            raise InputError(path, "last is below first", None, f"{place}.args")
        many = {"iterations": arguments.get("iterations", numbers["last"] - numbers["first"] + 1), "chunks": arguments.get("chunks", 1)}
        for key, number in many.items():
            if not is_whole(number) or number > numbers["last"] - numbers["first"] + 1:
                raise InputError(path, f"is {number!r}, of {numbers['last'] - numbers['first'] + 1} iterations", None, f"{place}.args.{key}")
        rows.append((numbers["tid"], numbers["ts"], numbers["ts"] + numbers["dur"], numbers["first"], numbers["last"],
                     many["iterations"], whole["loop"], many["chunks"]))
    if not rows:
        raise InputError(path, "holds no chunk", None, "traceEvents")
    frame = pd.DataFrame(rows, columns=["thread", "begin", "end", "first", "last", "iterations", "loop", "chunks"])
    return frame.sort_values(["thread", "begin"], kind="stable", ignore_index=True)


def _image(path: Path, said: Any) -> CostImage | None:
    if said is None:
        return None
    if not isinstance(said, dict):
        raise InputError(path, "expected an object or null", None, "metadata.image")
    for key, kind in (("file", str), ("unit", str), ("map", str)):
        if not isinstance(said.get(key), kind):
            raise InputError(path, "expected text", None, f"metadata.image.{key}")
    for key in ("low", "high", "opacity", "shown"):
        if not is_number(said.get(key)):
            raise InputError(path, "expected a number", None, f"metadata.image.{key}")
    if said["map"] not in matplotlib.colormaps:
        raise InputError(path, f"is {said['map']!r}, which matplotlib does not have", None, "metadata.image.map")
    file = path.parent / said["file"]
    try:
        pixels = imread(file)
    except FileNotFoundError:
        raise InputError(path, f"{file}: no such file", None, "metadata.image.file") from None
    except (OSError, ValueError, SyntaxError) as error:
        raise InputError(path, f"{file}: cannot be read: {error}", None, "metadata.image.file") from None
    return CostImage(file, pixels, said["unit"], *(float(said[key]) for key in ("low", "high")), said["map"],
                     *(float(said[key]) for key in ("opacity", "shown")))


def threads_table(trace: Trace) -> Table:
    """One row a thread: what it ran, and how the time of the loop divides for it."""
    begin, end = trace.span
    spans, all_loops = trace.loops, float((trace.loops[:, 1] - trace.loops[:, 0]).sum())
    chunks = trace.chunks.assign(busy=trace.chunks["end"] - trace.chunks["begin"])
    # Of each loop on its own: a thread is before its first chunk once a loop, not once a frame.
    by_loop = chunks.groupby(["thread", "loop"], sort=True).agg(first=("begin", "min"), last=("end", "max"), busy=("busy", "sum")).reset_index()
    of = spans[by_loop["loop"].to_numpy()]
    by_loop["length"] = of[:, 1] - of[:, 0]
    by_loop["before"] = (by_loop["first"] - of[:, 0]).clip(lower=0)
    by_loop["after"] = (of[:, 1] - by_loop["last"]).clip(lower=0)
    by_loop["between"] = (by_loop["last"] - by_loop["first"] - by_loop["busy"]).clip(lower=0)
    sums = by_loop.groupby("thread")[["before", "after", "between", "length"]].sum()
    counts = chunks.groupby("thread").agg(chunks=("chunks", "sum"), iterations=("iterations", "sum"), busy=("busy", "sum"), longest=("busy", "max"))
    every = range(trace.threads)
    sums, counts = sums.reindex(every, fill_value=0.0), counts.reindex(every, fill_value=0)
    numbers = pd.DataFrame({
        "thread": every, "chunks": counts["chunks"].astype(int), "iterations": counts["iterations"].astype(int), "chunks_us": counts["busy"].astype(float),
        "between_us": sums["between"], "before_us": sums["before"], "after_us": sums["after"], "none_us": (all_loops - sums["length"]).clip(lower=0),
        "outside_us": end - begin - all_loops, "longest_event_us": counts["longest"].astype(float)})
    shown = shares(numbers)
    words = pd.DataFrame([{"thread": r.thread, "chunks": r.chunks, "iterations": r.iterations,
                           **{f"{name} (µs)": f"{getattr(r, f'{name}_us'):.1f}" for name in shown},
                           "longest (µs)": f"{r.longest_event_us:.1f}"} for r in numbers.itertuples()])
    loops = text.count(trace.metadata["loops"], "loop")
    note = f"From the begin of the first of {loops} to the end of the last one; chunks: {trace.metadata['chunks_found_by']}."
    return Table("threads", f"Time of the threads, {trace.title}", note, numbers, words)


def shares(threads: pd.DataFrame) -> list[str]:
    """The shares that are shown: what no thread has in a trace of one loop is left out."""
    return [name for name in SHARES if name not in ("none", "outside") or threads[f"{name}_us"].max() > ROUNDING]


def plain(trace: Trace) -> str:
    table = threads_table(trace)
    begin, end = trace.span
    busy = table.numbers["chunks_us"]
    lines = [trace.title, table.words.to_string(index=False)]
    if busy.mean() > 0:
        lines.append(f"imbalance {busy.max() / busy.mean():.3f} (longest / mean time in chunks); {100 * busy.sum() / (trace.threads * (end - begin)):.1f} %"
                     f" of {trace.threads} x {end - begin:.1f} us lie in chunks")
    return "\n".join(lines)


def write(trace: Trace, folder: Path) -> list[Path]:
    """Gantt, shares and, where the trace names one, the heat map, as svg, pdf and png with their captions and what lies beside each figure; the table
    of threads."""
    from .figures import gantt  # matplotlib's figures only when they are drawn

    table = threads_table(trace)
    files: dict[str, str | bytes] = {"threads.csv": table.csv(), "threads.tex": table.tex()}
    captions = ""
    with matplotlib.rc_context(style.RC):
        for drawing in gantt.draw(trace, table.numbers):
            files |= sidecars.files(drawing, *sidecars.drawn_from(trace.path, folder))
            captions += f"{drawing.name}: {drawing.caption.plain} {drawing.caption.reading}\n\n"
    files["captions.txt"] = captions
    writing.write_folder(folder, files, "trace", [trace.path, *([trace.image.path] if trace.image else [])])
    return [folder / name for name in sorted(files)]
