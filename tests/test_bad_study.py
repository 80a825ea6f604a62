"""Bad study files and bad options of `study`: exit code 2, one line with file, line and key, and no folder made."""

from __future__ import annotations

from pathlib import Path

import pytest

from .program import CPUS, ROOT, refused, run, snapshot

STUDY = """\
name = "bad"
question = "?"
seed = 3

[sampling]
target = 0.5
min_samples = 6
max_samples = 8
point_seconds = 5
time_limit = 60
launches = 1

[[sweep]]
scene = ["teapot:triangles=300"]
size = ["64x48"]
kernel = ["tile_parallel"]
numeric = ["f32"]
fill = ["closed"]
near = ["clip"]
execution = ["openmp:dynamic"]
chunk = ["default", 4]
threads = [1]
binding = ["none"]
wait_policy = ["default"]
runtime = ["default"]
tile = [64]
cache = ["warm"]
generality = ["minimal"]
isa = ["best"]
techniques = ["all"]
"""
AXES = ["size", "kernel", "numeric", "fill", "near", "execution", "chunk", "threads", "binding", "wait_policy", "runtime", "tile", "cache",
        "generality", "isa", "techniques"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "good.toml").write_text(STUDY)
    return tmp_path


def refuse_in(folder: Path, arguments: list[object], *words: str) -> str:
    before = snapshot(folder)
    line = refused(run("study", *arguments, cwd=folder), *words)
    assert snapshot(folder) == before
    return line


def refuse_line(folder: Path, key: str, replacement: str, *words: str) -> None:
    """Replaces the line of `key`; the error must name file, line and (where the file can be parsed) the key."""
    rows = STUDY.splitlines()
    (number,) = [i for i, row in enumerate(rows) if row.split(" ")[0] == key]
    rows[number] = replacement
    (folder / "bad.toml").write_text("\n".join(rows) + "\n")
    refuse_in(folder, ["bad.toml", "--out", "results"], f"bad.toml:{number + 1}: ", *words)


def test_the_study_is_good_before_it_is_spoilt(folder: Path) -> None:
    assert run("study", "good.toml", "--list", cwd=folder).ok().stdout.splitlines() == [
        f"teapot:triangles=300/64x48/tile_parallel/f32/closed/clip/openmp:dynamic{chunk}/1" for chunk in ("", ",4")]


