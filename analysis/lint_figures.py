"""The rules of figures, checked in the files beside them (analysis/sidecars.py)."""

from __future__ import annotations

from typing import Any, Iterator

from . import load, style
from .lint import Finding, Folder
from .severity import GRAVE, NOTE

SMALLEST_TEXT = 5.5  # points, at the width of a page
RATIOS = ("speedup", "efficiency")


def caption(folder: Folder) -> Iterator[Finding]:
    for file in folder.undescribed:
        yield Finding(GRAVE, file, file, "nothing beside it says what it shows", "draw it with `python3 -m analysis report`, or move it away")
    for file, figure in folder.figures:
        facts = figure["facts"]
        if facts is None:
            yield Finding(GRAVE, file, _name(figure), "says nothing of its data", "give its caption the facts (captions.Facts)")
            continue
        if not facts.get("machine") or str(facts["machine"]).startswith("unknown"):
            yield Finding(GRAVE, file, _name(figure), "does not name the machine", "record machine.cpu")
        if facts.get("estimates") and not facts.get("samples"):
            yield Finding(GRAVE, file, _name(figure), "does not say how many samples its points have", "build the caption from the records")
        if facts.get("estimates") and not facts.get("interval"):
            yield Finding(NOTE, file, _name(figure), "shows estimates without intervals", "take at least 6 samples a point")


def base(folder: Folder) -> Iterator[Finding]:
    for file, figure in folder.figures:
        ratio = next((w for w in RATIOS if any(w in str(label).lower() for label in figure["axes"])), None)
        if ratio and not (figure["facts"] or {}).get("base"):
            yield Finding(GRAVE, file, _name(figure), f"an axis of {ratio} and no base in the caption", "name the base and its seconds")


def lines(folder: Folder) -> Iterator[Finding]:
    for file, figure in folder.figures:
        for line in figure["lines_across_categories"]:
            yield Finding(GRAVE, file, _name(figure), f"a line joins categories ({line})", "draw points: there is nothing between kernels")


def legible(folder: Folder) -> Iterator[Finding]:
    for file, figure in folder.figures:
        smallest, size = figure["smallest_text_pt"], figure["size_inches"]
        if smallest is not None and smallest < SMALLEST_TEXT:
            yield Finding(NOTE, file, _name(figure), f"text of {smallest:g} points", f"use at least {SMALLEST_TEXT:g}")
        if size[0] > style.FULL_WIDTH + 0.01 or size[1] > style.MAX_HEIGHT + 0.8:
            yield Finding(NOTE, file, _name(figure), f"{size[0]:g} x {size[1]:g} inches: larger than a page", "divide it")


def grey(folder: Folder) -> Iterator[Finding]:
    for file, figure in folder.figures:
        for a, b in figure["alike_in_grey"]:
            yield Finding(NOTE, file, _name(figure), f"{a!r} and {b!r} differ in colour only", "give them markers, dashes or hatches")


def current(folder: Folder) -> Iterator[Finding]:
    for file, figure in folder.figures:
        source = folder.source(file, figure)
        if not figure["records"]:
            continue  # of several files (compare), which its base names
        if source is None:
            yield Finding(NOTE, file, _name(figure), "what it was drawn from is not here", "keep a figure beside its data")
        elif load.digest(source) != figure["records"]:
            yield Finding(GRAVE, file, _name(figure), f"was drawn from another {source.name} than the one here", "draw it again, with the command that wrote it")


def _name(figure: dict[str, Any]) -> str:
    return str(figure["title"])
