"""Speedup and efficiency over threads, or over the fastest serial kernel where a study has one thread count."""

from __future__ import annotations

from typing import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .. import captions, fitting, style, text
from ..comparison import Analysis, Group
from ..load import Record
from ..statistics import estimates
from ..statistics.estimates import Estimate
from . import floors
from .common import Block, Drawing, Row, drawn_together, bounds, dots, execution_rows, named, pages, part, spread
from .times import point, thread_series

SECTION = "Speedup and efficiency"
COLUMNS, NARROWEST = 3, 1.6  # panels beside each other, and inches of one


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        if drawn_together(analysis, group):
            continue
        counts = sorted({r.config.threads for r in group.timed if r.config.backend != "serial"})
        if len(counts) > 1:
            yield from _over_threads(analysis, group, counts)
        elif counts:
            yield from _over_serial(analysis, group)


def curves(analysis: Analysis, group: Group) -> dict[tuple[str, str], list[Record]]:
    """Points that differ in their threads only and have a base on one thread: {(kernel, execution): records}."""
    found: dict[tuple[str, str], list[Record]] = {}
    for record in group.timed:
        if record.config.backend != "serial" and analysis.thread_base[record.id] is not None:
            found.setdefault((record.config.kernel, analysis.execution(record)), []).append(record)
    return {key: sorted(records, key=lambda r: r.config.threads) for key, records in found.items() if len(records) > 1}


def _over_threads(analysis: Analysis, group: Group, counts: list[int]) -> Iterator[Drawing]:
    every = curves(analysis, group)
    best: dict[str, tuple[str, list[Record]]] = {}
    for (kernel, execution), records in every.items():
        last = analysis.estimates[records[-1].id].value
        if records[-1].config.threads == counts[-1] and (
                kernel not in best or last < analysis.estimates[best[kernel][1][-1].id].value):
            best[kernel] = (execution, records)
    if best:
        yield _summary(analysis, group, best, counts)
    if len(every) > len(best):
        yield _panels(analysis, group, every, counts)


