"""`adopt DIR`: what `rasterbench adopt` timed."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import pages

NAME = "adopt"
HELP = "draw speedup, efficiency and schedules of a program that rasterbench adopt has timed"
DESCRIPTION = ("Writes DIR/figures/*.svg, *.pdf, *.png with their captions, .txt, and DIR/tables/*.csv, *.tex, then prints the times with 95 %"
               " intervals.")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("directory", metavar="DIR", type=Path, help="folder of `rasterbench adopt --out`, with adopt.json")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    from .. import adopt

    print(adopt.write(options.directory))
    return 0
