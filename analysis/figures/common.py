"""What the figures share: a drawing with its caption, and the dot plot with one labelled row an execution."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .. import fitting, style, text, weak
from ..captions import Caption
from ..comparison import Analysis, Group, strategy
from ..load import Record
from . import floors

ROW_HEIGHT = 0.175  # inches
SERIES_HEIGHT = 0.055  # of a row of several intervals that overlap
NARROWEST = 0.8  # inches of the axes, and of their labels
MAX_ROWS = 44  # more rows go to a further figure
LABEL_SIZE = 7.5
SMALL = 6  # a group with fewer timed points has no figures of its own if it can be drawn beside its like


@dataclass(frozen=True)
class Drawing:
    name: str  # file name without suffix
    section: str
    figure: Figure
    caption: Caption
    raster: bool = False  # shown as PNG in the report: it is made of pixels anyway

    def __post_init__(self) -> None:
        fitting.fit(self.figure)


@dataclass(frozen=True)
class Point:
    value: float
    low: float | None
    high: float | None
    series: int
    ringed: bool = False


@dataclass(frozen=True)
class Row:
    label: str
    points: tuple[Point, ...] = ()
    message: str = ""  # instead of points: why there are none
    note: str = ""  # in the right margin


@dataclass
class Block:
    """The rows of one kernel."""

    kernel: str
    rows: list[Row] = field(default_factory=list)
    continued: bool = False

    @property
    def title(self) -> str:
        return self.kernel + (" (continued)" if self.continued else "")


def most_rows(row_height: float) -> int:
    """Rows of this height that a page holds, with a title, an axis and two lines of keys."""
    return min(MAX_ROWS, int((style.MAX_HEIGHT - 1.2) / row_height))


def max_rows() -> int:
    """Of one figure. In a narrow column a row may have two lines."""
    return MAX_ROWS * 3 // 5 if style.is_narrow() else MAX_ROWS


def pages(blocks: list[Block], limit: int | None = None) -> list[list[Block]]:
    """Blocks in as few figures as hold them, about equally filled; a block longer than a figure is divided."""
    limit = max_rows() if limit is None else limit
    pieces = []
    for block in blocks:
        step = limit - 1
        parts = [block.rows[i:i + step] for i in range(0, len(block.rows), step)]
        pieces += [Block(block.kernel, rows, i > 0) for i, rows in enumerate(parts)]
    total = sum(len(piece.rows) + 1 for piece in pieces)
    even = max(1, -(-total // max(1, -(-total // limit))))
    result: list[list[Block]] = []
    used = limit + 1
    for piece in pieces:
        size = len(piece.rows) + 1
        if used + size > limit or (used >= even and result):
            result.append([])
            used = 0
        result[-1].append(piece)
        used += size
    return result


def spread(values: list[float]) -> bool:
    """Whether the values ask for a log axis: more than a factor of ten apart."""
    return bool(values) and min(values) > 0 and max(values) / min(values) > 10


@dataclass(frozen=True)
class Frame:
    """Axes with one labelled line a row, below the name of its kernel."""

    figure: Figure
    axes: Axes
    rows: list[tuple[float, Row]]  # y of each row


def row_frame(blocks: list[Block], title: str, unit: str, *, limits: tuple[float, float], log: bool,
              keys: list, every: list[Block] | None = None, row_height: float = ROW_HEIGHT) -> Frame:
    """every: the blocks of all pages, so that their axes begin and end at the same places."""
    rows = sum(len(block.rows) + 1 for block in blocks)
    measured = blocks if every is None else [*every, *blocks]
    labels = [row.label for block in measured for row in block.rows]
    heads = [block.title for block in measured]
    # A head has its row to itself, so that in a narrow column it may reach into the axes.
    of_heads = 0.0 if style.is_narrow() else style.text_width(heads, LABEL_SIZE, bold=True)
    left = 0.25 + max(style.text_width(labels, LABEL_SIZE) + 0.1, of_heads)
    # Notes and labels become lines where they would leave less than half of a narrow page to the axes.
    notes = {row.note: row.note for block in measured for row in block.rows if row.note}
    if left + style.text_width(list(notes), 7) > style.page_width() / 2 and style.is_narrow():
        notes = {note: fitting.lines(note, 7, style.page_width() / 4) for note in notes}
    right = 0.15 + (style.text_width(list(notes.values()), 7) + 0.08 if notes else 0.0)
    columns = style.legend_columns([key.get_label() for key in keys])
    foot = 0.5 + (0.17 * -(-len(keys) // columns) if keys else 0)
    most = max(NARROWEST, style.page_width() - right - NARROWEST)
    broken = {row.label: fitting.lines(row.label, LABEL_SIZE, most - 0.15) for block in measured for row in block.rows}
    left = min(left, most)
    row_height = max(row_height, *(0.05 + 0.125 * (1 + words.count("\n")) for words in [*broken.values(), *notes.values()]))
    wide, height = style.page_width() - left - right, rows * row_height + 0.35 + foot
    figure = style.new_figure(style.page_width(), height)
    axes = style.place(figure, left, foot, wide, rows * row_height)
    axes.set_ylim(rows - 0.5, -0.5)
    axes.set_yticks([])
    style.number_axis(axes, *limits, log)
    axes.grid(axis="x")
    axes.set_xlabel(unit)
    style.title(figure, title, 0.2)
    placed: list[tuple[float, Row]] = []
    y = 0
    for i, block in enumerate(blocks):
        if i % 2 == 0:
            axes.axhspan(y - 0.5, y + len(block.rows) + 0.5, color=style.BAND, lw=0, zorder=0)
        _label(axes, y, block.title, left - 0.1, weight="bold", ha="left")
        for row in block.rows:
            y += 1
            placed.append((y, row))
            _label(axes, y, broken[row.label], 0.07, color=style.FAILED if row.message else "black", ha="right")
            if row.message:
                axes.text(0.01, y, text.shorten(row.message, int(wide / 0.05)), transform=axes.get_yaxis_transform(),
                          fontsize=7, style="italic", color=style.FAILED, va="center", clip_on=True)
            if row.note:
                axes.annotate(notes[row.note], (1, y), xycoords=("axes fraction", "data"), xytext=(4, 0),
                              textcoords="offset points", fontsize=7, va="center", annotation_clip=False)
        y += 1
    if keys:
        figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.05 / style.page_width(), 0.02 / height),
                      ncol=columns, borderaxespad=0.2, columnspacing=1.2, handletextpad=0.5)
    return Frame(figure, axes, placed)


def dots(blocks: list[Block], series: list[str], title: str, unit: str, *, limits: tuple[float, float], log: bool,
         ring: str = "", reference: float | None = None, reference_name: str = "", floor: dict[int, float] | None = None,
         floor_unit: str = "ms", every: list[Block] | None = None, row_height: float = ROW_HEIGHT) -> Figure:
    """Horizontal dot plot with intervals; floor: where the line of a series stands; every, row_height: of row_frame()."""
    keys = _keys(series, ring, reference, reference_name)
    if floor:
        limits, floor, far = floors.reached(limits, log, floor)
        keys.append(floors.key(far, floor_unit))
    frame = row_frame(blocks, title, unit, limits=limits, log=log, keys=keys, every=every, row_height=row_height)
    for y, row in frame.rows:
        _points(frame.axes, row, y, len(series))
    if reference is not None:
        frame.axes.axvline(reference, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
    for index, at in (floor or {}).items():
        floors.across(frame.axes, at, style.look(index).colour)
    return frame.figure


def _label(axes, y: float, label: str, offset: float, **options) -> None:
    axes.annotate(label, (0, y), xycoords=("axes fraction", "data"), xytext=(-72 * offset, 0),
                  textcoords="offset points", fontsize=LABEL_SIZE, va="center", annotation_clip=False, **options)


def _points(axes, row: Row, y: float, series: int) -> None:
    for point in row.points:
        look = style.look(point.series)
        # Points of one row are set apart a little: at equal times all of them stay visible.
        at = y + (point.series - (series - 1) / 2) * min(0.14, 0.75 / max(1, series))
        if point.low is not None:
            axes.plot([point.low, point.high], [at, at], color=look.colour, lw=1.4, solid_capstyle="butt", zorder=3)
            axes.plot([point.low, point.high], [at, at], color=look.colour, lw=0, marker="|", ms=5, mew=1.0, zorder=3)
        axes.plot(point.value, at, marker=look.marker, color=look.colour, ms=4, mew=0, zorder=4)
        if point.ringed:
            axes.plot(point.value, at, marker="o", mfc="none", mec="black", mew=0.8, ms=8, zorder=5)


def _keys(series: list[str], ring: str, reference: float | None, reference_name: str) -> list[Line2D]:
    keys = [Line2D([], [], color=style.look(i).colour, marker=style.look(i).marker, lw=1.4, ms=4, label=name)
            for i, name in enumerate(series)]
    if ring:
        keys.append(Line2D([], [], color="black", marker="o", mfc="none", ms=8, lw=0, mew=0.8, label=ring))
    if reference is not None and reference_name:
        keys.append(Line2D([], [], color="black", lw=0.8, ls=(0, (4, 2)), label=reference_name))
    return keys


def execution_rows(analysis: Analysis, group: Group, kernel: str) -> dict[str, list[Record]]:
    """The timed points of a kernel by execution, in the order of the study; serial comes first in a study file."""
    rows: dict[str, list[Record]] = {}
    for record in group.timed:
        if record.config.kernel == kernel:
            rows.setdefault(analysis.execution(record), []).append(record)
    return rows


def peer_blocks(analysis: Analysis, group: Group, threads: list[int]) -> list[Block]:
    """The peers of a group, below its kernels."""
    found: dict[str, list[Record]] = {}
    for record in group.peers:
        found.setdefault(strategy(record), []).append(record)
    blocks = []
    for name, records in found.items():
        points = []
        for record in records:
            if record.ok:
                e = analysis.estimates[record.id]
                points.append(Point(e.value, e.low, e.high, threads.index(record.config.threads)))
        rows = [Row(analysis.execution(records[0]), tuple(points))] if points else []
        rows += [Row(analysis.threads(r), message=f"{r.status}: {r.reason}") for r in records if not r.ok]
        blocks.append(Block(name, rows))
    return blocks


def untimed_rows(analysis: Analysis, group: Group, kernel: str, most: int = 3) -> list[Row]:
    """Failed and skipped points of a kernel with their reasons; many with one reason share a row."""
    reasons: dict[tuple[str, str], list[Record]] = {}
    for record in group.untimed:
        if record.config.kernel == kernel:
            reasons.setdefault((record.status, record.reason), []).append(record)
    rows = []
    for (status, reason), records in reasons.items():
        message = f"{status}: {reason}"
        if len(records) <= most:
            rows += [Row(f"{analysis.execution(r)}, {analysis.threads(r)}", message=message) for r in records]
        else:
            rows.append(Row(text.count(len(records), "point"), message=message))
    return rows


def families(analysis: Analysis) -> list[list[Group]]:
    """Groups that share scene and size, and so differ in their arithmetic or its fill and near rules."""
    found: dict[tuple, list[Group]] = {}
    for group in analysis.groups:
        if group.timed:
            config = group.records[0].config
            found.setdefault((config.scene, config.scene_hash, config.size), []).append(group)
    return [groups for groups in found.values() if len(groups) > 1]


def drawn_together(analysis: Analysis, group: Group) -> bool:
    """Whether a group is too small for figures of its own and is shown beside its other numeric modes, or in weak scaling, instead."""
    return len(group.timed) < SMALL and (any(group in groups for groups in families(analysis)) or weak.shows(analysis, group))


def bounds(points: list[Point]) -> tuple[float, float]:
    lows = [p.low if p.low is not None else p.value for p in points]
    highs = [p.high if p.high is not None else p.value for p in points]
    return float(np.min(lows)), float(np.max(highs))


def named(base: str, page: int, count: int) -> str:
    return base if count == 1 else f"{base}_{page + 1}"


def part(page: int, count: int) -> str:
    return "" if count == 1 else f" ({page + 1} of {count})"
