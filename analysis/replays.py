"""Sleep replays (`rasterbench replay --json`): what a runtime took for a loop of sleeps, beside the simulation of its rule."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from . import load, schedule_model, text, work_stealing
from .load import InputError, is_whole
from .statistics import is_number
from .tables import Table

DRAWS = 21  # simulations of a work-stealing loop, whose victims are random


@dataclass(frozen=True)
class Repetition:
    measured: float  # milliseconds
    slept: np.ndarray  # milliseconds of each iteration
    workers: np.ndarray  # who ran each


@dataclass(frozen=True)
class Replay:
    path: Path
    backend: str
    schedule: str
    chunk: int | None
    runtime: str
    threads: int
    repetitions: list[Repetition]

    @property
    def name(self) -> str:
        return f"{self.backend} {self.schedule}" + ("" if self.chunk is None else f",{self.chunk}")

    def simulated(self, repetition: Repetition) -> float:
        """Milliseconds of these sleeps under the rule of the runtime; of random steals the median."""
        prefix = np.concatenate([[0.0], np.cumsum(repetition.slept)])
        if self.backend == "openmp":
            return schedule_model.simulate(prefix, self.schedule, self.runtime, self.threads, self.chunk, 0.0).time
        run = work_stealing.auto if self.schedule == "auto" else work_stealing.simple
        return float(np.median([run(prefix, self.threads, self.chunk or 1, 0.0, 0.0, seed).time for seed in range(DRAWS)]))

    @property
    def errors(self) -> list[float]:
        """Of the simulated time, relative to the measured one, by repetition."""
        return [self.simulated(r) / r.measured - 1 for r in self.repetitions]


def read(path: Path) -> Replay:
    value = load.parse(load.read_text(path, "no such file (rasterbench replay --json writes one)"), path, None)

    def expect(condition: bool, field: str, expected: str) -> None:
        if not condition:
            raise InputError(path, f"expected {expected}" if field in value else "missing", None, field)

    execution = value.get("execution")
    expect(isinstance(execution, str) and ":" in execution, "execution", "BACKEND:SCHEDULE")
    backend, _, rest = execution.partition(":")
    schedule, _, chunk = rest.partition(",")
    expect(backend == "openmp" and schedule in ("static", "dynamic", "guided") or backend == "tbb" and schedule in ("auto", "simple"),
           "execution", "a schedule that has a model: openmp static, dynamic, guided, tbb auto, simple")
    expect(backend == "tbb" or value.get("runtime") in schedule_model.RUNTIMES, "runtime", " or ".join(schedule_model.RUNTIMES))
    for key in ("threads", "iterations"):
        expect(is_whole(value.get(key)), key, "a whole number above 0")
    runs = value.get("repetitions")
    expect(isinstance(runs, list) and len(runs) > 0 and all(_is_repetition(run, value["iterations"]) for run in runs), "repetitions",
           "objects with measured_ms, and slept_ms and workers of each iteration")
    return Replay(path, backend, schedule, int(chunk) if chunk else None, value.get("runtime"), value["threads"],
                  [Repetition(float(r["measured_ms"]), np.array(r["slept_ms"], dtype=float), np.array(r["workers"], dtype=int)) for r in runs])


def _is_repetition(run: Any, n: int) -> bool:
    return isinstance(run, dict) and is_number(run.get("measured_ms")) and run["measured_ms"] > 0 and all(
        isinstance(run.get(key), list) and len(run[key]) == n and all(map(is_number, run[key])) for key in ("slept_ms", "workers"))


def table(found: list[Replay]) -> Table:
    numbers, words = [], []
    for replay in sorted(found, key=lambda r: (r.backend, r.schedule, r.runtime, r.threads, r.chunk or 0)):
        errors = replay.errors
        measured = float(np.median([r.measured for r in replay.repetitions]))
        numbers.append({"schedule": replay.name, "runtime": replay.runtime, "threads": replay.threads, "repetitions": len(errors),
                        "measured_ms": measured, "error": float(np.median(errors)), "least_error": min(errors), "largest_error": max(errors)})
        words.append({"schedule": replay.name, "runtime": replay.runtime, "threads": str(replay.threads), "measured ms": text.number(measured),
                      "error": f"{100 * np.median(errors):+.2f} %", "errors": f"{100 * min(errors):+.2f} to {100 * max(errors):+.2f} %",
                      "n": str(len(errors))})
    return Table("whatif_replay", "Sleep replay", "The iterations as sleeps in the real runtime, against the simulation of its rule on the durations"
                 " that were slept: what is left is the error of the rule (median over the repetitions; steals are random).",
                 pd.DataFrame(numbers), pd.DataFrame(words))
