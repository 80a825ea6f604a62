"""Assembles figures, tables, findings and warnings into one self-contained HTML file."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable

import jinja2
import matplotlib
from markupsafe import Markup

from . import (__version__, checks, figures, findings, hypotheses, inline_svg, ladder, lint, lost_time, nodes, sidecars, stage_efficiency, strategy_map, style, tables, text,
               trade, trade_tables, trade_text, weak, work, writing)
from .captions import Caption
from .comparison import Analysis
from .figures.common import drawn_together
from .findings import Finding
from .statistics import intervals, numbers
from .tables import Table

MANY_SMALL = 6  # groups of few points; the tables of more are in tables/ only


@dataclass(frozen=True)
class Embedded:
    name: str
    number: int
    picture: Markup  # <svg>, or <img> of a figure that is made of pixels
    caption: Caption


@dataclass(frozen=True)
class Written:
    path: Path
    findings: list[Finding]


def write(analysis: Analysis, out: Path | None = None) -> Written:
    """Everything is made before anything is written; the report, which needs the rest, comes last."""
    directory = analysis.study.directory
    files: dict[str, bytes] = {}
    sections: dict[str, list[Embedded]] = {}
    page = inline_svg.Page()
    with matplotlib.rc_context(style.RC):
        for number, drawing in enumerate(figures.draw(analysis), start=1):
            made = sidecars.files(drawing, analysis.study.records_hash)
            files |= made
            picture = image(made[f"{drawing.name}.png"], drawing.caption.title) if drawing.raster else page.figure(drawing.figure, drawing.caption.title)
            sections.setdefault(drawing.section, []).append(Embedded(drawing.name, number, picture, drawing.caption))
    found = [t for module in (hypotheses, nodes, tables, trade_tables, ladder, strategy_map, work, weak, stage_efficiency, lost_time) for t in module.tables(analysis)]
    for table in found:
        if table.section:
            sections.setdefault(table.section, [])  # a section may have tables and no figure
    top = findings.top(analysis)
    html = render(analysis, page, sections, found, top, lint.lint(analysis, files))
    path = out if out is not None else directory / "report.html"
    captions = "".join(f"Figure {e.number} ({e.name}): {e.caption.plain}\n\n" for es in sections.values() for e in es)
    writing.refuse_inputs([path], [directory / name for name in ("records.jsonl", "context.json", "journal.jsonl")])
    writing.write_folder(directory / "figures", files | ({"captions.txt": captions.encode()} if captions else {}), "report")
    writing.write_folder(directory / "tables", {f"{t.name}.csv": t.csv() for t in found} | {f"{t.name}.tex": t.tex() for t in found}, "report")
    writing.write(path, html)
    return Written(path, top)


def image(png: bytes, name: str) -> Markup:
    return Markup('<img src="data:image/png;base64,{}" alt="{}">').format(base64.b64encode(png).decode("ascii"), name)


def render(analysis: Analysis, page: inline_svg.Page, sections: dict[str, list[Embedded]], found: list[Table], top: list[Finding],
           rules: lint.Result) -> str:
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True,
                                     undefined=jinja2.StrictUndefined, trim_blocks=False)
    study, hidden = analysis.study, small_tables(analysis)
    about = study.context["study"]
    return environment.get_template("report.html.j2").render(
        page=page, title=study.name, question=about.get("question") or "", findings=top, warnings=checks.check(analysis),
        rules=rules, rules_summary=lint.summary(rules), merged=lint.merged,
        counts=counts(analysis), run_facts=run_facts(analysis), machine_facts=machine_facts(study.context),
        placed_tables=placed(found, hidden), hidden=len(hidden), section_words={trade.SECTION: trade_text.summary(analysis)},
        section_tables=by_section(found), claimed=[item for item in sections.items() if item[0] == hypotheses.SECTION],
        sections=[item for item in sections.items() if item[0] != hypotheses.SECTION], context=recorded(study.context), cell_class=cell_class,
        trade_section=f"\u201c{trade.SECTION}\u201d",
        version=__version__, records=f"{text.count(len(study.every_record), 'record')} in {study.directory.name}/records.jsonl",
        min_launches=intervals.MIN_LAUNCHES)


def small_tables(analysis: Analysis) -> set[str]:
    """Names of the tables of groups that have no figures of their own, where a study has many: with 25 numeric modes on five
    scenes 250 tables of two rows would bury the others."""
    small = [group for group in analysis.groups if drawn_together(analysis, group)]
    return {f"{kind}_{group.slug}" for group in small for kind in ("points", "matrix")} if len(small) > MANY_SMALL else set()


def placed(found: list[Table], hidden: set[str]) -> dict[str, list[Table]]:
    """Where each table stands: what was run, verification, results, or folded because it is long."""
    places: dict[str, list[Table]] = {"run": [], "verification": [], "results": [], "long": []}
    for table in found:
        if table.section or table.name in hidden:
            continue
        kind = ("run" if table.name in ("not_timed", "nodes") else "verification" if table.name == "verification" else
                "long" if table.name in ("stages", "over_scenes") and len(table.words) > 12 else "results")
        places[kind].append(table)
    # The overview comes before the table that has everything.
    places["results"].sort(key=lambda table: not table.name.startswith("matrix"))
    return places


def by_section(found: list[Table]) -> dict[str, list[Table]]:
    sections: dict[str, list[Table]] = {}
    for table in found:
        sections.setdefault(table.section, []).append(table)
    return sections


def cell_class(cell: object) -> Markup:
    words = str(cell)
    if words.startswith(("failed", "skipped")):
        return Markup(' class="untimed long"') if len(words) > 30 else Markup(' class="untimed"')
    return Markup(' class="long"') if len(words) > 44 else Markup("")


def counts(analysis: Analysis) -> list[tuple[str, int]]:
    records = analysis.study.every_record
    planned = analysis.study.context["points"].get("planned")
    return [("points planned", planned if isinstance(planned, int) else len(records)),
            ("timed", sum(r.ok for r in records)),
            ("skipped", sum(r.status == "skipped" for r in records)),
            ("failed", sum(r.status == "failed" for r in records))]


def said(value: Any) -> str:
    """A recorded value as words; what was not recorded is called that."""
    if value in (None, "", [], {}):
        return "not recorded"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(f"{key} {said(item)}" for key, item in value.items())
    if isinstance(value, list):
        return ", ".join(map(said, value))
    return str(value)


def run_facts(analysis: Analysis) -> list[tuple[str, str]]:
    context, timed = analysis.study.context, analysis.study.timed
    study = context["study"]
    stops: dict[str, int] = {}
    for record in timed:
        stops[record.stop or "not recorded"] = stops.get(record.stop or "not recorded", 0) + 1
    facts = [("study file", said(study.get("file"))), ("shard", said(study.get("shard"))), ("started", said(context.get("started"))),
             ("finished", said(context.get("finished"))), ("a sample times", said(context.get("region"))),
             ("sampling", said(study.get("sampling")))]
    if timed:
        launches = sorted({r.samples.launch_count for r in timed})
        facts += [("samples a point", text.span([r.samples.n for r in timed])),
                  ("launches a point", ", ".join(map(str, launches))),
                  ("stopped by", ", ".join(f"{name} ({many})" for name, many in stops.items()))]
    facts += noise_facts(context)
    facts += [(f"custom: {key}", said(value)) for key, value in context["custom"].items()]
    return facts


def noise_facts(context: dict[str, Any]) -> list[tuple[str, str]]:
    """What the study saw of the machine between its blocks."""
    noise = context.get("noise")
    if not isinstance(noise, dict):
        return [("noise while sampling", "not recorded")]

    def spread(key: str, say: Callable[[float], str]) -> str:
        value = noise.get(key)
        if not isinstance(value, dict) or not all(numbers.is_number(value.get(k)) for k in ("median", "worst")):
            return said(value)
        return f"{say(value['median'])} in the median, {say(value['worst'])} at worst"

    facts = [("CPUs that others kept busy", spread("other_load_cpus", text.number)), ("CPU time stolen", spread("steal_share", text.percent)),
             ("load average while sampling", spread("load_average", text.number)), ("frequency of the fastest CPU, MHz", said(noise.get("frequency_mhz"))),
             ("throttled", said(noise.get("throttled")))]
    facts = [(name, words) for name, words in facts if words != "not recorded"]  # merged studies have their parts' in parts
    remarks = noise.get("remarks")
    return facts + ([("remarks on noise", said(remarks))] if remarks else [])


def machine_facts(context: dict[str, Any]) -> list[tuple[str, str]]:
    machine, program = context["machine"], context["program"]
    caches = machine.get("caches")
    if isinstance(caches, list) and all(isinstance(c, dict) for c in caches):
        caches = [f"L{c.get('level')} {_bytes(c.get('size_bytes'))} shared by {said(c.get('shared_by'))}" for c in caches]
    allowed = machine.get("cpus_allowed")
    cpus = f"{said(machine.get('cpus_online'))} online"
    cpus += f", {len(allowed)} allowed" if isinstance(allowed, list) else ""
    commit = said(program.get("commit")) + (" (dirty)" if program.get("dirty") else "")
    return [("host", said(machine.get("hostname"))), ("CPU", said(machine.get("cpu"))), ("CPUs", cpus),
            ("cores, packages, NUMA nodes", ", ".join(said(machine.get(k)) for k in ("cores", "packages", "numa_nodes"))),
            ("SMT", said(machine.get("smt"))), ("caches", said(caches)), ("memory", _bytes(machine.get("memory_bytes"))),
            ("governor", said(machine.get("governor"))), ("load average", said(machine.get("load_average"))),
            ("kernel", said(machine.get("kernel"))), ("virtualisation", said(machine.get("virtualisation"))),
            ("program", f"{said(program.get('version'))}, commit {commit}"),
            ("compiler", f"{said(program.get('compiler'))}, {said(program.get('build_type'))}"), ("flags", said(program.get("flags"))),
            ("libraries", said(context["libraries"])),
            ("environment", said(context["environment"]) if context["environment"] else "no variable of OpenMP or TBB set")]


def _bytes(value: Any) -> str:
    if not numbers.is_number(value):
        return said(value)
    for unit, size in (("GiB", 2**30), ("MiB", 2**20), ("KiB", 2**10)):
        if value >= size:
            return f"{value / size:.4g} {unit}"
    return f"{value:g} bytes"


def recorded(context: dict[str, Any]) -> list[tuple[str, str]]:
    """The study file as it was written, then the whole context."""
    parts = []
    source = context["study"].get("text")
    if isinstance(source, str) and source:
        parts.append(("The study file", source))
    rest = {**context, "study": {k: v for k, v in context["study"].items() if k != "text"}}
    parts.append(("Everything in context.json", json.dumps(rest, indent=2, ensure_ascii=False)))
    return parts
