"""The floor of a point in figures and tables, and reports of records that have none."""

from __future__ import annotations

import json

import pandas as pd
import pytest

from .. import __main__ as program
from .. import checks, load, tables
from ..figures import draw, floors
from .conftest import FEW, analyse


def with_floors(share: float):
    """Floors that are a share of the fastest time of the study over threads."""
    def edit(records):
        fastest = min(r["median_ms"] for r in records if r["status"] == "ok")
        for entry in records:
            entry["floor_ms"] = fastest * share / entry["config"]["threads"] if entry["status"] == "ok" else None
    return edit


def drawings(analysis, kind):
    found = [drawing for drawing in draw(analysis) if drawing.name.startswith(kind)]
    assert found
    return found


def lines(drawing):
    """The dotted lines of a figure, as their x and y."""
    return [(list(line.get_xdata()), list(line.get_ydata())) for axes in drawing.figure.axes for line in axes.get_lines()
            if line.get_label() == floors.DRAWN]


def labels(drawing):
    return [words.get_text() for legend in drawing.figure.legends for words in legend.get_texts()]


@pytest.mark.parametrize("kind", ["time_", "scaling_", "scaling_by_execution_"])
def test_figures_have_a_labelled_line(study, kind):
    analysis = analyse(study(edit=with_floors(0.8)))
    for drawing in drawings(analysis, kind):
        assert lines(drawing) and floors.LABEL in labels(drawing)
        assert "Dotted: the floor" in drawing.caption.body


def test_speedup_over_serial_has_a_line(study):
    (drawing,) = drawings(analyse(study(threads=[2], edit=with_floors(1.8))), "speedup_")
    assert len(lines(drawing)) == 1 and floors.LABEL in labels(drawing)


def test_numeric_modes_have_a_line(study):
    def modes(records):
        with_floors(0.8)(records)
        for entry in [e for e in records if e["config"]["kernel"] == "scanline"]:
            twin = json.loads(json.dumps(entry))
            twin["config"]["numeric"], twin["id"] = "f64", "f64" + entry["id"]
            records.append(twin)

    (drawing,) = drawings(analyse(study(edit=modes)), "numerics_")
    assert len(lines(drawing)) == 1 and floors.LABEL in labels(drawing)


def test_lines_stand_where_the_floors_are(study):
    analysis = analyse(study(edit=with_floors(0.8)))
    expected = {r.config.threads: r.floor_ms for r in analysis.study.timed}
    (times,) = drawings(analysis, "time_")
    assert sorted(x[0] for x, _ in lines(times)) == pytest.approx(sorted(expected.values()))
    summary = next(d for d in drawings(analysis, "scaling_") if "by_execution" not in d.name)
    speedup, efficiency, over_serial = summary.figure.axes
    serial = min(analysis.estimates[r.id].value for r in analysis.study.timed if r.config.backend == "serial")
    for line in over_serial.get_lines():
        if line.get_label() == floors.DRAWN:
            assert list(line.get_xdata()) == [1, 2]
            assert list(line.get_ydata()) == pytest.approx([serial / expected[1], serial / expected[2]])
    per_kernel = [[line for line in axes.get_lines() if line.get_label() == floors.DRAWN] for axes in (speedup, efficiency)]
    assert len(per_kernel[0]) == len(per_kernel[1]) > 1
    for of_speedup, of_efficiency in zip(*per_kernel):
        assert list(of_efficiency.get_ydata()) == pytest.approx([y / p for p, y in zip((1, 2), of_speedup.get_ydata())])


def test_points_keep_their_room(study):
    """A floor far from every point is named, and leaves the axes as they are without one."""
    far, none = analyse(study(edit=with_floors(0.001))), analyse(study())
    for kind in ("scaling_", "speedup_"):
        if kind == "speedup_":
            far, none = analyse(study(threads=[2], edit=with_floors(0.001))), analyse(study(threads=[2]))
        for drawing, plain in zip(drawings(far, kind), drawings(none, kind)):
            assert [a.get_ylim() for a in drawing.figure.axes] == [a.get_ylim() for a in plain.figure.axes]
            assert [a.get_xlim() for a in drawing.figure.axes] == [a.get_xlim() for a in plain.figure.axes]
            named = [words.get_text() for axes in drawing.figure.axes for words in axes.texts] + labels(drawing)
            assert any(("floor at" in words or "off the axis at" in words) and words.endswith((" ms", " times")) for words in named)


def test_an_axis_reaches_for_near_lines_only():
    assert floors.reached((2, 8), False, {0: 0.001, 1: 15, 2: 17}) == ((0.001, 15), {0: 0.001, 1: 15}, [17])
    assert floors.reached((2, 8), True, {0: 0.3, 1: 0.1, 2: 70}) == ((0.3, 70), {0: 0.3, 2: 70}, [0.1])


def test_old_records_draw_no_line(study):
    for drawing in draw(analyse(study())):
        assert not any("floor" in label for label in labels(drawing)) and "floor" not in drawing.caption.body
        if not drawing.raster:
            assert not lines(drawing)


def test_table_has_the_column(study, capsys):
    directory = study(edit=with_floors(0.8))
    analysis = analyse(directory)
    (group,) = analysis.groups
    table = tables.points(analysis, group)
    rows = table.numbers.set_index("id")
    for record in group.records:
        if record.ok:
            assert rows.loc[record.id].times_floor == pytest.approx(analysis.estimates[record.id].value / record.floor_ms)
        else:
            assert pd.isna(rows.loc[record.id].floor_ms) and pd.isna(rows.loc[record.id].times_floor)
    assert "x floor" in table.words and "x floor" in table.note
    assert program.main(["table", str(directory)]) == 0
    out = capsys.readouterr().out
    assert "x floor" in out and max(map(len, out.splitlines())) < 140


def test_table_of_old_records_has_no_column(study):
    analysis = analyse(study())
    table = tables.points(analysis, analysis.groups[0])
    assert "x floor" not in table.words and "floor_ms" not in table.numbers and "floor" not in table.note


def test_times_below_the_floor_are_said(study):
    def said(share):
        return any("less time than the floor" in warn.text for warn in checks.check(analyse(study(edit=with_floors(share)))))

    assert said(2.5) and not said(0.8)


def test_reports_with_floors_are_whole(study, capsys):
    directory = study(edit=with_floors(0.8), schedules=FEW)
    assert program.main(["report", str(directory)]) == 0
    assert "x floor" in (directory / "report.html").read_text()


@pytest.mark.parametrize("value", ["fast", 0, -1, True, [1]])
def test_a_floor_that_is_none_is_refused(study, value):
    def spoil(records):
        records[0]["floor_ms"] = value

    with pytest.raises(load.InputError, match="records.jsonl:1: floor_ms: expected a number above 0 or null"):
        load.load(study(edit=spoil))
