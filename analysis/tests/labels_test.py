"""Names beside points: none covers another, a mark or the frame. Scales: order, ticks, room for what is dense."""

from __future__ import annotations

import numpy as np
import pytest

from .. import style
from ..figures import labels, scales


def placed(points, words, size=(430.0, 205.0)):
    points = np.array(points, dtype=float)
    sizes = np.array([(4.2 * len(word), labels.HEIGHT) for word in words])
    obstacles = np.concatenate([points - 3, points + 3], axis=1)
    return labels.place(points, sizes, obstacles, np.array([0, 0, *size])), obstacles


@pytest.mark.parametrize("count, seed", [(2, 0), (8, 1), (25, 2), (25, 3), (25, 4)])
def test_no_label_covers_another_or_a_mark(count, seed):
    rng = np.random.default_rng(seed)
    points = np.stack([rng.uniform(60, 370, count), rng.choice([20.0, 80.0, 130.0, 180.0], count)], axis=1)
    boxes, obstacles = placed(points, [f"filtered-{i:04d}" for i in range(count)])
    for i in range(count):
        others = np.delete(boxes, i, axis=0)
        assert labels.overlaps(boxes[i:i + 1], others)[0] == 0
        assert labels.overlaps(boxes[i:i + 1], obstacles)[0] == 0
    assert boxes[:, 0].min() >= 0 and boxes[:, 2].max() <= 430 and boxes[:, 1].min() >= 0 and boxes[:, 3].max() <= 205


def test_marks_in_one_place_have_names_apart():
    boxes, _ = placed([(200, 80)] * 6, ["mode"] * 6)
    assert sum(labels.overlaps(boxes[i:i + 1], np.delete(boxes, i, axis=0))[0] for i in range(6)) == 0


def test_a_lone_label_stands_beside_its_mark():
    boxes, _ = placed([(200, 80)], ["f32"])
    assert np.hypot(*(labels.nearest(np.array([200, 80]), boxes[0]) - (200, 80))) <= labels.FAR


def test_leaders_are_seen_to_cross_boxes():
    box = np.array([[40.0, -5.0, 60.0, 5.0]])
    assert labels.through(np.array([[0.0, 0.0]]), np.array([[100.0, 0.0]]), box)[0, 0]
    assert not labels.through(np.array([[0.0, 0.0]]), np.array([[100.0, 60.0]]), box)[0, 0]


def test_leaders_are_seen_to_cross_each_other():
    point, ends = np.array([0.0, 0.0]), np.array([[10.0, 10.0], [10.0, -10.0], [4.0, 4.0]])
    assert list(labels.crossings(point, ends, np.array([[10.0, 0.0]]), np.array([[0.0, 10.0]]))) == [1, 0, 0]


def test_error_scale_has_a_row_for_zero_below_all_decades():
    scale = scales.ErrorScale([0, 3, 40000])
    assert scale(0) == scale.zero < scale.break_at < scale(1) < scale(3) < scale(40000)
    assert scale.limits[0] < scale.zero and scale.limits[1] > scale(40000)
    axes = style.new_figure(3, 3).add_axes((0.1, 0.1, 0.8, 0.8))
    scale.apply(axes.yaxis, "none")
    assert [t.get_text() for t in axes.get_yticklabels()] == ["none", "1", "10", "100", "1,000", "10,000", "1e5"]


@pytest.mark.parametrize("values", [[0.0], [0, 0], [7], [0.5, 0.5], [1000]])
def test_error_scale_of_few_values(values):
    scale = scales.ErrorScale(values)
    assert scale.limits[0] < scale(0) < scale.limits[1] and all(scale.limits[0] < scale(v) < scale.limits[1] for v in values)


def test_a_crowd_gets_room_and_the_order_stays():
    values = [1.0, 30.0, *np.linspace(60, 72, 14)]
    scale = scales.SpeedScale(values, [75.0])
    at = [scale(v) for v in values]
    assert scale.cut is not None and at == sorted(at)
    width = scale.limits[1] - scale.limits[0]
    assert (at[-1] - at[2]) / width > 0.45 > (np.log10(72 / 60)) / np.log10(75)
    assert scale.limits[0] < at[0] and scale(75) < scale.limits[1]


def test_a_cut_does_not_part_equal_values():
    values = [1.0, *[60.0] * 9, 61.0]
    cut = scales.SpeedScale(values, []).cut
    assert cut is None or 0 < cut < np.log10(60) or np.log10(60) < cut


def test_an_even_spread_is_not_cut():
    assert scales.SpeedScale([1, 2, 4, 8, 16, 32], []).cut is None
    assert scales.SpeedScale([5], []).cut is None and scales.SpeedScale([5, 5], [4, 6]).cut is None


def test_ticks_are_round_and_apart():
    for low, high in ((1, 1.05), (62, 73), (1, 800), (0.3, 9), (1, 1e9)):
        ticks = sorted(scales.round_values(low, high))
        assert len(ticks) >= 2 and ticks[0] >= 0.999 * low and ticks[-1] <= 1.001 * high
    assert [scales.said(v) for v in (0.01, 1e-7, 1, 62.5, 10000, 1e6, 2e5)] == ["0.01", "1e-7", "1", "62.5", "10,000", "1e6", "2e5"]
