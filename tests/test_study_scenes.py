"""Scenes of a study: given on the command line, beside its file, by name."""

from __future__ import annotations

from pathlib import Path

from .program import run, sampling, sweep
from .studies import Study


def test_study_runs_on_other_scenes_and_sizes(tmp_path: Path) -> None:
    run("scene", "terrain:triangles=500", "-o", tmp_path / "land.dat", "--parameters", tmp_path / "view.txt").ok()
    study = Study(tmp_path, sampling(), sweep(), options=("--scene", f"{tmp_path}/land.dat@{tmp_path}/view.txt", "--size", "50x40", "--size", "40x30"))
    assert [(r["config"]["scene"], r["config"]["size"]) for r in study.records] == [("land@view", [50, 40]), ("land@view", [40, 30])]


def test_models_lie_beside_the_study_file(tmp_path: Path) -> None:
    for name in ("land", "view"):
        run("scene", "terrain:triangles=500", "-o", tmp_path / f"{name}.dat", "--parameters", tmp_path / f"{name}.txt").ok()
    study = Study(tmp_path, sampling(), sweep(scene=["land.dat@land.txt", "land.dat@view.txt", "view.dat"]))
    assert [r["config"]["scene"] for r in study.records] == ["land", "land@view", "view"]
    assert len({r["config"]["scene_hash"] for r in study.where(scene="land") + study.where(scene="land@view")}) == 1


def test_named_scenes_have_a_picture_each(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(), '[[sweep]]\nsize = "64x48"\nkernel = "tile_parallel"\nexecution = "serial"\n'
                  'scene = [{name = "a b", model = "teapot:triangles=300"}, {name = "a_b", model = "terrain:triangles=500"}]')
    images = study.context["images"]
    assert set(images) == {"a b", "a_b"} == {r["config"]["scene"] for r in study.records}
    assert (study.folder / images["a b"]).read_bytes() != (study.folder / images["a_b"]).read_bytes()
