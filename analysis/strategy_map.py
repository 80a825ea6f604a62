"""Where each strategy wins: triangles x pixels per triangle -> the fastest kernel and its lead."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pandas as pd

from . import text
from .comparison import GROUP_AXES, Analysis, Group
from .load import Record
from .statistics.estimates import Estimate
from .statistics.numbers import is_number
from .tables import Table, columns, times
from .work import family, triangles

SECTION = "Where each strategy wins"
FEWEST = 2  # rows and columns of a map, each with several cells
# Scenes whose measured values differ by less than this share a row or a column; random triangles of one size do.
TOLERANCE = 1.6
TIE = "tie"


@dataclass(frozen=True)
class Cell:
    """One picture: its fastest point, that of the best other kernel, and whether they can be told apart."""

    group: Group
    triangles: int
    pixels_per_triangle: float
    best: Record | None  # None where nothing was timed
    second: Record | None  # None where no other kernel was
    lead: Estimate | None  # time of the second / time of the best
    tied: tuple[str, ...]  # other kernels that cannot be told apart from the best, the nearest first; empty: it wins

    @property
    def winner(self) -> str | None:
        return None if self.best is None else TIE if self.tied else self.best.config.kernel


@dataclass(frozen=True)
class Map:
    """Cells by (row, column); rows are intervals of pixels per triangle, columns of triangles."""

    title: str
    slug: str
    rows: list[tuple[float, float]]
    columns: list[tuple[int, int]]
    cells: dict[tuple[int, int], Cell]
    without: tuple[str, ...] = ()  # kernels that were left out because they lead everywhere

    @property
    def heading(self) -> str:
        return "The fastest strategy" + (f" but for {text.listing(list(self.without), 4)}" if self.without else "")

    @property
    def kernels(self) -> list[str]:
        """In the order of the study: each has one colour, won or not."""
        return list(dict.fromkeys(r.config.kernel for cell in self.cells.values() for r in cell.group.records
                                  if r.config.kernel not in self.without))

    @property
    def leaders(self) -> set[str]:
        return {cell.best.config.kernel for cell in self.cells.values() if cell.best is not None}


def pixels_per_triangle(record: Record) -> float | None:
    """Fragments covered per triangle drawn, as they were counted."""
    covered, drawn = record.work.get("fragments_covered"), record.work.get("drawn")
    return covered / drawn if is_number(covered) and is_number(drawn) and covered > 0 and drawn > 0 else None


def maps(analysis: Analysis) -> list[Map]:
    """One of each generator whose scenes vary in triangles and in their size, by everything else that is equal. A map that one
    strategy leads from end to end is followed by the map of the others, so that theirs shows, too."""
    found: dict[tuple, list[tuple[Group, Record]]] = {}
    for group in analysis.groups:
        counted = next((r for r in group.records if triangles(r) and pixels_per_triangle(r)), None)
        if counted is None or (own := family(analysis, counted)) is None:
            continue
        config = counted.config
        rules = tuple(getattr(config, axis) for axis in GROUP_AXES if axis not in ("scene", "scene_hash"))
        found.setdefault((own[0], *rules), []).append((group, counted))
    result: list[Map] = []
    for key, pictures in found.items():
        cells = [_cell(analysis, group, triangles(counted), pixels_per_triangle(counted)) for group, counted in pictures]
        rows = clusters([cell.pixels_per_triangle for cell in cells])
        across = clusters([cell.triangles for cell in cells])
        placed = {(_index(rows, c.pixels_per_triangle), _index(across, c.triangles)): c for c in cells}
        # A grid, not a few scenes of unlike size: most places have a cell.
        if len(rows) < FEWEST or len(across) < FEWEST or len(placed) < max(4, len(rows) * len(across) / 2):
            continue
        config = cells[0].group.records[0].config
        title = f"{key[0]} {config.size[0]}x{config.size[1]} {config.numeric} {config.fill}"
        slug = "".join(c.lower() if c.isalnum() and c.isascii() else "_" for c in title)
        slug += f"_{len(result) + 1}" if result else ""
        drawn = Map(title, slug, rows, across, placed)
        result.append(drawn)
        while len(drawn.leaders) == 1 and len(drawn.kernels) > 2:
            without = (*drawn.without, *drawn.leaders)
            placed = {place: _cell(analysis, analysis.without(cell.group, without, len(pictures)), cell.triangles, cell.pixels_per_triangle)
                      for place, cell in placed.items()}
            drawn = Map(title, f"{slug}_without_{len(without)}", rows, across, placed, without)
            result.append(drawn)
    return result


def _cell(analysis: Analysis, group: Group, count: int, size: float) -> Cell:
    best = group.best
    rivals: dict[str, Record] = {}
    for record in group.timed:
        kernel = record.config.kernel
        if best is not None and kernel != best.config.kernel and (
                kernel not in rivals or analysis.estimates[record.id].value < analysis.estimates[rivals[kernel].id].value):
            rivals[kernel] = record
    nearest = sorted(rivals.values(), key=lambda r: analysis.estimates[r.id].value)
    second = nearest[0] if nearest else None
    tied = tuple(r.config.kernel for r in nearest if group.comparisons[r.id].verdict != "slower")
    lead = None if second is None else group.comparisons[second.id].ratio
    return Cell(group, count, size, best, second, lead, tied)


def clusters(values: list) -> list[tuple]:
    """(lowest, highest) of values that are near each other, ascending."""
    found: list[tuple] = []
    for value in sorted(values):
        if found and value <= found[-1][1] * TOLERANCE:
            found[-1] = (found[-1][0], value)
        else:
            found.append((value, value))
    return found


def _index(intervals: list[tuple], value: float) -> int:
    return next(i for i, (low, high) in enumerate(intervals) if low <= value <= high)


def pixels(value: float) -> str:
    """'0.98', '10.1', '987', '9,870': three digits."""
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 100 else f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}"


def interval(low: float, high: float) -> str:
    return pixels(low) if pixels(low) == pixels(high) else f"{pixels(low)} to {pixels(high)}"


def tables(analysis: Analysis) -> list[Table]:
    return [_table(analysis, found) for found in maps(analysis)]


def _table(analysis: Analysis, found: Map) -> Table:
    numbers, words = [], []
    for _, cell in sorted(found.cells.items(), key=lambda place: (place[0][1], place[0][0])):
        row = {"scene": cell.group.records[0].config.scene, "triangles": cell.triangles, "pixels_per_triangle": cell.pixels_per_triangle}
        said = {"triangles": f"{cell.triangles:,}", "pixels per triangle": pixels(cell.pixels_per_triangle)}
        if cell.second is None:
            alone = cell.best.config.kernel if cell.best is not None else None
            numbers.append(row | {"best": alone})
            words.append(said | {"fastest": f"{alone}, no other was timed" if alone else "none was timed"})
            continue
        best, second = (analysis.estimates[r.id] for r in (cell.best, cell.second))
        numbers.append(row | {"best": cell.best.config.kernel, **columns("best_ms", best), "second": cell.second.config.kernel,
                              **columns("second_ms", second), **columns("lead", cell.lead), "tied": " ".join(cell.tied),
                              "floor_ms": cell.best.floor_ms})
        said |= {"fastest": cell.best.config.kernel, "ms": times(best), "second": cell.second.config.kernel,
                 "its time / the fastest": times(cell.lead), "not told apart": ", ".join(cell.tied)}
        words.append(said)
    return Table(f"map_{found.slug}", f"{found.heading} by triangles and their size, {found.title}",
                 "Pixels per triangle: fragments covered per triangle drawn, as counted. Not told apart: kernels whose difference from the"
                 " fastest the rank test (corrected for all pictures) and the paired interval do not both support.",
                 pd.DataFrame(numbers), pd.DataFrame(words).fillna(""), section=SECTION, folded=len(words) > 12)
