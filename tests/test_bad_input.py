"""Bad input of `render`, `graphics`, `list` and `scene`: exit code 2, one line that says where and what, and no file touched."""

from __future__ import annotations

import math
import os
import struct
from pathlib import Path

import pytest

from .program import CPUS, ROOT, Parameters, refused, run, snapshot, write_dat

WALL = [-1.0, -1, 0, 1, -1, 0, 0, 1, 0]
FIELDS = ["object red", "object green", "object blue", "background red", "background green", "background blue",
          "camera x", "camera y", "camera z", "height", "width", "theta", "near", "far"]
LINES = [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 5, 6, 6]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A good model, good parameters, and outputs of before that must survive."""
    write_dat(tmp_path / "good.dat", [WALL] * 3)
    Parameters().write(tmp_path / "good.txt")
    for name in ("out.ppm", "ids.npy"):
        (tmp_path / name).write_bytes(b"precious")
    (tmp_path / "folder.ppm").mkdir()
    return tmp_path


def refuse_in(folder: Path, arguments: list[object], *words: str, name: str = "rasterbench") -> str:
    before = snapshot(folder)
    line = refused(run(*arguments, cwd=folder, name=name), *words, name=name)
    assert snapshot(folder) == before
    return line


# Models.

def dat_bytes(count: int, triangles: float) -> bytes:
    return struct.pack("<i", count) + b"\0" * int(36 * triangles)


BAD_MODELS = {
    "truncated": (dat_bytes(3, 2.5), ["T says 3 triangles", "holds 2", "94 bytes"]),
    "truncated by a byte": (dat_bytes(1, 1)[:-1], ["T says 1 triangles", "holds 0"]),
    "header only": (dat_bytes(5, 0), ["T says 5 triangles", "holds 0"]),
    "T of all": (dat_bytes(2**31 - 1, 1), ["T says 2147483647 triangles", "holds 1"]),
    "negative T": (dat_bytes(-1, 1), ["T is -1", "negative"]),
    "most negative T": (dat_bytes(-(2**31), 0), ["T is -2147483648"]),
    "empty": (b"", ["empty"]),
    "two bytes": (b"\1\0", ["T needs 4 bytes", "2"]),
    "text": (b"solid teapot\nfacet normal 0 0 1\n", ["T says", "triangles"]),
}


@pytest.mark.parametrize("program", ["rasterbench", "graphics"])
@pytest.mark.parametrize("case", BAD_MODELS)
def test_bad_model(case: str, program: str, folder: Path) -> None:
    content, words = BAD_MODELS[case]
    (folder / "bad.dat").write_bytes(content)
    arguments: list[object] = ["bad.dat", "good.txt", "out.ppm"]
    if program == "rasterbench":
        arguments = ["render", "bad.dat", "good.txt", "-o", "out.ppm"]
    refuse_in(folder, arguments, "bad.dat", *words, name=program)


MISNAMED_MODELS = {
    "missing file": ("none.dat", ["none.dat", "No such file"]),
    "missing folder": ("none/model.dat", ["none/model.dat", "No such file"]),
    "folder": ("folder.ppm", ["folder.ppm", "directory"]),
    "other format": ("out.ppm", ["out.ppm", ".dat"]),
    "device": ("/dev/null", ["/dev/null"]),
    "nothing": ("", ["MODEL"]),
    "generator": ("teapt", ["teapt", "did you mean 'teapot'"]),
    "key": ("teapot:triangle=300", ["teapot:triangle=300", "did you mean 'triangles'"]),
    "value": ("teapot:triangles=many", ["triangles", "'many' is not a number"]),
    "nan": ("teapot:triangles=nan", ["triangles", "nan"]),
    "fraction": ("confetti:triangles=3.5", ["triangles", "3.5 is not an integer"]),
    "too many": ("confetti:triangles=1e12", ["triangles", "1e12 is not in"]),
    "too few": ("confetti:triangles=0", ["triangles", "0 is not in"]),
    "word": ("layers:order=randm", ["order", "did you mean 'random'"]),
    "twice": ("teapot:triangles=300,triangles=400", ["triangles", "twice"]),
    "no value": ("teapot:triangles", ["triangles", "KEY=VALUE"]),
    "comma": ("teapot:triangles=300,", ["','"]),
}


@pytest.mark.parametrize("case", MISNAMED_MODELS)
def test_misnamed_model(case: str, folder: Path) -> None:
    model, words = MISNAMED_MODELS[case]
    refuse_in(folder, ["render", model, "good.txt", "-o", "out.ppm"], *words)
    if case not in ("missing file", "missing folder", "folder", "other format", "device", "nothing"):
        refuse_in(folder, ["scene", model, "-o", "out.ppm", "--parameters", "good.txt"], *words)


# Parameters.

def with_token(index: int, token: str) -> str:
    rows = [row.split() for row in Parameters().text().splitlines()]
    rows[LINES[index] - 1][sum(line == LINES[index] for line in LINES[:index])] = token
    return "".join(" ".join(row) + "\n" for row in rows)


def refuse_parameters(folder: Path, text: str | bytes, *words: str) -> None:
    (folder / "bad.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    refuse_in(folder, ["render", "good.dat", "bad.txt", "-o", "out.ppm"], *words)
    refuse_in(folder, ["good.dat", "bad.txt", "out.ppm"], *words, name="graphics")


@pytest.mark.parametrize("index", range(14), ids=FIELDS)
def test_parameter_that_is_no_number(index: int, folder: Path) -> None:
    refuse_parameters(folder, with_token(index, "1,5"), f"bad.txt:{LINES[index]}: {FIELDS[index]}: ", "'1,5'")


@pytest.mark.parametrize("index", range(14), ids=FIELDS)
def test_missing_parameter(index: int, folder: Path) -> None:
    """The file ends before the field; the next field's place is where it should stand."""
    tokens = Parameters().text().split()[:index]
    line = refused(run("render", "good.dat", "cut.txt", cwd=_written(folder, "cut.txt", " ".join(tokens))), FIELDS[index], "missing")
    assert "cut.txt:1: " in line
    assert not (folder / "good.png").exists()


