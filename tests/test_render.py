"""`rasterbench render` and `graphics`: pictures, ids and depths, checked against files of each other and a second pipeline."""

from __future__ import annotations

import itertools
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from . import course_pipeline
from .conftest import SmallScene
from .program import ROOT, Parameters, read_png, read_ppm, refused, run, write_dat

STEP = 2.0**-24  # of a depth
NUMERICS = ("f32", "f64", "fixed_8")
SCENES = ROOT.parent / "shared/scenes"


def listed(what: str) -> list[dict[str, Any]]:
    return json.loads(run("list", what, "--json").ok().stdout)


def render(scene: SmallScene, folder: Path, *options: object) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Colours, ids and depths."""
    run("render", scene.dat, scene.txt, "-o", folder / "image.ppm", "--ids", folder / "ids.npy", "--depth", folder / "depth.npy",
        *options).ok()
    return read_ppm(folder / "image.ppm"), np.load(folder / "ids.npy"), np.load(folder / "depth.npy")


def test_arrays_have_the_documented_form(teapot: SmallScene, tmp_path: Path) -> None:
    image, ids, depths = render(teapot, tmp_path)
    p = teapot.parameters
    assert image.shape == (p.height, p.width, 3)
    assert ids.shape == depths.shape == (p.height, p.width)
    assert ids.dtype == np.dtype("<i4") and depths.dtype == np.dtype("<f4")
    assert np.array_equal(ids == -1, depths == 1)
    assert ids.min() == -1 and ids.max() < len(teapot.triangles)
    assert 0.1 < np.mean(ids >= 0) < 0.9  # otherwise this scene tests little
    assert depths.min() >= -1
    assert np.all(image[ids == -1] == p.background)


def test_png_holds_the_pixels_of_the_ppm(teapot: SmallScene, tmp_path: Path) -> None:
    image, _, _ = render(teapot, tmp_path)
    run("render", teapot.dat, teapot.txt, "-o", tmp_path / "image.png").ok()
    assert np.array_equal(read_png(tmp_path / "image.png"), image)


@pytest.mark.parametrize("scene", ["teapot", "crossing"])
def test_colours_are_the_flat_shade_of_the_visible_triangle(scene: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    drawn: SmallScene = request.getfixturevalue(scene)
    image, ids, _ = render(drawn, tmp_path)
    expected = course_pipeline.colours(ids, drawn.triangles, drawn.parameters)
    difference = np.abs(image.astype(int) - expected.astype(int)).max(axis=2)
    assert difference.max() <= 1  # s C may lie on an integer, to the last bit
    assert np.mean(difference != 0) < 0.001
    assert len(np.unique(image[ids >= 0], axis=0)) > 10


@pytest.mark.parametrize("numeric", NUMERICS)
@pytest.mark.parametrize("scene", ["teapot", "crossing"])
def test_ids_and_depths_are_those_of_a_second_pipeline(scene: str, numeric: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    drawn: SmallScene = request.getfixturevalue(scene)
    _, ids, depths = render(drawn, tmp_path, "--numeric", numeric)
    expected = course_pipeline.draw(drawn.triangles, drawn.parameters)
    # A centre is misjudged only this close to an edge (pixels). Corners far outside the picture are rounded to 2^-7 px in f32
    # and all corners are moved in fixed_8, and their depths with them.
    tolerance = {"f32": 1e-4, "f64": 1e-10, "fixed_8": 0.75 / 256}[numeric]
    gap = {"f32": 1e-4, "f64": STEP, "fixed_8": 2e-3}[numeric]
    assert not course_pipeline.unexplained(expected, ids, depths, tolerance, gap)
    assert np.count_nonzero(expected.ids != ids) <= (12 if numeric == "fixed_8" else 2)
    same = (expected.ids == ids) & (ids >= 0)
    assert np.count_nonzero(same) > 1000
    error = np.abs(depths[same] - expected.depths[same])
    assert error.max() <= gap
    assert numeric == "fixed_8" or np.median(error) <= 4 * STEP


def test_the_crossing_scene_crosses(crossing: SmallScene, tmp_path: Path) -> None:
    """Guards the tests above: without a triangle on the near plane they would say nothing of clipping."""
    w = np.stack([course_pipeline.view(t, crossing.parameters.camera)[:, 2] for t in crossing.triangles])
    inside = -w > crossing.parameters.near
    crosses = inside.any(axis=1) & ~inside.all(axis=1)
    _, ids, depths = render(crossing, tmp_path)
    assert crosses.sum() > 20
    assert np.isin(ids, np.flatnonzero(crosses)).mean() > 0.2
    assert "cut at the near plane" in run("render", crossing.dat, crossing.txt, "--ids", tmp_path / "x.npy").ok().stdout


def executions() -> list[list[str]]:
    """Options of a few executions: serial, and of each backend a schedule with and without a chunk, on one and on two threads."""
    chosen = [["--backend", "serial"]]
    for schedule in listed("schedules"):
        backend, _, kind = schedule["name"].partition(":")
        if kind in ("dynamic", "guided", "auto"):
            chosen += [["--backend", backend, "--schedule", kind + (",3" if kind == "guided" else ""), "--threads", "2", "--oversubscribe"]]
    return chosen


@pytest.mark.parametrize("fill", ["closed", "top-left"])
@pytest.mark.parametrize("numeric", NUMERICS)
def test_every_kernel_and_execution_draws_the_same_bits(fill: str, numeric: str, crossing: SmallScene, tmp_path: Path) -> None:
    kernels = [kernel["name"] for kernel in listed("kernels") if numeric in kernel["numerics"]]
    assert len(kernels) >= 7
    pictures: dict[str, bytes] = {}
    for number, (kernel, execution) in enumerate(itertools.product(kernels, executions())):
        tile = ["--tile", 16] if kernel == "tile_parallel" and number % 2 else []
        render(crossing, tmp_path, "--kernel", kernel, "--numeric", numeric, "--fill", fill, *execution, *tile)
        pictures[f"{kernel} {execution}"] = b"".join((tmp_path / f).read_bytes() for f in ("ids.npy", "depth.npy", "image.ppm"))
    first = next(iter(pictures))
    different = [label for label, picture in pictures.items() if picture != pictures[first]]
    assert not different, f"differ from {first}"


@pytest.mark.parametrize("kernel, numeric", [("tile_simd", "fixed_8"), ("tile_parallel", "fixed_8"), ("bounding_box", "f64")])
def test_every_instruction_set_draws_the_same_bits(kernel: str, numeric: str, crossing: SmallScene, tmp_path: Path) -> None:
    pictures = {}
    for isa in listed("isas"):
        options = ("--kernel", kernel, "--numeric", numeric, "--isa", isa["name"], "--fill", "top-left", "--size", "201x77")
        if isa["available"]:
            render(crossing, tmp_path, *options)
            pictures[isa["name"]] = b"".join((tmp_path / f).read_bytes() for f in ("ids.npy", "depth.npy", "image.ppm"))
        else:
            refused(run("render", crossing.dat, *options), "--isa", isa["name"])
    assert "baseline" in pictures and len(set(pictures.values())) == 1
    assert [isa["name"] for isa in listed("isas") if isa["best"]] == [list(pictures)[-1]]


@pytest.mark.parametrize("kernel", ["fused_tiles", "tile_simd", "scanline"])
def test_every_technique_draws_the_same_bits(kernel: str, crossing: SmallScene, tmp_path: Path) -> None:
    names = [technique["name"] for technique in listed("techniques")]
    pictures = {}
    for techniques in ["all", "none", *names, *(f"all-{name}" for name in names), "+".join(names[::-1])]:
        # The rows of an odd width begin anywhere between two vectors.
        render(crossing, tmp_path, "--kernel", kernel, "--numeric", "fixed_8", "--size", "1031x77", "--techniques", techniques)
        pictures[techniques] = b"".join((tmp_path / f).read_bytes() for f in ("ids.npy", "depth.npy", "image.ppm"))
    assert len(set(pictures.values())) == 1


@pytest.mark.parametrize("command", ["render", "verify", "explain"])
@pytest.mark.parametrize("techniques, words", [("streeming", ["did you mean 'streaming'"]), ("all-", ["unknown technique ''"]), ("", ["unknown technique ''"]),
                                               ("all+streaming", ["'all' stands alone"]), ("streaming,huge_pages", ["unknown technique"])])
def test_bad_techniques(command: str, techniques: str, words: list[str]) -> None:
    refused(run(command, "teapot:triangles=300", "--techniques", techniques), "--techniques: ", *words)


def test_verify_takes_techniques() -> None:
    for techniques in ("none", "all"):
        assert " FAILED" not in run("verify", "teapot:triangles=300", "--size", "64x48", "--kernel", "fused_tiles", "--numeric", "fixed_8",
                                    "--techniques", techniques).ok().stdout


def test_options_change_the_picture(crossing: SmallScene, tmp_path: Path) -> None:
    """Otherwise equal bits above would be a sign of options that are not read."""
    _, closed, plain = render(crossing, tmp_path)
    _, _, fixed = render(crossing, tmp_path, "--numeric", "fixed_8")
    _, culled, _ = render(crossing, tmp_path, "--cull", "back")
    _, unclipped, _ = render(crossing, tmp_path, "--near", "off")
    image, _, _ = render(crossing, tmp_path, "--size", "50x20")
    assert not np.array_equal(plain, fixed)
    assert not np.array_equal(closed, culled)
    assert not np.array_equal(closed, unclipped)
    assert image.shape == (20, 50, 3)


def test_ties_go_to_the_first_or_the_last(tmp_path: Path) -> None:
    wall = [[-9, -9, 0, 9, -9, 0, 0, 9, 0]]
    scene = SmallScene(write_dat(tmp_path / "m.dat", wall * 3), Parameters(camera=(0, 0, 4)).write(tmp_path / "m.txt"),
                       np.zeros(0), Parameters())
    for tie, winner in (("first", 0), ("last", 2)):
        _, ids, _ = render(scene, tmp_path, "--tie", tie)
        assert np.all(ids[24, 20:40] == winner)


def test_edges_belong_to_one_side_in_top_left(tmp_path: Path) -> None:
    """Two triangles share the diagonal of a square; their other sides lie far outside the picture."""
    a, b, c, d = [-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]
    p = Parameters(camera=(0, 0, 4), width=64, height=64)
    scene = SmallScene(write_dat(tmp_path / "m.dat", a + b + c + a + c + d), p.write(tmp_path / "m.txt"), np.zeros(0), p)
    diagonal = np.arange(64), 63 - np.arange(64)
    _, closed, _ = render(scene, tmp_path)
    _, last, _ = render(scene, tmp_path, "--tie", "last")
    assert closed.min() == 0 and np.all(closed[diagonal] == 0) and np.all(last[diagonal] == 1)
    _, first, _ = render(scene, tmp_path, "--fill", "top-left")
    _, last, _ = render(scene, tmp_path, "--fill", "top-left", "--tie", "last")
    assert first.min() == 0 and np.array_equal(first, last)


def test_default_output_is_named_after_the_model(teapot: SmallScene, tmp_path: Path) -> None:
    run("render", teapot.dat, teapot.txt, cwd=tmp_path).ok()
    assert os.listdir(tmp_path) == ["small.png"]
    run("render", "teapot:triangles=300", "--size", "32x20", cwd=tmp_path).ok()
    assert sorted(os.listdir(tmp_path)) == ["small.png", "teapot.png"]
    assert read_png(tmp_path / "teapot.png").shape == (20, 32, 3)


def test_only_what_is_asked_for_is_written(teapot: SmallScene, tmp_path: Path) -> None:
    outcome = run("render", teapot.dat, teapot.txt, "--ids", "ids.npy", "--frames", 3, cwd=tmp_path).ok()
    assert os.listdir(tmp_path) == ["ids.npy"]
    assert "wrote ids.npy" in outcome.stdout and "median of 3" in outcome.stdout and outcome.stderr == ""


def test_graphics_draws_what_render_draws(teapot: SmallScene, tmp_path: Path) -> None:
    outcome = run(teapot.dat, teapot.txt, name="graphics", cwd=tmp_path).ok()
    assert outcome.stdout == outcome.stderr == ""
    assert os.listdir(tmp_path) == ["small.ppm"]
    run(teapot.dat, teapot.txt, "named.ppm", name="graphics", cwd=tmp_path).ok()
    run("render", teapot.dat, teapot.txt, "-o", "rendered.ppm", cwd=tmp_path).ok()
    assert (tmp_path / "small.ppm").read_bytes() == (tmp_path / "named.ppm").read_bytes() == (tmp_path / "rendered.ppm").read_bytes()


def test_a_picture_replaces_the_one_before(teapot: SmallScene, tmp_path: Path) -> None:
    for size in ("40x30", "20x10"):
        run("render", teapot.dat, teapot.txt, "--size", size, "-o", tmp_path / "image.ppm").ok()
    assert read_ppm(tmp_path / "image.ppm").shape == (10, 20, 3)
    assert os.listdir(tmp_path) == ["image.ppm"]


def test_an_empty_model_is_a_background(tmp_path: Path) -> None:
    dat, txt = write_dat(tmp_path / "m.dat", []), Parameters().write(tmp_path / "m.txt")
    scene = SmallScene(dat, txt, np.zeros(0), Parameters())
    image, ids, depths = render(scene, tmp_path)
    assert np.all(image == Parameters().background) and np.all(ids == -1) and np.all(depths == 1)


def test_bytes_left_over_are_a_warning(tmp_path: Path) -> None:
    dat = write_dat(tmp_path / "m.dat", [[0] * 9] * 3, count=2)
    outcome = run("render", dat, Parameters().write(tmp_path / "m.txt"), "-o", tmp_path / "m.ppm").ok()
    assert len(outcome.errors) == 1
    assert all(word in outcome.stderr for word in ("warning", str(dat), "2 triangles", "holds 3"))


def test_corners_that_are_not_finite_are_left_out_and_counted(tmp_path: Path) -> None:
    wall = [-9.0, -9, 0, 9, -9, 0, 0, 9, 0]
    dat = write_dat(tmp_path / "m.dat", [[*wall[:4], np.nan, *wall[5:]], [*wall[:8], np.inf], wall, [1.0] * 9])
    scene = SmallScene(dat, Parameters(camera=(0, 0, 4)).write(tmp_path / "m.txt"), np.zeros(0), Parameters())
    _, ids, _ = render(scene, tmp_path)
    assert set(np.unique(ids)) <= {-1, 2} and ids[24, 32] == 2
    told = run("render", dat, scene.txt, "--ids", tmp_path / "x.npy").ok().stdout
    assert "2 with a coordinate that is not finite" in told and "1 without area" in told


def scene_file(path: str) -> Path:
    found = SCENES / path
    if not found.exists():
        pytest.skip(f"{found} is absent: the collection of real scenes is not part of the project")
    return found


@pytest.mark.parametrize("folder, name", [("teapot", "teapot_43k"), ("ldraw_racer", "ldraw_racer")])
def test_real_models(folder: str, name: str, tmp_path: Path) -> None:
    manifest = json.loads(scene_file("manifest.json").read_text())[name]
    dat, txt = scene_file(f"{folder}/{name}.dat"), scene_file(f"{folder}/{name}.txt")
    scene = SmallScene(dat, txt, np.zeros(0), Parameters())
    tiles = render(scene, tmp_path, "--kernel", "tile_parallel", "--size", "1920x1080")
    atomics = render(scene, tmp_path, "--kernel", "triangle_atomics", "--size", "1920x1080")
    assert all(a.tobytes() == b.tobytes() for a, b in zip(tiles, atomics))
    assert abs(np.mean(tiles[1] >= 0) - manifest["cameras"][f"{name}.txt"]["covered"]) <= 0.001
