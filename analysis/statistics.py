"""The statistics of the report. Intervals assume no distribution of the times, nor do tests if the samples suffice.

Medians carry order-statistic intervals (exact binomial). Ratios are medians of ratios of samples that share a launch and
a block, because a block meets the same drift; their intervals are bootstrapped over launches, then blocks, because the
samples of one process share one memory layout and are not independent of each other.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import Sequence

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 2000
SEED = 20240229  # fixed, so that the same records always give the same report
MIN_SAMPLES = 6  # below it, [min, max] covers the median with less than 95 %
MIN_LAUNCHES = 5
EXACT_PAIRS = 625  # pairs of samples up to which Mann-Whitney is exact: 25 against 25
SIGNED_RANK, RANK_SUM, WELCH = "Wilcoxon signed-rank", "Mann-Whitney", "Welch t on logarithms"


@dataclass(frozen=True)
class Samples:
    """Times of one point in the order they were taken, each with the launch and the block it belongs to."""

    values: np.ndarray
    launches: np.ndarray
    blocks: np.ndarray

    @property
    def n(self) -> int:
        return len(self.values)

    @property
    def launch_count(self) -> int:
        return len(np.unique(self.launches))

    def by_block(self) -> dict[tuple[int, int], float]:
        cells: dict[tuple[int, int], list[float]] = {}
        for value, launch, block in zip(self.values, self.launches, self.blocks):
            cells.setdefault((int(launch), int(block)), []).append(float(value))
        return {key: float(np.median(cell)) for key, cell in cells.items()}

    def by_launch(self) -> list[np.ndarray]:
        return [self.values[self.launches == launch] for launch in np.unique(self.launches)]


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval; without one (low, high None) where the samples are too few."""

    value: float
    low: float | None
    high: float | None
    n: int
    kind: str
    note: str = ""

    @property
    def has_interval(self) -> bool:
        return self.low is not None and self.high is not None

    @property
    def excludes_one(self) -> bool:
        return self.has_interval and (self.low > 1.0 or self.high < 1.0)

    def scaled(self, factor: float) -> Estimate:
        low, high = (None if bound is None else bound * factor for bound in (self.low, self.high))
        return replace(self, value=self.value * factor, low=low, high=high)

    def inverse(self) -> Estimate:
        low, high = (None if bound is None else 1.0 / bound for bound in (self.high, self.low))
        return replace(self, value=1.0 / self.value, low=low, high=high)


@dataclass(frozen=True)
class Comparison:
    """A point against the fastest of its group: ratio = its time / the time of the fastest."""

    ratio: Estimate
    p: float
    p_holm: float
    superiority: float  # share of sample pairs in which the point is slower: 0.5 none, 1 always
    test: str
    verdict: str  # "best", "slower", "same" or "ambiguous"

    @property
    def distinguishable(self) -> bool:
        return self.verdict == "slower"


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


def median_estimate(samples: Samples) -> Estimate:
    """The median; with enough launches its interval lets the launches vary too."""
    value = float(np.median(samples.values))
    if samples.launch_count >= MIN_LAUNCHES:
        low, high = _quantiles(_resampled_medians(samples.by_launch()))
        return Estimate(value, low, high, samples.n, "bootstrap over launches, then blocks")
    bounds = order_interval(samples.values)
    if bounds is None:
        return Estimate(value, None, None, samples.n, "none", "fewer than 6 samples")
    return Estimate(value, *bounds, samples.n, "order statistics")


def paired_by_launch(numerator: Samples, denominator: Samples) -> dict[int, np.ndarray]:
    """launch: ratios of the samples that share it and a block."""
    above, below = numerator.by_block(), denominator.by_block()
    launches: dict[int, list[float]] = {}
    for key in sorted(above.keys() & below.keys()):
        launches.setdefault(key[0], []).append(above[key] / below[key])
    return {launch: np.array(ratios) for launch, ratios in launches.items()}


def paired(numerator: Samples, denominator: Samples) -> list[np.ndarray]:
    """Ratios of the samples that share launch and block, one array a launch."""
    return list(paired_by_launch(numerator, denominator).values())


