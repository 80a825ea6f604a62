"""Whole reports: of ordinary studies, of odd ones and of studies without a single time."""

from __future__ import annotations

import html.parser
import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import matplotlib.image
import pandas as pd
import pytest

from .. import __main__ as program
from .. import checks, findings, latex, report, tables, writing
from ..figures.balance import imbalance
from . import synthetic
from .conftest import FEW, analyse

ROOT = Path(__file__).resolve().parents[2]


class Links(html.parser.HTMLParser):
    VOID = {"meta", "img", "br", "link", "input", "hr"}

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.tags: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.found += [value for name, value in attributes if name in ("src", "href", "srcset", "data", "action")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def parse(path: Path) -> tuple[str, Links]:
    page = path.read_text(encoding="utf-8")
    links = Links()
    links.feed(page)
    assert links.open == []
    return page, links


def prints_three(capsys, directory, *more) -> list[str]:
    assert program.main(["report", str(directory), *more]) == 0
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert err == "" and len(lines) == 4 and lines[0].startswith("report: ")
    return lines[1:]


def test_report_is_self_contained(full):
    directory, _, written = full
    page, links = parse(written.path)
    assert links.found and all(link.startswith(("data:image/", "#")) for link in links.found)
    assert {link[1:] for link in links.found if link.startswith("#")} <= set(re.findall(r' id="([^"]+)"', page))
    assert "script" not in links.tags and "link" not in links.tags and "@import" not in page and not re.search(r"url\((?!#)", page)
    assert 'name="viewport"' in page and "@media print" in page and page.startswith("<!DOCTYPE html>")
    assert "<b>not html</b>" not in page and "&lt;b&gt;not html" in page


def test_report_says_what_it_must(full):
    directory, analysis, written = full
    page, _ = parse(written.path)
    for words in ("Which strategy &amp; schedule is fastest?", "points planned", "does not conform: 12 pixels", "--oversubscribe",
                  "not publishable", "one launch", "Example CPU 9000", "-O3", "0123abc", "How to read it", "within its bound",
                  "Base (a)", "base (b)", "Recorded context", "Holm"):
        assert words in page, words
    for finding in written.findings:
        assert finding.text in page


@pytest.mark.parametrize("kind", ["scenes", "time_teapot", "scaling_teapot", "scaling_by_execution", "schedules_", "stages_", "balance_"])
def test_figures_exist_in_all_formats(full, kind):
    directory, _, _ = full
    names = [p.stem for p in (directory / "figures").glob("*.svg") if p.stem.startswith(kind)]
    assert names
    for name in names:
        svg, png, pdf = (directory / "figures" / f"{name}.{end}" for end in ("svg", "png", "pdf"))
        root = ElementTree.parse(svg).getroot()
        assert root.tag.endswith("svg") and svg.stat().st_size > 5000
        assert not re.search(r'href="(?!#|data:)', svg.read_text())
        assert pdf.read_bytes().startswith(b"%PDF") and pdf.stat().st_size > 5000
        image = matplotlib.image.imread(png)
        assert image.shape[1] <= 1100 and image.shape[0] <= 1500 and image[..., :3].std() > 0.01
        # Nothing runs off the page: the outermost pixels are white.
        for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
            assert edge[..., :3].min() > 0.99, name


def test_output_is_deterministic(study, capsys, published_fonts):
    directory = study()
    prints_three(capsys, directory)
    assert all(b"/CIDFontType2" in path.read_bytes() and b"/Type3" not in path.read_bytes() for path in directory.glob("figures/*.pdf"))
    first = {p.name: p.read_bytes() for p in directory.rglob("*") if p.is_file()}
    prints_three(capsys, directory)
    assert first == {p.name: p.read_bytes() for p in directory.rglob("*") if p.is_file()}


def test_failed_points_show_no_speed(full):
    directory, _, _ = full
    frame = pd.read_csv(directory / "tables" / "points_teapot_640x360_f32.csv")
    failed = frame[frame.status == "failed"]
    assert len(failed) == 1
    assert failed[[c for c in frame if "median" in c or "speedup" in c or "over_fastest" in c]].isna().all(axis=None)


def test_tables_agree_with_the_records(full):
    directory, analysis, _ = full
    frame = pd.concat(pd.read_csv(p) for p in (directory / "tables").glob("points_*.csv")).set_index("id")
    assert len(frame) == len(analysis.study.records)
    for record in analysis.study.timed:
        row = frame.loc[record.id]
        assert row.median_ms == pytest.approx(record.recorded_median)
        assert (row.median_ms_low, row.median_ms_high) == pytest.approx(record.recorded_interval)
        if record.config.threads > 1:
            assert row.efficiency == pytest.approx(row.speedup_b / record.config.threads)
    assert not any("differs from what their samples give" in warn.text for warn in checks.check(analysis))


def test_bases_are_named(full):
    _, analysis, _ = full
    for record in analysis.study.timed:
        base = analysis.serial_base[record.id]
        assert base.config.backend == "serial" and base.config.scene == record.config.scene
        own = analysis.thread_base[record.id]
        assert own is None or (own.config.threads == 1 and own.config.kernel == record.config.kernel)


@pytest.mark.parametrize("changes, present, absent", [
    (dict(threads=[2]), "speedup_teapot_640x360_f32", "scaling_teapot_640x360_f32"),
    (dict(threads=[1, 2]), "scaling_teapot_640x360_f32", "speedup_teapot_640x360_f32"),
    (dict(launches=4, blocks=5), "time_teapot_640x360_f32", "nothing"),
    (dict(launches=5, blocks=4), "time_teapot_640x360_f32", "nothing"),
    (dict(blocks=3), "time_teapot_640x360_f32", "nothing"),
    (dict(blocks=1), "time_teapot_640x360_f32", "nothing"),
    (dict(threads=[1, 2, 4, 8, 16]), "scaling_teapot_640x360_f32", "nothing"),
])
def test_kinds_of_studies(study, capsys, changes, present, absent):
    directory = study(**changes)
    prints_three(capsys, directory)
    assert (directory / "figures" / f"{present}.svg").exists()
    assert not (directory / "figures" / f"{absent}.svg").exists()
    page, _ = parse(directory / "report.html")
    assert ("at least 5, because" in page) == (changes.get("launches", 1) < 5)
    if changes.get("threads") == [2]:
        assert "one thread count (2)" in page
    if changes.get("launches") == 5:
        assert "bootstrap over launches, then blocks" in page


def test_all_skipped(study, capsys):
    def skip(records):
        for entry in records:
            synthetic.withhold(entry, "skipped", "time limit of the study reached <soon>")
            entry["verify"] = None

    directory = study(edit=skip)
    lines = prints_three(capsys, directory)
    assert any("nothing can be said" in line for line in lines)
    page, _ = parse(directory / "report.html")
    assert "reached &lt;soon&gt;" in page and "No point was verified" in page
    assert program.main(["table", str(directory)]) == 0
    assert "skipped: time limit" in capsys.readouterr().out


def test_single_record(study, capsys):
    directory = study(kernels=["scanline"], untimed=False)
    lines = prints_three(capsys, directory)
    assert "compared with nothing" in lines[0] and not any("faster" in line for line in lines)


def test_bare_records_give_a_report(study, capsys):
    """What a record may lack: stages, per-thread times, work, oracle, a picture; and what a context may lack."""
    def strip(records):
        for entry in records:
            for key in ("stages_ms", "per_thread", "work", "interval_ms", "median_ms", "p95_ms", "stop", "threads_observed"):
                entry.pop(key, None)
            entry["verify"] = {"conforms": entry["status"] == "ok"}

    directory = study(edit=strip, threads=[2], kernels=["bounding_box", "tile_parallel"])
    (directory / "context.json").write_text(json.dumps({"schema": 1, "program": {}, "machine": {}, "study": {}}))
    prints_three(capsys, directory)
    page, _ = parse(directory / "report.html")
    assert "not recorded" in page and "says nothing of" in page


def test_no_serial_kernel(study, capsys):
    def parallel_only(records):
        records[:] = [entry for entry in records if entry["config"]["backend"] != "serial"]

    directory = study(edit=parallel_only, threads=[2])
    prints_three(capsys, directory)
    page, _ = parse(directory / "report.html")
    assert "no base (a)" in page and "no base (b)" in page


def test_warnings(study):
    def spoil(records):
        for entry in records:
            entry["config"]["binding"] = "none"
            if len(entry["per_thread"]) > 1:
                entry["per_thread"][1]["busy_ms"] = 0.0
        records[0]["stop"] = "time_limit"
        records[0]["median_ms"] = 1e3
        records[1]["threads_observed"] = 0

    directory = study(edit=spoil)
    path = directory / "context.json"
    context = json.loads(path.read_text())
    context["program"]["dirty"] = True
    context["machine"]["load_average"] = "7.25 3.1 2.0"
    context["images"]["lost"] = "../../etc/passwd"
    path.write_text(json.dumps(context))
    said = " ".join(warn.text for warn in checks.check(analyse(directory)))
    for words in ("dirty commit", "load average 7.25", "not pinned", "stopped by the time limit of the study", "no picture found for lost",
                  "differs from what their samples give", "fewer threads ran", "no cpufreq", "next to nothing"):
        assert words in said, words


def test_axes_that_would_share_a_name_are_said(study):
    def tiles(records):
        for entry in [e for e in records if e["config"]["kernel"] == "tile_parallel"]:
            twin = json.loads(json.dumps(entry))
            twin["config"]["tile"], twin["id"] = 64, entry["id"][::-1]
            records.append(twin)

    analysis = analyse(study(edit=tiles))
    names = {(g.key, analysis.label(r)) for g in analysis.groups for r in g.records}
    assert len(names) == len(analysis.study.records)
    assert any("tile 64" in name for _, name in names)


def test_out_and_stale_files(study, capsys, tmp_path):
    directory = study(threads=[1, 2])
    (directory / "figures").mkdir()
    (directory / "figures" / "mine.png").write_bytes(b"kept")
    out = tmp_path / "else where" / "page.html"
    prints_three(capsys, directory, "--out", str(out))
    assert out.exists() and not (directory / "report.html").exists()
    assert (directory / "figures" / "scaling_teapot_640x360_f32.svg").exists()
    study(threads=[2])
    prints_three(capsys, directory)
    assert not (directory / "figures" / "scaling_teapot_640x360_f32.svg").exists()
    assert (directory / "figures" / "mine.png").read_bytes() == b"kept"
    assert not list(directory.rglob(".*.tmp")) and not [p for p in directory.rglob(".*") if p.name != writing.MANIFEST]


def test_a_failed_write_keeps_the_old_report(study, capsys, monkeypatch):
    directory = study(threads=[2])
    prints_three(capsys, directory)
    before = (directory / "report.html").read_bytes()
    monkeypatch.setattr(report, "render", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    assert program.main(["report", str(directory)]) == 2
    assert "No space left" in capsys.readouterr().err
    assert (directory / "report.html").read_bytes() == before


def test_table_command(full, capsys):
    directory, analysis, _ = full
    assert program.main(["table", str(directory)]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") > len(analysis.study.records)
    assert "failed: does not conform" in out and "fastest" in out
    assert max(map(len, out.splitlines())) < 140


def test_module_runs_from_the_root(study):
    done = subprocess.run([sys.executable, "-m", "analysis", "table", str(study())], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == ""


def test_latex_escapes():
    assert latex.escape(r"a_b & 5% $x$ #1 {y} ~^\ <>") == (
        r"a\_b \& 5\% \$x\$ \#1 \{y\} \textasciitilde{}\textasciicircum{}\textbackslash{} \textless{}\textgreater{}")
    made = latex.table(pd.DataFrame({"k_n": ["[1, 2]"], "ms": ["3"]}), "50 % & more", "tab:x")
    assert r"{[1, 2]} & 3 \\" in made and r"50 \% \& more" in made and r"\toprule" in made and "{lr}" in made


def test_latex_tables_are_balanced(full):
    directory, _, _ = full
    files = list((directory / "tables").glob("*.tex"))
    assert len(files) >= 6
    for path in files:
        source = path.read_text()
        assert source.count(r"\begin") == source.count(r"\end{")
        body = [line for line in source.splitlines() if line.endswith(r"\\") and "caption" not in line]
        assert len({len(re.findall(r"(?<!\\)&", line)) for line in body}) == 1
        assert not re.search(r"(?<!\\)_", re.sub(r"\\label\{[^}]*\}", "", source))


def test_over_scenes_divides_sums(full):
    _, analysis, _ = full
    table = tables.over_scenes(analysis).numbers.set_index(["kernel", "execution", "threads"])
    row = table.loc[("tile_parallel", "openmp dynamic,1", 2)]
    found = [analysis.estimates[r.id].value for r in analysis.study.timed if r.config.kernel == "tile_parallel"
             and analysis.execution(r) == "openmp dynamic,1" and r.config.threads == 2]
    assert row.sum_of_medians_ms == pytest.approx(sum(found))
    assert row.frames_per_second_harmonic == pytest.approx(2000 / sum(found))
    assert row.speedup_of_sums_low <= row.speedup_of_sums <= row.speedup_of_sums_high


def test_imbalance(full):
    _, analysis, _ = full
    record = next(r for r in analysis.study.timed if len(r.per_thread) == 4 and r.config.schedule == "static")
    assert imbalance(record) == pytest.approx(1.25 * 4 / 4.25)
    assert imbalance(next(r for r in analysis.study.timed if len(r.per_thread) == 1)) is None


def test_many_schedules_stay_in_page_height(study):
    many = [("openmp", "dynamic", 2**i) for i in range(1, 12)] + FEW
    analysis = analyse(study(schedules=many))
    from ..figures import draw

    for drawing in draw(analysis):
        width, height = drawing.figure.get_size_inches()
        assert width <= 7.0 and height <= 9.6, drawing.name
    assert len(findings.top(analysis)) == 3


def test_numeric_modes_of_one_scene_share_a_figure(study, capsys):
    def modes(records):
        for numeric in ("f64", "fixed_8"):
            for entry in [e for e in records if e["config"]["kernel"] == "scanline" and e["config"]["numeric"] == "f32"]:
                twin = json.loads(json.dumps(entry))
                twin["config"]["numeric"], twin["id"] = numeric, numeric + entry["id"]
                records.append(twin)

    directory = study(edit=modes)
    prints_three(capsys, directory)
    names = {p.stem for p in (directory / "figures").glob("*.svg")}
    assert "numerics_teapot_640x360" in names and "time_teapot_640x360_f32" in names
    assert "time_teapot_640x360_f64" not in names  # one point: drawn beside its like
    assert (directory / "tables" / "points_teapot_640x360_f64.csv").exists()


def test_long_scene_names_keep_their_files_apart(study, capsys):
    name = "confetti:triangles=20000,size=16,distribution=heavy,seed=7,and=more"

    def rename(records):
        for entry in records:
            entry["config"]["scene"] = name
        for entry in [json.loads(json.dumps(e)) for e in records]:
            entry["config"]["fill"], entry["id"] = "closed", "c" + entry["id"]
            records.append(entry)

    directory = study(edit=rename, threads=[2])
    prints_three(capsys, directory)
    assert len(list((directory / "tables").glob("points_*.csv"))) == 2
    assert all(len(p.name) < 100 for p in (directory / "figures").iterdir())
