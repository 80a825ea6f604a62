"""`report DIR`: figures, tables and the report of a study."""

from __future__ import annotations

import argparse
from pathlib import Path

from . import pages, studies

NAME = "report"
HELP = "write report.html, figures/ and tables/ and print three findings"
DESCRIPTION = ("Writes DIR/figures/*.svg, *.pdf, *.png, DIR/tables/*.csv, *.tex and a report as one self-contained HTML file, then prints its"
               " place and three findings.")


def arguments(parser: argparse.ArgumentParser) -> None:
    studies.directory(parser)
    parser.add_argument("--out", metavar="FILE", type=Path, help="where to write the report (default: DIR/report.html)")
    pages.width(parser)


def run(options: argparse.Namespace) -> int:
    analysis = studies.analysed(options.directory)
    from .. import report

    written = report.write(analysis, options.out)
    print(f"report: {written.path}")
    for finding in written.findings:
        print(finding.text)
    return 0