def paired_samples(numerator: Samples, denominator: Samples) -> Samples:
    """The paired ratios as samples of their own, so that ratios can be compared with ratios."""
    above, below = numerator.by_block(), denominator.by_block()
    keys = sorted(above.keys() & below.keys())
    return Samples(np.array([above[key] / below[key] for key in keys]), np.array([key[0] for key in keys], dtype=int),
                   np.array([key[1] for key in keys], dtype=int))


def ratio(numerator: Samples, denominator: Samples) -> Estimate:
    """The median of paired ratios with its bootstrap interval; unpaired where too few blocks match."""
    groups = paired(numerator, denominator)
    pairs = sum(len(group) for group in groups)
    smaller = min(numerator.n, denominator.n)
    if pairs >= MIN_SAMPLES or (pairs and pairs == smaller):
        value = float(np.median(np.concatenate(groups)))
        if pairs < MIN_SAMPLES:
            return Estimate(value, None, None, pairs, "none", "fewer than 6 pairs")
        # One launch has nothing to resample but its blocks, and there the exact interval of the median of n ratios
        # exists. The percentile bootstrap alone covers less than it says for small n, so the wider of the two counts.
        low, high = _quantiles(_resampled_medians(groups))
        kind = "paired, bootstrap over launches, then blocks"
        if len(groups) == 1:
            exact = order_interval(groups[0])
            low, high = min(low, exact[0]), max(high, exact[1])
            kind = "paired, bootstrap over blocks"
        return Estimate(value, low, high, pairs, kind)
    value = float(np.median(numerator.values) / np.median(denominator.values))
    note = "unpaired: blocks do not match"
    if smaller < MIN_SAMPLES:
        return Estimate(value, None, None, smaller, "none", "fewer than 6 samples")
    above = _resampled_medians(numerator.by_launch())
    below = _resampled_medians(denominator.by_launch(), SEED + 1)
    low, high = _quantiles(above / below)
    return Estimate(value, low, high, smaller, "unpaired bootstrap", note)


def efficiency(speedup: Estimate, threads: int) -> Estimate:
    return speedup.scaled(1.0 / threads)


def share(part: np.ndarray, whole: np.ndarray) -> Estimate:
    """The median of part / whole, sample by sample."""
    shares = np.asarray(part, dtype=float) / np.asarray(whole, dtype=float)
    bounds = order_interval(shares)
    low, high = bounds if bounds else (None, None)
    return Estimate(float(np.median(shares)), low, high, len(shares), "order statistics" if bounds else "none")


def ratio_of_sums(numerators: Sequence[Samples], denominators: Sequence[Samples]) -> Estimate:
    """Over scenes: the ratio of summed medians, never a mean of ratios. Scenes are fixed, samples are resampled."""
    above = sum(float(np.median(s.values)) for s in numerators)
    below = sum(float(np.median(s.values)) for s in denominators)
    n = min(s.n for s in (*numerators, *denominators))
    if n < MIN_SAMPLES:
        return Estimate(above / below, None, None, n, "none", "fewer than 6 samples")
    # Distinct seeds: points are resampled independently of each other.
    top = sum(_resampled_medians(s.by_launch(), SEED + 2 * i) for i, s in enumerate(numerators))
    bottom = sum(_resampled_medians(s.by_launch(), SEED + 2 * i + 1) for i, s in enumerate(denominators))
    low, high = _quantiles(top / bottom)
    return Estimate(above / below, low, high, n, "unpaired bootstrap")


def geometric_mean(ratios: Sequence[Estimate]) -> Estimate:
    """Over scenes: the geometric mean of ratios, the one mean that gives the same order whichever point is the base.

    The half widths of the intervals on the log scale add up as roots of summed squares, each side on its own (Zou and
    Donner, Construction of confidence limits about effect measures, 2008). The scenes count as independent.
    """
    logs = np.log([r.value for r in ratios])
    value, n = float(np.exp(logs.mean())), min(r.n for r in ratios)
    if not all(r.has_interval for r in ratios):
        return Estimate(value, None, None, n, "none", "a scene has no interval")
    below, above = (float(np.linalg.norm(logs - np.log(bounds))) / len(ratios)
                    for bounds in ([r.low for r in ratios], [r.high for r in ratios]))
    return Estimate(value, value * math.exp(-below), value * math.exp(above), n, "combined from the scenes' intervals")


