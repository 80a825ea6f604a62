"""A traced frame: its chunks by thread and time, the shares of each thread's time, and the heat map of its costs."""

from __future__ import annotations

from typing import Iterator

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from .. import style, text
from ..captions import Caption, Facts
from ..trace import SHARES, CostImage, Trace, shares
from .common import Drawing

SECTION = "Trace"
MOST_BOXES = 2000  # a thread: more are narrower than a pixel, so that shares of columns are drawn in their place
COLUMNS = 1400  # of such a picture
LANE = 0.3  # inches
MOST_LANES = 24
PAIR = ("#0072B2", "#A6D0EA")  # chunks take turns: dark and light also in grey
SHARE_LOOKS = {"chunks": (style.COLOURS[0], ""), "between": (style.COLOURS[4], "////"), "before": ("#FFFFFF", "...."), "after": ("#C9C9C9", ""),
               "none": ("#FFFFFF", ""), "outside": ("#7F7F7F", "xxxx")}


def draw(trace: Trace, threads: pd.DataFrame) -> Iterator[Drawing]:
    yield _gantt(trace)
    yield _shares(trace, threads)
    if trace.image is not None:
        yield _cost(trace, trace.image)


def _frame_facts(trace: Trace) -> Facts:
    """No estimates: a traced frame is no sample, and costs are times of one thread."""
    return Facts(None, None, None, None, None, trace.machine)


def _facts(trace: Trace) -> str:
    """What is traced: one frame has no interval, and its stamps are in it."""
    m = trace.metadata
    slower = f" The traced frame took {m['frame_us'] / 1000:.3f} ms, the same without stamps {m['untraced_frame_us'] / 1000:.3f} ms (median)." \
        if m["untraced_frame_us"] > 0 else ""
    return (f"One traced frame (the one of median loop time; no sample, n = 1, no interval), base: none. A chunk: {m['chunks_found_by']}."
            f"{slower} Machine: {trace.machine}.")


def _lanes(trace: Trace) -> list[int]:
    """Threads that are shown: all, or as many as have room, evenly chosen."""
    if trace.threads <= MOST_LANES:
        return list(range(trace.threads))
    return sorted({int(i) for i in np.linspace(0, trace.threads - 1, MOST_LANES).round()})


def _lane_axes(trace: Trace, lanes: list[int], title: str, foot: float):
    left, height = 0.25 + style.text_width([f"thread {lanes[-1]}"], 7.5), LANE * len(lanes)
    figure = style.new_figure(style.page_width(), height + foot + 0.35)
    axes = style.place(figure, left, foot, style.page_width() - left - 0.2, height)
    axes.set_ylim(len(lanes) - 0.4, -0.6)
    axes.set_yticks(range(len(lanes)), [f"thread {lane}" for lane in lanes])
    axes.tick_params(axis="y", length=0)
    style.title(figure, title, 0.17)
    return figure, axes


def _gantt(trace: Trace) -> Drawing:
    begin, end = trace.span
    lanes = _lanes(trace)
    many = any((trace.chunks["thread"] == lane).sum() > MOST_BOXES for lane in lanes)
    keys = [Patch(fc="#4A97C9", label="share of the time that lies in chunks: darker is more")] if many else \
        [Patch(fc=PAIR[0], label="a chunk"), Patch(fc=PAIR[1], label="the next chunk"), Patch(fc="white", ec="black", lw=0.5, label="outside of chunks")]
    columns = style.legend_columns([key.get_label() for key in keys])
    figure, axes = _lane_axes(trace, lanes, trace.title, 0.45 + 0.17 * -(-len(keys) // columns))
    for y, lane in enumerate(lanes):
        own = trace.chunks[trace.chunks["thread"] == lane]
        low, high = own["begin"].to_numpy() - begin, own["end"].to_numpy() - begin
        if len(own) <= MOST_BOXES:
            boxes = [[(a, y - 0.38), (b, y - 0.38), (b, y + 0.38), (a, y + 0.38)] for a, b in zip(low, high)]
            axes.add_collection(PolyCollection(boxes, facecolors=[PAIR[i % 2] for i in range(len(own))], linewidths=0))
        else:
            axes.imshow(covered(low, high, end - begin)[None, :], cmap="Blues", vmin=0, vmax=1.25, aspect="auto", interpolation="nearest",
                        extent=(0, end - begin, y + 0.38, y - 0.38))
    axes.set_ylim(len(lanes) - 0.4, -0.6)
    axes.set_xlim(0, end - begin)
    axes.xaxis.set_major_locator(MaxNLocator(7))
    axes.set_xlabel("time from the begin of the loop (µs)")
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.01, 0.0), ncol=columns, columnspacing=1.0, handletextpad=0.5)
    chosen = f"{text.count(len(lanes), 'thread')} of {trace.threads} are shown. " if len(lanes) < trace.threads else ""
    joined = trace.metadata.get("chunks_an_event", 1)
    merged = f"Up to {joined} chunks in a row are one mark. " if joined != 1 else ""
    return Drawing("gantt", SECTION, figure, Caption(
        f"Chunks by thread, {trace.title}", chosen + merged + _facts(trace),
        "White within a lane is time outside of chunks: at the right end of it the thread waits for the others.",
        _frame_facts(trace)))


