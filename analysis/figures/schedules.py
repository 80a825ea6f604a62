"""Schedule x chunk as a heat map, one panel a kernel, at the highest thread count."""

from __future__ import annotations

from typing import Iterator

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.patches import Patch, Rectangle

from .. import captions, fitting, style, text
from ..comparison import Analysis, Group, Panel
from . import floors
from .common import Drawing, named, part

SECTION = "Schedules and chunks"
CELL_HEIGHT = 0.23  # inches
AXES = ("chunk or grain (iterations)", "chunk or grain", "chunk")
PALEST_RANGE = 1.5  # a few per cent must not look like a factor
DARKEST = 4.0  # slower than four times the best needs no further shades
DARK = 0.6  # from this shade on white stands out more than black (equal contrast at a luminance of 0.18)
# One hue from white to dark: it survives grey paper and every kind of colour vision.
SHADES = LinearSegmentedColormap.from_list("slower", ["#FFFFFF", "#BBD7EA", "#5E9DC8", "#0F4F82", "#06284A"])


def draw(analysis: Analysis) -> Iterator[Drawing]:
    for group in analysis.groups:
        panels = [panel for panel in analysis.panels if panel.group is group]
        if panels:
            yield from _draw(analysis, group, panels, panels[0].threads)


def _draw(analysis: Analysis, group: Group, panels: list[Panel], threads: int) -> Iterator[Drawing]:
    backends = list(dict.fromkeys(r.config.backend for panel in panels for r in panel.cells.values()))
    found = {row: backends.index(r.config.backend) for panel in panels for (row, _), r in panel.cells.items()}
    rows = sorted(found, key=found.__getitem__)  # stable: within a backend in the order of the study
    chunks = sorted({chunk for panel in panels for _, chunk in panel.cells}, key=lambda c: -1 if c is None else c)
    panel = max(0.42 * len(chunks), _widest_name(panels))
    across = max(1, min(3, int((style.page_width() - _left(rows) - 0.1) / (panel + 0.15)), len(panels)))
    down = max(1, int((style.MAX_HEIGHT - 1.3) / (len(rows) * _cell_height(rows) + 0.45)))
    split = [panels[i:i + across * down] for i in range(0, len(panels), across * down)]
    for page, chosen in enumerate(split):
        shown = [r for panel in chosen for r in panel.cells.values() if r.ok]
        best = {panel.kernel: min(analysis.estimates[r.id].value for r in panel.cells.values() if r.ok) for panel in chosen}
        floor, floor_notes = floors.beside(shown, best)
        figure = _figure(analysis, group, chosen, rows, chunks, across, threads, part(page, len(split)), floor)
        caption = captions.build(
            analysis, f"Schedule and chunk, {group.title}, {text.count(threads, 'thread')}{part(page, len(split))}",
            "Look for pale cells: shades give the time relative to the fastest cell of the same panel, numbers the time. The ratio is the median of"
            " ratios within a block, so where times vary a cell may be paler than its number suggests.",
            shown, estimates=None,
            notes=[f"Cells are median times of a frame in ms ({analysis.sampled(shown)}); 'default' leaves the chunk to the"
                   " runtime. The thick frame is the fastest cell of a panel, dashed frames cannot be told apart from it (rank"
                   f" test, Holm-corrected within the panel and for all {len(analysis.panels)} panels, and paired interval). Other thread counts are in the"
                   " table of all points.", *floor_notes])
        yield Drawing(named(f"schedules_{group.slug}", page, len(split)), SECTION, figure, caption)


