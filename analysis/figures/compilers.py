"""Time over that of the base program, by compiler and flags: one panel a kernel, one row a configuration."""

from __future__ import annotations

from typing import Iterator

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .. import style, text
from ..captions import Caption, Facts
from ..comparison import slug
from ..compilers import Cell, Comparison, INTERVAL, time, where
from ..load import Config
from ..statistics.estimates import Estimate
from .common import Drawing

SECTION = "Compilers"
ROW = 0.24  # inches
PANELS, NARROWEST = 3, 1.5  # beside each other, and inches of one
OPEN = "promises no bits (-ffast-math)"
GAP, FOOT_OF_PANEL, HEAD_OF_PANEL = 0.18, 0.42, 0.3


# What a panel has one value of, besides its kernel and mode; said in its title where the study has several.
PANEL_AXES = ("fill", "near", "isa", "tile", "binding", "wait_policy", "runtime", "cache", "generality", "techniques")


def draw(found: Comparison) -> Iterator[Drawing]:
    """One figure a scene and size; its panels are the kernels in their modes, which hold their executions."""
    varying = {(axis, kernel) for axis in PANEL_AXES for kernel in {p.config.kernel for p in found.points}
               if len({getattr(p.config, axis) for p in found.points if p.config.kernel == kernel}) > 1}
    pictures: dict[tuple, dict[str, list[str]]] = {}
    for point in found.points:
        c = point.config
        panel = ", ".join([c.kernel, c.numeric, *(f"{axis} {getattr(c, axis)}" for axis in PANEL_AXES if (axis, c.kernel) in varying)])
        pictures.setdefault((c.scene, c.size), {}).setdefault(panel, []).append(point.name)
    for (scene, size), panels in pictures.items():
        title = f"{scene} {size[0]}x{size[1]}"
        name = "compilers_ratio" if len(pictures) == 1 else f"compilers_ratio_{slug(title)}"
        yield _picture(found, panels, title, name)


