"""Brings the words of a figure into its width. On the page that a figure was laid out for nothing has to give; in a narrow column (--width)
titles, axis labels and keys become lines, and the figure grows by them."""

from __future__ import annotations

import re

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from . import style

MARGIN = 0.05  # inches that stay free at the sides
HANDLE = 0.5  # inches of a key before its words


def fit(figure: Figure) -> None:
    canvas = FigureCanvasAgg(figure)  # measures words
    above = sum(_fit_title(words) for words in figure.texts)
    below = max((_fit_label(axes) for axes in figure.axes), default=0.0)
    below += sum(_fit_keys(legend) for legend in figure.legends)
    _grow(figure, above, below)
    for axes in figure.axes:
        _shift_label(axes, canvas)


def lines(words: str, size: float, room: float, bold: bool = False) -> str:
    """The words in as many lines as a room of so many inches asks for; what is in lines already stays so where it fits. Names of points
    may break behind a slash; brackets hold together."""
    made: list[str] = []
    for line in words.split("\n"):
        made.append("")
        for piece in re.findall(r"(?:\[[^\]]*\]|[^ /])+(?:/| +|$)|[ /]+", line):
            if made[-1] and style.text_width([(made[-1] + piece).rstrip()], size, bold) > room:
                made.append("")
            made[-1] += piece
    return "\n".join(line.rstrip() for line in made)


def _set_lines(words: Text, room: float) -> float:
    """Breaks the words; the inches by which they become higher."""
    before = words.get_text()
    if not before.strip() or style.text_width([before], words.get_fontsize(), _is_bold(words)) <= room:
        return 0.0
    after = lines(before, words.get_fontsize(), room, _is_bold(words))
    words.set_text(after)
    return (after.count("\n") - before.count("\n")) * words.get_fontsize() * style.LINE / 72


def _is_bold(words: Text) -> bool:
    return words.get_fontweight() in ("bold", 700)


def _fit_title(words: Text) -> float:
    """A title keeps the place of its first line."""
    figure = words.figure
    width, height = figure.get_size_inches()
    grown = _set_lines(words, width - words.get_position()[0] * width - MARGIN)
    if grown:
        x, y = words.get_position()
        words.set_position((x, y - (grown / 2 if words.get_verticalalignment() == "center" else 0) / height))
    return grown


def _fit_label(axes: Axes) -> float:
    return _set_lines(axes.xaxis.label, axes.figure.get_size_inches()[0] - 2 * MARGIN)


def _fit_keys(legend: Legend) -> float:
    """The column that grows most says by how much its legend does."""
    texts = legend.get_texts()
    columns = max(1, legend._ncols if hasattr(legend, "_ncols") else legend._ncol)  # before matplotlib 3.6
    room = legend.figure.get_size_inches()[0] - HANDLE - MARGIN
    grown = [_set_lines(words, room) for words in texts]
    in_column = -(-len(texts) // columns)
    return max((sum(grown[i:i + in_column]) for i in range(0, len(grown), in_column)), default=0.0)


def _grow(figure: Figure, above: float, below: float) -> None:
    """Adds inches over the axes and under them. What lies under the lowest axes keeps its distance from the lower edge of the figure."""
    if not above and not below:
        return
    width, height = figure.get_size_inches()
    taller = height + above + below
    lowest = min((axes.get_position().y0 for axes in figure.axes), default=0.0)
    for axes in figure.axes:
        box = axes.get_position()
        axes.set_position((box.x0, (box.y0 * height + below) / taller, box.width, box.height * height / taller))
    for words in figure.texts:
        x, y = words.get_position()
        words.set_position((x, (y * height + (above + below if y >= lowest else 0)) / taller))
    for legend in figure.legends:
        anchor = legend.get_bbox_to_anchor().transformed(figure.transFigure.inverted())
        legend.set_bbox_to_anchor((anchor.x0, (anchor.y0 * height + (below if anchor.y0 >= lowest else 0)) / taller))
    figure.set_size_inches(width, taller)


def _shift_label(axes: Axes, canvas: FigureCanvasAgg) -> None:
    """A label that is centred on its axes may pass the edge of the figure where they do not lie in its middle."""
    label = axes.xaxis.label
    if not label.get_text().strip():
        return
    width = axes.figure.get_size_inches()[0]
    half = style.text_width([label.get_text()], label.get_fontsize()) / 2
    box = axes.get_position()
    centre = (box.x0 + box.width / 2) * width
    inside = min(max(centre, MARGIN + half), width - MARGIN - half)
    if abs(inside - centre) > 1e-6 and 2 * half <= width:
        label.set_x((inside / width - box.x0) / box.width)