@pytest.mark.parametrize("key, line, words", [
    ("name", 'nme = "bad"', ["nme", "did you mean 'name'"]),
    ("question", "questions = 3", ["questions", "did you mean 'question'"]),
    ("target", "targt = 0.5", ["targt", "did you mean 'target'"]),
    ("launches", "blocks = 3", ["blocks", "known: "]),
    ("kernel", 'kernels = "tile_parallel"', ["kernels", "did you mean 'kernel'"]),
    ("size", 'siz = "64x48"', ["siz", "did you mean 'size'"]),
    ("[sampling]", "[samplng]", ["samplng", "did you mean 'sampling'"]),
    ("[[sweep]]", "[[sweeps]]", ["sweeps", "did you mean 'sweep'"]),
    ("kernel", 'kernel = ["scanline", "tile_paralel"]', ["kernel: ", "'tile_paralel'", "did you mean 'tile_parallel'"]),
    ("numeric", 'numeric = "f16"', ["numeric: ", "did you mean 'f"]),
    ("fill", 'fill = "topleft"', ["fill: ", "did you mean 'top-left'"]),
    ("near", 'near = "clipped"', ["near: ", "clip"]),
    ("execution", 'execution = "openmpi:static"', ["execution: ", "did you mean 'openmp'"]),
    ("execution", 'execution = "openmp:dynamc"', ["execution: ", "did you mean 'dynamic'"]),
    ("execution", 'execution = "openmp"', ["execution: ", "schedule"]),
    ("execution", 'execution = "openmp:dynamic,0"', ["execution: ", "chunk '0'"]),
    ("execution", 'execution = "openmp:auto,4"', ["execution: ", "takes no chunk"]),
    ("execution", 'execution = "serial:static"', ["execution: ", "serial takes no schedule"]),
    ("execution", 'execution = ""', ["execution: "]),
    ("size", 'size = "64"', ["size: ", "'64'"]),
    ("size", 'size = ["64x48", "64x0"]', ["size: ", "height '0'"]),
    ("size", 'size = "65537x1"', ["size: ", "width '65537'"]),
    ("chunk", "chunk = 0", ["chunk: ", "whole numbers from 1"]),
    ("chunk", "chunk = [1, -4]", ["chunk: ", "whole numbers from 1"]),
    ("chunk", 'chunk = "defalt"', ["chunk: "]),
    ("threads", "threads = 0", ["threads: ", "whole numbers from 1"]),
    ("threads", "threads = 99999", ["threads: "]),
    ("threads", 'threads = "1..mx"', ["threads: ", "did you mean '1..max'"]),
    ("binding", 'binding = "closed"', ["binding: ", "did you mean 'close'"]),
    ("wait_policy", 'wait_policy = "activ"', ["wait_policy: ", "did you mean 'active'"]),
    ("runtime", 'runtime = "libomp5"', ["runtime: ", "did you mean 'libomp'"]),
    ("tile", "tile = 0", ["tile: "]),
    ("tile", "tile = 16.0", ["tile: "]),
    ("cache", 'cache = "hot"', ["cache: "]),
    ("generality", 'generality = "ful"', ["generality: ", "full"]),
    ("isa", 'isa = "avx51"', ["isa: ", "did you mean 'avx512'"]),
    ("techniques", 'techniques = ["none", "streeming"]', ["techniques: ", "did you mean 'streaming'"]),
    ("techniques", 'techniques = "all-hugepages"', ["techniques: ", "did you mean 'huge_pages'"]),
    ("techniques", 'techniques = "none+streaming"', ["techniques: ", "'none' stands alone"]),
    ("techniques", "techniques = true", ["techniques: ", "string"]),
    ("seed", "seed = -1", ["seed: ", "whole number from 0"]),
    ("seed", "seed = 1.5", ["seed: ", "whole number"]),
    ("target", "target = 0", ["target: ", "a number from"]),
    ("target", "target = nan", ["target: ", "a number from"]),
    ("target", 'target = "2 %"', ["target: ", "a number from"]),
    ("min_samples", "min_samples = 5", ["min_samples: ", "from 6"]),
    ("min_samples", "min_samples = 7.0", ["min_samples: ", "whole number"]),
    ("max_samples", "max_samples = 5", ["max_samples: "]),
    ("point_seconds", "point_seconds = -1", ["point_seconds: "]),
    ("point_seconds", "point_seconds = inf", ["point_seconds: "]),
    ("point_seconds", "frame_seconds = -1", ["frame_seconds: "]),
    ("time_limit", "time_limit = true", ["time_limit: "]),
    ("time_limit", "time_limit = 9007199254740993", ["time_limit: "]),
    ("launches", "launches = 0", ["launches: ", "from 1"]),
    ("scene", 'scene = "teapt"', ["scene: ", "did you mean 'teapot'"]),
    ("scene", 'scene = "teapot:triangle=300"', ["scene: ", "did you mean 'triangles'"]),
    ("scene", 'scene = "none.dat"', ["scene: ", "none.dat", "No such file"]),
    ("scene", 'scene = "teapot@none.txt"', ["scene: ", "none.txt", "No such file"]),
    ("scene", 'scene = {name = "x", modl = "teapot"}', ["modl: ", "did you mean 'model'"]),
    ("scene", 'scene = {name = "x"}', ["model: ", "missing"]),
    ("scene", 'scene = {name = 3, model = "teapot"}', ["name: ", "string"]),
    ("scene", 'scene = {name = "a/b", model = "teapot"}', ["name: ", "'/'"]),
    ("scene", 'scene = [{name = "x", model = "teapot"}, {name = "x", model = "terrain"}]', ["scene: ", "two scenes", "'x'"]),
    ("name", "name =", ["bad.toml:1"]),
    ("seed", 'seed = 3 "', ["bad.toml:3"]),
    ("question", 'question = "?', ["bad.toml:2"]),
    ("seed", 'name = "twice"', ["bad.toml:3", "name"]),
    ("scene", "[sweep]", ["bad.toml:14"]),
], ids=lambda value: value if isinstance(value, str) else "")
def test_bad_line(key: str, line: str, words: list[str], folder: Path) -> None:
    refuse_line(folder, key, line, *words)


@pytest.mark.parametrize("value", ["[]", "3.5", "true", "{a = 1}", "2024-01-01", "[[1]]"])
@pytest.mark.parametrize("key", ["scene", *AXES])
def test_axis_of_a_wrong_type(key: str, value: str, folder: Path) -> None:
    refuse_line(folder, key, f"{key} = {value}", "a scene 'a'" if (key, value[0]) == ("scene", "{") else f"{key}: ")


@pytest.mark.parametrize("key", ["name", "question", "seed"])
def test_value_of_a_wrong_type(key: str, folder: Path) -> None:
    refuse_line(folder, key, f"{key} = [1]", f"{key}: ")


@pytest.mark.parametrize("key", ["scene", "kernel", "execution"])
def test_axis_that_no_sweep_can_lack(key: str, folder: Path) -> None:
    rows = [row for row in STUDY.splitlines() if not row.startswith(f"{key} ")]
    (folder / "bad.toml").write_text("\n".join(rows))
    refuse_in(folder, ["bad.toml"], "bad.toml:13: ", f"{key}: ", "missing")