def covered(low: np.ndarray, high: np.ndarray, span: float) -> np.ndarray:
    """Share of each of COLUMNS equal parts of [0, span] that lies in the intervals, which do not overlap."""
    edges = np.linspace(0, span, COLUMNS + 1)
    ends = np.column_stack([low, high]).ravel()
    sums = np.repeat(np.concatenate([[0.0], np.cumsum(high - low)]), 2)[1:-1]  # time in intervals up to each end
    return np.diff(np.interp(edges, ends, sums)) / (span / COLUMNS)


def _shares(trace: Trace, threads: pd.DataFrame) -> Drawing:
    lanes = _lanes(trace)
    shown = shares(threads)
    columns = style.legend_columns([SHARES[share] for share in shown])
    figure, axes = _lane_axes(trace, lanes, f"Time of each thread, {trace.title}", 0.5 + 0.17 * -(-len(shown) // columns))
    for y, lane in enumerate(lanes):
        at = 0.0
        row = threads.iloc[lane]
        for share in shown:
            colour, hatch = SHARE_LOOKS[share]
            axes.barh(y, row[f"{share}_us"], left=at, height=0.7, color=colour, hatch=hatch, ec="black", lw=0.4)
            at += row[f"{share}_us"]
    axes.set_xlim(0, None)
    axes.xaxis.set_major_locator(MaxNLocator(7))
    axes.set_xlabel("time of the loop (µs)")
    keys = [Patch(fc=SHARE_LOOKS[s][0], hatch=SHARE_LOOKS[s][1], ec="black", lw=0.4, label=SHARES[s]) for s in shown]
    figure.legend(handles=keys, loc="lower left", bbox_to_anchor=(0.01, 0.0), ncol=columns, columnspacing=1.0, handletextpad=0.5)
    busy = threads["chunks_us"]
    note = f"Imbalance (longest / mean time in chunks) {busy.max() / busy.mean():.3f}. " if busy.mean() > 0 else ""
    return Drawing("thread_shares", SECTION, figure, Caption(f"Time of each thread, {trace.title}", note + _facts(trace),
                                                       "Bars are equally long: each is the time from the first loop's begin to the last one's end, divided by what the thread did.",
                                                       _frame_facts(trace)))


def _cost(trace: Trace, image: CostImage) -> Drawing:
    height, width = image.pixels.shape[:2]
    wide = min(style.page_width() - 1.1, (style.MAX_HEIGHT - 1.0) * width / height)
    tall = wide * height / width
    figure = style.new_figure(style.page_width(), tall + 0.45)
    axes = style.place(figure, 0.1, 0.1, wide, tall)
    axes.imshow(image.pixels, cmap="gray", interpolation="nearest", aspect="auto")
    axes.set_axis_off()
    bar = style.place(figure, 0.1 + wide + 0.12, 0.1 + 0.05 * tall, 0.16, 0.9 * tall)
    # The map as it looks over a middle grey, which the picture has on average.
    colours = matplotlib.colormaps[image.map](np.linspace(0, 1, 256))[:, :3] * image.opacity + 0.5 * (1 - image.opacity)
    seen = LinearSegmentedColormap.from_list("seen", colours)
    figure.colorbar(ScalarMappable(Normalize(image.low, max(image.high, image.low + 1e-12)), seen), cax=bar, extend="max",
                    label=image.unit.replace("us ", "µs ").replace(" a ", " per "))
    style.title(figure, f"Cost on one thread, {trace.metadata['kernel']}, {trace.metadata['numeric']}, {trace.metadata['model']}", 0.15)
    spread = "" if image.unit.startswith("us") else " A triangle's cost is spread evenly over the pixels of its box; boxes on top of each other add up."
    hidden = f" {100 * image.shown:.1f} % of the cost lies on the picture, the rest in triangles that draw nothing." if image.shown < 0.9995 else ""
    return Drawing("cost", SECTION, figure, Caption(
        f"Cost of each {trace.metadata['unit']}, {trace.title}",
        f"Median time of each {trace.metadata['unit']} on one thread, without what the stamps add, over the picture in grey.{spread}{hidden} The scale ends at"
        f" the 99.9th percentile of the pixels that cost something. Machine: {trace.machine}.",
        "Brighter costs more; the bar shows the colours as they look over a middle grey.", _frame_facts(trace)), raster=True)