def _summary(analysis: Analysis, group: Group, best: dict[str, tuple[str, list[Record]]], counts: list[int]) -> Drawing:
    """Three panels, one line a kernel: speedup over itself, efficiency, speedup over the fastest serial kernel."""
    serial = {k: analysis.serial_base[records[0].id] for k, (_, records) in best.items()}
    panels = ["speedup over the same\non 1 thread, base (b)", "efficiency:\nspeedup (b) / threads"]
    if any(serial.values()):
        panels.append("speedup over the fastest\nserial kernel, base (a)")
    shown = [r for _, records in best.values() for r in records]
    floor = floors.by_threads(shown)
    foot = 0.55 + 0.17 * (len(best) + bool(floor))
    across = style.panels_across(len(panels), 2.1)
    rows, tall = -(-len(panels) // across), 2.45 if across > 1 else 1.35
    height = rows * (tall + 0.58) + (rows - 1) * 0.4 + foot
    figure = style.new_figure(style.page_width(), height)
    wide = (style.page_width() - 0.1) / across
    axes = [style.place(figure, 0.58 + i % across * wide, foot + (rows - 1 - i // across) * (tall + 0.98), wide - 0.68, tall)
            for i in range(len(panels))]
    keys = []
    limits: list[list[dict[int, float]]] = [[] for _ in panels]
    for i, (kernel, (execution, records)) in enumerate(best.items()):
        base = analysis.thread_base[records[-1].id]
        own = {r.config.threads: _self(analysis, r, base) for r in records}
        curve(axes[0], own, i)
        curve(axes[1], {p: estimates.efficiency(e, p) for p, e in own.items()}, i)
        limits[0].append(floors.ceilings(floor, analysis.estimates[base.id].value, counts))
        limits[1].append({p: ceiling / p for p, ceiling in limits[0][-1].items()})
        name = f"{kernel}, {execution}: base (b) {seconds(analysis, base)}"
        if serial[kernel] is not None:
            over = {r.config.threads: analysis.speedup(r, serial[kernel]) for r in records}
            curve(axes[2], over, i)
            limits[2].append(floors.ceilings(floor, analysis.estimates[serial[kernel].id].value, counts))
            name += f"; base (a) {serial[kernel].config.kernel}, {seconds(analysis, serial[kernel])}"
        look = style.look(i)
        keys.append(Line2D([], [], color=look.colour, marker=look.marker, ms=4, label=name))
    for i, (panel, title) in enumerate(zip(axes, panels)):
        thread_axis(panel, counts)
        panel.set_title(title, loc="left", fontsize=8)
        panel.set_ylabel("efficiency (1 = ideal)" if i == 1 else "speedup (times)")
        if i != 1:
            panel.plot(counts, counts, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
            panel.annotate("ideal", (counts[-1], counts[-1]), xytext=(-3, 1), textcoords="offset points", ha="right",
                           va="bottom", fontsize=7)
        else:
            panel.axhline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        panel.set_ylim(0, max(panel.get_ylim()[1], 1.1))
        # Over base (a) all kernels share a line where they share the base; over their own bases each has one.
        floors.over_threads(panel, limits[i], [style.look(k).colour if i < 2 else style.GREY for k in range(len(limits[i]))])
    if floor:
        keys.append(floors.key())
    style.title(figure, group.title)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=1,
                  borderaxespad=0.2)
    caption = captions.build(
        analysis, f"Speedup and efficiency over threads, {group.title}",
        "A line on the dashed one scales ideally; the distance below it is what is lost to overhead, imbalance and shared"
        " memory.", shown, estimates="medians of paired ratios", kind=ratio_kind(analysis, shown),
        base="Base (b) is the same kernel, backend and schedule on one thread; base (a) is the fastest serial kernel with"
             " equal picture, numeric mode and instruction set. Both are named with their seconds in the legend.",
        notes=[f"Each kernel is drawn with the execution that has its lowest median at {counts[-1]} threads.", *floors.notes(shown)])
    return Drawing(f"scaling_{group.slug}", SECTION, figure, caption)


def _self(analysis: Analysis, record: Record, base: Record) -> Estimate:
    speedup = analysis.speedup(record, base)
    return speedup if speedup is not None else Estimate(1.0, None, None, record.samples.n, "base")


def seconds(analysis: Analysis, record: Record) -> str:
    return f"{text.number(analysis.estimates[record.id].value / 1000)} s"


def ratio_kind(analysis: Analysis, records: list[Record]) -> str:
    """How the intervals of the speedups came about; all kinds are said where they differ."""
    kinds = set()
    for record in records:
        for base in (analysis.thread_base[record.id], analysis.serial_base[record.id]):
            estimate = analysis.speedup(record, base)
            if estimate is not None and estimate.has_interval:
                kinds.add(estimate.kind)
    return " / ".join(sorted(kinds))


def curve(axes: Axes, values: dict[int, Estimate], series: int) -> None:
    # Not set apart sideways: against the ideal line a shift in threads would look like a gain or a loss.
    look = style.look(series)
    x = np.array(list(values), dtype=float)
    estimates = list(values.values())
    y = np.array([e.value for e in estimates])
    low = np.array([e.value - e.low if e.has_interval else 0 for e in estimates])
    high = np.array([e.high - e.value if e.has_interval else 0 for e in estimates])
    # A percentile interval need not hold its own median where the pairs are few.
    axes.errorbar(x, y, np.maximum(0, [low, high]), color=look.colour, marker=look.marker, ms=4, lw=1.0, elinewidth=1.0)


def thread_axis(axes: Axes, counts: list[int]) -> None:
    if counts[-1] / counts[0] >= 8:
        axes.set_xscale("log", base=2)
        axes.set_xlim(counts[0] * 0.85, counts[-1] * 1.18)
    else:
        reach = counts[-1] - counts[0]
        axes.set_xlim(counts[0] - 0.12 * reach, counts[-1] + 0.12 * reach)
    axes.set_xticks(counts, [str(n) for n in counts])
    axes.minorticks_off()
    axes.set_xlabel("threads")
    axes.grid(axis="y")


def _panels(analysis: Analysis, group: Group, every: dict[tuple[str, str], list[Record]], counts: list[int]) -> Drawing:
    """One panel a kernel, one line an execution: what the choice of schedule does to scaling."""
    kernels = list(dict.fromkeys(kernel for kernel, _ in every))
    executions = list(dict.fromkeys(execution for _, execution in every))
    across = style.panels_across(COLUMNS, NARROWEST)
    rows = -(-len(kernels) // across)
    columns = style.legend_columns(executions)
    shown = [r for records in every.values() for r in records]
    floor = floors.by_threads(shown)
    foot = 0.3 + 0.17 * (-(-len(executions) // columns) + bool(floor))
    each = min(1.85, (style.MAX_HEIGHT - foot - 0.35) / rows)
    height = rows * each + foot + 0.35
    figure = style.new_figure(style.page_width(), height)
    wide = (style.page_width() - 0.1) / across
    top = 0.0
    panels: list[tuple[Axes, dict[int, float]]] = []
    for i, kernel in enumerate(kernels):
        row, column = divmod(i, across)
        axes = style.place(figure, 0.5 + column * wide, height - 0.3 - (row + 1) * each + 0.4, wide - 0.6, each - 0.75)
        lines = [(e, records) for (k, e), records in every.items() if k == kernel]
        bases = []
        for execution, records in lines:
            base = analysis.thread_base[records[-1].id]
            bases.append(analysis.estimates[base.id].value / 1000)
            curve(axes, {r.config.threads: _self(analysis, r, base) for r in records}, executions.index(execution))
        axes.plot(counts, counts, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        thread_axis(axes, counts)
        low, high = text.number(min(bases)), text.number(max(bases))
        # One line a panel, of the fastest base: its executions differ little on one thread.
        panels.append((axes, floors.ceilings(floor, 1000 * min(bases), counts)))
        of_base = fitting.lines(f"base (b) {low if low == high else f'{low} to {high}'} s", 7.5, wide - 0.4)
        axes.set_title(f"{kernel}\n{of_base}", loc="left", fontsize=7.5, linespacing=1.1, pad=4)
        axes.set_ylabel("speedup (times)" if column == 0 else "")
        if row < rows - 1 and i + across < len(kernels):
            axes.set_xlabel("")
        top = max(top, axes.get_ylim()[1])
    for axes, ceilings in panels:
        axes.set_ylim(0, top)
        floors.over_threads(axes, [ceilings], [style.GREY])
    keys = [Line2D([], [], color=style.look(i).colour, marker=style.look(i).marker, ms=4, label=name)
            for i, name in enumerate(executions)] + ([floors.key()] if floor else [])
    style.title(figure, group.title)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=columns,
                  borderaxespad=0.2, columnspacing=1.2)
    caption = captions.build(
        analysis, f"Speedup over threads by execution, {group.title}",
        "One panel a kernel. Where its lines lie together, the schedule does not matter for it; dashed is ideal.",
        shown, estimates="medians of paired ratios", kind=ratio_kind(analysis, shown),
        base="Base (b): the same kernel, backend and schedule on one thread; the title of a panel gives its seconds.",
        notes=floors.notes(shown))
    return Drawing(f"scaling_by_execution_{group.slug}", SECTION, figure, caption)


def _over_serial(analysis: Analysis, group: Group) -> Iterator[Drawing]:
    """One thread count gives no curve: the speedup over the fastest serial kernel is what can be said."""
    based = [r for r in group.timed if analysis.speedup(r, analysis.serial_base[r.id]) is not None
             and r.config.backend != "serial"]
    if not based:
        return
    threads = thread_series(based)
    bases = list({analysis.serial_base[r.id].id: analysis.serial_base[r.id] for r in based}.values())
    blocks = []
    for kernel in group.kernels:
        rows = []
        for execution, records in execution_rows(analysis, group, kernel).items():
            points = tuple(point(analysis.speedup(r, analysis.serial_base[r.id]), threads.index(r.config.threads))
                           for r in records if r in based)
            if points:
                rows.append(Row(execution, points))
        if rows:
            blocks.append(Block(kernel, rows))
    every = [p for block in blocks for row in block.rows for p in row.points]
    low, high = bounds(every)
    # The fastest base of a thread count gives its lowest, and so its only certain line.
    limits = floors.ceilings(floors.by_threads(based), min(analysis.estimates[b.id].value for b in bases), threads)
    log = spread([p.value for p in every])
    split = pages(blocks)
    named_bases = text.listing([f"{b.config.kernel} ({b.config.isa}) with {seconds(analysis, b)}" for b in bases])
    for page, chosen in enumerate(split):
        figure = dots(chosen, [f"{n} thread{'s' if n > 1 else ''}" for n in threads], group.title + part(page, len(split)),
                      "speedup over the fastest serial kernel (times)" + (", log scale" if log else ""),
                      limits=(min(low, 1), max(high, 1)), log=log, reference=1.0, reference_name="as fast as the base",
                      floor={threads.index(count): ceiling for count, ceiling in limits.items()}, floor_unit="times", every=blocks)
        caption = captions.build(
            analysis, f"Speedup over the fastest serial kernel, {group.title}{part(page, len(split))}",
            "Right of the dashed line a point is faster than the best serial kernel.", based,
            estimates="medians of paired ratios", kind=ratio_kind(analysis, based),
            base=f"Base (a), the fastest serial kernel with equal picture, numeric mode and instruction set: {named_bases}.",
            notes=[f"The study has one thread count ({threads[0]}), so there is no curve over threads and no efficiency.",
                   *floors.notes(based)])
        yield Drawing(named(f"speedup_{group.slug}", page, len(split)), SECTION, figure, caption)
