"""What each technique gives, rung by rung, and strategies side by side at equal rungs."""

from __future__ import annotations

from typing import Iterator

from .. import captions, ladder, text
from ..comparison import Analysis
from ..ladder import Ladders
from ..load import Record
from . import floors
from .common import Block, Drawing, Row, bounds, dots, named, pages, part, spread
from .times import floor_lines, point, thread_series

SECTION = ladder.SECTION
DIVIDED, MULTIPLIED = "\u00f7", "\u00d7"


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for ladders in ladder.find(analysis):
        yield from _climb(analysis, ladders)
        if ladders.equal:
            yield from _side_by_side(analysis, ladders)


def _ratio(analysis: Analysis, record: Record, base: Record, sign: str) -> str:
    """Time of the base over that of the record, for the margin."""
    estimate = analysis.speedup(record, base)
    return f"{sign} {text.estimate(estimate.value, estimate.low, estimate.high)}"


def _climb(analysis: Analysis, ladders: Ladders) -> Iterator[Drawing]:
    blocks = [Block(ladder.name(steps), [
        Row(step.label, (point(analysis.estimates[step.record.id], 0),),
            note="" if step.before is None else _ratio(analysis, step.record, step.before, DIVIDED)) for step in steps])
        for steps in ladders.ladders]
    notes = [f"At the right: what a rung divides the time of the one before by ({DIVIDED}), with its interval, over paired samples where"
             " blocks are shared."]
    yield from _pages(analysis, ladders, blocks, [[s.record for s in steps] for steps in ladders.ladders], "ladder",
                      "What each technique gives", notes,
                      "From top to bottom each rung adds what it names to the one above it; left is faster. An addition pays where its"
                      " ratio lies above 1 with its whole interval.")


def _side_by_side(analysis: Analysis, ladders: Ladders) -> Iterator[Drawing]:
    blocks = [Block(rung.words, [
        Row(record.config.kernel, (point(analysis.estimates[record.id], 0),),
            note="fastest" if record is records[0] else _ratio(analysis, records[0], record, MULTIPLIED)) for record in records])
        for rung, records in ladders.equal]
    notes = [f"At the right: how many times the time of the fastest of the same rung a strategy takes ({MULTIPLIED}), with its interval,"
             " over paired samples where blocks are shared."]
    yield from _pages(analysis, ladders, blocks, [records for _, records in ladders.equal], "equal_rungs",
                      "Strategies at equal rungs", notes,
                      "Compare within a rung: its strategies have the same instruction set and techniques, so that a difference is one"
                      " of strategy.")


def _pages(analysis: Analysis, ladders: Ladders, blocks: list[Block], records: list[list[Record]], kind: str, title: str,
           notes: list[str], reading: str) -> Iterator[Drawing]:
    every = [r for some in records for r in some]
    threads = thread_series(every)
    points = [p for block in blocks for row in block.rows for p in row.points]
    log = spread([p.value for p in points])
    split = pages(blocks)
    for page, chosen in enumerate(split):
        kernels = {block.kernel for block in chosen}
        shown = list({r.id: r for block, some in zip(blocks, records) if block.kernel in kernels for r in some}.values())
        figure = dots(chosen, [text.count(n, "thread") for n in threads], ladders.title + part(page, len(split)),
                      "time of a frame, median (ms)" + (", log scale" if log else ""), limits=bounds(points), log=log,
                      floor=floor_lines(every, threads))
        caption = captions.build(analysis, f"{title}, {ladders.title}{part(page, len(split))}", reading, shown,
                                 notes=notes + floors.notes(every))
        yield Drawing(named(f"{kind}_{ladders.slug}", page, len(split)), SECTION, figure, caption)
