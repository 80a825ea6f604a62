"""Ladders: what each technique gives, and strategies side by side where they have the same ones.

A rung is an instruction set and a set of techniques. Points that differ in kernel and rung only, on one picture and in one
execution, make ladders. The first climbs in the order of the study, from kernel to kernel; every kernel that has more rungs
than it shows there has a ladder of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from . import text
from .comparison import Analysis, Group, execution
from .load import TECHNIQUES, Config, Record, technique_set
from .tables import Table, columns, times

SECTION = "Ladder of techniques"
ISAS = ("baseline", "sse4", "avx2", "avx512")  # each has what those before it have
# What the points of one ladder share besides the picture and the arithmetic of their group.
SETTING_AXES = ("backend", "schedule", "chunk", "threads", "binding", "wait_policy", "runtime", "generality")


@dataclass(frozen=True)
class Rung:
    isa: str
    techniques: frozenset[str]

    @staticmethod
    def of(config: Config) -> Rung:
        """Records from before there were techniques differ in the instruction set only."""
        return Rung(config.isa, technique_set(config.techniques) if config.techniques is not None else frozenset())

    @property
    def words(self) -> str:
        named = " + ".join(name for name in TECHNIQUES if name in self.techniques)
        return f"isa {self.isa}, " + ("no technique" if not named else "all techniques" if len(self.techniques) == len(TECHNIQUES) else named)

    @property
    def height(self) -> tuple[int, int]:
        return ISAS.index(self.isa) if self.isa in ISAS else -1, len(self.techniques)

    def holds(self, lower: Rung) -> bool:
        """Whether this rung has everything that `lower` has."""
        known = self.isa == lower.isa or (self.isa in ISAS and lower.isa in ISAS)
        return known and self.height[0] >= lower.height[0] and self.techniques >= lower.techniques


@dataclass(frozen=True)
class Step:
    record: Record
    before: Record | None  # on the rung before; None at the foot
    label: str  # of the foot what it is, of the others what they add


@dataclass(frozen=True)
class Ladders:
    """Those of one picture in one execution."""

    group: Group
    title: str
    slug: str
    ladders: list[list[Step]]
    equal: list[tuple[Rung, list[Record]]]  # rungs that several kernels stand on, from the lowest; the fastest first


def find(analysis: Analysis) -> list[Ladders]:
    """Of every group and execution in which some kernel stands on several rungs. Where a kernel stands several times on one
    rung, as with several sizes of tiles, its first point there counts."""
    found = []
    for group in analysis.groups:
        settings: dict[tuple, list[Record]] = {}
        for record in group.timed:
            settings.setdefault(tuple(getattr(record.config, axis) for axis in SETTING_AXES), []).append(record)
        made = [(records, _ladders(records)) for records in map(_first_of_each, settings.values())]
        made = [(records, ladders) for records, ladders in made if ladders]
        for i, (records, ladders) in enumerate(made):
            config = records[0].config
            where = execution(config) + ("" if config.backend == "serial" else f" on {text.count(config.threads, 'thread')}")
            found.append(Ladders(group, f"{group.title}, {where}", group.slug + (f"_{i + 1}" if len(made) > 1 else ""), ladders,
                                 _equal(analysis, records)))
    return found


def _first_of_each(records: list[Record]) -> list[Record]:
    first: dict[tuple, Record] = {}
    for record in records:
        first.setdefault((record.config.kernel, Rung.of(record.config)), record)
    return list(first.values())


def _ladders(records: list[Record]) -> list[list[Step]]:
    if not any(_rungs([r for r in records if r.config.kernel == kernel]) > 1 for kernel in {r.config.kernel for r in records}):
        return []  # kernels side by side, each as it is: nothing is climbed
    across = _across(records)
    result = [across] if _rungs([step.record for step in across]) > 1 else []
    shown = {step.record.id for ladder in result for step in ladder}
    for kernel in dict.fromkeys(record.config.kernel for record in records):
        mine = [record for record in records if record.config.kernel == kernel]
        own = _climb(sorted(mine, key=lambda r: Rung.of(r.config).height))
        if _rungs([step.record for step in own]) > 1 and any(step.record.id not in shown for step in own):
            result.append(own)
    return result


def _rungs(records: list[Record]) -> int:
    return len({Rung.of(record.config) for record in records})


def _across(records: list[Record]) -> list[Step]:
    """The ladder in the order of the study: a kernel enters once, at its first point, and only with all that the one before
    it had."""
    chosen: list[Record] = []
    seen: set[str] = set()
    for record in records:
        last = chosen[-1].config if chosen else None
        follows = last is None or record.config.kernel == last.kernel or record.config.kernel not in seen
        if follows and (last is None or Rung.of(record.config).holds(Rung.of(last))):
            chosen.append(record)
        seen.add(record.config.kernel)
    return _climb(chosen)


def _climb(records: list[Record]) -> list[Step]:
    """Steps from record to record; one that lacks something of the last is left out."""
    steps: list[Step] = []
    for record in records:
        before = steps[-1].record if steps else None
        if before is None or Rung.of(record.config).holds(Rung.of(before.config)):
            steps.append(Step(record, before, _label(record, before)))
    return steps


def _label(record: Record, before: Record | None) -> str:
    here = Rung.of(record.config)
    if before is None:
        return f"{record.config.kernel}, {here.words}"
    last = Rung.of(before.config)
    added = [f"kernel {record.config.kernel}"] if record.config.kernel != before.config.kernel else []
    added += [f"isa {here.isa}"] if here.isa != last.isa else []
    added += [name for name in TECHNIQUES if name in here.techniques - last.techniques]
    return "+ " + ", ".join(added)


def _equal(analysis: Analysis, records: list[Record]) -> list[tuple[Rung, list[Record]]]:
    rungs: dict[Rung, list[Record]] = {}
    for record in records:
        rungs.setdefault(Rung.of(record.config), []).append(record)
    shared = [(rung, sorted(found, key=lambda r: analysis.estimates[r.id].value)) for rung, found in rungs.items() if len(found) > 1]
    return sorted(shared, key=lambda item: item[0].height)


def name(ladder: list[Step]) -> str:
    """'tile_parallel', 'tile_parallel to fused_tiles'."""
    first, last = ladder[0].record.config.kernel, ladder[-1].record.config.kernel
    return first if first == last else f"{first} to {last}"


def tables(analysis: Analysis) -> list[Table]:
    found = find(analysis)
    return [_ladder_table(analysis, found), *([_equal_table(analysis, found)] if any(l.equal for l in found) else [])] if found else []


def _place(record: Record) -> dict[str, object]:
    config = record.config
    return {"scene": config.scene, "size": "x".join(map(str, config.size)), "numeric": config.numeric, "execution": execution(config),
            "threads": config.threads}


def _ladder_table(analysis: Analysis, found: list[Ladders]) -> Table:
    numbers, words = [], []
    for ladders in found:
        for ladder in ladders.ladders:
            for i, step in enumerate(ladder):
                record, estimate = step.record, analysis.estimates[step.record.id]
                faster = analysis.speedup(record, step.before)
                over_foot = analysis.speedup(record, ladder[0].record)
                floor = None if record.floor_ms is None else estimate.value / record.floor_ms
                numbers.append(_place(record) | {
                    "ladder": name(ladder), "rung": i, "kernel": record.config.kernel, "isa": record.config.isa,
                    "techniques": record.config.techniques} | columns("median_ms", estimate) | columns("over_rung_before", faster)
                    | {"over_rung_before_kind": faster.kind if faster else None} | columns("over_foot", over_foot)
                    | {"times_floor": floor, "id": record.id})
                words.append({
                    "scene": ladders.title, "ladder": name(ladder), "rung": step.label, "median ms [95 %]": times(estimate),
                    "over the rung before": "is the foot" if step.before is None else times(faster),
                    "over the foot": "" if step.before is None else times(over_foot), "x floor": text.number(floor)})
    note = ("Over the rung before: its time / the time of this rung, above 1 where the addition pays; over paired samples where blocks"
            " are shared. x floor: times the time in which the point's bytes pass at the measured rate.")
    return Table("ladder", "What each technique gives", note, pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words), section=SECTION)


def _equal_table(analysis: Analysis, found: list[Ladders]) -> Table:
    numbers, words = [], []
    for ladders in found:
        for rung, records in ladders.equal:
            for record in records:
                slower = None if record is records[0] else analysis.speedup(records[0], record)
                numbers.append(_place(record) | {"isa": rung.isa, "techniques": record.config.techniques, "kernel": record.config.kernel}
                               | columns("median_ms", analysis.estimates[record.id]) | columns("time_over_fastest", slower)
                               | {"id": record.id})
                words.append({"scene": ladders.title, "rung": rung.words, "kernel": record.config.kernel,
                              "median ms [95 %]": times(analysis.estimates[record.id]),
                              "time / fastest of the rung": "fastest" if record is records[0] else times(slower)})
    return Table("equal_rungs", "Strategies at equal rungs", "Each over the fastest of its own rung, over paired samples.",
                 pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words), section=SECTION, folded=len(words) > 40)
