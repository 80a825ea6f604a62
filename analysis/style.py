"""One look for all figures: sizes for a text column, colours for colour-blind readers, markers for grey paper."""

from __future__ import annotations

import io
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from typing import Iterator

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

FULL_WIDTH = 6.9  # inches: the text width of an A4 page
MAX_HEIGHT = 9.0  # with its caption it still fits on that page
PNG_DPI = 150
LINE = 1.2  # distance of lines over the size of their letters
HEADROOM = 1.08  # a linear axis ends this much beyond its largest value

# Okabe and Ito's palette without yellow (too light for a thin line on white), the darkest contrasts first.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#7F7F7F")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++")
GREY = "#6B6B6B"
FAILED = "#9A3412"
BAND = "#F3F4F6"

RC = {
    "font.family": "DejaVu Sans", "font.size": 8, "axes.titlesize": 8.5, "axes.labelsize": 8,
    "xtick.labelsize": 7.5, "ytick.labelsize": 7.5, "legend.fontsize": 7.5, "legend.frameon": False,
    "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.7, "axes.axisbelow": True,
    "grid.color": "#D9D9D9", "grid.linewidth": 0.5, "lines.linewidth": 1.1, "lines.markersize": 4.5,
    "errorbar.capsize": 1.6, "hatch.linewidth": 0.5, "savefig.facecolor": "white", "figure.facecolor": "white",
    "text.parse_math": False,  # a name with two dollars is a name
    "pdf.fonttype": 42,
    # The same records give the same bytes: no random ids, no dates. Text as paths looks alike everywhere.
    "svg.hashsalt": "rasterbench", "svg.fonttype": "path",
}


@dataclass(frozen=True)
class Look:
    colour: str
    marker: str


def look(index: int) -> Look:
    # Beyond eight the markers shift against the colours, so that a pair does not repeat before 64.
    return Look(COLOURS[index % 8], MARKERS[(index + index // 8) % 8])


_page_width: ContextVar[float] = ContextVar("page_width", default=FULL_WIDTH)


def page_width() -> float:
    """Of the figures that are drawn now, in inches."""
    return _page_width.get()


def is_narrow() -> bool:
    """Whether figures are drawn for less than a whole page."""
    return page_width() < FULL_WIDTH - 0.1


@contextmanager
def page(inches: float) -> Iterator[None]:
    """Within it figures are drawn for a column of this width. Their letters have the same size in all of them."""
    before = _page_width.set(inches)
    try:
        yield
    finally:
        _page_width.reset(before)


def panels_across(most: int, least: float) -> int:
    """Panels beside each other: `most`, or as many as have `least` inches each."""
    return max(1, min(most, int(page_width() / least + 1e-6)))


def new_figure(width: float, height: float) -> Figure:
    # Not through pyplot: no display, no list of open figures, nothing to close.
    return Figure(figsize=(width, height))


def place(figure: Figure, left: float, bottom: float, width: float, height: float, **options) -> Axes:
    """Axes at a place in inches: margins that hold labels are known, so no layout engine has to guess them."""
    w, h = figure.get_size_inches()
    return figure.add_axes((left / w, bottom / h, width / w, height / h), **options)


def text_width(texts: list[str], size: float, bold: bool = False) -> float:
    """Width in inches of the widest line."""
    lines = [line for words in texts for line in words.split("\n")]
    widest = max(lines, key=len, default="")
    candidates = {line for line in lines if len(line) > 0.8 * len(widest)}
    return max((_width(t, size, bold) for t in candidates if t.strip()), default=0.0) / 72


@lru_cache(maxsize=None)  # the same names stand in many panels, and each page of them
def _width(words: str, size: float, bold: bool) -> float:
    font = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal", size=size)
    return float(text_to_path.get_text_width_height_descent(words, font, ismath=False)[0])


def title(figure: Figure, words: str, top: float = 0.13) -> None:
    """A bold line at the upper left, top inches below the edge; somewhat smaller where a long name would leave the page."""
    width, height = figure.get_size_inches()
    size = min(8.5, max(7.5, 8.5 * (width - 0.2) / max(0.1, text_width([words], 8.5, bold=True))))
    figure.text(0.1 / width, 1 - top / height, words, fontsize=size, weight="bold", va="center")


def legend_columns(labels: list[str], width: float | None = None) -> int:
    """As many columns as fit into the width (default: the page's); a handle and its gaps take about 0.55 inches."""
    return max(1, min(len(labels), int((width or page_width()) / (text_width(labels, 7.5) + 0.6)))) if labels else 1


def plain(value: float, _position: int = 0) -> str:
    """Tick labels such as 0.2, 1, 20, 5000 instead of powers of ten."""
    return f"{value:.10f}".rstrip("0").rstrip(".") if value < 1 else f"{value:g}" if value < 1e6 else f"{value:.0e}"


def number_axis(axes: Axes, low: float, high: float, log: bool, name: str = "x") -> None:
    """Ticks that say enough: on a log axis at least two labels, more where the range is short."""
    axis = axes.xaxis if name == "x" else axes.yaxis
    limits = axes.set_xlim if name == "x" else axes.set_ylim
    room = axes.get_position().width * axes.figure.get_size_inches()[0] if name == "x" else 6.0  # inches for the labels of x
    if log:
        (axes.set_xscale if name == "x" else axes.set_yscale)("log")
        limits(low / 1.25, high * 1.25)
        decades = high / low
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < min(300, 10 ** (room / 0.75)) else (1,), numticks=20))
        axis.set_minor_locator(NullLocator())
        axis.set_minor_formatter(NullFormatter())
    else:
        limits(0, high * HEADROOM)
        axis.set_major_locator(MaxNLocator(max(2, min(6, int(room / 0.4))), steps=(1, 2, 2.5, 5, 10)))  # 1 is a tick where it is in sight: the base of ratios
    axis.set_major_formatter(FuncFormatter(plain))


def outputs(figure: Figure) -> dict[str, bytes]:
    """The figure as svg, pdf and png."""
    files = {}
    for kind, metadata in (("svg", {"Date": None}), ("pdf", {"CreationDate": None}), ("png", {})):
        buffer = io.BytesIO()
        figure.savefig(buffer, format=kind, dpi=PNG_DPI, metadata=metadata)
        files[kind] = buffer.getvalue()
    return files
