"""Weak scaling: how the time of a frame holds when triangles or pixels grow with the threads (`weak = ...` in a sweep)."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from . import text
from .comparison import Analysis, Group, slug, strategy
from .load import Record, WeakSeries
from .statistics.estimates import Estimate
from .tables import Table, columns, times

SECTION = "Weak scaling"
# The points of a curve agree in these; scene, size and threads grow together.
SAME = ("numeric", "fill", "near", "output", "cache")


@dataclass(frozen=True)
class Curve:
    """One strategy in one execution, with one thread and more."""

    name: str
    execution: str
    records: dict[int, Record]  # by threads, 1 among them

    @property
    def base(self) -> Record:
        return self.records[1]

    @property
    def label(self) -> str:
        return f"{self.name}, {self.execution}"

    def efficiencies(self, analysis: Analysis) -> dict[int, Estimate]:
        """T_1 / T_P by threads: 1 where each thread does its share as fast as one thread alone does it."""
        found = {p: analysis.speedup(record, self.base) for p, record in self.records.items()}
        return {p: e if e is not None else Estimate(1.0, None, None, self.base.samples.n, "base") for p, e in found.items()}


@dataclass(frozen=True)
class Growth:
    """The curves over one weak series in one arithmetic."""

    series: WeakSeries
    numeric: str
    rules: str  # the other axes that they agree in, where a study has several
    curves: list[Curve]

    @property
    def title(self) -> str:
        return " ".join(filter(None, [f"{self.series.scene} {self.series.size}", self.numeric, self.rules]))

    @property
    def slug(self) -> str:
        return slug(f"{self.series.kind} {self.title}")

    @property
    def records(self) -> list[Record]:
        return [record for curve in self.curves for record in curve.records.values()]

    @property
    def threads(self) -> list[int]:
        return sorted({p for curve in self.curves for p in curve.records})


def growths(analysis: Analysis) -> list[Growth]:
    """Those with a curve of at least two numbers of threads."""
    found = []
    for series in analysis.study.weak:
        groups: dict[tuple, dict[tuple[str, str], dict[int, Record]]] = {}
        for record in analysis.study.every_record:
            config = record.config
            if record.ok and series.steps.get(config.threads) == (config.scene, config.size):
                key = tuple(getattr(config, axis) for axis in SAME)
                name = (strategy(record), analysis.execution(record))
                groups.setdefault(key, {}).setdefault(name, {})[config.threads] = record
        for key, by_name in groups.items():
            curves = [Curve(*name, dict(sorted(records.items()))) for name, records in by_name.items() if len(records) > 1 and 1 in records]
            if curves:
                found.append(Growth(series, key[0], " ".join(key[1:]) if len(groups) > 1 else "", curves))
    return found


def bases(analysis: Analysis) -> dict[str, Record]:
    """The one-thread point of each point of a curve, by id."""
    return {record.id: curve.base for growth in growths(analysis) for curve in growth.curves for record in curve.records.values()}


def shows(analysis: Analysis, group: Group) -> bool:
    """Whether a group is there for weak scaling: a picture of a weak series, whose points stand in its figure."""
    pictures = {step for series in analysis.study.weak for step in series.steps.values()}
    return bool(group.timed) and (group.timed[0].config.scene, group.timed[0].config.size) in pictures


def tables(analysis: Analysis) -> list[Table]:
    numbers, words = [], []
    for growth in growths(analysis):
        for curve in growth.curves:
            for p, e in curve.efficiencies(analysis).items():
                record = curve.records[p]
                width, height = record.config.size
                numbers.append({"grows": growth.series.kind, "scene": growth.series.scene, "size": growth.series.size,
                                "numeric": growth.numeric, "rules": growth.rules, "kernel": curve.name, "execution": curve.execution,
                                "threads": p, "triangles": record.work.get("triangles"), "pixels": width * height,
                                **columns("median_ms", analysis.estimates[record.id]), **columns("efficiency", e), "interval": e.kind})
                words.append({"grows": growth.series.kind, "picture": growth.title, "kernel": curve.name, "execution": curve.execution,
                              "threads": str(p), "triangles": text.number(record.work.get("triangles")), "size": f"{width}x{height}",
                              "median ms [95 %]": times(analysis.estimates[record.id]),
                              "efficiency [95 %]": "is the base" if record is curve.base else times(e)})
    if not numbers:
        return []
    note = "Efficiency is T_1 / T_P, the median of paired ratios: the time of one thread on its share / that of P threads on P shares."
    return [Table("weak_scaling", "Weak scaling", note, pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words), section=SECTION, folded=len(words) > 24)]
