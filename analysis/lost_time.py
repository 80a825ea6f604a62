"""The lost-time identity: where the threads of a point were while they did not do the work of one.

P T(P) - T(1) = work inflation + locks + imbalance + dispatch + synchronisation + serial part + other stages + residual

T(1) is the serial backend's frame of the same kernel where the study has it, else the point's own on one thread. Of the raster stage each
sample has a time R and the busy times of its threads (between the stamps of each loop), of which the longest, the mean b, longest - b and the
time outside, o = R - longest, are taken within the sample, and so is the time w that the threads waited for locks; each term is made of medians of these over the samples (raster_loop.py). The
base's are marked 1, the point's own on one thread s, for which the base stands where the study has no such point:

  dispatch          b_s - b_1               handing out chunks, on one thread; unknown where either point is missing
  locks             w                       waiting for locks that others held, within the busy time; none on one thread
  work inflation    P b - b_s - w           the same work on P threads: caches, atomics that had to be repeated, contended hand-out
  imbalance         P (longest - b)         waiting for the longest
  serial part       (P - 1) o_1             P - 1 threads have nothing to do outside of loops
  synchronisation   P (o - o_1)             starts, joins and barriers: time outside of loops beyond that of the base
  other stages      P (T - R) - (T_1 - R_1) clear, geometry, resolve: no stamps of their own; means of the half of the samples whose frames
                                            are nearest to the median, since the medians of stages need not add up to that of frames

The residual is measured frame time that none of them holds: what the medians of several quantities leave (they come from different
samples), time between the stages, what differs between the mean frame of a sample and its last one, which alone is stamped, and busy times
that exceed their stage, which no time outside can be below 0 for. It cannot show busy times that are wrong within their stage: time that
the stamps miss is time outside, so what work or imbalance lacks then, synchronisation has too much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from . import raster_loop, text
from .comparison import Analysis, Group
from .load import STAGES, Record
from .raster_loop import RasterLoop
from .tables import Table

SECTION = "Lost time"
TERMS = {"inflation": "work inflation", "locks": "waiting for locks", "imbalance": "imbalance", "dispatch": "dispatch", "synchronisation": "synchronisation",
         "serial": "serial part", "others": "other stages", "residual": "residual"}
RESIDUAL = "The residual is what medians leave, and frame time outside of stages; busy times that are wrong within their stage do not show in it:" \
           " what they miss is called synchronisation."
SPLIT = ("isa", "tile", "generality", "techniques", "cache")  # axes that a serial point shares with one that it splits


@dataclass(frozen=True)
class LostTime:
    """One point; milliseconds of thread time, medians. dispatch is None where no two points tell it from the work, locks where the record
    is older than their being counted."""

    record: Record
    base: Record  # T(1)
    total: float  # P T(P)
    useful: float  # T(1)
    terms: dict[str, float | None]
    per_sample: bool  # else imbalance is that of the threads' medians, of an older record
    failed_exchanges: float | None  # a frame, of all threads; None: as locks

    @property
    def lost(self) -> float:
        return self.total - self.useful

    @property
    def over_serial(self) -> bool:
        return self.base.config.backend == "serial"


def other_stages(record: Record) -> float:
    """Milliseconds of the stages beside raster, in the half of the samples whose times are nearest to the median."""
    times = record.samples.values
    middle = np.argsort(np.abs(times - np.median(times)), kind="stable")[:(len(times) + 1) // 2]
    return sum(float(np.mean(record.stages[name][middle])) for name in STAGES if name != "raster" and name in record.stages)


def serial_of(group: Group, record: Record) -> Record | None:
    config = record.config
    return next((r for r in group.timed if r.config.backend == "serial" and r.config.kernel == config.kernel and _loop(r)
                 and all(getattr(r.config, axis) == getattr(config, axis) for axis in SPLIT)), None)


def _loop(record: Record) -> RasterLoop | None:
    """None also where there is no raster stage to set the busy times against."""
    loop = raster_loop.of(record)
    return None if loop is None or loop.outside is None or "raster" not in record.stages else loop


def lost_time(analysis: Analysis, group: Group, record: Record) -> LostTime | None:
    """None where the point has one thread, no stamps, or neither a serial point nor one of its own on one thread."""
    serial, itself = serial_of(group, record), analysis.thread_base[record.id]
    base, alone = serial or itself, itself or serial
    if record.config.threads == 1 or base is None or alone is None:
        return None
    own, of_alone, of_base = (_loop(r) for r in (record, alone, base))
    if own is None or of_alone is None or of_base is None:
        return None
    threads = record.config.threads
    medians = {r.id: float(np.median(r.samples.values)) for r in (record, base)}
    terms: dict[str, float | None] = {
        "inflation": threads * own.mean - of_alone.mean - (own.lock_wait or 0.0),
        "locks": own.lock_wait,
        "imbalance": threads * own.imbalance,
        "dispatch": of_alone.mean - of_base.mean if base is not alone else None,
        "synchronisation": threads * (own.outside - of_base.outside),
        "serial": (threads - 1) * of_base.outside,
        "others": threads * other_stages(record) - other_stages(base)}
    total, useful = threads * medians[record.id], medians[base.id]
    terms["residual"] = total - useful - sum(term for term in terms.values() if term is not None)
    return LostTime(record, base, total, useful, terms, own.per_sample, own.failed_exchanges)


def lost_times(analysis: Analysis, group: Group) -> list[LostTime]:
    return [found for record in group.timed if (found := lost_time(analysis, group, record)) is not None]


def tables(analysis: Analysis) -> list[Table]:
    numbers, words, older = [], [], 0
    for group in analysis.groups:
        for one in lost_times(analysis, group):
            older += not one.per_sample
            head = {"scene": group.title, "kernel": one.record.config.kernel, "execution": analysis.execution(one.record),
                    "threads": one.record.config.threads}
            of = {"P T(P)": one.total, "T(1)": one.useful, "lost": one.lost} | {TERMS[name]: term for name, term in one.terms.items()}
            numbers.append(head | {"total_ms": one.total, "base_ms": one.useful, "lost_ms": one.lost}
                           | {f"{name}_ms": term for name, term in one.terms.items()} | {"failed_exchanges": one.failed_exchanges, "base": one.base.name, "per_sample": one.per_sample})
            words.append(head | {name: text.number(value) for name, value in of.items()}
                         | {"failed exchanges": text.MISSING if one.failed_exchanges is None else f"{one.failed_exchanges:.0f}", "base": "serial" if one.over_serial else "itself, 1 thread"})
    if not numbers:
        return []
    split = "" if all(one["dispatch_ms"] is not None for one in numbers) else \
        " Where the study has not both a serial point of the kernel and the point itself on one thread, dispatch cannot be told from the work:" \
        " it is missing and lies in work inflation, or in T(1) too."
    return [Table("lost_time", "Lost time of each point",
                  "Milliseconds of thread time: P T(P) - T(1) and the terms that add up to it, of medians; analysis/lost_time.py has their"
                  " formulas. Waiting for locks is measured where a thread finds one taken; failed exchanges are compare-exchanges of a frame"
                  " that found another thread's key, whose repetition is work inflation, as is contended hand-out; a negative term is time"
                  f" that several threads save. {RESIDUAL} Medians have no interval here: a term below the noise of the samples is none.{split}"
                  f"{older_remark(older)}{uncounted_remark(sum(one['locks_ms'] is None for one in numbers))}",
                  pd.DataFrame(numbers), pd.DataFrame(words), section=SECTION, folded=len(words) > 16)]


def older_remark(count: int) -> str:
    return f" Of {text.count(count, 'point')} imbalance is {raster_loop.REMARK}." if count else ""


def uncounted_remark(count: int) -> str:
    return f" Of {text.count(count, 'point')} waiting for locks is not known, in records of an older version: it lies in work inflation." if count else ""


def worst_residual(found: list[LostTime]) -> float:
    """The largest |residual| as a share of P T(P)."""
    return max((abs(one.terms["residual"] or 0.0) / one.total for one in found), default=0.0)

