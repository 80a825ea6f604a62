"""The trade between speed and accuracy: bases, fronts and what is said of them, on studies whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable

import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from .. import findings, load, report, tables, trade, trade_tables, trade_text
from ..comparison import Analysis
from ..figures import pareto
from ..fronts import DEPTH, END_TO_END, LITERAL, MEASURES, WRONG, Front, Mark, Measure
from . import synthetic, synthetic_modes
from .conftest import analyse
from .report_test import parse
from .synthetic_modes import MODES, Mode

FEW = {name: MODES[name] for name in ("two_product", "f32", "f32_incremental", "f64", "fixed_8", "filtered", "filtered-f64", "f32-fastmath")}
TWO = {name: synthetic_modes.SCENES[name] for name in ("dungeon", "confetti_heavy")}


@pytest.fixture
def modes(tmp_path: Path) -> Callable[..., Analysis]:
    """An accuracy study of two scenes; the names of Plan's fields change it."""
    def make(known: dict[str, Mode] = FEW, then: Callable[[list[dict[str, Any]]], None] | None = None, rays: bool = True,
             **changes: Any) -> Analysis:
        def edit(records: list[dict[str, Any]]) -> None:
            synthetic_modes.spread(known, rays=rays)(records)
            if then is not None:
                then(records)

        plan = synthetic_modes.plan(**(dict(scenes=TWO, edit=edit) | changes))
        return analyse(synthetic.write(tmp_path / "study", plan, pictures=False))

    return make


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """The study as it is, for tests that only read it."""
    plan = synthetic_modes.plan(scenes=TWO, edit=synthetic_modes.spread(FEW))
    return analyse(synthetic.write(tmp_path_factory.mktemp("plain"), plan, pictures=False))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Analysis, report.Written]:
    plan = synthetic_modes.plan(scenes=TWO, edit=synthetic_modes.spread(FEW))
    directory = synthetic.write(tmp_path_factory.mktemp("accuracy"), plan, pictures=False)
    analysis = analyse(directory)
    return directory, analysis, report.write(analysis)


def front(analysis: Analysis, measure: Measure = WRONG) -> Front:
    """Of the first picture, each mode with its fastest point."""
    whole = trade.of(analysis)
    return whole.front(first(whole), measure)


def first(whole: trade.Trade) -> trade.View:
    return whole.fastest[whole.pictures[0].slug]


def names(marks: list[Mark]) -> list[str]:
    return [mark.name for mark in marks]


# the base

def test_the_literal_program_is_the_base(plain):
    whole = trade.of(plain)
    for picture in whole.pictures:
        config = whole.base(picture).config
        assert (config.numeric, config.kernel, config.backend) == ("two_product", "all_pixels", "serial")


def test_speedups_are_those_of_the_model(modes):
    analysis = modes(noise=0.001)
    found = {mark.name: mark.speedup for mark in front(analysis).marks}
    config = next(c for c in synthetic.configs(synthetic_modes.plan(scenes=TWO)) if c["kernel"] == "tile_parallel" and c["threads"] == 2)
    plan = synthetic_modes.plan(scenes=TWO)
    base = plan.scenes["dungeon"][1] * MODES["two_product"].time
    for name in ("f32", "f64", "filtered"):
        expected = base / (synthetic.mean_time(plan, config) * MODES[name].time)
        assert found[name].value == pytest.approx(expected, rel=0.02)
        assert found[name].low <= found[name].value <= found[name].high
    assert found[LITERAL].value == 1


def test_bounding_box_stands_in_for_all_pixels(modes):
    def withhold(records):
        for entry in records:
            if entry["config"]["kernel"] == "all_pixels":
                synthetic.withhold(entry, "skipped", "predicted cost of 794 s exceeds the limit")

    whole = trade.of(modes(then=withhold))
    base = whole.base(whole.pictures[0])
    assert base.config.kernel == "bounding_box" and whole.is_literal(base)
    assert "visits every pixel as the text says, is not the base here" in trade_text.base(whole, first(whole))


