"""The commands of `python3 -m analysis`, one module each: NAME, HELP, DESCRIPTION, arguments(parser) and run(options), which
returns the exit status. A new command is a new module and its entry in COMMANDS.

A module here imports what it needs within run(): nobody waits for matplotlib to learn of a wrong option or path.
"""

from __future__ import annotations

import argparse
from typing import Protocol

from . import adopt, compare, compilers, lint, report, selftest, speed, stability, table, trace, whatif


class Command(Protocol):
    """What a module of a command has."""

    NAME: str
    HELP: str  # one line in the list of commands
    DESCRIPTION: str  # above its own options

    def arguments(self, parser: argparse.ArgumentParser) -> None: ...

    def run(self, options: argparse.Namespace) -> int: ...


COMMANDS: tuple[Command, ...] = (report, table, speed, lint, compare, stability, selftest, adopt, trace, whatif, compilers)  # as --help lists them