def _picture(found: Comparison, panels: dict[str, list[str]], title: str, name: str) -> Drawing:
    configs = {point.name: point.config for point in found.points}
    executions = list(dict.fromkeys(where(configs[point]) for points in panels.values() for point in points))
    rows = found.configurations
    cells = {key: cell for key, cell in found.cells.items() if any(key[0] in points for points in panels.values())}
    keys = _keys(executions, any(cell.marked for cell in cells.values()))
    left = 0.2 + style.text_width([c.name for c in rows], 7.5)
    across = max(1, min(PANELS, len(panels), int((style.page_width() - left) / NARROWEST)))
    down = -(-len(panels) // across)
    wide = (style.page_width() - left - 0.12 - (across - 1) * GAP) / across
    tall = len(rows) * ROW
    columns = style.legend_columns([key.get_label() for key in keys])
    foot = 0.12 + 0.17 * -(-len(keys) // columns)
    height = 0.3 + down * (HEAD_OF_PANEL + tall + FOOT_OF_PANEL) + foot
    figure = style.new_figure(style.page_width(), height)
    for i, (panel, points) in enumerate(panels.items()):
        bottom = foot + (down - 1 - i // across) * (HEAD_OF_PANEL + tall + FOOT_OF_PANEL) + FOOT_OF_PANEL
        axes = style.place(figure, left + (i % across) * (wide + GAP), bottom, wide, tall)
        axes.set_title(panel, loc="left", pad=4, fontsize=min(8.5, 8.5 * wide / style.text_width([panel], 8.5)))
        _panel(axes, found, points, configs, executions, labelled=i % across == 0)
    style.title(figure, f"Time over that of {found.base}, {title}", 0.15)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.02 / height), ncol=columns, borderaxespad=0.2,
                  columnspacing=1.2, handletextpad=0.5)
    return Drawing(name, SECTION, figure, _caption(found, list(cells.values()), title))


def _panel(axes: Axes, found: Comparison, points: list[str], configs: dict[str, Config], executions: list[str], labelled: bool) -> None:
    rows = found.configurations
    shown: list[tuple[int, int, Cell, Estimate]] = []
    for y, configuration in enumerate(rows):
        missing = ""
        for point in points:
            cell = found.cells[point, configuration.name]
            over = found.ratio(cell)
            if over is not None:
                shown.append((y, executions.index(where(configs[point])), cell, over))
            elif cell.samples is None:
                missing = cell.reason
        if missing and configuration.name != found.base and not any(row == y for row, *_ in shown):
            width = axes.get_position().width * style.page_width()
            axes.text(0.02, y, text.shorten(missing, max(8, int(width / 0.058))), transform=axes.get_yaxis_transform(), fontsize=7, style="italic",
                      color=style.FAILED, va="center", clip_on=True)
    ends = [end for *_, over in shown for end in (over.value, over.low, over.high) if end is not None] + [1.0]
    low, high = min(ends), max(ends)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    if high / low > 3:
        style.number_axis(axes, low, high, True)
    else:
        style.number_axis(axes, low, high, False)
        room = 0.08 * max(high - low, 0.05)
        axes.set_xlim(low - room, high + room)
    names = [c.name for c in rows]
    if found.base in names:
        across, _ = axes.transAxes.inverted().transform(axes.transData.transform((1, 0)))
        side = -1 if across > 0.7 else 1  # of the line, so that the word stays within the panel
        axes.annotate("base", (1, names.index(found.base)), xytext=(4 * side, 0), textcoords="offset points", fontsize=7, va="center",
                      ha="right" if side < 0 else "left", color=style.GREY)
    axes.set_yticks(range(len(rows)), [c.name for c in rows] if labelled else [])
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x")
    axes.set_xlabel("time / base" + (", log scale" if high / low > 3 else ""), labelpad=2)
    axes.axvline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
    for y in range(0, len(rows), 2):
        axes.axhspan(y - 0.5, y + 0.5, color=style.BAND, lw=0, zorder=0)
    for y, series, cell, over in shown:
        look = style.look(series)
        at = y + (series - (len(executions) - 1) / 2) * min(0.26, 0.7 / len(executions))
        if over.has_interval:
            axes.plot([over.low, over.high], [at, at], color=look.colour, lw=1.3, marker="|", ms=4, mew=1.0, zorder=3)
        axes.plot(over.value, at, marker=look.marker, color=look.colour, mfc="white" if cell.marked else look.colour, mew=1.0, ms=4, lw=0, zorder=4)


def _keys(executions: list[str], marked: bool) -> list[Line2D]:
    keys = [Line2D([], [], color=style.look(i).colour, marker=style.look(i).marker, lw=1.3, ms=4, label=name) for i, name in enumerate(executions)]
    if marked:
        keys.append(Line2D([], [], color=style.GREY, marker="o", mfc="white", lw=0, ms=4, label=f"hollow: {OPEN}"))
    keys.append(Line2D([], [], color="black", lw=0.8, ls=(0, (4, 2)), label="as fast as the base"))
    return keys


def _caption(found: Comparison, cells: list[Cell], title: str) -> Caption:
    timed = [cell for cell in cells if cell.samples is not None]
    bases = {cell.name: cell for cell in cells if cell.configuration.name == found.base and cell.samples is not None}
    seconds = "; ".join(f"{cell.config.kernel} {where(cell.config)} {text.number(time(cell.samples).value / 1e3)} s" for cell in bases.values())
    base = f"Base: {found.base} ({seconds})."
    rounds = [time(cell.samples).n for cell in timed]
    samples = [cell.samples.n for cell in timed]
    kind = INTERVAL if any(time(cell.samples).has_interval for cell in timed) else None
    intervals = f"with 95 % intervals ({INTERVAL})" if kind else "without intervals: fewer than 6 rounds"
    body = [f"Points are medians over rounds of a program's time over that of the base in the same round, {intervals},"
            f" {text.span(rounds)} rounds of one launch of each program in random order, {text.span(samples)} samples a point.", base]
    marked = sorted({cell.configuration.name for cell in timed if cell.marked})
    if marked:
        verb, whose = ("promises", "its") if len(marked) == 1 else ("promise", "their")
        body.append(f"Hollow: {text.listing(marked)} {verb} no bits; {whose} wrong pixels and depth errors are in the table.")
    body += [found.runtimes(cells)] if found.runtimes(cells) else []
    body.append(f"All other programs that are shown drew the bits of the specification, judged by {found.judge}. Machine: {found.machine}.")
    facts = Facts("medians of paired ratios", kind, base, (min(samples), max(samples)) if samples else None,
                  (min(rounds), max(rounds)) if rounds else None, found.machine)
    return Caption(f"The same source under several compilers and flags, {title}", " ".join(body),
                   "Left of the dashed line is faster than the base; where an interval reaches the line, do not name a winner.", facts)
