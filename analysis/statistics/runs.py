"""Two runs of a study, which share no blocks: their ratio, and how far a point moves between two runs of one program."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy import stats

from .estimates import Estimate
from .intervals import CONFIDENCE, MIN_SAMPLES, SEED, quantiles, resampled_medians
from .launch_tests import launch_medians
from .rank_tests import unpaired_test
from .samples import Samples


def between_runs(samples: Samples, base: Samples, family: float = 1) -> tuple[Estimate, float, str]:
    """Ratio of the medians of two runs, samples / base, the two-sided p of no difference, and the test of the samples.

    Runs share no blocks and no drift, so nothing is paired. The samples must differ by unpaired_test in a family of this many
    comparisons, and the launches, which are what repeats, by Welch's t on the logarithms of their medians: p is the larger
    one. The interval is the wider of that t's and of the bootstrap over launches, then blocks, which alone is too narrow for
    few launches. With one launch on either side the samples have to stand for launches, which they cannot (another launch has
    another memory layout): p is that of the samples.
    """
    value = float(np.median(samples.values) / np.median(base.values))
    n = min(samples.n, base.n)
    if n < MIN_SAMPLES:
        return Estimate(value, None, None, n, "none", f"fewer than {MIN_SAMPLES} samples"), 1.0, "none"
    above, below = resampled_medians(samples.by_launch), resampled_medians(base.by_launch, SEED + 1)
    low, high = quantiles(above / below)
    p, test = unpaired_test(samples.values, base.values, family)
    if min(samples.launch_count, base.launch_count) < 2:
        return Estimate(value, low, high, n, "bootstrap over blocks"), p, test
    a, b = launch_medians(samples), launch_medians(base)
    # Welch (1947): the degrees of freedom of Satterthwaite.
    variances = a.var(ddof=1) / len(a), b.var(ddof=1) / len(b)
    error = math.sqrt(sum(variances))
    shift = float(a.mean() - b.mean())
    if error == 0:
        return Estimate(value, low, high, n, "bootstrap over launches, then blocks"), p if shift else 1.0, test
    freedom = error**4 / (variances[0] ** 2 / (len(a) - 1) + variances[1] ** 2 / (len(b) - 1))
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, freedom)) * error
    p = max(p, float(2 * stats.t.sf(abs(shift) / error, freedom)))
    return Estimate(value, min(low, math.exp(shift - half)), max(high, math.exp(shift + half)), n,
                    "Welch t over launches, or bootstrap where wider"), p, test


def yardstick(logs: np.ndarray) -> np.ndarray:
    """How far a point may move between two runs of one program, as a distance of logarithms; one a point.

    logs[point, run]: log medians of two or more runs of the same program; nan where a run lacks a point. What a run adds to
    all points (the median over them) and what it adds to one have standard deviations c, from as many values as there are
    runs, and s, pooled over the points. The difference of two runs has sqrt(2) times that, so the distance is the root of the
    sum of the squares of t * sqrt(2) c, with runs - 1 degrees of freedom, and t * sqrt(2) s, with t at 0.05 / points
    (Bonferroni: what is common to all is wrong once, what is a point's own in each); and at least what the point did move.
    With one repeat t is 12.7 for the common part: one repeat says little, two or three say much more.
    """
    moved = logs - logs[:, :1]
    known = moved[np.all(np.isfinite(moved), axis=1)]
    points, runs = known.shape
    common = np.median(known, axis=0)
    tail = (1 - CONFIDENCE) / 2
    whole = stats.t.ppf(1 - tail, runs - 1) * math.sqrt(2) * float(np.std(common, ddof=1))
    own = 0.0
    if points > 1:
        pooled = math.sqrt(float(np.mean(np.var(known - common, axis=1, ddof=1))) * points / (points - 1))
        own = stats.t.ppf(1 - tail / len(logs), (runs - 1) * (points - 1)) * math.sqrt(2) * pooled
    return np.maximum(math.hypot(whole, own), np.nanmax(np.abs(moved), axis=1))


def widened_by(estimate: Estimate, distance: float) -> Estimate:
    """The interval of a ratio with another error of `distance` (95 %, on the log scale), which is independent of its own."""
    if not estimate.has_interval:
        return estimate
    low = estimate.value * math.exp(-math.hypot(math.log(estimate.value / min(estimate.low, estimate.value)), distance))
    high = estimate.value * math.exp(math.hypot(math.log(max(estimate.high, estimate.value) / estimate.value), distance))
    return replace(estimate, low=low, high=high, kind=f"{estimate.kind}, widened by the repeats of A")
