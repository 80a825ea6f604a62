"""Logarithmic scales that give room to what is dense: a row of its own for 0, and a compressed part below a cut."""

from __future__ import annotations

import math
from typing import Iterable, Sequence

from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from .. import style

NARROW = 4.0  # a range below this factor has ticks at even steps, not at 1, 2, 5
WIDE = 300.0  # a range above it has ticks at decades only
ROW = 0.2  # distance of the row for 0 from the smallest value, as a share of the range
BEYOND = 0.15  # room beyond that row: the modes without errors crowd in it, and their names need two sides
PAD = 0.06
DENSE = 0.3  # a cut is made where half of the values or more lie in this share of the range or less
LOWER = (0.24, 0.42)  # the compressed part takes between these shares of the axis


class ErrorScale:
    """Decades, and below them a row for 0. Coordinates are decimal logarithms."""

    def __init__(self, values: Iterable[float]) -> None:
        positive = [v for v in values if v > 0] or [1.0]
        self.low = math.floor(math.log10(min(positive)) + 1e-9)
        self.high = max(math.ceil(math.log10(max(positive)) - 1e-9), self.low + 1)
        reach = self.high - self.low
        self.zero = self.low - ROW * reach
        self.limits = (self.zero - BEYOND * reach, self.high + PAD * reach)

    def __call__(self, value: float) -> float:
        return math.log10(value) if value > 0 else self.zero

    @property
    def break_at(self) -> float:
        """Between the row of zeros and the decades."""
        return (self.zero + self.low) / 2

    def apply(self, axis: Axis, zero: str = "0") -> None:
        decades = list(range(self.low, self.high + 1))
        decades = decades[:: -(-len(decades) // 7)]
        set_ticks(axis, [self.zero, *decades], [zero, *(said(10.0**d) for d in decades)])


class SpeedScale:
    """Decimal logarithms, compressed below the cut, if there is one: the literal program and slow modes lie far from a
    crowd of fast ones, whose order is what a reader wants to see."""

    def __init__(self, values: Sequence[float], extent: Iterable[float]) -> None:
        """values: the marks, which decide where the scale is cut; extent: further values that it must hold."""
        every = [math.log10(v) for v in (*values, *extent)]
        self.low, self.high = min(every), max(every)
        found = dense_part([math.log10(v) for v in values])
        self.cut: float | None = None
        self.squeeze = 1.0
        if found is not None:
            cut, share = found
            lower = min(max(1 - share, LOWER[0]), LOWER[1])
            self.cut = cut
            self.squeeze = (self.high - cut) * lower / (1 - lower) / (cut - self.low)
        low, high = self._at(self.low), self._at(self.high)
        reach = max(high - low, 0.02)
        self.limits = (low - PAD * reach, high + PAD * reach)

    def _at(self, logarithm: float) -> float:
        return logarithm if self.cut is None or logarithm >= self.cut else self.cut - (self.cut - logarithm) * self.squeeze

    def __call__(self, value: float) -> float:
        return self._at(math.log10(value))

    def apply(self, axis: Axis, gap: float = 0.07) -> None:
        """gap: the least distance of two ticks, as a share of the axis."""
        parts = [(self.low, self.high)] if self.cut is None else [(self.cut, self.high), (self.low, self.cut)]
        ticks: list[float] = []
        for low, high in parts:
            for tick in round_values(10**low, 10**high):
                if all(abs(self(tick) - self(t)) >= gap * (self.limits[1] - self.limits[0]) for t in ticks):
                    ticks.append(tick)
        set_ticks(axis, [self(t) for t in ticks], [said(t) for t in ticks])


def dense_part(values: Sequence[float]) -> tuple[float, float] | None:
    """Where the dense upper part begins, and the share of the values in it; None where the values are spread evenly.

    Of all cuts the one that makes a density of two steps most likely (the largest Kullback-Leibler divergence of the
    shares of values from the shares of the range)."""
    ordered = sorted(values)
    reach = ordered[-1] - ordered[0]
    best: tuple[float, float, float] | None = None
    for i in range(1, len(ordered)):
        cut = (ordered[i - 1] + ordered[i]) / 2
        share, part = 1 - i / len(ordered), (ordered[-1] - cut) / reach if reach > 0 else 1.0
        if ordered[i] == ordered[i - 1] or share < 0.5 or not 0 < part <= DENSE:
            continue
        gain = share * math.log(share / part) + (1 - share) * math.log((1 - share) / (1 - part))
        if best is None or gain > best[0]:
            best = (gain, cut, share)
    return best and best[1:]


def round_values(low: float, high: float) -> list[float]:
    """Round values from low to high, those first that must not be missing: decades, then 2 and 5."""
    if high / low < NARROW:
        ticks = [float(t) for t in MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)]
    else:
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        ticks = [s * 10.0**d for s in ((1,) if high / low > WIDE else (1, 2, 5)) for d in decades]
    return [t for t in ticks if low * 0.999 <= t <= high * 1.001 and t > 0]


def set_ticks(axis: Axis, places: list[float], labels: list[str]) -> None:
    axis.set_major_locator(FixedLocator(places))
    axis.set_ticklabels(labels)
    axis.set_minor_locator(NullLocator())


def said(value: float) -> str:
    """'0.01', '20', '10,000', '1e6', '1e-7'."""
    if 1e-3 <= value < 1e5:
        return f"{value:,.0f}" if value >= 1000 else style.plain(float(f"{value:.4g}"))
    digits, exponent = f"{value:.3e}".split("e")
    return f"{float(digits):g}e{int(exponent)}"
