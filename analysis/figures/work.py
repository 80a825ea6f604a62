"""Time against triangles, and against pixels: log-log, one panel a thread count, one line a strategy, the floor below."""

from __future__ import annotations

from typing import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .. import captions, style, text, work
from ..comparison import Analysis, strategy
from ..work import Curve, Growth
from . import floors
from .common import Drawing

MOST_PANELS = 3
SLOPE = (0, (6, 2))


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for growth in work.growths(analysis):
        yield _draw(analysis, growth)


def shown_threads(growth: Growth) -> list[int]:
    """The fewest and the most threads, and one between where there is one."""
    counts = list(growth.curves)
    return counts if len(counts) <= MOST_PANELS else [counts[0], counts[len(counts) // 2], counts[-1]]


def _draw(analysis: Analysis, growth: Growth) -> Drawing:
    counts = shown_threads(growth)
    drawn = {curve.name for threads in counts for curve in growth.curves[threads]}
    every = list(dict.fromkeys(strategy(record) for record in analysis.study.every_record))  # one colour in all figures of a study
    names = [name for name in every if name in drawn]
    shown = [r for threads in counts for curve in growth.curves[threads] for r in curve.records.values()]
    floor = {threads: work.floor_of(growth, threads) for threads in counts}
    keys = [Line2D([], [], color=style.look(every.index(name)).colour, marker=style.look(every.index(name)).marker, ms=4, label=name,
                   ls="--" if name.endswith("(peer)") else "-") for name in names]
    keys.append(Line2D([], [], color="#9A9A9A", lw=0.8, ls=SLOPE, label=f"slope 1: time proportional to {growth.kind}"))
    if any(floor.values()):
        keys.append(floors.key())
    per_row = style.legend_columns([key.get_label() for key in keys])
    foot = (0.5 if growth.kind == "triangles" else 0.66) + 0.17 * -(-len(keys) // per_row)
    across = style.panels_across(len(counts), 2.1)
    rows, tall = -(-len(counts) // across), 2.9 if across > 1 else 1.9
    gap = foot - 0.17 * -(-len(keys) // per_row) + 0.15  # between rows: ticks, an axis label and a title
    height = rows * tall + (rows - 1) * gap + foot + 0.5
    figure = style.new_figure(style.page_width(), height)
    wide = (style.page_width() - 0.55) / across
    estimates = [analysis.estimates[r.id] for r in shown]
    lows = [e.low if e.has_interval else e.value for e in estimates] + [v for line in floor.values() for v in line.values()]
    highs = [e.high if e.has_interval else e.value for e in estimates]
    for i, threads in enumerate(counts):
        axes = style.place(figure, 0.58 + i % across * wide, foot + (rows - 1 - i // across) * (tall + gap), wide - 0.38, tall)
        style.number_axis(axes, min(lows), max(highs), log=True, name="y")
        _work_axis(axes, growth)
        _guide(axes)
        for curve in growth.curves[threads]:
            _curve(analysis, axes, curve, every.index(curve.name))
        if floor[threads]:
            axes.plot(list(floor[threads]), list(floor[threads].values()), color=style.GREY, lw=1.2, ls=floors.DOTTED, zorder=1,
                      label=floors.DRAWN)
        _slopes(analysis, axes, growth.curves[threads], every)
        axes.set_title(text.count(threads, "thread"), loc="left", fontsize=8)
        axes.grid()
        if i % across == 0:
            axes.set_ylabel("time of a frame, median (ms), log scale")
        else:
            axes.set_yticklabels([])
    style.title(figure, f"Time against {growth.kind}: {growth.title}")
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=per_row,
                  borderaxespad=0.2, columnspacing=1.2)
    notes = ["The number at the end of a line is its slope over its last step: the exponent of time over work."]
    if any(curve.is_peer for threads in counts for curve in growth.curves[threads]):
        notes.append("Dashed with markers: a peer, another program with an arithmetic of its own.")
    executions = {curve.name: curve.execution for threads in counts for curve in growth.curves[threads] if not curve.is_peer}
    if executions:
        notes.append("Executions: " + text.listing(sorted(set(executions.values())), 3) + ".")
    if growth.skipped:
        notes.append(f"{text.count(len(growth.skipped), 'point')} of these without a time: "
                     + text.listing([f"{r.config.kernel} on {r.config.scene} {r.config.size[0]}x{r.config.size[1]},"
                                     f" {analysis.threads(r)}" for r in growth.skipped], 3) + ".")
    notes += floors.notes(shown)
    caption = captions.build(
        analysis, f"Time against {growth.kind}, {growth.title}",
        "A line that is flat pays for something other than this work; one parallel to the grey dashes is proportional to it; its height"
        " above the dotted line is what is left to gain.", shown, notes=notes)
    return Drawing(f"work_{growth.slug}", work.SECTION, figure, caption)


def _work_axis(axes: Axes, growth: Growth) -> None:
    amounts = growth.amounts
    axes.set_xscale("log")
    axes.set_xlim(min(amounts) / 1.5, max(amounts) * 1.9)  # room for the slopes
    axes.minorticks_off()
    if growth.kind == "pixels":
        heights = [name.partition("x")[2] for name in amounts.values()]
        # The lines of a picture name its size where they tell all sizes apart; the pixels are where the tick stands.
        labels = [f"{h}p" for h in heights] if len(set(heights)) == len(heights) else list(amounts.values())
        axes.set_xticks(list(amounts), labels, rotation=35, ha="right", rotation_mode="anchor")
        axes.set_xlabel("pixels, log scale (ticks: lines)")
        return
    low, high = min(amounts), max(amounts)
    decades = [10**d for d in range(int(np.floor(np.log10(low) + 0.02)), int(np.ceil(np.log10(high) - 0.02)) + 1)]
    axes.set_xticks(decades, [f"1e{len(str(d)) - 1}" for d in decades])
    axes.set_xlabel("triangles, log scale")


def _guide(axes: Axes) -> None:
    """Lines of slope 1 across the panel, one a decade of time."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    for decade in range(int(np.floor(np.log10(low * left / right))), int(np.ceil(np.log10(high))) + 1):
        axes.plot([left, right], [10.0**decade, 10.0**decade * right / left], color="#C4C4C4", lw=0.6, ls=SLOPE, zorder=0.5,
                  scalex=False, scaley=False)


def _curve(analysis: Analysis, axes: Axes, curve: Curve, series: int) -> None:
    look = style.look(series)
    estimates = [analysis.estimates[r.id] for r in curve.records.values()]
    y = np.array([e.value for e in estimates])
    low = np.array([e.value - e.low if e.has_interval else 0 for e in estimates])
    high = np.array([e.high - e.value if e.has_interval else 0 for e in estimates])
    axes.errorbar(list(curve.records), y, np.maximum(0, [low, high]), color=look.colour, marker=look.marker, ms=4, lw=1.1,
                  elinewidth=1.0, ls="--" if curve.is_peer else "-", zorder=3)


def _slopes(analysis: Analysis, axes: Axes, curves: list[Curve], names: list[str]) -> None:
    """The last slope of each line right of its end; where ends are close the numbers give way upwards and downwards."""
    ends = []
    for curve in curves:
        x, slope = list(curve.slopes(analysis).items())[-1]
        ends.append([x, analysis.estimates[curve.records[x].id].value, slope, style.look(names.index(curve.name)).colour])
    height = 72 * axes.get_position().height * axes.figure.get_size_inches()[1]
    low, high = np.log10(axes.get_ylim())
    places = {id(end): (np.log10(end[1]) - low) / (high - low) * height for end in ends}
    for x in {end[0] for end in ends}:
        column = sorted((end for end in ends if end[0] == x), key=lambda end: end[1])
        for _ in range(60):  # neighbours push each other apart, a point at a time
            for a, b in zip(column, column[1:]):
                if places[id(b)] - places[id(a)] < 7.5:
                    places[id(a)] -= 0.5
                    places[id(b)] += 0.5
    for end in ends:
        x, y, slope, colour = end
        shift = places[id(end)] - (np.log10(y) - low) / (high - low) * height
        axes.annotate(f"{slope:.2f}", (x, y), xytext=(6, shift), textcoords="offset points", fontsize=6.5, color=colour, va="center",
                      annotation_clip=False, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.3}, zorder=2)