def _written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder


BAD_VALUES = [
    ("object red", "256"), ("object green", "-1"), ("object blue", "1.5"), ("background red", "99999999999999999999"),
    ("camera x", "nan"), ("camera y", "inf"), ("camera z", "-infinity"), ("camera x", "1e400"), ("camera y", "0x10"), ("camera z", "--1"),
    ("height", "0"), ("width", "0"), ("height", "-0"), ("width", "-5"), ("height", "65537"), ("width", "1e3"), ("height", "4294967297"),
    ("theta", "nan"), ("theta", "0"), ("theta", "-1"), ("theta", "3.2"), ("theta", "200"), ("theta", "1e-310"),
    ("near", "0"), ("near", "-0.5"), ("near", "nan"), ("near", "20"), ("near", "21"), ("far", "inf"), ("far", "1e400"),
]


@pytest.mark.parametrize("field, token", BAD_VALUES, ids=lambda value: str(value))
def test_parameter_out_of_range(field: str, token: str, folder: Path) -> None:
    index = FIELDS.index(field)
    refuse_parameters(folder, with_token(index, token), f"bad.txt:{LINES[index]}: {field}: ")


@pytest.mark.parametrize("theta", ["45", "60.0", "179"])
def test_theta_in_degrees(theta: str, folder: Path) -> None:
    refuse_parameters(folder, with_token(11, theta), "bad.txt:5: theta: ", "radians", "degrees?")


@pytest.mark.parametrize("theta", [repr(math.pi), "181", "200"])
def test_theta_that_is_no_angle_in_degrees_either(theta: str, folder: Path) -> None:
    (folder / "bad.txt").write_text(with_token(11, theta))
    assert "degrees" not in refuse_in(folder, ["render", "good.dat", "bad.txt", "-o", "out.ppm"], "bad.txt:5: theta: ")


def test_camera_at_the_origin(folder: Path) -> None:
    refuse_parameters(folder, Parameters(camera=(0.0, 0.0, -0.0)).text(), "bad.txt:3: camera x: ", "origin")


def test_near_behind_far_names_both(folder: Path) -> None:
    refuse_parameters(folder, Parameters(near=7.5, far=7.25).text(), "bad.txt:6: near: ", "7.5", "7.25")


def test_huge_picture(folder: Path) -> None:
    """4e9 pixels: refused before memory is touched, with what it would need."""
    (folder / "huge.txt").write_text(Parameters(height=65535, width=65535).text())
    for arguments in (["good.dat", "huge.txt", "out.ppm"],):
        refuse_in(folder, arguments, "65535", "GiB", name="graphics")
    refuse_in(folder, ["render", "good.dat", "good.txt", "-o", "out.ppm", "--size", "65535x65535"], "65535", "GiB")


