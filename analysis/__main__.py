"""Command line: python3 -m analysis report DIR, table DIR, speed DIR, compare DIR_A DIR_B, lint DIR, selftest FILE, adopt DIR, stability FILE, trace FILE, whatif FILE, compilers DIR."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from . import __version__
from .load import InputError, load


class Parser(argparse.ArgumentParser):
    """Usage errors in one line, as the other programs of the suite give them."""

    def error(self, message: str) -> None:  # type: ignore[override]
        print(f"analysis: {message} (see {self.prog} --help)", file=sys.stderr)
        raise SystemExit(2)


def share(words: str) -> float:
    value = float(words)
    if not 0 < value < 1:
        raise argparse.ArgumentTypeError(f"{words} is not between 0 and 1")
    return value


def microseconds(word: str) -> float:
    value = float(word)
    if not 0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number that is not below 0, found {word!r}")
    return value


def parser() -> Parser:
    main = Parser(prog="python3 -m analysis", description="Turns the records of a study into figures, tables and a report.",
                  epilog="Exit codes: 0 done, 1 compare found a slower point, lint a broken rule or selftest too many differences,"
                         " 2 bad input or usage (one line on stderr), 3 compare found a point that only A has, or that failed in B, 4 compare could not tell most points.")
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
    lint = commands.add_parser("lint", help="say which rules of measuring a study and its figures keep or break",
                               description="Names each rule, whether the folder keeps it, what breaks it (file, point) and what to do. In a"
                                           " folder without a study the rules of figures are asked of what adopt, whatif, trace, stability or"
                                           " compare drew. Exit codes: 0 nothing forbids publishing, 1 a rule is broken, 2 bad input.")
    lint.add_argument("--json", action="store_true", help="print JSON, with every finding")
    lint.add_argument("directory", metavar="DIR", type=Path, help="folder of a study (see harness/records.md), or of figures")
    for command in (report, table, speed):
        command.add_argument("directory", metavar="DIR", type=Path,
                             help="folder of a study, with context.json and records.jsonl (see harness/records.md)")
    compare = commands.add_parser("compare", help="compare two runs, point by point",
                                  description="Says of each point whether B is FASTER or SLOWER than A, the SAME within the margin, or"
                                              " AMBIGUOUS, with the ratio of their times and its 95 %% interval. Exit codes: 0 nothing"
                                              " is slower, 1 a point is slower, 2 bad input, or the recorded contexts differ (one line"
                                              " a difference), 3 a point was lost, 4 undecided: no point, or fewer than half of the"
                                              " points, could be called FASTER, SLOWER or SAME.")
    for name, what in (("a", "the run that is compared with"), ("b", "the run that is judged")):
        compare.add_argument(name, metavar=f"DIR_{name.upper()}", type=Path,
                             help=f"{what}: folder of a study, or a file of Google Benchmark's JSON")
    compare.add_argument("--ignore", metavar="KEY", action="append", default=[],
                         help="a key of context.json, or of a record's config as config.KEY, that may differ, with all that lies in it"
                              " (program, machine.kernel, ...); points: points that B has not; may be given several times")
    compare.add_argument("--margin", metavar="SHARE", type=share,
                         help="differences within it are SAME (default: the studies' target, else 0.02)")
    compare.add_argument("--few-launches", action="store_true",
                         help="judge points with fewer than five launches on a side, too, whose differences may be those of other"
                              " processes (default: AMBIGUOUS)")
    compare.add_argument("--repeat", metavar="DIR_A2", type=Path, action="append", default=[],
                         help="another run of A: what differs by no more than A from itself is AMBIGUOUS; may be given several times, and"
                              " two repeats tell much more than one")
    compare.add_argument("--json", action="store_true", help="print JSON instead of text")
    compare.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="also write comparison.csv, .tex, .json and its figure")
    stability = commands.add_parser("stability", help="draw the stability envelopes of numeric modes and list their breaking points",
                                    description="Writes FOLDER/stability.png, .svg, .pdf, .csv, .tex and its caption, .txt, then"
                                                " prints where each numeric mode breaks.")
    stability.add_argument("file", metavar="FILE", type=Path, help="the sweeps, one JSON object a line (stability.jsonl)")
    stability.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="where to write (default: the folder of FILE)")
    selftest = commands.add_parser("selftest", help="say how often the report would tell a point from itself",
                                   description="Judges the comparisons of `rasterbench selftest -o FILE` as the report judges points."
                                               " Exit codes: 0 no more false differences than stated, 1 more, 2 bad input.")
    selftest.add_argument("file", metavar="FILE", type=Path, help="one comparison a line (rasterbench selftest -o)")
    adopt = commands.add_parser("adopt", help="draw speedup, efficiency and schedules of a program that rasterbench adopt has timed",
                                description="Writes DIR/figures/*.svg, *.pdf, *.png with their captions, .txt, and DIR/tables/*.csv, *.tex,"
                                            " then prints the times with 95 %% intervals.")
    adopt.add_argument("directory", metavar="DIR", type=Path, help="folder of `rasterbench adopt --out`, with adopt.json")
    trace = commands.add_parser("trace", help="draw a traced frame: its chunks by thread, the threads' time, the heat map of its costs",
                                description="Writes FOLDER/gantt, thread_shares and, where the trace has a heat map, cost, each as .png, .svg and"
                                            " .pdf, their captions.txt, and threads.csv and .tex, then prints the table of the threads.")
    trace.add_argument("file", metavar="FILE", type=Path, help="a trace of `rasterbench trace` (trace.json)")
    trace.add_argument("-o", "--out", metavar="FOLDER", type=Path, help="where to write (default: figures/ beside FILE)")
    whatif = commands.add_parser("whatif", help="predict schedules and chunks for 1 to 1024 threads from traced costs",
                                 description="Simulates each schedule and chunk on the costs of a loop's iterations, contention-free, for 1 to"
                                             " 1024 threads; writes figures, tables and text to FOLDER and prints the answers for 16 and 64 threads.")
    whatif.add_argument("file", metavar="COSTS", type=Path, help="costs.json, as `rasterbench trace --costs` writes it")
    whatif.add_argument("--measured", metavar="DIR", type=Path, help="folder of a study to compare the predictions with")
    whatif.add_argument("--scene", metavar="NAME", help="scene of that study (needed where it has several)")
    whatif.add_argument("--replay", metavar="FILE", type=Path, action="append", default=[],
                        help="output of `rasterbench replay --json`, to state the error of the rules; may be repeated")
    whatif.add_argument("--steal-us", metavar="X", type=microseconds, help="cost of a steal in microseconds (default: that of a chunk)")
    whatif.add_argument("--out", metavar="FOLDER", type=Path, required=True, help="where to write")
    compilers = commands.add_parser("compilers", help="compare programs of several compilers and flags, as scripts/compilers measured them",
                                    description="Writes DIR/compilers.csv, .tex, .txt and compilers_ratio.png, .svg, .pdf with its caption,"
                                                " then prints the table.")
    compilers.add_argument("directory", metavar="DIR", type=Path, help="folder that scripts/compilers wrote, with compilers.json")
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
        if options.command == "selftest":
            from . import selftest

            outcome = selftest.judge(selftest.read(options.file))
            print(selftest.plain(outcome))
            return outcome.status
        if options.command == "compare":
            from . import compare

            outcome = compare.compare(compare.read(options.a), compare.read(options.b), options.ignore, options.margin,
                                      options.few_launches, [compare.read(path) for path in options.repeat])
            from . import comparison_output

            written = comparison_output.write(outcome, options.out) if options.out else []
            print(comparison_output.as_json(outcome) if options.json else comparison_output.plain(outcome))
            if written and not options.json:
                print(f"written: {', '.join(map(str, written))}")
            return outcome.status
        if options.command == "adopt":
            from . import adopt

            print(adopt.write(options.directory))
            return 0
        if options.command == "trace":
            from . import trace

            traced = trace.read(options.file)
            written = trace.write(traced, options.out or options.file.parent / "figures")
            print(trace.plain(traced))
            print(f"written: {', '.join(map(str, written))}")
            return 0
        if options.command == "whatif":
            from . import whatif

            made = whatif.write(options.file, options.out, options.measured, options.scene, options.steal_us, options.replay)
            print(made.text)
            print(f"written: {', '.join(map(str, made.paths))}")
            return 0
        if options.command == "lint":
            from . import lint

            result = lint.lint_directory(options.directory)
            print(lint.as_json(result) if options.json else lint.plain(result))
            return result.status
        if options.command == "compilers":
            from . import compilers

            found = compilers.Comparison(options.directory)
            written = compilers.write(found)
            print(compilers.plain(found))
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
    print(f"report: {written.path}")
    for finding in written.findings:
        print(finding.text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
