"""Stability envelopes: one panel a sweep, one line a numeric mode, the share of wrong pixels over the parameter."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .. import style, text
from ..captions import Caption, Facts
from ..stability import BREAKING, SWEEPS, Envelope
from .common import Drawing
from .scales import round_values, said, set_ticks

COLUMNS, NARROWEST = 2, 2.6  # panels beside each other, and inches of one
# Pictures are compared, not times: a mode draws the same bits on every machine.
MACHINE = "any (modes with approximate reciprocals or contracted multiply-adds: any CPU of one type)"
LEFT, RIGHT, HEAD = 0.72, 0.1, 0.32  # inches
GAP = 0.72  # between the rows of panels: ticks, an axis label and a title
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)), (0, (3, 1, 1, 1, 1, 1)), (0, (8, 2)))
ENTRY = 0.17  # inches: a line of the legend
LANE = 0.09  # decades between the lines of two modes in the band of zeros
LEAST = 0.8  # decades of that band


def draw(found: list[Envelope]) -> Drawing:
    sweeps = [sweep for sweep in SWEEPS if any(e.sweep == sweep for e in found)]
    modes = list(dict.fromkeys(e.mode for e in found))
    across = min(style.panels_across(COLUMNS, NARROWEST), len(sweeps))
    rows = -(-len(sweeps) // across)
    keys = [_key(modes, mode) for mode in modes] + [
        Line2D([], [], color="black", marker="o", mfc="none", ms=8, mew=0.9, lw=0, label="breaking point"),
        Line2D([], [], color="black", lw=0.8, ls=(0, (4, 2)), label=f"{BREAKING:g} of the drawn")]
    labels = [key.get_label() for key in keys]
    # The legend takes the last place of the grid where that is free and large enough.
    wide = style.page_width() / across - LEFT - RIGHT
    each = 1.9 + 0.02 * len(modes)
    columns = style.legend_columns(labels, wide + LEFT)
    inside = len(sweeps) % across > 0 and ENTRY * -(-len(keys) // columns) < each + 0.3
    if not inside:
        columns = style.legend_columns(labels)
    foot = 0.5 + (0 if inside else ENTRY * -(-len(keys) // columns))
    each = min(each, (style.MAX_HEIGHT - HEAD - foot) / rows - GAP)
    height = HEAD + foot + rows * (each + GAP) - GAP + 0.2
    figure = style.new_figure(style.page_width(), height)
    for i, sweep in enumerate(sweeps):
        row, column = divmod(i, across)
        axes = style.place(figure, LEFT + column * (wide + LEFT + RIGHT), height - HEAD - 0.2 - (row + 1) * each - row * GAP, wide, each)
        _panel(axes, sweep, [e for e in found if e.sweep == sweep], modes)
    style.title(figure, "Stability envelopes: where each numeric mode breaks")
    corner = ((LEFT + wide + RIGHT + 0.3) / style.page_width(), (foot + each) / height) if inside else (0.05 / style.page_width(), 0.02 / height)
    figure.legend(handles=keys, loc="upper left" if inside else "lower left", bbox_to_anchor=corner, ncol=columns, borderaxespad=0.2,
                  columnspacing=1.0, handlelength=3.2)
    return Drawing("stability", "Stability envelopes", figure, _caption(found, modes))


def _look(modes: list[str], mode: str) -> dict:
    i = modes.index(mode)
    look = style.look(i)
    return dict(color=look.colour, marker=look.marker, ls=DASHES[i % len(DASHES)], ms=3.6, mew=0, lw=1.0)


def _key(modes: list[str], mode: str) -> Line2D:
    return Line2D([], [], label=mode, **_look(modes, mode))


def _panel(axes: Axes, sweep: str, found: list[Envelope], modes: list[str]) -> None:
    shares = [s.share for e in found for s in e.samples if s.share]
    low, high = math.floor(math.log10(min([*shares, BREAKING / 10]))), max(0, math.ceil(math.log10(max([*shares, BREAKING]))))
    band = max(LEAST, LANE * (len(found) + 3))
    # Modes without a wrong pixel lie in lanes of their own, else the last one drawn would hide the others.
    lanes = {e.mode: low - 0.25 - band * (i + 1) / (len(found) + 1) for i, e in enumerate(found)}
    parameters = [s.parameter for e in found for s in e.samples]
    axes.axhspan(low - 0.25 - band, low - 0.25, color=style.BAND, lw=0, zorder=0)
    axes.axhline(math.log10(BREAKING), color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
    for envelope in found:
        drawn = [(math.log10(s.parameter), math.log10(s.share) if s.share else lanes[envelope.mode], s)
                 for s in envelope.samples if s.share is not None]
        look = _look(modes, envelope.mode)
        axes.plot([x for x, _, _ in drawn], [y for _, y, _ in drawn], zorder=3, **look)
        for x, y, sample in drawn:
            if sample in envelope.breaks:
                axes.plot(x, y, marker="o", mfc="none", mec="black", ms=8, mew=0.9, zorder=4)
    title, unit = SWEEPS[sweep]
    axes.set_title(title, loc="left", weight="bold", fontsize=8, pad=3)
    axes.set_xlabel(unit, labelpad=2)
    axes.set_ylabel("wrong / drawn pixels", labelpad=2)
    begin, finish = min(parameters), max(parameters)
    margin = 0.04 * max(math.log10(finish / begin), 0.1)
    axes.set_xlim(math.log10(begin) - margin, math.log10(finish) + margin)
    axes.set_ylim(low - 0.25 - band, high + 0.15)
    ticks = sorted(round_values(begin, finish))
    ticks = ticks[:: -(-len(ticks) // 6)]
    set_ticks(axes.xaxis, [math.log10(t) for t in ticks], [said(t) for t in ticks])
    decades = list(range(low, high + 1))
    decades = decades[:: -(-len(decades) // 6)]
    set_ticks(axes.yaxis, [low - 0.25 - band / 2, *decades], ["none", *(said(10.0**d) for d in decades)])
    axes.grid(axis="x")


def _caption(found: list[Envelope], modes: list[str]) -> Caption:
    never = [m for m in modes if all(not e.breaks for e in found if e.mode == m)]
    beyond = [m for m in modes if any(e.unexplained for e in found if e.mode == m)]
    judges: dict[str, list[str]] = {}
    for sweep, judge in dict.fromkeys((e.sweep, s.judge) for e in found for s in e.samples if s.judge):
        judges.setdefault(judge, []).append(SWEEPS[sweep][0].lower())
    notes = [f"Share of the drawn pixels that the judge gives to another triangle, by numeric mode; rings mark the first parameter beyond a"
             f" mode's envelope at which more than {BREAKING:g} of them are wrong. Axes are logarithmic, with a band for none."]
    if judges:
        notes.append("Judged by: " + "; ".join(f"{judge} ({text.listing(names, len(SWEEPS))})" for judge, names in judges.items()) + ".")
    if never:
        notes.append(f"{text.listing(never, len(never))} {'breaks' if len(never) == 1 else 'break'} nowhere in these sweeps.")
    if beyond:
        notes.append(f"Wrong beyond their stated bound somewhere: {text.listing(beyond, len(beyond))}.")
    return Caption("Stability envelopes", " ".join(notes), "A line in the grey band has no wrong pixel; lines there are set apart only to be"
                   " seen. Right of (or left of) its ring a mode is not to be used.", Facts(None, None, None, None, None, MACHINE))
