"""`compilers DIR`: programs of several compilers and flags, as scripts/compilers measured them."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import pages, studies

NAME = "compilers"
HELP = "compare programs of several compilers and flags, as scripts/compilers measured them"
DESCRIPTION = "Writes DIR/compilers.csv, .tex, .txt and compilers_ratio.png, .svg, .pdf with its caption, then prints the table."


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("directory", metavar="DIR", type=Path, help="folder that scripts/compilers wrote, with compilers.json")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    from .. import compilers

    found = compilers.Comparison(options.directory)
    written = compilers.write(found)
    print(compilers.plain(found))
    studies.print_written(written)
    return 0
