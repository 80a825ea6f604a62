"""`rasterbench explain`: where the time of a point goes, as text and JSON, of a model and of a point of a study."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, Parameters, refused, run, sampling, sweep, write_dat, write_study

STAGES = ["clear", "geometry", "raster", "resolve"]
RUNGS = ["read", "transform", "reject", "clip", "set-up", "box", "coverage", "key", "keep", "shade"]
SMALL = ("teapot:triangles=300", "--size", "96x64", "--samples", 6)


def explain(*arguments: object, **variables: str) -> dict[str, Any]:
    outcome = run("explain", *arguments, "--json", **variables).ok()
    assert "verify: " in outcome.stderr and "counters: " in outcome.stderr  # progress
    return json.loads(outcome.stdout)


@pytest.fixture(scope="module")
def explained() -> dict[str, Any]:
    return explain(*SMALL, "--kernel", "triangle_private", "--numeric", "fixed_8", "--threads", min(2, CPUS))


def test_keys(explained: dict[str, Any]) -> None:
    assert list(explained) == ["point", "config", "samples", "median_ms", "interval_ms", "floor_ms", "times_floor", "rates", "stages", "raster_loop",
                               "geometry", "specification", "counted", "hardware", "hardware_rates", "cost_ladder", "own_bytes_ms", "bound"]
    assert explained["point"].startswith("teapot:triangles=300/96x64/triangle_private/fixed_8/closed/clip/openmp:dynamic/")
    assert explained["config"]["kernel"] == "triangle_private" and explained["samples"] == 6
    low, high = explained["interval_ms"]
    assert 0 < low <= explained["median_ms"] <= high


def test_floors_follow_from_bytes_and_rates(explained: dict[str, Any]) -> None:
    rates = explained["rates"]

    def milliseconds(read: int, written: int) -> float:
        return (read / rates["read"]["best"] + written / rates["streaming_write"]["best"]) / 1e6

    triangles = explained["geometry"]["triangles"]
    assert (rates["read_bytes"], rates["write_bytes"]) == (36 * triangles, 8 * 96 * 64)
    assert explained["floor_ms"] == pytest.approx(milliseconds(36 * triangles, 8 * 96 * 64))
    assert explained["times_floor"] == pytest.approx(explained["median_ms"] / explained["floor_ms"])
    assert list(explained["stages"]) == STAGES
    for name, stage in explained["stages"].items():
        assert stage["floor_ms"] == pytest.approx(milliseconds(stage["bytes"]["read"], stage["bytes"]["written"])), name
        assert stage["share"] == pytest.approx(stage["median_ms"] / explained["median_ms"])
    assert explained["own_bytes_ms"] == pytest.approx(sum(stage["floor_ms"] for stage in explained["stages"].values()))


def test_raster_loop(explained: dict[str, Any]) -> None:
    loop = explained["raster_loop"]
    assert len(loop["busy_ms"]) == explained["config"]["threads"]
    assert loop["busy_longest_ms"] >= loop["busy_mean_ms"] >= 0 and loop["imbalance_ms"] >= 0 and loop["serial_ms"] >= 0


def test_counters_of_a_triangle_drawn_by_hand(tmp_path: Path) -> None:
    """From (0, 0, 3) with 90 degrees, 32 x 32 px: legs of 4.25 px from the upper left corner cover 10 of the 16 samples of their box."""
    def corner(x: float, y: float) -> list[float]:
        return [(x / 16 - 1) * 3, (1 - y / 16) * 3, 0]

    dat = write_dat(tmp_path / "one.dat", [[corner(0, 0), corner(4.25, 0), corner(0, 4.25)]])
    txt = Parameters(camera=(0, 0, 3), height=32, width=32, theta=1.5707963267948966, near=1, far=10).write(tmp_path / "one.txt")
    for kernel, tested in (("bounding_box", 16), ("all_pixels", 32 * 32), ("tile_parallel", 16)):
        e = explain(dat, txt, "--samples", 6, "--backend", "serial", "--kernel", kernel)
        c = e["counted"]
        assert (c["fragments_tested"], c["fragments_passed"], c["covered_pixels"], c["visible_triangles"]) == (tested, 10, 10, 1), kernel
        assert {size: n for size, n in c["sizes"].items() if n} == {"side_4": 1}
        assert (c["tiles"], c["tiles_touched"], c["bin_entries"]) == ((1, 1, 1) if kernel == "tile_parallel" else (None, None, None))
        assert [rung["results"] for rung in e["cost_ladder"]["rungs"]] == [1, 1, 1, 1, 1, 1, 10, 10, 10, 32 * 32]


def test_samples_are_those_of_the_specification(explained: dict[str, Any]) -> None:
    specification, counted = explained["specification"], explained["counted"]
    assert specification["samples_in_boxes"] == counted["samples_in_boxes"] == counted["fragments_tested"]
    assert specification["samples_inside"] == counted["fragments_passed"] > counted["covered_pixels"] > 0


def test_cost_ladder(explained: dict[str, Any]) -> None:
    ladder = explained["cost_ladder"]
    assert [rung["rung"] for rung in ladder["rungs"]] == RUNGS and ladder["numeric"] == "fixed_8" and ladder["repetitions"] == 6
    below = 0
    for rung in ladder["rungs"]:
        assert rung["meaning"] and rung["unit"] and rung["median_ms"] > 0
        assert rung["step_ms"] == pytest.approx(rung["median_ms"] - below, abs=1e-12)
        assert rung["times_floor"] == pytest.approx(rung["median_ms"] / explained["floor_ms"])
        below = rung["median_ms"]
    assert ladder["rungs"][0]["results"] == explained["geometry"]["triangles"]
    assert ladder["rungs"][3]["results"] == explained["geometry"]["pieces"]
    for rung in ladder["rungs"][6:9]:
        assert rung["results"] == explained["counted"]["fragments_passed"]


def test_hardware_counters_are_there_or_say_why_not(explained: dict[str, Any]) -> None:
    hardware, rates = explained["hardware"], explained["hardware_rates"]
    for thread in hardware["per_thread"]:
        assert {event for event, count in thread.items() if count is None} == set(hardware["unavailable"])
    counted = bool(hardware["per_thread"]) and not {"cycles", "instructions"} & set(hardware["unavailable"])
    assert (rates["instructions_per_cycle"] is not None) == counted


def test_the_bound_is_that_of_the_thresholds(explained: dict[str, Any]) -> None:
    e, loop = explained, explained["raster_loop"]
    frame = e["median_ms"]
    if frame <= 1.5 * e["floor_ms"] or frame <= 1.5 * e["own_bytes_ms"]:
        expected = "memory bandwidth"
    elif loop["imbalance_ms"] + loop["serial_ms"] >= 0.2 * frame:
        expected = "imbalance" if loop["imbalance_ms"] >= loop["serial_ms"] else "serial part"
    elif e["stages"]["geometry"]["median_ms"] >= 0.5 * frame:
        expected = "geometry"
    else:
        expected = "instructions"
    assert e["bound"]["name"] == expected and e["bound"]["text"] and e["bound"]["measures"] and e["bound"]["largest_step"]


def test_barriers_of_a_kernel_that_has_one_per_triangle_are_its_bound() -> None:
    if CPUS < 2:
        pytest.skip("needs two CPUs")
    e = explain("confetti:triangles=3000,size=2", "--size", "320x200", "--samples", 6, "--kernel", "bounding_box", "--threads", 2,
                OMP_WAIT_POLICY="passive")
    assert e["bound"]["name"] in ("serial part", "imbalance")


def test_text() -> None:
    text = run("explain", *SMALL, "--numeric", "fixed_8", "--kernel", "tile_simd").ok().stdout
    assert text.startswith("teapot:triangles=300/96x64/tile_simd/fixed_8/")
    for words in (*STAGES, *RUNGS, "x floor", "pieces by the longer side", "bins: ", "hardware counters", "bound: ", "busy"):
        assert words in text, words


def test_what_has_no_ladder_says_so() -> None:
    e = explain(*SMALL, "--numeric", "f64", "--backend", "serial")
    assert e["cost_ladder"] == "unavailable: no ladder in mode f64, but in f32, fixed_8, filtered"
    assert e["counted"]["fragments_passed"] is None and e["counted"]["bin_entries"] > 0


def test_a_kernel_that_does_not_conform_is_not_explained() -> None:
    outcome = run("explain", *SMALL, "--kernel", "null", "--backend", "serial")
    assert outcome.code == 1 and outcome.stdout == "" and "null does not conform" in outcome.errors[-1]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_study(tmp_path_factory.mktemp("study") / "study.toml", sampling(),
                       sweep(["tile_parallel", "row_parallel"], ["serial", "openmp:static"], threads=1, binding=["none", "close"]),
                       sweep("tile_parallel", "openmp:dynamic", threads=CPUS + 1),
                       sweep("scanline", "serial", cache="cold"))


def test_a_point_of_a_study(study: Path) -> None:
    for binding in ("none", "close"):
        pattern = "row_parallel.*static" + ("/1$" if binding == "none" else ".*close")
        e = explain(study, "--point", pattern, "--samples", 6)
        assert (e["config"]["kernel"], e["config"]["schedule"], e["config"]["binding"]) == ("row_parallel", "static", binding)


@pytest.mark.parametrize("options, words", [
    (["--point", "row_parallel"], ["study.toml", "--point", "matches 4 points", "row_parallel"]),
    (["--point", "nothing"], ["--point", "matches 0 points"]),
    ([], ["--point", "points, not one"]),
    (["--point", "("], ["--point", "not a regular expression"]),
    (["--point", "dynamic"], ["is skipped", "--oversubscribe"]),
    (["--point", "scanline"], ["cache:cold", "warm"]),
    (["--point", "static", "--kernel", "row_parallel"], ["--kernel", "study"]),
])
def test_bad_choice_of_a_point(study: Path, options: list[str], words: list[str]) -> None:
    refused(run("explain", study, *options), *words)


@pytest.mark.parametrize("arguments, words", [
    (["none.dat"], ["none.dat"]),
    (["none.toml"], ["none.toml"]),
    (["teapot:triangle=3"], ["triangle"]),
    (["teapot", "--kernel", "tile_paralel"], ["tile_paralel", "tile_parallel"]),
    (["teapot", "--kernel", "tile_simd"], ["--kernel", "tile_simd", "f32"]),
    (["teapot", "--numeric", "f33"], ["f33"]),
    (["teapot", "--numeric", "ray_cast"], ["ray_cast"]),
    (["teapot", "--backend", "opnmp"], ["opnmp"]),
    (["teapot", "--schedule", "dynamic,0"], ["chunk"]),
    (["teapot", "--size", "0x5"], ["--size"]),
    (["teapot", "--fill", "open"], ["--fill", "open"]),
    (["teapot", "--isa", "mmx"], ["--isa", "mmx"]),
    (["teapot", "--threads", "100000"], ["--threads"]),
    (["teapot", "--samples", "5"], ["--samples", "6"]),
    (["teapot", "--samples", "many"], ["--samples", "many"]),
    (["teapot", "--point", "x"], ["--point", "study"]),
    (["teapot", "--tie", "last"], ["--tie"]),
    ([], ["MODEL"]),
])
def test_bad_input(arguments: list[str], words: list[str]) -> None:
    refused(run("explain", *arguments), *words)