@pytest.mark.parametrize("content, words", [
    (b"", [": object red: ", "missing"]),
    (b"\n\n\n", [": object red: ", "missing"]),
    (b"\x00\xff\x01 \x1b[31m 3", [":1: object red: "]),
    (Parameters().text().encode() + b"\n7", [":8: ", "'7' after the last field"]),
    (b"1 " * 40000, ["not a scene parameter file"]),
    (b"9" * 5000, [":1: object red: "]),
], ids=["empty", "blank", "binary", "too long", "far too long", "long token"])
def test_other_parameter_files(content: bytes, words: list[str], folder: Path) -> None:
    refuse_parameters(folder, content, "bad.txt", *words)


@pytest.mark.parametrize("name, word", [("none.txt", "No such file"), ("folder.ppm", "directory"), ("good.dat", "object red")])
def test_misnamed_parameters(name: str, word: str, folder: Path) -> None:
    refuse_in(folder, ["render", "good.dat", name, "-o", "out.ppm"], name, word)


# Options.

BAD_OPTIONS: dict[str, list[str]] = {
    **{f"--size {size}": ["--size"] for size in ("0x10", "10x0", "-0x5", "10x-5", "65537x1", "1x65537", "99999999999x1", "1e3x10", "10", "10x",
                                                 "x", "10x10x10", "10X10", "1.5x2")},
    "--size=": ["--size"],
    "--threads 0": ["--threads"], "--threads -1": ["--threads"], "--threads two": ["--threads"], "--threads 65537": ["--threads"],
    f"--threads {CPUS + 1}": ["--threads", f"{CPUS + 1} threads on {CPUS} CPUs", "--oversubscribe"],
    "--schedule dynamc": ["schedule", "did you mean 'dynamic'"],
    "--schedule dynamic,0": ["--schedule", "chunk '0'"], "--schedule dynamic,-4": ["--schedule", "chunk '-4'"],
    "--schedule dynamic,": ["--schedule", "chunk ''"], "--schedule dynamic,4,4": ["--schedule", "chunk '4,4'"],
    "--schedule dynamic,99999999999": ["--schedule", "chunk"],
    "--schedule auto,4": ["chunk", "takes no chunk"],
    "--backend serial --schedule static": ["schedule", "serial takes no schedule"],
    "--backend serial --threads 2 --oversubscribe": ["threads", "serial"],
    "--backend openmpi": ["backend", "did you mean 'openmp'"],
    "--kernel tile_paralel": ["kernel", "did you mean 'tile_parallel'"],
    "--numeric f33": ["did you mean 'f32'"],
    "--kernel triangle_atomics --numeric f64": ["triangle_atomics", "f64"],
    "--fill open": ["--fill", "closed, top-left"], "--near of": ["--near", "did you mean 'off'"],
    "--tie frist": ["--tie", "did you mean 'first'"], "--cull front": ["--cull"],
    "--tile 0": ["--tile"], "--tile 99999": ["--tile"], "--frames 0": ["--frames"], "--frames 1.5": ["--frames"],
    "--kernels x": ["--kernels"], "--threads": ["--threads"], "extra": ["extra"],
}


@pytest.mark.parametrize("options", BAD_OPTIONS)
def test_bad_option(options: str, folder: Path) -> None:
    refuse_in(folder, ["render", "good.dat", "good.txt", "-o", "out.ppm", *options.split()], *BAD_OPTIONS[options])


BAD_OUTPUTS: dict[str, tuple[list[str], list[str]]] = {
    "folder that is not there": (["-o", "none/x.ppm"], ["none/x.ppm", "No such file"]),
    "below a file": (["-o", "good.txt/x.ppm"], ["good.txt/x.ppm"]),
    "is a folder": (["-o", "folder.ppm"], ["folder.ppm", "directory"]),
    "gif": (["-o", "out.gif"], ["out.gif", "'.gif'", ".ppm, .png"]),
    "no extension": (["-o", "out"], ["out", ".ppm, .png"]),
    "ids": (["--ids", "none/ids.npy"], ["none/ids.npy", "No such file"]),
    "depth": (["--depth", "folder.ppm"], ["folder.ppm", "directory"]),
    "full disk": (["--ids", "/dev/full"], ["/dev/full", "No space left"]),
    "full disk, picture": (["-o", "full.ppm"], ["full.ppm", "No space left"]),
    "second of three": (["-o", "new.ppm", "--ids", "none/ids.npy"], ["none/ids.npy"]),
    "third of three": (["-o", "out.ppm", "--ids", "ids.npy", "--depth", "none/depth.npy"], ["none/depth.npy"]),
}


