"""Weak scaling and the bars of imbalance: efficiencies of times that are known, and what the figures say."""

from __future__ import annotations

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from .. import lint, lint_figures, sidecars, style, weak
from ..figures import imbalance
from ..figures.weak import draw
from ..load import InputError
from .conftest import analyse
from .hypotheses_test import state
from .synthetic import plan, write

EXECUTIONS = [("openmp", "dynamic", 16), ("tbb", "auto", None)]
SAMPLES = 15
SIZES = {1: [640, 360], 2: [905, 509], 4: [1280, 720]}
SERIES = [
    {"kind": "triangles", "scene": "load", "size": "640x360", "steps": [{"threads": p, "scene": f"load-x{p}", "size": SIZES[1]} for p in (1, 2, 4)]},
    {"kind": "pixels", "scene": "pot", "size": "640x360*threads", "steps": [{"threads": p, "scene": "pot", "size": SIZES[p]} for p in (1, 2, 4)]}]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """On P threads tile_parallel takes 1 + (P - 1) / 10 times its time on one, triangle_atomics P / 2 times from two on."""
    rng = np.random.default_rng(3)
    scenes = {f"load-x{p}": (1000 * p, 10.0, SIZES[1]) for p in (1, 2, 4)} | {"pot": (1000, 10.0, SIZES[1])}

    def edit(records: list[dict]) -> None:
        more = []
        for value in [r for r in records if r["config"]["scene"] == "pot"]:
            for p in (2, 4):  # the same scene on larger pictures
                copy = json.loads(json.dumps(value))
                copy["config"]["size"] = SIZES[p]
                copy["id"] += f"{p}"
                copy["name"] = copy["name"].replace("640x360", "x".join(map(str, SIZES[p])))
                more.append(copy)
        records += more
        drift = np.exp(rng.normal(0, 0.05, SAMPLES))
        for value in records:
            p = value["config"]["threads"]
            factor = 1 + (p - 1) / 10 if value["config"]["kernel"] == "tile_parallel" else max(1, p / 2)
            times = 10 * factor * drift * np.exp(rng.normal(0, 0.002, SAMPLES))
            value["samples_ms"] = times.tolist()
            value["stages_ms"] = {stage: (times / 4).tolist() for stage in value["stages_ms"]}
            value["loop_ms"] = None
            value |= {"median_ms": float(np.median(times)), "interval_ms": None, "min_ms": float(times.min()), "max_ms": float(times.max()),
                      "p95_ms": None}

    directory = write(tmp_path_factory.mktemp("weak") / "study", plan(scenes=scenes, kernels=["tile_parallel", "triangle_atomics"], schedules=EXECUTIONS, launches=5,
                                               blocks=SAMPLES // 5, untimed=False, edit=edit))
    state(directory, *SERIES, key="weak")
    return directory


@pytest.fixture
def study(written: Path, tmp_path: Path) -> Path:
    """A copy that may be changed."""
    return Path(shutil.copytree(written, tmp_path / "study"))


def test_efficiencies(study: Path) -> None:
    analysis = analyse(study)
    found = weak.growths(analysis)
    assert [g.series.kind for g in found] == ["triangles", "pixels"] and all(g.threads == [1, 2, 4] for g in found)
    for growth in found:
        assert len(growth.curves) == 4  # two kernels, two executions; serial has one thread
        for curve in growth.curves:
            e = curve.efficiencies(analysis)
            assert e[1].value == 1 and not e[1].has_interval
            expected = {2: 1 / 1.1, 4: 1 / 1.3} if curve.name == "tile_parallel" else {2: 1.0, 4: 0.5}
            for p, value in expected.items():
                assert e[p].value == pytest.approx(value, rel=0.005) and e[p].low < e[p].value < e[p].high
                assert "paired" in e[p].kind, "drift that both met is no error"


def test_points_of_other_pictures_are_no_curve(study: Path) -> None:
    """load-x2 on 4 threads is strong scaling of that picture."""
    records = {r.name for g in weak.growths(analyse(study)) for r in g.records}
    assert not [name for name in records if name.startswith("load-x2/") and not name.endswith("/2")]
    state(study, key="weak")
    assert weak.growths(analyse(study)) == [] and weak.tables(analyse(study)) == [] and list(draw(analyse(study))) == []


def test_figure_and_table(study: Path) -> None:
    analysis = analyse(study)
    (drawing,) = draw(analysis)
    body = drawing.caption.body
    assert "Base: the same kernel and execution on one thread" in body and re.search(r"tile_parallel, (openmp|tbb)[^;]* 0\.0\d+ s", body)
    assert "square root of the threads" in body and "tables/weak_scaling.csv" in body
    (table,) = weak.tables(analysis)
    rows = list(csv.DictReader(table.csv().splitlines()))
    assert len(rows) == 2 * 4 * 3 and table.tex().count("is the base") == 2 * 4
    row = next(r for r in rows if (r["grows"], r["kernel"], r["threads"]) == ("pixels", "triangle_atomics", "4"))
    assert float(row["efficiency"]) == pytest.approx(0.5, rel=0.005) and row["pixels"] == str(1280 * 720)
    sidecar = sidecars.describe(drawing, "")
    assert sidecar["facts"]["base"] and sidecar["lines_across_categories"] == [] and sidecar["alike_in_grey"] == []
    assert sidecar["smallest_text_pt"] >= lint_figures.SMALLEST_TEXT and sidecar["size_inches"][0] <= style.FULL_WIDTH


def test_a_weak_point_has_a_base(study: Path) -> None:
    """Where each picture was drawn by its own number of threads only, one thread on its share is the base."""
    kept = [line for line in (study / "records.jsonl").read_text().splitlines()
            if (c := json.loads(line)["config"])["backend"] == "serial" or c["scene"] == f"load-x{c['threads']}"]
    (study / "records.jsonl").write_text("\n".join(kept) + "\n")

    def problems() -> list[str]:
        return [f.problem for v in lint.lint(analyse(study)).verdicts if v.rule.id == "base-case" for f in v.findings]

    assert not [p for p in problems() if "base (b)" in p]
    state(study, key="weak")
    assert [p for p in problems() if "base (b)" in p]


@pytest.mark.parametrize("wrong", [3, SERIES[0] | {"steps": [{"threads": 0, "scene": "a", "size": [1, 1]}]}, SERIES[0] | {"steps": [{"threads": 1}]},
                                   SERIES[0] | {"kind": None}])
def test_bad_series_are_refused(study: Path, wrong: object) -> None:
    state(study, wrong, key="weak")
    with pytest.raises(InputError, match=r"context.json: study.weak\[0\]: "):
        analyse(study)


def test_imbalance_shows_the_busiest_thread(study: Path) -> None:
    analysis = analyse(study)
    drawings = {d.name: d for d in imbalance.draw(analysis)}
    assert "imbalance_load_x4_640x360_f32" in drawings
    figure = drawings["imbalance_load_x4_640x360_f32"].figure
    assert len(figure.axes) == 2
    for axes, record in zip(figure.axes, imbalance.chosen(analysis, next(g for g in analysis.groups if g.title.startswith("load-x4")))):
        heights = [bar.get_height() for bar in axes.patches]
        assert len(heights) == 4 and heights == pytest.approx([entry["busy_ms"] for entry in record.per_thread])
        hatched = [bar.get_height() for bar in axes.patches if bar.get_hatch()]
        assert hatched == [max(heights)]
        (mean,) = axes.get_lines()
        assert mean.get_ydata()[0] == pytest.approx(np.mean(heights))
        assert f"max / mean = {max(heights) / np.mean(heights):.2f}" in axes.get_title(loc="left")


def test_imbalance_needs_busy_times(study: Path) -> None:
    lines = []
    for line in (study / "records.jsonl").read_text().splitlines():
        lines.append(json.dumps(json.loads(line) | {"per_thread": []}))
    (study / "records.jsonl").write_text("\n".join(lines) + "\n")
    assert list(imbalance.draw(analyse(study))) == []