def test_one_kernel_is_the_base_of_all_scenes(modes):
    def withhold(records):
        entry = next(e for e in records if e["config"]["kernel"] == "all_pixels")
        synthetic.withhold(entry, "skipped", "too slow")

    whole = trade.of(modes(then=withhold))
    assert [whole.base(p).config.kernel for p in whole.pictures] == ["bounding_box", "all_pixels"]
    assert all([b.config.kernel for b in view.bases] == ["bounding_box"] * 2 for view in whole.over_scenes)


def test_without_the_literal_program_f32_is_the_base(modes):
    analysis = modes({k: v for k, v in FEW.items() if k != "two_product"})
    whole = trade.of(analysis)
    assert whole.base(whole.pictures[0]).config.numeric == "f32" and not whole.loops
    assert LITERAL not in names(front(analysis).marks)
    assert "because the literal program was not timed" in trade_text.base(whole, first(whole))


def test_a_literal_program_with_other_rules_is_found_and_said(modes):
    def off(records):
        for entry in records:
            if entry["config"]["kernel"] == "all_pixels":
                entry["config"]["near"] = "off"
        records[:] = [e for e in records if e["config"]["numeric"] != "two_product" or e["config"]["near"] == "off"]

    whole = trade.of(modes(then=off))
    assert "serial, near off" in trade_text.base(whole, first(whole))


# the front

def test_frontier_and_dominated_modes_are_those_of_the_model(plain):
    found = front(plain)
    assert names(found.frontier) == ["f32-fastmath", "f32", "filtered"]
    assert {"f64", "filtered-f64", "f32_incremental", "two_product"} <= found.dominated.keys()
    # fixed_8 is faster than f32 and has more wrong pixels than f32-fastmath, which is faster still.
    assert found.dominated["fixed_8"] == "f32-fastmath" and found.dominated["f64"] == "filtered"
    assert names(found.bounded_frontier) == ["fixed_8", "f32", "filtered"]
    assert [found.role(name) for name in ("f32", "f64", LITERAL, "ray_cast")] == ["frontier", "dominated by filtered", "\u2013", "\u2013"]
    assert names(front(plain, DEPTH).frontier)[-1] == "filtered-f64"
    assert "ray_cast" not in names(found.marks) and "ray_cast" in names(front(plain, END_TO_END).marks)


def test_no_mark_of_the_frontier_is_bettered_and_every_other_is(plain):
    for measure in MEASURES:
        found = front(plain, measure)
        for mark in found.marks:
            better = [m for m in found.marks if m is not mark and m.error <= mark.error and m.speedup.value >= mark.speedup.value]
            assert bool(better) != (mark in found.frontier)


def test_equal_modes_are_hardly_ever_called_dominated(tmp_path):
    """Modes of one speed and one error: nothing tells them apart, so none is dominated."""
    known = {"two_product": MODES["two_product"]} | {f"m{i}": Mode(1.0, 10, 40) for i in range(8)}
    claimed = 0
    for seed in range(12):
        plan = synthetic_modes.plan(scenes={"dungeon": TWO["dungeon"]}, seed=seed, edit=synthetic_modes.spread(known, ("tile_parallel",), False))
        analysis = analyse(synthetic.write(tmp_path / str(seed), plan, pictures=False))
        claimed += bool(front(analysis).dominated)
    assert claimed <= 1


def test_few_samples_claim_no_dominance_and_no_finding(modes):
    analysis = modes(blocks=4)
    found = front(analysis)
    assert not found.dominated and "f64" in found.open
    assert trade_text.finding(analysis) is None


def test_a_less_wrong_mode_dominates_one_of_about_equal_speed(modes):
    known = {"two_product": MODES["two_product"], "good": Mode(0.995, 0, 1.0), "bad": Mode(1.0, 500, 100.0)}
    found = front(modes(known, noise=0.002, blocks=20))
    assert found.dominated.get("bad") == "good"


