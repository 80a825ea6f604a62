"""Order statistics against the tables and the exact binomial; the bootstrap against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from ..statistics import intervals


@pytest.mark.parametrize("n, ranks", [(5, None), (6, (1, 6)), (8, (1, 8)), (9, (2, 8)), (10, (2, 9)), (12, (3, 10)), (20, (6, 15))])
def test_order_ranks_are_those_of_the_tables(n, ranks):
    found = intervals.order_ranks(n)
    assert (found[:2] if found else None) == ranks


def test_order_coverage_is_the_exact_binomial():
    assert intervals.order_ranks(6)[2] == pytest.approx(1 - 2 / 64)
    assert intervals.order_ranks(10)[2] == pytest.approx(1 - 2 * 11 / 1024)
    for n in range(6, 80):
        low, high, coverage = intervals.order_ranks(n)
        assert coverage >= 0.95
        assert coverage == pytest.approx(stats.binom.cdf(high - 1, n, 0.5) - stats.binom.cdf(low - 1, n, 0.5))


@pytest.mark.parametrize("n", [6, 11, 24])
def test_order_interval_covers_the_median_as_often_as_it_says(n):
    rng = np.random.default_rng(n)
    draws = np.sort(rng.lognormal(0, 1, (4000, n)), axis=1)
    low, high, coverage = intervals.order_ranks(n)
    covered = np.mean((draws[:, low - 1] <= 1) & (draws[:, high - 1] >= 1))
    assert covered == pytest.approx(coverage, abs=0.015)
    assert intervals.order_interval(draws[0]) == (draws[0][low - 1], draws[0][high - 1])


def test_resampled_medians_agree_with_scipy():
    values = np.random.default_rng(5).lognormal(0, 0.2, 25)
    ours = np.percentile(intervals.resampled_medians([values]), [2.5, 97.5])
    theirs = stats.bootstrap((values,), np.median, method="percentile", n_resamples=4000, random_state=1).confidence_interval
    assert ours == pytest.approx([theirs.low, theirs.high], rel=0.03)


def test_resampling_unequal_launches_stays_within_the_samples():
    draws = intervals.resampled_medians([np.array([1.0, 2.0, 3.0]), np.array([10.0])])
    assert np.all(np.isfinite(draws)) and draws.min() >= 1 and draws.max() <= 10
