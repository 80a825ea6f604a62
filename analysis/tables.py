"""Tables: one frame of numbers for CSV, one of text for HTML, LaTeX and the terminal."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from . import latex, steadiness, text
from .comparison import EXTRA_AXES, GROUP_AXES, Analysis, Group, strategy
from .load import Record
from .statistics import estimates, numbers
from .statistics.estimates import Estimate
from .statistics.fastest import Comparison

FORMER = {"edge": "edge_ties", "depth": "depth_ties", "unexplained": "errors"}  # classes of wrong pixels in older records
VERDICTS = {"best": "fastest", "same": "same as fastest", "ambiguous": "not told apart", "slower": "slower"}


@dataclass(frozen=True)
class Table:
    name: str
    title: str
    note: str
    numbers: pd.DataFrame  # full precision, one column a number
    words: pd.DataFrame  # rounded, with intervals
    marked: frozenset[int] = field(default_factory=frozenset)  # rows of words to set off
    section: str = ""  # stands with the figures of this section; else in a section of tables
    folded: bool = False  # in the report behind its title

    def csv(self) -> str:
        return self.numbers.to_csv(index=False, lineterminator="\n")

    def tex(self) -> str:
        return latex.table(self.words, f"{self.title}. {self.note}", f"tab:{self.name}")


def accuracy(record: Record) -> str:
    """The second verdict: how the picture compares with the oracle."""
    oracle = record.verify.get("oracle")
    if not isinstance(oracle, dict):
        return "not judged"
    bound = record.verify.get("bound")
    if isinstance(bound, dict) and bound.get("bounded") is False or oracle.get("predicted") == -1:
        return "unbounded"
    counts = ("wrong",) if "wrong" in oracle else tuple(FORMER.values())
    differences = [oracle.get(key) for key in (*counts, "max_depth_error_steps")]
    if all(d in (0, None) for d in differences) and any(d == 0 for d in differences):
        return "exact"
    within = oracle.get("within_bound")
    return "within its bound" if within is True else "outside its bound" if within is False else "not judged"


def columns(name: str, estimate: Estimate | None) -> dict[str, float | None]:
    if estimate is None:
        return {name: None, f"{name}_low": None, f"{name}_high": None}
    return {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}


def times(estimate: Estimate | None) -> str:
    return text.MISSING if estimate is None else text.estimate(estimate.value, estimate.low, estimate.high)


def _base(analysis: Analysis, record: Record, base: Record | None) -> tuple[Estimate | None, str, float | None]:
    """Speedup over a base, the base's name and its seconds."""
    if base is None:
        return None, "no base", None
    label = base.config.kernel if base.config.backend == "serial" else analysis.label(base)
    return analysis.speedup(record, base), label, analysis.estimates[base.id].value / 1000


def tables(analysis: Analysis) -> list[Table]:
    found = [points(analysis, group) for group in analysis.groups]
    found += [matrix(analysis, group) for group in analysis.groups if group.timed]
    for make in (over_scenes, stages, verification, not_timed):
        table = make(analysis)
        if len(table.numbers):
            found.append(table)
    return found


