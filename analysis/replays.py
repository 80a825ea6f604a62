"""Sleep replays (`rasterbench replay --json`): what a runtime took for a loop of sleeps, beside the simulation of its rule."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from . import load, schedule_model, text, work_stealing
from .load import InputError, is_thread_count, is_whole
from .statistics.numbers import is_number
from .tables import Table

CONTRADICTIONS = ("contradiction", "order_contradiction")  # of a repetition: the first iteration that is one, or null
DRAWS = 21  # simulations of a work-stealing loop, whose victims are random


@dataclass(frozen=True)
class Repetition:
    measured: float  # milliseconds
    slept: np.ndarray  # milliseconds of each iteration
    workers: np.ndarray  # who ran each
    contradicted: bool  # who ran what, or the order of the starts, is not what the rule allows


@dataclass(frozen=True)
class Replay:
    path: Path
    backend: str
    schedule: str
    chunk: int | None
    runtime: str
    threads: int
    repetitions: list[Repetition]
    can_be_contradicted: bool  # by who ran what: chunks of one iteration fit any worker

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
    def contradicted(self) -> int:
        """Repetitions that contradict the rule."""
        return sum(r.contradicted for r in self.repetitions)

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
    expect(not rest.partition(",")[1] or load.chunk_of(chunk) is not None, "execution", f"a chunk from 1 to {load.MOST_CHUNK}")
    expect(is_thread_count(value.get("threads")), "threads", f"a whole number from 1 to {load.MOST_THREADS}")
    expect(is_whole(value.get("iterations")), "iterations", "a whole number above 0")
    runs = value.get("repetitions")
    expect(isinstance(runs, list) and len(runs) > 0 and all(_is_repetition(run, value["iterations"]) for run in runs), "repetitions",
           "objects with measured_ms, contradiction (an iteration or null), and slept_ms and workers of each iteration")
    return Replay(path, backend, schedule, load.chunk_of(chunk) if chunk else None, value.get("runtime"), value["threads"],
                  [Repetition(float(r["measured_ms"]), np.array(r["slept_ms"], dtype=float), np.array(r["workers"], dtype=int),
                              any(r.get(key) is not None for key in CONTRADICTIONS)) for r in runs], value.get("can_be_contradicted") is True)


def _is_repetition(run: Any, n: int) -> bool:
    return isinstance(run, dict) and is_number(run.get("measured_ms")) and run["measured_ms"] > 0 and "contradiction" in run and all(
        run.get(key) is None or (isinstance(run[key], int) and not isinstance(run[key], bool) and 0 <= run[key] < n) for key in CONTRADICTIONS) and all(
        isinstance(run.get(key), list) and len(run[key]) == n and all(map(is_number, run[key])) for key in ("slept_ms", "workers"))


def _verdict(replay: Replay) -> str:
    if replay.contradicted:
        return f"CONTRADICTED by {replay.contradicted} of {len(replay.repetitions)}"
    if replay.backend != "openmp":
        return "random, not checked"
    return "not contradicted" if replay.can_be_contradicted else "cannot be contradicted"


def warnings(found: list[Replay]) -> list[str]:
    """A line for each replay that contradicts the rule by which it was simulated."""
    return [f"The replay of {replay.name} on {text.count(replay.threads, 'thread')} ({replay.path.name}) CONTRADICTS the rule of {replay.runtime} in"
            f" {replay.contradicted} of {text.count(len(replay.repetitions), 'repetition')}: predictions by this rule do not hold for it."
            for replay in found if replay.contradicted]


def table(found: list[Replay]) -> Table:
    numbers, words = [], []
    for replay in sorted(found, key=lambda r: (r.backend, r.schedule, r.runtime, r.threads, r.chunk or 0)):
        errors = replay.errors
        measured = float(np.median([r.measured for r in replay.repetitions]))
        numbers.append({"schedule": replay.name, "runtime": replay.runtime, "threads": replay.threads, "repetitions": len(errors),
                        "measured_ms": measured, "error": float(np.median(errors)), "least_error": min(errors), "largest_error": max(errors),
                        "contradicted": replay.contradicted, "can_be_contradicted": replay.can_be_contradicted})
        words.append({"schedule": replay.name, "runtime": replay.runtime, "threads": str(replay.threads), "measured ms": text.number(measured),
                      "error": f"{100 * np.median(errors):+.2f} %", "errors": f"{100 * min(errors):+.2f} to {100 * max(errors):+.2f} %",
                      "n": str(len(errors)), "rule": _verdict(replay)})
    return Table("whatif_replay", "Sleep replay", "The iterations as sleeps in the real runtime, against the simulation of its rule on the durations"
                 " that were slept: what is left is the error of the rule (median over the repetitions; steals are random). CONTRADICTED: that many"
                 " repetitions did not follow the rule, and their error is none of it; cannot be contradicted: only the order of the starts was checked.",
                 pd.DataFrame(numbers), pd.DataFrame(words))
