"""Rank tests against scipy's; Holm's correction and the exact rank sum by hand."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from ..statistics import rank_tests
from .timings import samples


def test_holm_by_hand():
    assert rank_tests.holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert rank_tests.holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert rank_tests.holm([]) == []


def test_rank_test_is_scipys():
    rng = np.random.default_rng(2)
    a, b = samples(rng.normal(11, 1, 12)), samples(rng.normal(10, 1, 12))
    p, name = rank_tests.rank_test(a, b, 1)
    assert name == "Wilcoxon signed-rank" and p == pytest.approx(stats.wilcoxon(np.log(a.values / b.values)).pvalue)
    p, name = rank_tests.rank_test(a, b, 1e9)
    assert name == "Welch t on logarithms"
    assert p == pytest.approx(stats.ttest_ind(np.log(a.values), np.log(b.values), equal_var=False).pvalue)
    p, name = rank_tests.rank_test(a, b, 5000)  # 12 pairs cannot reach 0.05 / 5000
    assert name == "Mann-Whitney" and p == pytest.approx(stats.mannwhitneyu(a.values, b.values, method="exact").pvalue)


def test_exact_rank_sum():
    """Without ties it is scipy's; with ties it counts the ways to deal the midranks."""
    rng = np.random.default_rng(8)
    for n, m in ((6, 6), (7, 12), (25, 25)):
        a, b = rng.normal(0, 1, n), rng.normal(0.7, 1, m)
        assert rank_tests.rank_sum_p(a, b) == pytest.approx(stats.mannwhitneyu(a, b, method="exact").pvalue)
        assert rank_tests.rank_sum_p(np.arange(n), 100.0 + np.arange(m)) == pytest.approx(rank_tests.least_rank_sum_p(n, m))
    a, b = rng.integers(0, 4, 6), rng.integers(1, 5, 7)
    ranks = stats.rankdata(np.concatenate([a, b]))
    off = [abs(ranks[list(chosen)].sum() - 6 * ranks.mean()) for chosen in combinations(range(13), 6)]
    assert rank_tests.rank_sum_p(a, b) == pytest.approx(np.mean(np.array(off) >= off[0] - 1e-9))
    assert rank_tests.least_rank_sum_p(30, 30) == pytest.approx(
        stats.mannwhitneyu(np.arange(30), 100 + np.arange(30), method="asymptotic").pvalue)
