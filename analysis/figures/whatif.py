"""What-if figures: predicted speedup over threads with what was measured, and schedule x chunk at 64 threads."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from .. import style, text
from ..captions import Caption, Facts
from ..loop_costs import LoopCosts
from ..whatif import ASKED, CAVEAT, RULES, THREADS, TIE, Comparison, Measured, Model, Rule
from .common import Drawing
from .schedules import CELL_HEIGHT, cell_number

SECTION = "What if"
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)), (0, (8, 2)), (0, (3, 1, 1, 1, 1, 1)))
TALL = 2.9  # inches
ENTRY = 0.17  # inches: a line of the legend
# Dark is efficient: one hue, so that it survives grey paper and every kind of colour vision.
SHADES = LinearSegmentedColormap.from_list("efficiency", ["#FFFFFF", "#BBD7EA", "#5E9DC8", "#0F4F82", "#06284A"])


def curves(model: Model, found: Comparison | None) -> Drawing:
    shown = {rule: model.best(ASKED[-1], rule)[0] for rule in RULES}
    points = _points(found)
    keys = [Line2D([], [], label=f"{p.name}", color=style.look(i).colour, ls=DASHES[i], lw=1.3) for i, p in enumerate(shown.values())]
    keys.append(Patch(facecolor=style.BAND, edgecolor=style.GREY, hatch="////", lw=0.4, label="beyond the bounds"))
    keys += [Line2D([], [], label=f"measured, {rule.name}", color=style.look(RULES.index(rule)).colour, marker=style.look(RULES.index(rule)).marker,
                    ms=7, mec="black", mew=1.0, lw=0) for rule in points]
    columns = style.legend_columns([key.get_label() for key in keys])
    foot = 0.45 + ENTRY * -(-len(keys) // columns)
    height = 0.35 + TALL + foot
    figure = style.new_figure(style.page_width(), height)
    axes = style.place(figure, 0.55, foot, style.page_width() - 0.7, TALL)
    _bounds(axes, model)
    for i, (rule, best) in enumerate(shown.items()):
        axes.plot(THREADS, [model.predict(rule, best.chunk, threads).speedup for threads in THREADS], color=style.look(i).colour, ls=DASHES[i],
                  lw=1.3, zorder=3)
    for rule, measured in points.items():
        look = style.look(RULES.index(rule))
        s = [m.speedup for m in measured]
        bars = np.array([[e.value - e.low, e.high - e.value] if e.has_interval else [0, 0] for e in s]).T
        axes.errorbar([m.prediction.threads for m in measured], [e.value for e in s], yerr=bars, fmt=look.marker, ms=7, color=look.colour, mec="black",
                      mew=1.0, ecolor="black", elinewidth=1.0, capsize=3, zorder=5)
    style.title(figure, f"What if: predicted speedup of the loop, {model.costs.name}")
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.02 / height), ncol=columns, borderaxespad=0.2,
                  columnspacing=1.0, handlelength=3.2)
    return Drawing("whatif_curves", SECTION, figure, _curves_caption(model, found, points))


def _points(found: Comparison | None) -> dict[Rule, list[Measured]]:
    """Of each rule and thread count the fastest measured chunk."""
    best: dict[Rule, dict[int, Measured]] = {}
    for point in found.points if found else []:
        mine = best.setdefault(point.prediction.rule, {})
        threads = point.prediction.threads
        if point.speedup is not None and (threads not in mine or point.time.value < mine[threads].time.value):
            mine[threads] = point
    return {rule: [mine[threads] for threads in sorted(mine)] for rule, mine in best.items() if mine}


def _bounds(axes: Axes, model: Model) -> None:
    """Shades what no schedule can reach: more than the threads, more than the largest iteration leaves."""
    bound = model.costs.total / model.costs.largest
    top = THREADS[-1] * 1.4
    x = np.geomspace(THREADS[0] / 1.15, THREADS[-1] * 1.15, 300)
    axes.fill_between(x, np.minimum(x, bound), top, facecolor=style.BAND, edgecolor="#D0D0D0", hatch="////", lw=0, zorder=1)
    axes.plot(x, np.minimum(x, bound), color=style.GREY, lw=0.8, zorder=2)
    if bound < THREADS[-1] / 3:
        axes.text(THREADS[-1] * 1.1, bound * 1.06, f"largest iteration: {text.number(bound)}", ha="right", va="bottom", fontsize=7, zorder=4,
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})
    middle = min(bound, THREADS[-1]) ** 0.45
    axes.text(middle, middle * 1.35, "as many as threads", ha="right", va="bottom", fontsize=7, zorder=4,
              bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})
    style.number_axis(axes, 1, THREADS[-1], True, "x")
    style.number_axis(axes, 1, min(THREADS[-1], max(bound, 2)), True, "y")
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.8, min(top, bound * 1.6))
    axes.set_xticks(THREADS, [str(t) for t in THREADS])
    axes.grid(axis="y")
    axes.set_xlabel("threads", labelpad=2)
    axes.set_ylabel("speedup over one thread", labelpad=2)


def _curves_caption(model: Model, found: Comparison | None, points: dict[Rule, list[Measured]]) -> Caption:
    costs = model.costs
    sentences = [f"Lines are predictions from the traced costs of {costs.n} iterations ({costs.unit}s), each with the chunk or grain that is predicted"
                 f" best at {ASKED[-1]} threads. {CAVEAT}. {_base(costs)} The hatched"
                 " part lies beyond the bounds by the number of threads and by the largest iteration."]
    kinds = ""
    if points:
        shown = [m for of in points.values() for m in of]
        counts = text.span([m.time.n for m in shown])
        kinds = text.listing(sorted({m.speedup.kind for m in shown if m.speedup.has_interval}))
        what = "loop" if found.of_loop else "whole raster stage"
        sentences.append(f"Large symbols are measured: the median speedup of the {what} with the fastest measured chunk over the same kernel on"
                         f" one thread ({counts}; {f'95 % intervals, {kinds}' if kinds else 'no intervals: too few samples'}). Machine: {found.machine}.")
    else:
        sentences.append("Nothing was measured." + (f" Costs of {costs.machine}." if costs.machine else ""))
    samples = [m.record.samples for of in points.values() for m in of]
    counts, launches = [s.n for s in samples], [s.launch_count for s in samples]
    facts = Facts("median speedups" if samples else None, kinds or None if samples else None, _base(costs), (min(counts), max(counts)) if samples else None,
                  (min(launches), max(launches)) if samples else None, found.machine if samples else costs.machine)
    return Caption("What if there were more threads", " ".join(sentences),
                   "A line that bends before the hatched part loses to its chunks or their dispatch; symbols below their line lose to what no prediction has.", facts)


def _base(costs: LoopCosts) -> str:
    return f"Base: the loop on one thread, {text.number(costs.total / 1e3)} ms, without dispatch."


def heat_map(model: Model) -> Drawing:
    threads = ASKED[-1]
    found = model.at(threads)
    best = model.best(threads)
    chunks = sorted({p.chunk for p in found}, key=lambda c: -1 if c is None else c)
    rows = [rule.name for rule in RULES]
    left = 0.25 + style.text_width(rows, 7)
    wide = style.page_width() - left - 0.1
    cell = wide / len(chunks)
    ticks = ["n/threads" if c is None else str(c) for c in chunks]
    turned = style.text_width(ticks, 7) > 0.95 * cell
    beside = style.page_width() - left > 4.2  # whether the keys have room beside the bar
    foot = (0.98 if beside else 1.2) + 0.35 * turned
    height = 0.35 + len(rows) * CELL_HEIGHT + foot
    figure = style.new_figure(style.page_width(), height)
    axes = style.place(figure, left, foot, wide, len(rows) * CELL_HEIGHT)
    norm = Normalize(0, 1)
    axes.set_xlim(-0.5, len(chunks) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.tick_params(length=0)
    axes.set_facecolor("#EFEFEF")  # no such chunk
    for spine in axes.spines.values():
        spine.set_visible(False)
    for p in found:
        x, y = chunks.index(p.chunk), RULES.index(p.rule)
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=SHADES(norm(p.efficiency)), edgecolor="white", lw=0.5))
        if p in best:
            first = p is best[0]
            axes.add_patch(Rectangle((x - 0.46, y - 0.41), 0.92, 0.82, facecolor="none", lw=1.8 if first else 0.8, ls="-" if first else "--",
                                     edgecolor="black" if p.efficiency < 0.6 else "white", zorder=3))
        axes.text(x, y, cell_number(100 * p.efficiency, cell), fontsize=6.5, ha="center", va="center", color="black" if p.efficiency < 0.45 else "white",
                  weight="bold" if p is best[0] else "normal", zorder=4)
    axes.set_xticks(range(len(chunks)), ticks, fontsize=7, rotation=90 if turned else 0)
    axes.set_yticks(range(len(rows)), rows, fontsize=7)
    axes.set_xlabel("chunk or grain (iterations)", fontsize=7.5, labelpad=2)
    style.title(figure, f"What if: predicted efficiency at {threads} threads (%), {model.costs.name}")
    bar = style.place(figure, left, 0.34 if beside else 0.56, min(1.8, style.page_width() - left - 0.2), 0.09)
    figure.colorbar(ScalarMappable(norm, SHADES), cax=bar, orientation="horizontal")
    bar.set_xticks([0, 0.5, 1], ["0", "50", "100"], fontsize=7)
    bar.set_xlabel("efficiency (%)", fontsize=7.5, labelpad=1)
    keys = [Patch(facecolor="#5E9DC8", edgecolor="black", lw=1.8, label="best"),
            Patch(facecolor="#5E9DC8", edgecolor="black", lw=0.8, ls="--", label=f"tie (within {text.percent(TIE)})")]
    figure.legend(handles=keys, loc="lower left", ncol=2,
                  bbox_to_anchor=((left + 2.1 if beside else 0.05) / style.page_width(), (0.2 if beside else 0.02) / height))
    caption = Caption(
        f"Predicted efficiency of schedules and chunks at {threads} threads",
        f"Cells are the predicted speedup over the loop on one thread ({text.number(model.costs.total / 1e3)} ms), divided by {threads}, in per cent;"
        f" the rules of libgomp and libomp differ in guided. {CAVEAT}: nothing here was measured but the costs of {model.costs.n} iterations and the"
        f" overhead of a chunk. Frames: the fastest (white on dark cells), and dashed what is within {text.percent(TIE)} of it.",
        "Look for dark cells: small chunks pay for dispatch, large ones for imbalance.",
        Facts(None, None, _base(model.costs), None, None, model.costs.machine))
    return Drawing("whatif_schedules", SECTION, figure, caption)
