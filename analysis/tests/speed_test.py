"""The table of speed: ratios of paired samples, and goals that are reached, missed or neither."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pandas as pd
import pytest

from .. import __main__ as program
from .. import speed
from ..statistics import intervals
from . import synthetic
from .conftest import analyse
from .peer_test import peer_of

ALL = 4  # the CPUs of the synthetic machine
KERNEL_MS, FLOOR_MS = 10.0, 4.0
SMALL = speed.GOALS[0]


def timed(entry: dict[str, Any], samples: np.ndarray) -> None:
    bounds = intervals.order_interval(samples)
    entry.update(samples_ms=samples.tolist(), launches=[0] * len(samples), blocks=list(range(len(samples))),
                 median_ms=float(np.median(samples)), interval_ms=list(bounds) if bounds else None, min_ms=float(samples.min()),
                 max_ms=float(samples.max()), stages_ms={"raster": samples.tolist()}, loop_ms=None)


def identify(entry: dict[str, Any]) -> dict[str, Any]:
    return entry | {"id": synthetic.digest(entry["config"]), "name": f"{synthetic.name(entry['config'])}/{entry['config']['isa']}"}


@pytest.fixture
def make(study: Callable[..., Path]) -> Callable[..., Path]:
    """A study of speed: a mesh of 870k triangles of 2 px on 1920x1080, on 1 and 4 threads, in two instruction sets."""
    def made(factor: float = 30.0, spread: float = 0.0, samples: int = 12, floor: float | None = FLOOR_MS, pixels: float = 2.0,
             triangles: int = 870_000, size: tuple[int, int] = (1920, 1080), peers: bool = True, fill: str = "top-left",
             then: Callable[[list[dict[str, Any]]], None] | None = None) -> Path:
        def edit(entries: list[dict[str, Any]]) -> None:
            # Drift that peer and kernel share must not show in their ratio; `spread` is the ratio's own.
            drift = np.linspace(1.0, 3.0, samples)
            ratios = factor * (1 + spread * np.linspace(-1, 1, samples)[np.argsort(np.sin(np.arange(samples)))])
            kernels, others = [], []
            for entry in entries:
                if entry["config"]["backend"] == "serial":
                    continue
                entry["config"] |= {"numeric": "fixed_8", "isa": "avx512", "fill": fill}
                entry["work"]["fragments_covered"] = pixels * triangles
                entry["floor_ms"] = floor
                other = peer_of(entry, entry["config"]["threads"])
                timed(other, KERNEL_MS * drift * ratios)
                timed(entry, KERNEL_MS * drift)
                twin = copy.deepcopy(entry)
                twin["config"]["isa"] = "avx2"
                kernels += [identify(entry), identify(twin)]
                others.append(other)
            entries[:] = kernels + (others if peers else [])
            if then:
                then(entries)

        return study(scenes={"mesh": (triangles, 45.0, list(size))}, kernels=["tile_parallel"], schedules=[("openmp", "dynamic", None)],
                     threads=[1, ALL], untimed=False, edit=edit)

    return made


def row_of(directory: Path, isa: str = "avx512", threads: int = ALL) -> speed.Row:
    (row,) = [r for r in speed.rows(analyse(directory)) if (r.kernel.config.isa, r.kernel.config.threads) == (isa, threads)]
    return row


def test_the_ratio_is_that_of_pairs(make: Callable[..., Path]) -> None:
    """Samples drift threefold, pairs do not: the interval is that of the pairs."""
    row = row_of(make(factor=30.0, spread=0.01))
    assert row.faster.value == pytest.approx(30.0, rel=0.01) and "paired" in row.faster.kind
    assert 29.6 < row.faster.low < row.faster.high < 30.4
    assert row.floor.value == pytest.approx(2 * KERNEL_MS / FLOOR_MS) and row.floor.low < row.floor.value < row.floor.high
    assert row.pixels == 2.0 and row.goal is SMALL


@pytest.mark.parametrize("factor, spread, expected", [(26, 0.01, speed.REACHED), (24, 0.01, speed.MISSED), (25, 0.2, speed.UNDECIDED)])
def test_a_goal_is_judged_by_the_interval(make: Callable[..., Path], capsys: Any, factor: float, spread: float, expected: str) -> None:
    directory = make(factor=factor, spread=spread)
    row = row_of(directory)
    assert row.faster_verdict == expected
    assert (row.faster.low < SMALL.times_faster < row.faster.high) == (expected == speed.UNDECIDED)
    assert program.main(["speed", str(directory)]) == 0
    assert f">= 25: {expected}" in capsys.readouterr().out


@pytest.mark.parametrize("floor, expected", [(100.0, speed.REACHED), (1.0, speed.MISSED), (2 * KERNEL_MS / 6, speed.UNDECIDED)])
def test_a_goal_over_the_floor_is_an_upper_bound(make: Callable[..., Path], floor: float, expected: str) -> None:
    assert row_of(make(floor=floor)).floor_verdict == expected


def test_a_ratio_without_an_interval_decides_nothing(make: Callable[..., Path]) -> None:
    row = row_of(make(factor=1000.0, samples=4))
    assert row.faster.value > 900 and not row.faster.has_interval and row.faster_verdict == speed.UNDECIDED


def test_an_unpaired_ratio_decides_nothing(make: Callable[..., Path]) -> None:
    def other_blocks(entries: list[dict[str, Any]]) -> None:
        for entry in (e for e in entries if e["config"]["backend"] == "llvmpipe"):
            entry["blocks"] = [block + 100 for block in entry["blocks"]]

    row = row_of(make(factor=1000.0, then=other_blocks))
    assert row.faster.low > SMALL.times_faster and row.faster_verdict == speed.UNDECIDED


def test_avx2_is_to_reach_half(make: Callable[..., Path]) -> None:
    directory = make(factor=13.0, floor=2.0)  # 13 x, 10 x the floor: below 25 and 6, beyond 12.5 and 12
    assert (row_of(directory).faster_verdict, row_of(directory, "avx2").faster_verdict) == (speed.MISSED, speed.REACHED)
    table = speed.table(analyse(directory)).numbers.set_index(["isa", "threads"])
    assert table.loc["avx2", ALL].times_faster_goal == 12.5 and table.loc["avx2", ALL].times_floor_goal == 12


def test_only_all_threads_and_the_shared_fill_rule_are_judged(make: Callable[..., Path]) -> None:
    assert not row_of(make(), threads=1).judged and row_of(make(), threads=1).faster.value == pytest.approx(30)
    assert not row_of(make(fill="closed")).judged

    def without_all(entries: list[dict[str, Any]]) -> None:
        entries[:] = [e for e in entries if e["config"]["threads"] == 1]

    analysis = analyse(make(then=without_all))
    assert not any(row.judged for row in speed.rows(analysis)) and "no goal applies" in speed.plain(analysis)


def test_another_instruction_set_has_no_goal(make: Callable[..., Path]) -> None:
    def sse4(entries: list[dict[str, Any]]) -> None:
        entries[:] = [identify({**e, "config": e["config"] | {"isa": "sse4"}}) for e in entries if e["config"]["isa"] == "avx2"]

    (_, row) = speed.rows(analyse(make(then=sse4)))
    assert row.goal is SMALL and not row.judged and row.faster_verdict == ""


@pytest.mark.parametrize("size, triangles, pixels, name", [
    ((1920, 1080), 870_000, 1.6, "small"), ((1920, 1080), 3_500_000, 0.7, "small, 3.5M"), ((1920, 1080), 69_000, 20, "medium"),
    ((1920, 1080), 1_000_000, 12, "medium"), ((3840, 2160), 870_000, 6.3, "medium, 4K"), ((3840, 2160), 8_000, 10_000, "big, 4K"),
    ((3840, 2160), 3_000, 69_000, "big, 4K, deep"), ((1280, 720), 870_000, 1.6, None), ((1920, 1080), 300, 2, None)])
def test_the_load_decides_the_class(size: tuple[int, int], triangles: int, pixels: float, name: str | None) -> None:
    goal = speed.goal_of(size, triangles, pixels)
    assert (goal.name if goal else None) == name


def test_classes_are_disjoint() -> None:
    for size in (speed.HD, speed.UHD):
        for triangles in np.geomspace(100, 1e8, 60):
            for pixels in np.geomspace(0.1, 1e6, 60):
                assert sum(goal.holds(size, triangles, pixels) for goal in speed.GOALS) <= 1


def test_a_picture_of_no_class_is_shown_without_a_goal(make: Callable[..., Path]) -> None:
    analysis = analyse(make(triangles=300))
    assert "no class: mesh" in speed.plain(analysis) and set(speed.table(analysis).words["goal"]) == {""}
    assert all(f"{goal.name} (" in speed.plain(analysis) for goal in speed.GOALS)


def test_a_missing_peer_is_said(make: Callable[..., Path]) -> None:
    analysis = analyse(make(peers=False))
    row = speed.rows(analysis)[-1]
    assert row.peer is None and row.faster is None and row.faster_verdict == speed.NOT_MEASURED and row.floor is not None
    assert "not in the study" in speed.plain(analysis) and f">= 25: {speed.NOT_MEASURED}" in speed.plain(analysis)


def test_a_peer_that_was_skipped_gives_its_reason(make: Callable[..., Path]) -> None:
    def skip(entries: list[dict[str, Any]]) -> None:
        for entry in (e for e in entries if e["config"]["backend"] == "llvmpipe"):
            synthetic.withhold(entry, "skipped", "EGL could not be started")

    directory = make(then=skip)
    shown = speed.plain(analyse(directory))
    assert "skipped (1)" in shown and shown.count("skipped: EGL could not be started") == 1
    assert row_of(directory).faster_verdict == speed.NOT_MEASURED


def test_a_failed_point_has_its_reason_and_no_speed(make: Callable[..., Path]) -> None:
    def fail(entries: list[dict[str, Any]]) -> None:
        (entry,) = [e for e in entries if e["config"]["isa"] == "avx512" and e["config"]["threads"] == ALL]
        synthetic.withhold(entry, "failed", "12 pixels differ from the specification")

    directory = make(then=fail)
    row = row_of(directory)
    assert row.faster is None and row.floor is None and row.faster_verdict == row.floor_verdict == speed.NOT_MEASURED
    assert row.goal is SMALL and row_of(directory, "avx2").faster_verdict == speed.REACHED
    shown = speed.plain(analyse(directory))
    assert "failed (1)" in shown and "(1) failed: 12 pixels differ from the specification" in shown


def test_older_records_have_no_floor(make: Callable[..., Path]) -> None:
    row = row_of(make(floor=None))
    assert row.floor is None and row.floor_verdict == speed.NOT_MEASURED and row.faster_verdict == speed.REACHED


def test_the_summary_counts_the_goals(make: Callable[..., Path]) -> None:
    faster, floor, absent = speed.summary(analyse(make(factor=20.0, floor=2.0)))  # of 25 and 12.5; 10 x of 6 and 12
    assert faster == "Times faster: of 2 goals 1 reached, 1 MISSED." and floor.startswith("Times the floor: of 2 goals ")
    assert "small (" not in absent and "medium (" in absent


def test_what_is_written(make: Callable[..., Path], capsys: Any) -> None:
    directory = make()
    assert program.main(["speed", str(directory)]) == 0
    out = capsys.readouterr().out
    assert "tile_parallel, fixed_8, fill top-left, openmp dynamic" in out and "avx512, avx2" in out
    assert "Not publishable" in out and str(directory / "speed.csv") in out
    assert max(map(len, out.split("written:")[0].splitlines())) <= 140
    numbers = pd.read_csv(directory / "speed.csv")
    assert len(numbers) == 4 and set(numbers["class"]) == {"small"} and (numbers["times_faster"].round(6) == 30).all()
    assert list(numbers["times_faster_verdict"].dropna()) == [speed.REACHED] * 2
    assert r"\begin{tabular}" in (directory / "speed.tex").read_text()


def test_a_study_of_several_kernels_is_refused(study: Callable[..., Path], capsys: Any) -> None:
    directory = study()
    assert program.main(["speed", str(directory)]) == 2
    refused = capsys.readouterr().err
    assert "records.jsonl: expected one kernel" in refused and len(refused.splitlines()) == 1
    assert not (directory / "speed.csv").exists()
