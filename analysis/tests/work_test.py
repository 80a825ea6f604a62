"""Time against work, the map of winners, the efficiency of stages: from records whose answers are known."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from .. import __main__ as program
from .. import stage_efficiency, strategy_map, tables, work
from ..figures import draw, floors
from .conftest import analyse
from .synthetic import digest

COUNTS = (1000, 10_000, 100_000)


def known(directory):
    """The study again, with scenes in its context: `model` of each."""
    context = json.loads((directory / "context.json").read_text())
    records = [json.loads(line) for line in (directory / "records.jsonl").read_text().splitlines()]
    return context, records


def rewrite(directory, context, records):
    (directory / "context.json").write_text(json.dumps(context))
    (directory / "records.jsonl").write_text("".join(json.dumps(r) + "\n" for r in records))
    return directory


def copy_of(record, factor, floor=None, **config):
    """A record at other axes whose times are the record's times a factor."""
    new = json.loads(json.dumps(record))
    new["config"] |= config
    new["id"], new["name"] = digest(new["config"]), record["name"] + str(config)
    new["samples_ms"] = [t * factor for t in new["samples_ms"]]
    new["stages_ms"] = {s: v and [t * factor for t in v] for s, v in new["stages_ms"].items()}
    new["floor_ms"] = floor
    return new


