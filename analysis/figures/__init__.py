"""One module a figure. Each yields the figures that its data allow, and none where there are no data."""

from __future__ import annotations

from typing import Iterator

from ..comparison import Analysis
from . import (balance, hypotheses, imbalance, ladder, lost_time, numerics, pareto, scaling, scenes, schedules, stage_efficiency, stages, strategy_map, times,
               weak, work)
from .common import Drawing

MODULES = (hypotheses, scenes, pareto, strategy_map, work, times, ladder, numerics, scaling, weak, schedules, stages, stage_efficiency, lost_time, balance, imbalance)


def draw(analysis: Analysis) -> Iterator[Drawing]:
    """The figures of the report in its order, drawn one at a time so that only one is held in memory."""
    for module in MODULES:
        yield from module.draw(analysis)
