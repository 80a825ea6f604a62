"""How many times faster than a peer the kernel of a study is, how many times the floor it takes, and whether that is the goal.

For a study of one kernel in one arithmetic and execution beside one peer (studies/speed.toml). Ratios are those of paired
samples of one run, because machines drift; a goal is judged by the interval of the ratio, never by its median alone.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from . import checks, text, writing
from .comparison import PEER_AXES, Analysis, execution
from .load import InputError, Record
from .statistics import estimates, numbers
from .statistics.estimates import Estimate
from .tables import Table, columns, times

HD, UHD = (1920, 1080), (3840, 2160)
REACHED, MISSED, UNDECIDED, NOT_MEASURED = "reached", "MISSED", "undecided", "not measured"
VERDICTS = (REACHED, MISSED, UNDECIDED, NOT_MEASURED)


@dataclass(frozen=True)
class Goal:
    """What is to be reached on all threads by pictures of one class, which their load decides, not their names."""

    name: str
    meaning: str
    size: tuple[int, int]
    triangles: tuple[float, float]  # of the model: at least, below
    pixels: tuple[float, float]  # pixel centres inside a triangle, hidden ones too, mean over the model: at least, below
    times_faster: float  # than the peer on as many threads: at least
    times_floor: float | None  # at most; None: no goal

    def holds(self, size: tuple[int, int], triangles: float, pixels: float) -> bool:
        return (size == self.size and self.triangles[0] <= triangles < self.triangles[1]
                and self.pixels[0] <= pixels < self.pixels[1])


# Disjoint, so that their order does not matter. For AVX-512 and the top-left fill rule.
GOALS = (
    Goal("small", "500k triangles or more of about 2 px at 1920x1080", HD, (500e3, 2.5e6), (0, 5), 25, 6),
    Goal("small, 3.5M", "about 3.5M small triangles at 1920x1080", HD, (2.5e6, 5e6), (0, 5), 45, 2.5),
    Goal("medium", "5 to 50 px a triangle at 1920x1080", HD, (50e3, 5e6), (5, 50), 15, None),
    Goal("medium, 4K", "500k triangles or more of 5 to 50 px at 3840x2160", UHD, (500e3, 5e6), (5, 50), 15, None),
    Goal("big, 4K", "about 10k px a triangle at 3840x2160", UHD, (1e3, 50e3), (3e3, 30e3), 20, 2.2),
    Goal("big, 4K, deep", "about 69k px a triangle, 25 over each other, at 3840x2160", UHD, (1e3, 50e3), (30e3, 200e3), 45, 3.6))
# The share of a goal that an instruction set is to reach; those that are not named have none.
SHARE = {"avx512": 1.0, "avx2": 0.5}
UNTIMED = ("failed: ", "skipped: ")  # what takes the place of a time, before its reason
FILL = "top-left"  # the rule that the goals and the peer share


@dataclass(frozen=True)
class Row:
    """A kernel's point beside the peer's on the same picture and as many threads."""

    kernel: Record
    peer: Record | None
    pixels: float | None  # a triangle; None where no point of the picture was drawn
    goal: Goal | None  # of the picture's class
    faster: Estimate | None  # times faster than the peer
    floor: Estimate | None  # times the floor; its interval is that of the time
    judged: bool  # on all threads, in the fill rule and in an instruction set that have goals
    faster_verdict: str  # "" where there is no goal
    floor_verdict: str

    @property
    def share(self) -> float:
        return SHARE.get(self.kernel.config.isa, 1.0)


def verdict(estimate: Estimate | None, goal: float, at_least: bool) -> str:
    """Reached or missed only where the whole interval is on one side of the goal, and, of a ratio, that of paired samples:
    unpaired, it would hold what the machine did in between."""
    if estimate is None:
        return NOT_MEASURED
    if not estimate.has_interval or estimate.kind.startswith("unpaired"):
        return UNDECIDED
    low, high = (estimate.low, estimate.high) if at_least else (-estimate.high, -estimate.low)
    bound = goal if at_least else -goal
    return REACHED if low >= bound else MISSED if high < bound else UNDECIDED


def goal_of(size: tuple[int, int], triangles: float, pixels: float) -> Goal | None:
    return next((goal for goal in GOALS if goal.holds(size, triangles, pixels)), None)


def _picture(record: Record) -> tuple:
    return tuple(getattr(record.config, axis) for axis in PEER_AXES)


def _strategy(record: Record) -> str:
    """What all kernels of the table share, in words."""
    config = record.config
    return f"{config.kernel}, {config.numeric}, fill {config.fill}, {execution(config)}"


def _only_strategy(analysis: Analysis) -> str:
    """Refuses studies of several kernels, whose rows would need a choice that the table does not make."""
    found = list(dict.fromkeys(map(_strategy, analysis.study.records)))
    if len(found) != 1:
        named = "; ".join(found[:2]) + (f"; and {len(found) - 2} more" if len(found) > 2 else "") if found else "none"
        raise InputError(analysis.study.directory / "records.jsonl",
                         f"expected one kernel in one arithmetic and execution, as studies/speed.toml has, found {named}")
    return found[0]


def _loads(analysis: Analysis) -> dict[tuple, tuple[float, float]]:
    """Triangles and pixels a triangle of each picture that some kernel drew, timed or not."""
    found = {}
    for record in analysis.study.records:
        triangles, covered = record.work.get("triangles"), record.work.get("fragments_covered")
        if numbers.is_number(triangles) and triangles > 0 and numbers.is_number(covered):
            found[_picture(record)] = (float(triangles), covered / triangles)
    return found


def _all_threads(analysis: Analysis) -> int:
    """The CPUs of the run; of an older record, that does not have them, the most threads of the study."""
    allowed = analysis.study.context["machine"].get("cpus_allowed")
    return len(allowed) if isinstance(allowed, list) else max(r.config.threads for r in analysis.study.every_record)


def rows(analysis: Analysis) -> list[Row]:
    """One for each point of the kernel, in the order of the study."""
    loads = _loads(analysis)
    most = _all_threads(analysis)
    found = []
    for record in analysis.study.records:
        config = record.config
        load = loads.get(_picture(record))
        goal = goal_of(config.size, *load) if load else None
        peer = next((p for p in analysis.study.peers if _picture(p) == _picture(record) and p.config.threads == config.threads), None)
        faster = estimates.ratio(peer.samples, record.samples) if record.ok and peer is not None and peer.ok else None
        floor = (analysis.estimates[record.id].scaled(1 / record.floor_ms)
                 if record.ok and record.floor_ms is not None else None)
        judged = goal is not None and config.threads == most and config.fill == FILL and config.isa in SHARE
        share = SHARE.get(config.isa, 1.0)
        found.append(Row(
            record, peer, load[1] if load else None, goal, faster, floor, judged,
            verdict(faster, goal.times_faster * share, at_least=True) if judged else "",
            verdict(floor, goal.times_floor / share, at_least=False) if judged and goal.times_floor is not None else ""))
    return found


def _time(analysis: Analysis, record: Record | None) -> str:
    """The median with its interval, or why there is none."""
    if record is None:
        return "not in the study"
    return times(analysis.estimates[record.id]) if record.ok else f"{record.status}: {record.reason}"


def table(analysis: Analysis) -> Table:
    """The rows as numbers and as words."""
    strategy = _only_strategy(analysis)
    numbers, words = [], []
    for row in rows(analysis):
        config, goal = row.kernel.config, row.goal
        size = "x".join(map(str, config.size))
        faster_goal = goal.times_faster * row.share if row.judged else None
        floor_goal = goal.times_floor / row.share if row.judged and goal.times_floor is not None else None
        numbers.append(
            {"class": goal.name if goal else None, "scene": config.scene, "size": size, "pixels_per_triangle": row.pixels,
             "isa": config.isa, "threads": config.threads, "status": row.kernel.status, "reason": row.kernel.reason}
            | columns("kernel_ms", analysis.estimates.get(row.kernel.id))
            | {"peer": row.peer.config.kernel if row.peer else None,
               "peer_status": row.peer.status if row.peer else "not in the study",
               "peer_reason": row.peer.reason if row.peer else None}
            | columns("peer_ms", analysis.estimates.get(row.peer.id) if row.peer else None)
            | columns("times_faster", row.faster)
            | {"times_faster_kind": row.faster.kind if row.faster else None,
               "times_faster_n": row.faster.n if row.faster else None,
               "times_faster_goal": faster_goal, "times_faster_verdict": row.faster_verdict or None,
               "floor_ms": row.kernel.floor_ms}
            | columns("times_floor", row.floor)
            | {"times_floor_goal": floor_goal, "times_floor_verdict": row.floor_verdict or None, "id": row.kernel.id})
        words.append({
            "class": goal.name if goal else text.MISSING, "scene": f"{config.scene} {size}", "px/tri": text.number(row.pixels),
            "isa": config.isa, "threads": str(config.threads), "kernel ms": _time(analysis, row.kernel),
            f"{_peer_name(analysis)} ms": _time(analysis, row.peer), "times faster": times(row.faster),
            "goal": f">= {faster_goal:g}: {row.faster_verdict}" if faster_goal is not None else "",
            "x floor": times(row.floor), "floor goal": f"<= {floor_goal:g}: {row.floor_verdict}" if floor_goal is not None else ""})
    note = ("In brackets 95 % intervals, of times faster over paired samples. px/tri: pixel centres inside a triangle, hidden ones too, mean"
            " over the model. x floor: times the time in which the triangles are read and the pixels written at the highest measured"
            " rates. Goals are for all threads; avx2 is to reach half of one.")
    return Table("speed", f"Speed: {strategy}", note, pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words))


def _peer_name(analysis: Analysis) -> str:
    return analysis.study.peers[0].config.kernel if analysis.study.peers else "peer"


def _head(analysis: Analysis) -> list[str]:
    isas = list(dict.fromkeys(r.config.isa for r in analysis.study.records))
    version = analysis.study.context["libraries"].get(_peer_name(analysis))
    launches = max((r.samples.launch_count for r in analysis.study.every_record if r.ok), default=0)
    return [f"Kernel: {_only_strategy(analysis)}; instruction sets: {', '.join(isas)}",
            f"Peer:   {version if version else f'{_peer_name(analysis)}, its version is not recorded'}",
            f"Machine: {analysis.machine}; {analysis.sampled(analysis.study.every_record)}"
            f" in {text.count(launches, 'launch', 'launches')}"]


def summary(analysis: Analysis) -> list[str]:
    """The goals that were reached, missed and neither, and the classes without a picture."""
    found = rows(analysis)
    said = []
    for what, verdicts in (("Times faster", [r.faster_verdict for r in found]), ("Times the floor", [r.floor_verdict for r in found])):
        counts = {v: verdicts.count(v) for v in VERDICTS}
        goals = sum(counts.values())
        said.append(f"{what}: " + (f"of {text.count(goals, 'goal')} " + ", ".join(f"{n} {v}" for v, n in counts.items() if n)
                                   if goals else "no goal applies") + ".")
    absent = [f"{goal.name} ({goal.meaning})" for goal in GOALS if not any(r.judged and r.goal is goal for r in found)]
    if absent:
        said.append(f"No point is judged in: {'; '.join(absent)}.")
    return said


def plain(analysis: Analysis) -> str:
    """The table of `python3 -m analysis speed`, for a terminal: a line with class and picture, then its points."""
    made = table(analysis)
    of_picture = ["class", "scene", "px/tri"]
    keep = [name for name in made.words if name not in of_picture]
    reasons: list[str] = []  # longer than a time: told below the table, so that its columns stay narrow

    def cell(value: str) -> str:
        if not value.startswith(UNTIMED):
            return value
        if value not in reasons:
            reasons.append(value)
        return f"{value.partition(':')[0]} ({reasons.index(value) + 1})"

    cells = [[cell(value) for value in line] for line in made.words[keep].itertuples(index=False, name=None)]
    width = [max(map(len, column)) for column in zip(keep, *cells)]
    heads = [f"{kind}: {scene}, {pixels} px a triangle" if kind != text.MISSING else f"no class: {scene}, {pixels} px a triangle"
             for kind, scene, pixels in made.words[of_picture].itertuples(index=False, name=None)]
    lines = []
    for i, line in enumerate(cells):
        if i == 0 or heads[i] != heads[i - 1]:
            lines.append(heads[i])
        lines.append("  " + _padded(line, width))
    first = "  " + _padded(keep, width)
    rule = "-" * max(map(len, [first, *lines]))
    unfit = [f"Not publishable: {warn.text}" for warn in checks.check(analysis) if warn.severity == checks.NOT_PUBLISHABLE]
    below = [*(f"({i}) {reason}" for i, reason in enumerate(reasons, start=1)), made.note, "", *summary(analysis), *unfit]
    wrapped = [textwrap.fill(line, max(80, len(rule)), break_on_hyphens=False) for line in below]
    return "\n".join([*_head(analysis), rule, first, rule, *lines, rule, *wrapped])


def _padded(line: list[str], width: list[int]) -> str:
    return "  ".join(value.ljust(w) for value, w in zip(line, width)).rstrip()


def write(analysis: Analysis) -> list[Path]:
    """Writes DIR/speed.csv and DIR/speed.tex."""
    made = table(analysis)
    files = {analysis.study.directory / "speed.csv": made.csv(), analysis.study.directory / "speed.tex": made.tex()}
    for path, content in files.items():
        writing.write(path, content)
    return list(files)
