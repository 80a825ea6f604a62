"""`rasterbench fuzz`: what it finds, how it says so, and how it ends."""

from __future__ import annotations

import re
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from .program import TIMEOUT, command, environment, read_dat, refused, run

# A kernel that draws nothing: a violation in the first case in which something is drawn.
CANARY = ("--kernel", "null", "--relation", "kernels", "--numeric", "f32")


def without_times(text: str) -> str:
    return re.sub(r"in \d+\.\d s", "in T s", text)


def test_a_short_run_finds_nothing() -> None:
    outcome = run("fuzz", "--cases", 16, "--seconds", 60, "--seed", 3).ok()  # the 16th is a scene
    assert re.search(r"\d+ cases in \d+\.\d s, 0 violated\n$", outcome.stdout)
    rows = {line.split()[0]: line.split()[1:] for line in outcome.stdout.splitlines()[2:] if line and line[0].islower()}
    assert {"turn", "shift", "oracle", "kernels"} <= rows.keys()
    assert int(rows["turn"][0]) > 100 and all(row[2] == "0" for row in rows.values())
    assert re.search(r"\d+ cases, \d+ cases/s, 0 violated", outcome.stderr)


def test_what_is_found_is_a_test_and_a_scene(tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    outcome = run("fuzz", *CANARY, "--cases", 8, "--seed", 5, "--out", out)
    assert outcome.code == 1 and "violated in f32" in outcome.stderr
    (source,) = out.glob("*.cpp")
    name = source.stem
    assert re.fullmatch(r"KernelsF32Seed5Case\d+", name)
    assert sorted(path.name for path in out.iterdir()) == [f"{name}.cpp", f"{name}.dat", f"{name}.txt"]
    text = source.read_text()
    assert text in outcome.stdout
    assert f"TEST(Fuzz, {name}) {{" in text and 'EXPECT_EQ(violation("kernels", "f32", fuzz_case, {"null"}), "");' in text

    # The scene is the one of the text, and shows something to a kernel that draws.
    triangles = read_dat(out / f"{name}.dat")
    assert triangles.shape == (1, 3, 3)
    listed = re.findall(r"-?0x[0-9a-f.]+p[+-]\d+(?=f)", text)
    assert np.array_equal(triangles.ravel(), [float.fromhex(number) for number in listed])
    run("render", out / f"{name}.dat", out / f"{name}.txt", "--ids", tmp_path / "ids.npy").ok()
    assert np.load(tmp_path / "ids.npy").max() == 0


def test_the_same_seed_gives_the_same_run() -> None:
    first, again, other = (run("fuzz", *CANARY, "--cases", 6, "--seed", seed) for seed in (11, 11, 12))
    assert first.code == again.code == 1
    assert without_times(first.stdout) == without_times(again.stdout) != without_times(other.stdout)
    longer = run("fuzz", *CANARY, "--cases", 9, "--seed", 11)
    found = first.stdout.split("\nrelation")[0]
    assert longer.stdout.startswith(found)


def test_options_choose_what_is_asked() -> None:
    outcome = run("fuzz", "--cases", 20, "--seconds", 60, "--relation", "turn", "--relation", "fill", "--numeric", "f32", "--numeric", "f64").ok()
    rows = [line.split()[:2] for line in outcome.stdout.splitlines() if re.match(r"(turn|fill|\w+) +\d+ +\d+ +\d+", line)]
    assert rows == [["turn", "40"], ["fill", "40"]]


@pytest.mark.parametrize("options, words", [
    (("--numeric", "f23"), ("f23", "numeric mode")),
    (("--numeric", "ray_cast"), ("ray_cast", "screen triangles")),
    (("--kernel", "tile_paralel"), ("did you mean 'tile_parallel'?",)),
    (("--relation", "turm"), ("--relation", "did you mean 'turn'?")),
    (("--seconds", "-1"), ("--seconds",)),
    (("--seconds", "soon"), ("--seconds",)),
    (("--seconds", "nan"), ("--seconds", "nan")),
    (("--first", "9" * 20), ("--first", "2^63")),
    (("--seed", "0x10"), ("--seed", "0x10")),
    (("--seed", "-1"), ("--seed",)),
    (("--cases", "0"), ("--cases",)),
    (("MODEL.dat",), ("MODEL.dat",)),
])
def test_bad_usage_is_one_line(options: tuple[str, ...], words: tuple[str, ...]) -> None:
    refused(run("fuzz", *options), *words)


def test_a_folder_that_cannot_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    refused(run("fuzz", "--out", tmp_path / "file"), str(tmp_path / "file"))
    refused(run("fuzz", "--out", tmp_path / "file" / "below"), str(tmp_path / "file" / "below"))


def test_a_crash_says_how_to_see_it_again() -> None:
    process = subprocess.Popen(command("fuzz", "--seconds", 600, "--seed", 4, "--relation", "turn", "--first", 5), env=environment(),
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0)
    try:
        assert process.stderr is not None
        process.stderr.readline()  # the first report of progress
        process.send_signal(signal.SIGSEGV)
        _, stderr = process.communicate(timeout=TIMEOUT)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    assert process.returncode == -signal.SIGSEGV
    (options,) = re.findall(r"crashed in: (fuzz .*)", stderr.decode())
    assert re.fullmatch(r"fuzz --seed 4 --first \d+ --cases 1 --relation turn --numeric \S+", options)
    assert "1 cases in" in run(*options.split()).ok().stdout


def test_a_case_is_found_again_by_its_number() -> None:
    found = run("fuzz", *CANARY, "--cases", 3, "--seed", 6).stdout
    (number,) = re.findall(r"TEST\(Fuzz, \w+Case(\d+)\)", found)
    again = run("fuzz", *CANARY, "--first", number, "--cases", 1, "--seed", 6).stdout
    assert again.split("\nrelation")[0] == found.split("\nrelation")[0]


def test_interrupted_it_says_what_was_found_so_far() -> None:
    process = subprocess.Popen(command("fuzz", *CANARY, "--seconds", 600), env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               bufsize=0)  # so that readline() takes one line and leaves the rest to communicate()
    try:
        assert process.stdout is not None
        seen = process.stdout.readline()  # the first finding
        process.send_signal(signal.SIGINT)
        begin = time.monotonic()
        stdout, stderr = process.communicate(timeout=TIMEOUT)
        assert time.monotonic() - begin < 10
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    assert process.returncode == 130
    text = (seen + stdout).decode()
    assert "TEST(Fuzz, " in text and "1 violated; interrupted" in text
