"""The same source under several compilers and flags, as `scripts/compilers` measured it: times over those of a base program.

What repeats is the round: one launch of every program, in random order. A ratio is the median, over the rounds, of the median of
a program's launch over that of the base's launch in the same round, so that drift between rounds cancels; its interval is that of
order statistics over the rounds. Samples within a launch are not paired: two programs do not run at once.

A program conforms where it draws the bits of the judge's specification, and one that should and does not shows no speed. One that
was compiled with -ffast-math has no bits to promise: it is shown, always marked, with its accuracy beside its time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Iterable

import matplotlib
import numpy as np
import pandas as pd

from . import load, sidecars, style, text, writing
from .comparison import execution
from .load import Config, InputError, Record, Study
from .statistics import intervals
from .statistics.estimates import Estimate
from .statistics.numbers import is_number
from .statistics.samples import Samples
from .tables import Table, columns, times

SCHEMA = 1
PLAN = "compilers.json"
INTERVAL = "order statistics over rounds"
CONFORMS, DIFFERS, UNPROMISED = "yes", "NO", "not promised"


@dataclass(frozen=True)
class Configuration:
    """A compiler with its flags, or a program that was given."""

    name: str
    flags: str
    compiler: str  # as the program says it; "" where there is none
    fast_math: bool
    program_bytes: int | None
    reason: str  # why it was not measured, or ""


@dataclass(frozen=True)
class Cell:
    """A point under one configuration."""

    configuration: Configuration
    config: Config
    name: str
    samples: Samples | None  # None: no speed, for `reason`
    reason: str
    judged: dict[str, Any] | None  # what the judge said of its picture
    runtime: str | None  # of OpenMP, as its loops ran under; None where they ran under none

    @property
    def marked(self) -> bool:
        """Whether the time is that of a program which promises no bits."""
        return self.samples is not None and self.configuration.fast_math

    @property
    def conforms(self) -> str:
        if self.judged is None:
            return text.MISSING
        if not self.judged["conforms"]:
            return f"{DIFFERS}: {text.count(self.judged['differing_pixels'], 'pixel')}"
        return UNPROMISED if self.configuration.fast_math else CONFORMS


def launch_medians(samples: Samples) -> dict[int, float]:
    """The median of each round's launch."""
    return {int(launch): float(np.median(samples.values[samples.launches == launch])) for launch in np.unique(samples.launches)}


def over_rounds(values: list[float]) -> Estimate:
    bounds = intervals.order_interval(values)
    low, high = bounds if bounds else (None, None)
    return Estimate(float(np.median(values)), low, high, len(values), INTERVAL if bounds else "none", "" if bounds else "fewer than 6 rounds")


def time(samples: Samples) -> Estimate:
    """Milliseconds of a frame: the median over the rounds of each launch's median."""
    return over_rounds(list(launch_medians(samples).values()))


def ratio(samples: Samples, base: Samples) -> Estimate | None:
    """Time over that of the base, paired by round; None where they share none."""
    mine, other = launch_medians(samples), launch_medians(base)
    shared = [mine[round_] / other[round_] for round_ in sorted(mine.keys() & other.keys())]
    return over_rounds(shared) if shared else None


