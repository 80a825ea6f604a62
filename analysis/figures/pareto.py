"""Speed against accuracy: speedup over the literal program by the errors of each numeric mode, per scene and over scenes."""

from __future__ import annotations

from typing import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .. import captions, style, text, trade, trade_text
from ..captions import Caption
from ..comparison import Analysis
from ..fronts import LITERAL, Front, Mark
from ..trade import Trade, View
from . import labels
from .common import Drawing
from .scales import ErrorScale, SpeedScale

LEFT, RIGHT, HEAD = 0.86, 0.12, 0.3  # inches
GAP = 0.3
BOUNDED, UNBOUNDED, LINE = style.COLOURS[0], style.COLOURS[1], "#A9CCE3"
SHAPES = ("o", "s", "^", "D", "v", "P", "X", "p")  # no star: that is the literal program
DAGGER = "\u2020"
AXES = {"wrong": "wrong pixels", "depth": "largest depth error\n(steps of 2\u207b\u00b2\u2074)", "end_to_end": "wrong pixels\nend to end"}
MEANS = {"wrong": "mean wrong pixels", "depth": "mean of the largest\ndepth errors (steps)", "end_to_end": "mean wrong pixels\nend to end"}


def draw(analysis: Analysis) -> Iterator[Drawing]:
    whole = trade.of(analysis)
    for view in whole.views():
        if whole.fronts(view):
            title = f"Speed against accuracy, {'over ' if view.several else ''}{view.title}"
            yield Drawing(f"pareto_{view.slug}", trade.SECTION, _figure(whole, view, title), _caption(whole, view, title))


def _figure(whole: Trade, view: View, title: str):
    fronts = whole.fronts(view)
    kernels = list(dict.fromkeys(mark.kernels for front in fronts for mark in front.marks if mark.name != LITERAL))
    keys = _keys(fronts, kernels)
    columns = style.legend_columns([key.get_label() for key in keys])
    foot = 0.42 + 0.17 * -(-len(keys) // columns) + 0.05
    most = max(len(front.marks) for front in fronts)
    each = min(2.1 + 0.03 * most, (style.MAX_HEIGHT - HEAD - foot) / len(fronts) - GAP)
    height = HEAD + foot + len(fronts) * each + (len(fronts) - 1) * GAP
    figure = style.new_figure(style.page_width(), height)
    across = _across(fronts)
    for i, front in enumerate(fronts):
        bottom = foot + (len(fronts) - 1 - i) * (each + GAP)
        axes = style.place(figure, LEFT, bottom, style.page_width() - LEFT - RIGHT, each)
        names = MEANS if view.several else AXES
        _panel(axes, front, across, kernels, names[front.measure.key], last=i == len(fronts) - 1)
        if i == len(fronts) - 1:
            mean = "geometric mean speedup" if view.several else "speedup"
            stretched = "" if across.cut is None else ", stretched right of the dotted line"
            axes.set_xlabel(f"{mean} over {_base(whole, view)} (times, log scale{stretched})")
    style.title(figure, title)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.02 / height), ncol=columns,
                  borderaxespad=0.2, columnspacing=1.2, handletextpad=0.5)
    return figure


def _base(whole: Trade, view: View) -> str:
    return "the literal program" if whole.is_literal(view.bases[0]) else view.bases[0].config.numeric


def _across(fronts: list[Front]) -> SpeedScale:
    """The panels share one axis."""
    marks = [mark for front in fronts for mark in front.marks]
    return SpeedScale(list({mark.name: mark.speedup.value for mark in marks}.values()), [v for mark in marks for v in _reach(mark)])


def _reach(mark: Mark) -> list[float]:
    """Everything of a mark that must lie within the axis."""
    bounds = [mark.speedup.low, mark.speedup.high] if mark.speedup.has_interval else []
    return [mark.speedup.value, *bounds, *([mark.worst.speedup] if mark.worst else [])]


def _panel(axes: Axes, front: Front, across: SpeedScale, kernels: list[str], name: str, last: bool) -> None:
    errors = [e for mark in front.marks for e in (mark.error, mark.worst.error if mark.worst else mark.error)]
    down = ErrorScale(errors)
    axes.set_xlim(*across.limits)
    axes.set_ylim(down.limits[1], down.limits[0])  # fewer errors are up, so that up and right is better
    across.apply(axes.xaxis)
    down.apply(axes.yaxis)
    if not last:
        axes.set_xticklabels([])
    axes.set_ylabel(name)
    axes.yaxis.set_label_coords(-(LEFT - 0.36) / (style.page_width() - LEFT - RIGHT), 0.5)
    axes.grid(True)
    axes.axhspan(down.limits[0], down.break_at, color=style.BAND, lw=0, zorder=0)
    if across.cut is not None:
        axes.axvline(across.cut, color=style.GREY, lw=0.8, ls=(0, (1, 2)), zorder=1)
    _stairs(axes, front, across, down)
    obstacles = [box for mark in front.marks for box in _mark(axes, front, mark, kernels, across, down)]
    axes.annotate("better \u2197", (1, 1), xycoords="axes fraction", xytext=(0, 2), textcoords="offset points", fontsize=7, ha="right",
                  va="bottom", color=style.GREY)
    names = [labels.Name(across(m.speedup.value), down(m.error), m.name + (DAGGER if m.unbounded else ""), m.name == LITERAL)
             for m in front.marks]
    labels.draw(axes, names, np.array(obstacles))


