"""Time of every point, and with a single thread count its speedup over the fastest serial kernel."""

from __future__ import annotations

from typing import Iterator

from .. import captions, text
from ..comparison import Analysis, Group, strategy
from ..load import Record
from ..statistics.estimates import Estimate
from . import floors
from .common import Block, Drawing, Point, Row, bounds, dots, drawn_together, execution_rows, named, pages, part, peer_blocks, spread, untimed_rows

SECTION = "Time per strategy"


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        if (group.timed or any(r.ok for r in group.peers)) and not drawn_together(analysis, group):
            yield from _draw(analysis, group)


def thread_series(records: list[Record]) -> list[int]:
    return sorted({record.config.threads for record in records})


def point(estimate: Estimate, series: int, ringed: bool = False) -> Point:
    return Point(estimate.value, estimate.low, estimate.high, series, ringed)


def _draw(analysis: Analysis, group: Group) -> Iterator[Drawing]:
    peers = [r for r in group.peers if r.ok]
    threads = thread_series([*group.timed, *peers])
    blocks = []
    for kernel in group.kernels:
        rows = []
        for execution, records in execution_rows(analysis, group, kernel).items():
            points = tuple(point(analysis.estimates[r.id], threads.index(r.config.threads), near_best(group, r))
                           for r in records)
            rows.append(Row(execution, points, note="fastest" if group.best in records else ""))
        rows += untimed_rows(analysis, group, kernel)
        blocks.append(Block(kernel, rows))
    blocks += peer_blocks(analysis, group, threads)
    every = [p for block in blocks for row in block.rows for p in row.points]
    log = spread([p.value for p in every])
    split = pages(blocks)
    for page, chosen in enumerate(split):
        shown = [r for r in (*group.timed, *peers) if any(block.kernel == strategy(r) for block in chosen)]
        # All pages of a scene share one axis, so that they can be laid side by side.
        figure = dots(chosen, [f"{n} thread{'s' if n > 1 else ''}" for n in threads], group.title + part(page, len(split)),
                      "time of a frame, median (ms)" + (", log scale" if log else ""), limits=bounds(every), log=log,
                      ring="fastest, or not distinguishable from it", floor=floor_lines(group.timed, threads), every=blocks)
        caption = captions.build(
            analysis, f"Time per strategy, {group.title}{part(page, len(split))}",
            "Left is faster. Where two intervals are apart the points differ; rings mark the fastest and what cannot be told"
            " apart from it.", shown, notes=_notes(analysis, group))
        yield Drawing(named(f"time_{group.slug}", page, len(split)), SECTION, figure, caption)


def floor_lines(records: list[Record], threads: list[int]) -> dict[int, float]:
    """Where the line of each series of thread_series() stands in a figure of times."""
    return {threads.index(count): floor for count, floor in floors.by_threads(records).items()}


def near_best(group: Group, record: Record) -> bool:
    return group.comparisons[record.id].verdict != "slower" and len(group.timed) > 1


def _notes(analysis: Analysis, group: Group) -> list[str]:
    notes = ["An interval that is narrower than its marker is hidden by it."]
    if len(group.timed) > 1:
        groups = len([g for g in analysis.groups if g.timed])
        notes.append(f"Told apart means: rank test, corrected for {text.count(len(group.timed) - 1, 'comparison')} (Holm)"
                     + (f" in each of {groups} groups of equal picture and arithmetic" if groups > 1 else "")
                     + ", below 0.05, and the paired interval of the ratio above 1.")
    if group.peers:
        notes.append("A peer is another program that draws the same scene, with an arithmetic and a fill rule of its own: no kernel, and"
                     " no base of a speedup.")
    notes += floors.notes(group.timed)
    if group.untimed:
        notes.append("Failed and skipped points are listed with their reasons and show no time.")
    return notes
