"""The option of all commands that draw: how wide the figures are."""

from __future__ import annotations

import argparse

NARROWEST, WIDEST = 84, 175  # mm: a column of two, and the text of an A4 page
INCH = 25.4  # mm


def width(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--width", metavar="MM", type=millimetres, default=WIDEST,
                        help=f"width of the figures in mm, {NARROWEST} (a column of a page with two) to {WIDEST} (the text of an A4 page, the default);"
                             " letters have the same size in all of them")


def millimetres(words: str) -> float:
    value = float(words)
    if not NARROWEST <= value <= WIDEST:
        raise argparse.ArgumentTypeError(f"{words} is not from {NARROWEST} to {WIDEST}")
    return value


def run(options: argparse.Namespace) -> int:
    """The command, with its figures as wide as it was asked for."""
    if getattr(options, "width", WIDEST) == WIDEST:
        return options.run(options)
    from .. import style  # only now: it takes matplotlib along

    with style.page(options.width / INCH):
        return options.run(options)
