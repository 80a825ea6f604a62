"""Where the time of a frame goes: clear, geometry, raster, resolve."""

from __future__ import annotations

from typing import Iterator

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .. import captions, style, text
from ..comparison import Analysis, Group
from ..load import STAGES, Record
from . import floors
from .common import Block, Drawing, Row, drawn_together, named, pages, part, row_frame

SECTION = "Stages of a frame"
MOST = 30  # bars; with more, only the fastest execution of each kernel, backend and thread count


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        if any(record.stages for record in group.timed) and not drawn_together(analysis, group):
            yield from _draw(analysis, group)


def chosen_records(analysis: Analysis, group: Group) -> tuple[list[Record], bool]:
    """The records to draw, and whether they are all of them."""
    staged = [record for record in group.timed if record.stages]
    if len(staged) <= MOST:
        return staged, True
    classes: dict[tuple, list[Record]] = {}
    for record in staged:
        classes.setdefault((record.config.kernel, record.config.backend, record.config.threads), []).append(record)
    return [analysis.fastest(records) for records in classes.values()], False


def stage_names(records: list[Record]) -> list[str]:
    found = dict.fromkeys(name for record in records for name in record.stages)
    return [s for s in STAGES if s in found] + [s for s in found if s not in STAGES]


def _draw(analysis: Analysis, group: Group) -> Iterator[Drawing]:
    records, complete = chosen_records(analysis, group)
    names = stage_names(records)
    backends = list(dict.fromkeys(record.config.backend for record in records))
    by_label: dict[tuple[str, str], Record] = {}
    # Bars are lengths, so the axis is linear; a bar far beyond the others leaves it and says its time instead.
    totals = sorted(_total(analysis, r) for r in records)
    typical = 5 * float(np.median(totals))
    limit = max(t for t in totals if t <= typical)
    blocks = []
    for kernel in group.kernels:
        rows = []
        mine = [record for record in records if record.config.kernel == kernel]
        for record in sorted(mine, key=lambda r: (backends.index(r.config.backend), r.config.threads)):
            label = analysis.execution(record)
            label += "" if record.config.backend == "serial" else f", {analysis.threads(record)}"
            by_label[(kernel, label)] = record
            beyond = _total(analysis, record) > limit * style.HEADROOM
            rows.append(Row(label, note=f"\u25b6 {text.number(analysis.estimates[record.id].value)}" if beyond else ""))
        if rows:
            blocks.append(Block(kernel, rows))
    split = pages(blocks)
    keys = [Patch(facecolor=style.COLOURS[i], hatch=style.HATCHES[i % 6], edgecolor="white", lw=0, label=name)
            for i, name in enumerate(names)]
    keys.append(Line2D([], [], color="black", marker="|", ms=9, mew=1.4, lw=0, label="median of the whole frame"))
    if floors.by_threads(records):
        keys.append(floors.key())
    for page, chosen in enumerate(split):
        shown = [by_label[(block.kernel, row.label)] for block in chosen for row in block.rows]
        frame = row_frame(chosen, group.title + part(page, len(split)), "median time of a stage (ms)", limits=(0, limit),
                          log=False, keys=keys)
        for (y, _), record in zip(frame.rows, shown):
            _bar(analysis, frame.axes, y, record, names, frame.axes.get_xlim()[1])
        notes = ["Bars are medians of each stage, stacked; the tick is the median of the whole frame, from which a sum of"
                 f" medians may differ ({analysis.sampled(shown)}). A stage that a kernel does not have is absent."]
        if not complete:
            notes.append("Of each kernel, backend and thread count only the fastest execution is drawn; tables/stages.csv"
                         " has all.")
        if totals[-1] > limit * style.HEADROOM:
            notes.append("Bars that leave the axis end in an arrow and their time in ms.")
        notes += floors.notes(shown)
        caption = captions.build(analysis, f"Stages of a frame, {group.title}{part(page, len(split))}",
                                 "Long parts are where time can be won; a part that does not shrink with more threads"
                                 " limits the speedup.", shown, estimates=None, notes=notes)
        yield Drawing(named(f"stages_{group.slug}", page, len(split)), SECTION, frame.figure, caption)


def _total(analysis: Analysis, record: Record) -> float:
    return max(analysis.estimates[record.id].value, sum(float(np.median(v)) for v in record.stages.values()))


def _bar(analysis: Analysis, axes, y: float, record: Record, names: list[str], edge: float) -> None:
    start = 0.0
    for i, name in enumerate(names):
        if name not in record.stages:
            continue
        length = float(np.median(record.stages[name]))
        axes.barh(y, min(length, max(0.0, edge - start)), left=start, height=0.68, color=style.COLOURS[i],
                  hatch=style.HATCHES[i % 6], edgecolor="white", lw=0, zorder=2)
        start += length
    if record.floor_ms is not None:
        floors.across_row(axes, record.floor_ms, y)
    if start <= edge:
        axes.plot(analysis.estimates[record.id].value, y, marker="|", ms=9, mew=1.4, color="black", zorder=4)