def points(analysis: Analysis, group: Group) -> Table:
    """The main table: every point of a group, with a speed only where it was timed and conforms."""
    numbers, words, marked = [], [], set()
    for i, record in enumerate(_ordered(group)):
        config = record.config
        row: dict[str, Any] = {
            "scene": config.scene, "size": "x".join(map(str, config.size)), "numeric": config.numeric, "kernel": config.kernel,
            "backend": config.backend, "schedule": config.schedule, "chunk": config.chunk, "threads": config.threads,
            **{axis: getattr(config, axis) for axis in EXTRA_AXES}, "runtime_observed": record.runtime_observed,
            "status": record.status, "reason": record.reason, "id": record.id}
        said = {"kernel": config.kernel, "execution": analysis.execution(record), "threads": str(config.threads)}
        if record.ok:
            comparison = group.comparisons[record.id]
            row |= _measured(analysis, record, comparison)
            said |= _said(analysis, record, comparison)
            if comparison.verdict != "slower" and len(group.timed) > 1:
                marked.add(i)
        else:
            said |= {"median ms [95 %]": f"{record.status}: {text.shorten(record.reason, 60)}"}
        numbers.append(row)
        words.append(said)
    for record in group.peers:
        row, said = _peer(analysis, group, record)
        numbers.append(row)
        words.append(said)
    bases = sorted({f"{b.config.kernel} ({text.number(analysis.estimates[b.id].value / 1000)} s, {b.config.isa})"
                    for r in group.timed if (b := analysis.serial_base[r.id]) is not None})
    note = ("Intervals in brackets are 95 %. Base (a): " + (text.listing(bases) if bases else "none, no serial kernel was timed")
            + "; base (b): the same point on one thread, with its seconds."
            + (" A peer is another program, with an arithmetic and a fill rule of its own: it has no speedup and is no base."
               if group.peers else "")
            + (f" {steadiness.RULE}" if any(analysis.steadiness[r.id].words for r in group.timed) else "")
            + (" x floor: times the time in which the point's bytes pass at the measured rate." if any(
                r.floor_ms is not None for r in group.timed) else ""))
    return Table(f"points_{group.slug}", f"Strategy and execution, {group.title}", note,
                 pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words).fillna(""), frozenset(marked))


def _peer(analysis: Analysis, group: Group, record: Record) -> tuple[dict[str, Any], dict[str, str]]:
    """A peer's row: its time, also over the fastest kernel's."""
    config = record.config
    row: dict[str, Any] = {"scene": config.scene, "size": "x".join(map(str, config.size)), "numeric": config.numeric,
                           "kernel": strategy(record), "backend": config.backend, "threads": config.threads, "isa": config.isa,
                           "status": record.status, "reason": record.reason, "id": record.id}
    said = {"kernel": strategy(record), "execution": analysis.execution(record), "threads": str(config.threads)}
    if not record.ok:
        return row, said | {"median ms [95 %]": f"{record.status}: {text.shorten(record.reason, 60)}"}
    ratio = estimates.ratio(record.samples, group.best.samples) if group.best is not None else None
    row |= columns("median_ms", analysis.estimates[record.id]) | columns("time_over_fastest", ratio)
    row |= {"n": record.samples.n, "launches": record.samples.launch_count, "interval": analysis.estimates[record.id].kind,
            "stop": record.stop}
    return row, said | {"median ms [95 %]": times(analysis.estimates[record.id]), "n": str(record.samples.n),
                        "stop": record.stop or text.MISSING, "verdict": "within its bound", "time / fastest": times(ratio)}


def _ordered(group: Group) -> list[Record]:
    kernels = {kernel: i for i, kernel in enumerate(group.kernels)}
    return sorted(group.records, key=lambda r: kernels[r.config.kernel])  # stable: within a kernel as in the study


def _measured(analysis: Analysis, record: Record, comparison: Comparison) -> dict[str, Any]:
    row: dict[str, Any] = columns("median_ms", analysis.estimates[record.id])
    row |= {"n": record.samples.n, "launches": record.samples.launch_count, "interval": analysis.estimates[record.id].kind,
            "stop": record.stop, "accuracy": accuracy(record)}
    steady, where = analysis.steadiness[record.id], steadiness.placement(record) or {}
    row |= {"drift": steady.drift, "drift_p_holm": steady.p_holm, "outliers": steady.outliers,
            **{key: where.get(key) for key in ("migrations", "samples_sharing_core")}}
    row |= columns("time_over_fastest", comparison.ratio if comparison.verdict != "best" else None)
    row |= {"verdict": VERDICTS[comparison.verdict], "test": comparison.test, "p_holm": comparison.p_holm,
            "superiority": comparison.superiority}
    for letter, bases in (("a", analysis.serial_base), ("b", analysis.thread_base)):
        speedup, label, seconds = _base(analysis, record, bases[record.id])
        row |= columns(f"speedup_{letter}", speedup) | {f"base_{letter}": label, f"base_{letter}_seconds": seconds}
        row[f"speedup_{letter}_kind"] = speedup.kind if speedup else None
    if record.floor_ms is not None:
        row |= {"floor_ms": record.floor_ms, "times_floor": _over_floor(analysis, record)}
    own = analysis.speedup(record, analysis.thread_base[record.id])
    row |= columns("efficiency", estimates.efficiency(own, record.config.threads) if own else None)
    return row


