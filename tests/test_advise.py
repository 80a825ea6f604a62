"""`rasterbench advise`: its recommendation is a proof, its command runs, and bad input is one clear line."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .conftest import SmallScene
from .program import Outcome, Parameters, refused, run, write_dat

QUICK = ("--seconds", 0.5, "--threads", 1)


def advise(*arguments: object, code: int = 0) -> dict[str, Any]:
    """The JSON of an advice; progress is on stderr and nothing else on stdout."""
    outcome = run("advise", *arguments, *QUICK, "--json")
    assert outcome.code == code, outcome.stderr
    return json.loads(outcome.stdout)


def mode(advice: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = [m for m in advice["modes"] if m["name"] == name]
    return found


@pytest.fixture(scope="module")
def close_walls(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Six walls that pass through each other, less than a float32 step of depth apart."""
    folder = tmp_path_factory.mktemp("walls")
    z = np.array([0, -1, 2, -3, 4, -5]) * 3e-7
    walls = [[[-1, -1, a], [1, -1, -a], [0, 1, a / 2]] for a in z]
    p = Parameters(camera=(0.3, 0.2, 3.0), height=60, width=80, near=0.01, far=1000.0)
    return write_dat(folder / "walls.dat", walls), p.write(folder / "walls.txt")


@pytest.mark.parametrize("allowed", [0, 5, 1000])
@pytest.mark.parametrize("scene", ["teapot", "crossing"])
def test_the_recommendation_is_a_proof(scene: str, allowed: int, request: pytest.FixtureRequest) -> None:
    drawn: SmallScene = request.getfixturevalue(scene)
    advice = advise(drawn.dat, drawn.txt, "--max-wrong", allowed)
    for m in advice["modes"]:
        assert m["beyond_bound"] == 0, m["name"]
        if m["predicted"] is not None:
            assert m["found"] <= m["predicted"] and m["found_depth_error_world"] <= m["depth_bound_world"], m["name"]
            assert m["suffices"] == (m["predicted"] <= allowed)
        else:
            assert not m["suffices"]
    assert all(t["conforms"] and mode(advice, t["numeric"])["suffices"] for t in advice["tried"])
    chosen = advice["recommendation"]
    assert chosen["found"] <= chosen["predicted"] <= allowed
    assert mode(advice, chosen["numeric"])["suffices"]
    assert chosen["median_ms"] in [f["median_ms"] for f in advice["finalists"]]


def test_the_command_draws_what_was_promised(teapot: SmallScene, tmp_path: Path) -> None:
    """Against the picture of the mode `exact`, drawn by another kernel."""
    advice = advise(teapot.dat, teapot.txt, "--max-wrong", 40, "--size", "200x150", "--fill", "top-left", "--near", "off")
    words = shlex.split(advice["recommendation"]["command"])
    assert words[:4] == ["rasterbench", "render", str(teapot.dat), str(teapot.txt)]
    run(*words[1:], "--ids", tmp_path / "ids.npy").ok()
    run("render", teapot.dat, teapot.txt, "--size", "200x150", "--fill", "top-left", "--near", "off", "--kernel", "bounding_box",
        "--numeric", "exact", "--ids", tmp_path / "exact.npy").ok()
    ids, exact = np.load(tmp_path / "ids.npy"), np.load(tmp_path / "exact.npy")
    assert ids.shape == (150, 200)
    # A mode in float64 is judged on corners that are rounded less: a pixel or two more may differ.
    assert np.count_nonzero(ids != exact) <= 40 + 2


def test_no_wrong_pixel_allowed_where_bounds_cannot_tell(close_walls: tuple[Path, Path]) -> None:
    advice = advise(*close_walls, "--max-wrong", 0)
    assert mode(advice, "f32")["predicted"] > 100 and not mode(advice, "f32")["suffices"]
    chosen = advice["recommendation"]
    assert (chosen["predicted"], chosen["found"]) == (0, 0)
    assert mode(advice, "two_product")["standing"] == "unbounded" and mode(advice, "two_product")["found"] is not None


def test_nothing_suffices(teapot: SmallScene) -> None:
    options = (teapot.dat, teapot.txt, "--max-wrong", 0, "--max-depth-error", 1e-13)
    advice = advise(*options, code=1)
    assert advice["recommendation"] is None and advice["tried"] == advice["finalists"] == []
    assert advice["nearest"]["predicted"] == 0
    outcome = run("advise", *options, *QUICK)
    assert outcome.code == 1
    assert "no mode keeps this tolerance by its bound" in outcome.stdout and advice["nearest"]["name"] in outcome.stdout


