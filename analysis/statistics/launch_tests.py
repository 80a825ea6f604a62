"""Whether two points differ over launches, which are what repeats: blocks of one launch share its memory layout."""

from __future__ import annotations

import math
from typing import Sequence

import numpy as np
from scipy import stats

from .intervals import CONFIDENCE
from .samples import Samples, paired_by_launch


def launch_tests(group: Sequence[Samples], best: int) -> list[float]:
    """Two-sided p of every point against the best by a t test over launches, of one mean log ratio a launch: blocks of one
    launch share its memory layout, so launches, not blocks, are what repeats.

    Five launches say little about their own spread (with four degrees of freedom t must be 20 to survive a correction for a
    heat map), but all points together say much: points x launches is a complete block design with two factors, whose residual
    variance has (points - 2) (launches - 1) degrees of freedom (Box, Hunter and Hunter, Statistics for Experimenters, 2005,
    chapter 4; the best's own deviations are common to all ratios and go with the launches). Points need not be alike: where
    one's ratios vary more, its own variance counts, and where an F test tells them from the others, its own degrees of freedom. A p is 0 where both points have one launch: such a study speaks
    of that launch only (checks.py says so in the report); 1 where no two launches hold pairs. The best's own is 1.
    """
    alone = group[best].launch_count == 1
    means: dict[int, dict[int, float]] = {}
    for i, samples in enumerate(group):
        if i != best and not (alone and samples.launch_count == 1):
            means[i] = launch_log_ratios(samples, group[best])
    launches = sorted({launch for row in means.values() for launch in row})
    logs = np.array([[row.get(launch, np.nan) for launch in launches] for row in means.values()])
    pooled, freedom = 0.0, 0
    if logs.size and len(logs) > 1:
        logs = logs[:, np.sum(np.isfinite(logs), axis=0) > 1]  # a launch of one point says nothing of the others
        many = np.sum(np.isfinite(logs), axis=1)
        residuals = logs[many > 1] - np.nanmean(logs[many > 1], axis=1, keepdims=True) if np.any(many > 1) else logs[:0]
        if residuals.size:
            residuals = residuals - np.nanmean(residuals, axis=0)
            freedom = (len(residuals) - 1) * (residuals.shape[1] - 1) - int(np.sum(np.isnan(residuals)))
            pooled = 2 * float(np.nansum(residuals**2)) / freedom if freedom > 0 else 0.0
    result = []
    for i in range(len(group)):
        if i == best:
            result.append(1.0)
        elif i not in means:
            result.append(0.0)
        else:
            result.append(_launch_p(np.array(list(means[i].values())), pooled, freedom))
    return result


def _launch_p(logs: np.ndarray, pooled: float, freedom: int) -> float:
    """p of a mean that is not 0; pooled: a variance, with its degrees of freedom, below which that of the logs is chance."""
    if len(logs) < 2:
        return 1.0
    mean, own = float(np.mean(logs)), float(np.var(logs, ddof=1))
    variance, degrees = max(own, pooled), freedom
    if freedom == 0 or own > pooled * stats.f.ppf(CONFIDENCE, len(logs) - 1, freedom):
        variance, degrees = own, len(logs) - 1  # not one of the others' kind
    if variance == 0:
        return 0.0 if mean else 1.0
    return float(2 * stats.t.sf(abs(mean) / math.sqrt(variance / len(logs)), degrees))


def launch_log_ratios(numerator: Samples, denominator: Samples) -> dict[int, float]:
    """launch: mean of the logarithms of the paired ratios."""
    return {launch: float(np.mean(np.log(ratios))) for launch, ratios in paired_by_launch(numerator, denominator).items()}


def launch_medians(samples: Samples) -> np.ndarray:
    """The logarithm of each launch's median: what repeats independently in a run."""
    return np.log([np.median(group) for group in samples.by_launch])
