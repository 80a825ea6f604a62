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
from .load import InputError, is_whole
from .statistics import is_number
from .tables import Table

SHARES = {"chunks": "in chunks", "between": "between chunks: handing out, and the trace's stamps",
          "before": "before the first chunk", "after": "after the last chunk: waiting for the others"}


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
    for key in ("threads", "loops"):
        if not is_whole(metadata.get(key)):
            raise InputError(path, "expected a whole number above 0", None, f"metadata.{key}")
    for key in ("frame_us", "untraced_frame_us", "loop_begin_us", "loop_end_us", "loop_us"):
        if not (is_number(metadata.get(key)) and metadata[key] >= 0):
            raise InputError(path, "expected a number that is not below 0", None, f"metadata.{key}")
    for key in ("schedule", "chunk"):
        if key not in metadata:
            raise InputError(path, "missing", None, f"metadata.{key}")
    return Trace(path, metadata, _chunks(path, value.get("traceEvents"), metadata["threads"]), _image(path, metadata.get("image")))


def _chunks(path: Path, events: Any, threads: int) -> pd.DataFrame:
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
        if numbers["last"] < numbers["first"]:
            raise InputError(path, "last is below first", None, f"{place}.args")
        rows.append((numbers["tid"], numbers["ts"], numbers["ts"] + numbers["dur"], numbers["first"], numbers["last"],
                     arguments.get("iterations", numbers["last"] - numbers["first"] + 1), arguments.get("loop", 0),
                     arguments.get("chunks", 1)))
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
    rows = []
    for thread in range(trace.threads):
        own = trace.chunks[trace.chunks["thread"] == thread]
        busy = float((own["end"] - own["begin"]).sum())
        first, last = (float(own["begin"].iloc[0]), float(own["end"].iloc[-1])) if len(own) else (end, end)
        longest = float((own["end"] - own["begin"]).max()) if len(own) else 0.0
        rows.append({"thread": thread, "chunks": int(own["chunks"].sum()), "iterations": int(own["iterations"].sum()), "chunks_us": busy,
                     "between_us": max(0.0, last - first - busy), "before_us": first - begin, "after_us": end - last,
                     "longest_event_us": longest})
    numbers = pd.DataFrame(rows)
    words = pd.DataFrame([{"thread": r["thread"], "chunks": r["chunks"], "iterations": r["iterations"],
                           **{f"{name} (µs)": f"{r[f'{name}_us']:.1f}" for name in SHARES},
                           "longest (µs)": f"{r['longest_event_us']:.1f}"} for r in rows])
    loops = text.count(trace.metadata["loops"], "loop")
    note = f"From the begin of the first of {loops} to the end of the last one; chunks: {trace.metadata['chunks_found_by']}."
    return Table("threads", f"Time of the threads, {trace.title}", note, numbers, words)


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
    writing.refuse_inputs((folder / name for name in files), [trace.path, *([trace.image.path] if trace.image else [])])
    for name, content in files.items():
        writing.write(folder / name, content)
    return [folder / name for name in sorted(files)]
