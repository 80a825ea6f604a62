"""Weak scaling: efficiency over threads where triangles or pixels grow with them, a panel each."""

from __future__ import annotations

from typing import Iterator

from matplotlib.lines import Line2D

from .. import captions, style, text, weak
from ..comparison import Analysis
from ..weak import Curve, Growth
from .common import Drawing, named, part
from .scaling import curve as draw_curve
from .scaling import seconds, thread_axis

COLUMNS, NARROWEST = 2, 2.6  # panels beside each other, and inches of one
ROWS = 3  # of panels in one figure
TALL = 2.1  # inches of a panel


def draw(analysis: Analysis) -> Iterator[Drawing]:
    found = weak.growths(analysis)
    step = style.panels_across(COLUMNS, NARROWEST) * ROWS
    split = [found[i:i + step] for i in range(0, len(found), step)]
    for page, growths in enumerate(split):
        yield _draw(analysis, growths, page, len(split))


def chosen(analysis: Analysis, growth: Growth) -> list[Curve]:
    """Of each strategy the execution that is fastest on the most threads."""
    best: dict[str, Curve] = {}
    for curve in growth.curves:
        last, known = list(curve.records.items())[-1], best.get(curve.name)
        if known is None or (-last[0], analysis.estimates[last[1].id].value) < (
                -max(known.records), analysis.estimates[known.records[max(known.records)].id].value):
            best[curve.name] = curve
    return list(best.values())


def _draw(analysis: Analysis, growths: list[Growth], page: int, pages: int) -> Drawing:
    drawn = {growth.slug: chosen(analysis, growth) for growth in growths}
    names = list(dict.fromkeys(curve.name for curves in drawn.values() for curve in curves))
    shown = [record for curves in drawn.values() for curve in curves for record in curve.records.values()]
    keys = [Line2D([], [], color=style.look(i).colour, marker=style.look(i).marker, ms=4, label=name) for i, name in enumerate(names)]
    keys.append(Line2D([], [], color="black", lw=0.8, ls=(0, (4, 2)), label="ideal: P threads draw P times the work in the time of one"))
    columns = style.legend_columns([key.get_label() for key in keys])
    across = style.panels_across(COLUMNS, NARROWEST)
    rows = -(-len(growths) // across)
    foot = 0.45 + 0.17 * -(-len(keys) // columns)
    each = TALL + 0.55
    height = rows * each + foot + 0.25
    figure = style.new_figure(style.page_width(), height)
    wide = (style.page_width() - 0.1) / across
    top, panels = 1.1, []
    for i, growth in enumerate(growths):
        row, column = divmod(i, across)
        axes = style.place(figure, 0.58 + column * wide, height - 0.25 - row * each - 0.3 - TALL, wide - 0.72, TALL)
        for curve in drawn[growth.slug]:
            draw_curve(axes, curve.efficiencies(analysis), names.index(curve.name))
        thread_axis(axes, growth.threads)
        if row < rows - 1 and i + across < len(growths):
            axes.set_xlabel("")
        axes.axhline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        axes.set_title(text.shorten(f"{growth.series.kind} grow: {growth.title}", int((wide - 0.5) / 0.062)), loc="left", fontsize=7.5)
        axes.set_ylabel("efficiency T_1 / T_P (1 = ideal)" if column == 0 else "")
        top = max(top, axes.get_ylim()[1])
        panels.append(axes)
    for axes in panels:
        axes.set_ylim(0, top)
    style.title(figure, f"Weak scaling{part(page, pages)}")
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=columns, borderaxespad=0.2,
                  columnspacing=1.2)
    said = [f"{growth.title}: " + text.listing([f"{curve.label} {seconds(analysis, curve.base)}" for curve in drawn[growth.slug]], len(names))
            for growth in growths]
    kinds = {e.kind for curves in drawn.values() for curve in curves for e in curve.efficiencies(analysis).values() if e.has_interval}
    notes = []
    if any(growth.series.kind == "triangles" for growth in growths):
        notes.append("Where triangles grow, the picture stays: clearing and resolving it is divided among the threads, so an efficiency above 1 is possible.")
    if any(growth.series.kind == "pixels" for growth in growths):
        notes.append("Where pixels grow, the triangles stay: both sides of the picture grow with the square root of the threads.")
    if any(len(drawn[growth.slug]) < len(growth.curves) for growth in growths):
        notes.append("Of each strategy the execution that is fastest on the most threads is drawn; tables/weak_scaling.csv has all.")
    caption = captions.build(
        analysis, f"Weak scaling{part(page, pages)}",
        "A flat line at 1 is ideal; what a line loses, threads spend on each other: memory bandwidth, hand-out, waiting.", shown,
        estimates="medians of paired ratios", kind=" / ".join(sorted(kinds)),
        base=f"Base: the same kernel and execution on one thread, with one thread's share of the work ({'; '.join(said)}).", notes=notes)
    return Drawing(named("weak_scaling", page, pages), weak.SECTION, figure, caption)
