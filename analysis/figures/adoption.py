"""An adopted program: speedup and efficiency over threads, one line a schedule, and the times of all points."""

from __future__ import annotations

from typing import Iterator

from matplotlib.lines import Line2D

from .. import style, text
from ..adopt import Adoption
from ..captions import Caption, Facts
from ..statistics import estimates, intervals
from .common import Block, Drawing, Point, Row, bounds, dots, named, pages, part, spread
from .scaling import curve, thread_axis

SECTION = "Adopted program"
BASE = "Base: the same program and OMP_SCHEDULE with OMP_NUM_THREADS=1, named with its seconds in the legend."


def draw(adoption: Adoption) -> Iterator[Drawing]:
    if len(adoption.threads) > 1:
        yield _scaling(adoption)
    yield from _times(adoption)


def _scaling(adoption: Adoption) -> Drawing:
    """Two panels as in the studies' figures, the legend names each base with its seconds."""
    schedules, counts = adoption.schedules, adoption.threads
    foot, tall = 0.55 + 0.17 * len(schedules), 2.45
    across = style.panels_across(2, 2.6)
    rows = 2 // across
    height = rows * (tall + 0.58) + (rows - 1) * 0.4 + foot
    figure = style.new_figure(style.page_width(), height)
    wide = (style.page_width() - 0.1) / across
    panels = [style.place(figure, 0.58 + i % across * wide, foot + (rows - 1 - i // across) * (tall + 0.98), wide - 0.68, tall) for i in range(2)]
    keys = []
    for i, schedule in enumerate(schedules):
        speedups = {point.threads: adoption.speedup(point) for point in adoption.line(schedule)}
        curve(panels[0], speedups, i)
        curve(panels[1], {n: estimates.efficiency(e, n) for n, e in speedups.items()}, i)
        seconds = estimates.median_estimate(adoption.base(schedule).samples).value / 1000
        look = style.look(i)
        keys.append(Line2D([], [], color=look.colour, marker=look.marker, ms=4, label=f"{schedule}: base {text.number(seconds)} s"))
    for axes, title, ideal in zip(panels, ("speedup over one thread", "efficiency: speedup / threads"), (counts, [1] * len(counts))):
        thread_axis(axes, counts)
        axes.set_title(title, loc="left", fontsize=8)
        axes.plot(counts, ideal, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        axes.set_ylim(0, max(axes.get_ylim()[1], 1.1))
    panels[0].annotate("ideal", (counts[-1], counts[-1]), xytext=(-3, 1), textcoords="offset points", ha="right", va="bottom", fontsize=7)
    panels[0].set_ylabel("speedup (times)")
    panels[1].set_ylabel("efficiency (1 = ideal)")
    style.title(figure, adoption.title)
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.03 / height), ncol=1, borderaxespad=0.2)
    kinds = sorted({e.kind for p in adoption.points if (e := adoption.speedup(p)).has_interval})
    return Drawing("adopt_scaling", SECTION, figure, Caption(
        f"Speedup and efficiency over threads of {adoption.title}",
        " ".join([
            _estimates("medians of paired ratios", adoption, " / ".join(kinds)),
            BASE, *_notes(adoption)]),
        "A line on the dashed one scales ideally. Reading the model and writing the picture are in the time, and do not scale.",
        _facts("medians of paired ratios", adoption, " / ".join(kinds), BASE)))


def _times(adoption: Adoption) -> Iterator[Drawing]:
    rows = []
    threads = adoption.threads
    near = {id(p) for p, c in zip(adoption.points, adoption.comparisons) if c.verdict in ("best", "same", "ambiguous")}
    best = next(p for p, c in zip(adoption.points, adoption.comparisons) if c.verdict == "best")
    for schedule in adoption.schedules:
        points = []
        for point in adoption.line(schedule):
            time = estimates.median_estimate(point.samples)
            points.append(Point(time.value, time.low, time.high, threads.index(point.threads), ringed=id(point) in near))
        rows.append(Row(schedule, tuple(points)))
    every = [p for row in rows for p in row.points]
    log = spread([p.value for p in every])
    split = pages([Block("OMP_SCHEDULE", rows)])
    for page, blocks in enumerate(split):
        figure = dots(blocks, [text.count(n, "thread") for n in threads], adoption.title + part(page, len(split)),
                      "time of the whole process (ms)" + (", log scale" if log else ""), limits=bounds(every), log=log,
                      ring="fastest, or not told apart from it")
        caption = Caption(
            f"Time by schedule and threads of {adoption.title}{part(page, len(split))}",
            " ".join([
                _estimates("medians", adoption, estimates.median_estimate(adoption.points[0].samples).kind),
                f"Ringed: the fastest point ({best.name}) and those that cannot be told apart from it (rank test, Holm-corrected, and"
                " paired interval).", *_notes(adoption)]),
            "Left is faster. Where intervals overlap or both points are ringed, do not name a winner.",
            _facts("medians", adoption, estimates.median_estimate(adoption.points[0].samples).kind, None))
        yield Drawing(named("adopt_times", page, len(split)), SECTION, figure, caption)


def _facts(what: str, adoption: Adoption, kind: str, base: str | None) -> Facts:
    """Each sample is a process of its own, so that there are as many launches as samples."""
    counts = [point.samples.n for point in adoption.points]
    sampled = (min(counts), max(counts))
    return Facts(what, kind if _has_intervals(adoption) and kind else None, base, sampled, sampled, adoption.machine)


def _has_intervals(adoption: Adoption) -> bool:
    return all(point.samples.n >= intervals.MIN_SAMPLES for point in adoption.points)


def _estimates(what: str, adoption: Adoption, kind: str) -> str:
    if not _has_intervals(adoption):
        return f"Points are {what} without intervals: too few samples ({adoption.sampled} a point)."
    return f"Points are {what} with 95 % intervals ({kind}), {adoption.sampled} samples a point."


def _notes(adoption: Adoption) -> list[str]:
    stop = {"target": "stopped when every interval was within the target", "max_samples": "stopped at the largest number of samples",
            "seconds": "stopped when the time was up"}.get(adoption.stop, "")
    return [f"Timed: {adoption.region}.", f"Randomised complete blocks, each sample a process of its own{'; ' + stop if stop else ''}.",
            f"Machine: {adoption.machine}.", *([adoption.noise] if adoption.noise else [])]