class Comparison:
    """A folder that `scripts/compilers` wrote."""

    def __init__(self, folder: Path) -> None:
        if not folder.is_dir():
            raise InputError(folder, "no such folder (expected the one that scripts/compilers wrote)")
        self.folder, self.plan_file = folder, folder / PLAN
        plan = load.parse(load.read_text(self.plan_file, "no such file (expected the folder that scripts/compilers wrote)"), self.plan_file, None)
        load.check_schema(plan, self.plan_file, None)
        self.base, self.judge = (self._text(plan, key) for key in ("base", "judge"))
        listed = plan.get("configurations")
        if not isinstance(listed, list) or not listed or not all(isinstance(entry, dict) for entry in listed):
            raise InputError(self.plan_file, "expected an array of objects", None, "configurations")
        self.studies: dict[str, Study] = {}
        self.configurations: list[Configuration] = []
        self._judged: dict[str, dict[str, dict[str, Any]]] = {}
        for entry in listed:
            self._add(entry)
        if self.base not in self.studies:
            raise InputError(self.plan_file, f"{self.base} was not measured", None, "base")

    def _text(self, source: dict[str, Any], key: str) -> str:
        if not isinstance(source.get(key), str) or not source[key]:
            raise InputError(self.plan_file, f"expected text, found {source.get(key)!r}", None, key)
        return source[key]

    def _add(self, entry: dict[str, Any]) -> None:
        name, status = self._text(entry, "name"), self._text(entry, "status")
        flags, reason = str(entry.get("flags") or ""), str(entry.get("reason") or "")
        if any(known.name == name for known in self.configurations) or Path(name).name != name:
            raise InputError(self.plan_file, f"{name!r} is a second one of this name, or no name of a folder", None, "configurations.name")
        if status != "ok":
            if not reason:
                raise InputError(self.plan_file, f"missing, status is {status!r}", None, "configurations.reason")
            self.configurations.append(Configuration(name, flags, "", False, None, f"{status}: {reason}"))
            return
        study = self.studies[name] = load.load(self.folder / name)
        program = study.context["program"]
        size = entry.get("program_bytes")
        self.configurations.append(Configuration(name, flags or str(program.get("flags") or ""), str(program.get("compiler") or "unknown"),
                                                 program.get("fast_math") is True, int(size) if is_number(size) else None, ""))
        self._judged[name] = self._verdicts(self.folder / name / "judged.json")

    def _verdicts(self, path: Path) -> dict[str, dict[str, Any]]:
        """By the name of the point."""
        value = load.parse(load.read_text(path, "no such file: nobody judged this program's pictures"), path, None)
        load.check_schema(value, path, None)
        points = value.get("points")
        if not isinstance(points, list) or not all(isinstance(p, dict) and isinstance(p.get("point"), str) for p in points):
            raise InputError(path, "expected an array of objects with a point", None, "points")
        for point in points:
            if not isinstance(point.get("conforms"), bool) or not is_number(point.get("differing_pixels")):
                raise InputError(path, f"{point['point']} has no verdict", None, "points.conforms")
        return {point["point"]: point for point in points}

    @property
    def base_study(self) -> Study:
        return self.studies[self.base]

    @cached_property
    def points(self) -> list[Record]:
        """Those of the base, in the order of the study."""
        return self.base_study.records

    @cached_property
    def cells(self) -> dict[tuple[str, str], Cell]:
        """By point and configuration."""
        return {(point.name, c.name): self._cell(point, c) for point in self.points for c in self.configurations}

    def _cell(self, point: Record, configuration: Configuration) -> Cell:
        record = None if configuration.reason else next((r for r in self.studies[configuration.name].records if r.name == point.name), None)

        def cell(samples: Samples | None, reason: str, judged: dict[str, Any] | None = None) -> Cell:
            runtime = None if record is None or samples is None else record.raw.get("runtime_observed")
            return Cell(configuration, point.config, point.name, samples, reason, judged, runtime)

        if configuration.reason:
            return cell(None, configuration.reason)
        if record is None:
            return cell(None, "missing: this program's study does not have the point")
        judged = self._judged[configuration.name].get(point.name)
        raw = record.raw
        if raw.get("status") != "ok":
            return cell(None, f"{raw.get('status')}: {raw.get('reason')}", judged)
        if judged is None:
            return cell(None, "failed: its picture was not judged")
        if configuration.fast_math:
            return cell(Samples(*(np.array(raw[key], dtype=kind) for key, kind in (("samples_ms", float), ("launches", int), ("blocks", int)))),
                        "", judged)
        if not record.ok:
            return cell(None, f"{record.status}: {record.reason}", judged)
        if not judged["conforms"]:
            return cell(None, f"failed: {judged['differing_pixels']} pixels differ from the specification of {self.judge}", judged)
        return cell(record.samples, "", judged)

    def ratio(self, cell: Cell) -> Estimate | None:
        base = self.cells[cell.name, self.base]
        if cell.samples is None or base.samples is None or cell.configuration.name == self.base:
            return None
        return ratio(cell.samples, base.samples)

    @property
    def machine(self) -> str:
        return text.machine(self.base_study.context["machine"])

    def runtimes(self, cells: Iterable[Cell]) -> str:
        """Where compilers bring OpenMP runtimes of their own, a sentence that says so; else nothing."""
        under: dict[str, list[str]] = {}
        for cell in cells:
            if cell.runtime is not None and cell.configuration.name not in under.setdefault(cell.runtime, []):
                under[cell.runtime].append(cell.configuration.name)
        if len(under) < 2:
            return ""
        said = "; ".join(f"{runtime}: {', '.join(names)}" for runtime, names in sorted(under.items()))
        return f"OpenMP's loops ran under the compiler's own runtime ({said}): between these, only serial points compare the compilers alone."

    @cached_property
    def rounds(self) -> list[int]:
        """Of each timed cell."""
        return [len(launch_medians(cell.samples)) for cell in self.cells.values() if cell.samples is not None]