@pytest.fixture
def growing(study):
    """Times in proportion to triangles for scanline, to their root for tile_parallel, and to pixels for both."""
    directory = study(kernels=["tile_parallel", "scanline"], schedules=[("openmp", "static", None)], untimed=False)
    context, records = known(directory)
    # scanline is serial here, tile_parallel also on 1 and 2 threads.
    context["scenes"] = {f"mesh-{t}": {"model": f"teapot:triangles={t}", "triangles": t} for t in COUNTS}
    found = []
    for record in records:
        power = 1.0 if record["config"]["kernel"] == "scanline" else 0.5
        for t in COUNTS:
            new = copy_of(record, (t / COUNTS[0]) ** power, floor=t / 1e6, scene=f"mesh-{t}", scene_hash=str(t))
            new["work"]["triangles"] = t
            found.append(new)
        for lines in (720, 1080):
            size = [lines * 16 // 9, lines]
            pixels = size[0] * size[1] / (640 * 360)
            new = copy_of(record, pixels, floor=pixels, scene="mesh-1000", scene_hash="1000", size=size)
            new["work"]["triangles"] = 1000
            found.append(new)
    return rewrite(directory, context, found)


def test_slopes_are_those_of_the_times(growing):
    analysis = analyse(growing)
    by_kind = {growth.kind: growth for growth in work.growths(analysis)}
    assert set(by_kind) == {"triangles", "pixels"}
    triangles = by_kind["triangles"]
    assert list(triangles.amounts) == list(COUNTS) and list(triangles.curves) == [1, 2]
    slopes = {curve.name: list(curve.slopes(analysis).values()) for curve in triangles.curves[1]}
    assert slopes["scanline"] == pytest.approx([1, 1]) and slopes["tile_parallel"] == pytest.approx([0.5, 0.5])
    assert list(by_kind["pixels"].amounts.values()) == ["640x360", "1280x720", "1920x1080"]
    assert all(slope == pytest.approx(1) for c in by_kind["pixels"].curves[1] for slope in c.slopes(analysis).values())
    assert work.floor_of(triangles, 1) == {t: t / 1e6 for t in COUNTS}


def test_the_fastest_execution_stands_for_a_kernel(growing):
    (curve,) = [c for c in work.growths(analyse(growing))[0].curves[1] if c.name == "tile_parallel"]
    medians = {e: r.raw["median_ms"] for e in ("serial", "openmp static") for r in analyse(growing).study.timed
               if r.config.kernel == "tile_parallel" and r.config.threads == 1 and r.config.scene == f"mesh-{COUNTS[-1]}"
               and r.config.backend == e.split()[0]}
    assert curve.execution == min(medians, key=medians.get)


def test_figure_of_work(growing):
    drawings = {d.name: d for d in draw(analyse(growing)) if d.name.startswith("work_")}
    assert len(drawings) == 2
    for drawing in drawings.values():
        one, two = drawing.figure.axes
        assert [axes.get_title(loc="left") for axes in (one, two)] == ["1 thread", "2 threads"]
        assert one.get_xscale() == one.get_yscale() == "log" and one.get_ylim() == two.get_ylim()
        assert all(any(line.get_label() == floors.DRAWN for line in axes.get_lines()) for axes in (one, two))
        said = [words.get_text() for legend in drawing.figure.legends for words in legend.get_texts()]
        assert {"scanline", "tile_parallel", floors.LABEL} <= set(said) and any("slope 1" in words for words in said)
        assert "slope over its last step" in drawing.caption.body and "Dotted: the floor" in drawing.caption.body
    assert "1.00" in {t.get_text() for t in next(d for n, d in drawings.items() if "triangles" in n).figure.axes[0].texts}


def test_peers_are_named(growing):
    context, records = known(growing)
    peers = [copy_of(r, 2, r["floor_ms"], kernel="llvmpipe", numeric="llvmpipe", backend="llvmpipe", fill="top-left", isa="jit",
                     schedule=None, tile=None) for r in records if r["config"]["kernel"] == "scanline" and r["config"]["threads"] == 1]
    for peer in peers:
        truth = {"errors": 0, "wrong": 3, "edge_ties": 2, "depth_ties": 1, "max_depth_error_steps": 4}
        peer["verify"] = {"conforms": None, "end_to_end": truth}
        peer["stages_ms"] = {"clear": None, "geometry": None, "raster": peer["samples_ms"], "resolve": None}
    analysis = analyse(rewrite(growing, context, records + peers))
    assert all(any(c.is_peer and c.name == "llvmpipe (peer)" for c in g.curves[1]) for g in work.growths(analysis))
    words = tables.verification(analysis).words
    rows = words[words.kernels == "llvmpipe (peer)"]
    # One a picture: 3 numbers of triangles and 2 more sizes.
    assert sorted(rows.points) == [1] * len(rows) and len(rows) == 5
    assert set(rows.accuracy) == {"within its bound"} and set(rows.conforms) == {"–"}
    assert set(rows.wrong) == {"3"} and set(rows.edge) == {"2"} and set(rows.depth) == {"1"}


def test_nothing_is_said_without_such_data(study):
    analysis = analyse(study())
    assert work.growths(analysis) == work.tables(analysis) == [] and strategy_map.maps(analysis) == strategy_map.tables(analysis) == []
    assert not any(d.name.startswith(("work_", "map_")) for d in draw(analysis))


GRID = {(t, p): (t, p) for t in (100, 1000, 10_000) for p in (1.0, 10.0, 100.0)}


@pytest.fixture
def grid(study):
    return write_grid(study)


def write_grid(study, everywhere=None):
    """A grid without its largest cell. scanline wins below 500 triangles, tile_parallel above; in one cell all take the same time.
    everywhere: a kernel that leads all cells."""
    directory = study(kernels=["tile_parallel", "scanline"], schedules=[("openmp", "static", None)], threads=[1], untimed=False, blocks=14)
    context, records = known(directory)
    base = next(r for r in records if r["config"]["kernel"] == "tile_parallel" and r["config"]["backend"] == "serial")
    rng = np.random.default_rng(5)
    context["scenes"], found = {}, []
    for t, p in GRID:
        if (t, p) == (10_000, 100.0):
            continue
        scene = f"c{t}x{p:g}"
        context["scenes"][scene] = {"model": f"confetti:triangles={t},size={p:g}", "triangles": t}
        for kernel in ("scanline", "tile_parallel"):
            slow = 1.0 if (t, p) == (1000, 10.0) else 2.0 if (kernel == "scanline") == (t > 500) else 1.0
            new = copy_of(base, slow, scene=scene, scene_hash=scene, kernel=kernel)
            new["samples_ms"] = [x * math.exp(rng.normal(0, 0.01)) for x in new["samples_ms"]]
            # 3 % off the grid, as random triangles are.
            new["work"] |= {"triangles": t, "drawn": t, "fragments_covered": int(t * p * 1.03)}
            found.append(new)
        if everywhere:
            found.append(copy_of(base, 0.25, scene=scene, scene_hash=scene, kernel=everywhere) | {"work": new["work"]})
    return rewrite(directory, context, found)


def test_map_has_the_winners(grid):
    (found,) = strategy_map.maps(analyse(grid))
    assert found.columns == [(100, 100), (1000, 1000), (10_000, 10_000)] and len(found.rows) == 3
    winners = {place: cell.winner for place, cell in found.cells.items()}
    assert (2, 2) not in winners and len(winners) == 8  # unmeasured
    assert winners.pop((1, 1)) == strategy_map.TIE
    assert all(winner == ("scanline" if x == 0 else "tile_parallel") for (_, x), winner in winners.items())
    assert all(cell.lead.value == pytest.approx(2, rel=0.02) for place, cell in found.cells.items() if place != (1, 1))
    for (y, _), cell in found.cells.items():
        assert cell.pixels_per_triangle == pytest.approx(1.03 * 10**y, rel=0.01)  # of the work, not of the name


def test_a_strategy_that_leads_everywhere_does_not_hide_the_others(study):
    analysis = analyse(write_grid(study, "fused_tiles"))
    whole, rest = strategy_map.maps(analysis)
    assert whole.leaders == {"fused_tiles"} and whole.without == () and rest.without == ("fused_tiles",)
    assert rest.leaders == {"scanline", "tile_parallel"} and rest.kernels == ["scanline", "tile_parallel"]
    assert rest.cells[1, 1].winner == strategy_map.TIE
    assert all(cell.lead.value == pytest.approx(2, rel=0.02) for place, cell in rest.cells.items() if place != (1, 1))
    first, second = (d for d in draw(analysis) if d.name.startswith("map_"))
    assert first.name != second.name and "but for fused_tiles" in second.caption.title + second.caption.plain
    assert len({table.name for table in strategy_map.tables(analysis)}) == 2


def test_figure_of_the_map(grid):
    analysis = analyse(grid)
    (drawing,) = [d for d in draw(analysis) if d.name.startswith("map_")]
    (axes,) = drawing.figure.axes
    words = [t.get_text() for t in axes.texts]
    assert words.count("scanline") + words.count("tile_parallel") == 8 and sum(w.startswith("tie: ") for w in words) == 1
    assert sum(w.endswith("x") for w in words) == 7
    said = [t.get_text() for legend in drawing.figure.legends for t in legend.get_texts()]
    assert "scanline" in said and any("blank" in w for w in said) and any("tie" in w for w in said)
    assert "1 cell of 9 is blank" in drawing.caption.body
    assert not any(d.name.startswith("work_triangles") for d in draw(analysis))  # a grid is no curve
    table = strategy_map.tables(analysis)[0]
    assert len(table.numbers) == 8 and (table.numbers.tied == "").sum() == 7


def test_efficiency_of_stages(study):
    def edit(records):
        for r in records:
            if r["config"]["threads"] == 2 and r["config"]["backend"] == "openmp":
                one = next(o for o in records if {**o["config"], "threads": 2} == r["config"] and o["config"]["threads"] == 1)
                # geometry does not scale, raster does, resolve at 3/4
                for stage, factor in (("geometry", 1.0), ("raster", 0.5), ("resolve", 1 / 1.5)):
                    r["stages_ms"][stage] = one["stages_ms"][stage] and [t * factor for t in one["stages_ms"][stage]]
                r["stages_ms"]["clear"] = None

    kernels = ["triangle_atomics", "tile_parallel"]
    analysis = analyse(study(kernels=kernels, schedules=[("openmp", "static", None)], edit=edit, untimed=False))
    (group,) = analysis.groups
    found = {e.record.config.kernel: e for e in stage_efficiency.efficiencies(analysis, group)}
    assert set(found) == {"triangle_atomics", "tile_parallel"}
    stages = found["triangle_atomics"].stages
    expected = {"geometry": 0.5, "raster": 1.0, "resolve": 0.75}
    assert {s: stages[s].value for s in expected} == pytest.approx(expected)
    assert "clear" not in stages and stages["raster"].has_interval and stage_efficiency.TOTAL in stages
    assert "geometry" not in found["tile_parallel"].stages  # fused in the synthetic study
    (table,) = stage_efficiency.tables(analysis)
    rows = table.words.set_index("kernel")
    assert rows.loc["tile_parallel"].geometry == "none" and rows.loc["triangle_atomics"]["clear"] == "none"
    assert rows.loc["triangle_atomics"].raster.startswith("1.000") and set(rows.base) == {"itself, 1 thread"}
    (drawing,) = [d for d in draw(analysis) if d.name.startswith("stage_efficiency_")]
    assert "no clear, geometry" in [t.get_text() for t in drawing.figure.axes[0].texts]


def test_efficiency_over_the_serial_backend_says_so(study):
    analysis = analyse(study(kernels=["triangle_atomics"], schedules=[("openmp", "static", None)], threads=[2], untimed=False))
    (one,) = stage_efficiency.efficiencies(analysis, analysis.groups[0])
    assert one.over_serial and one.base.config.backend == "serial"
    (table,) = stage_efficiency.tables(analysis)
    assert list(table.words.base) == ["serial, 1 thread"] and list(table.numbers.base_is) == ["serial"]


def test_stages_and_schedules_have_the_floor(study):
    def edit(records):
        for r in records:
            r["floor_ms"] = 0.5 * min(x["median_ms"] for x in records if x["status"] == "ok") / r["config"]["threads"]
    analysis = analyse(study(schedules=[("openmp", "static", c) for c in (None, 4, 16)], edit=edit))
    drawings = {d.name.partition("_")[0]: d for d in draw(analysis)}
    (axes,) = drawings["stages"].figure.axes
    lines = [list(line.get_xdata()) for line in axes.get_lines() if line.get_label() == floors.DRAWN]
    assert sorted({x[0] for x in lines}) == pytest.approx(sorted({r.floor_ms for r in analysis.study.timed}))
    assert "Dotted: the floor" in drawings["stages"].caption.body
    assert "; floor " in "".join(t.get_text() for t in drawings["schedules"].figure.texts)
    assert "times for tile_parallel" in drawings["schedules"].caption.body


@pytest.mark.parametrize("kind, section", [("growing", work.SECTION), ("grid", strategy_map.SECTION)])
def test_reports_are_whole(kind, section, request, capsys):
    directory = request.getfixturevalue(kind)
    assert program.main(["report", str(directory)]) == 0
    html = (directory / "report.html").read_text()
    assert f"<h2>{section}</h2>" in html and f"<h2>{stage_efficiency.SECTION}</h2>" in html
