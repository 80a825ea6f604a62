"""Values with their intervals: medians, ratios of paired samples, and what is made of several points."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Sequence

import numpy as np
from scipy import stats

from .intervals import CONFIDENCE, MIN_LAUNCHES, MIN_SAMPLES, SEED, order_interval, quantiles, resampled_medians
from .samples import Samples, paired


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval; without one (low, high None) where the samples are too few."""

    value: float
    low: float | None
    high: float | None
    n: int
    kind: str
    note: str = ""

    @property
    def has_interval(self) -> bool:
        return self.low is not None and self.high is not None

    @property
    def excludes_one(self) -> bool:
        return self.has_interval and (self.low > 1.0 or self.high < 1.0)

    def scaled(self, factor: float) -> Estimate:
        low, high = (None if bound is None else bound * factor for bound in (self.low, self.high))
        return replace(self, value=self.value * factor, low=low, high=high)

    def inverse(self) -> Estimate:
        low, high = (None if bound is None else 1.0 / bound for bound in (self.high, self.low))
        return replace(self, value=1.0 / self.value, low=low, high=high)


def median_estimate(samples: Samples) -> Estimate:
    """The median; with enough launches its interval lets the launches vary too."""
    value = float(np.median(samples.values))
    if samples.launch_count >= MIN_LAUNCHES:
        low, high = quantiles(resampled_medians(samples.by_launch))
        return Estimate(value, low, high, samples.n, "bootstrap over launches, then blocks")
    bounds = order_interval(samples.values)
    if bounds is None:
        return Estimate(value, None, None, samples.n, "none", "fewer than 6 samples")
    return Estimate(value, *bounds, samples.n, "order statistics")


def ratio(numerator: Samples, denominator: Samples) -> Estimate:
    """The median of paired ratios with its bootstrap interval; unpaired where too few blocks match."""
    groups = paired(numerator, denominator)
    pairs = sum(len(group) for group in groups)
    smaller = min(numerator.n, denominator.n)
    if pairs >= MIN_SAMPLES or (pairs and pairs == smaller):
        value = float(np.median(np.concatenate(groups)))
        if pairs < MIN_SAMPLES:
            return Estimate(value, None, None, pairs, "none", "fewer than 6 pairs")
        # One launch has nothing to resample but its blocks, and there the exact interval of the median of n ratios
        # exists. The percentile bootstrap alone covers less than it says for small n, so the wider of the two counts.
        low, high = quantiles(resampled_medians(groups))
        kind = "paired, bootstrap over launches, then blocks"
        if len(groups) == 1:
            exact = order_interval(groups[0])
            low, high = min(low, exact[0]), max(high, exact[1])
            kind = "paired, bootstrap over blocks"
        return Estimate(value, low, high, pairs, kind)
    value = float(np.median(numerator.values) / np.median(denominator.values))
    note = "unpaired: blocks do not match"
    if smaller < MIN_SAMPLES:
        return Estimate(value, None, None, smaller, "none", "fewer than 6 samples")
    above = resampled_medians(numerator.by_launch)
    below = resampled_medians(denominator.by_launch, SEED + 1)
    low, high = quantiles(above / below)
    return Estimate(value, low, high, smaller, "unpaired bootstrap", note)


def efficiency(speedup: Estimate, threads: int) -> Estimate:
    return speedup.scaled(1.0 / threads)


def share(part: np.ndarray, whole: np.ndarray) -> Estimate:
    """The median of part / whole, sample by sample."""
    shares = np.asarray(part, dtype=float) / np.asarray(whole, dtype=float)
    bounds = order_interval(shares)
    low, high = bounds if bounds else (None, None)
    return Estimate(float(np.median(shares)), low, high, len(shares), "order statistics" if bounds else "none")


def ratio_of_sums(numerators: Sequence[Samples], denominators: Sequence[Samples]) -> Estimate:
    """Over scenes: the ratio of summed medians, never a mean of ratios. Scenes are fixed, samples are resampled."""
    above = sum(float(np.median(s.values)) for s in numerators)
    below = sum(float(np.median(s.values)) for s in denominators)
    n = min(s.n for s in (*numerators, *denominators))
    if n < MIN_SAMPLES:
        return Estimate(above / below, None, None, n, "none", "fewer than 6 samples")
    # Distinct seeds: points are resampled independently of each other.
    top = sum(resampled_medians(s.by_launch, SEED + 2 * i) for i, s in enumerate(numerators))
    bottom = sum(resampled_medians(s.by_launch, SEED + 2 * i + 1) for i, s in enumerate(denominators))
    low, high = quantiles(top / bottom)
    return Estimate(above / below, low, high, n, "unpaired bootstrap")


def geometric_mean(ratios: Sequence[Estimate]) -> Estimate:
    """Over scenes: the geometric mean of ratios, the one mean that gives the same order whichever point is the base.

    The half widths of the intervals on the log scale add up as roots of summed squares, each side on its own (Zou and
    Donner, Construction of confidence limits about effect measures, 2008). The scenes count as independent.
    """
    logs = np.log([r.value for r in ratios])
    value, n = float(np.exp(logs.mean())), min(r.n for r in ratios)
    if not all(r.has_interval for r in ratios):
        return Estimate(value, None, None, n, "none", "a scene has no interval")
    below, above = (float(np.linalg.norm(logs - np.log(bounds))) / len(ratios)
                    for bounds in ([r.low for r in ratios], [r.high for r in ratios]))
    return Estimate(value, value * math.exp(-below), value * math.exp(above), n, "combined from the scenes' intervals")


def widened(estimate: Estimate, family: float) -> Estimate:
    """The interval of a ratio at level 0.05 / family (Bonferroni): its ends move out as those of a normal distribution on
    the log scale would."""
    if not estimate.has_interval:
        return estimate
    tail = (1 - CONFIDENCE) / 2
    factor = float(stats.norm.ppf(1 - tail / max(1.0, family)) / stats.norm.ppf(1 - tail))
    low, high = (estimate.value * (bound / estimate.value) ** factor for bound in (estimate.low, estimate.high))
    return replace(estimate, low=low, high=high)


def harmonic_mean(rates: Sequence[float]) -> float:
    """The mean of rates over equal amounts of work: total work / total time."""
    values = np.asarray(rates, dtype=float)
    if len(values) == 0 or np.any(values <= 0):
        raise ValueError("a harmonic mean needs positive rates")
    return float(len(values) / np.sum(1.0 / values))