def test_failed_modes_show_no_speed(modes):
    def fail(records):
        for entry in records:
            if entry["config"]["numeric"] == "fixed_8":
                entry["verify"]["oracle"].update(unexplained=7, within_bound=False)
                synthetic.withhold(entry, "failed", "7 pixels are wrong beyond the stated bound")

    analysis = modes(then=fail)
    whole = trade.of(analysis)
    assert "fixed_8" not in names(front(analysis).marks) and all("fixed_8" in view.missing for view in whole.over_scenes)
    row = next(t for t in trade_tables.tables(analysis) if t.name == "trade_dungeon_1920x1080").numbers.set_index("mode").loc["fixed_8"]
    assert row.status == "failed" and pd.isna(row.median_ms) and pd.isna(row.speedup_over_base)
    assert row.wrong == round(MODES["fixed_8"].wrong * synthetic_modes.HARDNESS[0] * 1920 * 1080 / 1e6)  # its verdict is kept
    assert any("7 pixels are wrong beyond the stated bound" in words for words in trade_text.summary(analysis))
    time = next(t for t in trade_tables.tables(analysis) if t.name == "accuracy_time").words.set_index("mode")
    assert time.loc["fixed_8", "dungeon"] == "failed"


# over scenes

def test_over_scenes_are_geometric_means_and_plain_means(plain):
    whole = trade.of(plain)
    view = whole.over_scenes[-1]
    assert not view.one_loop
    single = [{m.name: m for m in whole.front(whole.fastest[p.slug], WRONG).marks} for p in whole.pictures]
    marks = whole.front(view, WRONG).marks
    for mark in marks:
        each = [found[mark.name] for found in single]
        assert mark.speedup.value == pytest.approx(np.prod([m.speedup.value for m in each]) ** (1 / len(each)))
        assert mark.error == pytest.approx(np.mean([m.error for m in each]))
        worst = max(each, key=lambda m: (m.error, -m.speedup.value))
        assert (mark.worst.error, mark.worst.speedup) == (worst.error, worst.speedup.value)
    f32 = next(m for m in marks if m.name == "f32")
    assert f32.worst.scene == "confetti_heavy"  # the harder one
    assert f32.speedup.low < f32.speedup.value < f32.speedup.high


def test_over_scenes_a_mode_stands_for_one_kernel_and_execution(modes):
    """tile_parallel, which is faster, was timed on one of the two scenes only."""
    def drop(records):
        records[:] = [e for e in records if e["config"]["kernel"] != "tile_parallel" or e["config"]["scene"] == "dungeon"]

    whole = trade.of(modes(then=drop, rays=False))
    view = whole.over_scenes[-1]
    assert {r.config.kernel for records in view.modes.values() for r in records} == {"bounding_box"}
    assert whole.fastest["dungeon_1920x1080"].modes["f32"][0].config.kernel == "tile_parallel"


def test_in_the_loop_of_the_literal_program_only_the_arithmetic_differs(plain):
    whole = trade.of(plain)
    loops = [whole.over_scenes[0], *whole.loops.values()]
    assert len(loops) == 3
    for view in loops:
        points = [r.config for records in (view.bases, *view.modes.values()) for r in records]
        assert {(c.kernel, c.backend) for c in points} == {("bounding_box", "serial")} and view.one_loop
        found = {mark.name: mark.speedup.value for mark in whole.front(view, WRONG).marks}
        for name in ("f32", "f64", "filtered"):
            assert found[name] == pytest.approx(FEW["two_product"].time / FEW[name].time, rel=0.02)
    assert "only the arithmetic differs" in trade_text.points(loops[0])


def test_views_of_the_same_points_are_drawn_once(modes):
    def serial(records):
        records[:] = [e for e in records if (e["config"]["kernel"], e["config"]["backend"]) == ("bounding_box", "serial")]

    whole = trade.of(modes(then=serial, rays=False))
    assert len(whole.over_scenes) == 1 and not whole.loops and len(whole.views()) == 3


def test_a_mode_that_a_scene_lacks_is_not_averaged(modes):
    def drop(records):
        records[:] = [e for e in records if e["config"]["numeric"] != "f64" or e["config"]["scene"] != "dungeon"]

    whole = trade.of(modes(then=drop))
    for view in whole.over_scenes:
        assert "f64" in view.missing and "f64" not in names(whole.front(view, WRONG).marks)


def test_one_scene_has_no_mean(modes):
    analysis = modes(scenes={"dungeon": TWO["dungeon"]})
    assert not trade.of(analysis).over_scenes
    assert "frontier of 8 numeric modes" in trade_text.finding(analysis)


# what is said

