"""rasterbench adopt: programs of our own, right and wrong in known ways, and what it must say of each."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any, Callable

import pytest

from .program import CPUS, ROOT, Parameters, command, environment, program, read_png, refused, run, write_dat

SOURCES = ROOT / "tests/programs"
# Small and quick: what is tested is the judgement, not the times.
QUICK = {"--size": "160x90", "--repetitions": 2, "--race-seconds": 0.5, "--seconds": 0.5, "--min-samples": 6, "--max-samples": 6}
MODEL = "layers:triangles=120,depth=4"


def compiler() -> str:
    """The one that CMake found."""
    cache = program().parent.parent / "CMakeCache.txt"
    for line in cache.read_text().splitlines():
        if line.startswith("CMAKE_CXX_COMPILER:"):
            return line.split("=", 1)[1]
    raise AssertionError(f"{cache} names no compiler")


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Compiles a test program once: build("rows", "LOOP_SCHEDULE=static")."""
    folder = tmp_path_factory.mktemp("programs")

    def compiled(name: str, *definitions: str, flags: tuple[str, ...] = ("-fopenmp",)) -> Path:
        target = folder / "_".join([name, *definitions, *flags]).replace("=", "_").replace(",", "_")
        if not target.exists():
            subprocess.run([compiler(), "-std=c++20", "-O2", *flags, *(f"-D{d}" for d in definitions), SOURCES / f"{name}.cpp", "-o", target],
                           check=True, capture_output=True, timeout=300)
        return target

    return compiled


@pytest.fixture
def script(tmp_path: Path) -> Callable[[str], Path]:
    def written(text: str) -> Path:
        path = tmp_path / "program.sh"
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)
        return path

    return written


def quick(*options: object) -> list[object]:
    """The options, and those of QUICK that are not among them."""
    return [word for name, value in QUICK.items() if name not in options for word in (name, value)] + list(options)


def adopt(what: Path, out: Path, *options: object, code: int, model: object = MODEL) -> tuple[dict[str, Any], str]:
    """Runs it; adopt.json and what it printed."""
    outcome = run("adopt", what, model, "--out", out, *quick(*options))
    assert outcome.code == code, f"exit code {outcome.code}: {outcome.stderr}\n{outcome.stdout}"
    result = json.loads((out / "adopt.json").read_text())
    assert result["correct"] == (code == 0)
    assert not list(out.glob(".work*")) and not list(out.glob(".races*"))
    if code != 0:
        assert result["timing"] is None and result["slurm"] is None, "a program that is wrong shows no speed"
        assert "WRONG" in outcome.stdout
    return result, outcome.stdout


def kinds(judgement: dict[str, Any]) -> list[str]:
    return [problem["kind"] for problem in judgement["problems"]]


# Right programs.

def test_our_own_program_is_right_to_the_last_pixel(tmp_path: Path) -> None:
    result, _ = adopt(program("graphics"), tmp_path, code=0, model="teapot:triangles=3000")
    nearest = {(m["numeric"], m["fill"]): m["differing"] for m in result["judgement"]["nearest"]}
    assert nearest["f32", "closed"] == 0 == result["judgement"]["nearest"][0]["differing"]
    assert result["judgement"]["pictures"][0]["wrong"] == 0
    assert result["openmp"]["schedule"] == "runtime" and result["openmp"]["evidence"] == "calls"


def test_a_correct_program(build: Callable[..., Path], tmp_path: Path) -> None:
    result, said = adopt(build("rows"), tmp_path, "--own-time", r"drawn in ([0-9.]+) ms", code=0)
    judgement = result["judgement"]
    assert judgement["correct"] and not judgement["problems"] and len(judgement["pictures"]) == 1
    assert judgement["pictures"][0]["pixels"]["same"] == 160 * 90 and judgement["difference"] is None
    assert result["races"]["correct"] and "proves none away" in said
    assert result["openmp"]["schedule"] == "runtime"
    points = {(p["schedule"], p["threads"]): p for p in result["timing"]["points"]}
    assert set(points) == {(s, t) for s in ("static", "dynamic,1", "dynamic,16", "guided") for t in {1, CPUS} | {2**i for i in range(6) if 2**i < CPUS}}
    for point in points.values():
        assert len(point["samples_ms"]) == result["timing"]["blocks"] <= 6 and min(point["samples_ms"]) > 0
        assert point["own_times"] == [1.5] * len(point["samples_ms"])
        assert point["median_ms"] >= point["min_ms"]


