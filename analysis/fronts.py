"""Fronts of speed against errors: what dominates what, in the manner of Herbie's plots (speedup over the program as it was
given on one axis, accuracy on the other).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

from . import text
from .load import Record
from .statistics.estimates import Estimate
from .statistics.numbers import is_number

LITERAL = "literal program"


def number(record: Record, part: str, key: str) -> float | None:
    """A number of the record's verdicts, such as oracle.wrong; None where it was not recorded."""
    section = record.verify.get(part)
    value = section.get(key) if isinstance(section, dict) else None
    return float(value) if is_number(value) else None


def unbounded(record: Record) -> bool:
    bound = record.verify.get("bound")
    if isinstance(bound, dict) and isinstance(bound.get("bounded"), bool):
        return not bound["bounded"]
    return number(record, "oracle", "predicted") == -1


@dataclass(frozen=True)
class Measure:
    """A way to count errors; 0 is exact in all of them."""

    key: str
    noun: str
    unit: str
    part: str  # where it stands in a record's verify
    name: str

    def of(self, record: Record) -> float | None:
        return number(record, self.part, self.name)

    def said(self, value: float) -> str:
        return amount(value) + (" " + self.unit if self.unit else "")


WRONG = Measure("wrong", "wrong pixels", "px", "oracle", "wrong")
DEPTH = Measure("depth", "largest depth error", "steps", "oracle", "max_depth_error_steps")
END_TO_END = Measure("end_to_end", "wrong pixels end to end", "px", "end_to_end", "wrong")
MEASURES = (WRONG, DEPTH, END_TO_END)


def amount(value: float) -> str:
    """'12,345', '0.5', '3.33': counts in full, means and depth errors to three digits."""
    return f"{value:,.0f}" if value == round(value) or value >= 100 else text.number(value)


@dataclass(frozen=True)
class Worst:
    scene: str
    speedup: float
    error: float


@dataclass(frozen=True)
class Mark:
    """A mode's place on a plot: one record a picture, the speedup over the base, the error."""

    name: str
    records: tuple[Record, ...]
    speedup: Estimate
    error: float
    worst: Worst | None = None  # over scenes: the one with the largest error, of equals the slowest

    @property
    def unbounded(self) -> bool:
        return any(map(unbounded, self.records))

    @property
    def kernels(self) -> str:
        return "/".join(dict.fromkeys(r.config.kernel for r in self.records))


@dataclass(frozen=True)
class Front:
    """Marks by one measure. The frontier holds those that no other mark equals or betters in both speed and error.

    A mode off the frontier is called dominated only if a mode on it is at most as wrong and the times support it; else
    it is open: another run may put it on the line.
    """

    measure: Measure
    marks: list[Mark]
    frontier: list[Mark]  # the fastest first
    dominated: dict[str, str]  # mode: the fastest mode of the frontier that dominates it, if possible one with a bound
    open: list[str]

    @property
    def bounded_frontier(self) -> list[Mark]:
        """The frontier of the modes that have a bound alone."""
        return _line([mark for mark in self.marks if not mark.unbounded])

    def role(self, name: str) -> str:
        if name in self.dominated:
            return f"dominated by {self.dominated[name]}"
        if any(mark.name == name for mark in self.frontier):
            return "frontier"
        return "not told apart" if name in self.open else text.MISSING


def _line(marks: list[Mark]) -> list[Mark]:
    """The marks that no other equals or betters in both speed and error, the fastest first."""
    frontier: list[Mark] = []
    for mark in sorted(marks, key=lambda m: (-m.speedup.value, m.error)):
        if not frontier or mark.error < frontier[-1].error:
            frontier.append(mark)
    return frontier


def front(measure: Measure, marks: list[Mark], dominates: Callable[[Mark, Mark], bool]) -> Front:
    frontier = _line(marks)
    dominated: dict[str, str] = {}
    undecided: list[str] = []
    for mark in marks:
        if mark in frontier or mark.name == LITERAL:
            continue
        better = [f for f in frontier if f.error <= mark.error and dominates(f, mark)]
        if better:  # a mode that promises something is the better witness
            dominated[mark.name] = min(better, key=lambda f: f.unbounded).name
        else:
            undecided.append(mark.name)
    return Front(measure, marks, frontier, dominated, undecided)
