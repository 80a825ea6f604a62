"""The parallel efficiency of each stage, at the highest thread count of a picture."""

from __future__ import annotations

from typing import Iterator

from .. import captions, stage_efficiency, text
from ..comparison import Analysis, Group
from ..load import STAGES
from ..stage_efficiency import TOTAL, Efficiency
from .common import ROW_HEIGHT, SERIES_HEIGHT, Block, Drawing, Row, bounds, dots, drawn_together, most_rows, named, pages, part
from .times import point

MOST = 30  # rows; with more, only the fastest execution of each kernel and backend


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        if not drawn_together(analysis, group):
            yield from _draw(analysis, group)


def chosen(analysis: Analysis, group: Group) -> tuple[list[Efficiency], bool]:
    """Those at the highest thread count, and whether they are all of them."""
    found = stage_efficiency.efficiencies(analysis, group)
    highest = max((one.record.config.threads for one in found), default=0)
    found = [one for one in found if one.record.config.threads == highest]
    if len(found) <= MOST:
        return found, True
    classes: dict[tuple[str, str], Efficiency] = {}
    for one in sorted(found, key=lambda e: analysis.estimates[e.record.id].value):
        classes.setdefault((one.record.config.kernel, one.record.config.backend), one)
    return list(classes.values()), False


def _draw(analysis: Analysis, group: Group) -> Iterator[Drawing]:
    found, complete = chosen(analysis, group)
    if not found:
        return
    series = [s for s in (*STAGES, TOTAL) if any(s in one.stages for one in found)]
    blocks = []
    for kernel in group.kernels:
        rows = []
        for one in found:
            if one.record.config.kernel == kernel:
                missing = [s for s in STAGES if s not in one.stages]
                rows.append(Row(analysis.execution(one.record), tuple(point(e, series.index(s)) for s, e in one.stages.items()),
                                note="no " + ", ".join(missing) if missing else ""))
        if rows:
            blocks.append(Block(kernel, rows))
    threads = found[0].record.config.threads
    every = [p for block in blocks for row in block.rows for p in row.points]
    _, high = bounds(every)
    row_height = max(ROW_HEIGHT, SERIES_HEIGHT * len(series))
    split = pages(blocks, most_rows(row_height))
    shown = [one.record for one in found]
    kinds = sorted({e.kind for one in found for e in one.stages.values() if e.has_interval})
    for page, some in enumerate(split):
        figure = dots(some, [_series(s) for s in series], f"{group.title}, {text.count(threads, 'thread')}" + part(page, len(split)),
                      "parallel efficiency, T(1) / (N T(N))", limits=(0, max(high, 1)), log=False, reference=1.0, reference_name="ideal", every=blocks,
                      row_height=row_height)
        notes = [f"{text.count(sum(one.over_serial for one in found), 'point')} without a point on one thread have the serial backend as"
                 " their base."] if any(one.over_serial for one in found) else []
        if not complete:
            notes.append("Of each kernel and backend only the fastest execution is drawn; tables/stage_efficiency.csv has all.")
        caption = captions.build(
            analysis, f"Parallel efficiency of each stage, {group.title}{part(page, len(split))}",
            "A stage left of the dashed line loses time to overhead, imbalance or shared memory; how much that matters is its share of the"
            " frame (figure of the stages).", shown, estimates="medians of paired ratios", kind=" / ".join(kinds),
            base="Base: the same kernel, backend and schedule on one thread.", notes=notes)
        yield Drawing(named(f"stage_efficiency_{group.slug}", page, len(split)), stage_efficiency.SECTION, figure, caption)


def _series(stage: str) -> str:
    return "whole frame" if stage == TOTAL else stage
