"""`rasterbench machine`: the measured limits as text and JSON, and the floors of a study's records that follow from such rates."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, events, json_lines, records, refused, run, sampling, sweep, write_study

SMALL = ("--triangles", 3000, "--size", "64x48", "--repetitions", 6)


def is_measured(value: dict[str, Any], name: str) -> bool:
    low, high = value["interval"]
    best = value["best"] >= high if name == "gb_per_s" else 0 < value["best"] <= low
    return set(value) == {name, "interval", "best"} and 0 < low <= value[name] <= high and best


@pytest.fixture(scope="module")
def machine() -> dict[str, Any]:
    outcome = run("machine", *SMALL, "--json").ok()
    assert "machine: " in outcome.stderr  # progress
    return json.loads(outcome.stdout)


def test_json_keys_and_types(machine: dict[str, Any]) -> None:
    assert set(machine) == {"instructions", "threads_by", "repetitions", "last_level_cache_bytes", "point", "bandwidth", "geometry", "floor"}
    assert machine["instructions"] and machine["threads_by"] == "std::thread, unbound" and machine["repetitions"] == 6
    assert machine["point"] == {"size": [64, 48], "triangles": 3000, "read_bytes": 108000, "write_bytes": 24576}
    counts = list(range(1, CPUS + 1))
    assert [(row["working_set"], row["threads"]) for row in machine["bandwidth"]] == [(s, n) for n in counts for s in ("point", "beyond_cache")]
    for row in machine["bandwidth"]:
        assert set(row) == {"working_set", "threads", "read_bytes", "write_bytes", "huge_pages", "read", "write", "streaming_write", "triad"}
        assert isinstance(row["huge_pages"], bool)
        assert all(is_measured(row[loop], "gb_per_s") for loop in ("read", "write", "streaming_write", "triad"))
    for row in machine["geometry"]:
        assert set(row) == {"threads", "model", "batch_triangles", "isa", "ns_per_triangle", "interval", "best"}
        assert is_measured({key: row[key] for key in ("ns_per_triangle", "interval", "best")}, "ns_per_triangle") and row["batch_triangles"] > 0
    assert [row["threads"] for row in machine["geometry"]] == [row["threads"] for row in machine["floor"]] == counts


def test_working_sets(machine: dict[str, Any]) -> None:
    for row in machine["bandwidth"]:
        if row["working_set"] == "point":  # whole blocks of 512 bytes, three a thread
            blocks = [max(-(-size // 512), 3 * row["threads"]) for size in (108000, 24576)]
            assert [row["read_bytes"], row["write_bytes"]] == [512 * n for n in blocks]
        else:
            cache = machine["last_level_cache_bytes"]
            free = int(re.search(r"MemAvailable: +(\d+)", Path("/proc/meminfo").read_text())[1]) * 1024
            if not isinstance(cache, str) and free > 100 * cache:
                assert row["read_bytes"] >= 4 * cache and row["write_bytes"] >= 4 * cache


def test_floor_is_bytes_at_the_rates_of_the_point(machine: dict[str, Any]) -> None:
    rates = {row["threads"]: row for row in machine["bandwidth"] if row["working_set"] == "point"}
    for row, geometry in zip(machine["floor"], machine["geometry"]):
        at = rates[row["threads"]]
        assert row["floor_ms"] == pytest.approx(108000 / at["read"]["best"] / 1e6 + 24576 / at["streaming_write"]["best"] / 1e6)
        assert row["geometry_ms"] == pytest.approx(3000 * geometry["ns_per_triangle"] / 1e6)


def test_tables() -> None:
    out = run("machine", *SMALL, "--threads", 1).ok().stdout
    assert re.search(r"^point +1 ", out, re.MULTILINE) and re.search(r"^beyond_cache +1 ", out, re.MULTILINE)
    assert "GB/s" in out and "floor ms" in out and "3000 triangles of 36 bytes" in out
    assert not re.search(r"^point +2 ", out, re.MULTILINE)


@pytest.mark.parametrize("options, words", [
    (["--size", "64"], ["--size", "64"]),
    (["--size", "0x48"], ["--size", "0"]),
    (["--triangles", 0], ["--triangles", "0"]),
    (["--triangles", "many"], ["--triangles", "many"]),
    (["--triangles", 2**31], ["--triangles", str(2**31)]),
    (["--threads", 0], ["--threads", "0"]),
    (["--threads", CPUS + 1], ["--threads", f"{CPUS} CPUs"]),
    (["--repetitions", 5], ["--repetitions", "6"]),
    (["--sise", "64x48"], ["--sise"]),
], ids=lambda value: " ".join(map(str, value)))
def test_bad_options(options: list[object], words: list[str]) -> None:
    refused(run("machine", *options), *words)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("floors")
    file = write_study(folder / "study.toml", sampling(), sweep(["tile_parallel", "null"], ["serial", "openmp:static"], threads=[1, CPUS + 1]))
    assert run("study", file, "--out", folder / "out").code == 1  # null does not conform
    return folder / "out"


def test_records_have_floors_that_follow_from_the_limits(study: Path) -> None:
    limits = json.loads((study / "context.json").read_text())["limits"]
    assert set(limits) == {"floor", "bytes_per_triangle", "bytes_per_pixel", "threads_by", "instructions", "rates"}
    (rates,) = limits["rates"]  # one scene, one size; the points on more threads than CPUs are skipped
    assert set(rates) == {"threads", "read_bytes", "write_bytes", "huge_pages", "repetitions", "read", "streaming_write"} and rates["threads"] == 1
    timed = [r for r in records(study) if r["status"] == "ok"]
    assert timed and len(timed) < len(records(study))
    for r in timed:
        width, height = r["config"]["size"]
        assert (rates["read_bytes"], rates["write_bytes"]) == (r["work"]["triangles"] * 36, width * height * 8)
        floor = rates["read_bytes"] / rates["read"]["best"] + rates["write_bytes"] / rates["streaming_write"]["best"]
        assert r["floor_ms"] == pytest.approx(floor / 1e6) and 0 < r["floor_ms"] < r["median_ms"]
    assert {r["status"] for r in records(study) if r["floor_ms"] is None} == {"failed", "skipped"}


def test_a_resumed_study_keeps_its_limits(study: Path) -> None:
    before = json.loads((study / "context.json").read_text())["limits"]
    run("study", study.parent / "study.toml", "--out", study, "--resume")
    assert json.loads((study / "context.json").read_text())["limits"] == before
    assert len(events(study, "limit")) == 1


def test_a_broken_limit_is_refused(study: Path, tmp_path: Path) -> None:
    lines = (study / "journal.jsonl").read_text().splitlines(keepends=True)
    (place,) = [i for i, event in enumerate(json_lines(study / "journal.jsonl")) if event["event"] == "limit"]
    (tmp_path / "out").mkdir()
    lines[place] = '{"event":"limit","rates":{"threads":1}}\n'
    (tmp_path / "out/journal.jsonl").write_text("".join(lines))
    refused(run("study", study.parent / "study.toml", "--out", tmp_path / "out", "--resume"), f"journal.jsonl:{place + 1}: ", "read_bytes")


@pytest.mark.skipif(CPUS < 2, reason="needs two CPUs")
def test_threads_that_do_not_run_have_no_floor(tmp_path: Path) -> None:
    file = write_study(tmp_path / "study.toml", sampling(), sweep("row_parallel", "openmp:dynamic", threads=[1, 2]))
    outcome = run("study", file, "--out", tmp_path / "out", OMP_THREAD_LIMIT="1")
    assert [r["floor_ms"] is None for r in records(tmp_path / "out")] == [False, True]
    assert outcome.code == 1


@pytest.mark.skipif(CPUS < 2, reason="needs two CPUs")
def test_threads_bound_to_one_cpu_are_not_measured() -> None:
    outcome = run("machine", *SMALL, "--threads", 2, OMP_PROC_BIND="close")
    assert outcome.code == 1 and outcome.stdout == "" and "bound to one CPU (see OMP_PROC_BIND)" in outcome.errors[-1]
