"""lint of figures that no study drew: those of adopt, trace, stability and whatif lie beside descriptions of their own, which keep the
rules, name what they were drawn from, and are found in their folder, above it and in a study."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from .. import __main__ as program
from .. import lint
from . import adopt_test, loops, stability_test, trace_test
from .lint_test import write as write_study

FIGURES = {"adopt": {"adopt_scaling", "adopt_times"}, "trace": {"gantt", "thread_shares", "cost"}, "stability": {"stability"},
           "whatif": {"whatif_curves", "whatif_schedules"}}


def adopt(folder: Path) -> tuple[Path, Path]:
    adopt_test.written(folder, adopt_test.result())
    assert program.main(["adopt", str(folder)]) == 0
    return folder / "adopt.json", folder / "figures"


def trace(folder: Path) -> tuple[Path, Path]:
    path = trace_test.made(folder, image=True)
    assert program.main(["trace", str(path), "--out", str(folder / "drawn")]) == 0
    return path, folder / "drawn"


def stability(folder: Path) -> tuple[Path, Path]:
    path = stability_test.write(folder, [stability_test.line(parameter=10.0**i, wrong=n) for i, n in enumerate((0, 0, 500))])
    assert program.main(["stability", str(path)]) == 0
    return path, folder


def whatif(folder: Path) -> tuple[Path, Path]:
    path = loops.write(folder / "costs.json", np.linspace(1, 9, 200), cpu="A CPU", runtime="libgomp")
    assert program.main(["whatif", str(path), "--out", str(folder / "drawn")]) == 0
    return path, folder / "drawn"


WRITERS = {"adopt": adopt, "trace": trace, "stability": stability, "whatif": whatif}


@pytest.fixture(params=WRITERS, scope="module")
def drawn_once(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path, Path, Path]:
    """To draw takes most of the time of these tests."""
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, folder, *WRITERS[request.param](folder)


@pytest.fixture
def drawn(drawn_once: tuple[str, Path, Path, Path], tmp_path: Path) -> tuple[str, Path, Path]:
    """The name of a writer, what it read and where it drew: a copy, which a test may change."""
    name, made, source, folder = drawn_once
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return name, tmp_path / source.relative_to(made), tmp_path / folder.relative_to(made)


def findings(folder: Path, rule: str | None = None) -> list[lint.Finding]:
    return [f for v in lint.lint_directory(folder).verdicts for f in v.findings if rule in (None, v.rule.id)]


def test_every_figure_is_described(drawn: tuple[str, Path, Path]) -> None:
    name, source, folder = drawn
    for figure in FIGURES[name]:
        beside = json.loads((folder / f"{figure}.json").read_text())
        assert (folder / beside["source"]).resolve() == source.resolve()
        assert beside["title"] and beside["caption"] and beside["facts"]["machine"]
    if name == "adopt":
        facts = json.loads((folder / "adopt_scaling.json").read_text())["facts"]
        assert facts["samples"] == facts["launches"] == [12, 12] and "OMP_NUM_THREADS=1" in facts["base"] and facts["interval"]


def test_they_keep_the_rules_wherever_they_are_looked_for(drawn: tuple[str, Path, Path], capsys: pytest.CaptureFixture) -> None:
    _, source, folder = drawn
    for directory in {folder, source.parent}:
        assert [f for f in findings(directory) if f.severity == "grave"] == []
        capsys.readouterr()
        assert program.main(["lint", str(directory)]) == 0
        out = capsys.readouterr().out
        assert "no study is here" in out and "plot-caption" in out


def test_a_figure_of_data_that_have_changed_is_broken(drawn: tuple[str, Path, Path]) -> None:
    name, source, folder = drawn
    source.write_text(source.read_text() + "\n")
    assert {f.severity for f in findings(folder, "plot-current")} == {"grave"}
    assert len(findings(folder, "plot-current")) == len(FIGURES[name])
    source.unlink()
    assert {f.severity for f in findings(folder, "plot-current")} == {"note"}


def test_costs_of_an_unknown_machine_are_found(tmp_path: Path) -> None:
    """Older files of costs do not name it."""
    path = loops.write(tmp_path / "costs.json", np.linspace(1, 9, 200))
    assert program.main(["whatif", str(path), "--out", str(tmp_path / "drawn")]) == 0
    assert {f.problem for f in findings(tmp_path / "drawn", "plot-caption")} == {"does not name the machine"}


def test_a_study_finds_the_figures_below_it(tmp_path: Path) -> None:
    study = write_study(tmp_path / "study")
    shutil.copytree(adopt(tmp_path)[1].parent / "figures", study / "adopted" / "figures")
    shutil.copy(tmp_path / "adopt.json", study / "adopted" / "adopt.json")
    assert findings(study) == []
    (study / "adopted/adopt.json").write_text("{}")
    assert {(f.file, f.severity) for f in findings(study)} == {(f"adopted/figures/{name}.json", "grave") for name in FIGURES["adopt"]}


def test_data_beside_a_picture_of_their_name_are_no_figure(tmp_path: Path) -> None:
    trace(tmp_path)
    (tmp_path / "trace.png").write_bytes(b"")
    assert findings(tmp_path) == []


def test_a_trace_is_never_written_over(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """The heat map that a trace names has the name of a figure."""
    path = trace_test.made(tmp_path, image=True)
    value = json.loads(path.read_text())
    (tmp_path / "i.png").rename(tmp_path / "cost.png")
    value["metadata"]["image"]["file"] = "cost.png"
    path.write_text(json.dumps(value))
    before = (tmp_path / "cost.png").read_bytes()
    assert program.main(["trace", str(path), "--out", str(tmp_path)]) == 2
    assert "cost.png" in capsys.readouterr().err and (tmp_path / "cost.png").read_bytes() == before


def test_folders_without_anything(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    (tmp_path / "empty").mkdir()
    assert program.main(["lint", str(tmp_path / "empty")]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "neither a study" in err
