"""Programs of several compilers: ratios paired by round, who shows a speed, the table, the figure and its side file."""

from __future__ import annotations

import copy
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .. import __main__ as program
from .. import compilers, lint, lint_figures, load, sidecars
from ..comparison import Analysis
from ..severity import GRAVE
from ..statistics.samples import Samples
from . import synthetic

ROUNDS, BLOCKS = 7, 6
DRIFT = np.exp(np.random.default_rng(5).normal(0, 0.3, ROUNDS))  # the machine, from round to round
NAMES = ("gcc-O0", "gcc-O2", "gcc-Ofast", "clang-O2")
SLOWNESS = {"gcc-O0": 8.0, "gcc-O2": 1.0, "gcc-Ofast": 0.8, "clang-O2": 0.95}


def folder_of(path: Path, rounds: int = ROUNDS, judged: dict[str, dict[str, Any]] | None = None, **slowness: float) -> Path:
    """What scripts/compilers writes: three kernels, serial and on two threads, in every configuration."""
    path.mkdir()
    known = SLOWNESS | {name.replace("_", "-"): value for name, value in slowness.items()}
    for name in NAMES:
        study = synthetic.write(path / name, synthetic.plan(scenes={"teapot": synthetic.SCENES["teapot"]}, schedules=[("openmp", "dynamic", None)],
                                                            kernels=["tile_parallel", "triangle_atomics"], threads=[2], untimed=False))
        fast = "fast" in name
        context = json.loads((study / "context.json").read_text())
        context["program"] |= {"compiler": name.split("-")[0], "flags": "-" + name.split("-")[1], "fast_math": fast, "build_id": name}
        (study / "context.json").write_text(json.dumps(context))
        rng = np.random.default_rng(sum(map(ord, name)))
        changed, verdicts = [], []
        for line in (study / "records.jsonl").read_text().splitlines():
            record = json.loads(line)
            times = known[name] * 10 * np.repeat(DRIFT[:rounds], BLOCKS) * np.exp(rng.normal(0, 0.01, rounds * BLOCKS))
            record |= {"samples_ms": times.tolist(), "launches": np.repeat(np.arange(rounds), BLOCKS).tolist(), "blocks": list(range(rounds * BLOCKS)),
                       "stages_ms": {"raster": times.tolist()}, "loop_ms": None, "median_ms": float(np.median(times)), "interval_ms": None, "p95_ms": None,
                       "min_ms": float(times.min()), "max_ms": float(times.max())}
            if record["config"]["backend"] == "openmp":
                record["runtime_observed"] = "libomp" if name.startswith("clang") else "libgomp"
            if fast:
                record["verify"] = {"conforms": None, "differing_pixels": None, "oracle": None, "checked_against": "nothing"}
            changed.append(record)
            verdict = {"point": record["name"], "conforms": True, "differing_pixels": 0, "wrong": 3, "unexplained": 0, "end_to_end_errors": 0,
                       "max_depth_error_steps": 1.5}
            verdicts.append(verdict | ({"conforms": False, "differing_pixels": 12, "wrong": 9, "unexplained": 4} if fast else {})
                            | (judged or {}).get(name, {}))
        (study / "records.jsonl").write_text("".join(json.dumps(record) + "\n" for record in changed))
        (study / "judged.json").write_text(json.dumps({"schema": 1, "judge": "gcc-O2", "points": verdicts}))
    entries = [{"name": name, "status": "ok", "reason": "", "flags": "", "program_bytes": 1000} for name in NAMES]
    entries.append({"name": "clang-O3", "status": "skipped", "reason": "clang++ is not installed", "flags": "-O3", "program_bytes": None})
    (path / "compilers.json").write_text(json.dumps({"schema": 1, "base": "gcc-O2", "judge": "gcc-O2", "rounds": rounds, "configurations": entries}))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folder_of(tmp_path_factory.mktemp("compilers") / "out")


def cell(found: compilers.Comparison, name: str, point: int = 0) -> compilers.Cell:
    return found.cells[found.points[point].name, name]


