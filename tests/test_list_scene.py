"""`list` says what there is to choose from, and all of it can be chosen; `scene` writes what generators draw."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .program import CPUS, ROOT, read_dat, read_parameters, run

WORDS = ["kernels", "numerics", "backends", "schedules", "isas", "techniques", "scenes", "studies"]
KERNELS = {"all_pixels", "bounding_box", "triangle_locks", "triangle_atomics", "triangle_private", "row_parallel", "tile_parallel", "scanline"}
GENERATORS = ["teapot:triangles=500", "terrain:triangles=800,seed=3", "confetti:triangles=300,distribution=heavy,seed=2",
              "layers:triangles=200,depth=3,order=random"]


def listed(word: str) -> list[dict[str, Any]]:
    outcome = run("list", word, "--json").ok()
    assert outcome.stderr == ""
    return json.loads(outcome.stdout)


@pytest.mark.parametrize("word", WORDS)
def test_json_is_an_array_of_objects_with_a_name(word: str) -> None:
    entries = listed(word)
    assert isinstance(entries, list) and entries
    names = [entry["name"] for entry in entries]
    assert all(isinstance(name, str) and name for name in names) and len(set(names)) == len(names)


@pytest.mark.parametrize("word", WORDS)
def test_plain_list_shows_the_same_names(word: str) -> None:
    lines = run("list", word).ok().stdout.splitlines()
    assert [line for line in lines if not line.startswith(" ")] == [entry["name"] for entry in listed(word)]


def test_kernels() -> None:
    kernels = {k["name"]: k for k in listed("kernels")}
    assert KERNELS <= set(kernels) and "null" not in kernels
    for k in kernels.values():
        assert k["parallel_unit"] and k["synchronisation"] and k["work"] and k["numerics"]
    assert "f64" not in kernels["triangle_atomics"]["numerics"] and "64-bit" in kernels["triangle_atomics"]["not_in"]["f64"]


def test_techniques_say_who_has_them() -> None:
    techniques = {t["name"]: t for t in listed("techniques")}
    assert list(techniques) == ["fragments", "blocks", "front_to_back", "streaming", "huge_pages"] and all(t["meaning"] for t in techniques.values())
    assert techniques["fragments"]["kernels"] == techniques["front_to_back"]["kernels"] == ["fused_tiles"]
    assert set(techniques["streaming"]["kernels"]) == set(techniques["huge_pages"]["kernels"]) >= KERNELS | {"fused_tiles"}
    has = {k["name"]: k["techniques"] for k in listed("kernels")}
    assert has["fused_tiles"] == "all" and all(has[kernel] == "streaming+huge_pages" for kernel in KERNELS) and has.get("ray_cast", "none") == "none"


def test_numerics_state_their_arithmetic_and_bound() -> None:
    numerics = listed("numerics")
    assert {"f32", "f64", "fixed_8"} <= {n["name"] for n in numerics}
    assert all(n[key] for n in numerics for key in ("vertices", "edges", "depth", "bound"))


def test_backends_say_whether_they_can_be_used() -> None:
    backends = {b["name"]: b for b in listed("backends")}
    assert set(backends) == {"serial", "openmp", "tbb"} and all(isinstance(b["available"], bool) for b in backends.values())
    assert backends["serial"]["available"] and backends["openmp"]["runtime"].startswith("lib")


def test_every_schedule_can_be_used(tmp_path: Path) -> None:
    schedules = listed("schedules")
    assert {"openmp:static", "openmp:dynamic", "openmp:guided", "openmp:auto"} <= {s["name"] for s in schedules}
    for s in schedules:
        backend, _, kind = s["name"].partition(":")
        for chunk in ("", ",2") if s["chunk"] else ("",):
            options = ["--schedule", kind + chunk] if kind else []
            told = run("render", "teapot:triangles=300", "--size", "20x20", "--ids", tmp_path / "x.npy", "--backend", backend, *options).ok().stdout
            assert f" {s['name']}{chunk} " in told


def test_threads_follow_omp_num_threads(tmp_path: Path) -> None:
    arguments = ["render", "teapot:triangles=300", "--size", "20x20", "--ids", tmp_path / "x.npy"]
    assert "on 1 thread:" in run(*arguments, OMP_NUM_THREADS="1").ok().stdout
    assert f"on {CPUS} thread" in run(*arguments).ok().stdout


def test_every_study_of_the_list_can_be_planned() -> None:
    studies = listed("studies")
    if not studies:  # programs copied out of a build folder know no studies
        pytest.skip("these programs lie in no build folder of a checkout")
    assert {s["name"] for s in studies} == {path.stem for path in (ROOT / "studies").glob("*.toml")}
    for s in studies:
        size = [] if s["name"] == "weak" else ["--size", "64x48"]  # that one grows with the threads
        outcome = run("study", s["file"], "--dry-run", *size, "--filter", "teapot").ok()
        assert f"{s['name']}: " in outcome.stdout


def test_every_generator_draws_something_by_default(tmp_path: Path) -> None:
    generators = listed("scenes")
    assert {"teapot", "terrain", "confetti", "layers"} <= {g["name"] for g in generators}
    for g in generators:
        for key in g["keys"]:
            assert key["meaning"] and ("words" in key) != ("range" in key)
            assert key["default"] in key["words"] if "words" in key else key["range"][0] <= key["default"] <= key["range"][1]
        run("render", g["name"], "--size", "80x60", "--ids", tmp_path / "x.npy").ok()
        assert np.mean(np.load(tmp_path / "x.npy") >= 0) > 0.05, g["name"]


@pytest.mark.parametrize("specification", GENERATORS)
def test_a_written_scene_is_the_generated_one(specification: str, tmp_path: Path) -> None:
    dat, txt = tmp_path / "m.dat", tmp_path / "m.txt"
    told = run("scene", specification, "-o", dat, "--parameters", txt).ok().stdout
    triangles = read_dat(dat)
    assert np.isfinite(triangles).all() and f"{len(triangles)} triangles" in told
    p = read_parameters(txt)
    size = ["--size", "160x90"]
    for arguments, name in (([specification, *size], "direct"), ([dat, txt, *size], "file")):
        run("render", *arguments, "--ids", tmp_path / f"{name}.npy", "--depth", tmp_path / f"{name}.depth.npy", "-o", tmp_path / f"{name}.ppm").ok()
    for end in (".npy", ".depth.npy", ".ppm"):
        assert (tmp_path / f"direct{end}").read_bytes() == (tmp_path / f"file{end}").read_bytes()
    assert (np.load(tmp_path / "direct.npy") >= 0).any() and (p.width, p.height) == (1920, 1080)


@pytest.mark.parametrize("specification", GENERATORS)
def test_a_generator_always_makes_the_same_bytes(specification: str, tmp_path: Path) -> None:
    for name in ("a", "b"):
        run("scene", specification, "-o", tmp_path / f"{name}.dat", "--parameters", tmp_path / f"{name}.txt").ok()
    assert (tmp_path / "a.dat").read_bytes() == (tmp_path / "b.dat").read_bytes()
    assert (tmp_path / "a.txt").read_bytes() == (tmp_path / "b.txt").read_bytes()


@pytest.mark.parametrize("first, second", [("terrain:triangles=800,seed=1", "terrain:triangles=800,seed=2"),
                                           ("confetti:triangles=300,size=5", "confetti:triangles=300,size=50"),
                                           ("layers:triangles=200,order=front-to-back", "layers:triangles=200,order=back-to-front")])
def test_keys_change_the_model(first: str, second: str, tmp_path: Path) -> None:
    for name, specification in (("a", first), ("b", second)):
        run("scene", specification, "-o", tmp_path / f"{name}.dat").ok()
    assert (tmp_path / "a.dat").stat().st_size == (tmp_path / "b.dat").stat().st_size
    assert (tmp_path / "a.dat").read_bytes() != (tmp_path / "b.dat").read_bytes()


@pytest.mark.parametrize("specification, count", [("confetti:triangles=1", 1), ("confetti:triangles=2e3", 2000), ("terrain:triangles=2", 2)])
def test_number_of_triangles(specification: str, count: int, tmp_path: Path) -> None:
    run("scene", specification, "-o", tmp_path / "m.dat").ok()
    assert len(read_dat(tmp_path / "m.dat")) == count
