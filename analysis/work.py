"""How time grows with work: the points that differ in their triangles only, or in their pixels only."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from . import text
from .comparison import Analysis, strategy
from .load import Record
from .statistics.numbers import is_number
from .tables import Table, columns, times

SECTION = "Time against work"
FEWEST = 3  # amounts of work: two points are no curve
# A curve's points agree in these; the scene or the size is what varies.
SAME = ("numeric", "fill", "near", "output", "cache")
UNITS = {"triangles": "triangles", "pixels": "pixels"}


@dataclass(frozen=True)
class Curve:
    """One strategy on one thread count: its records by amount of work."""

    name: str  # "tile_simd", "llvmpipe (peer)"
    execution: str
    records: dict[int, Record]
    is_peer: bool

    def slopes(self, analysis: Analysis) -> dict[int, float]:
        """Exponent of time over work between each amount and the one before it: 1 is proportional, 0 no growth."""
        at = list(self.records.items())
        return {x: math.log(analysis.estimates[r.id].value / analysis.estimates[q.id].value) / math.log(x / w)
                for (w, q), (x, r) in zip(at, at[1:])}


@dataclass(frozen=True)
class Growth:
    """Curves over one kind of work, everything else equal, by thread count."""

    kind: str  # "triangles" or "pixels"
    title: str
    slug: str
    amounts: dict[int, str]  # of work, with what names them
    curves: dict[int, list[Curve]]  # by threads
    skipped: list[Record]  # points of these curves without a time

    @property
    def records(self) -> list[Record]:
        return [record for curves in self.curves.values() for curve in curves for record in curve.records.values()]


def triangles(record: Record) -> int | None:
    """Triangles of the scene, as the point drew them."""
    count = record.work.get("triangles")
    return int(count) if is_number(count) and count > 0 else None


def family(analysis: Analysis, record: Record) -> tuple[str, str] | None:
    """(generator, its other keys) of a scene that differs from others in its triangles only; None of one from a file."""
    scenes = analysis.study.context.get("scenes")
    scene = scenes.get(record.config.scene) if isinstance(scenes, dict) else None
    model = scene.get("model") if isinstance(scene, dict) else None
    if not isinstance(model, str) or "." in model.partition(":")[0] or "/" in model.partition(":")[0]:
        return None
    generator, _, keys = model.partition(":")
    return generator, ",".join(key for key in keys.split(",") if not key.startswith("triangles="))


def growths(analysis: Analysis) -> list[Growth]:
    """Those with at least FEWEST amounts of work. A generator that varies in another key as well is a grid, not a curve."""
    found = []
    families = {f for r in analysis.study.every_record if (f := family(analysis, r)) is not None}
    for kind in UNITS:
        groups: dict[tuple, list[Record]] = {}
        for record in analysis.study.records:
            config = record.config
            if kind == "triangles":
                own = family(analysis, record)
                if own is None or sum(f[0] == own[0] for f in families) > 1:
                    continue
                what = (own, config.size)
            else:
                what = (config.scene, config.scene_hash)
            groups.setdefault((*what, *(getattr(config, axis) for axis in SAME)), []).append(record)
        several = len({key[2:] for key in groups}) > 1
        for key, records in groups.items():
            pictures = {(r.config.scene, r.config.scene_hash, r.config.size) for r in records}
            peers = [r for r in analysis.study.peers if (r.config.scene, r.config.scene_hash, r.config.size) in pictures]
            growth = _growth(analysis, kind, key, [*records, *peers], several)
            if growth is not None:
                found.append(growth)
    return found


def _growth(analysis: Analysis, kind: str, key: tuple, records: list[Record], several: bool) -> Growth | None:
    first = records[0].config
    timed = [r for r in records if r.ok and _amount(kind, r) is not None]
    amounts = {x: _named(kind, r) for r in sorted(timed, key=lambda r: _amount(kind, r)) if (x := _amount(kind, r))}
    if len(amounts) < FEWEST:
        return None
    curves: dict[int, list[Curve]] = {}
    for threads in sorted({r.config.threads for r in timed}):
        by_strategy: dict[str, dict[str, dict[int, Record]]] = {}
        for record in sorted((r for r in timed if r.config.threads == threads), key=lambda r: _amount(kind, r)):
            by_strategy.setdefault(strategy(record), {}).setdefault(analysis.execution(record), {})[_amount(kind, record)] = record
        for name, executions in by_strategy.items():
            best = min(executions, key=lambda e: (-len(executions[e]), analysis.estimates[list(executions[e].values())[-1].id].value))
            if len(executions[best]) > 1:
                chosen = executions[best]
                peer = next(iter(chosen.values())).config.is_peer
                curves.setdefault(threads, []).append(Curve(name, best, chosen, peer))
    if not curves:
        return None
    what = f"{key[0][0]} {first.size[0]}x{first.size[1]}" if kind == "triangles" else first.scene
    words = " ".join([what, first.numeric, first.fill, *([first.near] if several else [])])
    name = "".join(c.lower() if c.isalnum() and c.isascii() else "_" for c in words)
    return Growth(kind, words, f"{kind}_{name}", amounts, curves, [r for r in records if not r.ok])


def _amount(kind: str, record: Record) -> int | None:
    return triangles(record) if kind == "triangles" else record.config.size[0] * record.config.size[1]


def _named(kind: str, record: Record) -> str:
    return f"{_amount(kind, record):,}" if kind == "triangles" else "x".join(map(str, record.config.size))


def tables(analysis: Analysis) -> list[Table]:
    return [_table(analysis, growth) for growth in growths(analysis)]


def _table(analysis: Analysis, growth: Growth) -> Table:
    numbers, words = [], []
    for threads, curves in growth.curves.items():
        for curve in curves:
            slopes = curve.slopes(analysis)
            said = {"kernel": curve.name, "execution": curve.execution, "threads": str(threads)}
            for x, label in growth.amounts.items():
                record = curve.records.get(x)
                if record is None:
                    said[f"{label}: ms"] = text.MISSING
                    continue
                numbers.append({"kernel": curve.name, "execution": curve.execution, "threads": threads, growth.kind: x,
                                **columns("median_ms", analysis.estimates[record.id]), "floor_ms": record.floor_ms,
                                "slope_from_the_one_before": slopes.get(x)})
                said[f"{label}: ms"] = times(analysis.estimates[record.id])
            said["slopes"] = ", ".join(f"{slope:.2f}" for slope in slopes.values())
            words.append(said)
    note = (f"Medians with 95 % intervals. Slopes: the exponent of time over {growth.kind} between each point and the one before it"
            " in the row; 1 is proportional to the work, 0 no growth.")
    return Table(f"work_{growth.slug}", f"Time against {growth.kind}, {growth.title}", note, pd.DataFrame(numbers), pd.DataFrame(words),
                 section=SECTION, folded=len(words) > 12)


def floor_of(growth: Growth, threads: int) -> dict[int, float]:
    """Milliseconds of the floor by amount of work."""
    found: dict[int, float] = {}
    for curve in growth.curves.get(threads, []):
        for x, record in curve.records.items():
            if record.floor_ms is not None:
                found[x] = min(record.floor_ms, found.get(x, np.inf))
    return dict(sorted(found.items()))
