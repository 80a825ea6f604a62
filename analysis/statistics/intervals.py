"""95 % intervals without a distribution: order statistics (exact binomial) of a median, and draws of a bootstrap over launches, then
blocks, because the samples of one process share one memory layout and are not independent of each other."""

from __future__ import annotations

from typing import Sequence

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 2000
SEED = 20240229  # fixed, so that the same records always give the same report
MIN_SAMPLES = 6  # below it, [min, max] covers the median with less than 95 %
MIN_LAUNCHES = 5


def order_ranks(n: int, confidence: float = CONFIDENCE) -> tuple[int, int, float] | None:
    """Ranks (from 1) of the narrowest symmetric interval for the median, with its exact coverage."""
    if n < 1 or 1 - 2 * 0.5**n < confidence:
        return None
    low = 1
    while 1 - 2 * stats.binom.cdf(low, n, 0.5) >= confidence:
        low += 1
    return low, n + 1 - low, float(1 - 2 * stats.binom.cdf(low - 1, n, 0.5))


def order_interval(values: Sequence[float], confidence: float = CONFIDENCE) -> tuple[float, float] | None:
    ranks = order_ranks(len(values), confidence)
    if ranks is None:
        return None
    ordered = np.sort(np.asarray(values, dtype=float))
    return float(ordered[ranks[0] - 1]), float(ordered[ranks[1] - 1])


def resampled_medians(groups: Sequence[np.ndarray], seed: int = SEED) -> np.ndarray:
    """Medians of RESAMPLES draws: launches with replacement (if there are several), then blocks within each."""
    rng = np.random.default_rng(seed)
    lengths = np.array([len(group) for group in groups])
    widest = int(lengths.max())
    table = np.full((len(groups), widest), np.inf)
    for row, group in enumerate(groups):
        table[row, : len(group)] = group
    if len(groups) == 1:
        return np.median(table[0][rng.integers(0, widest, (RESAMPLES, widest))], axis=1)
    launch = rng.integers(0, len(groups), (RESAMPLES, len(groups)))
    drawn = lengths[launch][:, :, None]
    block = (rng.random((RESAMPLES, len(groups), widest)) * drawn).astype(int)
    values = np.where(np.arange(widest) < drawn, table[launch[:, :, None], block], np.inf)
    values = np.sort(values.reshape(RESAMPLES, -1), axis=1)  # what a shorter launch lacks sorts to the end
    total = drawn.sum(axis=(1, 2))
    row = np.arange(RESAMPLES)
    return 0.5 * (values[row, (total - 1) // 2] + values[row, total // 2])


def quantiles(draws: np.ndarray) -> tuple[float, float]:
    tail = 100 * (1 - CONFIDENCE) / 2
    low, high = np.percentile(draws, [tail, 100 - tail])
    return float(low), float(high)
