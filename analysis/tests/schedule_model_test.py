"""The schedule rules against sequences that the runtimes were seen to hand out, and the simulations against slow ones."""

from __future__ import annotations

import numpy as np
import pytest

from .. import schedule_model as model
from .. import work_stealing
from .loops import heavy


def sizes(schedule, runtime, n, threads, chunk):
    return np.diff(model.boundaries(schedule, runtime, n, threads, chunk)).tolist()


def prefix(costs):
    return np.concatenate([[0.0], np.cumsum(costs)])


@pytest.mark.parametrize("runtime, n, threads, chunk, seen", [
    # Observed with 1 ms of sleep an iteration, under gcc 12's libgomp and LLVM 14's libomp.
    ("libgomp", 203, 4, 5, [51, 38, 29, 22, 16, 12, 9, 7, 5, 5, 5, 4]),
    ("libgomp", 30, 4, 4, [8, 6, 4, 4, 4, 4]),
    ("libomp", 203, 4, 5, [25, 22, 19, 17, 15, 13, 11, 10, 8, 7, 7, 6, 5, 5, 5, 5, 5, 5, 5, 5, 3]),
    ("libomp", 30, 4, 4, [4, 4, 4, 4, 4, 4, 4, 2])])
def test_guided_hands_out_what_the_runtimes_do(runtime, n, threads, chunk, seen):
    assert sizes("guided", runtime, n, threads, chunk) == seen


def test_the_first_guided_chunk_differs_between_the_runtimes():
    assert sizes("guided", "libgomp", 1080, 2, 1)[0] == 540
    assert sizes("guided", "libomp", 1080, 2, 1)[0] == 270


def test_static_deals_the_remainder_to_the_first_threads():
    assert sizes("static", "libgomp", 103, 4, None) == [26, 26, 26, 25]
    assert sizes("static", "libomp", 3, 8, None) == [1, 1, 1]


@pytest.mark.parametrize("schedule", ["static", "dynamic", "guided"])
@pytest.mark.parametrize("runtime", model.RUNTIMES)
@pytest.mark.parametrize("n, threads, chunk", [(1, 1, 1), (1, 64, 1), (1000, 1, 7), (1000, 3, 1), (1000, 16, 16), (97, 1024, 2), (97, 4, 1000)])
def test_chunks_cover_the_loop_once(schedule, runtime, n, threads, chunk):
    edges = model.boundaries(schedule, runtime, n, threads, chunk)
    assert edges[0] == 0 and edges[-1] == n and np.all(np.diff(edges) > 0)


def exact_list_schedule(durations, threads):
    loads = [0.0] * threads
    for duration in durations:
        k = loads.index(min(loads))
        loads[k] += duration
    return max(loads)


@pytest.mark.parametrize("threads", [1, 2, 7, 64])
@pytest.mark.parametrize("n", [1, 6, 500, 20000])
def test_list_schedule_is_within_its_tolerance(threads, n):
    durations = heavy(n, seed=n + threads)
    assert model.list_schedule(durations, threads) == pytest.approx(exact_list_schedule(durations, threads), rel=model.TOLERANCE)


def test_static_round_robin_adds_up_each_threads_chunks():
    costs = np.array([1.0, 2, 3, 4, 5, 6, 7])
    # Thread 0: 0 1 and 4 5; thread 1: 2 3 and 6.
    assert model.simulate(prefix(costs), "static", "libgomp", 2, 2, 0.5).time == pytest.approx(max(1 + 2 + 5 + 6, 3 + 4 + 7) + 1.0)


def test_dispatch_is_paid_by_chunk():
    uniform = prefix(np.ones(64))
    assert model.simulate(uniform, "dynamic", "libgomp", 4, 4, 0.25).time == pytest.approx(4 * (4 + 0.25), rel=model.TOLERANCE)


@pytest.mark.parametrize("run", [work_stealing.simple, work_stealing.auto])
@pytest.mark.parametrize("threads", [1, 2, 16, 100])
@pytest.mark.parametrize("grain", [1, 5, 1000])
def test_stealing_runs_all_work_and_keeps_its_bounds(run, threads, grain):
    costs = heavy(700)
    outcome = run(prefix(costs), threads, grain, 0.0, 0.0, 1)
    bound = max(costs.sum() / threads, outcome.largest)
    assert outcome.time >= bound * (1 - 1e-9)
    # Greedy: a worker idles only where nothing can be stolen, so Graham's bound holds with the ranges as its jobs; auto runs the pieces
    # of its pool, of which none can be stolen unless a thief was seen, so that it may take longer.
    if run is work_stealing.simple:
        assert outcome.time <= costs.sum() / threads + outcome.largest * (1 + 1e-9)
    if threads == 1:
        assert outcome.time == pytest.approx(costs.sum())


def test_a_steal_costs_what_it_is_said_to():
    uniform = prefix(np.ones(2))
    assert work_stealing.simple(uniform, 2, 1, 0.0, 0.5, 1).time == pytest.approx(1.5)


def test_simple_partitioner_halves_to_the_grain():
    assert np.diff(work_stealing.leaves(10, 3)).tolist() == [2, 3, 2, 3]


def test_auto_partitioner_splits_less_than_simple_and_more_on_demand():
    even, skewed = prefix(np.ones(4096)), prefix(np.r_[np.full(64, 100.0), np.full(4032, 1.0)])
    few = work_stealing.auto(even, 4, 1, 0.0, 0.0, 1).chunks
    assert few < 1000  # simple_partitioner has 4096
    assert work_stealing.auto(skewed, 4, 1, 0.0, 0.0, 1).chunks > few