def test_figures_and_tables(build: Callable[..., Path], tmp_path: Path) -> None:
    adopt(build("rows"), tmp_path, "--seconds", 60, code=0)
    done = subprocess.run([ROOT / "scripts/python", "-m", "analysis", "adopt", tmp_path], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "dynamic,16" in done.stdout and "speedup" in done.stdout
    for file in ("figures/adopt_times.png", "figures/adopt_times.txt", "tables/adopt.csv", "tables/adopt.tex"):
        assert (tmp_path / file).stat().st_size > 100
    assert (tmp_path / "figures/adopt_scaling.png").exists() == (CPUS > 1)


def test_one_that_does_not_scale(build: Callable[..., Path], tmp_path: Path) -> None:
    """One critical section for all pixels: right, and no faster. What the probe counted says why."""
    if CPUS < 2:
        pytest.skip("needs two CPUs")
    result, said = adopt(build("zbuffer", "GUARDED"), tmp_path, "--threads", 2, "--schedule", "dynamic,1", "--size", "320x180", "--seconds", 60,
                         model="layers:triangles=120,depth=12", code=0)
    assert result["openmp"]["calls"]["criticals"] > 100000
    (point,) = [p for p in result["timing"]["points"] if p["threads"] == 2]
    assert point["speedup"] < 1.25 and point["speedup_interval"] is not None
    assert "critical sections" in said or point["speedup_interval"][1] >= 1.25


# schedule(runtime) or not.

@pytest.mark.parametrize("definitions, flags, expected, evidence, words", [
    (("LOOP_SCHEDULE=dynamic,4",), ("-fopenmp",), "fixed", "calls", "dynamic"),
    (("LOOP_SCHEDULE=static",), ("-fopenmp",), "fixed", "calls", "no schedule(runtime)"),
    ((), (), "no_openmp", "imports", "no OpenMP"),
    ((), ("-fopenmp", "-static"), "undecided", "none", "only the times"),
], ids=["dynamic", "static", "no OpenMP", "linked statically"])
def test_the_schedule_is_found_out(definitions: tuple[str, ...], flags: tuple[str, ...], expected: str, evidence: str, words: str,
                                   build: Callable[..., Path], tmp_path: Path) -> None:
    result, said = adopt(build("rows", *definitions, flags=flags), tmp_path, "--schedule", "static", "--schedule", "guided", code=0)
    assert (result["openmp"]["schedule"], result["openmp"]["evidence"]) == (expected, evidence) and words in said
    schedules = {p["schedule"] for p in result["timing"]["points"]}
    assert schedules == ({"static", "guided"} if expected == "undecided" else {None}), "OMP_SCHEDULE is swept where it can matter"


# Wrong ones.

def test_a_race(build: Callable[..., Path], tmp_path: Path) -> None:
    if CPUS < 2:
        pytest.skip("needs two CPUs")
    result, said = adopt(build("zbuffer"), tmp_path, "--race-seconds", 60, code=1)
    judgement = result["judgement"] if kinds(result["judgement"]) else result["races"]
    assert kinds(judgement) == ["race"] and "data race" in said and "one of the two updates is lost" in said
    assert judgement["unstable_pixels"] > 0 and len(judgement["pictures"]) > 1
    worst = max(judgement["pictures"], key=lambda picture: picture["wrong"])
    assert worst["wrong"] >= worst["pixels"]["hidden"] > 0
    assert {run["picture"] for run in judgement["runs"] if run["threads"] == 1} == {judgement["runs"][0]["picture"]}


def test_a_crash_with_threads(build: Callable[..., Path], tmp_path: Path) -> None:
    result, said = adopt(build("faults", "FAULT=1"), tmp_path, code=1)
    assert kinds(result["judgement"]) == ["crashed"]
    assert "signal 11" in said and "never happened with one thread" in said
    assert {r["outcome"] for r in result["judgement"]["runs"] if r["threads"] == 1} == {"ok"}


@pytest.mark.parametrize("fault, finding, words", [
    (2, "hidden", "depth test"), (3, "colour", "shading"), (4, None, "upside down"), (5, "unwritten", "never written"), (7, None, "row + 0.5"),
], ids=["farthest wins", "other shading", "upside down", "a tile left black", "samples at corners"])
def test_wrong_pixels(fault: int, finding: str | None, words: str, build: Callable[..., Path], tmp_path: Path) -> None:
    result, said = adopt(build("faults", f"FAULT={fault}"), tmp_path, code=1, model="teapot:triangles=3000" if fault == 7 else MODEL)
    judgement = result["judgement"]
    assert kinds(judgement) == ["wrong_pixels"] and words in said
    (picture,) = judgement["pictures"]
    assert sum(picture["pixels"].values()) == 160 * 90 and picture["wrong"] > 0
    if finding:
        assert picture["pixels"][finding] > 0.9 * picture["wrong"]
    if fault == 5:
        assert picture["wrong"] == 64 and judgement["box"] == [40, 8, 48, 16]
        assert judgement["first_pixels"][0] | {"x": 40, "y": 8, "drawn": "#000000"} == judgement["first_pixels"][0]
    assert read_png(tmp_path / judgement["difference"]).shape[1] == 160
    assert read_png(tmp_path / judgement["picture"]).shape == (90, 160, 3)


def test_a_fill_rule_that_tears_neighbours_apart(build: Callable[..., Path], tmp_path: Path) -> None:
    """The diagonal of a square runs through samples: a matter of the fill rule, which rounding may excuse, but which is said."""
    square = write_dat(tmp_path / "square.dat", [[-.5, -.5, 0, .5, -.5, 0, .5, .5, 0], [-.5, -.5, 0, .5, .5, 0, -.5, .5, 0]])
    scene = Parameters(camera=(0, 0, 4), height=64, width=64, theta=0.48995732625372834, near=1, far=10).write(tmp_path / "square.txt")
    for definitions, differing in (((), 0), (("OPEN_EDGES",), 32)):
        outcome = run("adopt", build("rows", *definitions), square, scene, "--out", tmp_path / "out", *quick("--size", "64x64")).ok()
        (picture,) = json.loads((tmp_path / "out/adopt.json").read_text())["judgement"]["pictures"]
        assert picture["differ"] == picture["pixels"]["edge_float64"] == differing and picture["wrong"] == 0
        assert ("tears neighbours apart" in outcome.stdout) == (differing > 0)


def test_an_earlier_result_does_not_stay(build: Callable[..., Path], tmp_path: Path) -> None:
    adopt(build("rows"), tmp_path, "--schedule", "static", code=0)
    assert (tmp_path / "adopt.sbatch").exists()
    adopt(build("faults", "FAULT=5"), tmp_path, code=1)
    assert {p.name for p in tmp_path.iterdir()} == {"adopt.json", "difference.png", "picture.png"}


def test_some_wrong_pixels_can_be_let_pass(build: Callable[..., Path], tmp_path: Path) -> None:
    adopt(build("faults", "FAULT=5"), tmp_path, "--max-wrong", 64, "--race-seconds", 0, code=0)


def test_a_picture_that_depends_on_the_threads(build: Callable[..., Path], tmp_path: Path) -> None:
    result, _ = adopt(build("faults", "FAULT=6"), tmp_path, code=1)
    assert "depends_on_threads" in kinds(result["judgement"])


@pytest.mark.parametrize("text, kind, words", [
    ("exit 0", "no_picture", "wrote no picture"),
    ("echo no such luck >&2; exit 3", "failed", "exit code 3; it said: no such luck"),
    ("printf 'P6\\n160 90\\n255\\nabc' > $3", "bad_picture", "cut off"),
    ("printf 'P6\\n999999999 999999999\\n255\\nabc' > $3", "bad_picture", "999999999 x 999999999"),
    ("printf 'P6\\n90 160\\n255\\nabc' > $3", "bad_picture", "swapped"),
    ("mkfifo $3", "bad_picture", "no plain file"),
    ("cp $1 $2", "failed", "wrote to the model or the scene"),
    ("kill -KILL $$", "crashed", "signal 9"),
], ids=["no file", "exit code", "truncated", "huge header", "height first", "a pipe", "overwrites its input", "killed"])
def test_programs_that_fail(text: str, kind: str, words: str, script: Callable[[str], Path], tmp_path: Path) -> None:
    result, said = adopt(script(text), tmp_path / "out", code=1)
    assert kinds(result["judgement"]) == [kind] and words in said
    assert not result["judgement"]["nearest"]


def test_one_that_hangs_is_killed_with_all_its_children(script: Callable[[str], Path], tmp_path: Path) -> None:
    begin = time.monotonic()
    result, said = adopt(script(f"sleep 1000 & echo $! >> {tmp_path}/children; wait"), tmp_path / "out", "--limit", 0.5, code=1)
    assert kinds(result["judgement"]) == ["hung"] and "no end within 0.5 s" in said
    assert len(result["judgement"]["runs"]) == 1 and time.monotonic() - begin < 60
    assert_gone((tmp_path / "children").read_text().split())


def assert_gone(children: list[str]) -> None:
    assert children
    for _ in range(100):
        states = [Path(f"/proc/{child}/stat") for child in children]
        if all(not s.exists() or ") Z" in s.read_text() for s in states):
            return
        time.sleep(0.05)
    raise AssertionError(f"still there: {children}")


def test_interrupted(script: Callable[[str], Path], tmp_path: Path) -> None:
    """Ctrl-C kills what runs, leaves no half result, and says so in one line."""
    what = script(f"sleep 1000 & echo $! >> {tmp_path}/children; wait")
    started = subprocess.Popen(command("adopt", what, MODEL, "--out", tmp_path / "out", *quick()), env=environment(), stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "children").exists():
        assert started.poll() is None
        time.sleep(0.02)
    time.sleep(0.2)
    started.send_signal(signal.SIGINT)
    _, errors = started.communicate(timeout=60)
    assert started.returncode == 1 and errors.splitlines()[-1] == "rasterbench: interrupted"
    assert not (tmp_path / "out/adopt.json").exists() and not list((tmp_path / "out").iterdir())
    assert_gone((tmp_path / "children").read_text().split())


def test_the_users_files_are_safe(script: Callable[[str], Path], tmp_path: Path) -> None:
    """A program that mistakes its arguments writes over copies."""
    model, scene = tmp_path / "m.dat", tmp_path / "s.txt"
    run("scene", "teapot:triangles=100", "-o", model, "--parameters", scene).ok()
    before = model.read_bytes(), scene.read_bytes()
    outcome = run("adopt", script("echo spoiled > $1; echo spoiled > $2"), model, scene, "--out", tmp_path / "out", *quick())
    assert outcome.code == 1 and (model.read_bytes(), scene.read_bytes()) == before


def test_another_file_name_is_found_and_said(build: Callable[..., Path], script: Callable[[str], Path], tmp_path: Path) -> None:
    """A program that calls its picture after its model, as `graphics` does without a third argument."""
    result, said = adopt(script(f'"{build("rows")}" "$1" "$2" model.ppm'), tmp_path / "out", code=0)
    assert "wrote model.ppm" in said and result["openmp"]["schedule"] == "runtime", "the probe sees the program behind a script"


def test_the_environment_is_that_of_the_point(build: Callable[..., Path], script: Callable[[str], Path], tmp_path: Path) -> None:
    log = tmp_path / "log"
    what = script(f'echo "$OMP_NUM_THREADS $OMP_SCHEDULE $OMP_PROC_BIND" >> {log}; exec "{build("rows")}" "$@"')
    outcome = run("adopt", what, MODEL, "--out", tmp_path / "out", *quick("--schedule", "guided,3", "--binding", "close"), OMP_SCHEDULE="static,7",
                  OMP_NUM_THREADS="5")
    assert outcome.code == 0, outcome.stderr
    lines = log.read_text().splitlines()
    assert "1 guided,3 close" in lines and not any("static,7" in line or line.startswith("5 ") for line in lines)


# The SLURM script.

def test_slurm_script(build: Callable[..., Path], tmp_path: Path) -> None:
    """It parses, asks for cores, memory and time, and what it runs works (a script stands in for srun)."""
    out = tmp_path / "it's here"
    odd = tmp_path / "my program; echo"
    odd.symlink_to(build("rows"))
    adopt(odd, out, "--slurm-cores", CPUS, "--schedule", "static", code=0)
    batch = out / "adopt.sbatch"
    text = batch.read_text()
    for words in (f"#SBATCH --cpus-per-task={CPUS}", "#SBATCH --mem=", "#SBATCH --time=", "--cpu-bind=cores -c"):
        assert words in text, words
    (tmp_path / "bin").mkdir()
    srun = tmp_path / "bin/srun"
    srun.write_text('#!/bin/sh\nwhile [ "${1#-}" != "$1" ]; do [ "$1" = -c ] && shift; shift; done\nexec "$@"\n')
    srun.chmod(0o755)
    done = subprocess.run(["bash", batch], capture_output=True, text=True, check=False, timeout=300, cwd=tmp_path,
                          env=environment(PATH=f"{tmp_path}/bin:{os.environ['PATH']}", SLURM_JOB_ID="7", SLURM_CPUS_PER_TASK=str(CPUS)))
    assert done.returncode == 0, done.stderr
    again = json.loads((tmp_path / "it's here-7/adopt.json").read_text())
    assert again["correct"] and again["environment"]["binding"] == "close"
    assert {p["schedule"] for p in again["timing"]["points"]} == {"static"}


# Bad usage.

def test_bad_options(build: Callable[..., Path], tmp_path: Path) -> None:
    good = build("rows")
    for options, words in [
            (["--fill", "open"], ["--fill", "open"]), (["--near", "far"], ["--near"]), (["--schedule", "dynamc"], ["dynamc", "dynamic"]),
            (["--schedule", "static,0"], ["chunk"]), (["--threads", "0"], ["--threads"]), (["--threads", "60000"], ["--oversubscribe"]),
            (["--limit", "nan"], ["--limit"]), (["--limit", "0"], ["--limit"]), (["--size", "0x9"], ["--size"]), (["--binding", "far"], ["--binding"]),
            (["--min-samples", "9", "--max-samples", "8"], ["--min-samples"]), (["--own-time", "("], ["--own-time", "regular"]),
            (["--own-time", "ms"], ["--own-time", "group"]), (["--max-wrong", "-1"], ["--max-wrong"])]:
        refused(run("adopt", good, MODEL, "--out", tmp_path / "out", *options), *words)
    refused(run("adopt", good, MODEL), "--out")
    refused(run("adopt", tmp_path / "none", MODEL, "--out", tmp_path / "out"), "none", "no such program")
    refused(run("adopt", tmp_path, MODEL, "--out", tmp_path / "out"), "not a file that can be run")
    refused(run("adopt", good, "no.dat", "--out", tmp_path / "out"), "no.dat")
    (tmp_path / "plain").write_text("hello")
    refused(run("adopt", tmp_path / "plain", MODEL, "--out", tmp_path / "out"), "plain", "cannot be run")
    (tmp_path / "plain").chmod(0o755)  # no interpreter line, no ELF
    outcome = run("adopt", tmp_path / "plain", MODEL, "--out", tmp_path / "out")
    assert outcome.code == 2 and "cannot be started: Exec format error" in outcome.errors[-1]
    refused(run("adopt", good, MODEL, "--out", tmp_path / "plain"), "plain", "--out")
