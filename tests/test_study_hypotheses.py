"""Hypotheses and weak scaling on the command line: what is planned, recorded, refused and reported."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest

from .program import CPUS, ROOT, environment, events, records, refused, run, sampling, snapshot, sweep, write_study

needs_two_cpus = pytest.mark.skipif(CPUS < 2, reason="this machine has one CPU")
POINTS = sweep("tile_parallel", ["serial", "openmp:static"], threads=1) + sweep("all_pixels", "serial")
NAME = "teapot:triangles=300/64x48/{}/f32/closed/clip/serial/1"
FAST, SLOW = NAME.format("tile_parallel"), NAME.format("all_pixels")


def hypothesis(**keys: str) -> str:
    values = {"claim": '"Tiles beat the naive loop"', "where": '{execution = "serial"}', "faster": '{kernel = "tile_parallel"}',
              "slower": '{kernel = "all_pixels"}', "by": "0.1"} | keys
    return "[[hypothesis]]\n" + "".join(f"{key} = {value}\n" for key, value in values.items() if value)


def study(folder: Path, *tables: str) -> Path:
    return write_study(folder / "study.toml", sampling(6, launches=2), *(tables or (POINTS, hypothesis())))


def analysis(*arguments: object) -> str:
    done = subprocess.run([ROOT / "scripts/python", "-m", "analysis", *map(str, arguments)], cwd=ROOT, env=environment(), capture_output=True,
                          text=True, timeout=120, check=False)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hypotheses")
    run("study", study(folder), "--out", folder / "out").ok()
    return folder


def test_the_journal_and_the_context_have_the_claim(done: Path) -> None:
    stated = [{"claim": "Tiles beat the naive loop", "by": 0.1, "faster": [FAST], "slower": [SLOW], "untested": None}]
    assert json.loads((done / "out/context.json").read_text())["study"]["hypotheses"] == stated
    (start,) = events(done / "out", "start")
    assert start["hypotheses"] == stated


def test_both_sides_have_the_same_blocks(done: Path) -> None:
    blocks = {r["name"]: list(zip(r["launches"], r["blocks"])) for r in records(done / "out")}
    assert blocks[FAST][:6] == blocks[SLOW][:6] and len(blocks[FAST]) >= 6


def test_resume_refuses_another_claim(done: Path, tmp_path: Path) -> None:
    other = study(tmp_path, POINTS, hypothesis(by="0.05"))
    refused(run("study", other, "--out", done / "out", "--resume"), "hypotheses: differs from this study")


def test_dry_run_forecasts_from_an_assumption_a_number_or_an_earlier_run(done: Path, tmp_path: Path) -> None:
    def ratio(text: str) -> float:
        (found,) = re.findall(r"detectable: a true ratio of ([\d.e+]+) \(", text)
        return float(found)

    file = done / "study.toml"
    assumed = run("study", file, "--dry-run", "--out", tmp_path / "none").ok().stdout
    assert "an assumed noise of 8 % a sample" in assumed and "cost: at most 6 min of frames: 3 points x 2 x point_seconds of 60 s" in assumed
    given = run("study", file, "--dry-run", "--out", tmp_path / "none", "--noise", "0.01").ok().stdout
    assert "noise of 1 % a sample (--noise)" in given and 1.1 < ratio(given) < ratio(assumed)
    measured = run("study", file, "--dry-run", "--out", done / "out", "--noise", "0.01").ok().stdout
    assert f"noise as measured in {done / 'out'}" in measured and ratio(measured) > 1.1
    assert "by the times of 3 of 3 points" in measured and "verification and the like, as then" in measured
    assert not (tmp_path / "none").exists()


def test_noise_is_of_the_dry_run(done: Path) -> None:
    refused(run("study", done / "study.toml", "--noise", "0.1"), "--noise")
    refused(run("study", done / "study.toml", "--dry-run", "--noise", "0"), "--noise")


def test_earlier_records_that_no_study_wrote_are_refused(done: Path, tmp_path: Path) -> None:
    (tmp_path / "records.jsonl").write_text('{"status": "ok"}\n')
    outcome = run("study", done / "study.toml", "--dry-run", "--out", tmp_path)
    assert outcome.code == 2 and "records.jsonl:1: is not what a study writes" in outcome.stderr


def test_the_report_has_the_verdict(done: Path) -> None:
    analysis("report", done / "out")
    page = (done / "out/report.html").read_text()
    assert "<h2>Hypotheses</h2>" in page and "Tiles beat the naive loop" in page
    assert (done / "out/figures/hypotheses.svg").is_file() and (done / "out/tables/hypotheses.tex").is_file()
    found = {rule["id"]: rule for rule in json.loads(analysis("lint", done / "out", "--json"))["rules"]}
    assert found["hypotheses"]["findings"] == []


@pytest.mark.parametrize("keys, words", [
    ({"claim": ""}, ["claim: is missing"]), ({"faster": ""}, ["faster: is missing"]), ({"by": '"much"'}, ["by: must be a number"]),
    ({"faster": '"tile_parallel"'}, ["faster: must be a table"]), ({"faster": '{kernel = "tile_paralel"}'}, ["kernel: ", "did you mean 'tile_parallel'"]),
    ({"faster": '{kernle = "tile_parallel"}'}, ["kernle", "did you mean 'kernel'"]), ({"faster": '{kernel = "scanline"}'}, ["faster: selects no point"]),
    ({"faster": "{}"}, ["faster: selects 2 points", "differ in kernel", "best = true"]),
    ({"faster": '{kernel = "all_pixels"}'}, ["slower: selects", "as faster does"]),
    ({"faster": '{kernel = "tile_parallel", best = 1}'}, ["best: must be true or false"]),
    ({"where": '{execution = "serial", scene = "teapto"}'}, ["scene: ", "teapto"]), ({"clam": "1"}, ["clam", "did you mean 'claim'"]),
    ({"where": '{execution = "serial", kernel = "scanline"}'}, ["kernel is in where, too"]),
    ({"where": '{execution = "serial", best = true}'}, ["best"])])
def test_bad_hypotheses_name_file_line_and_key(tmp_path: Path, keys: dict[str, str], words: list[str]) -> None:
    file = study(tmp_path, POINTS, hypothesis(**keys))
    before = snapshot(tmp_path)
    line = refused(run("study", file, "--list", "--out", tmp_path / "out"), *words)
    assert re.match(r"rasterbench: .*study\.toml:\d+: ", line) and snapshot(tmp_path) == before


def test_one_bracket_is_not_two(tmp_path: Path) -> None:
    file = study(tmp_path, POINTS, hypothesis().replace("[[hypothesis]]", "[hypothesis]"))
    refused(run("study", file, "--list"), "hypothesis: must be [[hypothesis]] tables, with two brackets")


@pytest.mark.parametrize("keys, words", [
    (dict(weak="triangels"), ["weak: ", "did you mean 'triangles'"]), (dict(weak=["triangles", "pixels"]), ["weak: must be one word"]),
    (dict(weak="triangles", scene="teapot:triangles=300"), ["weak: ", "does not grow"]), (dict(weak="triangles", scene="a.dat"), ["weak: ", "does not grow"]),
    (dict(scene="teapot:triangles=300*threads"), ["scene: ", 'needs weak = "triangles"']), (dict(size="64x48*threads"), ["size: ", 'needs weak = "pixels"']),
    (dict(weak="pixels"), ["size: ", "does not grow"]), (dict(weak="pixels", size="40000x1*threads", threads=[1, 9]), ["weak: ", "larger than 65536"]),
    (dict(weak="triangles", scene="teapot:triangles=300*threads", threads=[2, 4]), ["threads: ", "1 is missing"]),
    (dict(weak="triangles", scene="teapot:triangles=many*threads"), ["weak: ", "'many' is not a number"])])
def test_bad_weak_sweeps_name_file_line_and_key(tmp_path: Path, keys: dict[str, object], words: list[str]) -> None:
    file = study(tmp_path, sweep(execution="openmp:static", **({"threads": [1, 2]} | keys)))
    line = refused(run("study", file, "--list"), *words)
    assert re.match(r"rasterbench: .*study\.toml:\d+: ", line)


def test_scenes_of_the_command_line_must_grow_too(tmp_path: Path) -> None:
    file = study(tmp_path, sweep(execution="openmp:static", weak="triangles", scene="teapot:triangles=300*threads", threads=[1, 2]))
    refused(run("study", file, "--list", "--scene", "teapot:triangles=500"), "--scene: ", "does not grow")
    names = run("study", file, "--list", "--scene", "confetti:triangles=50*threads", "--cpus", "2").ok().stdout.splitlines()
    assert [name.partition("/")[0] for name in names] == ["confetti:triangles=50", "confetti:triangles=100"]


@needs_two_cpus
def test_weak_scaling_from_study_to_figure(tmp_path: Path) -> None:
    weak = dict(execution=["serial", "openmp:static"], threads=[1, 2])
    file = study(tmp_path, sweep(weak="triangles", scene={}, **weak).replace("{}", '{name = "load", model = "teapot:triangles=300*threads"}'),
                 sweep(weak="pixels", **(weak | {"size": "64x48*threads"})))
    out = tmp_path / "out"
    run("study", file, "--out", out).ok()
    context = json.loads((out / "context.json").read_text())
    assert context["study"]["weak"] == [
        {"kind": "triangles", "scene": "load", "size": "64x48",
         "steps": [{"threads": 1, "scene": "load-x1", "size": [64, 48]}, {"threads": 2, "scene": "load-x2", "size": [64, 48]}]},
        {"kind": "pixels", "scene": "teapot:triangles=300", "size": "64x48*threads",
         "steps": [{"threads": 1, "scene": "teapot:triangles=300", "size": [64, 48]}, {"threads": 2, "scene": "teapot:triangles=300", "size": [91, 68]}]}]
    drawn = {(r["config"]["scene"], tuple(r["config"]["size"]), r["config"]["backend"], r["config"]["threads"]) for r in records(out)}
    assert drawn == {("load-x1", (64, 48), "serial", 1), ("load-x1", (64, 48), "openmp", 1), ("load-x2", (64, 48), "serial", 1),
                     ("load-x2", (64, 48), "openmp", 2), ("teapot:triangles=300", (64, 48), "serial", 1),
                     ("teapot:triangles=300", (64, 48), "openmp", 1), ("teapot:triangles=300", (91, 68), "serial", 1),
                     ("teapot:triangles=300", (91, 68), "openmp", 2)}
    sizes = {name: scene["triangles"] for name, scene in context["scenes"].items()}
    assert sizes["load-x2"] == pytest.approx(2 * sizes["load-x1"], rel=0.2)
    analysis("report", out)
    assert "<h2>Weak scaling</h2>" in (out / "report.html").read_text()
    assert len((out / "tables/weak_scaling.csv").read_text().splitlines()) == 1 + 4


@pytest.mark.parametrize("name", ["schedules", "strategies", "weak"])
@pytest.mark.parametrize("cpus", [1, 2, 8])
def test_hypotheses_of_the_studies_select_their_points(name: str, cpus: int, tmp_path: Path) -> None:
    plan = run("study", ROOT / f"studies/{name}.toml", "--dry-run", "--cpus", cpus, "--out", tmp_path / "none").ok().stdout
    found = re.findall(r"^hypothesis (\d): .*\n  (\w+)", plan, re.MULTILINE)
    expected = "not" if name == "weak" and cpus == 1 else "faster"
    assert found == [("1", expected), ("2", expected), ("3", expected)]
