"""The verdicts of the report on `rasterbench selftest -o FILE`: of a point compared with itself each difference is a false one."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from . import load
from .load import InputError
from .statistics import estimates, intervals
from .statistics.fastest import compare_with_best
from .statistics.numbers import is_number
from .statistics.samples import Samples

STATED = 1 - intervals.CONFIDENCE


@dataclass(frozen=True)
class Outcome:
    comparisons: int
    verdicts: Counter  # of the report: "slower" is a false difference, whichever label it is of
    false_ratios: int  # intervals of the paired ratio that exclude 1, which speedups show
    median_off: float  # of the ratios' distance from 1

    def rate(self, many: int) -> tuple[float, float, float]:
        """A share of the comparisons with its exact 95 % interval (Clopper and Pearson)."""
        interval = stats.binomtest(many, self.comparisons).proportion_ci(intervals.CONFIDENCE, method="exact")
        return many / self.comparisons, float(interval.low), float(interval.high)

    @property
    def status(self) -> int:
        return int(max(self.rate(many)[1] for many in (self.verdicts["slower"], self.false_ratios)) > STATED)


def read(path: Path) -> list[tuple[Samples, Samples]]:
    pairs = []
    for line, words in enumerate(load.read_text(path, "no such file").split("\n"), start=1):
        if words.strip():
            value = load.parse(words, path, line)
            pairs.append(tuple(_samples(value, label, path, line) for label in ("a", "b")))
    if not pairs:
        raise InputError(path, "holds no comparisons")
    return pairs


def _samples(value: dict[str, Any], label: str, path: Path, line: int) -> Samples:
    part = value.get(label)
    if not isinstance(part, dict):
        raise InputError(path, "expected an object", line, label)
    columns = []
    for key in ("samples_ms", "launches", "blocks"):
        numbers = part.get(key)
        if not isinstance(numbers, list) or not numbers or not all(map(is_number, numbers)):
            raise InputError(path, "expected an array of numbers", line, f"{label}.{key}")
        columns.append(np.array(numbers))
    if len(set(map(len, columns))) != 1 or np.any(columns[0] <= 0):
        raise InputError(path, "expected times above 0, each with its launch and block", line, f"{label}.samples_ms")
    return Samples(columns[0].astype(float), *(column.astype(int) for column in columns[1:]))


def judge(pairs: list[tuple[Samples, Samples]]) -> Outcome:
    verdicts: Counter = Counter()
    ratios = []
    for pair in pairs:
        best, compared = compare_with_best(pair)
        verdicts[compared[1 - best].verdict] += 1
        ratios.append(estimates.ratio(*pair))
    off = float(np.median([max(ratio.value, 1 / ratio.value) - 1 for ratio in ratios]))
    return Outcome(len(pairs), verdicts, sum(ratio.excludes_one for ratio in ratios), off)


def plain(outcome: Outcome) -> str:
    lines = [f"{outcome.comparisons} comparisons of a point with itself; half of the ratios are within {100 * outcome.median_off:.2f} % of 1"]
    for what, many in (("called slower than the fastest by the report", outcome.verdicts["slower"]),
                       ("with an interval of the paired ratio that excludes 1", outcome.false_ratios)):
        rate, low, high = outcome.rate(many)
        lines.append(f"{many} {what}: {100 * rate:.1f} % [{100 * low:.1f}, {100 * high:.1f}], stated {100 * STATED:g} %")
    lines.append(f"the report's other verdicts: {outcome.verdicts['same']} same, {outcome.verdicts['ambiguous']} ambiguous")
    lines.append("BROKEN: more often than stated" if outcome.status else "no more often than stated, as far as so many comparisons can tell")
    return "\n".join(lines)
