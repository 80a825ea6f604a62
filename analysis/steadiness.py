"""How steady the times of a point were: drift over its samples and outliers among them, labelled and never dropped.

Drift: Kendall's rank correlation between the times and their order, as Mann tests a trend (Holm over the timed points of the study,
level 0.05; its p is exact for few samples, where Spearman's errs by a fifth), whose size over the run, by Theil and Sen's slope,
exceeds the target of the study: a test finds any trend, and a small one does not matter.
Outliers: times beyond the quartiles by more than three times their distance (Tukey's far out), and further from the median than
the target, so that the grain of the clock makes none; from ten samples on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np
from scipy import stats

from . import text
from .load import Record
from .statistics import rank_tests
from .statistics.samples import Samples

LEVEL = 0.05  # of drift, over all points of a study
FENCE = 3.0  # interquartile distances
LEAST = 10  # samples, below which neither is looked for
MOST_SLOPES = 400  # samples whose slopes in pairs are taken; more are thinned evenly
RULE = f"Drift: Kendall's rank correlation of time and order, Holm-corrected, and a change beyond the target. Outliers lie beyond the quartiles by" \
       f" more than {FENCE:g} times their distance, and further from the median than the target; all are kept."


@dataclass(frozen=True)
class Steadiness:
    drift: float | None  # change from the first sample to the last, as a share of the median; None: none found
    p_holm: float  # 1 where too few samples were taken to tell
    outliers: int
    largest: float  # of the outliers, over the median; 1 without one

    @property
    def words(self) -> str:
        said = [] if self.drift is None else [f"drift {100 * self.drift:+.1f} %"]
        if self.outliers:
            said.append(text.count(self.outliers, "outlier"))
        return ", ".join(said)


def judge(points: Sequence[Samples], target: float) -> list[Steadiness]:
    """Of all timed points of a study, in their order. target: the share of a median that the study asked for."""
    corrected = rank_tests.holm([_trend(samples.values) for samples in points])
    found = []
    for samples, p in zip(points, corrected):
        change = _change(samples.values) if p < LEVEL else 0.0
        far = outliers(samples.values, target)
        largest = float(far.max() / np.median(samples.values)) if len(far) else 1.0
        found.append(Steadiness(change if abs(change) > target else None, p, len(far), largest))
    return found


def outliers(values: np.ndarray, target: float) -> np.ndarray:
    """The times that are far out, in the order they were taken."""
    if len(values) < LEAST:
        return values[:0]
    low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
    reach = FENCE * (high - low)
    return values[((values < low - reach) | (values > high + reach)) & (np.abs(values - median) > target * median)]


def _trend(values: np.ndarray) -> float:
    """p of the rank correlation between time and order."""
    if len(values) < LEAST or np.ptp(values) == 0:
        return 1.0
    return float(stats.kendalltau(np.arange(len(values)), values).pvalue)


def _change(values: np.ndarray) -> float:
    """From the first sample to the last, as a share of the median."""
    taken = np.unique(np.linspace(0, len(values) - 1, min(len(values), MOST_SLOPES)).round().astype(int))
    slope = stats.theilslopes(values[taken], taken).slope
    return float(slope * (len(values) - 1) / np.median(values))


def placement(record: Record) -> dict[str, Any] | None:
    """Where the threads of a point were seen; None where nobody looked."""
    found = record.raw.get("placement")
    return found if isinstance(found, dict) else None
