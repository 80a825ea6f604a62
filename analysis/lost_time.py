"""The lost-time identity: where the threads of a point were while they did not do the work of one.

P T(P) - T(1) = work inflation + imbalance + dispatch + synchronisation + serial part + other stages + residual

T(1) is the serial backend's frame of the same kernel where the study has it, else the point's own on one thread. Of the raster stage,
with its time R and busy times b (between the stamps of each loop; the base's with 1, the point's on one thread with s):

  dispatch          b_s - b_1                       handing out chunks, on one thread; unknown without a serial point
  work inflation    sum b - b_s                     the same work on P threads: caches, locks, atomics, contended hand-out
  imbalance         P max b - sum b                 waiting for the longest
  serial part       (P - 1) (R_1 - b_1)             P - 1 threads have nothing to do outside of loops
  synchronisation   P (R - max b) - P (R_1 - b_1)   starts and barriers: what lies outside of loops, beyond the serial part
  other stages      P (T - R) - (T_1 - R_1)         clear, geometry, resolve: no stamps of their own

Without the medians that they are made of, these would close exactly; the residual is what the medians leave, and what lies between stages.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from . import text
from .comparison import Analysis, Group
from .load import STAGES, Record
from .statistics import is_number
from .tables import Table

SECTION = "Lost time"
TERMS = {"inflation": "work inflation", "imbalance": "imbalance", "dispatch": "dispatch", "synchronisation": "synchronisation",
         "serial": "serial part", "others": "other stages", "residual": "residual"}
SPLIT = ("isa", "tile", "generality", "techniques", "cache")  # axes that a serial point shares with one that it splits


@dataclass(frozen=True)
class LostTime:
    """One point; milliseconds of thread time, medians. dispatch is None where no serial point tells it from the work."""

    record: Record
    base: Record  # T(1)
    total: float  # P T(P)
    useful: float  # T(1)
    terms: dict[str, float | None]

    @property
    def lost(self) -> float:
        return self.total - self.useful

    @property
    def over_serial(self) -> bool:
        return self.base.config.backend == "serial"


def busy(record: Record) -> list[float]:
    """Busy milliseconds of each thread of the raster stage; empty where they were not recorded."""
    times = [entry.get("busy_ms") for entry in record.per_thread]
    known = len(times) == record.config.threads and all(is_number(t) and t >= 0 for t in times) and sum(times) > 0
    return [float(t) for t in times] if known else []


def stage(record: Record, name: str) -> float:
    values = record.stages.get(name)
    return 0.0 if values is None else float(np.median(values))


def serial_of(group: Group, record: Record) -> Record | None:
    config = record.config
    return next((r for r in group.timed if r.config.backend == "serial" and r.config.kernel == config.kernel and busy(r) and "raster" in r.stages
                 and all(getattr(r.config, axis) == getattr(config, axis) for axis in SPLIT)), None)


def lost_time(analysis: Analysis, group: Group, record: Record) -> LostTime | None:
    """None where the point has one thread, no stamps, or no point on one thread."""
    alone = analysis.thread_base[record.id]
    if record.config.threads == 1 or alone is None or not all(busy(r) and "raster" in r.stages for r in (record, alone)):
        return None
    serial = serial_of(group, record)
    base = serial or alone
    threads, own = record.config.threads, busy(record)
    medians = {r.id: float(np.median(r.samples.values)) for r in (record, base)}
    longest, outside = max(own), stage(base, "raster") - busy(base)[0]
    terms: dict[str, float | None] = {
        "inflation": sum(own) - busy(alone)[0],
        "imbalance": threads * longest - sum(own),
        "dispatch": busy(alone)[0] - busy(serial)[0] if serial else None,
        "synchronisation": threads * (stage(record, "raster") - longest - outside),
        "serial": (threads - 1) * outside,
        "others": sum(threads * stage(record, name) - stage(base, name) for name in STAGES if name != "raster")}
    total, useful = threads * medians[record.id], medians[base.id]
    terms["residual"] = total - useful - sum(term for term in terms.values() if term is not None)
    return LostTime(record, base, total, useful, terms)


def lost_times(analysis: Analysis, group: Group) -> list[LostTime]:
    return [found for record in group.timed if (found := lost_time(analysis, group, record)) is not None]


def tables(analysis: Analysis) -> list[Table]:
    numbers, words = [], []
    for group in analysis.groups:
        for one in lost_times(analysis, group):
            head = {"scene": group.title, "kernel": one.record.config.kernel, "execution": analysis.execution(one.record),
                    "threads": one.record.config.threads}
            of = {"P T(P)": one.total, "T(1)": one.useful, "lost": one.lost} | {TERMS[name]: term for name, term in one.terms.items()}
            numbers.append(head | {"total_ms": one.total, "base_ms": one.useful, "lost_ms": one.lost}
                           | {f"{name}_ms": term for name, term in one.terms.items()} | {"base": one.base.name})
            words.append(head | {name: text.number(value) for name, value in of.items()}
                         | {"base": "serial" if one.over_serial else "itself, 1 thread"})
    if not numbers:
        return []
    split = "" if all(one["base"] == "serial" for one in words) else \
        " Where the study has no serial point of the kernel, dispatch cannot be told from the work: it is missing and lies in both."
    return [Table("lost_time", "Lost time of each point",
                  "Milliseconds of thread time: P T(P) - T(1) and the terms that add up to it, of medians; analysis/lost_time.py has their"
                  " formulas. Work inflation holds waiting for locks and atomics, and contended hand-out; a negative term is time that"
                  f" several threads save. Medians have no interval here: a term below the noise of the samples is none.{split}",
                  pd.DataFrame(numbers), pd.DataFrame(words), section=SECTION, folded=len(words) > 16)]


def worst_residual(found: list[LostTime]) -> float:
    """The largest |residual| as a share of P T(P)."""
    return max((abs(one.terms["residual"] or 0.0) / one.total for one in found), default=0.0)

