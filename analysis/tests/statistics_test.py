"""Statistics against values computed by hand, against scipy, and by simulation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from .. import statistics as s


def samples(values, launches=None, blocks=None) -> s.Samples:
    values = np.asarray(values, dtype=float)
    return s.Samples(values, np.zeros(len(values), int) if launches is None else np.asarray(launches),
                     np.arange(len(values)) if blocks is None else np.asarray(blocks))


@pytest.mark.parametrize("n, ranks", [(5, None), (6, (1, 6)), (8, (1, 8)), (9, (2, 8)), (10, (2, 9)), (12, (3, 10)), (20, (6, 15))])
def test_order_ranks_are_those_of_the_tables(n, ranks):
    found = s.order_ranks(n)
    assert (found[:2] if found else None) == ranks


def test_order_coverage_is_the_exact_binomial():
    assert s.order_ranks(6)[2] == pytest.approx(1 - 2 / 64)
    assert s.order_ranks(10)[2] == pytest.approx(1 - 2 * 11 / 1024)
    for n in range(6, 80):
        low, high, coverage = s.order_ranks(n)
        assert coverage >= 0.95
        assert coverage == pytest.approx(stats.binom.cdf(high - 1, n, 0.5) - stats.binom.cdf(low - 1, n, 0.5))


@pytest.mark.parametrize("n", [6, 11, 24])
def test_order_interval_covers_the_median_as_often_as_it_says(n):
    rng = np.random.default_rng(n)
    draws = np.sort(rng.lognormal(0, 1, (4000, n)), axis=1)
    low, high, coverage = s.order_ranks(n)
    covered = np.mean((draws[:, low - 1] <= 1) & (draws[:, high - 1] >= 1))
    assert covered == pytest.approx(coverage, abs=0.015)
    assert s.order_interval(draws[0]) == (draws[0][low - 1], draws[0][high - 1])


def test_five_samples_have_no_interval():
    estimate = s.median_estimate(samples([1, 2, 3, 4, 5]))
    assert estimate.value == 3 and not estimate.has_interval and not estimate.excludes_one


def test_ratio_pairs_by_launch_and_block():
    blocks = np.arange(8)
    drift = np.linspace(1, 3, 8)  # what hits a block hits both points
    base, point = samples(10 * drift, blocks=blocks), samples((5 * drift)[::-1], blocks=blocks[::-1])
    estimate = s.ratio(base, point)
    assert (estimate.value, estimate.low, estimate.high) == pytest.approx((2, 2, 2))
    assert estimate.n == 8 and estimate.kind.startswith("paired")


def test_paired_ratio_is_the_median_of_ratios():
    a, b = [10, 12, 9, 11, 10, 13], [5, 4, 3, 11, 2, 6.5]
    assert s.ratio(samples(a), samples(b)).value == pytest.approx(np.median(np.array(a) / np.array(b)))


def test_ratio_falls_back_to_unpaired_and_says_so():
    rng = np.random.default_rng(1)
    estimate = s.ratio(samples(rng.normal(20, 0.1, 10)), samples(rng.normal(10, 0.1, 10), blocks=np.arange(100, 110)))
    assert "do not match" in estimate.note and estimate.kind == "unpaired bootstrap"
    assert estimate.low < 2 < estimate.high


def test_ratio_of_few_pairs_has_no_interval():
    assert not s.ratio(samples([2, 2, 2]), samples([1, 1, 1])).has_interval


def test_a_launch_effect_widens_the_interval():
    rng = np.random.default_rng(3)
    launches = np.repeat(np.arange(5), 10)
    blocks = np.tile(np.arange(10), 5)
    noise = lambda: np.exp(rng.normal(0, 0.005, 50))
    layout = np.exp(np.array([0.1, -0.1, 0.05, 0, -0.05]))[launches]  # luck of one process, not shared by the two points
    wide = s.ratio(samples(noise() * layout, launches, blocks), samples(noise(), launches, blocks))
    narrow = s.ratio(samples(noise(), launches, blocks), samples(noise(), launches, blocks))
    assert wide.high - wide.low > 5 * (narrow.high - narrow.low)
    assert "launches" in s.median_estimate(samples(noise(), launches, blocks)).kind


@pytest.mark.parametrize("n", [6, 10, 20])
def test_paired_interval_covers(n):
    rng = np.random.default_rng(n)
    covered = 0
    for _ in range(300):
        drift = np.exp(rng.normal(0, 0.1, n))
        estimate = s.ratio(samples(2 * drift * rng.lognormal(0, 0.03, n)), samples(drift * rng.lognormal(0, 0.03, n)))
        covered += estimate.low <= 2 <= estimate.high
    assert covered / 300 > 0.93


def test_resampled_medians_agree_with_scipy():
    values = np.random.default_rng(5).lognormal(0, 0.2, 25)
    ours = np.percentile(s._resampled_medians([values]), [2.5, 97.5])
    theirs = stats.bootstrap((values,), np.median, method="percentile", n_resamples=4000, random_state=1).confidence_interval
    assert ours == pytest.approx([theirs.low, theirs.high], rel=0.03)


def test_resampling_unequal_launches_stays_within_the_samples():
    draws = s._resampled_medians([np.array([1.0, 2.0, 3.0]), np.array([10.0])])
    assert np.all(np.isfinite(draws)) and draws.min() >= 1 and draws.max() <= 10


def test_holm_by_hand():
    assert s.holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert s.holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert s.holm([]) == []


def test_rank_test_is_scipys():
    rng = np.random.default_rng(2)
    a, b = samples(rng.normal(11, 1, 12)), samples(rng.normal(10, 1, 12))
    p, name = s.rank_test(a, b, 1)
    assert name == "Wilcoxon signed-rank" and p == pytest.approx(stats.wilcoxon(np.log(a.values / b.values)).pvalue)
    p, name = s.rank_test(a, b, 1e9)
    assert name == "Welch t on logarithms"
    assert p == pytest.approx(stats.ttest_ind(np.log(a.values), np.log(b.values), equal_var=False).pvalue)
    p, name = s.rank_test(a, b, 5000)  # 12 pairs cannot reach 0.05 / 5000
    assert name == "Mann-Whitney" and p == pytest.approx(stats.mannwhitneyu(a.values, b.values, method="exact").pvalue)


def test_harmonic_mean_is_work_over_time():
    assert s.harmonic_mean([10, 30]) == pytest.approx(2 / (1 / 10 + 1 / 30)) == pytest.approx(15)
    with pytest.raises(ValueError):
        s.harmonic_mean([1, 0])


def test_ratio_of_sums_is_not_a_mean_of_ratios():
    big, small = samples([100.0] * 6), samples([1.0] * 6)
    estimate = s.ratio_of_sums([big, small], [samples([50.0] * 6), samples([10.0] * 6)])
    assert estimate.value == pytest.approx(101 / 60)
    assert (estimate.low, estimate.high) == pytest.approx((101 / 60, 101 / 60))


def test_efficiency_and_inverse_keep_the_interval_in_order():
    speedup = s.Estimate(3.0, 2.0, 4.0, 9, "x")
    assert (s.efficiency(speedup, 4).low, s.efficiency(speedup, 4).high) == (0.5, 1.0)
    assert (speedup.inverse().low, speedup.inverse().high) == (0.25, 0.5)


def test_compare_with_best_groups():
    rng = np.random.default_rng(8)
    drift = np.exp(rng.normal(0, 0.05, 12))
    point = lambda mean: samples(mean * drift * np.exp(rng.normal(0, 0.005, 12)))
    best, comparisons = s.compare_with_best([point(10), point(10.001), point(12)])
    assert best in (0, 1)
    assert comparisons[best].verdict == "best"
    assert comparisons[1 - best].verdict in ("same", "ambiguous")
    assert comparisons[2].verdict == "slower" and comparisons[2].ratio.value == pytest.approx(1.2, rel=0.02)
    assert comparisons[2].superiority > 0.8


def test_identical_samples_are_the_same():
    values = samples(np.linspace(9.9, 10.1, 10))
    _, comparisons = s.compare_with_best([values, values, values])
    assert [c.verdict for c in comparisons] == ["best", "same", "same"]
    assert all(c.p_holm == 1 for c in comparisons)


def test_equal_points_are_rarely_told_apart():
    rng = np.random.default_rng(11)
    wrong = 0
    for _ in range(150):
        group = [samples(rng.lognormal(0, 0.02, 10)) for _ in range(12)]
        wrong += any(c.verdict == "slower" for c in s.compare_with_best(group)[1])
    assert wrong / 150 <= 0.06


def test_large_differences_are_told_apart_with_few_samples():
    rng = np.random.default_rng(12)
    group = [samples((1 + i) * rng.lognormal(0, 0.01, 6)) for i in range(40)]
    _, comparisons = s.compare_with_best(group)
    assert [c.verdict for c in comparisons] == ["best"] + ["slower"] * 39
    assert {c.test for c in comparisons[1:]} == {s.WELCH}


def test_launches_that_differ_are_not_taken_for_points_that_differ() -> None:
    rng = np.random.default_rng(5)
    launches, blocks = np.repeat(np.arange(5), 5), np.tile(np.arange(5), 5) * 5 + np.repeat(np.arange(5), 5)
    wrong = 0
    for _ in range(60):
        group = [s.Samples(10 * np.exp(rng.normal(0, 0.03, 25) + np.repeat(rng.normal(0, 0.03, 5), 5)), launches, blocks)
                 for _ in range(12)]
        wrong += any(c.verdict == "slower" for c in s.compare_with_best(group)[1])
    assert wrong <= 6  # 5 % of 60, and room for chance


def test_a_difference_that_all_launches_show_is_found() -> None:
    rng = np.random.default_rng(6)
    launches, blocks = np.repeat(np.arange(5), 5), np.tile(np.arange(5), 5) * 5 + np.repeat(np.arange(5), 5)
    group = [s.Samples(mean * np.exp(rng.normal(0, 0.01, 25)), launches, blocks) for mean in (10.0, 12.0)]
    best, comparisons = s.compare_with_best(group)
    assert best == 0 and comparisons[1].verdict == "slower"


def test_geometric_mean_combines_intervals_as_independent() -> None:
    a, b = s.Estimate(2.0, 1.8, 2.2, 10, "x"), s.Estimate(8.0, 7.0, 9.0, 12, "x")
    mean = s.geometric_mean([a, b])
    assert mean.value == pytest.approx(4.0) and mean.n == 10
    assert mean.low == pytest.approx(4 * np.exp(-np.hypot(np.log(2 / 1.8), np.log(8 / 7)) / 2))
    assert mean.high == pytest.approx(4 * np.exp(np.hypot(np.log(2.2 / 2), np.log(9 / 8)) / 2))
    assert not s.geometric_mean([a, s.Estimate(1.0, None, None, 3, "none")]).has_interval
    inverse = s.geometric_mean([a.inverse(), b.inverse()])
    assert (inverse.value, inverse.low, inverse.high) == pytest.approx((1 / mean.value, 1 / mean.high, 1 / mean.low))


def test_widened_intervals_grow_with_the_family() -> None:
    a = s.Estimate(1.2, 1.1, 1.3, 10, "x")
    assert (s.widened(a, 1).low, s.widened(a, 1).high) == pytest.approx((1.1, 1.3))
    assert s.widened(a, 300).low < s.widened(a, 10).low < a.low and s.widened(a, 10).high > a.high
    z = stats.norm.ppf(1 - 0.025 / 10) / stats.norm.ppf(0.975)
    assert s.widened(a, 10).low == pytest.approx(1.2 * (1.1 / 1.2) ** z)


def test_geometric_means_cover_the_truth() -> None:
    rng = np.random.default_rng(4)
    covered = 0
    for _ in range(200):
        ratios = [s.ratio(samples(2 * rng.lognormal(0, 0.02, 12)), samples(rng.lognormal(0, 0.02, 12))) for _ in range(4)]
        mean = s.geometric_mean(ratios)
        covered += mean.low <= 2 <= mean.high
    assert covered >= 184  # 95 % of 200, and room for chance


def test_exact_rank_sum():
    """Without ties it is scipy's; with ties it counts the ways to deal the midranks."""
    from itertools import combinations
    rng = np.random.default_rng(8)
    for n, m in ((6, 6), (7, 12), (25, 25)):
        a, b = rng.normal(0, 1, n), rng.normal(0.7, 1, m)
        assert s.rank_sum_p(a, b) == pytest.approx(stats.mannwhitneyu(a, b, method="exact").pvalue)
        assert s.rank_sum_p(np.arange(n), 100.0 + np.arange(m)) == pytest.approx(s.least_rank_sum_p(n, m))
    a, b = rng.integers(0, 4, 6), rng.integers(1, 5, 7)
    ranks = stats.rankdata(np.concatenate([a, b]))
    off = [abs(ranks[list(chosen)].sum() - 6 * ranks.mean()) for chosen in combinations(range(13), 6)]
    assert s.rank_sum_p(a, b) == pytest.approx(np.mean(np.array(off) >= off[0] - 1e-9))
    assert s.least_rank_sum_p(30, 30) == pytest.approx(
        stats.mannwhitneyu(np.arange(30), 100 + np.arange(30), method="asymptotic").pvalue)


