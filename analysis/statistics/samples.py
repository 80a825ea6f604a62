"""Times of one point, and those of two points that share a launch and a block: a block meets the same drift, so they are pairs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Samples:
    """Times of one point in the order they were taken, each with the launch and the block it belongs to."""

    values: np.ndarray
    launches: np.ndarray
    blocks: np.ndarray

    @property
    def n(self) -> int:
        return len(self.values)

    @property
    def launch_count(self) -> int:
        return len(np.unique(self.launches))

    @cached_property  # a base is paired with every other point of its picture
    def by_block(self) -> dict[tuple[int, int], float]:
        cells: dict[tuple[int, int], list[float]] = {}
        for value, launch, block in zip(self.values.tolist(), self.launches.tolist(), self.blocks.tolist()):
            cells.setdefault((int(launch), int(block)), []).append(float(value))
        return {key: cell[0] if len(cell) == 1 else float(np.median(cell)) for key, cell in cells.items()}

    @cached_property
    def by_launch(self) -> list[np.ndarray]:
        return [self.values[self.launches == launch] for launch in np.unique(self.launches)]


def paired_by_launch(numerator: Samples, denominator: Samples) -> dict[int, np.ndarray]:
    """launch: ratios of the samples that share it and a block."""
    above, below = numerator.by_block, denominator.by_block
    launches: dict[int, list[float]] = {}
    for key in sorted(above.keys() & below.keys()):
        launches.setdefault(key[0], []).append(above[key] / below[key])
    return {launch: np.array(ratios) for launch, ratios in launches.items()}


def paired(numerator: Samples, denominator: Samples) -> list[np.ndarray]:
    """Ratios of the samples that share launch and block, one array a launch."""
    return list(paired_by_launch(numerator, denominator).values())


def paired_samples(numerator: Samples, denominator: Samples) -> Samples:
    """The paired ratios as samples of their own, so that ratios can be compared with ratios."""
    above, below = numerator.by_block, denominator.by_block
    keys = sorted(above.keys() & below.keys())
    return Samples(np.array([above[key] / below[key] for key in keys]), np.array([key[0] for key in keys], dtype=int),
                   np.array([key[1] for key in keys], dtype=int))
