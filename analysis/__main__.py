"""Command line: python3 -m analysis report DIR, table DIR, speed DIR, stability FILE."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import __version__
from .load import InputError, load


class Parser(argparse.ArgumentParser):
    """Usage errors in one line, as the other programs of the suite give them."""

    def error(self, message: str) -> None:  # type: ignore[override]
        print(f"analysis: {message} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(2)


def parser() -> Parser:
    main = Parser(prog="python3 -m analysis", description="Turns the records of a study into figures, tables and a report.",
                  epilog="Exit codes: 0 done, 2 bad input or usage (one line on stderr).")
    main.add_argument("--version", action="version", version=f"rasterbench analysis {__version__}")
    commands = main.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=Parser)
    report = commands.add_parser("report", help="write report.html, figures/ and tables/ and print three findings",
                                 description="Writes DIR/figures/*.svg, *.pdf, *.png, DIR/tables/*.csv, *.tex and a report as one"
                                             " self-contained HTML file, then prints its place and three findings.")
    table = commands.add_parser("table", help="print the table of strategies and executions",
                                description="Prints for each scene every point with its median time in milliseconds and the 95 %%"
                                            " interval.")
    speed = commands.add_parser("speed", help="print the kernel of a study beside the peer, the floor and their goals",
                                description="Prints for each picture how many times faster than the peer the kernel is and how many times"
                                            " the floor it takes, with 95 %% intervals, and whether that is the goal of its class"
                                            " (studies/speed.toml). Writes DIR/speed.csv and DIR/speed.tex.")
    for command in (report, table, speed):
        command.add_argument("directory", metavar="DIR", type=Path,
                             help="folder of a study, with context.json and records.jsonl (see harness/records.md)")
    stability = commands.add_parser("stability", help="draw the stability envelopes of numeric modes and list their breaking points",
                                    description="Writes FOLDER/stability.png, .svg, .pdf, .csv, .tex and its caption, .txt, then"
                                                " prints where each numeric mode breaks.")
    stability.add_argument("file", metavar="FILE", type=Path, help="the sweeps, one JSON object a line (stability.jsonl)")
    stability.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="where to write (default: the folder of FILE)")
    report.add_argument("--out", metavar="FILE", type=Path, help="where to write the report (default: DIR/report.html)")
    return main


def main(arguments: list[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    try:
        if options.command == "stability":
            from . import stability

            written = stability.write(options.file, options.out or options.file.parent)
            print(stability.plain(options.file))
            print(f"written: {', '.join(map(str, written))}")
            return 0
        study = load(options.directory)
        # Imported late: a wrong path should not wait for matplotlib.
        from .comparison import Analysis

        if options.command == "table":
            from . import tables

            print(tables.plain(Analysis(study)))
            return 0
        if options.command == "speed":
            from . import speed

            analysis = Analysis(study)
            print(speed.plain(analysis))
            print(f"written: {', '.join(map(str, speed.write(analysis)))}")
            return 0
        from . import report

        written = report.write(Analysis(study), options.out)
    except InputError as error:
        print(f"analysis: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 0
    except OSError as error:
        print(f"analysis: {error.filename or vars(options).get('directory') or options.file}: {error.strerror or error}", file=sys.stderr)
        return 2
    print(f"report: {written.path}")
    for finding in written.findings:
        print(finding.text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
