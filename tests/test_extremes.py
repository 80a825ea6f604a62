"""`rasterbench extremes` and `rasterbench stability`: verdicts, exit codes, catalogues of one's own, and what is written."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from .program import json_lines, refused, run

MODES = ["f32", "f64", "fixed_8", "filtered", "exact"]
TRIANGLE = 'screen = [[2,2,2, 30,2,2, 2,30,3]]\nsize = [32, 32]\n'


def catalogue(folder: Path, *cases: str) -> Path:
    path = folder / "own.toml"
    path.write_text("".join(f'[[case]]\nnumber = {n}\nname = "case_{n}"\n{text}\n' for n, text in enumerate(cases, start=1)))
    return path


def extremes(*options: object, modes: list[str] = MODES) -> list[dict[str, Any]]:
    return json.loads(run("extremes", *(x for mode in modes for x in ("--numeric", mode)), *options, "--json").ok().stdout)


def test_a_case_has_a_verdict_in_each_mode() -> None:
    found = extremes("--case", 19)
    assert [entry["numeric"] for entry in found] == MODES
    for entry in found:
        assert entry["name"] == "extension_of_an_edge" and entry["kernel"] == "tile_parallel"
        assert entry["verdict"] == "exact" and entry["drawn"] > 0 and entry["wrong"] == 0 and entry["explanation"] == ""
    by_name = extremes("--case", "extension_of_an_edge")
    assert by_name == found


def test_the_literal_program_is_reported_and_not_wrong() -> None:
    (entry,) = extremes("--case", 19, modes=["two_product"])
    assert entry["verdict"] == "reported" and entry["wrong"] > 0 and "wrong" in entry["explanation"]


def test_cases_about_reading_run_once() -> None:
    found = extremes("--case", 2, "--case", "trailing_bytes")
    assert {entry["number"] for entry in found} == {2, 3}
    assert all(entry["verdict"] == "refused" and entry["numeric"] is None for entry in found)


def test_the_table_has_a_legend() -> None:
    outcome = run("extremes", "--numeric", "f32", "--numeric", "two_product", "--case", 18, "--case", 33).ok()
    rows = [line.split() for line in outcome.stdout.splitlines()]
    assert ["18", "lattice", "=", "o"] in rows
    assert ["33", "near_beyond_far", "!", "(reading:", "any", "mode)"] in rows
    for word in ("exact", "within bound", "reported", "refused", "WRONG", "not carried"):
        assert word in outcome.stdout
    counts = {row[0]: row[1:] for row in rows if row and row[0] in ("f32", "two_product")}
    assert counts["f32"] == ["0/0*"] and counts["two_product"][0].endswith("/2560")


def test_wrong_is_exit_code_1_and_a_line(tmp_path: Path) -> None:
    own = catalogue(tmp_path, TRIANGLE + "must = { pixels = 7 }", TRIANGLE + 'must = { match = ["oracle", "truth"] }')
    outcome = run("extremes", "--catalogue", own, "--numeric", "f32")
    assert outcome.code == 1
    (line,) = [line for line in outcome.stdout.splitlines() if line.startswith("WRONG: ")]
    assert line.startswith("WRONG: case 1 case_1, tile_parallel f32: ") and "pixels, not 7" in line
    assert run("extremes", "--catalogue", own, "--numeric", "f32", "--case", 2).ok()
    assert run("extremes", "--catalogue", own, "--numeric", "f32", "--json").code == 1


def test_a_kernel_that_cannot_carry_a_mode_is_shown(tmp_path: Path) -> None:
    own = catalogue(tmp_path, TRIANGLE + 'must = { match = ["oracle"] }')
    found = extremes("--catalogue", own, "--kernel", "triangle_atomics", "--kernel", "bounding_box", modes=["f32", "f64"])
    assert [(entry["kernel"], entry["numeric"], entry["verdict"]) for entry in found] == [
        ("triangle_atomics", "f32", "exact"), ("triangle_atomics", "f64", "not carried"),
        ("bounding_box", "f32", "exact"), ("bounding_box", "f64", "exact")]


def test_a_kernel_that_draws_something_else_is_wrong(tmp_path: Path) -> None:
    own = catalogue(tmp_path, TRIANGLE + 'must = { match = ["oracle"] }')
    outcome = run("extremes", "--catalogue", own, "--kernel", "null", "--numeric", "f32")
    assert outcome.code == 1 and "differ from the specification of f32" in outcome.stdout


def test_gaps_and_overlaps_are_counted(tmp_path: Path) -> None:
    own = catalogue(tmp_path, 'construct = { name = "lattice" }\nmust = { watertight = ["f32"] }', TRIANGLE + "must = { pixels = 7 }")
    found = extremes("--catalogue", own, "--watertight", modes=["f32", "exact", "two_product"])
    assert [(entry["gaps"], entry["overlaps"] > 0) for entry in found] == [(0, False), (0, False), (0, True)]
    # Half of the picture is bare.
    half = catalogue(tmp_path, 'screen = [[-1,-1,2, 65,-1,2, -1,65,2]]\nmust = { watertight = ["f32"] }')
    outcome = run("extremes", "--catalogue", half, "--numeric", "f32", "--watertight")
    assert outcome.code == 1 and "gaps and 0 overlaps" in outcome.stdout


@pytest.mark.parametrize("options, words", [
    (["--case", "latice"], ["--case", "did you mean 'lattice'"]),
    (["--case", 999], ["--case", "no case 999"]),
    (["--numeric", "f23"], ["--numeric", "did you mean"]),
    (["--kernel", "tiles"], ["unknown kernel 'tiles'"]),
    (["--case", 19, "--watertight"], ["--watertight", "mesh"]),
    (["--catalogue", "none.toml"], ["none.toml", "cannot be read"]),
])
def test_mistakes_are_refused(options: list[object], words: list[str]) -> None:
    refused(run("extremes", *options), *words)


def test_a_catalogue_is_read_strictly(tmp_path: Path) -> None:
    own = catalogue(tmp_path, TRIANGLE + "must = { pixel = 7 }")
    refused(run("extremes", "--catalogue", own), f"{own}:6", "pixel", "did you mean 'pixels'")


def test_sweeps_are_written_line_by_line(tmp_path: Path) -> None:
    outcome = run("stability", "--sweep", "near_far", "--sweep", "triangle_size", "--steps", 2, "--numeric", "f32", "--numeric", "f64",
                  "-o", "out.jsonl", cwd=tmp_path).ok()
    assert os.listdir(tmp_path) == ["out.jsonl"]
    lines = json_lines(tmp_path / "out.jsonl")
    keys = ["sweep", "parameter", "numeric", "pixels", "drawn", "wrong", "unexplained", "worst_distance_px", "max_depth_error_steps",
            "judge"]
    assert all(list(line) == keys for line in lines)
    assert [(line["sweep"], line["parameter"], line["numeric"]) for line in lines] == [
        (sweep, parameter, mode) for sweep, ends in (("near_far", (10, 1e18)), ("triangle_size", (1000, 1e-3)))
        for parameter in ends for mode in ("f32", "f64")]
    by_key = {(line["sweep"], line["parameter"], line["numeric"]): line for line in lines}
    assert by_key["near_far", 1e18, "f32"]["wrong"] == by_key["near_far", 1e18, "f32"]["drawn"] > 1000
    assert by_key["near_far", 1e18, "f64"]["wrong"] <= by_key["near_far", 1e18, "f64"]["drawn"] / 1000
    assert all((line["judge"] == "truth") == (line["worst_distance_px"] is None) for line in lines)
    assert all(line["unexplained"] == 0 for line in lines)
    table = {row[0]: row[1:] for row in map(str.split, outcome.stdout.splitlines()) if row and row[0] in ("f32", "f64")}
    assert table["f32"][0] == "1e+18" and table["f64"][0] == "-"


@pytest.mark.parametrize("options, words", [
    (["--sweep", "near_fra"], ["--sweep", "did you mean 'near_far'"]),
    (["--numeric", "ray_cast"], ["--numeric", "ray_cast"]),
    (["-o", "none/out.jsonl"], ["none"]),
])
def test_mistakes_of_stability_are_refused(options: list[object], words: list[str], tmp_path: Path) -> None:
    refused(run("stability", *options, cwd=tmp_path), *words)
    assert os.listdir(tmp_path) == []


def test_rays_are_taken_to_the_extremes_too() -> None:
    """ray_cast is a kernel and a mode of its own: by default it stands in a table beside the others'."""
    found = extremes(modes=["ray_cast"])
    assert {entry["kernel"] for entry in found if entry["numeric"]} == {"ray_cast"}
    assert {entry["number"] for entry in found} >= set(range(1, 46))
    assert not [entry for entry in found if entry["verdict"] == "WRONG"]
    assert sum(entry["verdict"] == "exact" for entry in found) > 20
