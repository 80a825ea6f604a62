"""What a comparison of two runs is written as: text, table, figure, JSON."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict
from os.path import commonprefix
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy import stats

from . import contexts, sidecars, style, text, writing
from .captions import Caption, Facts
from .compare import AMBIGUOUS, CHOSEN, FASTER, SAME, SLOWER, DECIDED_SHARE, VERDICTS, Outcome, Row, Run, common_shift
from .figures import common
from .statistics import intervals, rank_tests
from .statistics.samples import Samples
from .tables import Table

# Colour, marker and filling, so that a verdict can be read in grey, too.
LOOKS = {FASTER: (style.COLOURS[0], "<", True), SLOWER: (style.COLOURS[1], ">", True), SAME: (style.COLOURS[6], "o", True),
         AMBIGUOUS: (style.COLOURS[7], "D", False)}
OUT_OF_REACH = 12.0  # standard errors that launches have to be apart: from there on the reader is told
MEANING = {FASTER: "B is faster", SLOWER: "B is slower", SAME: "the same within the margin", AMBIGUOUS: "ambiguous"}


def plain(outcome: Outcome) -> str:
    """Every point, the slowest change first, then the counts and what else a reader has to know."""
    lines = [f"A {outcome.a.path}", f"B {outcome.b.path}", "",
             f"{'verdict':<10} {'time B / A':<22} {'P(B>A)':>6} {'A':>10} {'B':>10}  point"]
    for row in outcome.rows:
        a, b = (f"{text.number(_median(s))} ms" if s is not None else "" for s in (row.a, row.b))
        if row.ratio is None:
            lines.append(f"{row.verdict:<10} {text.MISSING:<22} {text.MISSING:>6} {a:>10} {b:>10}  {row.name} ({row.why})")
            continue
        quotient = text.estimate(row.ratio.value, row.ratio.low, row.ratio.high)
        lines.append(f"{row.verdict:<10} {quotient:<22} {row.superiority:>6.2f} {a:>10} {b:>10}  {row.name}")
    return "\n".join([*lines, "", *remarks(outcome)])


def remarks(outcome: Outcome) -> list[str]:
    counts = Counter(row.verdict for row in outcome.rows)
    lines = [", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict])
             + f" of {text.count(len(outcome.rows), 'point')}. SAME: within {text.percent(outcome.margin)}. Brackets: 95 % intervals"
             " of the ratio of medians. P(B>A): chance that a sample of B takes longer than one of A."]
    whys = Counter(row.why for row in outcome.rows if row.verdict == AMBIGUOUS)
    lines += [f"Ambiguous: {text.count(many, 'point')}, {why}." for why, many in whys.most_common()]
    lines += _power(outcome)
    lines.append(_yardstick(outcome))
    shift = common_shift(outcome)
    if shift is not None:
        lines.append(f"Nearly every point moved to the same side, by {text.percent(abs(shift - 1))} in the median: a machine that"
                     " changed between the runs looks like this, too; repeat A before you blame B.")
    if outcome.only_b:
        lines.append(f"Only in B: {text.listing(outcome.only_b, 1000)}.")
    if outcome.only_a:
        lines.append(f"Only in A, as allowed by --ignore: {text.listing(outcome.only_a, 1000)}.")
    for name, run in (("A", outcome.a), ("B", outcome.b)):
        unsaid = [f"{point} ({why})" for point, why in run.untimed.items() if name == "A" or point not in outcome.a.samples]
        if unsaid:
            lines.append(f"Without times in {name}: {text.listing(unsaid, 1000)}.")
    lines += [f"Differs, {'as the program chose it from the time of a frame' if d.key == CHOSEN else 'as allowed by --ignore'}: {d.key}: {d.words}."
              for d in outcome.ignored]
    if not (outcome.a.complete and outcome.b.complete):
        lines.append("Google Benchmark's JSON records little of the set-up: " + (
            "only host and CPUs were compared." if outcome.a.complete or outcome.b.complete else "its own context was compared, and no more."))
    if outcome.status == 4:
        lines.append(f"UNDECIDED: less than {text.percent(DECIDED_SHARE)} of the points could be told; this is not \"nothing is slower\".")
    return lines


def _power(outcome: Outcome) -> list[str]:
    """What the counts allow to be found at all."""
    judged = outcome.judged
    if not judged:
        return ["No point has the samples and launches for a test: whatever the times, none could be called FASTER or SLOWER."]
    lines = []
    assumed = sum(row.test == rank_tests.WELCH for row in judged)
    if assumed:
        lines.append(f"Too few samples for a rank test to survive Holm over {text.count(len(judged), 'point')}: {assumed} of them use Welch's"
                     " t on logarithms, which assumes a distribution.")
    few = [row for row in judged if min(row.a.launch_count, row.b.launch_count) < intervals.MIN_LAUNCHES]
    if few:
        lines.append(f"{text.count(len(few), 'point')} judged with fewer than {intervals.MIN_LAUNCHES} launches on a side: such a verdict is one on"
                     " those processes, and others may differ by as much.")
    level = (1 - intervals.CONFIDENCE) / len(judged)
    launches = [min(row.a.launch_count, row.b.launch_count) for row in judged if min(row.a.launch_count, row.b.launch_count) > 1]
    if launches:
        least = min(launches)
        needed = float(stats.t.isf(level / 2, 2 * least - 2))
        if needed > OUT_OF_REACH:
            lines.append(f"Holm over {text.count(len(judged), 'point')} asks for p below {level:.1g}: with {least} launches a side only a shift of"
                         f" {needed:.0f} standard errors of the launches has it. Take more launches, or compare fewer points.")
    return lines


def _yardstick(outcome: Outcome) -> str:
    """What the reader has to know of the machine between the runs."""
    words = "A and B were not interleaved: what the machine did between them counts as a difference"
    if not outcome.repeats:
        return f"{words}. Repeats of A (--repeat) would say how much that is."
    distances = [np.expm1(row.distance) for row in outcome.rows if row.ratio is not None]
    return (f"{words} unless A moves as far by itself: {text.count(len(outcome.repeats), 'repeat')} of A"
            f" ({', '.join(str(run.path) for run in outcome.repeats)}) widened the intervals by {text.percent(min(distances))} to"
            f" {text.percent(max(distances))}.")


def _median(samples: Samples) -> float:
    return float(np.median(samples.values))


def table(outcome: Outcome) -> Table:
    numbers, words = [], []
    for row in outcome.rows:
        ratio = row.ratio
        a, b = _median(row.a), None if row.b is None else _median(row.b)
        numbers.append({"verdict": row.verdict, "point": row.name, "a_ms": a, "b_ms": b, "b_over_a": ratio.value if ratio else None,
                        "low": ratio.low if ratio else None, "high": ratio.high if ratio else None,
                        "p_holm": row.p if ratio else None, "superiority": row.superiority if ratio else None,
                        "n_a": row.a.n, "n_b": row.b.n if row.b is not None else 0, "why": row.why, "test": row.test,
                        "moved_by_repeats": float(np.expm1(row.distance))})
        words.append({"point": row.name, "A (ms)": text.number(a), "B (ms)": text.number(b),
                      "time B / A": text.estimate(ratio.value, ratio.low, ratio.high) if ratio else text.MISSING,
                      "verdict": row.verdict})
    return Table("comparison", "Two runs, point by point", " ".join(remarks(outcome)), pd.DataFrame(numbers), pd.DataFrame(words))


def as_json(outcome: Outcome) -> str:
    def run(r: Run) -> dict[str, Any]:
        return {"path": str(r.path), "context": r.context.get("id")}

    def difference(d: contexts.Difference) -> dict[str, Any]:
        return {key: value for key, value in asdict(d).items() if value != ""}

    points = [{key: None if isinstance(value, float) and np.isnan(value) else value for key, value in entry.items()}
              for entry in table(outcome).numbers.astype(object).to_dict("records")]
    return json.dumps({"a": run(outcome.a), "b": run(outcome.b), "margin": outcome.margin, "status": outcome.status, "repeats": [run(r) for r in outcome.repeats],
                       "points": points, "only_a": outcome.only_a, "only_b": outcome.only_b,
                       "ignored": [difference(d) for d in outcome.ignored], "remarks": remarks(outcome)}, indent=1)


def drawings(outcome: Outcome) -> list[common.Drawing]:
    """The ratio of every point with its interval, in the order of the text; as many figures as hold them."""
    rows = [row for row in outcome.rows if row.ratio is not None]
    if not rows:
        return []
    limits = _limits(rows, outcome.margin)
    step = common.max_rows()
    pages = [rows[i:i + step] for i in range(0, len(rows), step)]
    return [common.Drawing(common.named("ratios", page, len(pages)), "Comparison",
                           _figure(outcome, shown, limits, common.part(page, len(pages))),
                           _caption(outcome, shown, common.part(page, len(pages)))) for page, shown in enumerate(pages)]


def _limits(rows: list[Row], margin: float) -> tuple[float, float]:
    ends = [end for row in rows for end in (row.ratio.low, row.ratio.high, row.ratio.value) if end is not None]
    low, high = min([*ends, 1 / (1 + margin)]), max([*ends, 1 + margin])
    room = 0.06 * (high - low)
    return low - min(room, low / 2), high + room


def _figure(outcome: Outcome, rows: list[Row], limits: tuple[float, float], suffix: str) -> matplotlib.figure.Figure:
    seen = [verdict for verdict in (SLOWER, FASTER, AMBIGUOUS, SAME) if any(row.verdict == verdict for row in outcome.rows)]
    keys = [_mark(verdict, label=MEANING[verdict]) for verdict in seen]
    keys.append(Patch(color=style.BAND, ec="#BBBBBB", lw=0.5, label=f"margin, {text.percent(outcome.margin)}"))
    log = limits[1] / limits[0] > 3
    shared = _shared([row.name for row in rows])
    block = common.Block(shared.rstrip("/"), [common.Row(text.shorten(row.name[len(shared):], 70)) for row in rows])
    frame = common.row_frame([block], f"Time of B over time of A{suffix}", "time B / time A (1: no difference; left is faster)",
                             limits=limits, log=log, keys=keys)
    for patch in list(frame.axes.patches):
        patch.remove()  # the band of a kernel's rows: there is one block, and the margin is the band here
    frame.axes.set_xlim(limits)
    frame.axes.axvspan(1 / (1 + outcome.margin), 1 + outcome.margin, fc=style.BAND, ec="#BBBBBB", lw=0.5, zorder=0)
    frame.axes.axvline(1, color="black", lw=0.8, ls=(0, (4, 2)), zorder=1)
    for (y, _), row in zip(frame.rows, rows):
        colour = LOOKS[row.verdict][0]
        if row.ratio.has_interval:
            frame.axes.plot([row.ratio.low, row.ratio.high], [y, y], color=colour, lw=1.4, solid_capstyle="butt", zorder=3)
        mark = _mark(row.verdict)
        mark.set_data([row.ratio.value], [y])
        mark.set_zorder(4)
        frame.axes.add_line(mark)
    return frame.figure


def _shared(names: list[str]) -> str:
    """What all names begin with, up to a slash: said once, it leaves room for the intervals."""
    prefix = commonprefix([name.rpartition("/")[0] + "/" for name in names])
    return prefix[:prefix.rfind("/") + 1]


def _mark(verdict: str, **options: str) -> Line2D:
    colour, marker, filled = LOOKS[verdict]
    return Line2D([], [], color=colour, marker=marker, mfc=colour if filled else "white", mec=colour, mew=1.0, ms=5, lw=0, **options)


def _caption(outcome: Outcome, rows: list[Row], suffix: str) -> Caption:
    kinds = sorted({row.ratio.kind for row in rows if row.ratio.has_interval})
    counts = [s.n for row in rows for s in (row.a, row.b)]
    launches = sorted({s.launch_count for row in rows for s in (row.a, row.b)})
    base = f"Base: A, {outcome.a.path.name}, whose medians are in the table; B is {outcome.b.path.name}."
    machine = outcome.a.context.get("machine", {})
    name = machine.get("cpu") or machine.get("hostname") or "not recorded"
    return Caption(f"Two runs, point by point{suffix}",
                   f"Points are ratios of medians with 95 % intervals ({' / '.join(kinds) or 'none'}), {text.span(counts)} samples a"
                   f" point and run. {base} {' / '.join(map(str, launches))} launches. Machine: {name}.",
                   "Filled triangles point to the side that a point moved to; hollow diamonds were not decided; the band is the"
                   " margin.", Facts("ratios of medians", " / ".join(kinds) or None, base, (min(counts), max(counts)),
                                     (launches[0], launches[-1]), str(name)))


def _paths(outcome: Outcome) -> list[Path]:
    return [run.path for run in (outcome.a, outcome.b, *outcome.repeats)]


def write(outcome: Outcome, folder: Path) -> list[Path]:
    """comparison.{csv,tex,json} and ratios.{svg,pdf,png,json}."""
    made = table(outcome)
    files: dict[str, str | bytes] = {"comparison.csv": made.csv(), "comparison.tex": made.tex(), "comparison.json": as_json(outcome) + "\n"}
    with matplotlib.rc_context(style.RC):
        for drawing in drawings(outcome):
            files |= sidecars.files(drawing)
    read = [path / name for path in _paths(outcome) for name in ("records.jsonl", "context.json")] + _paths(outcome)
    writing.write_folder(folder, files, "compare", read)
    return [folder / name for name in files]
