"""Ladders of techniques: which points make one, and the ratio of each rung to the one before."""

from __future__ import annotations

import copy
from typing import Any, Callable

import numpy as np
import pandas as pd
import pytest

from .. import __main__ as program
from .. import ladder, load
from ..figures import draw
from .conftest import analyse

# kernel, isa, techniques and milliseconds, in the order of a study file
STEPS = [("tile_parallel", "baseline", "none", 40.0), ("tile_parallel", "avx512", "none", 32.0), ("tile_simd", "avx512", "none", 20.0),
         ("tile_simd", "avx512", "huge_pages", 19.0), ("tile_simd", "avx512", "streaming+huge_pages", 19.0),
         ("fused_tiles", "avx512", "streaming+huge_pages", 10.0), ("fused_tiles", "avx512", "fragments+streaming+huge_pages", 9.0),
         ("fused_tiles", "avx512", "all-front_to_back", 8.0), ("fused_tiles", "avx512", "all", 5.0),
         ("scanline", "baseline", "none", 50.0), ("scanline", "avx512", "none", 42.0),
         ("tile_parallel", "avx512", "huge_pages", 31.0), ("tile_parallel", "avx512", "streaming+huge_pages", 33.0),
         ("scanline", "avx512", "huge_pages", 41.0), ("scanline", "avx512", "streaming+huge_pages", 43.0)]


def of(steps: list[tuple[str, str, str | None, float]], floor: float | None = 2.0) -> Callable[[list[dict[str, Any]]], None]:
    """Replaces a study's records by these points, whose samples meet the same drift in each block."""
    def edit(records: list[dict[str, Any]]) -> None:
        pattern = next(r for r in records if r["status"] == "ok" and r["config"]["backend"] == "openmp")
        drift = np.exp(np.random.default_rng(3).normal(0, 0.05, len(pattern["samples_ms"])))
        records.clear()
        for i, (kernel, isa, techniques, milliseconds) in enumerate(steps):
            entry = copy.deepcopy(pattern)
            entry["config"] |= {"kernel": kernel, "isa": isa, "techniques": techniques}
            samples = milliseconds * drift
            entry |= {"id": f"{i:032x}", "name": f"{kernel}/{isa}/{techniques}", "samples_ms": samples.tolist(),
                      "median_ms": float(np.median(samples)), "interval_ms": None, "floor_ms": floor,
                      "stages_ms": {"raster": samples.tolist()}, "loop_ms": None, "min_ms": float(samples.min()), "max_ms": float(samples.max())}
            records.append(entry)
    return edit


def found(study, steps, **changes):
    analysis = analyse(study(untimed=False, edit=of(steps), **changes))
    return analysis, ladder.find(analysis)


def said(steps):
    return [step.label for step in steps]


def test_the_first_ladder_climbs_in_the_order_of_the_study(study):
    _, (only,) = found(study, STEPS)
    assert said(only.ladders[0]) == [
        "tile_parallel, isa baseline, no technique", "+ isa avx512", "+ kernel tile_simd", "+ huge_pages", "+ streaming",
        "+ kernel fused_tiles", "+ fragments", "+ blocks", "+ front_to_back"]
    assert [ladder.name(steps) for steps in only.ladders] == ["tile_parallel to fused_tiles", "tile_parallel", "scanline"]
    assert said(only.ladders[2]) == ["scanline, isa baseline, no technique", "+ isa avx512", "+ huge_pages", "+ streaming"]


def test_strategies_stand_side_by_side_where_they_have_the_same(study):
    _, (only,) = found(study, STEPS)
    assert [(rung.words, [r.config.kernel for r in records]) for rung, records in only.equal] == [
        ("isa baseline, no technique", ["tile_parallel", "scanline"]),
        ("isa avx512, no technique", ["tile_simd", "tile_parallel", "scanline"]),
        ("isa avx512, huge_pages", ["tile_simd", "tile_parallel", "scanline"]),
        ("isa avx512, streaming + huge_pages", ["fused_tiles", "tile_simd", "tile_parallel", "scanline"])]