def widened(estimate: Estimate, family: float) -> Estimate:
    """The interval of a ratio at level 0.05 / family (Bonferroni): its ends move out as those of a normal distribution on
    the log scale would."""
    if not estimate.has_interval:
        return estimate
    tail = (1 - CONFIDENCE) / 2
    factor = float(stats.norm.ppf(1 - tail / max(1.0, family)) / stats.norm.ppf(1 - tail))
    low, high = (estimate.value * (bound / estimate.value) ** factor for bound in (estimate.low, estimate.high))
    return replace(estimate, low=low, high=high)


def harmonic_mean(rates: Sequence[float]) -> float:
    """The mean of rates over equal amounts of work: total work / total time."""
    values = np.asarray(rates, dtype=float)
    if len(values) == 0 or np.any(values <= 0):
        raise ValueError("a harmonic mean needs positive rates")
    return float(len(values) / np.sum(1.0 / values))


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
    return np.log([np.median(group) for group in samples.by_launch()])


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
    above, below = _resampled_medians(samples.by_launch()), _resampled_medians(base.by_launch(), SEED + 1)
    low, high = _quantiles(above / below)
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


def superiority(slower: Samples, faster: Samples) -> float:
    """Probability that a sample of the first takes longer than one of the second (ties count half)."""
    difference = slower.values[:, None] - faster.values[None, :]
    return float((np.sum(difference > 0) + 0.5 * np.sum(difference == 0)) / difference.size)


def compare_with_best(group: Sequence[Samples], target: float = 0.02, families: float = 1) -> tuple[int, list[Comparison]]:
    """Index of the lowest median, and every point against it. Slower needs the interval and the corrected tests, over
    samples and over launches: without the second, 12 equal points whose launches differ by 3 % gave a difference in half
    of the simulated studies.

    Holm corrects for the comparisons of this group. On top, by Bonferroni: the fastest was picked from the same samples,
    so the family is all pairs (without it, 12 equal points gave a difference in 12 % of simulated studies, not in 5 %);
    and families is the number of such groups among which a reader, or findings.py, looks for differences.
    """
    best = int(np.argmin([np.median(samples.values) for samples in group]))
    others = [i for i in range(len(group)) if i != best]
    families *= max(1.0, len(group) / 2)
    tests = {i: rank_test(group[i], group[best], len(others) * families) for i in others}
    by_launch = launch_tests(group, best)
    tests = {i: (max(p, by_launch[i]), name) for i, (p, name) in tests.items()}
    corrected = dict(zip(others, (min(1.0, p * families) for p in holm([tests[i][0] for i in others]))))
    comparisons = []
    for i, samples in enumerate(group):
        if i == best:
            one = Estimate(1.0, None, None, samples.n, "none")
            comparisons.append(Comparison(one, 1.0, 1.0, 0.5, "none", "best"))
            continue
        quotient = ratio(samples, group[best])
        verdict = "ambiguous"
        if quotient.has_interval and quotient.low > 1.0 and corrected[i] < 1 - CONFIDENCE:
            verdict = "slower"
        elif quotient.has_interval and 1 - target < quotient.low and quotient.high < 1 + target:
            verdict = "same"
        p, test = tests[i]
        comparisons.append(Comparison(quotient, p, corrected[i], superiority(samples, group[best]), test, verdict))
    return best, comparisons


def _resampled_medians(groups: Sequence[np.ndarray], seed: int = SEED) -> np.ndarray:
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


def _quantiles(draws: np.ndarray) -> tuple[float, float]:
    tail = 100 * (1 - CONFIDENCE) / 2
    low, high = np.percentile(draws, [tail, 100 - tail])
    return float(low), float(high)


def is_close(a: float, b: float) -> bool:
    """Whether a stored number is the computed one: six digits are written."""
    return math.isclose(a, b, rel_tol=1e-4, abs_tol=1e-6)


def is_number(value: object) -> bool:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # JSON has integers of any length
        return False
