"""scripts/compilers through its command line; given programs stand in for builds, which would take minutes."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from .program import ROOT, TIMEOUT, environment, program, records, run, sampling, sweep, write_study
from .test_compare_lint import analysis

SCRIPT = ROOT / "scripts/compilers"
NAMES = [f"{family}-{flags}" for family in ("gcc", "clang") for flags in ("O0", "O1", "O2", "O3", "O3-native", "Ofast")]
ROUNDS = 2  # without intervals, which compilers_test.py has


def compilers(*arguments: object, script: Path = SCRIPT, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(script), *map(str, arguments)], env=environment(**variables), capture_output=True, text=True, timeout=TIMEOUT,
                          check=False)


def refused(done: subprocess.CompletedProcess[str], *words: str) -> None:
    assert done.returncode == 2 and done.stdout == "", done.stdout
    (line,) = done.stderr.splitlines()
    assert line.startswith("scripts/compilers: ") and all(word in line for word in words), line


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_study(tmp_path_factory.mktemp("study") / "small.toml", 'name = "small"', sampling(6),
                       sweep("tile_parallel", ["serial", "openmp:static"], threads=[1], numeric="f32", fill="top-left"),
                       sweep("triangle_atomics", "serial", numeric="f32", fill="top-left"), sweep("tile_simd", "serial", numeric="fixed_8", tile=[32]))


def wrapper(path: Path, body: str) -> Path:
    """A program around the one under test, "$rasterbench" in `body`."""
    path.write_text(f"#!/bin/bash\nrasterbench={program()}\n{body}\n")
    path.chmod(0o755)
    return path


# One that takes every name to be that of another mode when it renders: its pictures are not those of its records.
LIAR = '[ "$1" = render ] && set -- "${@/#f32/fixed_4}"\nexec "$rasterbench" "$@"'
# One that says of itself what a program compiled with -ffast-math says.
FAST = '''"$rasterbench" "$@" || exit
while [ $# -gt 0 ]; do [ "$1" = --out ] && out=$2; shift; done
[ -z "${out:-}" ] || sed -i 's/"fast_math": false/"fast_math": true/' "$out/context.json"
[ -z "${out:-}" ] || sed -i 's/"conforms":true/"conforms":null/' "$out/records.jsonl"'''
BROKEN = '[ "$1" = --list ] || { echo "cannot be loaded" >&2; exit 3; }'


@pytest.fixture(scope="module")
def ran(study: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """The program under test twice, beside three that are not what they should be."""
    folder = tmp_path_factory.mktemp("ran")
    given = {"one": program(), "two": program(), "liar": wrapper(folder / "liar", LIAR), "fast": wrapper(folder / "fast", FAST),
             "broken": wrapper(folder / "broken", BROKEN)}
    done = compilers(*(f"--program={name}={path}" for name, path in given.items()), "--study", study, "--out", folder / "out",
                     "--rounds", ROUNDS, "--base", "one")
    return folder / "out", done


def table(folder: Path) -> list[dict[str, str]]:
    with (folder / "compilers.csv").open() as file:
        return list(csv.DictReader(file))


def plan(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "compilers.json").read_text())


def test_every_configuration_is_planned() -> None:
    done = compilers("--dry-run")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines[:len(NAMES)]] == NAMES
    for name, line in zip(NAMES, lines):
        said = re.fullmatch(r"(\S+) +(\S+) (-O.*), in build/compilers/(\S+)(  skipped: .* is not installed)?", line)
        assert said and said[1] == said[4] == name and said[2] == {"gcc": "g++", "clang": "clang++"}[name.split("-")[0]], line
        assert name.endswith("native") == ("-march=native" in said[3]) and ("Ofast" in name) == ("-Ofast" in said[3])
    orders = [line.split(": ")[1].split(", ") for line in lines if re.match(r"  \d+: ", line)]
    assert len(orders) == 7 and all(sorted(order) == sorted(orders[0]) for order in orders), "each program once in each round"
    assert len(set(map(tuple, orders))) > 1, "in another order"
    assert compilers("--dry-run").stdout == done.stdout and compilers("--dry-run", "--seed", "2").stdout != done.stdout


def test_a_dry_run_shows_the_points_and_builds_nothing(study: Path, tmp_path: Path) -> None:
    before = sorted((ROOT / "build").iterdir())
    done = compilers("--dry-run", "--program", f"mine={program()}", "--study", study, "--filter", "atomics", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "triangle_atomics" in done.stdout and "tile_simd" not in done.stdout and "g++" not in done.stdout
    assert not (tmp_path / "out").exists() and sorted((ROOT / "build").iterdir()) == before


def test_configurations_are_chosen_by_name() -> None:
    lines = compilers("--dry-run", "--configurations", r"gcc-O[02]$", "--rounds", "1").stdout.splitlines()
    assert [line.split()[0] for line in lines[:2]] == ["gcc-O0", "gcc-O2"] and lines[2].startswith("base gcc-O2; 1 rounds")


def checkout(folder: Path) -> Path:
    """The script in a checkout of links, so that what it builds lies elsewhere."""
    (folder / "scripts").mkdir(parents=True)
    for entry in ROOT.iterdir():
        if entry.name not in ("build", "results", "scripts"):
            (folder / entry.name).symlink_to(entry)
    (folder / "scripts/python").symlink_to(ROOT / "scripts/python")
    return Path(shutil.copy(SCRIPT, folder / "scripts/compilers"))


def only(folder: Path, *commands: str) -> str:
    """A PATH with these commands alone."""
    folder.mkdir()
    for command in commands:
        found = sys.executable if command == "python3" else shutil.which(command)
        assert found
        (folder / command).symlink_to(found)
    return str(folder)


def test_a_compiler_that_is_not_installed_is_skipped_with_the_reason(study: Path, tmp_path: Path) -> None:
    path = only(tmp_path / "bin", "python3", "env", "bash", "dirname")
    done = compilers("--program", f"mine={program()}", "--configurations", "clang-O2", "--study", study, "--out", tmp_path / "out", "--rounds", "1",
                     "--filter", "atomics", script=checkout(tmp_path / "checkout"), PATH=path, RASTERBENCH_PYTHON="/usr/bin/python3")
    assert done.returncode == 0, done.stderr
    assert {row["reason"] for row in table(tmp_path / "out") if row["configuration"] == "clang-O2"} == {"skipped: clang++ is not installed"}


def test_no_compiler_at_all(tmp_path: Path) -> None:
    done = compilers("--configurations", "clang", "--dry-run", PATH=only(tmp_path / "bin", "python3", "env"))
    assert done.returncode == 2 and done.stdout.count("clang++ is not installed") == 6
    assert done.stderr == "scripts/compilers: no configuration is left: none of the compilers is installed\n"


def test_what_does_not_build_stands_in_the_table(study: Path, tmp_path: Path) -> None:
    fake = tmp_path / "fake"
    fake.mkdir()
    (fake / "clang++").write_text("#!/bin/sh\necho 'error: no such luck' >&2\nexit 1\n")
    (fake / "clang++").chmod(0o755)
    done = compilers("--program", f"mine={program()}", "--configurations", "clang-O1", "--study", study, "--out", tmp_path / "out", "--rounds", "1",
                     "--filter", "atomics", script=checkout(tmp_path / "checkout"), PATH=f"{fake}:{os.environ['PATH']}")
    assert done.returncode == 1, done.stderr
    (reason,) = {row["reason"] for row in table(tmp_path / "out") if row["configuration"] == "clang-O1"}
    assert reason.startswith("failed: does not build (") and "clang-O1/build.log" in reason


def test_the_reason_is_the_first_error_and_not_a_file_of_that_name(tmp_path: Path) -> None:
    fake = tmp_path / "fake"
    fake.mkdir()
    (fake / "cmake").write_text("#!/bin/sh\n[ \"$1\" = --build ] || exit 0\n"
                                "echo '[1/2] Building CXX object base/error.cpp.o'; echo 'a.cpp:3:1: error: no such luck'; exit 1\n")
    (fake / "cmake").chmod(0o755)
    done = compilers("--configurations", "gcc-O1", "--build-only", script=checkout(tmp_path / "checkout"), PATH=f"{fake}:{os.environ['PATH']}")
    assert done.returncode == 1 and done.stdout.endswith("build.log): a.cpp:3:1: error: no such luck\n"), done.stdout


@pytest.mark.parametrize("arguments, words", [
    (["--bogus"], ["--bogus"]),
    (["--rounds", "0"], ["--rounds", "0"]),
    (["--rounds", "many"], ["--rounds", "many"]),
    (["--configurations", "icc"], ["--configurations", "icc", "gcc-O0"]),
    (["--configurations", "("], ["--configurations", "regular expression"]),
    (["--program", "no-equals"], ["--program", "NAME=PATH"]),
    (["--program", "../a=x"], ["--program", "NAME=PATH"]),
    (["--program", "a=/nowhere/rasterbench"], ["--program", "/nowhere/rasterbench"]),
    (["--base", "icc"], ["--base", "icc"]),
    (["--study", "none.toml"], ["--study", "none.toml"]),
    (["--out", str(ROOT / "README.md")], ["--out", "README.md"]),
], ids=lambda value: " ".join(value) if isinstance(value, list) else "")
def test_bad_options(arguments: list[str], words: list[str]) -> None:
    refused(compilers(*arguments, "--dry-run"), *words)


def test_two_programs_of_one_name() -> None:
    refused(compilers(f"--program=a={program()}", f"--program=a={program()}", "--dry-run"), "a")


def test_what_the_study_refuses_is_refused_before_anything_is_moved(study: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/mine").write_text("kept")
    refused(compilers(f"--program=a={program()}", "--study", study, "--out", tmp_path / "out", "--size", "0x0"), "--size")
    assert [p.name for p in tmp_path.iterdir()] == ["out"] and (tmp_path / "out/mine").read_text() == "kept"


def test_rounds_are_launches_of_one_study(ran: tuple[Path, Any]) -> None:
    """Each launch has a folder; together they are a study that every other command reads."""
    folder, done = ran
    assert done.returncode == 1, done.stderr  # of the liar and the broken one
    assert plan(folder)["judge"] == "one"
    for name in ("one", "two"):
        merged = records(folder / name)
        single = [records(folder / name / f"round_{number + 1}") for number in range(ROUNDS)]
        assert len(merged) == 4
        for i, r in enumerate(merged):
            assert r["status"] == "ok" and r["samples_ms"] == [t for launch in single for t in launch[i]["samples_ms"]]
            assert r["launches"] == [n for n in range(ROUNDS) for _ in range(6)] and len(set(r["blocks"])) == 6 * ROUNDS
            assert r["interval_ms"][0] <= r["median_ms"] <= r["interval_ms"][1] and r["min_ms"] == min(r["samples_ms"])
        assert analysis("table", folder / name).code == 0
        assert analysis("lint", folder / name).code in (0, 1)


def test_rounds_are_interleaved(ran: tuple[Path, Any]) -> None:
    folder, _ = ran
    order = plan(folder)["order"]
    assert len(order) == ROUNDS and all({"one", "two", "liar", "fast"} <= set(names) for names in order)
    started = {(name, number + 1): json.loads((folder / name / f"round_{number + 1}/context.json").read_text())["started"]
               for number in range(ROUNDS) for name in ("one", "two")}
    assert max(started["one", 1], started["two", 1]) <= min(started["one", ROUNDS], started["two", ROUNDS])


def test_who_shows_a_speed(ran: tuple[Path, Any]) -> None:
    folder, _ = ran
    rows = {(row["kernel"], row["configuration"]): row for row in table(folder) if row["execution"] == "serial"}
    for name in ("one", "two"):
        assert rows["tile_parallel", name]["conforms"] == "True" and float(rows["tile_parallel", name]["median_ms"]) > 0
        assert rows["tile_parallel", name]["rounds"] == str(ROUNDS)
    assert float(rows["tile_parallel", "two"]["time_over_base"]) > 0 and not rows["tile_parallel", "one"]["time_over_base"]
    liar, fast, broken = (rows["tile_parallel", name] for name in ("liar", "fast", "broken"))
    assert liar["median_ms"] == "" and "pixels differ from the specification of one" in liar["reason"] and int(liar["differing_pixels"]) > 0
    assert float(rows["tile_simd", "liar"]["median_ms"]) > 0, "of the mode that it does not lie about"
    assert float(fast["median_ms"]) > 0 and fast["fast_math"] == "True"
    assert broken["reason"].startswith("failed: ") and "cannot be loaded" in broken["reason"]


def test_fast_math_is_marked_and_hidden_elsewhere(ran: tuple[Path, Any]) -> None:
    folder, done = ran
    assert "(bits not promised)" in done.stdout and "not promised" in (folder / "compilers.tex").read_text()
    assert "conformity was not checked" in analysis("table", folder / "fast").stdout


def test_the_figure_says_what_it_shows(ran: tuple[Path, Any]) -> None:
    folder, _ = ran
    described = json.loads((folder / "compilers_ratio.json").read_text())
    assert described["facts"]["base"].startswith("Base: one (") and described["facts"]["launches"] == [ROUNDS, ROUNDS]
    assert described["lines_across_categories"] == [] and described["alike_in_grey"] == []
    for kind in ("png", "svg", "pdf", "txt"):
        assert (folder / f"compilers_ratio.{kind}").stat().st_size > 100


def test_nothing_is_deleted(study: Path, tmp_path: Path) -> None:
    for _ in range(2):
        done = compilers(f"--program=a={program()}", "--study", study, "--out", tmp_path / "out", "--rounds", "1", "--filter", "atomics.*serial")
        assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "out.previous"]
    assert (tmp_path / "out.previous/a/records.jsonl").is_file()


def test_the_study_that_comes_with_it() -> None:
    """One kernel of each style, serially and on all threads; one program at a time, so one launch a study."""
    names = run("study", ROOT / "studies/compilers.toml", "--list").ok().stdout.splitlines()
    assert {name.split("/")[2] for name in names} == {"tile_parallel", "tile_simd", "triangle_atomics"}
    assert len(names) == 6 and sum("/serial/" in name for name in names) == 3
