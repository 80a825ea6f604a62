"""Command lines: errors are one line on stderr and an exit code."""

from __future__ import annotations

import argparse
import errno
import os
import sys
from typing import Callable, NoReturn

from .folder import Failure, InputError

DISK = (errno.ENOSPC, errno.EDQUOT, errno.EIO)


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {message} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(2)


def guarded(name: str, body: Callable[[], int]) -> int:
    """The exit code of `body`: 2 for bad input, 1 for what went wrong outside, 130 for Ctrl-C."""
    try:
        return body()
    except InputError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    except Failure as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"{name}: interrupted; what was submitted is known: run it again to continue", file=sys.stderr)
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or the interpreter complains at its end
        return 0
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        print(f"{name}: {place}{error.strerror or error}", file=sys.stderr)
        return 1 if error.errno in DISK else 2
