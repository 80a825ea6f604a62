"""Tables of the trade: numeric modes x scenes, what a mode costs within one kernel and execution, the verdicts."""

from __future__ import annotations

from typing import Any, Callable

import pandas as pd

from . import fronts, text, trade
from .comparison import Analysis
from .load import Record
from .tables import Table, accuracy, columns, times
from .fronts import LITERAL
from .statistics import estimates, numbers
from .statistics.estimates import Estimate
from .trade import LIKE_AXES, SECTION, Picture, Trade

REFERENCES = ("f32", "f64")


def tables(analysis: Analysis) -> list[Table]:
    whole = trade.of(analysis)
    if not whole.pictures:
        return []
    found = [_matrix(whole, *what) for what in (
        ("accuracy_wrong", "Wrong pixels, modes x scenes", "Pixels whose owner is not the oracle's.", "oracle", "wrong"),
        ("accuracy_distance", "Worst distance in pixels, modes x scenes",
         "The largest distance of a misclassified pixel centre to the edge.", "oracle", "worst_distance_px"),
        ("accuracy_depth", "Largest depth error in steps of 2^-24, modes x scenes",
         "Over pixels of the same owner.", "oracle", "max_depth_error_steps"))]
    found += [_relative_times(whole), *(_trade(whole, picture) for picture in whole.pictures), _over_scenes(whole)]
    each = costs(whole)
    found += [_cost_matrix(_costs_over_scenes(each) or each, reference) for reference in REFERENCES]
    found.append(_cost_table(each))
    found += [*(_verdicts(whole, picture) for picture in whole.pictures), _bounds(whole)]
    return [table for table in found if len(table.numbers)]


def _modes(whole: Trade) -> list[str]:
    return list(dict.fromkeys(mode for picture in whole.pictures for mode in whole.entries(picture)))