def test_the_scene_is_described(crossing: SmallScene, teapot: SmallScene) -> None:
    scene = advise(crossing.dat, crossing.txt, "--max-wrong", 100000)["scene"]
    assert scene["triangles"] == len(crossing.triangles) == scene["drawn"] + sum(scene["rejected"].values())
    assert scene["near_clipped"] > 20 and scene["screen_triangles"] > scene["drawn"]
    near, far = scene["seen_world"]
    assert crossing.parameters.near <= near < far <= crossing.parameters.far
    assert scene["most_layers"] >= scene["mean_layers"] >= 1
    assert scene["edge_px"]["least"] <= scene["edge_px"]["median"] <= scene["edge_px"]["largest"]
    needs = {n["test"]: n for n in advise(teapot.dat, teapot.txt, "--max-wrong", 100000)["needs"]}
    assert not needs["near clip"]["kept"] and "behind the near plane" in needs["near clip"]["reason"]


def test_text(teapot: SmallScene, crossing: SmallScene) -> None:
    def text(scene: SmallScene, *options: object) -> Outcome:
        return run("advise", scene.dat, scene.txt, "--max-wrong", 100000, *QUICK, *options).ok()

    brief = text(teapot).stdout
    for words in ["edges", "depth", "layers", "nothing is promised", "finalists", "recommended: ", "possible by its bound (a proof)",
                  "rasterbench render "]:
        assert words in brief, words
    assert "near clip:" not in brief
    explained = text(crossing, "--explain").stdout
    assert "near clip: kept" in explained and "test of zero area: left out" in explained and "near an edge" in explained


def test_render_explains_what_it_leaves_out(teapot: SmallScene, tmp_path: Path) -> None:
    arguments = ("render", teapot.dat, teapot.txt, "--ids", tmp_path / "x.npy", "--explain")
    assert "near clip: left out, the nearest corner is" in run(*arguments).ok().stdout
    assert "every test is kept" in run(*arguments, "--generality", "full").ok().stdout


@pytest.mark.parametrize("options, words", [
    ([], ["--max-wrong"]),
    (["--max-wrong", "-1"], ["--max-wrong", "-1"]),
    (["--max-wrong", "some"], ["--max-wrong", "some"]),
    (["--max-wrong", "1.5"], ["--max-wrong", "1.5"]),
    (["--max-wrong", "1", "--max-depth-error", "0"], ["--max-depth-error"]),
    (["--max-wrong", "1", "--max-depth-error", "-0.1"], ["--max-depth-error"]),
    (["--max-wrong", "1", "--max-depth-error", "nan"], ["--max-depth-error"]),
    (["--max-wrong", "1", "--max-depth-error", "inf"], ["--max-depth-error"]),
    (["--max-wrong", "1", "--size", "0x10"], ["--size", "width"]),
    (["--max-wrong", "1", "--fill", "open"], ["--fill", "open"]),
    (["--max-wrong", "1", "--near", "cut"], ["--near", "cut"]),
    (["--max-wrong", "9" * 20], ["--max-wrong", "2^63"]),
    (["--max-wrong", "1", "--seconds", "0"], ["--seconds"]),
    (["--max-wrong", "1", "--seconds", "nan"], ["--seconds", "nan"]),
    (["--max-wrong", "1", "--threads", "0"], ["--threads"]),
    (["--max-wrong", "1", "no_such.txt"], ["no_such.txt"]),
], ids=" ".join)
def test_bad_options(options: list[str], words: list[str], teapot: SmallScene) -> None:
    refused(run("advise", teapot.dat, *options), *words)


def test_bad_model(tmp_path: Path) -> None:
    refused(run("advise", tmp_path / "none.dat", "--max-wrong", 1), "none.dat")
    refused(run("advise", "teapt", "--max-wrong", 1), "teapt", "teapot")


@pytest.mark.parametrize("word", ["ful", "none", ""])
def test_bad_generality(word: str, teapot: SmallScene) -> None:
    refused(run("render", teapot.dat, "--generality", word), "--generality", "value")
