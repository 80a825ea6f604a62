"""`compare DIR_A DIR_B`: which points became faster or slower."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import pages, studies

NAME = "compare"
HELP = "compare two runs, point by point"
DESCRIPTION = ("Says of each point whether B is FASTER or SLOWER than A, the SAME within the margin, or AMBIGUOUS, with the ratio of their times"
               " and its 95 % interval. Exit codes: 0 nothing is slower, 1 a point is slower, 2 bad input, or the recorded contexts differ"
               " (one line a difference), 3 a point was lost, 4 undecided: no point, or fewer than half of the points, could be called"
               " FASTER, SLOWER or SAME.")


def arguments(parser: argparse.ArgumentParser) -> None:
    for name, what in (("a", "the run that is compared with"), ("b", "the run that is judged")):
        parser.add_argument(name, metavar=f"DIR_{name.upper()}", type=Path,
                            help=f"{what}: folder of a study, or a file of Google Benchmark's JSON")
    parser.add_argument("--ignore", metavar="KEY", action="append", default=[],
                        help="a key of context.json, or of a record's config as config.KEY, that may differ, with all that lies in it"
                             " (program, machine.kernel, ...); points: points that B has not; may be given several times")
    parser.add_argument("--margin", metavar="SHARE", type=share,
                        help="differences within it are SAME (default: the studies' target, else 0.02)")
    parser.add_argument("--few-launches", action="store_true",
                        help="judge points with fewer than five launches on a side, too, whose differences may be those of other"
                             " processes (default: AMBIGUOUS)")
    parser.add_argument("--repeat", metavar="DIR_A2", type=Path, action="append", default=[],
                        help="another run of A: what differs by no more than A from itself is AMBIGUOUS; may be given several times, and"
                             " two repeats tell much more than one")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    parser.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="also write comparison.csv, .tex, .json and its figure")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    from .. import compare

    outcome = compare.compare(compare.read(options.a), compare.read(options.b), options.ignore, options.margin, options.few_launches,
                              [compare.read(path) for path in options.repeat])
    from .. import comparison_output

    written = comparison_output.write(outcome, options.out) if options.out else []
    print(comparison_output.as_json(outcome) if options.json else comparison_output.plain(outcome))
    if written and not options.json:
        studies.print_written(written)
    return outcome.status


def share(words: str) -> float:
    value = float(words)
    if not 0 < value < 1:
        raise argparse.ArgumentTypeError(f"{words} is not between 0 and 1")
    return value
