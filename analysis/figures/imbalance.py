"""Busy time of each thread as bars, for the fastest execution of each kernel on the most threads."""

from __future__ import annotations

from typing import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .. import captions, fitting, style, text
from ..comparison import Analysis, Group
from ..load import Record
from ..raster_loop import busy
from .balance import SECTION, imbalance, loop
from .common import Drawing, drawn_together, named, part

COLUMNS, NARROWEST = 3, 1.6  # panels beside each other, and inches of one
TALL = 1.25  # inches of a panel
LABELLED = 8  # threads up to which each bar has its number
HIGHEST = "////"


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        records = chosen(analysis, group)
        if records and not drawn_together(analysis, group):
            step = style.panels_across(COLUMNS, NARROWEST) * max(1, int((style.MAX_HEIGHT - 1.3) / (TALL + 0.75)))
            split = [records[i:i + step] for i in range(0, len(records), step)]
            for page, some in enumerate(split):
                yield _draw(analysis, group, some, page, len(split))


def chosen(analysis: Analysis, group: Group) -> list[Record]:
    """The fastest point of each kernel at the highest thread count of the group that has busy times."""
    records = [r for r in group.timed if loop(r)]
    threads = max((r.config.threads for r in records), default=0)
    found = [analysis.fastest([r for r in records if r.config.kernel == kernel and r.config.threads == threads]) for kernel in group.kernels]
    return [record for record in found if record is not None]


def _draw(analysis: Analysis, group: Group, records: list[Record], page: int, pages: int) -> Drawing:
    threads = records[0].config.threads
    columns = min(style.panels_across(COLUMNS, NARROWEST), len(records))
    rows = -(-len(records) // columns)
    keys = [Patch(fc=style.COLOURS[5], ec="black", lw=0.4, label="busy time of a thread"),
            Patch(fc=style.COLOURS[1], ec="black", lw=0.4, hatch=HIGHEST, label="of the busiest thread"),
            Line2D([], [], color="black", lw=1.0, ls=(0, (4, 2)), label="mean over the threads")]
    per_row = style.legend_columns([key.get_label() for key in keys])
    wide = (style.page_width() - 0.1) / columns
    names = [fitting.lines(f"{r.config.kernel}, {analysis.execution(r)}", 7.5, wide - 0.55) for r in records]
    more = 0.13 * max(name.count("\n") for name in names)  # inches
    foot, each = 0.49 + 0.17 * -(-len(keys) // per_row), TALL + 0.75 + more
    height = rows * each + foot + 0.1
    figure = style.new_figure(style.page_width(), height)
    for i, record in enumerate(records):
        row, column = divmod(i, columns)
        axes = style.place(figure, 0.58 + column * wide, height - 0.62 - more - row * each - TALL, wide - 0.68, TALL)
        _panel(axes, busy(record))
        axes.set_title(f"{names[i]}\nmax / mean = {imbalance(record):.2f}", loc="left", fontsize=7.5, linespacing=1.15, pad=4)
        axes.set_ylabel("busy time (ms)" if column == 0 else "")
        axes.set_xlabel("thread" if i + columns >= len(records) else "")
    title = f"{group.title}, {text.count(threads, 'thread')}{part(page, pages)}"
    style.title(figure, title)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=per_row, borderaxespad=0.2,
                  columnspacing=1.2)
    caption = captions.build(
        analysis, f"Busy time by thread, {title}",
        "Bars of one height share evenly; all others wait for the hatched one.", records, estimates=None,
        notes=[f"Bars are median busy times in the raster stage ({analysis.sampled(records)}), without intervals, since records hold one"
               " busy time a thread. Of each kernel its fastest execution is shown; each panel has a scale of its own."])
    return Drawing(named(f"imbalance_{group.slug}", page, pages), SECTION, figure, caption)


def _panel(axes: Axes, times: list[float]) -> None:
    longest = int(np.argmax(times))
    for i, time in enumerate(times):
        axes.bar(i, time, width=0.8, color=style.COLOURS[1 if i == longest else 5], hatch=HIGHEST if i == longest else "", ec="black",
                 lw=0.4 if len(times) <= 64 else 0)
    axes.axhline(sum(times) / len(times), color="black", lw=1.0, ls=(0, (4, 2)), zorder=4)
    axes.set_xlim(-0.6, len(times) - 0.4)
    axes.set_ylim(0, 1.08 * max(times))
    step = 1 if len(times) <= LABELLED else -(-len(times) // 8)
    axes.set_xticks(range(0, len(times), step), [str(i) for i in range(0, len(times), step)])
    axes.minorticks_off()
    axes.grid(axis="y")
