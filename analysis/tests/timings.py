"""Samples of a point for the tests of statistics."""

from __future__ import annotations

import numpy as np

from ..statistics.samples import Samples


def samples(values, launches=None, blocks=None) -> Samples:
    values = np.asarray(values, dtype=float)
    return Samples(values, np.zeros(len(values), int) if launches is None else np.asarray(launches),
                     np.arange(len(values)) if blocks is None else np.asarray(blocks))
