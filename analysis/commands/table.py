"""`table DIR`: the points of a study on the terminal."""

from __future__ import annotations

import argparse

from . import studies

NAME = "table"
HELP = "print the table of strategies and executions"
DESCRIPTION = "Prints for each scene every point with its median time in milliseconds and the 95 % interval."

arguments = studies.directory


def run(options: argparse.Namespace) -> int:
    analysis = studies.analysed(options.directory)
    from .. import tables

    print(tables.plain(analysis))
    return 0
