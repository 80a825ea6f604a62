"""`whatif COSTS`: schedules and chunks on more threads than there are here."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from . import pages, studies

NAME = "whatif"
HELP = "predict schedules and chunks for 1 to 1024 threads from traced costs"
DESCRIPTION = ("Simulates each schedule and chunk on the costs of a loop's iterations, contention-free, for 1 to 1024 threads; writes figures,"
               " tables and text to FOLDER and prints the answers for 16 and 64 threads.")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="COSTS", type=Path, help="costs.json, as `rasterbench trace --costs` writes it")
    parser.add_argument("--measured", metavar="DIR", type=Path, help="folder of a study to compare the predictions with")
    parser.add_argument("--scene", metavar="NAME", help="scene of that study (needed where it has several)")
    parser.add_argument("--replay", metavar="FILE", type=Path, action="append", default=[],
                        help="output of `rasterbench replay --json`, to state the error of the rules; may be repeated")
    parser.add_argument("--steal-us", metavar="X", type=microseconds, help="cost of a steal in microseconds (default: as traced, else that of a chunk)")
    parser.add_argument("--out", metavar="FOLDER", type=Path, required=True, help="where to write")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    from .. import whatif

    made = whatif.write(options.file, options.out, options.measured, options.scene, options.steal_us, options.replay)
    print(made.text)
    studies.print_written(made.paths)
    return 0


def microseconds(word: str) -> float:
    value = float(word)
    if not 0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number that is not below 0, found {word!r}")
    return value
