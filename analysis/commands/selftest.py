"""`selftest FILE`: how often the report would tell a point from itself."""

from __future__ import annotations

import argparse
from pathlib import Path

NAME = "selftest"
HELP = "say how often the report would tell a point from itself"
DESCRIPTION = ("Judges the comparisons of `rasterbench selftest -o FILE` as the report judges points. Exit codes: 0 no more false differences"
               " than stated, 1 more, 2 bad input.")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="one comparison a line (rasterbench selftest -o)")


def run(options: argparse.Namespace) -> int:
    from .. import selftest

    outcome = selftest.judge(selftest.read(options.file))
    print(selftest.plain(outcome))
    return outcome.status
