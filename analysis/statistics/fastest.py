"""The points of a group against the fastest of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence

import numpy as np

from .estimates import Estimate, ratio
from .intervals import CONFIDENCE
from .launch_tests import launch_tests
from .rank_tests import holm, rank_test, superiority
from .samples import Samples


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
