"""Command line: python3 -m analysis COMMAND ... (the commands are in commands/)."""

from __future__ import annotations

import argparse
import sys

from . import __version__
from .commands import COMMANDS, pages
from .load import InputError


class Parser(argparse.ArgumentParser):
    """Usage errors in one line, as the other programs of the suite give them."""

    def error(self, message: str) -> None:  # type: ignore[override]
        print(f"analysis: {message} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(2)


def parser() -> Parser:
    main = Parser(prog="python3 -m analysis", description="Turns the records of a study into figures, tables and a report.",
                  epilog="Exit codes: 0 done, 1 compare found a slower point, lint a broken rule or selftest too many differences,"
                         " 2 bad input or usage (one line on stderr), 3 compare found a point that only A has, or that failed in B, 4 compare could not tell most points.")
    main.add_argument("--version", action="version", version=f"rasterbench analysis {__version__}")
    subparsers = main.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=Parser)
    for command in COMMANDS:
        one = subparsers.add_parser(command.NAME, help=command.HELP, description=command.DESCRIPTION)
        command.arguments(one)
        one.set_defaults(run=command.run)
    return main


def main(arguments: list[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    try:
        return pages.run(options)
    except InputError as error:
        for line in getattr(error, "lines", ()):
            print(f"analysis: {line}", file=sys.stderr)
        print(f"analysis: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 0
    except OSError as error:
        given = vars(options).get("directory") or vars(options).get("out") or vars(options).get("file")
        print(f"analysis: {error.filename or given}: {error.strerror or error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
