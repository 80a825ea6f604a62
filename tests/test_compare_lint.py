"""`analysis compare` and `analysis lint` on what the program itself wrote."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from .program import ROOT, TIMEOUT, Outcome, environment, run, sampling, sweep, write_study

POINTS = 3


def analysis(*arguments: object, cwd: Path | None = None) -> Outcome:
    done = subprocess.run([str(ROOT / "scripts/python"), "-m", "analysis", *map(str, arguments)], cwd=cwd, env=environment(),
                          capture_output=True, text=True, timeout=TIMEOUT, check=False)
    return Outcome(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs of one study of five launches, a and b, and Google Benchmark's file of a."""
    folder = tmp_path_factory.mktemp("studies")
    study = write_study(folder / "study.toml", 'name = "twice"', sampling(10, launches=5),
                        sweep(["tile_parallel", "row_parallel", "scanline"], ["serial"], threads=[1]))
    for name in "ab":
        run("study", study, "--out", folder / name, f"--benchmark_out={folder / name}.json").ok()
    return folder


def slowed(studies: Path, target: Path, factor: float) -> Path:
    """b with all its times multiplied."""
    shutil.copytree(studies / "b", target)
    records = [json.loads(line) for line in (target / "records.jsonl").read_text().splitlines()]
    for record in records:
        record["samples_ms"] = [factor * sample for sample in record["samples_ms"]]
    (target / "records.jsonl").write_text("".join(json.dumps(record) + "\n" for record in records))
    return target


def test_two_runs_can_be_compared(studies: Path, tmp_path: Path) -> None:
    """The contexts of two runs of one program on one machine do not differ, whatever the times do."""
    done = analysis("compare", studies / "a", studies / "b", "--json", "-o", tmp_path / "out")
    assert done.code in (0, 1, 4), done.stderr  # busy machines leave points undecided
    value = json.loads(done.stdout)
    assert len(value["points"]) == POINTS
    assert {difference["key"] for difference in value["ignored"]} <= {"frames_per_sample"}  # chosen from times
    assert (tmp_path / "out/ratios.png").stat().st_size > 1000
    assert analysis("compare", studies / "a", studies / "a", "--margin", "0.9").code == 0


@pytest.mark.parametrize("factor, verdict, code", [(10.0, "SLOWER", 1), (0.1, "FASTER", 0)])
def test_a_planted_difference(studies: Path, tmp_path: Path, factor: float, verdict: str, code: int) -> None:
    other = slowed(studies, tmp_path / "c", factor)
    done = analysis("compare", studies / "a", other, "--json")
    assert done.code == code
    assert {point["verdict"] for point in json.loads(done.stdout)["points"]} == {verdict}


def test_another_context(studies: Path, tmp_path: Path) -> None:
    """Another study file, as the program records it."""
    study = write_study(tmp_path / "study.toml", 'name = "twice"', sampling(6), sweep("tile_parallel", "serial"))
    run("study", study, "--out", tmp_path / "c").ok()
    done = analysis("compare", studies / "a", tmp_path / "c")
    assert done.code == 2 and not done.stdout and any("study.sampling.launches" in line for line in done.errors)
    done = analysis("compare", studies / "a", tmp_path / "c", "--ignore", "study")
    assert done.code == 3 and "LOST" in done.stdout  # two points are not in c
    assert analysis("compare", studies / "a", tmp_path / "c", "--ignore", "study", "--ignore", "points").code == 4  # c has one launch


def test_google_benchmark_of_the_same_run(studies: Path) -> None:
    done = analysis("compare", studies / "a", studies / "a.json", "--few-launches", "--margin", "0.9", "--json")
    assert done.code == 0, done.stderr
    points = json.loads(done.stdout)["points"]
    assert len(points) == POINTS and all(point["b_over_a"] == pytest.approx(1, abs=1e-6) for point in points)


def test_lint(studies: Path) -> None:
    """What the program writes breaks no rule that the program can keep; how busy the machine is, is not its to say."""
    analysis("report", studies / "a").ok()
    done = analysis("lint", studies / "a", "--json")
    value = json.loads(done.stdout)
    verdicts = {rule["id"]: rule["verdict"] for rule in value["rules"]}
    dirty = [f for rule in value["rules"] for f in rule["findings"] if f["place"] == "program.dirty"]
    assert {name for name, verdict in verdicts.items() if verdict == "broken"} <= ({"set-up"} if dirty else set()), done.stdout
    assert done.code == (1 if dirty else 0)
    assert [name for name, verdict in verdicts.items() if verdict == "not visible"] == ["exit"]


def test_lint_finds_what_was_changed(studies: Path, tmp_path: Path) -> None:
    changed = slowed(studies, tmp_path / "c", 2.0)
    done = analysis("lint", changed, "--json")
    broken = {rule["id"] for rule in json.loads(done.stdout)["rules"] if rule["verdict"] == "broken"}
    assert done.code == 1 and {"means", "confidence", "raw-data"} <= broken