def test_summary_names_frontier_dominated_worst_scene_and_unbounded(plain):
    said = " ".join(trade_text.summary(plain))
    for words in ("on the frontier: f32-fastmath", "no bound)", "Of the modes with a bound: fixed_8, f32 and filtered.", "f64 and filtered-f64 by filtered",
                  "Worst scene: confetti_heavy for", "Without a bound: two_product and f32-fastmath.",
                  "not judged against the oracle, which needs the screen triangles of a mode: ray_cast"):
        assert words in said, words


def test_finding_names_both_ends_of_the_frontier(plain):
    assert [f.kind for f in findings.top(plain)].count("trade") == 1
    said = trade_text.finding(plain)
    assert "from f32-fastmath" in said and "without a bound" in said and "to filtered" in said and "with no wrong pixel" in said


def test_a_winner_that_depends_on_the_arithmetic_does_not_depend_on_the_scene(plain):
    assert not [f for f in findings.candidates(plain) if f.kind == "winners"]


# tables

def test_costs_compare_within_one_kernel_and_execution(modes):
    analysis = modes(noise=0.001)
    rows = trade_tables.costs(trade.of(analysis))
    assert {row["kernel"] for row in rows} == {"bounding_box", "tile_parallel"}  # all_pixels and ray_cast have one mode each
    for row in rows:
        for reference, ratio in row["ratios"].items():
            assert ratio.value == pytest.approx(FEW[row["mode"]].time / FEW[reference].time, rel=0.02)
            assert row["mode"] != reference


def test_costs_prefer_the_same_instruction_set(modes):
    def vectors(records):
        for entry in [e for e in records if e["config"]["numeric"] in ("f32", "filtered")]:
            made = synthetic_modes.twin(entry, entry["config"]["numeric"], Mode(0.25, 0, 1), 1.0)
            made["config"]["isa"], made["id"] = "avx2", made["id"][::-1]
            records.append(made)

    rows = trade_tables.costs(trade.of(modes(then=vectors, noise=0.001)))
    ratios = {(row["mode"], row["isa"]): row["ratios"].get("f32") for row in rows if row["kernel"] == "tile_parallel"}
    assert ratios["filtered", "avx2"].value == pytest.approx(1.06, rel=0.02) == ratios["filtered", "baseline"].value
    assert ratios["f32", "avx2"] is None


def test_matrices_hold_what_the_records_say(plain):
    made = {table.name: table for table in trade_tables.tables(plain)}
    wrong, depth = (made[name].numbers.set_index("mode") for name in ("accuracy_wrong", "accuracy_depth"))
    for record in plain.study.timed:
        oracle = record.verify["oracle"]
        if oracle is None:
            assert pd.isna(wrong.loc["ray_cast", record.config.scene])
        else:
            assert wrong.loc[record.config.numeric, record.config.scene] == oracle["wrong"]
            assert depth.loc[record.config.numeric, record.config.scene] == oracle["max_depth_error_steps"]
    assert made["accuracy_time"].words.set_index("mode").loc["f32", "dungeon"] == "1"
    verdicts = made["verdicts_dungeon_1920x1080"].words.set_index("mode")
    assert verdicts.loc["two_product", "oracle"] == "unbounded" and verdicts.loc["filtered", "oracle"] == "within its bound"
    assert verdicts.loc["f32", "Embree: edge/depth/error"] == "38/3/0" and verdicts.loc["two_product", "could be wrong"] == "no bound"
    assert list(verdicts.loc[["fixed_8", "f32"], "wrong on snapped"]) == ["0", "\u2013"]


def test_accuracy_verdicts():
    def verdict(**verify):
        return tables.accuracy(load.Record(1, "i", "n", None, "ok", "", None, {}, None, verify, {}, None, (), None, None, None))

    assert verdict(oracle={"wrong": 0, "max_depth_error_steps": None, "within_bound": True}) == "exact"
    assert verdict(oracle={"wrong": 5, "max_depth_error_steps": 0, "within_bound": True}) == "within its bound"
    assert verdict(oracle={"wrong": 5, "unexplained": 1, "within_bound": False}) == "outside its bound"
    assert verdict(oracle={"wrong": 0, "max_depth_error_steps": 0, "predicted": -1, "within_bound": True}) == "unbounded"
    assert verdict(oracle={"edge_ties": 0, "errors": 0, "max_depth_error_steps": 0}) == "exact"  # older records
    assert verdict(oracle={"edge_ties": 2, "errors": 0, "within_bound": True}) == "within its bound"
    assert verdict(oracle=None) == "not judged"