def _over_floor(analysis: Analysis, record: Record) -> float | None:
    """How many times the floor a point takes."""
    return None if record.floor_ms is None else analysis.estimates[record.id].value / record.floor_ms


def _said(analysis: Analysis, record: Record, comparison: Comparison) -> dict[str, str]:
    own, _, seconds = _base(analysis, record, analysis.thread_base[record.id])
    over, _, _ = _base(analysis, record, analysis.serial_base[record.id])
    is_base = analysis.serial_base[record.id] is record
    floor = _over_floor(analysis, record)
    return {
        "median ms [95 %]": times(analysis.estimates[record.id]), "n": str(record.samples.n), "stop": record.stop or text.MISSING,
        "verdict": f"conforms; {accuracy(record)}",
        **({"x floor": text.number(floor)} if floor is not None else {}),
        **({"unsteady": words} if (words := analysis.steadiness[record.id].words) else {}),
        "time / fastest": "fastest" if comparison.verdict == "best"
        else times(comparison.ratio) + ("" if comparison.verdict == "slower" else " ≈"),
        "speedup (a)": "is base (a)" if is_base else times(over),
        "speedup (b)": f"{times(own)} of {text.number(seconds)} s" if own else
        ("is base (b)" if analysis.thread_base[record.id] is record else "no base")}


def matrix(analysis: Analysis, group: Group) -> Table:
    """Execution by strategy, for a first look."""
    numbers: dict[tuple[str, int], dict[str, float]] = {}
    words: dict[tuple[str, int], dict[str, str]] = {}
    for record in _ordered(group):
        key = (analysis.execution(record), record.config.threads)
        cell = numbers.setdefault(key, {}), words.setdefault(key, {})
        if record.ok:
            best = " *" if group.comparisons[record.id].verdict != "slower" and len(group.timed) > 1 else ""
            cell[0][record.config.kernel] = analysis.estimates[record.id].value
            cell[1][record.config.kernel] = times(analysis.estimates[record.id]) + best
        else:
            cell[1][record.config.kernel] = record.status
    frames = []
    for cells in (numbers, words):
        frames.append(pd.DataFrame([{"execution": e, "threads": p, **row} for (e, p), row in cells.items()],
                                   columns=["execution", "threads", *group.kernels]))
    return Table(f"matrix_{group.slug}", f"Median milliseconds, {group.title}",
                 "95 % intervals in brackets; * marks the fastest and what cannot be told apart from it.",
                 frames[0], frames[1].astype(object).where(frames[1].notna(), ""))


