"""What the commands that read a study share."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Iterable

if TYPE_CHECKING:
    from ..comparison import Analysis


def directory(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("directory", metavar="DIR", type=Path,
                        help="folder of a study, with context.json and records.jsonl (see harness/records.md)")


def analysed(folder: Path) -> Analysis:
    """Raises InputError where the folder holds no study, before anything slow is imported."""
    from ..load import load

    study = load(folder)
    from ..comparison import Analysis

    return Analysis(study)


def print_written(paths: Iterable[Path]) -> None:
    print(f"written: {', '.join(map(str, paths))}")
