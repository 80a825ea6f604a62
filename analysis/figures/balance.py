"""How evenly the raster stage is shared among the threads."""

from __future__ import annotations

from typing import Iterator

from matplotlib.lines import Line2D

from .. import captions, style, text
from ..comparison import Analysis, Group
from ..load import Record
from ..statistics import is_number
from .common import Block, Drawing, Row, drawn_together, execution_rows, named, pages, part, row_frame

SECTION = "Balance of the threads"


def busy(record: Record) -> list[float]:
    """Busy milliseconds of each thread; empty where they were not recorded for two threads or more."""
    times = [entry.get("busy_ms") for entry in record.per_thread]
    if len(times) < 2 or not all(is_number(t) and t >= 0 for t in times) or sum(times) <= 0:
        return []
    return [float(t) for t in times]


def imbalance(record: Record) -> float | None:
    """Longest busy time / mean busy time: 1 is even, the number of threads is one thread doing all."""
    times = busy(record)
    return max(times) * len(times) / sum(times) if times else None


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        records = [r for r in group.timed if busy(r)]
        if records and not drawn_together(analysis, group):
            yield from _draw(analysis, group, max(r.config.threads for r in records))


def _draw(analysis: Analysis, group: Group, threads: int) -> Iterator[Drawing]:
    blocks, order = [], {}
    for kernel in group.kernels:
        rows = []
        for execution, records in execution_rows(analysis, group, kernel).items():
            chosen = [r for r in records if busy(r) and r.config.threads == threads]
            if chosen:
                order[(kernel, execution)] = chosen[0]
                rows.append(Row(execution, note=f"{imbalance(chosen[0]):.2f}"))
        if rows:
            blocks.append(Block(kernel, rows))
    split = pages(blocks)
    keys = [Line2D([], [], color=style.COLOURS[0], marker="o", mfc="none", ms=4.5, lw=0, label="a thread"),
            Line2D([], [], color=style.COLOURS[1], marker="D", ms=4.5, lw=0, label="the busiest thread (imbalance, number at the right)")]
    highest = max(imbalance(r) for r in order.values())
    for page, chosen in enumerate(split):
        frame = row_frame(chosen, f"{group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
                          "busy time of a thread in the raster stage / mean over the threads (times)",
                          limits=(0, max(highest, 1.2)), log=False, keys=keys)
        kernels = [block.kernel for block in chosen for _ in block.rows]
        shown = []
        for (y, row), kernel in zip(frame.rows, kernels):
            record = order[(kernel, row.label)]
            shown.append(record)
            times = busy(record)
            mean = sum(times) / len(times)
            last = max(range(len(times)), key=times.__getitem__)
            for i, time in enumerate(times):
                frame.axes.plot(time / mean, y, marker="D" if i == last else "o", ms=4.5, zorder=4 if i == last else 3,
                                color=style.COLOURS[1 if i == last else 0], mfc=None if i == last else "none")
        frame.axes.axvline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        caption = captions.build(
            analysis, f"Balance of the threads, {group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
            "All marks on the dashed line is an even share; the busiest thread is the one that the others wait for.",
            shown, estimates=None,
            notes=[f"Each mark is the median busy time of one thread ({analysis.sampled(shown)}); the records hold no"
                   " intervals for it. Imbalance is maximum / mean."])
        yield Drawing(named(f"balance_{group.slug}", page, len(split)), SECTION, frame.figure, caption)
