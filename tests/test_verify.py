"""`rasterbench verify`: the verdicts on kernels and numeric modes, the difference image, and the story of a pixel."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .conftest import SmallScene
from .program import TIMEOUT, command, environment, read_png, refused, run, snapshot


def rows(*arguments: object, code: int = 0) -> dict[tuple[str, str], dict[str, Any]]:
    """By (numeric, kernel)."""
    outcome = run("verify", *arguments, "--json")
    assert outcome.code == code, outcome.stderr
    return {(row["numeric"], row["kernel"]): row for row in json.loads(outcome.stdout)}


def drawn_by(drawn: SmallScene, folder: Path, numeric: str = "f32") -> tuple[Path, Path]:
    """A picture as another build would hand it over."""
    ids, depth = folder / "ids.npy", folder / "depth.npy"
    run("render", drawn.dat, drawn.txt, "--numeric", numeric, "--ids", ids, "--depth", depth, "-o", folder / "picture.png").ok()
    return ids, depth


def given(drawn: SmallScene, ids: Path, depth: Path, numeric: str = "f32", code: int = 0) -> dict[str, Any]:
    return rows(drawn.dat, drawn.txt, "--numeric", numeric, "--ids", ids, "--depth", depth, code=code)[numeric, None]


@pytest.mark.parametrize("numeric", ["f32", "fixed_8", "filtered"])
def test_a_given_picture_is_judged_as_the_kernels_are(numeric: str, teapot: SmallScene, tmp_path: Path) -> None:
    row = given(teapot, *drawn_by(teapot, tmp_path, numeric), numeric)
    assert row["verify"]["conforms"] and row["verify"]["differing_pixels"] == 0 and row["failure"] is None
    own = rows(teapot.dat, teapot.txt, "--numeric", numeric, "--kernel", "tile_parallel")[numeric, "tile_parallel"]["verify"]
    for verdict in ("oracle", "end_to_end"):
        assert {k: v for k, v in row["verify"][verdict].items() if k != "seconds"} == {k: v for k, v in own[verdict].items() if k != "seconds"}


def test_what_is_wrong_in_a_given_picture_is_found(teapot: SmallScene, tmp_path: Path) -> None:
    ids, depth = drawn_by(teapot, tmp_path)
    picture, depths = np.load(ids), np.load(depth)
    y, x = np.argwhere(picture >= 0)[40]
    picture[y, x] = -1  # a hole
    np.save(ids, picture)
    row = given(teapot, ids, depth, code=1)
    assert not row["verify"]["conforms"] and row["verify"]["differing_pixels"] == 1 and "1 pixels differ" in row["failure"]
    assert row["verify"]["oracle"]["unexplained"] == 1 and row["verify"]["oracle"]["false_negatives"] >= 1
    np.save(ids, np.load(drawn_by(teapot, tmp_path)[0]))
    depths[y, x] = np.nextafter(depths[y, x], np.float32(0))  # one step nearer
    np.save(depth, depths)
    row = given(teapot, ids, depth, code=1)
    assert row["verify"]["differing_pixels"] == 1 and row["verify"]["oracle"]["wrong"] == given(teapot, *drawn_by(teapot, tmp_path))["verify"]["oracle"]["wrong"]
    assert given(teapot, *drawn_by(teapot, tmp_path, "fixed_4"), code=1)["verify"]["oracle"]["unexplained"] > 0
    assert "(given picture)" in run("verify", teapot.dat, teapot.txt, "--numeric", "f32", "--ids", ids, "--depth", depth).stdout


@pytest.mark.parametrize("change, words", [
    (lambda ids, depth: ["--ids", ids], ["--depth", "missing"]),
    (lambda ids, depth: ["--depth", depth], ["--ids", "missing"]),
    (lambda ids, depth: ["--ids", depth, "--depth", depth], ["depth.npy", "<i4"]),
    (lambda ids, depth: ["--ids", ids, "--depth", ids], ["ids.npy", "<f4"]),
    (lambda ids, depth: ["--ids", ids.parent / "none.npy", "--depth", depth], ["none.npy", "read"]),
    (lambda ids, depth: ["--ids", ids, "--depth", depth, "--size", "10x10"], ["ids.npy", "shape", "10x10"]),
    (lambda ids, depth: ["--ids", ids, "--depth", depth, "--kernel", "scanline"], ["--ids", "--kernel"]),
    (lambda ids, depth: ["--ids", ids, "--depth", depth, "--numeric", "f64"], ["--ids", "one --numeric"]),
    (lambda ids, depth: [np.save(ids, np.load(ids)[:-1]), "--ids", ids, "--depth", depth][1:], ["depth.npy", "shape"]),
    (lambda ids, depth: [np.save(ids, np.full_like(np.load(ids), 300)), "--ids", ids, "--depth", depth][1:], ["ids.npy", "element 0", "300"]),
    (lambda ids, depth: [ids.write_bytes(ids.read_bytes()[:-4]), "--ids", ids, "--depth", depth][1:], ["ids.npy", "bytes"]),
    (lambda ids, depth: [ids.write_bytes(ids.read_bytes()[:40]), "--ids", ids, "--depth", depth][1:], ["ids.npy", "header"]),
    (lambda ids, depth: [ids.write_bytes(b"P6"), "--ids", ids, "--depth", depth][1:], ["ids.npy", "NumPy"]),
    (lambda ids, depth: [np.save(ids, np.asfortranarray(np.load(ids))), "--ids", ids, "--depth", depth][1:], ["ids.npy", "C order"]),
], ids=range(14))
def test_bad_given_pictures(change: Any, words: list[str], teapot: SmallScene, tmp_path: Path) -> None:
    refused(run("verify", teapot.dat, teapot.txt, "--numeric", "f32", *change(*drawn_by(teapot, tmp_path))), *words)


def test_depths_in_another_format_are_refused(teapot: SmallScene, tmp_path: Path) -> None:
    ids, depth = drawn_by(teapot, tmp_path, "filtered-unorm16")
    refused(run("verify", teapot.dat, teapot.txt, "--numeric", "filtered-unorm16", "--ids", ids, "--depth", depth), "--numeric", "format")


def listed_numerics() -> dict[str, dict[str, Any]]:
    return {mode["name"]: mode for mode in json.loads(run("list", "numerics", "--json").ok().stdout)}


@pytest.mark.parametrize("scene", ["teapot", "crossing"])
def test_every_mode_conforms_and_keeps_its_bound(scene: str, request: pytest.FixtureRequest) -> None:
    drawn: SmallScene = request.getfixturevalue(scene)
    modes = listed_numerics()
    verdicts = rows(drawn.dat, drawn.txt)
    assert {numeric for numeric, _ in verdicts} == {name for name, mode in modes.items() if mode["available"]}
    for (numeric, kernel), row in verdicts.items():
        verify = row["verify"]
        assert row["failure"] is None and verify["conforms"], (numeric, kernel, row["failure"])
        assert verify["bound"]["bounded"] == modes[numeric]["bounded"]
        truth = verify["end_to_end"]
        assert truth["errors"] == 0
        assert truth["pixels"] == truth["identical"] + truth["ambiguous"] + truth["wrong"]
        if numeric == "ray_cast":
            assert verify["oracle"] is None
            continue
        oracle = verify["oracle"]
        assert oracle["unexplained"] == 0 and oracle["within_bound"]
        assert oracle["wrong"] == oracle["exact_ties"] + oracle["edge"] + oracle["depth"] + oracle["unbounded"]
        if verify["bound"]["bounded"]:
            assert oracle["wrong"] <= oracle["predicted"], numeric
        if numeric.startswith("filtered") or numeric == "exact":
            assert oracle["false_positives"] == oracle["false_negatives"] == oracle["edge"] == 0, numeric
        if numeric == "exact":
            assert oracle["wrong"] == oracle["predicted"] == 0
        if numeric.startswith("fixed"):
            assert oracle["edge_on_snapped"] == 0, numeric
        for rays in (verify["embree"], verify["embree_robust"]):
            if "skipped" not in rays:
                assert rays["errors"] == 0 and rays["first_error"] is None and rays["identical"] > 0, numeric


def test_a_kernel_that_does_not_conform_fails(teapot: SmallScene) -> None:
    outcome = run("verify", teapot.dat, teapot.txt, "--kernel", "null", "--kernel", "stale", "--kernel", "scanline", "--numeric", "f32")
    assert outcome.code == 1
    assert re.search(r"f32 +stale +NO", outcome.stdout)
    assert re.search(r"f32 +null +NO", outcome.stdout)
    assert re.search(r"f32 +scanline +yes", outcome.stdout)
    assert "FAILED null f32:" in outcome.stdout and "pixels differ from the specification" in outcome.stdout


def test_the_table_names_unbounded_modes(teapot: SmallScene) -> None:
    outcome = run("verify", teapot.dat, teapot.txt, "--numeric", "two_product", "--numeric", "exact").ok()
    assert re.search(r"two_product .* unbounded", outcome.stdout)
    assert re.search(r"^exact .* exact$", outcome.stdout, re.MULTILINE)


def test_a_coarse_grid_is_wrong_where_the_difference_image_says(teapot: SmallScene, tmp_path: Path) -> None:
    image = tmp_path / "difference.png"
    run("verify", teapot.dat, teapot.txt, "--numeric", "fixed_4", "--difference", image).ok()
    wrong = rows(teapot.dat, teapot.txt, "--numeric", "fixed_4")["fixed_4", "tile_parallel"]["verify"]["oracle"]["wrong"]
    assert wrong > 0
    pixels = read_png(image).astype(int)
    p = teapot.parameters
    assert pixels.shape[1] == p.width and pixels.shape[0] > p.height  # a legend below
    coloured = np.ptp(pixels[: p.height], axis=2) > 30
    assert wrong <= np.count_nonzero(coloured) <= 9 * wrong


def test_the_story_of_a_pixel(teapot: SmallScene, tmp_path: Path) -> None:
    p = teapot.parameters
    ids = tmp_path / "ids.npy"
    run("render", teapot.dat, teapot.txt, "--ids", ids).ok()
    drawn = np.load(ids)
    y, x = (int(v) for v in np.argwhere(drawn >= 0)[200])
    story = run("verify", teapot.dat, teapot.txt, "--explain", f"{x},{y}", "--numeric", "f32", "--numeric", "fixed_8").ok().stdout
    owner = drawn[y, x]
    for who in ("exact oracle", "end-to-end truth", "f32", "fixed_8"):
        assert re.search(rf"^  {who}.* triangle {owner}$", story, re.MULTILINE), story
    block = story[story.index(f"\ntriangle {owner}"):].split("\n\n")[0]
    exact, single = (re.search(rf"^  {name} +yes +(\S+) +(\S+) +(\S+) +(\S+)$", block, re.MULTILINE) for name in ("exact", "f32"))
    assert exact and single, block
    for a, b in zip(exact.groups(), single.groups()):
        assert float(a) == pytest.approx(float(b), rel=1e-4, abs=1e-4)
    assert "no triangle claims this pixel" in run("verify", teapot.dat, teapot.txt, "--explain", "0,0", "--numeric", "f32").ok().stdout
    assert drawn[0, 0] == -1 and p.width > 0


@pytest.mark.parametrize("arguments, words", [
    (["--numeric", "f23"], ["--numeric", "f23", "f32"]),
    (["--kernel", "tiles"], ["kernel", "tiles"]),
    (["--explain", "1"], ["--explain", "X,Y"]),
    (["--explain", "1,x"], ["--explain", "X,Y"]),
    (["--explain", "97,0"], ["--explain", "97x61"]),
    (["--explain", "0,-1"], ["--explain", "97x61"]),
    (["--explain", "99999999999999,0"], ["--explain", "X,Y"]),
    (["--difference", "d.png"], ["--difference", "one"]),
    (["--difference", "missing/d.png", "--numeric", "f32"], ["missing"]),
    (["--difference", "d.gif", "--numeric", "f32"], ["d.gif"]),
    (["--difference", "d.png", "--numeric", "ray_cast"], ["--difference"]),
    (["--size", "0x5"], ["--size"]),
    (["--fill", "open"], ["--fill"]),
    (["--threads", "0"], ["--threads"]),
    (["--kernel", "ray_cast", "--numeric", "f32"], ["--kernel", "none of these"]),
    (["--numeric", "ray_cast", "--fill", "top-left"], ["--fill"]),
    (["--explain", "1,1", "--json"], ["--explain"]),
    (["--explain", "1,1", "--numeric", "ray_cast"], ["--explain"]),
])
def test_bad_options(arguments: list[str], words: list[str], teapot: SmallScene, tmp_path: Path) -> None:
    refused(run("verify", teapot.dat, teapot.txt, *arguments, cwd=tmp_path), *words)
    assert snapshot(tmp_path) == {}


def test_an_option_that_needs_a_model() -> None:
    refused(run("verify", "--explain", "0,0"), "--explain", "MODEL")


def test_a_table_that_cannot_be_written_is_an_error(teapot: SmallScene) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(command("verify", teapot.dat, teapot.txt, "--numeric", "f32"), stdout=full, stderr=subprocess.PIPE,
                              text=True, timeout=TIMEOUT, env=environment(), check=False)
    assert done.returncode == 1 and "stdout cannot be written" in done.stderr
