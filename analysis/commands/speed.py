"""`speed DIR`: the kernel of studies/speed.toml beside the peer, the floor and their goals."""

from __future__ import annotations

import argparse

from . import studies

NAME = "speed"
HELP = "print the kernel of a study beside the peer, the floor and their goals"
DESCRIPTION = ("Prints for each picture how many times faster than the peer the kernel is and how many times the floor it takes, with 95 %"
               " intervals, and whether that is the goal of its class (studies/speed.toml). Writes DIR/speed.csv and DIR/speed.tex.")

arguments = studies.directory


def run(options: argparse.Namespace) -> int:
    analysis = studies.analysed(options.directory)
    from .. import speed

    print(speed.plain(analysis))
    studies.print_written(speed.write(analysis))
    return 0