def test_ratios_are_paired(study):
    """Drift of 5 % that all points of a block share leaves the ratios exact."""
    analysis, _ = found(study, STEPS)
    rungs, equal = (table.numbers for table in ladder.tables(analysis))
    main = rungs[rungs.ladder == "tile_parallel to fused_tiles"]
    milliseconds = [ms for *_, ms in STEPS[:9]]
    assert pd.isna(main.over_rung_before.iloc[0])
    assert list(main.over_rung_before[1:]) == pytest.approx([a / b for a, b in zip(milliseconds, milliseconds[1:])])
    assert list(main.over_foot[1:]) == pytest.approx([40 / ms for ms in milliseconds[1:]])
    assert list(main.over_rung_before_low[1:]) == pytest.approx(list(main.over_rung_before[1:]))
    assert all(kind.startswith("paired") for kind in main.over_rung_before_kind[1:])
    assert list(main.times_floor) == pytest.approx([analysis.estimates[i].value / 2 for i in main.id])
    top = equal[equal.techniques == "streaming+huge_pages"]
    assert list(top.kernel) == ["fused_tiles", "tile_simd", "tile_parallel", "scanline"]
    assert list(top.time_over_fastest[1:]) == pytest.approx([1.9, 3.3, 4.3])


@pytest.mark.parametrize("steps", [
    [("tile_parallel", "avx512", "none", 9.0), ("scanline", "avx512", "none", 8.0)],  # one rung
    [("tile_parallel", "avx512", "streaming", 9.0), ("tile_parallel", "avx512", "huge_pages", 8.0)],  # neither holds the other
    [("tile_parallel", "avx512", "none", 9.0), ("scanline", "avx512", "none", 8.0), ("tile_parallel", "avx512", None, 9.0)],
    [("tile_parallel", "avx512", "none", 9.0), ("fused_tiles", "avx512", "all", 2.0)]])  # kernels as they are, none twice
def test_what_is_no_ladder(study, steps):
    analysis, ladders = found(study, steps)
    assert not ladders and not ladder.tables(analysis) and not [d for d in draw(analysis) if d.section == ladder.SECTION]


def test_studies_without_an_axis_have_none(full):
    _, analysis, written = full
    assert not ladder.find(analysis) and ladder.SECTION not in written.path.read_text()


def test_a_kernel_is_climbed_upwards_whatever_the_order(study):
    _, (only,) = found(study, [("tile_simd", "avx512", None, 5.0), ("tile_simd", "avx2", None, 8.0)])
    assert said(only.ladders[0]) == ["tile_simd, isa avx2, no technique", "+ isa avx512"]


def test_executions_have_ladders_of_their_own(study):
    def edit(records):
        of(STEPS)(records)
        for entry in copy.deepcopy(records):
            entry["config"]["threads"] = 7
            entry["id"] = "f" + entry["id"][1:]
            records.append(entry)

    analysis = analyse(study(untimed=False, edit=edit))
    two = ladder.find(analysis)
    assert [l.title.rpartition(" on ")[2] for l in two] == ["1 thread", "7 threads"] and two[0].slug != two[1].slug


def test_figures(study):
    analysis, _ = found(study, STEPS)
    drawings = {d.name.partition("_teapot")[0]: d for d in draw(analysis) if d.section == ladder.SECTION}
    assert set(drawings) == {"ladder", "equal_rungs"}
    words = [t.get_text() for t in drawings["ladder"].figure.axes[0].texts]
    assert "+ front_to_back" in words and any(w.startswith("\u00f7 1.6") for w in words)  # 8 ms to 5 ms
    assert "Dotted: the floor" in drawings["ladder"].caption.body
    words = [t.get_text() for t in drawings["equal_rungs"].figure.axes[0].texts]
    assert words.count("fastest") == 4 and any(w.startswith("\u00d7 4.3") for w in words) and "isa avx512, streaming + huge_pages" in words


def test_reports_have_the_section(study, capsys):
    directory = study(untimed=False, edit=of(STEPS, floor=None))
    assert program.main(["report", str(directory)]) == 0
    html = (directory / "report.html").read_text()
    assert ladder.SECTION in html and "What each technique gives" in html and "Strategies at equal rungs" in html
    assert (directory / "tables" / "ladder.csv").is_file() and (directory / "tables" / "equal_rungs.tex").is_file()


@pytest.mark.parametrize("words,names", [("all", load.TECHNIQUES), ("none", ()), ("all-streaming", ("fragments", "blocks", "front_to_back", "huge_pages")),
                                         ("fragments+huge_pages", ("fragments", "huge_pages"))])
def test_texts_of_records(words, names):
    assert load.technique_set(words) == frozenset(names)


@pytest.mark.parametrize("value,problem", [("streeming", "unknown technique 'streeming'"), ("all-", "unknown technique ''"), (3, "expected text"),
                                           ("", "expected text")])
def test_bad_texts_are_refused(study, value, problem):
    def spoil(records):
        records[0]["config"]["techniques"] = value

    with pytest.raises(load.InputError, match=f"records.jsonl:1: config.techniques: {problem}"):
        load.load(study(edit=spoil))
