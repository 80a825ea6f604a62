"""Triangles x pixels per triangle -> the fastest strategy, by colour and name, with its lead over the second."""

from __future__ import annotations

from typing import Iterator

from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch, Rectangle

from .. import captions, strategy_map, style, text
from ..comparison import Analysis
from ..strategy_map import Cell, Map
from .common import Drawing

CELL_HEIGHT = 0.5  # inches
PALE = 0.45  # share of a kernel's colour in its cells: black words stay readable on it
TIE_HATCH = "////"
SMALLEST = 6.0  # points; a name that would be smaller takes two lines


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for found in strategy_map.maps(analysis):
        yield _draw(analysis, found)


def paled(colour: str) -> tuple[float, float, float]:
    return tuple(1 - PALE * (1 - part) for part in to_rgb(colour))


def _draw(analysis: Analysis, found: Map) -> Drawing:
    rows, across = found.rows, found.columns
    shown = [r for cell in found.cells.values() for r in (cell.best, cell.second) if r is not None]
    named = [strategy_map.interval(*row) for row in rows]
    left = 0.45 + style.text_width(named, 7.5)
    wide = (style.page_width() - left - 0.1) / len(across)
    # Colours for those that lead somewhere only: the first of the palette are the easiest to tell apart.
    leaders = [k for k in found.kernels if any(c.best is not None and c.best.config.kernel == k for c in found.cells.values())]
    colours = {kernel: paled(style.look(i).colour) for i, kernel in enumerate(leaders)}
    keys = [Patch(facecolor=colour, edgecolor="black", lw=0.4, label=kernel) for kernel, colour in colours.items()]
    keys.append(Patch(facecolor="white", hatch=TIE_HATCH, edgecolor="#8C8C8C", lw=0.4, label="tie: the best two cannot be told apart"))
    if len(found.cells) < len(rows) * len(across):
        keys.append(Patch(facecolor="white", edgecolor="#BFBFBF", lw=0.6, ls=":", label="blank: not measured"))
    per_row = style.legend_columns([key.get_label() for key in keys])
    foot = 0.55 + 0.18 * -(-len(keys) // per_row)
    height = foot + CELL_HEIGHT * len(rows) + 0.35
    figure = style.new_figure(style.page_width(), height)
    axes = style.place(figure, left, foot, style.page_width() - left - 0.1, CELL_HEIGHT * len(rows))
    axes.set_xlim(-0.5, len(across) - 0.5)
    axes.set_ylim(-0.5, len(rows) - 0.5)  # small triangles at the bottom, as on an axis
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    for y in range(len(rows)):
        for x in range(len(across)):
            cell = found.cells.get((y, x))
            if cell is None:
                axes.add_patch(Rectangle((x - 0.47, y - 0.46), 0.94, 0.92, facecolor="none", edgecolor="#BFBFBF", lw=0.6, ls=":"))
            else:
                _cell(axes, x, y, cell, colours, 72 * wide * 0.8)
    ticks = [f"{low:,}" if low == high else f"{low:,} to {high:,}" for low, high in across]
    if style.text_width(ticks, 7.5) > 0.95 * wide:
        ticks = [words.replace(" to ", "\nto ") for words in ticks]
    axes.set_xticks(range(len(across)), ticks)
    axes.set_yticks(range(len(rows)), named)
    axes.set_xlabel("triangles")
    axes.set_ylabel("pixels per triangle, as counted")
    threads = sorted({r.config.threads for r in shown})
    style.title(figure, f"{found.heading}, {found.title}, {text.count(threads[-1], 'thread')}" if threads else found.title)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=per_row,
                  borderaxespad=0.2, columnspacing=1.2)
    notes = ["A cell names the fastest kernel and how many times its time the best other kernel takes (paired median). Hatched: the best"
             " two cannot be told apart (rank test, corrected for all pictures, and paired interval); both are named, with how many more.",
             "Pixels per triangle are the fragments covered per triangle drawn."]
    blank = len(rows) * len(across) - len(found.cells)
    if blank:
        notes.append(f"{text.count(blank, 'cell')} of {len(rows) * len(across)} {'is' if blank == 1 else 'are'} blank: not in the study.")
    untimed = {r.config.kernel: 0 for cell in found.cells.values() for r in cell.group.untimed}
    for cell in found.cells.values():
        for r in cell.group.untimed:
            untimed[r.config.kernel] += 1
    if untimed:
        notes.append("Without a time in some cells, and so out of the contest there: "
                     + text.listing([f"{kernel} ({many})" for kernel, many in untimed.items()], 8) + ".")
    executions = sorted({analysis.execution(r) for r in shown})
    notes.append(f"Compared are {text.listing(found.kernels, 12)}, with {text.listing(executions, 3)}.")
    if found.without:
        notes.append(f"{text.listing(list(found.without), 4)} {'leads' if len(found.without) == 1 else 'lead'} wherever"
                     f" {'it' if len(found.without) == 1 else 'they'} and these were timed, and {'is' if len(found.without) == 1 else 'are'} left out here.")
    but = f" but for {text.listing(list(found.without), 4)}" if found.without else ""
    caption = captions.build(analysis, f"Where each strategy wins{but}, {found.title}",
                             "Find the cell of a scene by its triangles and the pixels that each covers; where the lead is small or the"
                             " cell hatched, the choice matters little.", shown, estimates=None, notes=notes)
    return Drawing(f"map_{found.slug}", strategy_map.SECTION, figure, caption)


def _cell(axes: Axes, x: int, y: int, cell: Cell, colours: dict[str, tuple[float, float, float]], room: float) -> None:
    """room: points that words may take."""
    if cell.best is None:
        axes.text(x, y, "none timed", fontsize=6.5, style="italic", color=style.FAILED,
                  ha="center", va="center")
        return
    colour = colours[cell.best.config.kernel]
    tie = cell.winner == strategy_map.TIE
    axes.add_patch(Rectangle((x - 0.47, y - 0.46), 0.94, 0.92, facecolor=colour, edgecolor="black", lw=0.4))
    if tie:
        # The hatch keeps to the rim, so that the words stay readable.
        axes.add_patch(Rectangle((x - 0.47, y - 0.46), 0.94, 0.92, facecolor="none", hatch=TIE_HATCH, edgecolor="#8C8C8C", lw=0))
        axes.add_patch(Rectangle((x - 0.42, y - 0.36), 0.84, 0.72, facecolor=colour, lw=0))
    more = f" +{len(cell.tied) - 1}" if len(cell.tied) > 1 else ""
    lead = f"tie: {cell.tied[0]}{more}" if tie else f"{text.number(cell.lead.value)}x" if cell.lead else "no other timed"
    lines = [cell.best.config.kernel, lead]
    sizes = (7.5, 7.5 if cell.lead and not tie else 6.5)
    for words, size, at in zip(lines, sizes, (0.17, -0.17)):
        fits = min(size, size * room / (72 * style.text_width([words], size, bold=at > 0)))
        if fits < SMALLEST and "_" in words:
            words = words.replace("_", "_\n", 1)
            fits = min(size, size * room / (72 * style.text_width([words], size, bold=at > 0)))
        axes.text(x, y + at, words, fontsize=fits, ha="center", va="center", weight="bold" if at > 0 else "normal")
