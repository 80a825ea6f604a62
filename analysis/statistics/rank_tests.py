"""Whether samples of two points differ, without a distribution where they suffice; Holm's correction for several tests."""

from __future__ import annotations

import math
import warnings
from typing import Sequence

import numpy as np
from scipy import stats

from .intervals import CONFIDENCE, MIN_SAMPLES
from .samples import Samples, paired

EXACT_PAIRS = 625  # pairs of samples up to which Mann-Whitney is exact: 25 against 25
SIGNED_RANK, RANK_SUM, WELCH = "Wilcoxon signed-rank", "Mann-Whitney", "Welch t on logarithms"


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's step-down correction, in the order given."""
    p = np.asarray(p_values, dtype=float)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty_like(p)
    running = 0.0
    for rank, index in enumerate(order):
        running = max(running, min(1.0, (len(p) - rank) * p[index]))
        adjusted[index] = running
    return adjusted.tolist()


def rank_test(slower: Samples, faster: Samples, family: float) -> tuple[float, str]:
    """Two-sided p and the name of the test: the first of three that can reach significance in a family of this size.

    n pairs give the signed-rank test no p below 2 / 2^n, and two times n samples give Mann-Whitney none below
    2 / (2n over n), however large the difference. Mann-Whitney ignores the pairing, which is safe: blocks that drift
    together make its null distribution too wide. Welch's t on logarithms comes last, because it assumes a distribution.
    The choice depends on the counts only, never on the times.
    """
    level = 1 - CONFIDENCE
    groups = paired(slower, faster)
    pairs = np.concatenate(groups) if groups else np.array([])
    a, b = slower.values, faster.values
    if len(pairs) >= MIN_SAMPLES and 2.0 ** (1 - len(pairs)) * family < level:
        differences = np.log(pairs)
        if not np.any(differences):
            return 1.0, SIGNED_RANK
        with warnings.catch_warnings():  # zeros and ties switch to the normal approximation, which is what we want
            warnings.simplefilter("ignore")
            return float(stats.wilcoxon(differences).pvalue), SIGNED_RANK
    if min(len(a), len(b)) < MIN_SAMPLES:
        return 1.0, "none"
    return unpaired_test(a, b, family)


def unpaired_test(a: np.ndarray, b: np.ndarray, family: float) -> tuple[float, str]:
    """Two-sided p and the name of the test of samples that share no blocks: Mann-Whitney where its least p survives the
    correction in a family of this size, else Welch's t on logarithms. The choice depends on the counts only."""
    rank_sum = least_rank_sum_p(len(a), len(b)) * family < 1 - CONFIDENCE
    if np.ptp(np.concatenate([a, b])) == 0:
        return 1.0, RANK_SUM if rank_sum else WELCH
    if rank_sum:
        return rank_sum_p(a, b), RANK_SUM
    with warnings.catch_warnings():  # equal samples have no variance; then p is nan or 0
        warnings.simplefilter("ignore")
        p = float(stats.ttest_ind(np.log(a), np.log(b), equal_var=False).pvalue)
    return (p if math.isfinite(p) else 1.0), WELCH


def least_rank_sum_p(n: int, m: int) -> float:
    """The least p that rank_sum_p gives n and m samples without ties: that of two runs without overlap."""
    if n * m <= EXACT_PAIRS:
        return 2 / math.comb(n + m, n)
    return float(2 * stats.norm.sf((n * m / 2 - 0.5) / math.sqrt(n * m * (n + m + 1) / 12)))


def rank_sum_p(a: np.ndarray, b: np.ndarray) -> float:
    """Two-sided p of Mann-Whitney: exact, over all ways to deal the (mid)ranks, up to EXACT_PAIRS pairs; normal beyond.
    Ties are dealt as they are (Streitberg and Roehmel, Exact distributions for permutation and rank tests, 1986), so that a
    clock of few digits does not cost the exact test."""
    if len(a) * len(b) > EXACT_PAIRS:
        return float(stats.mannwhitneyu(a, b, alternative="two-sided", method="asymptotic").pvalue)
    ranks = np.rint(2 * stats.rankdata(np.concatenate([a, b]))).astype(int)  # midranks are halves
    ways = np.zeros((len(a) + 1, int(ranks.sum()) + 1))  # [how many were taken][their sum]; exact in double up to 2^53
    ways[0, 0] = 1
    for rank in ranks:
        ways[1:, rank:] += ways[:-1, :-rank].copy()
    off = np.abs(np.arange(ways.shape[1]) * len(ranks) - len(a) * int(ranks.sum()))  # from the mean, in whole numbers
    observed = off[int(ranks[: len(a)].sum())]
    return float(min(1.0, ways[-1][off >= observed].sum() / ways[-1].sum()))


def superiority(slower: Samples, faster: Samples) -> float:
    """Probability that a sample of the first takes longer than one of the second (ties count half)."""
    difference = slower.values[:, None] - faster.values[None, :]
    return float((np.sum(difference > 0) + 0.5 * np.sum(difference == 0)) / difference.size)
