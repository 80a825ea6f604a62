"""How oneTBB deals a loop: parallel_for over a blocked_range, by simple_partitioner or auto_partitioner.

The splitting is that of oneapi/tbb/partitioner.h (2021.8). Thieves take the oldest task of a victim that is drawn among those
that have one; a steal costs `steal` microseconds, and nothing else is lost to contention.
"""

from __future__ import annotations

import random
from bisect import bisect_right
from collections import deque
from heapq import heappop, heappush
from typing import Iterator

import numpy as np

from .schedule_model import Outcome

INITIAL_CHUNKS = 2  # the constants of partitioner.h
RANGE_POOL = 8
INITIAL_DEPTH = 5


def leaves(n: int, grain: int) -> np.ndarray:
    """Boundaries of the ranges of simple_partitioner: halves, until none is longer than the grain."""
    edges = np.array([0, n])
    while True:
        sizes = np.diff(edges)
        long = sizes > grain
        if not long.any():
            return edges
        edges = np.sort(np.concatenate([edges, edges[:-1][long] + sizes[long] // 2]))


class _Owner:
    """A worker that goes through a range from its front, with the halves that it has not yet begun in its deque."""

    __slots__ = ("start", "origin", "begin", "end", "version")

    def __init__(self) -> None:
        self.start, self.origin, self.begin, self.end, self.version = 0.0, 0.0, 0, 0, 0


def simple(prefix: np.ndarray, threads: int, grain: int, dispatch: float, steal: float, seed: int) -> Outcome:
    """simple_partitioner. Every range ends up as the same leaves whoever runs them, so a worker's time is a difference of running
    sums, and only steals are events: O(steals log n)."""
    n = len(prefix) - 1
    edges = leaves(n, grain)
    costs = np.diff(prefix[edges])
    sums = np.concatenate([[0.0], np.cumsum(costs + dispatch)])
    time_at, first = sums.tolist(), edges.tolist()
    draw = random.Random(seed)
    workers = [_Owner() for _ in range(threads)]
    victims: list[int] = []  # workers that may have a half to steal
    listed = [False] * threads

    def begin(worker: int, low: int, high: int, at: float) -> None:
        w = workers[worker]
        w.start, w.begin, w.end = at, low, high
        w.origin = time_at[bisect_right(first, low) - 1]
        w.version += 1
        if not listed[worker]:
            listed[worker] = True
            victims.append(worker)
        expect(worker)

    def expect(worker: int) -> None:
        w = workers[worker]
        heappush(events, (w.start + time_at[bisect_right(first, w.end) - 1] - w.origin, worker, w.version))

    def stolen(worker: int, at: float) -> tuple[int, int] | None:
        """Cuts off the oldest half that the worker has not begun at that time; None if there is none."""
        w = workers[worker]
        here = first[bisect_right(time_at, w.origin + max(0.0, at - w.start)) - 1]
        while w.end - w.begin > grain:
            middle = w.begin + (w.end - w.begin) // 2
            if here < middle:
                taken = (middle, w.end)
                w.end = middle
                return taken
            w.begin = middle
        return None

    events: list[tuple[float, int, int]] = []
    begin(0, 0, n, 0.0)
    for worker in range(1, threads):
        heappush(events, (0.0, worker, 0))
    finish = 0.0
    while events:
        at, worker, version = heappop(events)
        if version != workers[worker].version:
            continue  # what it was expected to run was stolen since
        finish = max(finish, at) if version else finish
        while victims:
            k = draw.randrange(len(victims))
            victim = victims[k]
            taken = stolen(victim, at) if victim != worker else None
            if taken:
                workers[victim].version += 1
                expect(victim)
                begin(worker, *taken, max(at, workers[victim].start) + steal)
                break
            listed[victim] = False
            victims[k] = victims[-1]
            victims.pop()
    return Outcome(finish, len(costs), float(costs.max()))


class _Node:
    """Of the tree of tasks: two children run under it."""

    __slots__ = ("parent", "running", "child_stolen")

    def __init__(self, parent: _Node | None) -> None:
        self.parent, self.running, self.child_stolen = parent, 2, False


class _Task:
    __slots__ = ("low", "high", "depth", "divisor", "parent")

    def __init__(self, low: int, high: int, depth: int, divisor: int, parent: _Node | None) -> None:
        self.low, self.high, self.depth, self.divisor, self.parent = low, high, depth, divisor, parent


def _run(task: _Task, stolen: bool, grain: int, spawned: deque) -> Iterator[tuple[int, int]]:
    """start_for::execute under auto_partitioner: yields the ranges that it runs; appends the tasks that it spawns."""
    if task.divisor == 0:
        task.divisor = 1
        if stolen and task.parent is not None and task.parent.running >= 2:
            task.parent.child_stolen = True
            task.depth = max(task.depth, 1) + 1

    def offer(low: int, high: int, depth: int) -> None:
        task.divisor //= 2
        task.parent = _Node(task.parent)
        spawned.append(_Task(low, high, depth, task.divisor, task.parent))

    while task.high - task.low > grain:
        if task.divisor <= 1:
            if task.divisor == 0 or task.depth == 0:
                break
            task.depth -= 1
            task.divisor = 0
        middle = task.low + (task.high - task.low) // 2
        offer(middle, task.high, task.depth)
        task.high = middle
    if task.high - task.low <= grain or task.depth == 0:
        yield task.low, task.high
    else:
        pool: deque[tuple[int, int, int]] = deque([(task.low, task.high, 0)])  # front: the largest, at the far end
        while pool:
            while len(pool) < RANGE_POOL and _divisible(pool[-1], grain, task.depth):
                low, high, depth = pool.pop()
                middle = low + (high - low) // 2
                pool += [(middle, high, depth + 1), (low, middle, depth + 1)]
            if task.parent is not None and task.parent.child_stolen:
                task.depth += 1
                if len(pool) > 1:
                    low, high, depth = pool.popleft()
                    offer(low, high, task.depth - depth)
                    continue
                if _divisible(pool[-1], grain, task.depth):
                    continue
            low, high, _ = pool.pop()
            yield low, high
    node = task.parent
    while node is not None:
        node.running -= 1
        if node.running:
            break
        node = node.parent


def _divisible(part: tuple[int, int, int], grain: int, depth: int) -> bool:
    return part[2] < depth and part[1] - part[0] > grain


def auto(prefix: np.ndarray, threads: int, grain: int, dispatch: float, steal: float, seed: int) -> Outcome:
    """auto_partitioner: about four tasks a thread, each in pieces of a sixteenth, and more where a thief shows demand."""
    draw = random.Random(seed)
    time_at = prefix.tolist()
    tasks: list[deque[_Task]] = [deque() for _ in range(threads)]
    running: list[Iterator[tuple[int, int]] | None] = [None] * threads
    running[0] = _run(_Task(0, len(time_at) - 1, INITIAL_DEPTH, INITIAL_CHUNKS * threads, None), False, grain, tasks[0])
    idle = list(range(1, threads))
    filled: list[int] = []  # workers whose deque may hold a task
    events: list[tuple[float, int]] = [(0.0, 0)]
    chunks, largest, finish = 0, 0.0, 0.0

    def victim() -> int | None:
        while filled:
            k = draw.randrange(len(filled))
            if tasks[filled[k]]:
                return filled[k]
            listed[filled[k]] = False
            filled[k] = filled[-1]
            filled.pop()
        return None

    listed = [False] * threads
    while events:
        at, worker = heappop(events)
        while True:
            piece = next(running[worker], None)
            if tasks[worker] and not listed[worker]:
                listed[worker] = True
                filled.append(worker)
            if piece is not None:
                cost = time_at[piece[1]] - time_at[piece[0]]
                chunks, largest = chunks + 1, max(largest, cost)
                heappush(events, (at + cost + dispatch, worker))
                break
            finish = max(finish, at)
            if not tasks[worker]:
                idle.append(worker)
                break
            running[worker] = _run(tasks[worker].pop(), False, grain, tasks[worker])
        while idle and (source := victim()) is not None:
            k = draw.randrange(len(idle))
            idle[k], idle[-1] = idle[-1], idle[k]
            thief = idle.pop()
            running[thief] = _run(tasks[source].popleft(), True, grain, tasks[thief])
            heappush(events, (at + steal, thief))
    return Outcome(finish, chunks, largest)
