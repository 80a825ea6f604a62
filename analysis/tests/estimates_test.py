"""Medians and ratios against values computed by hand, and by simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from ..statistics import estimates
from ..statistics.estimates import Estimate
from .timings import samples


def test_five_samples_have_no_interval():
    estimate = estimates.median_estimate(samples([1, 2, 3, 4, 5]))
    assert estimate.value == 3 and not estimate.has_interval and not estimate.excludes_one


def test_ratio_pairs_by_launch_and_block():
    blocks = np.arange(8)
    drift = np.linspace(1, 3, 8)  # what hits a block hits both points
    base, point = samples(10 * drift, blocks=blocks), samples((5 * drift)[::-1], blocks=blocks[::-1])
    estimate = estimates.ratio(base, point)
    assert (estimate.value, estimate.low, estimate.high) == pytest.approx((2, 2, 2))
    assert estimate.n == 8 and estimate.kind.startswith("paired")


def test_paired_ratio_is_the_median_of_ratios():
    a, b = [10, 12, 9, 11, 10, 13], [5, 4, 3, 11, 2, 6.5]
    assert estimates.ratio(samples(a), samples(b)).value == pytest.approx(np.median(np.array(a) / np.array(b)))


def test_ratio_falls_back_to_unpaired_and_says_so():
    rng = np.random.default_rng(1)
    estimate = estimates.ratio(samples(rng.normal(20, 0.1, 10)), samples(rng.normal(10, 0.1, 10), blocks=np.arange(100, 110)))
    assert "do not match" in estimate.note and estimate.kind == "unpaired bootstrap"
    assert estimate.low < 2 < estimate.high


def test_ratio_of_few_pairs_has_no_interval():
    assert not estimates.ratio(samples([2, 2, 2]), samples([1, 1, 1])).has_interval


def test_a_launch_effect_widens_the_interval():
    rng = np.random.default_rng(3)
    launches = np.repeat(np.arange(5), 10)
    blocks = np.tile(np.arange(10), 5)
    noise = lambda: np.exp(rng.normal(0, 0.005, 50))
    layout = np.exp(np.array([0.1, -0.1, 0.05, 0, -0.05]))[launches]  # luck of one process, not shared by the two points
    wide = estimates.ratio(samples(noise() * layout, launches, blocks), samples(noise(), launches, blocks))
    narrow = estimates.ratio(samples(noise(), launches, blocks), samples(noise(), launches, blocks))
    assert wide.high - wide.low > 5 * (narrow.high - narrow.low)
    assert "launches" in estimates.median_estimate(samples(noise(), launches, blocks)).kind


@pytest.mark.parametrize("n", [6, 10, 20])
def test_paired_interval_covers(n):
    rng = np.random.default_rng(n)
    covered = 0
    for _ in range(300):
        drift = np.exp(rng.normal(0, 0.1, n))
        estimate = estimates.ratio(samples(2 * drift * rng.lognormal(0, 0.03, n)), samples(drift * rng.lognormal(0, 0.03, n)))
        covered += estimate.low <= 2 <= estimate.high
    assert covered / 300 > 0.93


def test_harmonic_mean_is_work_over_time():
    assert estimates.harmonic_mean([10, 30]) == pytest.approx(2 / (1 / 10 + 1 / 30)) == pytest.approx(15)
    with pytest.raises(ValueError):
        estimates.harmonic_mean([1, 0])


def test_ratio_of_sums_is_not_a_mean_of_ratios():
    big, small = samples([100.0] * 6), samples([1.0] * 6)
    estimate = estimates.ratio_of_sums([big, small], [samples([50.0] * 6), samples([10.0] * 6)])
    assert estimate.value == pytest.approx(101 / 60)
    assert (estimate.low, estimate.high) == pytest.approx((101 / 60, 101 / 60))


def test_efficiency_and_inverse_keep_the_interval_in_order():
    speedup = Estimate(3.0, 2.0, 4.0, 9, "x")
    assert (estimates.efficiency(speedup, 4).low, estimates.efficiency(speedup, 4).high) == (0.5, 1.0)
    assert (speedup.inverse().low, speedup.inverse().high) == (0.25, 0.5)


def test_geometric_mean_combines_intervals_as_independent() -> None:
    a, b = Estimate(2.0, 1.8, 2.2, 10, "x"), Estimate(8.0, 7.0, 9.0, 12, "x")
    mean = estimates.geometric_mean([a, b])
    assert mean.value == pytest.approx(4.0) and mean.n == 10
    assert mean.low == pytest.approx(4 * np.exp(-np.hypot(np.log(2 / 1.8), np.log(8 / 7)) / 2))
    assert mean.high == pytest.approx(4 * np.exp(np.hypot(np.log(2.2 / 2), np.log(9 / 8)) / 2))
    assert not estimates.geometric_mean([a, Estimate(1.0, None, None, 3, "none")]).has_interval
    inverse = estimates.geometric_mean([a.inverse(), b.inverse()])
    assert (inverse.value, inverse.low, inverse.high) == pytest.approx((1 / mean.value, 1 / mean.high, 1 / mean.low))


def test_widened_intervals_grow_with_the_family() -> None:
    a = Estimate(1.2, 1.1, 1.3, 10, "x")
    assert (estimates.widened(a, 1).low, estimates.widened(a, 1).high) == pytest.approx((1.1, 1.3))
    assert estimates.widened(a, 300).low < estimates.widened(a, 10).low < a.low and estimates.widened(a, 10).high > a.high
    z = stats.norm.ppf(1 - 0.025 / 10) / stats.norm.ppf(0.975)
    assert estimates.widened(a, 10).low == pytest.approx(1.2 * (1.1 / 1.2) ** z)


def test_geometric_means_cover_the_truth() -> None:
    rng = np.random.default_rng(4)
    covered = 0
    for _ in range(200):
        ratios = [estimates.ratio(samples(2 * rng.lognormal(0, 0.02, 12)), samples(rng.lognormal(0, 0.02, 12))) for _ in range(4)]
        mean = estimates.geometric_mean(ratios)
        covered += mean.low <= 2 <= mean.high
    assert covered >= 184  # 95 % of 200, and room for chance