def over_scenes(analysis: Analysis) -> Table:
    """Points measured in all groups of one kind: the ratio of summed medians, never a mean of speedups."""
    empty = Table("over_scenes", "Over all scenes", "", pd.DataFrame(), pd.DataFrame())
    kinds: dict[tuple, list[Group]] = {}
    skip = {GROUP_AXES.index(axis) for axis in ("scene", "scene_hash", "size")}
    for group in analysis.groups:
        kinds.setdefault(tuple(k for i, k in enumerate(group.key) if i not in skip), []).append(group)
    numbers, words = [], []
    for kind, groups in kinds.items():
        if len(groups) < 2:
            continue
        found: dict[tuple, list[Record]] = {}
        for group in groups:
            for record in group.timed:
                name = (record.config.kernel, analysis.execution(record), record.config.threads, record.config.isa)
                found.setdefault(name, []).append(record)
        complete = {name: records for name, records in found.items() if len(records) == len(groups)}
        serial = [records for records in complete.values() if records[0].config.backend == "serial"]
        base = min(serial, key=lambda records: _sum(analysis, records), default=None)
        for name, records in sorted(complete.items(), key=lambda item: _sum(analysis, item[1])):
            total = _sum(analysis, records)
            ratio = None if base is None or records is base else estimates.ratio_of_sums(
                [r.samples for r in base], [r.samples for r in records])
            rate = estimates.harmonic_mean([1000 / analysis.estimates[r.id].value for r in records])
            named = "" if base is None else f"{base[0].config.kernel} serial, {text.number(_sum(analysis, base) / 1000)} s"
            numbers.append({"numeric": kind[0], "kernel": name[0], "execution": name[1], "threads": name[2], "scenes": len(groups),
                            "sum_of_medians_ms": total, **columns("speedup_of_sums", ratio), "base": named,
                            "frames_per_second_harmonic": rate})
            words.append({"kernel": name[0], "execution": name[1], "threads": str(name[2]), "numeric": kind[0],
                          "sum of medians, ms": text.number(total),
                          "speedup of the sums": "is the base" if records is base else times(ratio),
                          "frames/s (harmonic mean)": text.number(rate)})
    if not numbers:
        return empty
    bases = text.listing(sorted({row["base"] for row in numbers if row["base"]})) or "none"
    return Table("over_scenes", "Over all scenes", f"Points that were timed in every scene. Base: {bases} over the scenes. Speedup"
                 " is the ratio of summed medians; its interval resamples each point on its own.",
                 pd.DataFrame(numbers), pd.DataFrame(words))


def _sum(analysis: Analysis, records: list[Record]) -> float:
    return sum(analysis.estimates[record.id].value for record in records)


def stages(analysis: Analysis) -> Table:
    numbers, words = [], []
    for group in analysis.groups:
        for record in _ordered(group):
            if not record.stages:
                continue
            head = {"scene": group.title, "kernel": record.config.kernel, "execution": analysis.execution(record),
                    "threads": record.config.threads}
            medians = {name: float(np.median(values)) for name, values in record.stages.items()}
            numbers.append(head | {f"{name}_ms": value for name, value in medians.items()}
                           | {"frame_ms": analysis.estimates[record.id].value})
            words.append(head | {f"{name} ms": text.number(value) for name, value in medians.items()}
                         | {"frame ms": text.number(analysis.estimates[record.id].value)})
    return Table("stages", "Stages", "Medians of each stage; a stage that a kernel does not have is empty.",
                 pd.DataFrame(numbers), pd.DataFrame(words).fillna(""))


