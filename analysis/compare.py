"""Two runs, point by point: is B faster than A? Built for changes of the program, the compiler, the machine's set-up.

A verdict needs both directions of evidence: FASTER and SLOWER a difference that the launches of both runs show after Holm's
correction over all points; SAME an interval that lies within the margin; everything else is AMBIGUOUS, which is no
"no difference". A difference within the margin is SAME: it exists, and is too small to care.
"""

from __future__ import annotations

import io
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence

import numpy as np
import pandas as pd

from . import contexts, google_benchmark, statistics, text
from .load import InputError, Record, load
from .statistics import Estimate, Samples

FASTER, SLOWER, SAME, AMBIGUOUS, LOST = "FASTER", "SLOWER", "SAME", "AMBIGUOUS", "LOST"
POINTS = "points"  # for --ignore: points that only one run has
COMMON_SHIFT_SHARE = 0.9  # of the points on one side of 1: then say that the whole run moved


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
    superiority: float  # chance that a sample of B takes longer than one of A
    verdict: str
    why: str


@dataclass(frozen=True)
class Outcome:
    a: Run
    b: Run
    rows: list[Row]
    margin: float
    ignored: list[contexts.Difference]
    only_b: list[str]

    @property
    def status(self) -> int:
        """For CI: 1 if a point got slower or was lost."""
        return int(any(row.verdict in (SLOWER, LOST) for row in self.rows))


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
    """Raises InputError where the runs differ in a recorded condition that is not ignored."""
    found = contexts.differences(a.context, b.context, shared_only=not (a.complete and b.complete))
    found += _point_differences(a, b)
    refused = [difference for difference in found if not contexts.under(difference.key, ignore)]
    if refused:
        more = f"; also {text.listing([d.key for d in refused[1:]], 8)}" if refused[1:] else ""
        raise InputError(b.path, f"{refused[0].words}{more} (name with --ignore what is meant to differ)", None, refused[0].key)
    common = [name for name in a.samples if name in b.samples]
    if not common and not any(name in b.untimed for name in a.samples):
        raise InputError(b.path, f"no point of it has the name of a timed point of {a.path}")
    margin = margin if margin is not None else max(a.target or 0.0, b.target or 0.0) or 0.02
    tested = {name: statistics.between_runs(b.samples[name], a.samples[name]) for name in common}
    corrected = dict(zip(common, statistics.holm([tested[name][1] for name in common])))
    rows = [_row(name, a.samples[name], b.samples[name], tested[name][0], corrected[name], margin, one_launch) for name in common]
    rows.sort(key=lambda row: row.ratio.value, reverse=True)
    lost = [name for name in a.samples if name not in b.samples and (name in b.untimed or POINTS not in ignore)]
    rows += [Row(name, a.samples[name], None, None, 1.0, 0.5, LOST, b.untimed.get(name, "not in B")) for name in lost]
    only_b = [name for name in b.samples if name not in a.samples]
    return Outcome(a, b, rows, margin, [d for d in found if d not in refused], only_b)


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


def table(outcome: Outcome) -> pd.DataFrame:
    rows = []
    for row in outcome.rows:
        ratio = row.ratio
        rows.append({"verdict": row.verdict, "point": row.name, "a_ms": float(np.median(row.a.values)),
                     "b_ms": float(np.median(row.b.values)) if row.b is not None else None,
                     "b_over_a": ratio.value if ratio else None, "low": ratio.low if ratio else None,
                     "high": ratio.high if ratio else None, "p_holm": row.p, "superiority": row.superiority,
                     "n_a": row.a.n, "n_b": row.b.n if row.b is not None else 0, "why": row.why})
    return pd.DataFrame(rows)


def csv(outcome: Outcome) -> str:
    out = io.StringIO()
    table(outcome).to_csv(out, index=False)
    return out.getvalue()


def plain(outcome: Outcome) -> str:
    """Every point, the slowest change first, then the counts and what else a reader has to know."""
    lines = [f"A {outcome.a.path}", f"B {outcome.b.path}", "",
             f"{'verdict':<10} {'time B / A':<22} {'A':>10} {'B':>10}  point"]
    for row in outcome.rows:
        if row.ratio is None:
            lines.append(f"{row.verdict:<10} {row.why:<22} {text.number(float(np.median(row.a.values))):>7} ms {'':>10}  {row.name}")
            continue
        quotient = text.estimate(row.ratio.value, row.ratio.low, row.ratio.high)
        a, b = (text.number(float(np.median(s.values))) for s in (row.a, row.b))
        lines.append(f"{row.verdict:<10} {quotient:<22} {a:>7} ms {b:>7} ms  {row.name}")
    counts = Counter(row.verdict for row in outcome.rows)
    lines += ["", ", ".join(f"{counts[verdict]} {verdict}" for verdict in (FASTER, SLOWER, SAME, AMBIGUOUS, LOST) if counts[verdict])
              + f" of {text.count(len(outcome.rows), 'point')}; SAME means within {text.percent(outcome.margin)};"
              " brackets are 95 % intervals of the ratio."]
    whys = Counter(row.why for row in outcome.rows if row.verdict == AMBIGUOUS)
    lines += [f"Ambiguous: {many} because {why}." for why, many in whys.most_common()]
    shift = common_shift(outcome)
    if shift is not None:
        lines.append(f"Nearly every point moved to the same side, by {text.percent(abs(shift - 1))} in the median: a change of the"
                     " machine between the runs looks like this, too; repeat A before you blame B.")
    if outcome.only_b:
        lines.append(f"Only in B: {text.listing(outcome.only_b)}.")
    if outcome.ignored:
        lines.append("Differs, as allowed by --ignore: " + "; ".join(f"{d.key}: {d.words}" for d in outcome.ignored) + ".")
    if not (outcome.a.complete and outcome.b.complete):
        lines.append("Google Benchmark's JSON records little of the set-up: only host and CPUs were compared.")
    return "\n".join(lines)