def where(config: Config) -> str:
    """'serial', 'openmp dynamic, 2 threads'."""
    return "serial" if config.backend == "serial" else f"{execution(config)}, {text.count(config.threads, 'thread')}"


def table(found: Comparison) -> Table:
    numbers, words = [], []
    for point in found.points:
        config = point.config
        for configuration in found.configurations:
            cell = found.cells[point.name, configuration.name]
            spent = None if cell.samples is None else time(cell.samples)
            over = found.ratio(cell)
            judged = cell.judged or {}
            accuracy = {key: judged.get(key) for key in ("differing_pixels", "wrong", "unexplained", "end_to_end_errors", "max_depth_error_steps")}
            numbers.append({"scene": config.scene, "size": "x".join(map(str, config.size)), "kernel": config.kernel, "numeric": config.numeric,
                            "execution": execution(config), "threads": config.threads, "openmp_runtime": cell.runtime,
                            "configuration": configuration.name,
                            "compiler": configuration.compiler or None, "flags": configuration.flags or None,
                            "program_bytes": configuration.program_bytes}
                           | columns("median_ms", spent) | columns("time_over_base", over)
                           | {"rounds": None if cell.samples is None else len(launch_medians(cell.samples)),
                              "conforms": None if not judged else judged["conforms"], "fast_math": configuration.fast_math} | accuracy
                           | {"reason": cell.reason or None, "point": point.name})
            shown = "" if spent is None else " (does not conform)" if not judged.get("conforms") else " (bits not promised)" if cell.marked else ""
            words.append({"point": f"{config.kernel} {config.numeric}, {where(config)}", "configuration": configuration.name,
                          "median ms [95 %]": cell.reason if spent is None else times(spent) + shown,
                          "time / base": "is the base" if configuration.name == found.base else times(over),
                          "conforms": cell.conforms, "wrong": _count(accuracy["wrong"]), "beyond bound": _count(accuracy["unexplained"]),
                          "depth error, steps": text.number(accuracy["max_depth_error_steps"])})
    scenes = text.listing(sorted({f"{p.config.scene} {p.config.size[0]}x{p.config.size[1]}" for p in found.points}))
    note = (f"{scenes}. Base: {found.base}, paired by round; above 1 is slower. Conforms: the picture has the bits of the specification as"
            f" {found.judge} draws it. Wrong: pixels whose triangle is not the exact oracle's; beyond bound: those that the mode's bound does"
            " not explain. Depth error: the largest over right pixels, in steps of 2^-24. Programs compiled with -ffast-math promise no"
            " bits: their times are shown and marked, those of any other program that does not conform are not."
            f" {found.runtimes(found.cells.values())}").rstrip()
    return Table("compilers", "The same source under several compilers and flags", note, pd.DataFrame(numbers).convert_dtypes(), pd.DataFrame(words))


def _count(value: object) -> str:
    return str(value) if is_number(value) else text.MISSING


def plain(found: Comparison) -> str:
    """The table for a terminal, one block a point; then the configurations that were not measured."""
    words = table(found).words
    lines = []
    for point, part in words.groupby("point", sort=False):
        part = part.drop(columns="point")
        lines += [str(point), *("  " + line for line in _aligned(part)), ""]
    made = table(found)
    return "\n".join([f"Machine: {found.machine}; {text.span(found.rounds).replace('n =', 'rounds:')}", "", *lines, made.note])


def _aligned(frame: pd.DataFrame) -> list[str]:
    cells = [[name, *map(str, frame[name])] for name in frame]
    widths = [max(map(len, column)) for column in cells]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in zip(*cells)]


def write(found: Comparison) -> list[Path]:
    """FOLDER/compilers.{csv,tex,txt} and the figure, compilers_ratio.{svg,pdf,png,json} with its caption."""
    from .figures import compilers as drawing

    made = table(found)
    files: dict[str, str | bytes] = {f"{made.name}.csv": made.csv(), f"{made.name}.tex": made.tex(), f"{made.name}.txt": plain(found) + "\n"}
    with matplotlib.rc_context(style.RC):
        for drawn in drawing.draw(found):
            files |= sidecars.files(drawn, *sidecars.drawn_from(found.base_study.directory / "records.jsonl", found.folder))
            files[f"{drawn.name}.txt"] = f"{drawn.caption.plain}\n{drawn.caption.reading}\n"
    read = [found.plan_file, *(found.folder / name / file for name in found.studies for file in ("records.jsonl", "context.json", "judged.json"))]
    writing.write_folder(found.folder, files, "compilers", read)
    return [found.folder / name for name in files]