def _stairs(axes: Axes, front: Front, across: SpeedScale, down: ErrorScale) -> None:
    """What the frontier promises between its modes is the next more accurate one, so the line has steps."""
    x = [across(mark.speedup.value) for mark in front.frontier]
    y = [down(mark.error) for mark in front.frontier]
    axes.step([x[0], *x, across.limits[0]], [down.limits[1], *y, y[-1]], where="post", color=LINE, lw=2.0, zorder=1.5)


def _mark(axes: Axes, front: Front, mark: Mark, kernels: list[str], across: SpeedScale, down: ErrorScale) -> list[np.ndarray]:
    """Draws a mark and returns the boxes that no name may cover, in points."""
    x, y = across(mark.speedup.value), down(mark.error)
    colour = UNBOUNDED if mark.unbounded else BOUNDED
    taken = [[(x, y), (x, y)]]
    if mark.speedup.has_interval and mark.name != LITERAL:
        low, high = across(mark.speedup.low), across(mark.speedup.high)
        axes.plot([low, high], [y, y], color=colour, lw=1.2, solid_capstyle="butt", zorder=3)
        taken.append([(low, y), (high, y)])
    if mark.worst is not None:
        wx, wy = across(mark.worst.speedup), down(mark.worst.error)
        axes.plot([x, wx], [y, wy], color=colour, lw=0.5, alpha=0.7, zorder=2)
        axes.plot(wx, wy, marker="x", ms=3.2, mew=0.8, color=colour, zorder=3)
        taken.append([(wx, wy), (wx, wy)])
    if mark.name == LITERAL:
        axes.plot(x, y, marker="*", ms=11, mew=0.5, mec="white", color="black", zorder=5)
    else:
        shape = SHAPES[kernels.index(mark.kernels) % len(SHAPES)]
        fill = {"markerfacecolor": "white"} if mark.name in front.dominated else {}
        if mark.name in front.open:
            fill = {"fillstyle": "left", "markerfacecoloralt": "white"}
        axes.plot(x, y, marker=shape, ms=5, mew=0.9, color=colour, zorder=4, **fill)
    scale = 72 / axes.figure.dpi
    margin = 5.5 if mark.name == LITERAL else 3.2
    boxes = []
    for ends in taken:
        corners = axes.transData.transform(ends) * scale
        boxes.append(np.concatenate([corners.min(axis=0) - margin, corners.max(axis=0) + margin]))
    return boxes


def _keys(fronts: list[Front], kernels: list[str]) -> list[Line2D]:
    """Only what occurs."""
    marks = [mark for front in fronts for mark in front.marks]
    dot = dict(marker="o", ms=5, mew=0.9, lw=0)
    keys = []
    if any(mark.name == LITERAL for mark in marks):
        keys.append(Line2D([], [], marker="*", ms=10, mew=0, lw=0, color="black", label=LITERAL))
    keys.append(Line2D([], [], color=LINE, lw=2.0, marker="o", ms=5, mec=BOUNDED, mfc=BOUNDED, label="frontier"))
    if any(front.dominated for front in fronts):
        keys.append(Line2D([], [], color=BOUNDED, mfc="white", label="dominated", **dot))
    if any(front.open for front in fronts):
        keys.append(Line2D([], [], color=BOUNDED, fillstyle="left", markerfacecoloralt="white", label="not told apart from the frontier",
                           **dot))
    if any(mark.unbounded for mark in marks):
        keys.append(Line2D([], [], color=UNBOUNDED, label=f"{DAGGER} mode without a bound", **dot))
    if any(mark.worst for mark in marks):
        keys.append(Line2D([], [], color=BOUNDED, marker="x", ms=3.2, mew=0.8, lw=0.5, label="its worst scene"))
    if len(kernels) > 1:
        keys += [Line2D([], [], color=style.GREY, marker=SHAPES[i % len(SHAPES)], ms=5, lw=0, label=kernel)
                 for i, kernel in enumerate(kernels)]
    return keys


def _caption(whole: Trade, view: View, title: str) -> Caption:
    analysis, fronts = whole.analysis, whole.fronts(view)
    shown = list({r.id: r for front in fronts for mark in front.marks for r in mark.records}.values())
    kinds = {mark.speedup.kind for front in fronts for mark in front.marks if mark.speedup.has_interval and mark.speedup.kind != "base"}
    notes = [f"{words[0].upper()}{words[1:]}" for i, front in enumerate(fronts)
             for words in trade_text.frontier(front) + (trade_text.rest(front) if i == 0 else [])]
    if view.several:
        notes.insert(0, "The cross at the end of a thin line is the scene on which the mode has its largest error (of equals, the slowest).")
        if view.missing:
            notes.append(f"Not timed and judged in one way on every scene: {text.listing(view.missing, trade_text.ALL)}.")
    else:
        notes += trade_text.left_out(whole, view.pictures[0])
    notes.append(trade_text.points(view))
    estimates = "geometric means of the scenes' median paired ratios" if view.several else "medians of paired ratios"
    return captions.build(analysis, title, "Up and right is better: fewer errors, more speed. A mode that is not on the line has another"
                          " one above and to the right of it.", shown, estimates=estimates, kind=" / ".join(sorted(kinds)),
                          base=trade_text.base(whole, view), notes=notes)
