"""Drift and outliers: found where they are, at most as often as stated where they are not, and never dropped."""

from __future__ import annotations

import numpy as np
import pytest

from .. import steadiness
from ..statistics.samples import Samples


def samples(values):
    values = np.asarray(values, dtype=float)
    return Samples(values, np.zeros(len(values), dtype=int), np.arange(len(values)))


def steady(rng, n=40, spread=0.03):
    return 10 * np.exp(rng.normal(0, spread, n))


def test_drift_is_found_with_its_size():
    rng = np.random.default_rng(1)
    (found,) = steadiness.judge([samples(steady(rng, 60) * np.linspace(1, 1.2, 60))], 0.02)
    assert found.drift == pytest.approx(0.18, abs=0.04)  # from 1 to 1.2 around a median of 1.1
    assert found.p_holm < 1e-6 and found.words.startswith("drift +1")


def test_drift_within_the_target_is_none():
    values = np.linspace(10, 10.1, 60)  # a perfect trend of 1 %
    (found,) = steadiness.judge([samples(values)], 0.02)
    assert found.drift is None and found.words == "" and found.p_holm < 1e-6
    (strict,) = steadiness.judge([samples(values)], 0.005)
    assert strict.drift == pytest.approx(0.01, abs=0.001)


def test_steady_studies_are_rarely_said_to_drift():
    """Holm over the points: in at most 5 % of the studies any of their 20 points, which uncorrected would be 64 %."""
    rng = np.random.default_rng(2)
    studies = [steadiness.judge([samples(steady(rng, 20, 0.1)) for _ in range(20)], 0.001) for _ in range(200)]
    assert sum(any(point.drift is not None for point in study) for study in studies) <= 20  # 5 % of 200, and three deviations


def test_outliers_are_counted_with_the_largest():
    rng = np.random.default_rng(3)
    values = steady(rng)
    values[5], values[20] = 30, 1
    (found,) = steadiness.judge([samples(values)], 0.02)
    assert found.outliers == 2 and found.largest == pytest.approx(3, rel=0.05)
    assert "2 outliers" in found.words


def test_the_grain_of_a_clock_makes_no_outlier():
    """A distance between the quartiles of nearly 0 calls everything far out; what is within the target is not."""
    values = np.full(40, 10.0)
    values[7] = 10.1
    assert steadiness.judge([samples(values)], 0.02)[0].outliers == 0
    assert steadiness.judge([samples(values)], 0.005)[0].outliers == 1


def test_few_samples_are_not_judged():
    assert steadiness.judge([samples([1, 2, 3, 4, 5, 6, 7, 8, 90])], 0.02) == [steadiness.Steadiness(None, 1.0, 0, 1.0)]
    assert steadiness.judge([], 0.02) == []


def test_many_samples_are_thinned_for_the_slope_only():
    rng = np.random.default_rng(4)
    (found,) = steadiness.judge([samples(steady(rng, 3000) * np.linspace(1, 1.5, 3000))], 0.02)
    assert found.drift == pytest.approx(0.4, abs=0.03)
