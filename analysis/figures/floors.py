"""The floor of a point in figures: the time in which its bytes pass at the measured rate (harness/records.md), as a thin line."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from .. import style, text
from ..load import Record

LABEL = "floor: bytes at the measured rate"
NOTE = "Dotted: the floor, the time in which each triangle is read once and each pixel written once at the measured bandwidth."
REACH, LOG_REACH = 2.0, 10.0  # an axis is stretched at most this much for a line; one further away is named instead
DOTTED = (0, (1, 1.5))
DRAWN = "_floor"  # the lines' own label: the underscore keeps them out of legends, which have key()


def by_threads(records: list[Record]) -> dict[int, float]:
    """Milliseconds by thread count; empty where no record has a floor. Points of one picture share theirs."""
    found: dict[int, float] = {}
    for record in sorted(records, key=lambda r: r.config.threads):
        if record.floor_ms is not None:
            found[record.config.threads] = min(record.floor_ms, found.get(record.config.threads, record.floor_ms))
    return found


def ceilings(floors: dict[int, float], base_ms: float, counts: list[int]) -> dict[int, float]:
    """The speedup that a point at its floor would have over a base of `base_ms`, by thread count."""
    return {threads: base_ms / floors[threads] for threads in counts if threads in floors}


def notes(records: list[Record]) -> list[str]:
    return [NOTE] if by_threads(records) else []


def beside(records: list[Record], fastest: dict[str, float]) -> tuple[str, list[str]]:
    """For a figure whose places are taken: words for its title, and a note that gives the fastest times in milliseconds by name
    as multiples of the floor. Empty where there is none."""
    found = by_threads(records)
    if len(found) != 1:  # one line of words for one number of threads
        return "", []
    (floor,) = found.values()
    times = text.listing([f"{text.number(value / floor)} times for {name}" for name, value in fastest.items()], 12)
    return f"; floor {text.number(floor)}", [
        f"The floor of the picture is {text.number(floor)} ms, the time in which each triangle is read once and each pixel written once"
        f" at the measured bandwidth; the fastest cells take it {times}."]


def key(far: list[float] | None = None, unit: str = "") -> Line2D:
    """far: lines that are named, in this unit, because they are too far from the points to be drawn."""
    return Line2D([], [], color=style.GREY, lw=0.9, ls=DOTTED, label=LABEL + (f"; off the axis at {span(far)} {unit}" if far else ""))


def span(values: list[float]) -> str:
    low, high = text.number(min(values)), text.number(max(values))
    return low if low == high else f"{low} to {high}"


def reached(limits: tuple[float, float], log: bool, lines: dict[int, float]) -> tuple[tuple[float, float], dict[int, float], list[float]]:
    """The limits of an axis stretched for the lines within reach, these lines, and the places of the others. A linear axis starts
    at 0, so that nothing is too far below."""
    reach = LOG_REACH if log else REACH
    near = {i: at for i, at in lines.items() if at <= reach * limits[1] and (not log or at >= limits[0] / reach)}
    far = [at for i, at in lines.items() if i not in near]
    return (min([limits[0], *near.values()]), max([limits[1], *near.values()])), near, far


def across(axes: Axes, at: float, colour: str) -> None:
    """A line across the rows of a dot plot."""
    axes.axvline(at, color=colour, lw=0.9, ls=DOTTED, zorder=1, label=DRAWN)


def across_row(axes: Axes, at: float, y: float) -> None:
    """A line across one row, whose thread count the others need not share; on top of its bar."""
    axes.plot([at, at], [y - 0.48, y + 0.48], color="black", lw=1.1, ls=DOTTED, zorder=5, label=DRAWN, scalex=False, scaley=False)


def over_threads(axes: Axes, lines: list[dict[int, float]], colours: list[str]) -> None:
    """Ceilings as lines over threads, below a y axis that starts at 0 and has been set up for the points. What lies too far above
    is named at the edge instead, so that the points keep their room."""
    top = axes.get_ylim()[1]
    values = [value for line in lines for value in line.values()]
    if not values:
        return
    for line, colour in zip(lines, colours):
        axes.plot(list(line), list(line.values()), color=colour, lw=0.9, ls=DOTTED, zorder=1, label=DRAWN, scalex=False,
                  scaley=False)
    near = [value for value in values if value <= REACH * top]
    axes.set_ylim(0, max([top, *(style.HEADROOM * value for value in near)]))
    if len(near) < len(values):
        axes.text(0.03, 0.985, f"floor at {span(values)} times", transform=axes.transAxes, fontsize=6.5, color=style.GREY, va="top")