def _figure(analysis: Analysis, group: Group, panels: list[Panel], rows: list[str], chunks: list[int | None],
            across: int, threads: int, suffix: str, floor: str):
    left = _left(rows)
    wide = min(max(0.75 * len(chunks), _widest_name(panels)), (style.page_width() - left - 0.1) / across - 0.15)
    tall = len(rows) * _cell_height(rows)
    down = -(-len(panels) // across)
    beside = style.page_width() - left > 4.3  # whether the keys have room beside the bar
    turned = style.text_width([_chunk(c) for c in chunks], 7) > 0.9 * wide / len(chunks)  # the chunks below the cells
    foot, head = (0.95 if beside else 1.3) + 0.25 * turned, 0.35
    height = head + foot + down * (tall + 0.3)
    figure = style.new_figure(style.page_width(), height)
    norm = LogNorm(1, max(PALEST_RANGE, min(DARKEST, _worst(panels))))
    for i, panel in enumerate(panels):
        row, column = divmod(i, across)
        axes = style.place(figure, left + column * (wide + 0.15), height - head - (row + 1) * (tall + 0.3) + 0.02, wide, tall)
        _panel(analysis, axes, panel, rows, chunks, norm)
        axes.set_yticks(range(len(rows)), _labels(rows) if column == 0 else [""] * len(rows), fontsize=7)
        last = i + across >= len(panels)
        axes.set_xticks(range(len(chunks)), [_chunk(c) for c in chunks] if last else [""] * len(chunks), fontsize=7, rotation=90 if turned else 0)
        if last:
            axes.set_xlabel(next((a for a in AXES if style.text_width([a], 7.5) < wide + 0.1), AXES[-1]), fontsize=7.5, labelpad=2)
    style.title(figure, f"{group.title}, {text.count(threads, 'thread')}{suffix}: median time of a frame (ms{floor})")
    bar = style.place(figure, left, 0.34 if beside else 0.69, min(2.0, style.page_width() - left - 0.2), 0.09)
    figure.colorbar(ScalarMappable(norm, SHADES), cax=bar, orientation="horizontal",
                    extend="max" if _worst(panels) > DARKEST else "neither")
    bar.minorticks_off()
    ticks = [t for t in (1, 1.02, 1.05, 1.1, 1.2, 1.5, 2, 3, 4) if t <= norm.vmax]
    keep = [t for t in ticks if t == 1 or t >= 1 + (norm.vmax - 1) / 5]
    bar.set_xticks(keep, [f"{t:g}" for t in keep], fontsize=7)
    bar.set_xlabel("time / fastest of the panel", fontsize=7.5, labelpad=1)
    keys = [Patch(facecolor="none", edgecolor="black", lw=2.0, label="fastest of the panel"),
            Patch(facecolor="none", edgecolor="black", lw=0.8, ls="--", label="not distinguishable from it")]
    figure.legend(handles=keys, loc="lower left",
                  bbox_to_anchor=((left + 2.3 if beside else 0.05) / style.page_width(), (0.12 if beside else 0.02) / height))
    return figure


def _left(rows: list[str]) -> float:
    return 0.2 + style.text_width(_labels(rows), 7)


def _labels(rows: list[str]) -> list[str]:
    """In lines where they would take half of the page."""
    return [fitting.lines(row, 7, 0.45 * style.page_width()) for row in rows]


def _cell_height(rows: list[str]) -> float:
    return CELL_HEIGHT + 0.12 * max(label.count("\n") for label in _labels(rows))


def _widest_name(panels: list[Panel]) -> float:
    return style.text_width([panel.kernel for panel in panels], 8)


def _worst(panels: list[Panel]) -> float:
    return max(c.ratio.value for panel in panels for c in panel.comparisons.values())


def cell_number(value: float, room: float) -> str:
    """With as many digits as so many inches hold."""
    words = text.number(value)
    return words if style.text_width([words], 6.5) < room else f"{value:.2g}" if value < 10 else f"{value:.0f}"


def _chunk(chunk: int | None) -> str:
    return "default" if chunk is None else str(chunk)


def _panel(analysis: Analysis, axes: Axes, panel: Panel, rows: list[str], chunks: list[int | None], norm: LogNorm) -> None:
    axes.set_xlim(-0.5, len(chunks) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.tick_params(length=0)
    axes.set_facecolor("#EFEFEF")  # a combination that was not planned
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_title(panel.kernel, loc="left", fontsize=8, pad=3)
    room = axes.get_position().width * style.page_width() / len(chunks)
    for (row, chunk), record in panel.cells.items():
        x, y = chunks.index(chunk), rows.index(row)
        comparison = panel.comparisons.get(record.id)
        if comparison is None:
            axes.text(x, y, record.status, fontsize=6, color=style.FAILED, style="italic", ha="center", va="center")
            continue
        shade = norm(min(max(comparison.ratio.value, 1.0), norm.vmax))
        axes.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=SHADES(shade), edgecolor="white", lw=0.5))
        best, near = comparison.verdict == "best", comparison.verdict in ("same", "ambiguous")
        if best or near:
            axes.add_patch(Rectangle((x - 0.44, y - 0.41), 0.88, 0.82, facecolor="none", lw=1.8 if best else 0.8,
                                     edgecolor="black" if shade < DARK else "white", ls="-" if best else "--", zorder=3))
        axes.text(x, y, cell_number(analysis.estimates[record.id].value, room), fontsize=6.5, ha="center", va="center",
                  color="black" if shade < DARK else "white", weight="bold" if best else "normal", zorder=4)