def test_ratios_are_paired_by_round(folder: Path) -> None:
    """The drift between rounds, thirty per cent of it, is in the times and not in the ratios."""
    found = compilers.Comparison(folder)
    for name in NAMES:
        if name != found.base:
            over = found.ratio(cell(found, name))
            assert over.n == ROUNDS and over.low <= over.value <= over.high
            assert over.value == pytest.approx(SLOWNESS[name], rel=0.02) and over.high / over.low < 1.06, name
    times = [compilers.time(cell(found, name).samples) for name in NAMES]
    assert all(time.high / time.low > 1.3 for time in times), "the drift is there"
    assert found.ratio(cell(found, "gcc-O2")) is None


def test_the_round_is_what_repeats(tmp_path: Path) -> None:
    """Five rounds of six samples have no interval, however many samples that makes."""
    found = compilers.Comparison(folder_of(tmp_path / "out", rounds=5))
    over = found.ratio(cell(found, "gcc-O0"))
    assert over.n == 5 and not over.has_interval and over.value == pytest.approx(8, rel=0.02)
    compilers.write(found)


def test_rounds_that_only_one_has_are_left_out() -> None:
    a = Samples(np.array([2.0, 2.0, 4.0]), np.array([0, 0, 1]), np.arange(3))
    b = Samples(np.array([1.0, 1.0, 9.0]), np.array([0, 0, 2]), np.arange(3))
    assert compilers.ratio(a, b).value == 2 and compilers.ratio(a, b).n == 1
    assert compilers.ratio(a, Samples(np.array([1.0]), np.array([5]), np.array([0]))) is None


def test_fast_math_shows_its_time_marked_and_nothing_else_does(folder: Path) -> None:
    found = compilers.Comparison(folder)
    fast = cell(found, "gcc-Ofast")
    assert fast.samples is not None and fast.marked and fast.conforms == "NO: 12 pixels"
    assert cell(found, "gcc-O0").conforms == "yes" and not cell(found, "gcc-O0").marked
    words = compilers.table(found).words
    shown = words[words["configuration"] == "gcc-Ofast"]
    assert shown["median ms [95 %]"].str.endswith("(does not conform)").all() and set(shown["wrong"]) == {"9"} and set(shown["beyond bound"]) == {"4"}
    # Every other table of the suite hides the speed of such records.
    assert all(r.samples is None and "conform" in r.reason for r in load.load(folder / "gcc-Ofast").records)


def test_a_fast_program_with_the_bits_promises_them_no_more(tmp_path: Path) -> None:
    found = compilers.Comparison(folder_of(tmp_path / "out", judged={"gcc-Ofast": {"conforms": True, "differing_pixels": 0}}))
    assert cell(found, "gcc-Ofast").conforms == "not promised" and cell(found, "gcc-Ofast").marked
    assert compilers.table(found).words["median ms [95 %]"].str.contains("bits not promised").any()


def test_a_strict_program_that_does_not_conform_shows_no_speed(tmp_path: Path) -> None:
    found = compilers.Comparison(folder_of(tmp_path / "out", judged={"clang-O2": {"conforms": False, "differing_pixels": 1}}))
    wrong = cell(found, "clang-O2")
    assert wrong.samples is None and "1 pixels differ" in wrong.reason and found.ratio(wrong) is None
    numbers = compilers.table(found).numbers
    assert numbers[numbers["configuration"] == "clang-O2"]["median_ms"].isna().all() and numbers["median_ms"].notna().any()


def test_what_is_not_installed_stands_in_the_table_with_its_reason(folder: Path) -> None:
    found = compilers.Comparison(folder)
    assert cell(found, "clang-O3").reason == "skipped: clang++ is not installed"
    assert "skipped: clang++ is not installed" in compilers.plain(found)


def test_runtimes_that_differ_with_the_compiler_are_named(folder: Path) -> None:
    """libomp's loops are not libgomp's: such a ratio is of two things."""
    found = compilers.Comparison(folder)
    said = found.runtimes(found.cells.values())
    assert "libgomp: gcc-O0, gcc-O2, gcc-Ofast; libomp: clang-O2" in said
    made = compilers.table(found)
    assert made.note.endswith(said) and set(made.numbers["openmp_runtime"].dropna()) == {"libgomp", "libomp"}
    assert made.numbers[made.numbers["execution"] == "serial"]["openmp_runtime"].isna().all()
    compilers.write(found)
    assert said in (folder / "compilers_ratio.txt").read_text()
    assert found.runtimes(cell for cell in found.cells.values() if cell.configuration.name != "clang-O2") == ""


