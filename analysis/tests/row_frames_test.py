"""Dot plots with a labelled row an execution: pages that lie side by side, labels of several lines, intervals that stay apart."""

from __future__ import annotations

import itertools

import matplotlib
import pytest
from matplotlib.text import Text

from .. import style
from ..figures import common, hypotheses
from ..figures.common import Block, Point, Row
from . import synthetic
from .conftest import analyse
from .hypotheses_test import state

POINTS = tuple(Point(1.0, 0.9, 1.1, series) for series in range(5))
BLOCKS = [Block("one", [Row("openmp dynamic,16", POINTS)]), Block("two", [Row("serial", POINTS, note="the fastest")])]


def dots(blocks: list[Block], **options) -> matplotlib.figure.Figure:
    with matplotlib.rc_context(style.RC):
        return common.dots(blocks, list("abcde"), "title", "x", limits=(0, 1), log=False, **options)


def test_pages_share_the_ends_of_their_axes() -> None:
    places = [dots([block], every=BLOCKS).axes[0].get_position() for block in BLOCKS]
    assert places[0].x0 == pytest.approx(places[1].x0) and places[0].x1 == pytest.approx(places[1].x1)
    alone = [dots([block]).axes[0].get_position() for block in BLOCKS]
    assert alone[0].x1 > alone[1].x1  # the note takes its room on its own page only


def test_intervals_of_a_high_row_are_apart() -> None:
    """By well more than a line is wide (1.4 points); in rows of the usual height they overlap."""
    def gaps(figure) -> list[float]:
        axes = figure.axes[0]
        lines = sorted({float(line.get_ydata()[0]) for line in axes.get_lines() if line.get_linestyle() == "-" and len(line.get_xdata()) == 2})
        return [72 * (b - a) * axes.get_position().height * figure.get_figheight() / 2 for a, b in itertools.pairwise(lines)]  # two rows

    assert min(gaps(dots(BLOCKS[:1], row_height=common.SERIES_HEIGHT * 5))) > 2.5 > max(gaps(dots(BLOCKS[:1])))


@pytest.mark.parametrize("row_height", [common.ROW_HEIGHT, 5 * common.SERIES_HEIGHT])
def test_a_full_page_fits(row_height: float) -> None:
    most = common.most_rows(row_height)
    figure = dots([Block("one", [Row(f"row {i}", POINTS) for i in range(most - 1)])], row_height=row_height, reference=1, reference_name="ideal")
    assert figure.get_figheight() <= style.MAX_HEIGHT + 0.01


def test_a_label_of_two_lines_takes_the_width_of_the_longer() -> None:
    assert style.text_width(["a short one\na line that is longer"], 8) == style.text_width(["a line that is longer"], 8)


def test_ratios_have_a_tick_at_one() -> None:
    for high in (1.1, 1.5, 2.0, 4.2, 5.0):
        with matplotlib.rc_context(style.RC):
            axes = style.new_figure(4, 2).add_axes((0.1, 0.2, 0.8, 0.7))
            style.number_axis(axes, 0, high, False)
        assert 1 in axes.get_xticks()


def test_a_line_off_the_axis_has_its_unit() -> None:
    figure = dots(BLOCKS, floor={0: 100.0}, floor_unit="times")
    assert any(words.get_text().endswith("off the axis at 100 times") for words in figure.legends[0].findobj(Text))


def test_hypotheses_show_whole_claims(tmp_path) -> None:
    claim = "On the mesh the fused frame beats every strategy that stores its triangles first"
    directory = synthetic.write(tmp_path / "a", synthetic.plan(kernels=["all_pixels", "tile_parallel"], schedules=[], scenes={"teapot": synthetic.SCENES["teapot"]},
                                                               untimed=False))
    fast, slow = (next(r.name for r in analyse(directory).study.timed if r.config.kernel == kernel) for kernel in ("tile_parallel", "all_pixels"))
    state(directory, {"claim": claim, "by": 0.1, "faster": [fast], "slower": [slow], "untested": None})
    with matplotlib.rc_context(style.RC):
        (drawing,) = hypotheses.draw(analyse(directory))
    words = [" ".join(text.get_text().split()) for text in drawing.figure.findobj(Text)]
    assert f"H1 {claim}" in words and "both sides take the same time" in words