def verification(analysis: Analysis) -> Table:
    """Points with equal verdicts share a row: in one numeric mode all of them should."""
    rows: dict[tuple, list[Record]] = {}
    peers: dict[str, tuple[str, Record]] = {}  # beside several groups, a peer's picture is one
    for group in analysis.groups:
        for record in group.records:
            if not record.verify:
                continue
            oracle = record.verify.get("oracle") if isinstance(record.verify.get("oracle"), dict) else {}
            values = [record.verify.get("conforms"), record.verify.get("differing_pixels"), accuracy(record)]
            values += [*_classes(oracle), oracle.get("max_depth_error_steps")]
            rows.setdefault((group.title, *map(str, values)), []).append(record)
        for record in group.peers:
            peers.setdefault(record.id, (f"{record.config.scene} {'x'.join(map(str, record.config.size))}", record))
    for title, record in peers.values():
        truth = record.verify.get("end_to_end")
        if isinstance(truth, dict):
            rows.setdefault((title, *map(str, _peer_verdict(truth))), []).append(record)
    names = ["scene", "conforms", "differing pixels", "accuracy", "wrong", "exact tie", "edge", "depth", "unexplained", "unbounded",
             "max depth error (steps)"]
    frame = pd.DataFrame([dict(zip(names, (text.MISSING if v == "None" else v for v in key)))
                          | {"points": len(records), "kernels": _kernels(analysis, records)}
                          for key, records in rows.items()])
    frame = frame.loc[:, [c not in ("exact tie", "unbounded") or bool((frame[c] != text.MISSING).any()) for c in frame]]
    return Table("verification", "Verification", "Conforms: the same bits as the scalar specification of the numeric mode. Wrong pixels have"
                 " another owner than the oracle's; their classes: an exact tie of depths, explained by an edge or by a depth gap"
                 " within the mode's bound, unexplained, or of a mode without a bound."
                 + (" A peer has no specification: its picture is judged against the end-to-end truth, by the peer's own bound."
                    if any(r.verify for _, r in peers.values()) else ""), frame, frame.replace({"True": "yes", "False": "NO"}))


def _classes(oracle: dict[str, Any]) -> list[Any]:
    """Wrong pixels and their classes; older records have three classes, of which the first sum is made."""
    if "wrong" in oracle:
        return [oracle.get(key) for key in ("wrong", "exact_ties", *FORMER, "unbounded")]
    former = [oracle.get(key) for key in FORMER.values()]
    known = [count for count in former if numbers.is_number(count)]
    return [sum(known) if known else None, None, *former, None]


def _peer_verdict(truth: dict[str, Any]) -> list[Any]:
    """The cells of a peer's row: it cannot conform, and ties that its bound explains are its edges and depths."""
    errors = truth.get("errors")
    said = "within its bound" if errors == 0 else "outside its bound" if numbers.is_number(errors) else "not judged"
    return [None, None, said, truth.get("wrong"), None, truth.get("edge_ties"), truth.get("depth_ties"), errors, None,
            truth.get("max_depth_error_steps")]


def _kernels(analysis: Analysis, records: list[Record]) -> str:
    kernels = list(dict.fromkeys(strategy(record) for record in records))
    every = {record.config.kernel for record in analysis.study.records}
    return f"all {len(every)}" if len(kernels) == len(every) > 3 else ", ".join(kernels)


def not_timed(analysis: Analysis) -> Table:
    reasons: dict[tuple[str, str], list[Record]] = {}
    for record in analysis.study.every_record:
        if not record.ok:
            reasons.setdefault((record.status, record.reason), []).append(record)
    frame = pd.DataFrame([{"status": status, "reason": reason, "points": len(records),
                           "first of them": records[0].name} for (status, reason), records in reasons.items()])
    return Table("not_timed", "Points without a time", "Failed and skipped points, by reason.", frame, frame)


def plain(analysis: Analysis) -> str:
    """The tables of `python3 -m analysis table`."""
    parts = []
    for group in analysis.groups:
        words = points(analysis, group).words
        keep = [c for c in ("kernel", "execution", "threads", "median ms [95 %]", "n", "stop", "time / fastest", "x floor") if c in words]
        columns = {c: [c, *map(str, words[c])] for c in keep}
        # A reason is longer than a time; it may reach over the columns that it leaves empty.
        width = {c: max(len(v) for v in cells if ": " not in v) for c, cells in columns.items()}
        lines = []
        for cells in zip(*columns.values()):
            lines.append("  ".join(cell.ljust(width[c]) for c, cell in zip(keep, cells)).rstrip())
        rule = "-" * max(map(len, lines))
        parts.append("\n".join([group.title, rule, lines[0], rule, *lines[1:], rule]))
    parts.append("[..]: 95 % interval. ≈: cannot be told apart from the fastest.")
    return "\n\n".join(parts)


