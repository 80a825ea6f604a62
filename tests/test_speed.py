"""scripts/speed from its options to its table, on small scenes and with the programs under test in place of the set-up's."""

from __future__ import annotations

import csv
import json
import subprocess
from pathlib import Path

import pytest

from .program import ROOT, TIMEOUT, environment, program, records, run

QUICK = ("--scene", "teapot:triangles=300", "--size", "64x48", "--time-limit", "15")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The checkout by links, with a set-up that has nothing to do: the programs are those under test."""
    folder = tmp_path / "checkout"
    (folder / "scripts").mkdir(parents=True)
    for entry in ROOT.iterdir():
        if entry.name not in ("build", "results", "scripts"):
            (folder / entry.name).symlink_to(entry)
    for script in ("speed", "python"):
        (folder / "scripts" / script).symlink_to(ROOT / "scripts" / script)
    (folder / "scripts/setup").write_text("#!/bin/sh\n")
    (folder / "scripts/setup").chmod(0o755)
    (folder / "build/release").mkdir(parents=True)
    (folder / "build/release/bin").symlink_to(program().parent)
    return folder


def speed(checkout: Path, *options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([checkout / "scripts/speed", *map(str, options)], env=environment(), capture_output=True, text=True,
                          timeout=TIMEOUT, check=False)


def model(folder: Path, name: str) -> None:
    (folder / name).mkdir(parents=True)
    run("scene", "teapot:triangles=300", "-o", folder / name / f"{name}.dat", "--parameters", folder / name / f"{name}.txt").ok()


def test_it_measures_and_prints_the_table(checkout: Path) -> None:
    pytest.importorskip("matplotlib")
    done = speed(checkout, *QUICK)
    assert done.returncode == 0, done.stderr
    found = records(checkout / "results/speed")
    kernels = [r for r in found if r["config"]["kernel"] == "fused_tiles"]
    assert kernels and {r["config"]["fill"] for r in kernels} == {"top-left"} and {r["config"]["numeric"] for r in kernels} == {"fixed_8"}
    assert json.loads((checkout / "results/speed/context.json").read_text())["study"]["sampling"]["launches"] == 3
    assert "fused_tiles, fixed_8, fill top-left, openmp dynamic" in done.stdout and "no class: teapot:triangles=300 64x48" in done.stdout
    with (checkout / "results/speed/speed.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["id"] for row in rows] == [r["id"] for r in kernels]
    for row, r in zip(rows, kernels):
        if r["status"] != "ok":  # avx2 on a CPU that has it not
            assert row["reason"] == r["reason"]
            continue
        assert float(row["kernel_ms"]) == pytest.approx(r["median_ms"]) and float(row["times_floor"]) > 0
        if row["peer_status"] == "ok" and int(row["times_faster_n"]) >= 6:
            assert float(row["times_faster_low"]) <= float(row["times_faster"]) <= float(row["times_faster_high"])
            assert "paired" in row["times_faster_kind"]
        elif row["peer_status"] == "ok":  # a busy machine: the time limit came first
            assert float(row["times_faster"]) > 0 and row["times_faster_low"] == row["times_faster_high"] == ""
        else:
            assert row["times_faster"] == "" and row["peer_reason"]


def test_scenes_of_a_folder_are_added(checkout: Path, tmp_path: Path) -> None:
    model(tmp_path / "models", "city")
    (tmp_path / "models/ldraw_bridge").mkdir()
    (tmp_path / "models/ldraw_bridge/ldraw_bridge.dat.xz").write_bytes(b"")
    done = speed(checkout, "--scenes", tmp_path / "models", "--list")
    assert done.returncode == 0, done.stderr
    own, names = run("study", ROOT / "studies/speed.toml", "--list").ok().stdout.splitlines(), done.stdout.splitlines()
    added = [name for name in names if name not in own]
    assert [name for name in names if name in own] == own and added
    assert {name.split("/")[0] for name in added} == {"city"} and {name.split("/")[1] for name in added} == {"1920x1080"}
    swap = [name.replace("teapot-69k", "city") for name in own if name.startswith("teapot-69k/")]
    assert sorted(added) == sorted(swap)  # on the axes of the others
    shuttle, bridge = done.stderr.splitlines()
    assert "ldraw_shuttle.dat" in shuttle and "left out" in shuttle and "only ldraw_bridge.dat.xz is there: xz -dk" in bridge


@pytest.mark.parametrize("options, word", [(("--scenes", "nowhere"), "no such folder"), (("--scenes", "scripts"), "none of the scenes"),
                                           (("--scenes",), "needs a folder"), (("--size", "0x0"), "--size")])
def test_bad_options_are_refused(checkout: Path, options: tuple[str, ...], word: str) -> None:
    absolute = [str(checkout / o) if o == "scripts" else o for o in options]
    done = speed(checkout, *absolute)
    assert done.returncode == 2 and word in done.stderr.splitlines()[-1]
    assert not (checkout / "results").exists()
