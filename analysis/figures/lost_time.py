"""The lost-time identity at the highest thread count of a picture: thread time, divided by what it went into."""

from __future__ import annotations

from typing import Iterator

from matplotlib.patches import Patch

from .. import captions, lost_time, style, text
from ..comparison import Analysis, Group
from ..lost_time import TERMS, LostTime
from .common import Block, Drawing, Row, drawn_together, named, pages, part, row_frame

MOST = 30  # rows; with more, only the fastest execution of each kernel and backend
LOOKS = {"useful": ("#D9D9D9", ""), "inflation": (style.COLOURS[1], ""), "locks": ("#F0E442", "oooo"), "imbalance": (style.COLOURS[0], "----"), "dispatch": (style.COLOURS[4], "////"),
         "synchronisation": (style.COLOURS[2], "...."), "serial": (style.COLOURS[3], "xxxx"), "others": (style.COLOURS[5], "\\\\\\\\"),
         "residual": ("#FFFFFF", "++++")}
NAMES = {"useful": "T(1): the work of one thread"} | TERMS


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        if not drawn_together(analysis, group):
            yield from _draw(analysis, group)


def chosen(analysis: Analysis, group: Group) -> tuple[list[LostTime], bool]:
    """Those at the highest thread count, and whether they are all of them."""
    found = lost_time.lost_times(analysis, group)
    highest = max((one.record.config.threads for one in found), default=0)
    found = [one for one in found if one.record.config.threads == highest]
    if len(found) <= MOST:
        return found, True
    classes: dict[tuple[str, str], LostTime] = {}
    for one in sorted(found, key=lambda f: analysis.estimates[f.record.id].value):
        classes.setdefault((one.record.config.kernel, one.record.config.backend), one)
    return list(classes.values()), False


def shares(one: LostTime) -> dict[str, float]:
    """Percent of P T(P); what is unknown is left out."""
    return {name: 100 * ms / one.total for name, ms in ({"useful": one.useful} | one.terms).items() if ms is not None}


def _draw(analysis: Analysis, group: Group) -> Iterator[Drawing]:
    found, complete = chosen(analysis, group)
    if not found:
        return
    order = {(one.record.config.kernel, analysis.execution(one.record)): one for one in found}
    blocks = []
    for kernel in group.kernels:
        rows = [Row(execution, note=f"{round(shares(one)['residual'], 1) + 0.0:+.1f}") for (of, execution), one in order.items() if of == kernel]
        if rows:
            blocks.append(Block(kernel, rows))
    threads = found[0].record.config.threads
    drawn = [name for name in LOOKS if any(name in shares(one) for one in found)]
    keys = [Patch(fc=LOOKS[name][0], hatch=LOOKS[name][1], ec="black", lw=0.4, label=NAMES[name]) for name in drawn]
    lowest = min(sum(s for s in shares(one).values() if s < 0) for one in found)
    highest = max(sum(s for s in shares(one).values() if s > 0) for one in found)
    split = pages(blocks)
    for page, some in enumerate(split):
        frame = row_frame(some, f"{group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
                          "share of the thread time P T(P) (%); at the right: the residual", limits=(0, max(highest, 100)), log=False, keys=keys)
        frame.axes.set_xlim(min(0.0, 1.05 * lowest), 1.02 * max(highest, 100))
        kernels = [block.kernel for block in some for _ in block.rows]
        for (y, row), kernel in zip(frame.rows, kernels):
            left = {True: 0.0, False: 0.0}  # negative terms to the left of 0, positive ones to the right
            for name, share in shares(order[kernel, row.label]).items():
                frame.axes.barh(y, share, left=left[share < 0], height=0.72, color=LOOKS[name][0], hatch=LOOKS[name][1], ec="black", lw=0.4, zorder=3)
                left[share < 0] += share
        for at in (0, 100):
            frame.axes.axvline(at, color="black", lw=0.8, ls="-" if at == 0 else (0, (4, 2)), zorder=4)
        on_page = [order[kernel, row.label] for (_, row), kernel in zip(frame.rows, kernels)]
        both = sum(one.terms["dispatch"] is not None for one in on_page)
        notes = [f"T(1) is the serial backend's frame of the same kernel ({sum(one.over_serial for one in on_page)} of {len(on_page)} bars), else the"
                 f" point's own on one thread; dispatch is told from the work where the study has both ({both} of {len(on_page)} bars).",
                 f"Bars are of medians ({analysis.sampled([one.record for one in on_page])} samples), without intervals; the largest residual is"
                 f" {100 * lost_time.worst_residual(on_page):.1f} % of P T(P).",
                 "Work inflation holds repeated atomics and contended hand-out; terms below 0 save time and stand left of it.",
                 lost_time.RESIDUAL + lost_time.older_remark(sum(not one.per_sample for one in on_page))
                 + lost_time.uncounted_remark(sum(one.terms["locks"] is None for one in on_page))]
        if not complete:
            notes.append("Of each kernel and backend only the fastest execution is drawn; tables/lost_time.csv has all.")
        caption = captions.build(
            analysis, f"Lost time, {group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
            "The grey part is parallel efficiency; all right of it is time that threads spend on something else, by its cause.",
            [one.record for one in on_page], estimates=None, notes=notes)
        yield Drawing(named(f"lost_time_{group.slug}", page, len(split)), lost_time.SECTION, frame.figure, caption)
