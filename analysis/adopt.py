"""The times of a program that `rasterbench adopt` has judged and timed: speedup, efficiency and schedules.

Every sample is a process of its own, so the samples of a point are independent of each other and its intervals are exact
ones by order statistics; samples of one block are pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd

from . import load, sidecars, style, text, writing
from .load import InputError
from .statistics import estimates
from .statistics.estimates import Estimate
from .statistics.fastest import Comparison, compare_with_best
from .statistics.numbers import is_number
from .statistics.samples import Samples
from .tables import VERDICTS, Table, columns, times

AS_COMPILED = "as compiled"  # the program does not ask for OMP_SCHEDULE

NOISY = 0.25  # CPUs that others kept busy; as harness/adopt_command.cpp


@dataclass(frozen=True)
class TimedPoint:
    schedule: str
    threads: int
    samples: Samples  # milliseconds
    cpus_busy: float
    own: tuple[float, ...]  # what the program itself printed, in its own unit

    @property
    def name(self) -> str:
        return f"{text.count(self.threads, 'thread')}, {self.schedule}"


@dataclass(frozen=True)
class Adoption:
    """One adopt.json that has times."""

    program: str
    scene: str
    machine: str
    region: str
    stop: str
    other_load: float | None  # CPUs that others kept busy
    points: list[TimedPoint]

    @property
    def noise(self) -> str:
        """A sentence where others took so much of the machine that the times say more of them than of the program."""
        if self.other_load is None or self.other_load <= NOISY:
            return ""
        return f"Noisy machine: other programs kept {text.number(self.other_load)} CPUs busy in the mean; not to be published."

    @property
    def title(self) -> str:
        return f"{self.program}, {self.scene}"

    @property
    def schedules(self) -> list[str]:
        return list(dict.fromkeys(point.schedule for point in self.points))

    @property
    def threads(self) -> list[int]:
        return sorted({point.threads for point in self.points})

    @property
    def sampled(self) -> str:
        return text.span([point.samples.n for point in self.points])

    def line(self, schedule: str) -> list[TimedPoint]:
        """The points of one schedule, in the order of their threads."""
        return sorted((p for p in self.points if p.schedule == schedule), key=lambda p: p.threads)

    def base(self, schedule: str) -> TimedPoint:
        return self.line(schedule)[0]

    def speedup(self, point: TimedPoint) -> Estimate:
        """Over the same schedule on one thread, paired by block."""
        base = self.base(point.schedule)
        if base is point:
            return Estimate(1.0, None, None, point.samples.n, "base")
        return estimates.ratio(base.samples, point.samples)

    @cached_property
    def comparisons(self) -> list[Comparison]:
        """Every point against the fastest, in the order of the points."""
        return compare_with_best([point.samples for point in self.points])[1]


def read(directory: Path) -> Adoption:
    path = directory / "adopt.json"
    value = load.parse(load.read_text(path, "no such file (expected the folder of `rasterbench adopt --out`)"), path, None)
    load.check_schema(value, path, None)
    timing = value.get("timing")
    if timing is None:
        raise InputError(path, "the program was judged wrong, so it was not timed", field="timing")
    program, scene, machine = (_mapping(path, value, key) for key in ("program", "scene", "machine"))
    points = timing.get("points") if isinstance(timing, dict) else None
    if not isinstance(points, list) or not points:
        raise InputError(path, "expected a list of points", field="timing.points")
    read_points = [_point(path, i, point) for i, point in enumerate(points)]
    for schedule in {p.schedule for p in read_points}:
        threads = [p.threads for p in read_points if p.schedule == schedule]
        if 1 not in threads or len(set(threads)) < len(threads):
            raise InputError(path, f"{schedule}: expected each number of threads once, and 1 among them", field="timing.points")
    if len({p.samples.n for p in read_points}) > 1:
        raise InputError(path, "the points have different numbers of samples, but blocks are complete", field="timing.points")
    size = scene.get("size")
    shown = f"{Path(str(scene.get('model'))).stem if '/' in str(scene.get('model')) else scene.get('model')}"
    if isinstance(size, list) and len(size) == 2:
        shown += f" at {size[0]}x{size[1]}"
    return Adoption(Path(str(program.get("path", "program"))).name, shown, text.machine(machine), str(timing.get("region", "")),
                    str(timing.get("stop", "")), other if is_number(other := timing.get("other_load_cpus")) else None, read_points)


def _mapping(path: Path, value: dict[str, Any], key: str) -> dict[str, Any]:
    if not isinstance(value.get(key), dict):
        raise InputError(path, "expected an object", field=key)
    return value[key]


def _point(path: Path, index: int, value: Any) -> TimedPoint:
    field = f"timing.points[{index}]"
    if not isinstance(value, dict):
        raise InputError(path, "expected an object", field=field)
    threads, schedule, samples = value.get("threads"), value.get("schedule"), value.get("samples_ms")
    if not load.is_whole(threads) or threads < 1:
        raise InputError(path, f"expected a whole number above 0, found {threads!r}", field=f"{field}.threads")
    if schedule is not None and not isinstance(schedule, str):
        raise InputError(path, f"expected text or null, found {schedule!r}", field=f"{field}.schedule")
    if not isinstance(samples, list) or not samples or not all(is_number(s) and s > 0 for s in samples):
        raise InputError(path, "expected a list of numbers above 0", field=f"{field}.samples_ms")
    busy, own = value.get("cpus_busy"), value.get("own_times") or []
    if not is_number(busy) or busy < 0:
        raise InputError(path, f"expected a number that is not below 0, found {busy!r}", field=f"{field}.cpus_busy")
    if not isinstance(own, list) or not all(is_number(x) for x in own):
        raise InputError(path, "expected a list of numbers", field=f"{field}.own_times")
    n = len(samples)
    return TimedPoint(schedule or AS_COMPILED, threads, Samples(np.array(samples, dtype=float), np.zeros(n, dtype=int), np.arange(n)),
                      float(busy), tuple(map(float, own)))


def table(adoption: Adoption) -> Table:
    """One row a point, in the order of schedules and threads."""
    numbers, words = [], []
    has_own = any(point.own for point in adoption.points)
    for point, comparison in zip(adoption.points, adoption.comparisons):
        time, speedup = estimates.median_estimate(point.samples), adoption.speedup(point)
        efficiency = estimates.efficiency(speedup, point.threads)
        values = point.samples.values
        p95 = float(np.sort(values)[int(np.ceil(0.95 * len(values))) - 1]) if len(values) >= 59 else None
        own = float(np.median(point.own)) if point.own else None
        numbers.append({
            "schedule": point.schedule, "threads": point.threads, "n": point.samples.n, **columns("median_ms", time), "p95_ms": p95,
            "max_ms": float(values.max()), **columns("speedup", speedup), **columns("efficiency", efficiency),
            "cpus_busy": point.cpus_busy, **({"own_median": own} if has_own else {}), "verdict": comparison.verdict,
            "ratio_to_fastest": comparison.ratio.value, "p_holm": comparison.p_holm})
        words.append({
            "schedule": point.schedule, "threads": str(point.threads), "time (ms)": times(time), "max (ms)": text.number(float(values.max())),
            "speedup": "base" if speedup.kind == "base" else times(speedup),
            "efficiency": "base" if speedup.kind == "base" else times(efficiency), "CPUs busy": text.number(point.cpus_busy),
            **({"own time": text.number(own)} if has_own else {}), "against the fastest": VERDICTS[comparison.verdict]})
    return Table("adopt", f"Times of {adoption.title}",
                 f"Medians of whole processes with 95 % intervals ({adoption.sampled}). Base of speedup and efficiency: the same program and"
                 f" schedule on one thread, paired by block. Against the fastest: rank test, Holm-corrected. Machine: {adoption.machine}. {adoption.noise}".rstrip(),
                 pd.DataFrame(numbers), pd.DataFrame(words))


def write(directory: Path) -> str:
    """Writes figures and tables; the table for a terminal and what was written."""
    from .figures import adoption as drawing

    adoption = read(directory)
    made = table(adoption)
    figures: dict[str, str | bytes] = {}
    with matplotlib.rc_context(style.RC):
        for drawn in drawing.draw(adoption):
            figures |= sidecars.files(drawn, *sidecars.drawn_from(directory / "adopt.json", directory / "figures"))
            figures[f"{drawn.name}.txt"] = f"{drawn.caption.plain}\n{drawn.caption.reading}\n"
    writing.write_folder(directory / "figures", figures, "adopt")
    writing.write_folder(directory / "tables", {"adopt.csv": made.csv(), "adopt.tex": made.tex()}, "adopt")
    noise = f"\n{adoption.noise}" if adoption.noise else ""
    return f"{plain(made.words)}{noise}\nwritten: {directory / 'figures'}: {', '.join(figures)}; {directory / 'tables'}: adopt.csv, adopt.tex"


def plain(words: pd.DataFrame) -> str:
    cells = [[name, *map(str, words[name])] for name in words]
    widths = [max(map(len, column)) for column in cells]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in zip(*cells))
