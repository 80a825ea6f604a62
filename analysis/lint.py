"""Which rules of measuring a study keeps, and which its context, records, journal and figures break.

One rule, one id, one function that finds what breaks it. A rule that a folder cannot show is listed as such: silence is not
"kept". `grave` findings make results unfit to be published, `note` findings have to be said beside them.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Callable, Iterator

from . import load, sidecars, text
from .comparison import Analysis
from .load import InputError, Record
from .severity import GRAVE

PICTURES = (".png", ".svg")
FIGURE_PLACES = ("*.json", "figures/*.json", "*/*.json", "*/figures/*.json")
STUDY_FILES = ("context.json", "records.jsonl")
KEPT, BROKEN, NOTED, NOT_VISIBLE = "kept", "broken", "kept, with notes", "not visible"


@dataclass(frozen=True)
class Finding:
    severity: str
    file: str
    place: str  # the point, the key or the figure
    problem: str
    remedy: str


@dataclass(frozen=True)
class Rule:
    id: str
    text: str
    check: Callable[[Folder], Iterator[Finding]] | None  # None: no file of a study shows it
    needs: str = ""  # "journal" or "figures" (all others need a study): without them it is not visible
    why_not: str = ""


@dataclass(frozen=True)
class Verdict:
    rule: Rule
    findings: list[Finding] = field(default_factory=list)
    hidden: str = ""  # why it is not visible

    @property
    def words(self) -> str:
        if self.hidden:
            return NOT_VISIBLE
        return BROKEN if any(f.severity == GRAVE for f in self.findings) else NOTED if self.findings else KEPT


@dataclass(frozen=True)
class Result:
    directory: Path
    verdicts: list[Verdict]

    @property
    def findings(self) -> list[Finding]:
        return [finding for verdict in self.verdicts for finding in verdict.findings]

    @property
    def status(self) -> int:
        return int(any(finding.severity == GRAVE for finding in self.findings))


class Folder:
    """The files of a study, read once; or a folder that has figures only."""

    def __init__(self, analysis: Analysis | None, directory: Path) -> None:
        self.found = analysis
        self.directory = directory

    @property
    def analysis(self) -> Analysis:
        assert self.found is not None, "rules that need a study are not asked without one"
        return self.found

    @property
    def study(self) -> load.Study:
        return self.analysis.study

    @property
    def timed(self) -> list[Record]:
        """Kernels and peers that have times."""
        return [record for record in self.study.every_record if record.ok]

    @cached_property
    def journal(self) -> list[dict[str, Any]] | None:
        """The events; a last line without its end was being written when the study was killed, and is none."""
        path = self.directory / "journal.jsonl"
        if not path.is_file():
            return None
        lines = load.read_text(path).split("\n")
        return [_event(load.parse(line, path, number), path, number) for number, line in enumerate(lines[:-1], start=1) if line.strip()]

    @cached_property
    def figures(self) -> list[tuple[str, dict[str, Any]]]:
        """File and content of what lies beside each figure: in figures/, in the folder itself, and in those one below it, where
        others of the programs here may have drawn (whatif, trace, compare)."""
        found = []
        for path in sorted({path for pattern in FIGURE_PLACES for path in self.directory.glob(pattern)}):
            if not any(path.with_suffix(kind).is_file() for kind in PICTURES):
                continue  # others' JSON is no figure's
            # Elsewhere than in figures/ data may lie beside a picture of its name: a trace and its heat map.
            if path.parent.name == "figures" or sidecars.is_one(path):
                found.append((str(path.relative_to(self.directory)), sidecars.read(path)))
        return found

    def source(self, file: str, figure: dict[str, Any]) -> Path | None:
        """What a figure was drawn from; None where that is not said, or not here."""
        said = figure.get("source", sidecars.RECORDS if file.startswith("figures/") else "")
        path = Path(os.path.normpath((self.directory / file).parent / said))  # figures/ need not be there before a report is written
        return path if said and path.is_file() else None

    @cached_property
    def undescribed(self) -> list[str]:
        """Pictures in figures/ that nothing beside them describes; elsewhere there are pictures that are no figures."""
        inner = "" if self.directory.resolve().name == "figures" else "figures/"
        described = {file for file, _ in self.figures}
        pictures = sorted(path for kind in PICTURES for path in self.directory.glob(f"{inner}*{kind}"))
        alone = [path for path in pictures if f"{inner}{path.stem}.json" not in described]
        return [f"{inner}{path.name}" for path in {path.stem: path for path in reversed(alone)}.values()]  # one a name

    def record(self, record: Record, severity: str, problem: str, remedy: str) -> Finding:
        return Finding(severity, f"records.jsonl:{record.line}", record.name, problem, remedy)

    def context(self, key: str, severity: str, problem: str, remedy: str) -> Finding:
        return Finding(severity, "context.json", key, problem, remedy)


def _event(event: dict[str, Any], path: Path, line: int) -> dict[str, Any]:
    """An event whose fields that rules read are of their types."""
    fields: dict[str, Callable[[Any], bool]] = {"event": lambda value: isinstance(value, str)}
    if event.get("event") in ("sample", "verify"):
        fields["id"] = lambda value: isinstance(value, str)
    if event.get("event") == "sample":
        fields["block"] = fields["launch"] = lambda value: isinstance(value, int) and not isinstance(value, bool)
    for key, is_right in fields.items():
        if not is_right(event.get(key)):
            raise InputError(path, f"{event.get(key)!r} is not what `rasterbench study` writes", line, key)
    return event


def lint(analysis: Analysis, figures: dict[str, bytes] | None = None) -> Result:
    """figures: what a report is about to write into figures/; without it the files that are there are read."""
    folder = Folder(analysis, analysis.study.directory)
    if figures is not None:
        folder.undescribed = []  # report.py removes what it no longer draws
        folder.figures = [(f"figures/{name}", json.loads(content)) for name, content in sorted(figures.items()) if name.endswith(".json")]
    return _judge(folder)


def lint_directory(directory: Path) -> Result:
    """The folder of a study; or one without a study, with the figures of adopt, whatif, trace, stability or compare. Throws
    InputError where there is neither."""
    if not directory.is_dir() or any((directory / name).exists() for name in STUDY_FILES):
        return lint(Analysis(load.load(directory)))
    folder = Folder(None, directory)
    if not folder.figures and not folder.undescribed:
        raise InputError(directory, "holds neither a study (context.json, records.jsonl) nor a figure")
    return _judge(folder)


def _judge(folder: Folder) -> Result:
    from .lint_rules import RULES

    verdicts = []
    for rule in RULES:
        hidden = rule.why_not
        if folder.found is None and rule.needs != "figures":
            hidden = hidden or "no study is here"
        elif rule.needs == "journal" and folder.journal is None:
            hidden = "journal.jsonl is not here"
        elif rule.needs == "figures" and not folder.figures and not folder.undescribed:
            hidden = "no figures are here: run `python3 -m analysis report` first"
        verdicts.append(Verdict(rule, [] if hidden or rule.check is None else list(rule.check(folder)), hidden))
    return Result(folder.directory, verdicts)


def plain(result: Result, most: int = 5) -> str:
    """Every rule with its verdict; below it what breaks it, alike findings counted."""
    lines = []
    for verdict in result.verdicts:
        lines.append(f"{verdict.words:<17} {verdict.rule.id:<16} {verdict.rule.text}" + (f" ({verdict.hidden})" if verdict.hidden else ""))
        for finding, many in merged(verdict.findings)[:most]:
            more = f", and {text.count(many - 1, 'more like it', 'more like it')}" if many > 1 else ""
            lines += [f"    {finding.severity}: {finding.file}: {finding.place}: {finding.problem}{more}", f"           -> {finding.remedy}"]
        left = len(merged(verdict.findings)) - most
        if left > 0:
            lines.append(f"    and {text.count(left, 'other finding')}: see --json")
    return "\n".join([*lines, "", summary(result)])


def summary(result: Result) -> str:
    counts = Counter(verdict.words for verdict in result.verdicts)
    words = ", ".join(f"{counts[word]} {word}" for word in (KEPT, NOTED, BROKEN, NOT_VISIBLE) if counts[word])
    broken = [verdict.rule.id for verdict in result.verdicts if verdict.words == BROKEN]
    end = f"Not fit to be published: {text.listing(broken, len(broken))}." if broken else "Nothing here forbids publishing."
    return f"{len(result.verdicts)} rules: {words}. {end}"


def merged(findings: list[Finding]) -> list[tuple[Finding, int]]:
    """The first of those that differ in nothing but their place, with how many there are; the grave ones first."""
    groups: dict[tuple, list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.severity, finding.file.split(":")[0], finding.remedy), []).append(finding)
    return sorted(((group[0], len(group)) for group in groups.values()), key=lambda item: item[0].severity != GRAVE)


def as_json(result: Result) -> str:
    return json.dumps({"directory": str(result.directory), "status": result.status, "summary": summary(result),
                       "rules": [{"id": v.rule.id, "text": v.rule.text, "verdict": v.words, "hidden": v.hidden or None,
                                  "findings": [asdict(f) for f in v.findings]} for v in result.verdicts]}, indent=1)