@pytest.mark.parametrize("text, words", [
    ("", ["sweep"]),
    ("name = 'x'\n", ["sweep"]),
    ("sweep = 3\n", ["sweep"]),
    ("sweep = [1]\n", ["sweep"]),
    ("sweep = []\n", ["sweep"]),
    ("sampling = 3\n", ["bad.toml:1: ", "sampling"]),
    ("\n\nname = \x00\n", ["bad.toml:3"]),
    ("name = '\udcff'\n", ["bad.toml:1"]),
    ("[" * 3000, ["bad.toml:1"]),
], ids=["empty", "no sweep", "number", "list of numbers", "empty list", "sampling", "NUL", "not UTF-8", "deep"])
def test_other_files(text: str, words: list[str], folder: Path) -> None:
    (folder / "bad.toml").write_bytes(text.encode(errors="surrogateescape"))
    refuse_in(folder, ["bad.toml"], "bad.toml", *words)


@pytest.mark.parametrize("table, words", [
    ("min_samples = 50", ["min_samples", "max_samples"]),  # 40 is the default of max_samples
    ("max_samples = 6", ["min_samples", "max_samples"]),   # 7 is the default of min_samples
])
def test_min_samples_above_the_default_max(table: str, words: list[str], folder: Path) -> None:
    (folder / "bad.toml").write_text(f"[sampling]\n{table}\n" + STUDY[STUDY.index("[[sweep]]"):])
    refuse_in(folder, ["bad.toml"], "bad.toml:2: ", *words)


def test_missing_study_names_those_that_there_are(folder: Path) -> None:
    refuse_in(folder, ["none.toml"], "none.toml")
    refuse_in(folder, ["."], ".")
    refuse_in(folder, [ROOT / "studies/quik.toml"], "studies/quik.toml")


@pytest.mark.parametrize("options, words", [
    (["--shard", "0/2"], ["--shard", "'0'"]), (["--shard", "3/2"], ["--shard", "3", "2"]), (["--shard", "2"], ["--shard", "I/N"]),
    (["--shard", "1/0"], ["--shard", "'0'"]), (["--shard", "a/b"], ["--shard", "'a'"]), (["--shard", "1/2/3"], ["--shard"]),
    (["--filter", "("], ["--filter", "'('"]), (["--filter", "[z-a]"], ["--filter"]),
    (["--filter", "nothing like it"], ["no point is left"]),
    (["--time-limit", "-1"], ["--time-limit"]), (["--time-limit", "soon"], ["--time-limit"]),
    (["--resume", "--replace"], ["--re"]),
    (["--size", "64x0"], ["--size", "height '0'"]),
    (["--scene", "teapt"], ["did you mean 'teapot'"]), (["--scene", "none.dat@none.txt"], ["none.txt", "No such file"]),
    (["--out", "good.toml"], ["good.toml", "--out"]), (["--out", "good.toml/below"], ["good.toml/below", "--out"]),
    (["--kernel", "scanline"], ["--kernel"]),
    (["--benchmark_repetitons=3"], ["did you mean 'benchmark_repetitions'"]),
    (["--benchmark_xyz"], ["--benchmark_xyz"]),
    (["--benchmark_repetitions=0"], ["--benchmark_repetitions", "'0'"]),
    (["--benchmark_repetitions=many"], ["--benchmark_repetitions", "'many'"]),
    (["--benchmark_context=novalue"], ["--benchmark_context", "'novalue'", "KEY=VALUE"]),
    (["--benchmark_context=a=\udcff"], ["--benchmark_context"]),
    (["--benchmark_out_format=xml"], ["--benchmark_out_format", "json"]),
    (["--benchmark_format=jsn"], ["--benchmark_format", "did you mean 'json'"]),
    (["--benchmark_list_tests=maybe"], ["--benchmark_list_tests"]),
    (["--benchmark_enable_random_interleaving=false"], ["--benchmark_enable_random_interleaving"]),
    (["--benchmark_out=none/x.json"], ["none/x.json"]),
    (["--benchmark_out=."], ["."]),
], ids=lambda value: ascii(" ".join(value)) if isinstance(value, list) else "")
def test_bad_option(options: list[str], words: list[str], folder: Path) -> None:
    """Found before anything is measured, so that stderr holds one line and no folder is there."""
    refuse_in(folder, ["good.toml", *([] if "--out" in options else ["--out", "results"]), *options], *words)


def test_options_that_take_lists_leave_the_file_alone(folder: Path) -> None:
    for option, value in (("--size", "32x20"), ("--scene", "terrain:triangles=500")):
        assert value in run("study", option, value, "good.toml", "--list", cwd=folder).ok().stdout


def test_more_threads_than_cpus_is_a_skip_not_an_error(folder: Path) -> None:
    (folder / "many.toml").write_text(STUDY.replace("threads = [1]", f"threads = [{CPUS + 1}]"))
    assert "--oversubscribe" in run("study", "many.toml", "--dry-run", cwd=folder).ok().stdout
