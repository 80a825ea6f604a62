"""`stability FILE`: where each numeric mode breaks."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import pages, studies

NAME = "stability"
HELP = "draw the stability envelopes of numeric modes and list their breaking points"
DESCRIPTION = "Writes FOLDER/stability.png, .svg, .pdf, .csv, .tex and its caption, .txt, then prints where each numeric mode breaks."


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="the sweeps, one JSON object a line (stability.jsonl)")
    parser.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="where to write (default: the folder of FILE)")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    from .. import stability

    written = stability.write(options.file, options.out or options.file.parent)
    print(stability.plain(options.file))
    studies.print_written(written)
    return 0
