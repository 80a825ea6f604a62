"""Stability envelopes: how far each numeric mode can be taken, from the sweeps in a stability.jsonl.

A line is one picture: {sweep, parameter, numeric, pixels, drawn, wrong, unexplained, worst_distance_px,
max_depth_error_steps, judge (text, optional)}. A mode holds where at most BREAKING of the drawn pixels are wrong; its envelope is the longest run of
consecutive parameters on which it holds, and it breaks at the first parameter beyond each end. Which end is the hard one
depends on the sweep (small triangles, large translations, both extremes of the field of view), so both are looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import pandas as pd

from . import load, sidecars, style, text, writing
from .load import InputError
from .statistics.numbers import is_number
from .tables import Table

BREAKING = 1e-3
SWEEPS = {  # name: (title, parameter with its unit), in the order of the panels
    "near_far": ("Near and far planes", "far / near"),
    "translation": ("Translation of camera and object", "distance moved by (world units)"),
    "field_of_view": ("Field of view", "theta (radians)"),
    "triangle_size": ("Triangle size", "edge of triangles, breadth of slivers (pixels)"),
    "image_size": ("Image size", "width (pixels)")}
OPTIONAL = ("worst_distance_px", "max_depth_error_steps")


@dataclass(frozen=True)
class Sample:
    sweep: str
    parameter: float
    numeric: str
    pixels: int
    drawn: int
    wrong: int
    unexplained: int
    worst_distance_px: float | None
    max_depth_error_steps: float | None
    judge: str = ""  # whose picture it was compared with

    @property
    def share(self) -> float | None:
        """Wrong pixels of those that are drawn; all are wrong where none is drawn that should be, None where there is
        nothing to get wrong."""
        if self.drawn == 0:
            return 1.0 if self.wrong else None
        return self.wrong / self.drawn

    @property
    def holds(self) -> bool:
        return self.share is None or self.share <= BREAKING


@dataclass(frozen=True)
class Envelope:
    """One mode in one sweep, its samples in the order of their parameters."""

    sweep: str
    mode: str
    samples: list[Sample]
    held: list[Sample]  # empty: it holds nowhere
    breaks: list[Sample]  # beyond the lower end, beyond the upper end

    @property
    def unexplained(self) -> int:
        return sum(sample.unexplained for sample in self.samples)


def read(path: Path) -> list[Sample]:
    samples: list[Sample] = []
    seen: dict[tuple[str, float, str], int] = {}
    for line, content in enumerate(load.read_text(path, "no such file").split("\n"), start=1):
        if not content.strip():
            continue
        sample = _sample(path, line, load.parse(content, path, line))
        key = (sample.sweep, sample.parameter, sample.numeric)
        if key in seen:
            raise InputError(path, f"{sample.numeric} at {sample.parameter:g} of {sample.sweep} is also on line {seen[key]}", line, "parameter")
        seen[key] = line
        samples.append(sample)
    if not samples:
        raise InputError(path, "holds no samples")
    return samples


def _sample(path: Path, line: int, value: dict[str, Any]) -> Sample:
    def fail(key: str, expected: str) -> InputError:
        return InputError(path, f"expected {expected}, found {value[key]!r}" if key in value else "missing", line, key)

    if value.get("sweep") not in list(SWEEPS):
        raise fail("sweep", f"one of {', '.join(SWEEPS)}")
    if not isinstance(value.get("numeric"), str) or not value["numeric"]:
        raise fail("numeric", "the name of a numeric mode")
    if not is_number(value.get("parameter")) or value["parameter"] <= 0:
        raise fail("parameter", "a number above 0")
    for key in ("pixels", "drawn", "wrong", "unexplained"):
        if not isinstance(value.get(key), int) or isinstance(value[key], bool) or value[key] < 0:
            raise fail(key, "a whole number that is not below 0")
    if value["wrong"] > value["pixels"]:
        raise InputError(path, f"{value['wrong']} of {value['pixels']} pixels", line, "wrong")
    for key in OPTIONAL:
        if value.get(key) is not None and not (is_number(value[key]) and value[key] >= 0):
            raise fail(key, "a number that is not below 0, or null")
    return Sample(value["sweep"], float(value["parameter"]), value["numeric"], value["pixels"], value["drawn"], value["wrong"],
                  value["unexplained"], *(value.get(key) for key in OPTIONAL), str(value.get("judge") or ""))


def envelopes(samples: list[Sample]) -> list[Envelope]:
    """By sweep in the order of SWEEPS, then by mode in the order of the file."""
    found: dict[tuple[str, str], list[Sample]] = {}
    for sample in samples:
        found.setdefault((sample.sweep, sample.numeric), []).append(sample)
    result = []
    for sweep in SWEEPS:
        for (name, mode), mine in found.items():
            if name == sweep:
                result.append(_envelope(sweep, mode, sorted(mine, key=lambda s: s.parameter)))
    return result


def _envelope(sweep: str, mode: str, samples: list[Sample]) -> Envelope:
    begin = end = start = 0
    for i, sample in enumerate(samples):
        if not sample.holds:
            start = i + 1
        elif i + 1 - start > end - begin:
            begin, end = start, i + 1
    if begin == end:
        return Envelope(sweep, mode, samples, [], samples[:1])
    return Envelope(sweep, mode, samples, samples[begin:end], samples[max(0, begin - 1):begin] + samples[end:end + 1])


def table(found: list[Envelope]) -> Table:
    """One row a sweep and mode: from where to where it holds, and where it breaks."""
    numbers, words = [], []
    for envelope in found:
        low, high = (envelope.held[0], envelope.held[-1]) if envelope.held else (None, None)
        below = next((s for s in envelope.breaks if low is not None and s.parameter < low.parameter), None)
        above = next((s for s in envelope.breaks if high is not None and s.parameter > high.parameter), None)
        worst = max((s.share for s in envelope.samples if s.share is not None), default=None)
        title, unit = SWEEPS[envelope.sweep]
        numbers.append({
            "sweep": envelope.sweep, "mode": envelope.mode, "samples": len(envelope.samples), "holds_from": low and low.parameter,
            "holds_to": high and high.parameter, "breaks_below_at": below and below.parameter, "breaks_above_at": above and above.parameter,
            "wrong_below": below and below.wrong, "wrong_above": above and above.wrong, "largest_share": worst,
            "unexplained": envelope.unexplained})
        words.append({
            "sweep": title, "parameter": unit, "mode": envelope.mode,
            "holds": "nowhere" if low is None else f"{_said(low.parameter)} to {_said(high.parameter)}",
            "breaks at": _breaks(below, above) if low is not None else f"{_said(envelope.samples[0].parameter)} ({_wrong(envelope.samples[0])})",
            "largest share wrong": text.MISSING if worst is None else "0" if worst == 0 else f"{worst:.1e}",
            "beyond its bound": f"{envelope.unexplained:,} px" if envelope.unexplained else "0"})
    return Table("stability", "Stability envelopes", f"A mode holds where at most {BREAKING:g} of the drawn pixels are wrong: the longest run"
                 " of parameters. It breaks at the first parameter that was tried beyond it, if there is one. Between two parameters"
                 " nothing was tried.", pd.DataFrame(numbers), pd.DataFrame(words))


def _said(value: float) -> str:
    return f"{value:,.0f}" if value == round(value) and value < 1e6 else f"{value:.4g}"


def _wrong(sample: Sample) -> str:
    return f"{sample.wrong:,} of {sample.drawn:,} px"


def _breaks(*samples: Sample | None) -> str:
    said = [f"{_said(s.parameter)} ({_wrong(s)})" for s in samples if s is not None]
    return " and ".join(said) if said else "not in this range"


def write(path: Path, folder: Path) -> list[Path]:
    """The figure and its table; the paths of what was written."""
    from .figures import envelopes as drawing

    found = envelopes(read(path))
    with matplotlib.rc_context(style.RC):
        drawn = drawing.draw(found)
        files = sidecars.files(drawn, *sidecars.drawn_from(path, folder))
    made = table(found)
    files |= {f"{made.name}.csv": made.csv(), f"{made.name}.tex": made.tex(),
              f"{made.name}.txt": f"{drawn.caption.plain}\n{drawn.caption.reading}\n"}
    writing.refuse_inputs((folder / name for name in files), [path])
    for name, content in files.items():
        writing.write(folder / name, content)
    return [folder / name for name in files]


def plain(path: Path) -> str:
    """The table for a terminal."""
    words = table(envelopes(read(path))).words.drop(columns="parameter")
    columns = [[name, *map(str, words[name])] for name in words]
    widths = [max(map(len, cells)) for cells in columns]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in zip(*columns))
