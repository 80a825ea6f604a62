"""Points against the fastest of their group: what is told apart, and how often wrongly."""

from __future__ import annotations

import numpy as np
import pytest

from ..statistics import launch_tests, rank_tests
from ..statistics.fastest import compare_with_best
from ..statistics.samples import Samples
from .timings import samples


def test_compare_with_best_groups():
    rng = np.random.default_rng(8)
    drift = np.exp(rng.normal(0, 0.05, 12))
    point = lambda mean: samples(mean * drift * np.exp(rng.normal(0, 0.005, 12)))
    best, comparisons = compare_with_best([point(10), point(10.001), point(12)])
    assert best in (0, 1)
    assert comparisons[best].verdict == "best"
    assert comparisons[1 - best].verdict in ("same", "ambiguous")
    assert comparisons[2].verdict == "slower" and comparisons[2].ratio.value == pytest.approx(1.2, rel=0.02)
    assert comparisons[2].superiority > 0.8


def test_identical_samples_are_the_same():
    values = samples(np.linspace(9.9, 10.1, 10))
    _, comparisons = compare_with_best([values, values, values])
    assert [c.verdict for c in comparisons] == ["best", "same", "same"]
    assert all(c.p_holm == 1 for c in comparisons)


def test_equal_points_are_rarely_told_apart():
    rng = np.random.default_rng(11)
    wrong = 0
    for _ in range(150):
        group = [samples(rng.lognormal(0, 0.02, 10)) for _ in range(12)]
        wrong += any(c.verdict == "slower" for c in compare_with_best(group)[1])
    assert wrong / 150 <= 0.06


def test_large_differences_are_told_apart_with_few_samples():
    rng = np.random.default_rng(12)
    group = [samples((1 + i) * rng.lognormal(0, 0.01, 6)) for i in range(40)]
    _, comparisons = compare_with_best(group)
    assert [c.verdict for c in comparisons] == ["best"] + ["slower"] * 39
    assert {c.test for c in comparisons[1:]} == {rank_tests.WELCH}


def test_launches_that_differ_are_not_taken_for_points_that_differ() -> None:
    rng = np.random.default_rng(5)
    launches, blocks = np.repeat(np.arange(5), 5), np.tile(np.arange(5), 5) * 5 + np.repeat(np.arange(5), 5)
    wrong = 0
    for _ in range(60):
        group = [Samples(10 * np.exp(rng.normal(0, 0.03, 25) + np.repeat(rng.normal(0, 0.03, 5), 5)), launches, blocks)
                 for _ in range(12)]
        wrong += any(c.verdict == "slower" for c in compare_with_best(group)[1])
    assert wrong <= 6  # 5 % of 60, and room for chance


def test_a_difference_that_all_launches_show_is_found() -> None:
    rng = np.random.default_rng(6)
    launches, blocks = np.repeat(np.arange(5), 5), np.tile(np.arange(5), 5) * 5 + np.repeat(np.arange(5), 5)
    group = [Samples(mean * np.exp(rng.normal(0, 0.01, 25)), launches, blocks) for mean in (10.0, 12.0)]
    best, comparisons = compare_with_best(group)
    assert best == 0 and comparisons[1].verdict == "slower"


def launched(rng, factors, launches=5, blocks=4, spread=0.04):
    """Points of these mean times whose launches differ by `spread`."""
    cells = np.repeat(np.arange(launches), blocks), np.tile(np.arange(blocks), launches)
    return [Samples(factor * np.exp(np.repeat(rng.normal(0, spread, launches), blocks) + rng.normal(0, 0.01, launches * blocks)), *cells)
            for factor in factors]


def test_five_launches_suffice_for_a_heat_map():
    """A ratio of 1.5 among 30 points of three panels, whose launches differ by 4 %: alone, four degrees of freedom are too few."""
    _, comparisons = compare_with_best(launched(np.random.default_rng(3), [10.0] * 15 + [15.0] * 15), families=3)
    assert {c.verdict for c in comparisons[15:]} == {"slower"} and not any(c.verdict == "slower" for c in comparisons[:15])


def test_equal_points_whose_launches_differ_are_not_told_apart():
    rng = np.random.default_rng(5)
    wrong = sum(any(c.verdict == "slower" for c in compare_with_best(launched(rng, [10.0] * 8))[1]) for _ in range(60))
    assert wrong <= 6  # 0.05 of 60 is 3; more than 6 has a chance of 3 %


def test_a_point_of_its_own_spread_is_judged_by_it():
    quiet = launched(np.random.default_rng(7), [10.0] * 9, spread=0.01)
    rough = launched(np.random.default_rng(8), [11.5], spread=0.3)
    p = launch_tests.launch_tests([*quiet, *rough], best=0)
    assert p[0] == 1 and p[-1] == pytest.approx(launch_tests.launch_tests([quiet[0], rough[0]], best=0)[1])
