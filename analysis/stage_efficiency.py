"""The parallel efficiency of each stage of a frame: T(1) / (N T(N)), of the samples of the stage alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from .comparison import Analysis, Group, execution
from .load import STAGES, Record
from .statistics import estimates
from .statistics.estimates import Estimate
from .statistics.samples import Samples
from .tables import Table, columns, times

SECTION = "Stages of a frame"
TOTAL = "frame"


@dataclass(frozen=True)
class Efficiency:
    """One point on several threads against its base; a stage is absent where either point has none."""

    record: Record
    base: Record
    stages: dict[str, Estimate]  # and TOTAL

    @property
    def over_serial(self) -> bool:
        return self.base.config.backend != self.record.config.backend


def base_of(analysis: Analysis, record: Record) -> Record | None:
    """The same kernel, backend and schedule on one thread; else the same kernel in the serial backend."""
    own = analysis.thread_base[record.id]
    if own is not None:
        return own
    config = record.config
    return next((r for r in analysis.group_of(record).timed if r.config.backend == "serial" and r.config.kernel == config.kernel
                 and (r.config.isa, r.config.tile, r.config.generality) == (config.isa, config.tile, config.generality)), None)


def stage_samples(record: Record, stage: str) -> Samples | None:
    """A stage's times with the launches and blocks of the frames; None if it is absent, or too short for the clock somewhere."""
    if stage == TOTAL:
        return record.samples
    values = record.stages.get(stage)
    if values is None or np.any(values <= 0):
        return None
    return Samples(values, record.samples.launches, record.samples.blocks)


def efficiencies(analysis: Analysis, group: Group) -> list[Efficiency]:
    """Of every point on several threads that has a base."""
    return analysis.once(_efficiencies, group)


def _efficiencies(analysis: Analysis, group: Group) -> list[Efficiency]:
    found = []
    for record in group.timed:
        if record.config.threads == 1 or not record.stages or (base := base_of(analysis, record)) is None or not base.stages:
            continue
        stages = {}
        for stage in (*STAGES, TOTAL):
            above, below = stage_samples(base, stage), stage_samples(record, stage)
            if above is not None and below is not None:
                stages[stage] = estimates.efficiency(estimates.ratio(above, below), record.config.threads)
        found.append(Efficiency(record, base, stages))
    return found


def tables(analysis: Analysis) -> list[Table]:
    numbers, words = [], []
    for group in analysis.groups:
        for one in efficiencies(analysis, group):
            config = one.record.config
            base = f"{execution(one.base.config)}, 1 thread" if one.over_serial else "itself, 1 thread"
            head = {"scene": group.title, "kernel": config.kernel, "execution": analysis.execution(one.record),
                    "threads": config.threads}
            row, said = dict(head), dict(head)
            for stage in (*STAGES, TOTAL):
                row |= _milliseconds(one, stage) | columns(f"{stage}_efficiency", one.stages.get(stage))
                said[stage] = times(one.stages.get(stage)) if stage in one.stages else _absent(one, stage)
            numbers.append(row | {"base": one.base.name, "base_is": "serial" if one.over_serial else "one thread"})
            words.append(said | {"base": base})
    if not numbers:
        return []
    return [Table("stage_efficiency", "Parallel efficiency of each stage",
                  "T(1) / (N T(N)) of the times of a stage: medians of ratios paired by block, with 95 % intervals; 1 is ideal, 1/N is no"
                  " gain. A stage that a kernel does not have, or does within another, is said to be none.",
                  pd.DataFrame(numbers), pd.DataFrame(words), section=SECTION, folded=len(words) > 16)]


def _milliseconds(one: Efficiency, stage: str) -> dict[str, float | None]:
    of = {f"{stage}_ms_1": stage_samples(one.base, stage), f"{stage}_ms_n": stage_samples(one.record, stage)}
    return {name: None if samples is None else float(np.median(samples.values)) for name, samples in of.items()}


def _absent(one: Efficiency, stage: str) -> str:
    none = [r for r in (one.base, one.record) if stage not in r.stages]
    return "none" if none else "below the clock"
