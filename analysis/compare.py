"""Two runs, point by point: is B faster than A? Built for changes of the program, the compiler, the machine's set-up.

Every verdict needs evidence. FASTER and SLOWER: an interval of the ratio that excludes 1, and a difference of the samples
and of the launches of both runs after Holm's correction over all points that can be judged. SAME: an interval within the
margin, where a difference may exist and is too small to care. Everything else is AMBIGUOUS, which does not mean "no
difference". Two runs are not interleaved: repeats of A, if there are any, widen the intervals (statistics/runs.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence

import numpy as np
from scipy import stats

from . import contexts, google_benchmark, text
from .load import InputError, Record, load
from .statistics import intervals, rank_tests
from .statistics.estimates import Estimate
from .statistics.runs import between_runs, widened_by, yardstick
from .statistics.samples import Samples

FASTER, SLOWER, SAME, AMBIGUOUS, LOST = "FASTER", "SLOWER", "SAME", "AMBIGUOUS", "LOST"
# The program chooses it from the time of the first frames, so two runs of one program may differ in it: said, not refused.
CHOSEN = "frames_per_sample"
POINTS = "points"  # for --ignore: points that only one run has
VERDICTS = (SLOWER, FASTER, AMBIGUOUS, SAME, LOST)
DECIDED_SHARE = 0.5  # of the points; below it "nothing is slower" would be said of a comparison that could not tell
COMMON_SHIFT_SHARE = 0.9  # of the points on one side of 1: then say that the whole run moved


class Refused(InputError):
    """Runs that were recorded under other conditions; one line a condition."""

    def __init__(self, path: Path, found: Sequence[contexts.Difference],
                 remedy: str = "name with --ignore what is meant to differ") -> None:
        super().__init__(path, remedy, None, f"{text.count(len(found), 'difference')} to A")
        self.lines = [f"{path}: {difference.key}: {difference.words}" for difference in found]


@dataclass(frozen=True)
class Run:
    """What is compared of a run, by the points' names."""

    path: Path
    context: dict[str, Any]
    samples: dict[str, Samples]
    untimed: dict[str, str]  # name -> why it has no times
    facts: dict[str, dict[str, Any]]  # name -> recorded conditions of that point
    timed_facts: dict[str, dict[str, Any]]  # the same that only a timed point has
    target: float | None
    complete: bool  # whether the context says everything (records.md), not only what Google Benchmark writes


@dataclass(frozen=True)
class Row:
    name: str
    a: Samples | None
    b: Samples | None
    ratio: Estimate | None  # time of B / time of A
    p: float
    superiority: float  # Vargha and Delaney's A: chance that a sample of B takes longer than one of A
    verdict: str
    why: str
    test: str = "none"  # of the samples
    distance: float = 0.0  # by which repeats of A widened the interval, of logarithms


@dataclass(frozen=True)
class Outcome:
    a: Run
    b: Run
    rows: list[Row]
    margin: float
    ignored: list[contexts.Difference]  # with what the program chose by itself
    only_a: list[str]  # only where --ignore points allows it; else they are LOST
    only_b: list[str]
    repeats: list[Run]

    @property
    def judged(self) -> list[Row]:
        """Rows whose counts allow a test: the family that Holm corrects for."""
        return [row for row in self.rows if row.test != "none"]

    @property
    def undecided(self) -> bool:
        decided = sum(row.verdict in (FASTER, SLOWER, SAME) for row in self.rows)
        return decided == 0 or decided < DECIDED_SHARE * len(self.rows)

    @property
    def status(self) -> int:
        """For CI: 3 if a point was lost, else 1 if one got slower, else 4 if most could not be told, else 0."""
        found = {row.verdict for row in self.rows}
        return 3 if LOST in found else 1 if SLOWER in found else 4 if self.undecided else 0


def read(path: Path) -> Run:
    """The folder of a study, or a file of Google Benchmark's JSON."""
    if Path(path).is_file():
        runs = google_benchmark.read(Path(path))
        return Run(Path(path), runs.context, runs.samples, runs.errors, {}, {}, None, False)
    study = load(Path(path))
    named: dict[str, Record] = {}
    for record in study.every_record:
        if record.name in named:
            raise InputError(study.directory / "records.jsonl", f"{record.name} is also on line {named[record.name].line}",
                             record.line, "name")
        named[record.name] = record
    timed = {name: record.samples for name, record in named.items() if record.ok}
    untimed = {name: f"{record.status}: {record.reason}" for name, record in named.items() if not record.ok}
    # A point's name holds the axes only where they differ from their defaults, so all are compared.
    facts = {name: {f"config.{key}": value for key, value in record.raw["config"].items()} for name, record in named.items()}
    return Run(study.directory, study.context, timed, untimed, facts, {n: _timed_facts(named[n]) for n in timed}, study.target, True)


def _timed_facts(record: Record) -> dict[str, Any]:
    """A thread that did not start, another picture or another mean makes the times those of another point."""
    facts = {"threads_observed": record.threads_observed, "work.covered_pixels": record.work.get("covered_pixels"),
             "work.triangles": record.work.get("triangles"), CHOSEN: record.raw.get(CHOSEN)}
    return {key: value for key, value in facts.items() if value is not None}


