"""Where threads run."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, sampling, sweep
from .studies import Study, needs_two_cpus
from .study_schema import PLACEMENT, obey


def places_of_cores(context: dict[str, Any]) -> list[set[int]]:
    """The allowed CPUs of each core, in the order of the cores."""
    allowed, cores = set(context["machine"]["cpus_allowed"]), {}
    for place in context["machine"]["topology"]:
        if place["cpu"] in allowed:
            cores.setdefault(place["core"], set()).add(place["cpu"])
    return [cores[core] for core in sorted(cores)]


def test_topology_has_every_allowed_cpu(good: Study) -> None:
    machine = good.context["machine"]
    assert set(machine["cpus_allowed"]) <= {place["cpu"] for place in machine["topology"]}
    assert all(set(place) == {"cpu", "core", "package", "numa_node"} for place in machine["topology"])
    assert len({place["core"] for place in machine["topology"]}) == machine["cores"]


def test_every_sample_says_where_its_threads_were(study: Study) -> None:
    allowed = set(study.context["machine"]["cpus_allowed"])
    for r in study.records:
        if r["status"] != "ok":
            assert r["placement"] is None
            continue
        obey(r["placement"], PLACEMENT, r["name"])
        seen: set[int] = set()
        for thread in r["per_thread"]:
            cpus = set(map(int, thread["cpus"]))
            assert cpus <= allowed and all(1 <= n <= len(r["samples_ms"]) for n in thread["cpus"].values())
            assert thread["migrations"] >= len(cpus) - len(set(r["launches"]))  # a launch begins anywhere
            seen |= cpus
        assert r["placement"]["cpus"] == len(seen)
        assert r["placement"]["migrations"] == sum(thread["migrations"] for thread in r["per_thread"])
        assert r["placement"]["samples_sharing_cpu"] <= r["placement"]["samples_sharing_core"] <= len(r["samples_ms"])
        bound = r["config"]["binding"] != "none" and r["config"]["backend"] != "serial"
        assert r["placement"]["binding"] == ("kept" if bound else None)


@needs_two_cpus
@pytest.mark.parametrize("binding", ["close", "spread"])
def test_bound_threads_stay_in_their_places(tmp_path: Path, binding: str) -> None:
    """Under OpenMP as under oneTBB, whose binding is this program's own."""
    study = Study(tmp_path, sampling(8, launches=2), sweep("row_parallel", ["openmp:dynamic", "tbb:auto", "tbb:affinity"], threads=2, binding=binding))
    places = places_of_cores(study.context)
    expected = [0, 1 if binding == "close" else len(places) // 2] if len(places) > 1 else [0, 0]
    assert [r["status"] for r in study.records] == ["ok"] * 3, [r.get("reason") for r in study.records]
    for r in study.records:
        assert r["placement"]["binding"] == "kept" and r["threads_observed"] == 2
        for place, thread in zip(expected, r["per_thread"]):
            if thread["cpus"]:  # a worker of oneTBB that came too late for every loop was never seen
                assert set(map(int, thread["cpus"])) <= places[place]
        if len(places) > 1:
            assert r["placement"]["samples_sharing_core"] == 0


@needs_two_cpus
def test_a_binding_that_is_not_kept_fails(tmp_path: Path) -> None:
    """Threads that are told to bind and are moved on by somebody else: a library that frees them again."""
    source, library = tmp_path / "free.c", tmp_path / "free.so"
    source.write_text("""#define _GNU_SOURCE
#include <dlfcn.h>
#include <sched.h>
#include <unistd.h>
/* Every look moves the thread to the other CPU: 0, 1, 0, ... */
int sched_getcpu(void) { static __thread int looks; return looks++ % 2; }
""")
    compiled = subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], capture_output=True)
    if compiled.returncode != 0:
        pytest.skip("no C compiler")
    study = Study(tmp_path, sampling(), sweep("row_parallel", ["serial", "openmp:static"], threads=1, binding=["none", "close"]), LD_PRELOAD=str(library))
    places = places_of_cores(study.context)
    if any({0, 1} <= place for place in places):
        pytest.skip("CPUs 0 and 1 are one core")
    assert study.outcome.code == 1
    broken = study.the(backend="openmp", binding="close")
    assert broken["status"] == "failed" and "binding close was not kept: thread 0" in broken["reason"] and broken["placement"] is None
    free = study.the(backend="openmp", binding="none")
    assert free["status"] == "ok" and free["placement"]["binding"] is None and free["placement"]["migrations"] > 10


def test_two_threads_on_one_cpu_are_labelled(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(), sweep("row_parallel", "openmp:static", threads=CPUS + 1), options=("--oversubscribe",))
    (r,) = study.records
    assert r["placement"]["samples_sharing_cpu"] == len(r["samples_ms"])
