"""slurm/status: how far a submitted study is."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Sequence

from . import states
from .folder import Folder
from .usage import Parser, guarded


def run(directory: Path, quiet: bool) -> int:
    folder = Folder.existing(directory)
    manifest = folder.manifest()
    found, problem = states.of_files_only(folder, manifest)
    if problem:
        print(f"slurm/status: {problem}: what follows is from result files alone", file=sys.stderr)
    if not quiet:
        for state in found:
            print(f"{state.kind:<8} {state.family.id[:8]}  {state.family.title}, up to {state.family.threads} threads,"
                  f" {len(state.family.points)} points  {state.reason}")
    print(states.progress(found))
    return 0 if all(state.kind == "done" for state in found) else 3


def main(arguments: Sequence[str] | None = None) -> int:
    parser = Parser(prog="slurm/status", description="Says which families of a submitted study are done, running, pending, failed or"
                    " missing, from result files and squeue, and sacct where there is one.",
                    epilog="Exit codes: 0 all is done, 3 it is not, 2 bad input or usage.")
    parser.add_argument("directory", metavar="DIR", type=Path, help="the --out of slurm/submit")
    parser.add_argument("--quiet", action="store_true", help="only the line of progress")
    options = parser.parse_args(arguments)
    return guarded("slurm/status", lambda: run(options.directory, options.quiet))
