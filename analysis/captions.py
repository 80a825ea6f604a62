"""Captions are generated, so that none claims a base, a count or a machine that the data do not have."""

from __future__ import annotations

from dataclasses import dataclass

from . import text
from .comparison import Analysis
from .load import Record


@dataclass(frozen=True)
class Caption:
    """title: what it is · body: base, n, interval, machine · reading: how to read it, in one line."""

    title: str
    body: str
    reading: str

    @property
    def plain(self) -> str:
        return f"{self.title}. {self.body}"


def build(analysis: Analysis, title: str, reading: str, shown: list[Record], *, estimates: str | None = "medians",
          kind: str | None = None, base: str = "", notes: list[str] | None = None) -> Caption:
    """The body of every caption has the same order: what is drawn, base, interval and n, notes, machine."""
    sentences = []
    if estimates and shown:
        kind = analysis.interval_kind(shown) if kind is None else kind
        size = analysis.sampled(shown) + " samples a point"
        sentences.append(f"Points are {estimates} with 95 % intervals ({kind}), {size}." if kind else
                         f"Points are {estimates} without intervals: too few samples ({size}).")
    if base:
        sentences.append(base)
    sentences += notes or []
    launches = {record.samples.launch_count for record in shown if record.ok}
    if launches:
        sentences.append(f"{text.count(max(launches), 'launch', 'launches')}.")
    sentences.append(f"Machine: {analysis.machine}.")
    return Caption(title, " ".join(sentences), reading)
