"""Captions are generated, so that none claims a base, a count or a machine that the data do not have."""

from __future__ import annotations

from dataclasses import dataclass

from . import nodes, text
from .comparison import Analysis
from .load import Record


@dataclass(frozen=True)
class Facts:
    """What a caption says, for programs: the file beside each figure has it, and the linter reads it. None: nothing of it is
    shown (no estimates, no base), or it is unknown (no interval)."""

    estimates: str | None  # "medians", ...
    interval: str | None  # kind of the 95 % intervals
    base: str | None
    samples: tuple[int, int] | None  # fewest and most of a point
    launches: tuple[int, int] | None
    machine: str | None


@dataclass(frozen=True)
class Caption:
    """title: what it is · body: base, n, interval, machine · reading: how to read it, in one line."""

    title: str
    body: str
    reading: str
    facts: Facts | None = None

    @property
    def plain(self) -> str:
        return f"{self.title}. {self.body}"


def build(analysis: Analysis, title: str, reading: str, shown: list[Record], *, estimates: str | None = "medians",
          kind: str | None = None, base: str = "", notes: list[str] | None = None) -> Caption:
    """The body of every caption has the same order: what is drawn, base, interval and n, notes, machine."""
    sentences = []
    timed = [record.samples for record in shown if record.ok]
    if estimates and shown:
        kind = analysis.interval_kind(shown) if kind is None else kind
        size = analysis.sampled(shown) + " samples a point"
        sentences.append(f"Points are {estimates} with 95 % intervals ({kind}), {size}." if kind else
                         f"Points are {estimates} without intervals: too few samples ({size}).")
    if base:
        sentences.append(base)
    sentences += notes or []
    launches = [samples.launch_count for samples in timed]
    counts = [samples.n for samples in timed]
    facts = Facts(estimates if shown else None, kind or None if estimates and shown else None, base or None,
                  (min(counts), max(counts)) if counts else None, (min(launches), max(launches)) if launches else None,
                  nodes.machine(shown) or analysis.machine)
    if launches:
        sentences.append(f"{text.count(max(launches), 'launch', 'launches')}.")
    sentences.append(f"Machine: {facts.machine}.")
    return Caption(title, " ".join(sentences), reading, facts)
