"""How OpenMP's runtimes deal a loop, and how long it then takes if threads never disturb each other.

The rules are those of the sources, and what both runtimes were seen to do (harness/replay_command.cpp replays them):

static      both give the first n mod P threads one iteration more, in one piece each (libomp's schedule(runtime) too)
static,c    pieces of c go round-robin
dynamic,c   a free thread takes the next c
guided,c    libgomp (iter.c): a free thread takes ceil(left / P), at least c
            libomp (kmp_dispatch.cpp, guided_iterative): floor(left / 2P) while at least 2 P (c + 1) are left, then c; pieces of c
            from the start where (2 c + 1) P >= n; everything at once on one thread
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heapify, heapreplace

import numpy as np

RUNTIMES = ("libgomp", "libomp")
TOLERANCE = 1e-3  # relative: where the bounds of list scheduling are closer than this, their middle is the answer
BATCH = 8192  # chunks between two looks at those bounds


@dataclass(frozen=True)
class Outcome:
    """A simulated loop: when its last thread is done, and into how many chunks of which largest cost it was cut."""

    time: float  # microseconds
    chunks: int
    largest: float  # microseconds, without dispatch


def boundaries(schedule: str, runtime: str, n: int, threads: int, chunk: int | None) -> np.ndarray:
    """First iterations of the chunks in the order in which they are handed out, and n behind them."""
    if runtime not in RUNTIMES:
        raise ValueError(f"unknown runtime {runtime!r}")
    if schedule == "static" and chunk is None:
        each, more = divmod(n, threads)
        sizes = np.full(min(threads, n), each)
        sizes[:more] += 1
        return np.concatenate([[0], np.cumsum(sizes)])
    if schedule in ("static", "dynamic"):
        return _even(0, n, chunk or 1)
    if schedule != "guided":
        raise ValueError(f"unknown schedule {schedule!r}")
    return (_guided_libgomp if runtime == "libgomp" else _guided_libomp)(n, threads, chunk or 1)


def _even(begin: int, n: int, chunk: int) -> np.ndarray:
    return np.append(np.arange(begin, n, chunk), n)


def _guided_libgomp(n: int, threads: int, chunk: int) -> np.ndarray:
    starts, begin = [], 0
    while n - begin > chunk * threads:  # below, every share is at most the chunk
        starts.append(begin)
        begin += -(-(n - begin) // threads)
    return np.concatenate([np.array(starts, dtype=np.int64), _even(begin, n, chunk)])


def _guided_libomp(n: int, threads: int, chunk: int) -> np.ndarray:
    if threads == 1:
        return np.array([0, n])
    starts, begin = [], 0
    if (2 * chunk + 1) * threads < n:
        share = 0.5 / threads  # in double, as there: the rounding is part of the rule
        while n - begin >= 2 * threads * (chunk + 1):
            starts.append(begin)
            begin += int((n - begin) * share)
    return np.concatenate([np.array(starts, dtype=np.int64), _even(begin, n, chunk)])


def list_schedule(durations: np.ndarray, threads: int) -> float:
    """When the last thread is done if each free thread takes the next chunk (list scheduling). O(chunks log threads), and less
    where Graham's bounds (Bounds on multiprocessing timing anomalies, 1969) settle it: what is left adds at most its mean per
    thread and its largest chunk. Within TOLERANCE of the exact answer.
    """
    if len(durations) <= threads:
        return float(durations.max(initial=0.0))
    loads = durations[:threads].tolist()
    heapify(loads)
    begin = threads
    largest_left = np.append(np.maximum.accumulate(durations[::-1])[::-1], 0.0)
    left = np.append(np.cumsum(durations[::-1])[::-1], 0.0)
    while begin < len(durations):
        mean = (sum(loads) + left[begin]) / threads
        low, high = max(max(loads), mean), max(max(loads), mean + largest_left[begin])
        if high - low <= TOLERANCE * low:
            return float((low + high) / 2)
        for duration in durations[begin:begin + BATCH].tolist():
            heapreplace(loads, loads[0] + duration)
        begin += BATCH
    return max(loads)


def simulate(prefix: np.ndarray, schedule: str, runtime: str, threads: int, chunk: int | None, dispatch: float) -> Outcome:
    """An OpenMP loop. prefix: 0, then the running sum of the iterations' costs; dispatch: what a chunk costs beside them; both in
    microseconds."""
    edges = boundaries(schedule, runtime, len(prefix) - 1, threads, chunk)
    costs = np.diff(prefix[edges])
    durations = costs + dispatch
    if schedule == "static":
        padded = np.zeros(-(-len(durations) // threads) * threads)
        padded[:len(durations)] = durations
        time = float(padded.reshape(-1, threads).sum(axis=0).max())
    else:
        time = list_schedule(durations, threads)
    return Outcome(time, len(durations), float(costs.max()))
