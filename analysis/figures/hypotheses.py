"""The hypotheses of a study: the ratio of each with its interval, beside what was claimed."""

from __future__ import annotations

import textwrap
from typing import Iterator

from matplotlib.lines import Line2D

from .. import captions, hypotheses, style, text
from ..comparison import Analysis
from ..hypotheses import Verdict
from .common import ROW_HEIGHT, Block, Drawing, Point, Row, most_rows, named, pages, part, row_frame, spread

LINE = 50  # characters of a claim on a line of a whole page's width
MOST = 100  # characters of a claim; a longer one is cut off, and the table has it whole


def draw(analysis: Analysis) -> Iterator[Drawing]:
    tested = [v for v in hypotheses.verdicts(analysis) if v.tested]
    if not tested:
        return
    labels = {v.number: _label(v) for v in tested}
    blocks = [Block(word, [Row(labels[v.number], note=text.number(v.ratio.value, v.ratio.low, v.ratio.high)) for v in tested if v.word == word])
              for word in (hypotheses.SUPPORTED, hypotheses.REFUTED, hypotheses.UNDECIDED)]
    by_label = {labels[v.number]: v for v in tested}
    values = [x for v in tested for x in (v.ratio.value, v.ratio.low, v.ratio.high, v.bound, 1.0) if x is not None]
    log = spread(values)
    keys = [Line2D([], [], color=style.COLOURS[0], marker="o", ms=4.5, lw=1.4, label="measured, with its interval"),
            Line2D([], [], color=style.COLOURS[1], marker=">", ms=5, lw=0, label="claimed: this or more"),
            Line2D([], [], color="black", lw=0.8, ls=(0, (4, 2)), label="both sides take the same time")]
    row_height = ROW_HEIGHT * (1 + 0.8 * max(label.count("\n") for label in labels.values()))
    split = pages([block for block in blocks if block.rows], most_rows(row_height))
    for page, some in enumerate(split):
        frame = row_frame(some, f"Hypotheses{part(page, len(split))}", "time of slower / time of faster (times)" + (", log scale" if log else ""),
                          limits=(min(values), max(values)), log=log, keys=keys, every=blocks, row_height=row_height)
        if not log:
            reach = max(max(values) - min(values), 0.02)
            frame.axes.set_xlim(min(values) - 0.08 * reach, max(values) + 0.08 * reach)  # differences of a few per cent are seen
        shown: list[Verdict] = [by_label[row.label] for _, row in frame.rows]
        for (y, _), v in zip(frame.rows, shown):
            point = Point(v.ratio.value, v.ratio.low, v.ratio.high, 0)
            if point.low is not None:
                frame.axes.plot([point.low, point.high], [y, y], color=style.COLOURS[0], lw=1.4, marker="|", ms=5, solid_capstyle="butt", zorder=3)
            frame.axes.plot(point.value, y, color=style.COLOURS[0], marker="o", ms=4.5, zorder=4)
            frame.axes.plot(v.bound, y, color=style.COLOURS[1], marker=">", ms=5, lw=0, zorder=5)
        frame.axes.axvline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
        records = [record for v in shown for record in (v.faster, v.slower)]
        kinds = sorted({v.ratio.kind for v in shown if v.ratio.has_interval})
        caption = captions.build(
            analysis, f"Hypotheses{part(page, len(split))}",
            "An interval that lies right of its mark supports the claim, one left of it refutes it, one that holds the mark leaves it open.",
            records, estimates="medians of paired ratios", kind=" / ".join(kinds),
            base="Each ratio is over the faster side of its own claim; the table names both sides.",
            notes=["Verdicts also need p < 0.05 after Holm's correction over the hypotheses that were tested."])
        yield Drawing(named("hypotheses", page, len(split)), hypotheses.SECTION, frame.figure, caption)


def _label(verdict: Verdict) -> str:
    words = f"H{verdict.number}  {verdict.hypothesis.claim}"
    line = int(LINE * style.page_width() / style.FULL_WIDTH)
    return "\n".join(textwrap.wrap(words, line, max_lines=MOST // line, placeholder=" …"))
