"""The file beside each figure, NAME.json, for programs: what the caption says, from which records, and what was drawn.

{schema, name, title, caption, reading, facts (captions.Facts, or null), records (hash of the file that was drawn, or ""), source
(that file, as a path from the figure's folder; absent in older ones: ../records.jsonl), size_inches [w, h], axes [text of each labelled axis], smallest_text_pt, lines_across_categories [..], alike_in_grey
[[name, name], ..]}. The last three are what a reader of the figure would trip over, found in the drawn artists.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import Any, Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from . import load, style
from .figures.common import Drawing
from .load import InputError
from .statistics.numbers import is_number

SCHEMA = 1
RECORDS = "../records.jsonl"  # what a report draws, from its figures/
GREY_STEP = 0.12  # least difference of lightness (0 to 1) of two shades that a legend tells apart by nothing else


def drawn_from(path: Path, folder: Path) -> tuple[str, str]:
    """The hash of a file, and its path from the folder of the figures that are drawn from it."""
    return load.digest(path), os.path.relpath(path.resolve(), folder.resolve())


def files(drawing: Drawing, records: str = "", source: str = RECORDS) -> dict[str, bytes]:
    """NAME.svg, .pdf, .png and .json. records and source: drawn_from()."""
    made = {f"{drawing.name}.{kind}": content for kind, content in style.outputs(drawing.figure).items()}
    return made | {f"{drawing.name}.json": (json.dumps(describe(drawing, records, source), indent=1, ensure_ascii=False) + "\n").encode()}


def is_one(path: Path) -> bool:
    """Whether a file of JSON lies beside a figure to describe it, rather than holding data of its own."""
    return "smallest_text_pt" in load.parse(load.read_text(path), path, None)


def read(path: Path) -> dict[str, Any]:
    """What describe() wrote; throws InputError where it did not."""
    value = load.parse(load.read_text(path), path, None)
    size, smallest = value.get("size_inches"), value.get("smallest_text_pt")
    pairs = value.get("alike_in_grey")
    right = {"schema": value.get("schema") == SCHEMA, "title": isinstance(value.get("title"), str),
             "facts": value.get("facts") is None or isinstance(value["facts"], dict), "records": isinstance(value.get("records"), str),
             "source": isinstance(value.get("source", RECORDS), str),
             "size_inches": isinstance(size, list) and len(size) == 2 and all(map(is_number, size)),
             "axes": isinstance(value.get("axes"), list), "smallest_text_pt": smallest is None or is_number(smallest),
             "lines_across_categories": isinstance(value.get("lines_across_categories"), list),
             "alike_in_grey": isinstance(pairs, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in pairs)}
    for key, is_right in right.items():
        if not is_right:
            raise InputError(path, f"{value.get(key)!r} is not what `python3 -m analysis report` writes", None, key)
    return value


def describe(drawing: Drawing, records: str, source: str = RECORDS) -> dict[str, Any]:
    figure, caption = drawing.figure, drawing.caption
    labels = [words for axes in figure.axes for words in (axes.get_xlabel(), axes.get_ylabel()) if words]
    return {"schema": SCHEMA, "name": drawing.name, "title": caption.title, "caption": caption.body, "reading": caption.reading,
            "facts": asdict(caption.facts) if caption.facts else None, "records": records, "source": source if records else "",
            "size_inches": [round(float(side), 3) for side in figure.get_size_inches()], "axes": list(dict.fromkeys(labels)),
            "smallest_text_pt": smallest_text(figure),
            "lines_across_categories": [name for axes in figure.axes for name in across_categories(axes)],
            "alike_in_grey": [list(pair) for pair in alike_in_grey(figure)]}


def smallest_text(figure: Figure) -> float | None:
    """Points of the smallest text that is drawn."""
    sizes = [float(item.get_fontsize()) for item in figure.findobj(Text) if item.get_visible() and item.get_text().strip()]
    return min(sizes, default=None)


def across_categories(axes: Axes) -> Iterator[str]:
    """Lines that join places of an axis whose order means nothing: kernels, schedules, scenes."""
    for line in axes.get_lines():
        if line.get_linestyle() in ("None", "none", " ", "") or line.get_linewidth() == 0 or line.get_transform() != axes.transData:
            continue  # markers only, or a reference line that spans the axes
        for name, axis, values in (("x", axes.xaxis, line.get_xdata(orig=False)), ("y", axes.yaxis, line.get_ydata(orig=False))):
            if _categorical(axis) and len(values) > 1 and np.ptp(np.asarray(values, dtype=float)) >= 1:  # categories are one apart
                yield f"{name}: {line.get_label()}"


def _categorical(axis: Any) -> bool:
    if axis.get_scale() != "linear":
        return False
    if not len(axis.get_majorticklocs()):
        return True  # rows that are labelled by hand
    labels = [words for label in axis.get_majorticklabels() if (words := label.get_text().strip())]
    # A word among numbers ("none", "default") is the place of what has no number.
    return sum(not _number(words) for words in labels) > len(labels) / 2


def _number(words: str) -> bool:
    try:
        float(words.replace("\N{MINUS SIGN}", "-").replace(",", "").rstrip("x%\N{MULTIPLICATION SIGN} "))
    except ValueError:
        return False
    return True


def alike_in_grey(figure: Figure) -> list[tuple[str, str]]:
    """Pairs of a legend that differ in colour only, and whose colours have the same lightness."""
    found = []
    legends = [*figure.legends, *(legend for axes in figure.axes if (legend := axes.get_legend()))]
    for legend in legends:
        handles = legend.legend_handles if hasattr(legend, "legend_handles") else legend.legendHandles  # before matplotlib 3.7
        keys = [(text.get_text(), _look(handle)) for handle, text in zip(handles, legend.get_texts())]
        found += [(a, b) for (a, (shape_a, grey_a)), (b, (shape_b, grey_b)) in combinations(keys, 2)
                  if shape_a == shape_b and abs(grey_a - grey_b) < GREY_STEP]
    return found


def _look(handle: Any) -> tuple[tuple, float]:
    """What survives a grey printer: the shape of a key, and its lightness (CIE L*, 0 to 1)."""
    if isinstance(handle, Line2D):
        filled = handle.get_markerfacecolor() not in ("none", "None") and to_rgb(handle.get_markerfacecolor()) != (1.0, 1.0, 1.0)
        shape = ("line", str(handle.get_marker()), str(handle.get_linestyle()), round(handle.get_linewidth(), 1),
                 filled, round(handle.get_markersize()))
        return shape, _lightness(handle.get_color())
    if isinstance(handle, Patch):
        face = to_rgba(handle.get_facecolor())
        shape = ("patch", handle.get_hatch() or "", face[3] > 0, str(handle.get_linestyle()), round(handle.get_linewidth(), 1))
        return shape, _lightness(face if face[3] else handle.get_edgecolor())
    return (type(handle).__name__, id(handle)), 0.0


def _lightness(colour: Any) -> float:
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    luminance = float(np.dot((0.2126, 0.7152, 0.0722), linear))
    return (1.16 * luminance ** (1 / 3) - 0.16) if luminance > 0.008856 else 9.033 * luminance