@pytest.mark.parametrize("case", BAD_OUTPUTS)
def test_unwritable_output(case: str, folder: Path) -> None:
    options, words = BAD_OUTPUTS[case]
    if "full disk" in case and not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    if "full.ppm" in options:
        (folder / "full.ppm").symlink_to("/dev/full")
    refuse_in(folder, ["render", "good.dat", "good.txt", *options], *words)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_without_permission(folder: Path) -> None:
    locked = folder / "locked"
    locked.mkdir(mode=0o500)
    refuse_in(folder, ["render", "good.dat", "good.txt", "-o", "locked/x.ppm"], "locked/x.ppm", "Permission denied")


@pytest.mark.parametrize("arguments, words", [
    ([], ["subcommand"]),
    (["rendr", "good.dat"], ["rendr"]),
    (["render"], ["MODEL"]),
    (["render", "good.dat", "good.txt", "--bogus"], ["--bogus"]),
    (["list"], ["WHAT"]),
    (["list", "kernel"], ["did you mean 'kernels'"]),
    (["list", "kernels", "--jsn"], ["--jsn"]),
    (["scene", "teapot"], ["--output"]),
    (["scene", "teapot", "-o", "none/m.dat"], ["none/m.dat", "No such file"]),
    (["scene", "teapot:triangles=300", "-o", "m.dat", "--parameters", "none/m.txt"], ["none/m.txt", "No such file"]),
    (["study"], ["FILE"]),
    (["--bogus"], []),
    (["two\nlines"], ["two"]),
    (["render", "two\nlines.dat"], ["two"]),
    (["render", "good.dat", "good.txt", "two\nlines"], ["two"]),
    (["render", "good.dat", "--threads", "1\n2"], ["--threads"]),
], ids=lambda value: " ".join(value).replace("\n", "\\n") or "nothing")
def test_bad_usage(arguments: list[str], words: list[str], folder: Path) -> None:
    refuse_in(folder, arguments, *words)


@pytest.mark.parametrize("arguments, words", [
    ([], ["MODEL"]),
    (["good.dat"], ["SCENE"]),
    (["good.dat", "good.txt", "out.ppm", "extra"], ["extra"]),
    (["good.dat", "good.txt", "out.gif"], ["out.gif", ".ppm"]),
    (["good.dat", "good.txt", "none/x.ppm"], ["none/x.ppm", "No such file"]),
    (["none.dat", "good.txt"], ["none.dat", "No such file"]),
    (["good.txt", "good.dat"], ["good.dat"]),
], ids=lambda value: " ".join(value) or "nothing")
def test_bad_usage_of_graphics(arguments: list[str], words: list[str], folder: Path) -> None:
    refuse_in(folder, arguments, *words, name="graphics")


@pytest.mark.parametrize("command", [[], ["render"], ["study"], ["list"], ["scene"], ["selftest"]], ids=lambda c: " ".join(c) or "program")
def test_help_and_version_of_every_command(command: list[str], tmp_path: Path) -> None:
    outcome = run(*command, "--help", cwd=tmp_path).ok()
    assert "Usage" in outcome.stdout and outcome.stderr == ""
    version = run(*command, "--version", cwd=tmp_path).ok()
    assert version.stdout.startswith("rasterbench ")
    assert run("--version", name="graphics").ok().stdout.startswith("graphics ")


def test_missing_program_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RASTERBENCH_BIN", str(tmp_path))
    with pytest.raises(pytest.fail.Exception, match="scripts/setup"):
        run("--version")
    assert (ROOT / "scripts/setup").is_file()


@pytest.mark.parametrize("command", [["render", "-o", "out.ppm"], ["verify"], ["explain"], ["trace", "-o", "trace.json"], ["selftest"]], ids=lambda c: c[0])
def test_no_command_runs_more_threads_than_cpus_unasked(command: list[str], tmp_path: Path) -> None:
    refused(run(command[0], "teapot:triangles=300", *command[1:], "--threads", CPUS + 1, cwd=tmp_path),
            "--threads", f"{CPUS + 1} threads on {CPUS} CPUs", "--oversubscribe")
    assert list(tmp_path.iterdir()) == []
