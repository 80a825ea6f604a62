"""Time by numeric mode: what a more exact arithmetic costs the same kernel in the same execution."""

from __future__ import annotations

from typing import Iterator

from .. import captions
from ..comparison import Analysis, Group
from ..load import Record
from ..tables import accuracy
from . import floors
from .common import Block, Drawing, Row, bounds, dots, drawn_together, families, named, pages, part, peer_blocks, spread
from .times import floor_lines, point, thread_series

SECTION = "Numeric modes"


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for groups in families(analysis):
        yield from _draw(analysis, groups)


def _draw(analysis: Analysis, groups: list[Group]) -> Iterator[Drawing]:
    common = [axis for axis in ("fill", "near", "output", "cache")
              if len({getattr(g.records[0].config, axis) for g in groups}) > 1]
    found: dict[tuple[str, str], dict[str, list[Record]]] = {}
    for group in groups:
        config = group.records[0].config
        mode = " ".join([config.numeric, *(getattr(config, axis) for axis in common)])
        for record in group.timed:
            key = (record.config.kernel, analysis.execution(record))
            found.setdefault(key, {}).setdefault(mode, []).append(record)
    # A lone mode has nothing beside it, unless this is the only place where its group is drawn.
    small = {r.id for g in groups if drawn_together(analysis, g) for r in g.timed}
    shown = {key: modes for key, modes in found.items()
             if len(modes) > 1 or any(r.id in small for records in modes.values() for r in records)}
    records = [r for modes in shown.values() for rs in modes.values() for r in rs]
    if not records:
        return
    peers = [r for r in groups[0].peers if r.ok]
    threads = thread_series([*records, *peers])
    blocks = [Block(f"{kernel}, {execution}", [
        Row(mode, tuple(point(analysis.estimates[r.id], threads.index(r.config.threads)) for r in rs), note=accuracy(rs[0]))
        for mode, rs in modes.items()]) for (kernel, execution), modes in shown.items()]
    blocks += peer_blocks(analysis, groups[0], threads)
    every = [p for block in blocks for row in block.rows for p in row.points]
    log = spread([p.value for p in every])
    split = pages(blocks)
    config = groups[0].records[0].config
    place = f"{config.scene} {config.size[0]}x{config.size[1]}"
    for page, chosen in enumerate(split):
        figure = dots(chosen, [f"{n} thread{'s' if n > 1 else ''}" for n in threads], place + part(page, len(split)),
                      "time of a frame, median (ms)" + (", log scale" if log else ""), limits=bounds(every), log=log,
                      floor=floor_lines(records, threads))
        caption = captions.build(
            analysis, f"Time by numeric mode, {place}{part(page, len(split))}",
            "Within a band only the arithmetic differs: the distance between rows is its price.", records,
            notes=["At the right: the verdict against the oracle. Kernels that were timed in one mode only are in the figures of"
                   " that mode.", *floors.notes(records)])
        yield Drawing(named(f"numerics_{groups[0].family_slug}", page, len(split)), SECTION, figure, caption)