def _rows(whole: Trade, cell: Callable[[Picture, str, Record], tuple[dict[str, Any], str]]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """A row a mode, a column (in numbers perhaps several) a picture."""
    numbers, words = [], []
    for mode in _modes(whole):
        row, said = {"mode": mode}, {"mode": mode}
        for picture in whole.pictures:
            record = whole.entries(picture).get(mode)
            values, said[picture.short] = ({}, "not run") if record is None else cell(picture, mode, record)
            row |= values
        numbers.append(row)
        words.append(said)
    return pd.DataFrame(numbers), pd.DataFrame(words)


def _matrix(whole: Trade, name: str, title: str, note: str, part: str, key: str) -> Table:
    def cell(picture: Picture, mode: str, record: Record) -> tuple[dict[str, Any], str]:
        value = fronts.number(record, part, key)
        return {picture.short: value}, text.MISSING if value is None else _small(value)

    numbers, words = _rows(whole, cell)
    if len(numbers.columns) < 2 or numbers.drop(columns="mode").isna().all(axis=None):
        return Table(name, title, note, pd.DataFrame(), pd.DataFrame(), section=SECTION)
    return Table(name, title, note + " A mode that was not judged has none.", numbers, words, section=SECTION)


def _small(value: float) -> str:
    """Distances reach from whole pixels to 1e-5."""
    return fronts.amount(value) if value == 0 or value >= 0.01 else f"{value:.1e}"


def _relative_times(whole: Trade) -> Table:
    """The fastest point of each mode against the fastest point of f32."""
    def cell(picture: Picture, mode: str, record: Record) -> tuple[dict[str, Any], str]:
        timed = whole.fastest[picture.slug].modes
        reference = timed[trade.REFERENCE_MODE][0] if trade.REFERENCE_MODE in timed else None
        if not record.ok or reference is None or mode not in timed:
            return {}, record.status if not record.ok else text.MISSING
        ratio = whole.over(record, reference)
        return columns(picture.short, ratio), "1" if record is reference else times(ratio)

    numbers, words = _rows(whole, cell)
    empty = len(numbers.columns) < 2
    return Table("accuracy_time", "Time relative to f32, modes x scenes", "Time of a mode's fastest point / time of f32's fastest point"
                 " [95 % interval of the paired ratio]; above 1 is slower. Their kernels may differ: see the tables of the scenes.",
                 pd.DataFrame() if empty else numbers, words, section=SECTION)


def _trade(whole: Trade, picture: Picture) -> Table:
    """The figure of a picture as a table: which point each mode stands for, and its role by each measure."""
    analysis = whole.analysis
    found = {measure.key: whole.front(whole.fastest[picture.slug], measure) for measure in fronts.MEASURES}
    entries, base = whole.entries(picture), whole.base(picture)
    if whole.is_literal(base):
        entries = {LITERAL: base} | entries
    numbers, words = [], []
    for name, record in entries.items():
        point = analysis.label(record)
        row: dict[str, Any] = {"mode": name, "point": point, "status": record.status, "unbounded": fronts.unbounded(record)}
        said = {"mode": name, "point": point if record.ok else f"{record.status}: {text.shorten(record.reason, 60)}"}
        timed = record.ok and record.id in analysis.estimates
        time = analysis.estimates[record.id] if timed else None
        speedup = whole.over(base, record) if timed and base is not None else None
        row |= columns("median_ms", time) | columns("speedup_over_base", speedup)
        said |= {"median ms [95 %]": times(time), "speedup [95 %]": "base" if record is base else times(speedup)}
        for measure in fronts.MEASURES:
            value, front = measure.of(record), found[measure.key]
            role = front.role(name) if front is not None else text.MISSING
            row |= {measure.key: value, f"{measure.key}_role": role}
            if any(measure.of(r) is not None for r in entries.values()):
                said |= {measure.noun: text.MISSING if value is None else fronts.amount(value), f"by {measure.noun}": role}
        numbers.append(row)
        words.append(said)
    marked = frozenset(i for i, row in enumerate(numbers) if row["wrong_role"] == "frontier")
    return Table(f"trade_{picture.slug}", f"Speed against accuracy, {picture.title}", "Each mode with its fastest timed point. Rows in bold"
                 " are on the frontier by wrong pixels.", pd.DataFrame(numbers), pd.DataFrame(words).fillna(""), marked, SECTION,
                 folded=len(whole.pictures) > 1)


def _over_scenes(whole: Trade) -> Table:
    numbers, words = [], []
    for view in whole.over_scenes:
        found = whole.fronts(view)
        marks = {front.measure.key: {mark.name: mark for mark in front.marks} for front in found}
        for mode, records in view.modes.items():
            mark = next((marks[key][mode] for key in marks if mode in marks[key]), None)
            if mark is None:
                continue
            total = estimates.ratio_of_sums([r.samples for r in view.bases], [r.samples for r in records])
            point = whole.analysis.label(records[0])
            row: dict[str, Any] = {"scenes": view.title, "mode": mode, "point": point} | columns("speedup_geometric_mean", mark.speedup)
            row |= columns("speedup_of_sums", total)
            said = {"scenes": view.title} if len(whole.over_scenes) > 1 else {}
            said |= {"mode": mode, "point": point, "speedup, geometric mean [95 %]": times(mark.speedup),
                     "speedup of the sums [95 %]": times(total)}
            for front in found:
                key, of = front.measure.key, marks[front.measure.key].get(mode)
                row |= {f"{key}_mean": of and of.error, f"{key}_worst": of and of.worst.error,
                        f"{key}_worst_scene": of and of.worst.scene, f"{key}_role": front.role(mode)}
                said |= {f"{front.measure.noun}: mean": text.MISSING if of is None else fronts.amount(of.error),
                         "worst" + _nth(key): text.MISSING if of is None else
                         fronts.amount(of.worst.error) + (f" ({of.worst.scene})" if of.worst.error else ""),
                         f"by {front.measure.noun}": front.role(mode)}
            numbers.append(row)
            words.append(said)
    return Table("trade_over_scenes", "Speed against accuracy, over scenes", "Speedups over the base that the figure names: the geometric"
                 " mean over scenes, and the ratio of summed medians, in which long scenes count for more. Rows in bold"
                 " are on the frontier by wrong pixels.", pd.DataFrame(numbers), pd.DataFrame(words).fillna(""),
                 frozenset(i for i, row in enumerate(numbers) if row.get("wrong_role") == "frontier"), SECTION)


def _nth(key: str) -> str:
    """Columns of one frame need names of their own."""
    return {"wrong": " scene", "depth": " scene, depth", "end_to_end": " scene, end to end"}[key]


# what a mode costs

def costs(whole: Trade) -> list[dict[str, Any]]:
    """One row for each mode, kernel and execution on a picture: its time over that of f32 and f64 in the same place."""
    rows = []
    for picture in whole.pictures:
        places: dict[tuple, dict[tuple[str, str], Record]] = {}
        for record in picture.records:
            if record.ok:
                key = tuple(getattr(record.config, axis) for axis in LIKE_AXES)
                places.setdefault(key, {})[record.config.numeric, record.config.isa] = record
        for place in places.values():
            if len({mode for mode, _ in place}) < 2:
                continue
            for (mode, isa), record in place.items():
                found = {r: _reference(place, r, isa) for r in REFERENCES}
                ratios = {name: whole.over(record, reference) for name, reference in found.items()
                          if reference is not None and reference is not record}
                if ratios:
                    execution = whole.analysis.execution(record)
                    rows.append({"scene": picture.short, "kernel": record.config.kernel, "execution": execution,
                                 "threads": record.config.threads, "isa": isa, "mode": mode, "ratios": ratios})
    return rows


def _reference(place: dict[tuple[str, str], Record], mode: str, isa: str) -> Record | None:
    """The reference with the same instruction set; else its only point: a mode without a vector form pays for that too."""
    if (mode, isa) in place:
        return place[mode, isa]
    only = [record for (name, _), record in place.items() if name == mode]
    return only[0] if len(only) == 1 else None


def _costs_over_scenes(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Geometric means, for what was timed on two scenes or more."""
    found: dict[tuple, dict[str, list[Estimate]]] = {}
    for row in rows:
        key = tuple(row[k] for k in ("kernel", "execution", "threads", "isa", "mode"))
        for reference, ratio in row["ratios"].items():
            found.setdefault(key, {}).setdefault(reference, []).append(ratio)
    means = []
    for key, ratios in found.items():
        scenes = max(map(len, ratios.values()))
        if scenes > 1:
            means.append({"scene": text.count(scenes, "scene"), **dict(zip(("kernel", "execution", "threads", "isa", "mode"), key)),
                          "ratios": {r: estimates.geometric_mean(e) for r, e in ratios.items() if len(e) == scenes}})
    return means


LIKE = ("Time / time of {} in the same kernel, backend, schedule, chunk and threads, and the same instruction set where there is one"
        " [95 % interval]; above 1 is slower.")


def _cost_matrix(rows: list[dict[str, Any]], reference: str) -> Table:
    """Modes x kernels, over the scenes or of the one scene."""
    rows = [row for row in rows if reference in row["ratios"]]
    place = {id(row): f"{row['kernel']}, {row['execution']}" + (f", {text.count(row['threads'], 'thread')}" if row["threads"] > 1 else "")
             for row in rows}
    titles = list(dict.fromkeys(place.values()))
    # Columns that differ in their instruction set say it; others do not need to.
    if len({(place[id(row)], row["mode"], row["scene"]) for row in rows}) < len(rows):
        place = {id(row): f"{place[id(row)]}, {row['isa']}" for row in rows}
        titles = list(dict.fromkeys(place.values()))
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    heads = [(scene, mode) for scene in scenes for mode in dict.fromkeys(r["mode"] for r in rows if r["scene"] == scene)]
    words = []
    for scene, mode in heads:
        cells = {place[id(r)]: times(r["ratios"][reference]) for r in rows if (r["scene"], r["mode"]) == (scene, mode)}
        words.append(({"scenes": scene} if len(scenes) > 1 else {}) | {"mode": mode} | {t: cells.get(t, text.MISSING) for t in titles})
    numbers = [{"scenes": r["scene"], "mode": r["mode"], "place": place[id(r)]} | columns(f"time_over_{reference}", r["ratios"][reference])
               for r in rows]
    about = f"{scenes[0]}" if len(scenes) == 1 else "modes x kernels"
    return Table(f"mode_cost_{reference}", f"What a mode costs relative to {reference}, {about}", LIKE.format(reference)
                 + " Over scenes: geometric means.", pd.DataFrame(numbers), pd.DataFrame(words), section=SECTION)


def _cost_table(rows: list[dict[str, Any]]) -> Table:
    """Everything, a row a point."""
    numbers, words = [], []
    for row in rows:
        head = {key: value for key, value in row.items() if key != "ratios"}
        numbers.append(head | {k: v for r in REFERENCES for k, v in columns(f"time_over_{r}", row["ratios"].get(r)).items()})
        words.append({k: str(v) for k, v in head.items()}
                     | {f"time / {r} [95 %]": times(row["ratios"][r]) if r in row["ratios"] else "is " + r if row["mode"] == r
                        else text.MISSING for r in REFERENCES})
    return Table("mode_cost_scenes", "What a mode costs, scene by scene", LIKE.format("f32 and of f64"), pd.DataFrame(numbers),
                 pd.DataFrame(words), section=SECTION, folded=True)


# verdicts

def _verdicts(whole: Trade, picture: Picture) -> Table:
    numbers, words = [], []
    for mode, record in whole.entries(picture).items():
        oracle = record.verify.get("oracle") if isinstance(record.verify.get("oracle"), dict) else {}
        end, rays, robust = (record.verify.get(part) if isinstance(record.verify.get(part), dict) else {}
                             for part in ("end_to_end", "embree", "embree_robust"))
        conforms = record.verify.get("conforms")
        row = {"mode": mode, "status": record.status, "conforms": conforms, "accuracy": accuracy(record)}
        row |= {f"oracle_{k}": v for k, v in oracle.items()} | {f"end_to_end_{k}": v for k, v in end.items()}
        row |= {f"embree_{k}": v for k, v in rays.items()} | {f"embree_robust_{k}": v for k, v in robust.items()}
        predicted = oracle.get("predicted")
        numbers.append(row)
        words.append({
            "mode": mode, "conforms": {True: "yes", False: "NO"}.get(conforms, text.MISSING), "oracle": accuracy(record),
            "wrong (false +, -)": _counts(oracle, "wrong", "false_positives", "false_negatives"),
            "tie/edge/depth/unexplained": _slashed(oracle, "exact_ties", "edge", "depth", "unexplained"),
            "wrong on snapped": _count(oracle.get("wrong_on_snapped")),
            "could be wrong": "no bound" if predicted == -1 else _count(predicted),
            "end to end: wrong (ambiguous)": _counts(end, "wrong", "ambiguous"),
            "edge/depth/no bound/error": _slashed(end, "edge_ties", "depth_ties", "unbounded", "errors"),
            "Embree: edge/depth/error": _rays(rays), "robust": _rays(robust)})
    note = ("Pixels. Conforms: the bits of the mode's scalar specification. On snapped: against the oracle on the vertices that a fixed-point"
            " mode rounds to. Could be wrong: pixels that the mode's bound leaves open. Classes of wrong pixels: an exact tie, explained by"
            " an edge or a depth gap within the bound, unexplained.")
    return Table(f"verdicts_{picture.slug}", f"Verdicts, {picture.title}", note, pd.DataFrame(numbers), pd.DataFrame(words),
                 section=SECTION, folded=True)


def _rays(verdict: dict[str, Any]) -> str:
    return f"skipped: {verdict['skipped']}" if verdict.get("skipped") else _slashed(verdict, "edge_ties", "depth_ties", "errors")


def _count(value: object) -> str:
    return f"{value:,.0f}" if numbers.is_number(value) else text.MISSING


def _counts(source: dict[str, Any], first: str, *rest: str) -> str:
    if not numbers.is_number(source.get(first)):
        return text.MISSING
    return f"{_count(source[first])} ({', '.join(_count(source.get(key)) for key in rest)})"


def _slashed(source: dict[str, Any], *keys: str) -> str:
    return "/".join(_count(source.get(key)) for key in keys) if any(numbers.is_number(source.get(k)) for k in keys) else text.MISSING


def _bounds(whole: Trade) -> Table:
    """What each mode promises, in its own words."""
    rows: dict[tuple[str, str, str], None] = {}
    for picture in whole.pictures:
        for mode, record in whole.entries(picture).items():
            bound = record.verify.get("bound")
            if isinstance(bound, dict):
                rows[mode, str(bound.get("text") or text.MISSING), str(bound.get("source") or text.MISSING)] = None
    frame = pd.DataFrame(list(rows), columns=["mode", "stated bound", "source"])
    return Table("stated_bounds", "Stated bounds", "", frame, frame, section=SECTION, folded=True)
