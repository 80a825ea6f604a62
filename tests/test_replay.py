"""rasterbench replay: sleeps in the real runtimes against the schedule rules of analysis/, at 16 and 64 threads.

What is compared does not depend on how late a sleep ends: who ran which iteration, and the time that the rule gives for the durations
that were really slept.
"""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from analysis import replays, schedule_model
from analysis.tests import loops

from .program import refused, run

LIBOMP = next((str(p) for p in (Path("/usr/lib/x86_64-linux-gnu/libomp.so.5"), *Path("/usr/lib").glob("llvm-*/lib/libomp.so.5")) if p.exists()), None)
TOLERANCE = 0.05  # of a time; another rule's is off by more (test_the_rule_of_the_other_runtime_is_contradicted)
SCHEDULES = ("static", "static,4", "dynamic,1", "dynamic,5", "guided", "guided,3")
COSTS = loops.heavy(211)


def replay(folder: Path, schedule: str, threads: int, runtime: str = "libgomp", backend: str = "openmp", repetitions: int = 1, costs=COSTS) -> Path:
    variables = {"LD_PRELOAD": LIBOMP} if runtime == "libomp" else {}
    done = run("replay", loops.write(folder / "costs.json", costs), "--backend", backend, "--schedule", schedule, "--threads", threads,
               "--seconds", 0.2, "--repetitions", repetitions, "--json", **variables).ok()
    path = folder / f"{backend}_{schedule}_{runtime}_{threads}.json"
    path.write_text(done.stdout)
    if json.loads(done.stdout)["runtime"] not in (runtime, backend):
        pytest.skip(f"the program runs under {json.loads(done.stdout)['runtime']}")
    return path


def contradicts(found: replays.Replay, runtime: str) -> bool:
    """Whether some chunk of the rule was run by two workers, or in a static schedule by another than its own."""
    for repetition in found.repetitions:
        edges = schedule_model.boundaries(found.schedule, runtime, len(repetition.workers), found.threads, found.chunk)
        for k, (first, last) in enumerate(zip(edges, edges[1:])):
            worker = k % found.threads if found.schedule == "static" else repetition.workers[first]
            if np.any(repetition.workers[first:last] != worker):
                return True
    return False


def best_error(found: replays.Replay) -> float:
    return min(abs(error) for error in found.errors)


@pytest.mark.parametrize("runtime", schedule_model.RUNTIMES)
@pytest.mark.parametrize("schedule, threads", product(SCHEDULES, (16, 64)))
def test_runtimes_deal_by_their_rules(tmp_path, runtime, schedule, threads):
    if runtime == "libomp" and LIBOMP is None:
        pytest.skip("libomp is not installed")
    path = replay(tmp_path, schedule, threads, runtime, repetitions=3)
    found = replays.read(path)
    assert not contradicts(found, runtime) and found.contradicted == 0
    largest = np.diff(schedule_model.boundaries(found.schedule, runtime, len(COSTS), threads, found.chunk)).max()
    assert found.can_be_contradicted == (found.schedule == "static" or largest > 1)
    # A thread that other load stops between two sleeps is late by no sleep: of three runs the best is judged.
    assert best_error(found) < TOLERANCE
    # Every iteration is slept, and threads really share the loop.
    for repetition in found.repetitions:
        assert np.all(repetition.slept >= 0.2 * (1 - 1e-6)) and len(set(repetition.workers.tolist())) > 1
    # The simulation of the program is another implementation of the same rules.
    result = json.loads(path.read_text())
    sleeps = np.maximum(0.2, np.round(COSTS, 3) * 1e-3 * result["scale"])
    other = schedule_model.simulate(np.concatenate([[0.0], np.cumsum(sleeps)]), found.schedule, runtime, threads, found.chunk, 0.0)
    assert result["simulated_ms"] == pytest.approx(other.time, rel=schedule_model.TOLERANCE)
    assert result["chunks"] == other.chunks and result["repetitions"][0]["contradiction"] is None


def test_the_rule_of_the_other_runtime_is_contradicted(tmp_path):
    """Else the tests above could not fail."""
    found = replays.read(replay(tmp_path, "guided", 16, repetitions=3))
    assert not contradicts(found, "libgomp") and contradicts(found, "libomp")


@pytest.mark.parametrize("schedule", ["simple", "auto"])
@pytest.mark.parametrize("threads", [16, 64])
def test_work_stealing_is_near_its_simulation(tmp_path, schedule, threads):
    """Steals are random, and a thief may be asleep: the median of many simulations, and a wide tolerance."""
    if not {b["name"]: b["available"] for b in json.loads(run("list", "backends", "--json").ok().stdout)}.get("tbb"):
        pytest.skip("this build has no tbb")
    found = replays.read(replay(tmp_path, schedule, threads, backend="tbb", repetitions=5, costs=loops.heavy(1000)))
    assert best_error(found) < 0.3


def test_text_says_measured_and_simulated(tmp_path):
    said = run("replay", loops.write(tmp_path / "costs.json", COSTS), "--schedule", "dynamic", "--chunk", 2, "--threads", 16, "--seconds", 0.1).ok()
    assert "openmp:dynamic,2 on 16 threads" in said.stdout and "measured " in said.stdout and "simulated " in said.stdout


def test_fewer_threads_than_asked_for_are_an_error(tmp_path):
    done = run("replay", loops.write(tmp_path / "costs.json", COSTS), "--threads", 8, "--seconds", 0.1, OMP_THREAD_LIMIT="4")
    assert done.code != 0 and done.stdout == "" and done.stderr.count("\n") == 1 and "4 of 8 threads ran" in done.stderr


def test_what_cannot_be_contradicted_is_said(tmp_path):
    said = run("replay", loops.write(tmp_path / "costs.json", COSTS), "--schedule", "dynamic,1", "--threads", 4, "--seconds", 0.1).ok()
    assert "cannot contradict the rule here: only the order of the starts was checked" in said.stdout


@pytest.mark.parametrize("changes, arguments, words", [
    ({"schema": ...}, (), ("costs.json", "schema")), ({"schema": 2}, (), ("costs.json", "schema")), ({"cost_us": [1e308] * len(COSTS)}, (), ("costs.json", "cost_us")),
    ({"cost_us": [1.0]}, (), ("costs.json", "cost_us")), ({"unit": ...}, (), ("costs.json", "unit")), ({"iterations": 0}, (), ("costs.json", "iterations")),
    ({"cost_us": [0.0] * len(COSTS)}, (), ("costs.json", "cost_us")), ({}, ("--schedule", "static,2", "--chunk", 3), ("--chunk",)),
    ({}, ("--schedule", "fast"), ("fast",)), ({}, ("--scale", 1e9), ("--scale",)), ({}, ("--threads", 0), ("--threads",))])
def test_bad_input(tmp_path, changes, arguments, words):
    refused(run("replay", loops.write(tmp_path / "costs.json", COSTS, **changes), *arguments), *words)


def test_a_broken_file_is_refused(tmp_path):
    path = tmp_path / "costs.json"
    refused(run("replay", path), "costs.json")
    path.write_text("{")
    refused(run("replay", path), "costs.json", "not JSON")
