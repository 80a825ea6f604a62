"""`trace FILE`: the chunks, threads and costs of one traced frame."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import pages, studies

NAME = "trace"
HELP = "draw a traced frame: its chunks by thread, the threads' time, the heat map of its costs"
DESCRIPTION = ("Writes FOLDER/gantt, thread_shares and, where the trace has a heat map, cost, each as .png, .svg and .pdf, their captions.txt,"
               " and threads.csv and .tex, then prints the table of the threads.")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="a trace of `rasterbench trace` (trace.json)")
    parser.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="where to write (default: figures/ beside FILE)")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    from .. import trace

    traced = trace.read(options.file)
    written = trace.write(traced, options.out or options.file.parent / "figures")
    print(trace.plain(traced))
    studies.print_written(written)
    return 0
