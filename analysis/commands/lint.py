"""`lint DIR`: the rules of measuring that a study or its figures break."""

from __future__ import annotations

import argparse
from pathlib import Path

NAME = "lint"
HELP = "say which rules of measuring a study and its figures keep or break"
DESCRIPTION = ("Names each rule, whether the folder keeps it, what breaks it (file, point) and what to do. In a folder without a study the rules"
               " of figures are asked of what adopt, whatif, trace, stability or compare drew. Exit codes: 0 nothing forbids publishing, 1 a"
               " rule is broken, 2 bad input.")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON, with every finding")
    parser.add_argument("directory", metavar="DIR", type=Path, help="folder of a study (see harness/records.md), or of figures")


def run(options: argparse.Namespace) -> int:
    from .. import lint

    result = lint.lint_directory(options.directory)
    print(lint.as_json(result) if options.json else lint.plain(result))
    return result.status