def test_what_is_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert program.main(["compilers", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "gcc-Ofast" in said and "written:" in said
    for name in ("compilers.csv", "compilers.tex", "compilers.txt", "compilers_ratio.png", "compilers_ratio.svg", "compilers_ratio.pdf",
                 "compilers_ratio.txt"):
        assert (folder / name).stat().st_size > 100, name
    rows = (folder / "compilers.csv").read_text().splitlines()
    assert len(rows) == 1 + 4 * 5 and rows[0].startswith("scene,size,kernel")
    first = (folder / "compilers.csv").read_bytes()
    assert program.main(["compilers", str(folder)]) == 0 and (folder / "compilers.csv").read_bytes() == first


def test_the_figure_breaks_no_rule(folder: Path) -> None:
    """The rules of lint that are about figures, on the file beside this one."""
    found = compilers.Comparison(folder)
    compilers.write(found)
    figure = sidecars.read(folder / "compilers_ratio.json")
    assert figure["facts"]["base"].startswith("Base: gcc-O2 (") and figure["facts"]["interval"] == compilers.INTERVAL
    assert figure["facts"]["launches"] == [ROUNDS, ROUNDS] and figure["facts"]["samples"] == [ROUNDS * BLOCKS] * 2

    class Folder:
        figures, undescribed, study = [("compilers_ratio.json", figure)], [], found.base_study
        source = staticmethod(lambda file, figure: found.base_study.directory / "records.jsonl")

    for rule in (lint_figures.caption, lint_figures.base, lint_figures.lines, lint_figures.legible, lint_figures.grey, lint_figures.current):
        assert list(rule(Folder)) == [], rule.__name__


def test_a_folder_of_one_configuration_is_a_study(folder: Path) -> None:
    result = lint.lint(Analysis(load.load(folder / "gcc-O2")))
    assert [f for f in result.findings if f.severity == GRAVE and "launch" in f.problem] == []


@pytest.mark.parametrize("break_it, words", [
    (lambda f: (f / "compilers.json").unlink(), ["compilers.json", "no such file"]),
    (lambda f: (f / "compilers.json").write_text("{"), ["compilers.json", "not JSON"]),
    (lambda f: edit(f / "compilers.json", lambda c: c.update(schema=9)), ["schema", "9"]),
    (lambda f: edit(f / "compilers.json", lambda c: c.update(base="icc")), ["base", "icc"]),
    (lambda f: edit(f / "compilers.json", lambda c: c.update(configurations=[])), ["configurations"]),
    (lambda f: edit(f / "compilers.json", lambda c: c["configurations"][1].update(name="gcc-O0")), ["configurations.name", "gcc-O0"]),
    (lambda f: edit(f / "compilers.json", lambda c: c["configurations"][0].update(name="../x")), ["configurations.name"]),
    (lambda f: edit(f / "compilers.json", lambda c: c["configurations"][4].update(reason="")), ["configurations.reason"]),
    (lambda f: (f / "gcc-O0/judged.json").unlink(), ["judged.json", "nobody judged"]),
    (lambda f: edit(f / "gcc-O0/judged.json", lambda c: c["points"][0].update(conforms=None)), ["judged.json", "points.conforms"]),
    (lambda f: (f / "gcc-O0/records.jsonl").unlink(), ["records.jsonl", "no such file"]),
], ids=["no plan", "broken plan", "schema", "base", "empty", "twice", "path", "no reason", "not judged", "no verdict", "no records"])
def test_bad_input(break_it: Any, words: list[str], folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(folder, tmp_path / "out")
    break_it(tmp_path / "out")
    assert program.main(["compilers", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert all(word in line for word in words), line


def edit(path: Path, change: Any) -> None:
    value = copy.deepcopy(json.loads(path.read_text()))
    change(value)
    path.write_text(json.dumps(value))