# the report

def test_report_has_the_section_with_figures_and_tables(written):
    directory, _, made = written
    page, links = parse(made.path)
    assert f"<h2>{trade.SECTION}</h2>" in page and page.count(f"<h2>{trade.SECTION}</h2>") == 1
    for words in ("Wrong pixels, modes x scenes", "What a mode costs relative to f64", "Verdicts, dungeon", "Stated bounds"):
        assert words in page, words
    assert "Median milliseconds, dungeon 1920x1080 f64<" not in page and "tables of scenes and numeric modes with few points" in page
    for name in ("pareto_over_scenes", "pareto_over_scenes_loop", "pareto_dungeon_1920x1080_loop", "pareto_dungeon_1920x1080", 
                 "pareto_confetti_heavy_1920x1080"):
        for kind in ("svg", "pdf", "png"):
            assert (directory / "figures" / f"{name}.{kind}").stat().st_size > 5000
        image = matplotlib.image.imread(directory / "figures" / f"{name}.png")
        assert image.shape[1] <= 1100 and image.shape[0] <= 1500
        for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
            assert edge[..., :3].min() > 0.99, name
    for name in ("accuracy_wrong", "accuracy_time", "trade_over_scenes", "mode_cost_f32", "mode_cost_f64", "verdicts_dungeon_1920x1080"):
        assert (directory / "tables" / f"{name}.csv").stat().st_size and (directory / "tables" / f"{name}.tex").stat().st_size
    for path in (directory / "tables").glob("*.tex"):
        assert path.read_text().count(r"\begin") == path.read_text().count(r"\end{")


def test_older_records_have_no_such_section(full):
    directory, analysis, made = full
    page, _ = parse(made.path)
    assert f"<h2>{trade.SECTION}</h2>" not in page and not list((directory / "figures").glob("pareto*"))
    assert trade_tables.tables(analysis) == [] and trade_text.summary(analysis) == [] and trade_text.finding(analysis) is None


def test_one_mode_has_no_such_section(modes):
    analysis = modes({"f32": MODES["f32"]}, rays=False)
    assert not trade.of(analysis).pictures


@pytest.mark.parametrize("spoil", [
    lambda v: v.pop("end_to_end"), lambda v: v.pop("bound"), lambda v: v.update(embree={"skipped": "not built"}), lambda v: v.update(embree=None),
    lambda v: v["oracle"].update(max_depth_error_steps=None) if v["oracle"] else None, lambda v: v.update(end_to_end=None),
    lambda v: v.update(oracle={"renderer": "double", "identical": 5, "edge_ties": 1, "depth_ties": 0, "errors": 0}) if v["oracle"] else None,
    lambda v: v.update(oracle={"wrong": v["oracle"]["wrong"]}) if v["oracle"] else None])
def test_verdicts_may_lack_parts(modes, spoil):
    def thin(records):
        for i, entry in enumerate(records):
            if i % 2 or entry["config"]["scene"] == "dungeon":
                spoil(entry["verify"])

    analysis = modes({name: FEW[name] for name in ("two_product", "f32", "filtered")}, then=thin)
    trade_text.summary(analysis)
    findings.candidates(analysis)
    tables.tables(analysis)
    for table in trade_tables.tables(analysis):
        assert table.csv() and table.tex()
    for drawing in pareto.draw(analysis):
        assert drawing.caption.body


def test_nothing_is_said_of_speed_where_nothing_was_timed(modes):
    def withhold(records):
        for entry in records:
            synthetic.withhold(entry, "skipped", "time limit")

    analysis = modes(then=withhold)
    assert list(pareto.draw(analysis)) == [] and trade_text.finding(analysis) is None
    assert any(t.name == "accuracy_wrong" for t in trade_tables.tables(analysis))
    page = report.write(analysis).path.read_text()
    assert f"<h2>{trade.SECTION}</h2>" in page and "Wrong pixels, modes x scenes" in page
    assert "speedup over" not in " ".join(trade_text.summary(analysis))
