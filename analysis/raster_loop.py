"""How the raster stage of a point was shared among its threads: busy times, and what lies outside of them. All in milliseconds.

The longest and the mean busy time are those of each sample (record key raster_loop), and then medians: where another thread is the
longest in every frame, the medians of the threads are even and the frames are not. Records of older versions have the medians of the
threads alone; what is made of these is too even, and says so (per_sample).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .load import HELD_UP_KEYS, LOOP_KEYS, Record
from .statistics.numbers import is_number

REMARK = "of the threads' medians, in records of an older version: too even where the longest thread changes from frame to frame"


@dataclass(frozen=True)
class RasterLoop:
    mean: float  # busy time, over the threads
    longest: float
    imbalance: float  # longest - mean
    outside: float | None  # stage - longest; None where an older record has no raster stage
    per_sample: bool
    lock_wait: float | None = None  # thread time, over the threads; in it they waited for locks; None: an older record did not count it
    contended_locks: float | None = None
    failed_exchanges: float | None = None

    @property
    def ratio(self) -> float:
        """Longest / mean: 1 is even, the number of threads is one thread doing all."""
        return self.longest / self.mean


def busy(record: Record) -> list[float]:
    """Median busy time of each thread of the raster stage; empty where they were not recorded."""
    times = [entry.get("busy_ms") for entry in record.per_thread]
    known = len(times) == record.config.threads and all(is_number(t) and t >= 0 for t in times) and sum(times) > 0
    return [float(t) for t in times] if known else []


def of(record: Record) -> RasterLoop | None:
    """None where nothing was stamped."""
    times = busy(record)
    if not times:
        return None
    said = record.raw.get("raster_loop")
    if said is None:
        mean, longest = min(max(times), sum(times) / len(times)), max(times)  # no mean is above, but for rounding
        raster = record.stages.get("raster")
        return RasterLoop(mean, longest, longest - mean, None if raster is None else float(np.median(raster)) - longest, False)
    if said["busy_mean_ms"] <= 0:
        return None
    held_up = (None if said.get(key) is None else float(said[key]) for key in HELD_UP_KEYS)
    return RasterLoop(*(float(said[key]) for key in LOOP_KEYS), True, *held_up)