def test_numbers_that_are_none():
    assert not any(map(s.is_number, (10**400, float("nan"), float("inf"), True, "1", None, [])))
    assert s.is_number(10**300)


def launched(rng, factors, launches=5, blocks=4, spread=0.04):
    """Points of these mean times whose launches differ by `spread`."""
    cells = np.repeat(np.arange(launches), blocks), np.tile(np.arange(blocks), launches)
    return [s.Samples(factor * np.exp(np.repeat(rng.normal(0, spread, launches), blocks) + rng.normal(0, 0.01, launches * blocks)), *cells)
            for factor in factors]


def test_five_launches_suffice_for_a_heat_map():
    """A ratio of 1.5 among 30 points of three panels, whose launches differ by 4 %: alone, four degrees of freedom are too few."""
    _, comparisons = s.compare_with_best(launched(np.random.default_rng(3), [10.0] * 15 + [15.0] * 15), families=3)
    assert {c.verdict for c in comparisons[15:]} == {"slower"} and not any(c.verdict == "slower" for c in comparisons[:15])


def test_equal_points_whose_launches_differ_are_not_told_apart():
    rng = np.random.default_rng(5)
    wrong = sum(any(c.verdict == "slower" for c in s.compare_with_best(launched(rng, [10.0] * 8))[1]) for _ in range(60))
    assert wrong <= 6  # 0.05 of 60 is 3; more than 6 has a chance of 3 %


def test_a_point_of_its_own_spread_is_judged_by_it():
    quiet = launched(np.random.default_rng(7), [10.0] * 9, spread=0.01)
    rough = launched(np.random.default_rng(8), [11.5], spread=0.3)
    p = s.launch_tests([*quiet, *rough], best=0)
    assert p[0] == 1 and p[-1] == pytest.approx(s.launch_tests([quiet[0], rough[0]], best=0)[1])
