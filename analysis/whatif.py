"""What if there were more threads? Predicts the loop under study from the costs of its iterations (costs.json).

A prediction is contention-free: each iteration costs what it cost on one thread, and no thread waits for another's memory, lock or
chunk. So it bounds the speedup of the loop's schedule from above, up to the noise of the costs; start and join are outside of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Sequence

import matplotlib
import numpy as np
import pandas as pd

from . import load, replays, scaling_laws, schedule_model, sidecars, style, text, work_stealing, writing
from .comparison import Analysis
from .load import InputError, Record, Study
from .loop_costs import LoopCosts, read
from .scaling_laws import Fit
from .schedule_model import Outcome
from .statistics import estimates
from .statistics.estimates import Estimate
from .statistics.samples import Samples
from .tables import Table

CAVEAT = "Predictions are contention-free"
THREADS = tuple(2**k for k in range(11))
ASKED = (16, 64)  # which schedule and chunk is best here
TIE = 0.01  # predictions within this share of the best are ties: the costs are not known better
CONDITIONS = ("output", "cache", "binding", "wait_policy")  # of a run: a point is compared with one thread under the same
SERIES = (*CONDITIONS, "runtime")  # points that differ in one of them are no series
FINE = 100_000  # iterations up to which every power of two is a chunk, and steals are drawn three times
SEEDS = 3


@dataclass(frozen=True)
class Rule:
    """One row: a schedule under the rule of one runtime."""

    backend: str
    schedule: str
    runtime: str  # whose rule; "" where they agree

    @property
    def name(self) -> str:
        return f"{self.backend} {self.schedule}" + (f" ({self.runtime})" if self.runtime else "")


RULES = (Rule("openmp", "static", ""), Rule("openmp", "dynamic", ""), Rule("openmp", "guided", "libgomp"),
         Rule("openmp", "guided", "libomp"), Rule("tbb", "auto", ""), Rule("tbb", "simple", ""))


@dataclass(frozen=True)
class Prediction:
    rule: Rule
    chunk: int | None  # None: n / threads
    threads: int
    outcome: Outcome
    base: float  # microseconds of the loop on one thread, without dispatch
    longest: float  # microseconds of its largest iteration
    dispatch: float
    dispatch_from: str

    @property
    def speedup(self) -> float:
        return self.base / self.outcome.time

    @property
    def efficiency(self) -> float:
        return self.speedup / self.threads

    @property
    def chunk_bound(self) -> float:
        """No speedup beyond it: one thread runs the largest chunk."""
        return self.base / self.outcome.largest

    @property
    def iteration_bound(self) -> float:
        """Nor beyond it, with any chunks: one thread runs the largest iteration."""
        return self.base / self.longest

    @property
    def name(self) -> str:
        return self.rule.name + ("" if self.chunk is None else f",{self.chunk}")


class Model:
    """The predictions for one loop, each made once."""

    def __init__(self, costs: LoopCosts, steal: float | None = None) -> None:
        """steal: microseconds of a steal; None: as it was measured, or where it was not what a chunk costs."""
        self.costs, self.steal = costs, costs.steal if steal is None else steal
        self.prefix = np.concatenate([[0.0], np.cumsum(costs.costs)])
        self._made: dict[tuple, Prediction] = {}

    def chunks(self, rule: Rule) -> list[int | None]:
        steps = range(0, 11, 1 if self.costs.n <= FINE else 2)
        powers: list[int | None] = [2**k for k in steps if 2**k < self.costs.n] or [1]
        return [None, *powers] if rule.schedule == "static" else powers

    def predict(self, rule: Rule, chunk: int | None, threads: int) -> Prediction:
        key = (rule, chunk, threads)
        if key not in self._made:
            dispatch, source = self.costs.overhead(rule.backend, rule.schedule, chunk)
            self._made[key] = Prediction(rule, chunk, threads, self._simulate(rule, chunk, threads, dispatch), self.costs.total,
                                         self.costs.largest, dispatch, source)
        return self._made[key]

    def _simulate(self, rule: Rule, chunk: int | None, threads: int, dispatch: float) -> Outcome:
        if rule.backend == "openmp":
            return schedule_model.simulate(self.prefix, rule.schedule, rule.runtime or "libgomp", threads, chunk, dispatch)
        run = work_stealing.auto if rule.schedule == "auto" else work_stealing.simple
        steal = dispatch if self.steal is None else self.steal
        drawn = [run(self.prefix, threads, chunk or 1, dispatch, steal, seed) for seed in range(SEEDS if self.costs.n <= FINE else 1)]
        return sorted(drawn, key=lambda outcome: outcome.time)[len(drawn) // 2]

    def at(self, threads: int) -> list[Prediction]:
        return [self.predict(rule, chunk, threads) for rule in RULES for chunk in self.chunks(rule)]

    def best(self, threads: int, rule: Rule | None = None) -> list[Prediction]:
        """The fastest and its ties, the fastest first; of equals, that with fewer chunks."""
        found = [p for p in self.at(threads) if rule is None or p.rule == rule]
        found.sort(key=lambda p: (p.outcome.time, p.outcome.chunks))
        return [p for p in found if p.outcome.time <= found[0].outcome.time * (1 + TIE)]


@dataclass(frozen=True)
class Measured:
    """A point of a study beside its prediction: the loop, or where older records do not tell it the raster stage that it is in."""

    record: Record
    prediction: Prediction
    time: Estimate  # milliseconds
    speedup: Estimate | None  # over the same kernel on one thread, under the same conditions
    condition: str = ""  # its further axes, where points of the study differ in them

    @property
    def name(self) -> str:
        return self.prediction.name + self.condition

    @property
    def error(self) -> float:
        """Of the predicted time, relative to the measured one."""
        return self.prediction.outcome.time / 1e3 / self.time.value - 1


@dataclass(frozen=True)
class Comparison:
    study: Study
    machine: str
    scene: str
    points: list[Measured]
    left_out: int  # timed points of this loop whose schedule has no model
    of_loop: bool  # else the raster stage is compared, of a study some of whose records do not tell the loop's part of it
    fits: dict[str, list[Fit]] = field(default_factory=dict)  # by rule and chunk


def measured(model: Model, directory: Path, scene: str | None) -> Comparison:
    """The study's points of the same loop on the same scene. Raises InputError if there are none, or if they differ in an axis that decides
    what an iteration costs."""
    study, costs = load.load(directory), model.costs
    for axis, value in costs.axes.items():
        if value is None:
            raise InputError(costs.path, "missing, as in traces of older versions: trace again to compare with a study", None, axis)
    named = [r for r in study.timed if (r.config.kernel, r.config.numeric, r.config.size) == (costs.kernel, costs.numeric, costs.size)
            and (costs.tile is None or str(r.config.tile) == str(costs.tile)) and (scene is None or r.config.scene == scene)]
    if not named:
        raise InputError(directory / "records.jsonl", f"holds no timed point of {costs.name}" + (f" and scene {scene}" if scene else ""))
    mine = [r for r in named if all(getattr(r.config, axis) == value for axis, value in costs.axes.items())]
    if not mine:
        # The axis that fewest points have as the costs do is the one to name.
        axis = min(costs.axes, key=lambda a: sum(getattr(r.config, a) == costs.axes[a] for r in named))
        found = sorted({str(getattr(r.config, axis)) for r in named})
        raise InputError(directory / "records.jsonl", f"is {text.listing(found, 4)}, {costs.path.name} has {costs.axes[axis]}: no point of {costs.name} is of"
                         " the traced loop", None, f"config.{axis}")
    scenes = sorted({r.config.scene for r in mine})
    if len(scenes) > 1:
        raise InputError(directory / "records.jsonl", f"holds {', '.join(scenes)}: name one with --scene", None, "config.scene")
    of_loop = all(r.loop is not None for r in mine)
    points, left_out = [], 0
    for record in mine:
        rule, loop = _rule(record), _loop(record, of_loop)
        if rule is None or loop is None:
            left_out += 1
            continue
        chunk = record.config.chunk if record.config.chunk is not None or rule.schedule == "static" else 1
        base = _one_thread([r for r in mine if all(getattr(r.config, axis) == getattr(record.config, axis) for axis in CONDITIONS)], of_loop)
        points.append(Measured(record, model.predict(rule, chunk, record.config.threads), estimates.median_estimate(loop),
                               None if base is None else estimates.ratio(base, loop)))
    # The runtime of a backend is its own: only where one backend has several does it tell points apart.
    varied = [axis for axis in SERIES if any(len({getattr(p.record.config, axis) for p in points if p.record.config.backend == backend}) > 1
                                             for backend in {p.record.config.backend for p in points})]
    points = [replace(p, condition="".join(f", {axis.replace('_', ' ')} {getattr(p.record.config, axis)}" for axis in varied)) for p in points]
    series: dict[str, list[Measured]] = {}
    for point in points:
        series.setdefault(point.name, []).append(point)
    fits = {name: [scaling_laws.fit(law, [p.prediction.threads for p in of], [p.time.value for p in of]) for law in scaling_laws.LAWS]
            for name, of in series.items()}
    return Comparison(study, Analysis(study).machine, scenes[0], points, left_out, of_loop, fits)


def _loop(record: Record, of_loop: bool) -> Samples | None:
    times = record.loop if of_loop else record.stages.get("raster")
    return None if times is None else Samples(times, record.samples.launches, record.samples.blocks)


def _one_thread(records: Sequence[Record], of_loop: bool) -> Samples | None:
    """The loop on one thread: serial if it was measured, else the fastest schedule there."""
    found = [(r.config.backend != "serial", float(np.median(s.values)), i, s) for i, r in enumerate(records)
             if r.config.threads == 1 and (s := _loop(r, of_loop)) is not None]
    return min(found)[3] if found else None


def _rule(record: Record) -> Rule | None:
    runtime = "libomp" if record.config.runtime == "libomp" else "libgomp"
    return next((rule for rule in RULES if (rule.backend, rule.schedule) == (record.config.backend, record.config.schedule)
                 and rule.runtime in ("", runtime)), None)


# Tables

def _bounds(p: Prediction) -> dict[str, float]:
    return {"bound_largest_chunk": p.chunk_bound, "bound_largest_iteration": p.iteration_bound, "bound_total": p.threads}


def predictions_table(model: Model) -> Table:
    numbers = [{"backend": p.rule.backend, "schedule": p.rule.schedule, "rule_of": p.rule.runtime or "both", "chunk": p.chunk,
                "threads": p.threads, "time_us": p.outcome.time, "speedup": p.speedup, "efficiency": p.efficiency, "chunks": p.outcome.chunks,
                "largest_chunk_us": p.outcome.largest, **_bounds(p), "dispatch_us": p.dispatch, "dispatch_from": p.dispatch_from}
               for threads in THREADS for p in model.at(threads)]
    words = []
    for rule in RULES:
        row: dict[str, str] = {"schedule": rule.name}
        for threads in THREADS[1:]:
            best = model.best(threads, rule)[0]
            row[str(threads)] = f"{text.number(best.speedup)}" + (f" ({best.chunk})" if best.chunk else "")
        words.append(row)
    return Table("whatif", "Predicted speedup of the loop", f"By number of threads, with the best chunk or grain (in brackets; none: n / threads). {CAVEAT}.",
                 pd.DataFrame(numbers), pd.DataFrame(words))


def answers_table(model: Model, asked: Sequence[int] = ASKED) -> Table:
    numbers, words = [], []
    for threads in asked:
        best, *ties = model.best(threads)
        numbers += [{"threads": threads, "rank": rank, "schedule": p.name, "time_us": p.outcome.time, "speedup": p.speedup,
                     "efficiency": p.efficiency, **_bounds(p)} for rank, p in enumerate((best, *ties), start=1)]
        words.append({"threads": str(threads), "best": best.name, "speedup": text.number(best.speedup),
                      "efficiency": text.percent(best.efficiency), "bound by its largest chunk": text.number(best.chunk_bound),
                      "by the largest iteration": text.number(best.iteration_bound),
                      "by the total": str(threads), f"ties within {text.percent(TIE)}": text.listing([p.name for p in ties], 6) or "none"})
    return Table("whatif_best", "Best schedule by prediction", f"{CAVEAT}: a speedup that no real machine exceeds by its schedule alone.",
                 pd.DataFrame(numbers), pd.DataFrame(words))


def measured_table(found: Comparison) -> Table:
    numbers, words = [], []
    for p in sorted(found.points, key=lambda p: (p.prediction.threads, p.name)):
        s = p.speedup
        numbers.append({"schedule": p.name, "threads": p.prediction.threads, "predicted_ms": p.prediction.outcome.time / 1e3,
                        "measured_ms": p.time.value, "measured_low": p.time.low, "measured_high": p.time.high, "error": p.error,
                        "predicted_speedup": p.prediction.speedup, "speedup": s and s.value, "speedup_low": s and s.low,
                        "speedup_high": s and s.high, "n": p.time.n})
        words.append({"threads": str(p.prediction.threads), "schedule": p.name,
                      "predicted ms": text.number(p.prediction.outcome.time / 1e3),
                      "measured ms": text.estimate(p.time.value, p.time.low, p.time.high), "error": f"{100 * p.error:+.1f} %",
                      "predicted speedup": text.number(p.prediction.speedup),
                      "measured speedup": text.MISSING if s is None else text.estimate(s.value, s.low, s.high)})
    what = "The loop" if found.of_loop else "The raster stage, which has more in it than the loop"
    return Table("whatif_measured", "Predicted and measured", f"{what}. {CAVEAT}; an error below 0:"
                 " measured longer than predicted.", pd.DataFrame(numbers), pd.DataFrame(words))


def fits_table(found: Comparison) -> Table:
    numbers, words = [], []
    for name, fits in found.fits.items():
        for fit in fits:
            said = "; ".join(f"{key} {e.value:.3g} [{e.low:.3g}, {e.high:.3g}]" for key, e in fit.estimates.items() if key != "T1")
            words.append({"schedule": name, "law": fit.law.name, "threads": ", ".join(map(str, fit.threads)), "fit": said or fit.reason})
            numbers += [{"schedule": name, "law": fit.law.name, "parameter": key, "value": e.value, "low": e.low, "high": e.high,
                         "thread_counts": len(fit.threads), "reason": ""} for key, e in fit.estimates.items()] or [
                {"schedule": name, "law": fit.law.name, "parameter": "", "value": None, "low": None, "high": None,
                 "thread_counts": len(fit.threads), "reason": fit.reason}]
    return Table("whatif_fits", "Scaling laws fitted to the measured times", "95 % intervals; where fewer thread counts were measured than a"
                 " law has parameters (one is the time on one thread) and two, it is not identifiable.", pd.DataFrame(numbers), pd.DataFrame(words))


# Text

def findings(model: Model, found: Comparison | None) -> list[str]:
    costs = model.costs
    lines = [f"{costs.name}: {costs.n} iterations ({costs.unit}s), {text.number(costs.total / 1e3)} ms in all; the largest iteration is"
             f" {text.percent(costs.largest / costs.total)} of it, so no schedule exceeds a speedup of {text.number(costs.total / costs.largest)}."]
    for threads in ASKED:
        best, *ties = model.best(threads)
        tied = f"; within {text.percent(TIE)} of it: {text.listing([p.name for p in ties], 6)}" if ties else "; no other is within" \
            f" {text.percent(TIE)} of it"
        lines.append(f"{threads} threads: {best.name}, predicted speedup {text.number(best.speedup)} (efficiency"
                     f" {text.percent(best.efficiency)}; its largest chunk alone allows {text.number(best.chunk_bound)}){tied}.")
    if found is not None and found.points:
        for threads in sorted({p.prediction.threads for p in found.points}):
            errors = [p.error for p in found.points if p.prediction.threads == threads]
            what = "loop" if found.of_loop else "raster stage (the records do not tell the loop)"
            lines.append(f"Predicted against measured {what}, {text.count(threads, 'thread')}: error {100 * np.median(errors):+.1f} %"
                         f" (median of {text.count(len(errors), 'point')}; {100 * min(errors):+.1f} % to {100 * max(errors):+.1f} %).")
        if found.left_out:
            lines.append(f"{text.count(found.left_out, 'measured point')} of schedules without a model: left out (serial, auto, affinity).")
    return [*lines, *cautions(model)]


def cautions(model: Model) -> list[str]:
    costs = model.costs
    lines = [f"{CAVEAT}: memory, locks, the cost of start and join, and contention for the next chunk are left out."]
    if costs.serial is not None:
        share = costs.total / costs.serial - 1
        lines.append(f"The costs add up to {100 * share:+.1f} % of the untraced serial loop"
                     + (": too far from it to trust them." if abs(share) > 0.1 else "."))
    unknown = [rule.name for rule in RULES if costs.overhead(rule.backend, rule.schedule, None)[1] == "not measured"]
    if unknown:
        lines.append(f"No overhead of a chunk was measured for {text.listing(unknown, 6)}: 0 stands for it.")
    dispatch = f"The overhead of a chunk was measured on {text.count(costs.threads, 'thread')}"
    if costs.threads == 1:
        lines.append(f"{dispatch}, where nobody contends for the next chunk: on more threads it costs several times that, so small chunks look better than"
                     " they are. Trace with --threads as many as there are CPUs.")
    else:
        own = ", of oneTBB on one, whose ranges are its own until they are stolen" if "steal_us" in costs.raw else ""
        lines.append(f"{dispatch}{own}; with more, more contend for OpenMP's next chunk.")
    if costs.block > 1:
        lines.append(f"Each {costs.block} consecutive iterations share one traced cost: smaller chunks look more even than they are.")
    if model.steal is None:
        lines.append("What a oneTBB thread spends on a range that it steals was not measured: that of a chunk stands for it, which is less, so small grains look"
                     " better than they are (--steal-us changes it).")
    elif model.steal == costs.steal:
        lines.append(f"A range that a oneTBB thread steals takes it {text.number(costs.steal)} us more than one of its own (--steal-us changes it).")
    return lines


def plain(table: Table) -> str:
    columns = [[name, *map(str, table.words[name])] for name in table.words]
    widths = [max(map(len, cells)) for cells in columns]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in zip(*columns))


@dataclass(frozen=True)
class Written:
    paths: list[Path]
    text: str


def write(path: Path, folder: Path, study: Path | None = None, scene: str | None = None, steal: float | None = None,
          replayed: Sequence[Path] = ()) -> Written:
    """Figures, tables and text of a what-if; nothing is written where the input is bad."""
    from .figures import whatif as drawing

    model = Model(read(path), steal)
    found = None if study is None else measured(model, study, scene)
    made = [answers_table(model), predictions_table(model)] + ([measured_table(found), fits_table(found)] if found and found.points else [])
    slept = [replays.read(file) for file in replayed]
    made += [replays.table(slept)] if slept else []
    files: dict[str, str | bytes] = {}
    with matplotlib.rc_context(style.RC):
        for drawn in (drawing.curves(model, found), drawing.heat_map(model)):
            files |= sidecars.files(drawn, *sidecars.drawn_from(path, folder))
            files[f"{drawn.name}.txt"] = f"{drawn.caption.plain}\n{drawn.caption.reading}\n"
    for table in made:
        files |= {f"{table.name}.csv": table.csv(), f"{table.name}.tex": table.tex()}
    lines = [*findings(model, found), *replays.warnings(slept)]
    said = "\n".join([*lines, "", *(f"{table.title}. {table.note}\n{plain(table)}\n" for table in made)])
    files["whatif.txt"] = said
    writing.write_folder(folder, files, "whatif", [path, *replayed, *([study / "records.jsonl"] if study else [])])
    return Written([folder / name for name in files], said)