def compare(a: Run, b: Run, ignore: Sequence[str] = (), margin: float | None = None, few_launches: bool = False,
            repeats: Sequence[Run] = ()) -> Outcome:
    """repeats: further runs of A, under the same conditions. Raises Refused where the runs differ in a recorded condition that
    is not ignored."""
    known = {POINTS, *(key for run in (a, b) for facts in (dict(contexts.leaves(run.context)), *run.facts.values(),
                                                           *run.timed_facts.values()) for key in facts)}
    for name in ignore:
        if not any(contexts.under(key, [name]) for key in known):
            raise InputError(b.path, f"--ignore {name!r} names nothing that A or B records")
    for repeat in repeats:
        if differs := [difference for difference in _differences(a, repeat) if difference.key != CHOSEN]:
            raise Refused(repeat.path, differs, "a repeat has to be a run under the conditions of A")
    found = _differences(a, b)
    refused = [difference for difference in found if difference.key != CHOSEN and not contexts.under(difference.key, ignore)]
    if refused:
        raise Refused(b.path, refused)
    common = [name for name in a.samples if name in b.samples]
    if not common and not any(name in b.untimed for name in a.samples):
        raise InputError(b.path, f"no point of it has the name of a timed point of {a.path}")
    if repeats and not any(all(name in repeat.samples for repeat in repeats) for name in common):
        raise InputError(repeats[0].path, "no point is in all repeats of A, in A and in B")
    margin = margin if margin is not None else max(a.target or 0.0, b.target or 0.0) or 0.02
    able = [name for name in common if _unable(a.samples[name], b.samples[name], few_launches) is None]
    tested = {name: between_runs(b.samples[name], a.samples[name], max(1, len(able))) for name in common}
    # Counts alone decide what can be judged, so leaving the others out of the family selects nothing.
    corrected = dict(zip(able, rank_tests.holm([tested[name][1] for name in able])))
    distances = _distances(common, [a, *repeats])
    rows = [_row(name, a.samples[name], b.samples[name], tested[name], corrected.get(name), distances[name], margin, few_launches)
            for name in common]
    rows.sort(key=lambda row: row.ratio.value, reverse=True)
    missing = [name for name in a.samples if name not in b.samples]
    lost = [name for name in missing if name in b.untimed or POINTS not in ignore]
    rows += [Row(name, a.samples[name], None, None, 1.0, 0.5, LOST, b.untimed.get(name, "not in B")) for name in lost]
    only_a = [name for name in missing if name not in lost]
    only_b = [name for name in b.samples if name not in a.samples]
    return Outcome(a, b, rows, margin, [d for d in found if d not in refused], only_a, only_b, list(repeats))


def _differences(a: Run, b: Run) -> list[contexts.Difference]:
    # A file of Google Benchmark says less than a study; two of a kind are compared in all that either says.
    return contexts.differences(a.context, b.context, shared_only=a.complete != b.complete) + _point_differences(a, b)


def _point_differences(a: Run, b: Run) -> list[contexts.Difference]:
    """One entry a key, with the first point that has it."""
    found: dict[str, contexts.Difference] = {}
    for left, right in ((a.facts, b.facts), (a.timed_facts, b.timed_facts)):
        for name in (name for name in left if name in right):
            for key in left[name].keys() | right[name].keys():
                values = [facts[name].get(key, contexts.ABSENT) for facts in (left, right)]
                if values[0] != values[1] and key not in found:
                    found[key] = contexts.Difference(key, *values, name)
    return [found[key] for key in sorted(found)]


def _distances(names: Sequence[str], runs: Sequence[Run]) -> dict[str, float]:
    """How far the points may move between two runs of A; 0 without a repeat."""
    if len(runs) < 2:
        return dict.fromkeys(names, 0.0)
    logs = np.array([[np.log(np.median(run.samples[name].values)) if name in run.samples else np.nan for run in runs] for name in names])
    return dict(zip(names, yardstick(logs).tolist()))


def _unable(a: Samples, b: Samples, few_launches: bool) -> str | None:
    """Why the counts of a point allow no verdict."""
    if min(a.n, b.n) < intervals.MIN_SAMPLES:
        return f"fewer than {intervals.MIN_SAMPLES} samples"
    if min(a.launch_count, b.launch_count) < intervals.MIN_LAUNCHES and not few_launches:
        return f"fewer than {intervals.MIN_LAUNCHES} launches on a side: others may differ by as much (--few-launches judges them)"
    return None


def _row(name: str, a: Samples, b: Samples, tested: tuple[Estimate, float, str], p: float | None, distance: float, margin: float,
         few_launches: bool) -> Row:
    """p: after Holm; None where the counts allow no verdict."""
    ratio = widened_by(tested[0], distance) if distance else tested[0]
    verdict, why = AMBIGUOUS, "the interval holds both a difference and none"
    if p is None:
        why = _unable(a, b, few_launches) or ""
    elif 1 / (1 + margin) < ratio.low and ratio.high < 1 + margin:
        verdict, why = SAME, "the interval lies within the margin"
    elif ratio.excludes_one and p < 1 - intervals.CONFIDENCE:
        verdict, why = (SLOWER if ratio.low > 1 else FASTER), "the interval excludes 1, and so does the test after Holm"
    elif ratio.excludes_one:
        why = "the interval excludes 1, but not after Holm's correction over all points"
    elif tested[0].excludes_one:
        why = "the interval excludes 1, but A moves as far between two runs"
    return Row(name, a, b, ratio, 1.0 if p is None else p, rank_tests.superiority(b, a), verdict, why,
               "none" if p is None else tested[2], distance)


def common_shift(outcome: Outcome) -> float | None:
    """The median ratio of all points, where nearly all moved to the same side: what the whole machine did, or a change that
    is everywhere. None where they moved apart, or are so few that a sign test cannot tell (fewer than six)."""
    values = np.array([row.ratio.value for row in outcome.rows if row.ratio is not None])
    if not len(values):
        return None
    most = int(max(np.sum(values > 1), np.sum(values < 1)))
    if most < COMMON_SHIFT_SHARE * len(values) or stats.binomtest(most, len(values)).pvalue >= 1 - intervals.CONFIDENCE:
        return None
    return float(np.median(values))
