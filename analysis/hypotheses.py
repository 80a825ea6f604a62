"""What a study claimed before it ran, and whether its samples bear it out.

A hypothesis says that one point takes at least 1 + by times as long as another. Its test is that of the ratio of their paired
samples against 1 + by: ranks over blocks, and t over launches, the larger p of both; Holm's correction over the hypotheses of
the study. supported: the whole interval of the ratio lies above 1 + by and the corrected p is below 0.05; refuted: below it,
likewise; else undecided. Where a side is the fastest of several points, the claim holds if some point of the faster side beats
every point of the slower one: the p of a choice is multiplied by the number of points that it was made from, and the interval
is that of the fastest pair, widened to hold for all pairs together (Bonferroni).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Iterator

import pandas as pd

from . import text
from .comparison import Analysis
from .load import Hypothesis, Record
from .statistics import estimates, intervals, launch_tests, rank_tests
from .statistics.estimates import Estimate
from .statistics.samples import Samples
from .tables import Table, columns

SECTION = "Hypotheses"
SUPPORTED, REFUTED, UNDECIDED, NOT_TESTED = "supported", "refuted", "undecided", "not tested"
LEVEL = 1 - intervals.CONFIDENCE


@dataclass(frozen=True)
class Verdict:
    number: int  # from 1, as the study file has them
    hypothesis: Hypothesis
    word: str
    reason: str = ""  # why it was not tested
    faster: Record | None = None  # of several, the fastest
    slower: Record | None = None
    ratio: Estimate | None = None  # time of slower / time of faster
    p: float | None = None
    p_holm: float | None = None
    test: str = ""

    @property
    def bound(self) -> float:
        return 1 + self.hypothesis.by

    @property
    def tested(self) -> bool:
        return self.word != NOT_TESTED

    @property
    def sides(self) -> tuple[int, int]:
        return len(self.hypothesis.faster), len(self.hypothesis.slower)


def verdicts(analysis: Analysis) -> list[Verdict]:
    """In the order of the study."""
    return analysis.once(_verdicts)


def _verdicts(analysis: Analysis) -> list[Verdict]:
    known = {record.name: record for record in analysis.study.every_record}
    found = []
    stated = analysis.study.hypotheses
    reasons = [_why_untested(one, known) for one in stated]
    family = sum(not reason for reason in reasons)
    for number, (one, reason) in enumerate(zip(stated, reasons), start=1):
        found.append(Verdict(number, one, NOT_TESTED, reason) if reason else _tested(analysis, number, one, known, family))
    tested = [i for i, verdict in enumerate(found) if verdict.tested]
    for i, p in zip(tested, rank_tests.holm([found[i].p for i in tested])):
        found[i] = replace(found[i], p_holm=p, word=_word(found[i], p))
    return found


def _why_untested(one: Hypothesis, known: dict[str, Record]) -> str:
    if one.untested:
        return one.untested
    for name in (*one.faster, *one.slower):
        if name not in known:
            return f"{name} is not in these records"
        if not known[name].ok:
            return f"{name} {known[name].status}: {known[name].reason}"
    return ""


def _tested(analysis: Analysis, number: int, one: Hypothesis, known: dict[str, Record], family: int) -> Verdict:
    """Without its word, which takes the p of all others."""
    faster, slower = [known[name] for name in one.faster], [known[name] for name in one.slower]
    pairs = len(faster) * len(slower)
    above: dict[tuple[str, str], float] = {}  # two-sided p where the ratio lies above the bound, else 1
    below: dict[tuple[str, str], float] = {}
    names = set()
    for f in faster:
        for s in slower:
            p, name = _p(f.samples, s.samples, 1 + one.by, family * pairs)
            is_above = analysis.speedup(f, s).value > 1 + one.by
            above[f.id, s.id], below[f.id, s.id] = (p, 1.0) if is_above else (1.0, p)
            names.add(name)
    supports = len(faster) * min(max(above[f.id, s.id] for s in slower) for f in faster)
    refutes = len(slower) * max(min(below[f.id, s.id] for s in slower) for f in faster)
    best, least = analysis.fastest(faster), analysis.fastest(slower)
    ratio = estimates.widened(analysis.speedup(best, least), pairs)
    return Verdict(number, one, UNDECIDED, "", best, least, ratio, min(1.0, supports, refutes), None, ", ".join(sorted(names)))


def _p(faster: Samples, slower: Samples, bound: float, family: float) -> tuple[float, str]:
    """Two-sided p of a ratio equal to the bound, and the name of the test over samples."""
    shifted = replace(slower, values=slower.values / bound)
    p, name = rank_tests.rank_test(shifted, faster, family)
    return max(p, launch_tests.launch_tests([shifted, faster], best=1)[0]), name


def _word(verdict: Verdict, p: float) -> str:
    if not verdict.ratio.has_interval or p >= LEVEL:
        return UNDECIDED
    return SUPPORTED if verdict.ratio.low > verdict.bound else REFUTED if verdict.ratio.high < verdict.bound else UNDECIDED


def side(analysis: Analysis, record: Record, among: int) -> str:
    words = f"{analysis.label(record)} on {record.config.scene} {record.config.size[0]}x{record.config.size[1]}"
    return words if among == 1 else f"{words} (fastest of {among})"


def tables(analysis: Analysis) -> Iterator[Table]:
    found = verdicts(analysis)
    if not found:
        return
    numbers, words = [], []
    for v in found:
        row: dict[str, Any] = {"number": v.number, "claim": v.hypothesis.claim, "verdict": v.word, "by": v.hypothesis.by, "reason": v.reason,
                               "faster": v.faster.name if v.faster else None, "slower": v.slower.name if v.slower else None,
                               "faster_of": v.sides[0], "slower_of": v.sides[1], **columns("ratio", v.ratio),
                               "pairs": v.ratio.n if v.ratio else None, "interval": v.ratio.kind if v.ratio else None,
                               "test": v.test, "p": v.p, "p_holm": v.p_holm}
        said = {"": f"H{v.number}", "claim": v.hypothesis.claim, "verdict": v.word, "claimed ratio": f"at least {v.bound:.4g}"}
        if v.tested:
            said |= {"slower / faster [95 %]": text.estimate(v.ratio.value, v.ratio.low, v.ratio.high), "pairs": str(v.ratio.n),
                     "p (Holm)": f"{v.p_holm:.2g}", "faster": side(analysis, v.faster, v.sides[0]), "slower": side(analysis, v.slower, v.sides[1])}
        else:
            said |= {"slower / faster [95 %]": v.reason}
        numbers.append(row)
        words.append(said)
    note = ("Stated in the study file before the run. Ratios are medians of paired ratios of times; supported: the whole interval lies above"
            " the claimed ratio, refuted: below it, each with a p below 0.05 after Holm's correction over the hypotheses that were tested."
            " Undecided is no evidence for equality: `study --dry-run` says what the samples could have detected.")
    yield Table("hypotheses", "Verdicts", note, pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words).fillna(""), section=SECTION)


def summary(analysis: Analysis) -> str | None:
    """One sentence with every verdict, or None where nothing was claimed."""
    found = verdicts(analysis)
    if not found:
        return None
    parts = []
    for word in (SUPPORTED, REFUTED, UNDECIDED, NOT_TESTED):
        chosen = [v for v in found if v.word == word]
        said = [f"\u201c{v.hypothesis.claim}\u201d" + (f" (ratio {text.estimate(v.ratio.value, v.ratio.low, v.ratio.high)}, claimed"
                                                       f" at least {v.bound:.4g})" if v.tested else "") for v in chosen]
        if chosen:
            parts.append(f"{len(chosen)} {word}: {text.listing(said, len(said))}")
    return f"Of {text.count(len(found), 'hypothesis', 'hypotheses')} stated before the run: {'; '.join(parts)}."
