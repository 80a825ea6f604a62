"""Two runs, point by point: is B faster than A? Built for changes of the program, the compiler, the machine's set-up.

Every verdict needs evidence. FASTER and SLOWER: an interval of the ratio that excludes 1, and a difference of the samples
and of the launches of both runs after Holm's correction over all points. SAME: an interval within the margin, where a
difference may exist and is too small to care. Everything else is AMBIGUOUS, which does not mean "no difference".
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from . import contexts, google_benchmark, statistics, text
from .load import InputError, Record, load
from .statistics import Estimate, Samples

FASTER, SLOWER, SAME, AMBIGUOUS, LOST = "FASTER", "SLOWER", "SAME", "AMBIGUOUS", "LOST"
POINTS = "points"  # for --ignore: points that only one run has
VERDICTS = (SLOWER, FASTER, AMBIGUOUS, SAME, LOST)
COMMON_SHIFT_SHARE = 0.9  # of the points on one side of 1: then say that the whole run moved


class Refused(InputError):
    """Runs that were recorded under other conditions; one line a condition."""

    def __init__(self, path: Path, found: Sequence[contexts.Difference]) -> None:
        super().__init__(path, "name with --ignore what is meant to differ", None, f"{text.count(len(found), 'difference')} to A")
        self.lines = [f"{path}: {difference.key}: {difference.words}" for difference in found]


@dataclass(frozen=True)
class Run:
    """What is compared of a run, by the points' names."""

    path: Path
    context: dict[str, Any]
    samples: dict[str, Samples]
    untimed: dict[str, str]  # name -> why it has no times
    facts: dict[str, dict[str, Any]]  # name -> recorded conditions of that point
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


@dataclass(frozen=True)
class Outcome:
    a: Run
    b: Run
    rows: list[Row]
    margin: float
    ignored: list[contexts.Difference]
    only_a: list[str]  # only where --ignore points allows it; else they are LOST
    only_b: list[str]

    @property
    def status(self) -> int:
        """For CI: 3 if a point was lost, else 1 if one got slower, else 0."""
        found = {row.verdict for row in self.rows}
        return 3 if LOST in found else int(SLOWER in found)


def read(path: Path) -> Run:
    """The folder of a study, or a file of Google Benchmark's JSON."""
    if Path(path).is_file():
        runs = google_benchmark.read(Path(path))
        return Run(Path(path), runs.context, runs.samples, runs.errors, {}, None, False)
    study = load(Path(path))
    named: dict[str, Record] = {}
    for record in study.every_record:
        if record.name in named:
            raise InputError(study.directory / "records.jsonl", f"{record.name} is also on line {named[record.name].line}",
                             record.line, "name")
        named[record.name] = record
    timed = {name: record.samples for name, record in named.items() if record.ok}
    untimed = {name: f"{record.status}: {record.reason}" for name, record in named.items() if not record.ok}
    return Run(study.directory, study.context, timed, untimed, {n: _facts(r) for n, r in named.items()}, study.target, True)


def _facts(record: Record) -> dict[str, Any]:
    """Conditions of one point. Its name holds the axes only where they differ from their defaults, so all are compared; a thread
    that did not start, or another picture, makes the times those of another point."""
    facts = {f"config.{key}": value for key, value in record.raw["config"].items()}
    if record.ok:
        facts |= {"threads_observed": record.threads_observed, "work.covered_pixels": record.work.get("covered_pixels"),
                  "work.triangles": record.work.get("triangles")}
    return facts


def compare(a: Run, b: Run, ignore: Sequence[str] = (), margin: float | None = None, one_launch: bool = False) -> Outcome:
    """Raises Refused where the runs differ in a recorded condition that is not ignored."""
    found = contexts.differences(a.context, b.context, shared_only=not (a.complete and b.complete))
    found += _point_differences(a, b)
    refused = [difference for difference in found if not contexts.under(difference.key, ignore)]
    if refused:
        raise Refused(b.path, refused)
    common = [name for name in a.samples if name in b.samples]
    if not common and not any(name in b.untimed for name in a.samples):
        raise InputError(b.path, f"no point of it has the name of a timed point of {a.path}")
    margin = margin if margin is not None else max(a.target or 0.0, b.target or 0.0) or 0.02
    tested = {name: statistics.between_runs(b.samples[name], a.samples[name]) for name in common}
    corrected = dict(zip(common, statistics.holm([tested[name][1] for name in common])))
    rows = [_row(name, a.samples[name], b.samples[name], tested[name][0], corrected[name], margin, one_launch) for name in common]
    rows.sort(key=lambda row: row.ratio.value, reverse=True)
    missing = [name for name in a.samples if name not in b.samples]
    lost = [name for name in missing if name in b.untimed or POINTS not in ignore]
    rows += [Row(name, a.samples[name], None, None, 1.0, 0.5, LOST, b.untimed.get(name, "not in B")) for name in lost]
    only_a = [name for name in missing if name not in lost]
    only_b = [name for name in b.samples if name not in a.samples]
    return Outcome(a, b, rows, margin, [d for d in found if d not in refused], only_a, only_b)


def _point_differences(a: Run, b: Run) -> list[contexts.Difference]:
    """One entry a key, with the first point that has it."""
    found: dict[str, contexts.Difference] = {}
    for name in (name for name in a.facts if name in b.facts):
        for key in sorted(a.facts[name].keys() & b.facts[name].keys()):
            left, right = a.facts[name][key], b.facts[name][key]
            if left != right and key not in found:
                found[key] = contexts.Difference(key, left, right, name)
    return [found[key] for key in sorted(found)]


def _row(name: str, a: Samples, b: Samples, ratio: Estimate, p: float, margin: float, one_launch: bool) -> Row:
    verdict, why = AMBIGUOUS, "the interval holds both a difference and none"
    if not ratio.has_interval:
        why = ratio.note
    elif ratio.note == statistics.ONE_LAUNCH and not one_launch:
        why = "one launch: another process may differ by as much"
    elif 1 / (1 + margin) < ratio.low and ratio.high < 1 + margin:
        verdict, why = SAME, "the interval lies within the margin"
    elif ratio.excludes_one and p < 1 - statistics.CONFIDENCE:
        verdict, why = (SLOWER if ratio.low > 1 else FASTER), "the interval excludes 1, and so does the test after Holm"
    elif ratio.excludes_one:
        why = "the interval excludes 1, but not after Holm's correction over all points"
    return Row(name, a, b, ratio, p, statistics.superiority(b, a), verdict, why)


def common_shift(outcome: Outcome) -> float | None:
    """The median ratio of all points, where nearly all moved to the same side: what the whole machine did, or a change that
    is everywhere. None where the points are few or moved apart."""
    values = np.array([row.ratio.value for row in outcome.rows if row.ratio is not None])
    if len(values) < 8 or max(np.mean(values > 1), np.mean(values < 1)) < COMMON_SHIFT_SHARE:
        return None
    return float(np.median(values))
