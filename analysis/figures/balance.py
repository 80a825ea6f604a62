"""How evenly the raster stage is shared among the threads."""

from __future__ import annotations

from typing import Iterator

from matplotlib.lines import Line2D

from .. import captions, raster_loop, style, text
from ..comparison import Analysis, Group
from ..load import Record
from ..lost_time import older_remark
from ..raster_loop import RasterLoop
from .common import Block, Drawing, Row, drawn_together, execution_rows, named, pages, part, row_frame

SECTION = "Balance of the threads"


def loop(record: Record) -> RasterLoop | None:
    """None where busy times were not recorded for two threads or more."""
    return raster_loop.of(record) if record.config.threads > 1 else None


def imbalance(record: Record) -> float | None:
    """Longest busy time / mean busy time: 1 is even, the number of threads is one thread doing all."""
    found = loop(record)
    return None if found is None else found.ratio


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        records = [r for r in group.timed if loop(r)]
        if records and not drawn_together(analysis, group):
            yield from _draw(analysis, group, max(r.config.threads for r in records))


def _draw(analysis: Analysis, group: Group, threads: int) -> Iterator[Drawing]:
    blocks, order = [], {}
    for kernel in group.kernels:
        rows = []
        for execution, records in execution_rows(analysis, group, kernel).items():
            chosen = [r for r in records if loop(r) and r.config.threads == threads]
            if chosen:
                order[(kernel, execution)] = chosen[0]
                rows.append(Row(execution, note=f"{imbalance(chosen[0]):.2f}"))
        if rows:
            blocks.append(Block(kernel, rows))
    split = pages(blocks)
    keys = [Line2D([], [], color=style.COLOURS[0], marker="o", mfc="none", ms=4.5, lw=0, label="a thread (median over the samples)"),
            Line2D([], [], color=style.COLOURS[1], marker="D", ms=4.5, lw=0, label="the longest of each sample (median; imbalance, at the right)")]
    highest = max(imbalance(r) for r in order.values())
    for page, chosen in enumerate(split):
        frame = row_frame(chosen, f"{group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
                          "busy time of a thread in the raster stage / mean over the threads (times)",
                          limits=(0, max(highest, 1.2)), log=False, keys=keys, every=blocks)
        kernels = [block.kernel for block in chosen for _ in block.rows]
        shown = []
        for (y, row), kernel in zip(frame.rows, kernels):
            record = order[(kernel, row.label)]
            shown.append(record)
            times = raster_loop.busy(record)
            frame.axes.plot([time / loop(record).mean for time in times], [y] * len(times), marker="o", lw=0, ms=4.5, zorder=3,
                            color=style.COLOURS[0], mfc="none")
            frame.axes.plot(imbalance(record), y, marker="D", ms=4.5, zorder=4, color=style.COLOURS[1])
        frame.axes.axvline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        caption = captions.build(
            analysis, f"Balance of the threads, {group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
            "All marks on the dashed line is an even share; the longest of a sample is what the other threads wait for.",
            shown, estimates=None,
            notes=[f"Each circle is the median busy time of one thread ({analysis.sampled(shown)}); the records hold no intervals for it."
                   " Imbalance is longest / mean, each taken within a sample; a diamond right of all circles: the longest thread changes."
                   + older_remark(sum(not loop(r).per_sample for r in shown))])
        yield Drawing(named(f"balance_{group.slug}", page, len(split)), SECTION, frame.figure, caption)
