"""lint: a clean study breaks nothing; each rule is broken by one change, and by that change no other rule is."""

from __future__ import annotations

import json
import shutil

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from .. import __main__ as program
from .. import checks, lint, lint_rules, sidecars, style
from ..captions import Caption
from ..figures.common import Drawing
from ..statistics import intervals
from . import synthetic, synthetic_modes
from .conftest import FEW, analyse

IDS = [rule.id for rule in lint_rules.RULES]


def floors(records):
    for entry in records:
        if entry["status"] == "ok":
            entry["floor_ms"] = 0.01


def write(directory, edit=None, **changes):
    def both(records):
        floors(records)
        if edit:
            edit(records)

    plan = synthetic.plan(**(dict(kernels=["bounding_box", "tile_parallel"], schedules=FEW[:1], threads=[1, 2], launches=6, blocks=10, noise=0.008,
                                  scenes={"teapot": synthetic.SCENES["teapot"]}, untimed=False, edit=both) | changes))
    synthetic.write(directory, plan)
    rewrite_context(directory, lambda context: None)
    return directory


def rewrite_context(directory, change):
    path = directory / "context.json"
    context = json.loads(path.read_text())
    change(context)
    path.write_text(json.dumps(context) + "\n")


def journal(directory, change=None):
    """A journal that agrees with the records, its blocks shuffled."""
    entries = [json.loads(line) for line in (directory / "records.jsonl").read_text().splitlines()]
    rng = np.random.default_rng(1)
    events = [{"event": "start"}] + [{"event": "verify", "id": entry["id"]} for entry in entries]
    for launch in range(6):
        for block in range(10):
            events += [{"event": "sample", "launch": launch, "block": block, "id": entries[i]["id"]} for i in rng.permutation(len(entries))]
    events = change(events, entries) if change else events
    (directory / "journal.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events))


def broken(directory, severity=None):
    """Rules that something breaks, or with a severity those that it breaks so."""
    return {v.rule.id for v in lint.lint(analyse(directory)).verdicts for f in v.findings if severity in (None, f.severity)}


def test_a_clean_study_breaks_nothing(tmp_path, capsys):
    directory = write(tmp_path / "a")
    journal(directory)
    assert program.main(["report", str(directory)]) == 0
    capsys.readouterr()
    assert program.main(["lint", str(directory)]) == 0
    out = capsys.readouterr().out
    assert "Nothing here forbids publishing" in out
    result = lint.lint(analyse(directory))
    assert result.findings == []
    assert {v.rule.id for v in result.verdicts if v.words == lint.NOT_VISIBLE} == {"exit"}
    assert all(rule_id in out for rule_id in IDS) and len(IDS) == len(set(IDS))
    page = (directory / "report.html").read_text()
    assert "Rules of measuring" in page and lint.summary(result) in page


def drop_serial(records):
    records[:] = [entry for entry in records if entry["config"]["backend"] != "serial"]


def other_blocks(records):
    for entry in records:
        if entry["config"]["backend"] == "serial":
            entry["blocks"] = [block + 100 for block in entry["blocks"]]


def slow_stages(entry):
    entry["stages_ms"]["raster"] = [1.2 * sample for sample in entry["samples_ms"]]


def one_block(entry):
    entry["blocks"][1] = entry["blocks"][0]


def outlier(entry):
    entry["samples_ms"][3] *= 5
    restate(entry)


def drift(entry):
    n = len(entry["samples_ms"])
    entry["samples_ms"] = (10 * np.linspace(1, 1.3, n)).tolist()
    restate(entry)
    entry["stop"] = "max_samples"
    entry["stages_ms"] = {stage: None for stage in entry["stages_ms"]}


def restate(entry):
    values = np.array(entry["samples_ms"])
    bounds = intervals.order_interval(values)
    entry.update(median_ms=float(np.median(values)), interval_ms=list(bounds), min_ms=float(values.min()), max_ms=float(values.max()),
                 p95_ms=None)


def outside(entry):
    entry["verify"].update(bound={"bounded": True}, oracle={"within_bound": False})


def first(change):
    """The change made to a parallel point on two threads."""
    return lambda records: change(next(entry for entry in records if entry["config"]["threads"] == 2))


@pytest.mark.parametrize("rule, severity, edit, also", [
    ("base-case", "note", drop_serial, ()),
    ("base-case", "grave", other_blocks, ()),
    ("two-verdicts", "grave", first(lambda r: r["verify"].update(conforms=None)), ()),
    ("two-verdicts", "grave", first(outside), ()),
    ("two-verdicts", "note", first(lambda r: r["verify"].update(oracle=None)), ()),
    ("means", "grave", first(lambda r: r.update(median_ms=1.5 * r["median_ms"])), ()),
    ("means", "note", first(lambda r: r.pop("median_ms")), ()),
    ("determinism", "grave", first(lambda r: r["work"].update(covered_pixels=7)), ()),
    ("determinism", "grave", first(lambda r: r["verify"].update(differing_pixels=7)), ()),
    ("confidence", "grave", first(lambda r: r.update(interval_ms=[0.1, 0.2])), ()),
    ("confidence", "grave", first(lambda r: r.update(launches=[0] * 60, blocks=list(range(60)))), ()),
    ("stopping", "grave", first(lambda r: r.pop("stop")), ()),
    ("stopping", "note", first(lambda r: r.update(stop="point_seconds")), ()),
    ("raw-data", "grave", first(lambda r: r.update(max_ms=r["max_ms"] / 2)), ()),
    ("raw-data", "note", first(lambda r: r.update(min_ms=None)), ()),
    ("blocks", "grave", first(one_block), ()),
    ("set-up", "grave", first(lambda r: r["config"].pop("scene_hash")), ("base-case",)),
    ("clock", "grave", first(lambda r: r.pop("frames_per_sample")), ()),
    ("clock", "grave", first(slow_stages), ()),
    ("set-up", "grave", first(lambda r: r.update(threads_observed=1)), ()),
    ("set-up", "grave", first(lambda r: r.update(context="another")), ()),
    ("set-up", "note", first(lambda r: r["config"].update(binding="none")), ("base-case",)),
    ("set-up", "note", first(lambda r: r["per_thread"][1].update(busy_ms=0.0)), ()),
    ("set-up", "note", first(lambda r: r.update(threads_observed=None)), ()),
    ("set-up", "note", first(lambda r: r.pop("placement")), ()),
    ("set-up", "note", first(lambda r: r["placement"].update(samples_sharing_core=3)), ()),
    ("set-up", "grave", first(lambda r: r["placement"].update(binding="thread 1 left its place")), ()),
    ("noise", "note", first(outlier), ()),
    ("noise", "note", first(drift), ("stopping",)),
    ("verification", "grave", first(lambda r: r["verify"].pop("checked_against")), ()),
    ("bounds", "note", first(lambda r: r.pop("floor_ms")), ()),
    ("bounds", "note", first(lambda r: r.update(floor_ms=1e6)), ()),
])
def test_one_change_breaks_one_rule(tmp_path, rule, severity, edit, also):
    directory = write(tmp_path / "a", edit)
    assert rule in broken(directory, severity)
    assert broken(directory) == {rule, *also}


def test_findings_name_file_point_and_remedy(tmp_path, capsys):
    directory = write(tmp_path / "a", first(lambda r: r.update(threads_observed=1)))
    assert program.main(["lint", str(directory), "--json"]) == 1
    value = json.loads(capsys.readouterr().out)
    (rule,) = [rule for rule in value["rules"] if rule["verdict"] == "broken"]
    (finding,) = rule["findings"]
    assert rule["id"] == "set-up" and finding["file"].startswith("records.jsonl:") and "/2" in finding["place"]
    assert "1 of 2 threads" in finding["problem"] and finding["remedy"]
    assert value["status"] == 1 and "set-up" in value["summary"]


def test_few_samples(tmp_path):
    assert {"confidence", "comparison"} <= broken(write(tmp_path / "a", launches=1, blocks=3))
    assert broken(write(tmp_path / "b", first(lambda r: r.update(p95_ms=9.0)), blocks=9)) == {"confidence"}
    assert "stopping" in broken(write(tmp_path / "c", noise=0.2), "grave")  # "target", and the interval is far wider


def test_a_base_that_was_sampled_on_after_its_target(tmp_path):
    def noisy_end(entry):
        calm, rng = np.full(12, 10.0), np.random.default_rng(2)
        entry["samples_ms"] = [*calm, *(10 * np.exp(rng.normal(0, 0.5, 48)))]
        entry["stages_ms"] = {stage: None for stage in entry["stages_ms"]}
        restate(entry)

    assert "stopping" not in broken(write(tmp_path / "a", first(noisy_end)))


@pytest.mark.parametrize("rule, severity, change", [
    ("subsets", "grave", lambda c: c["points"].update(planned=99)),
    ("subsets", "grave", lambda c: c["points"].pop("skipped")),
    ("clock", "grave", lambda c: c.pop("region")),
    ("set-up", "grave", lambda c: c["program"].update(dirty=True)),
    ("set-up", "grave", lambda c: c["program"].pop("flags")),
    ("set-up", "grave", lambda c: c["program"].pop("build_id")),
    ("set-up", "grave", lambda c: c.pop("libraries")),
    ("set-up", "grave", lambda c: c.pop("environment")),
    ("set-up", "grave", lambda c: c["machine"].update(governor="")),
    ("noise", "grave", lambda c: c["machine"].pop("load_average")),
    ("noise", "note", lambda c: c["machine"].update(load_average=[3.5, 1, 1])),
    ("noise", "note", lambda c: c.pop("noise")),
    ("noise", "note", lambda c: c["noise"].update(warnings=["other programs kept 0.5 CPUs busy"])),
])
def test_contexts(tmp_path, rule, severity, change):
    directory = write(tmp_path / "a")
    rewrite_context(directory, change)
    assert broken(directory, severity) == {rule} == broken(directory)


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    directory = write(tmp_path_factory.mktemp("reported") / "a")
    assert program.main(["report", str(directory)]) == 0
    return directory


def unshuffled(events, entries):
    place = {entry["id"]: i for i, entry in enumerate(entries)}
    return sorted(events, key=lambda e: (e["event"] == "sample", e.get("launch", 0), e.get("block", 0), place.get(e.get("id"), 0)))


@pytest.mark.parametrize("rule, change", [
    ("journal", lambda events, entries: events[:-1]),
    ("order", unshuffled),
    ("verified-first", lambda events, entries: [e for e in events if e.get("id") != entries[3]["id"] or e["event"] != "verify"]),
    ("journal", lambda events, entries: [*events, {"event": "verify", "id": "lost"}, {"event": "sample", "launch": 0, "block": 0, "id": "lost"}]),
])
def test_journals(tmp_path, rule, change):
    directory = write(tmp_path / "a")
    assert broken(directory) == set()
    journal(directory)
    assert broken(directory) == set()
    journal(directory, change)
    assert broken(directory, "grave") == {rule}


def test_rules_of_the_journal_are_not_visible_without_one(tmp_path):
    directory = write(tmp_path / "a")
    hidden = {"journal", "order", "verified-first"}
    verdict = {v.rule.id: v.words for v in lint.lint(analyse(directory)).verdicts}
    assert {verdict[rule] for rule in hidden} == {lint.NOT_VISIBLE}
    journal(directory)
    verdict = {v.rule.id: v.words for v in lint.lint(analyse(directory)).verdicts}
    assert {verdict[rule] for rule in hidden} == {lint.KEPT}


def test_one_block_that_differs_does_not_hide_a_fixed_order(tmp_path):
    def nearly(events, entries):
        fixed = unshuffled(events, entries)
        places = [i for i, e in enumerate(fixed) if e["event"] == "sample" and (e["launch"], e["block"]) == (2, 3)]
        fixed[places[0]], fixed[places[1]] = fixed[places[1]], fixed[places[0]]
        return fixed

    directory = write(tmp_path / "a")
    journal(directory, nearly)
    assert broken(directory, "grave") == {"order"}


def test_two_points_have_the_same_order_by_chance(tmp_path):
    """Half of the pairs of blocks do: that is no fixed order."""
    directory = write(tmp_path / "a", kernels=["scanline", "bounding_box"], schedules=[])
    journal(directory)
    assert "order" not in broken(directory)
    journal(directory, unshuffled)
    assert "order" in broken(directory)


@pytest.mark.parametrize("event, field", [({"event": "sample", "id": [1]}, "id"), ({"event": "verify", "id": 5}, "id"), ({}, "event"),
                                          ({"event": "sample", "id": "x", "block": 0, "launch": {}}, "launch"),
                                          ({"event": "sample", "id": "x", "block": "1", "launch": 0}, "block"), ({"event": []}, "event")])
def test_events_of_wrong_types(tmp_path, capsys, event, field):
    directory = write(tmp_path / "a")
    journal(directory, lambda events, entries: [*events, event])
    assert program.main(["lint", str(directory)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "journal.jsonl:" in err and f" {field}: " in err


def test_an_unavailable_load_is_recorded(tmp_path):
    directory = write(tmp_path / "a")
    rewrite_context(directory, lambda c: c["machine"].update(load_average="unavailable: no /proc"))
    assert broken(directory) == set()


def test_a_report_and_lint_are_of_one_mind(tmp_path):
    """What lint calls grave, the report calls not publishable."""
    for name, change in (("stop", lambda r: r.update(stop=None)), ("interval", lambda r: r.update(interval_ms=[1.0, 2.0])),
                         ("base", None)):
        directory = write(tmp_path / name, first(change) if change else other_blocks)
        assert broken(directory, "grave")
        assert checks.NOT_PUBLISHABLE in {warn.severity for warn in checks.check(analyse(directory))}, name


def test_an_interrupted_line_of_the_journal_is_none(tmp_path):
    directory = write(tmp_path / "a")
    journal(directory)
    with (directory / "journal.jsonl").open("a") as file:
        file.write('{"event": "sam')
    assert broken(directory) == set()


def test_a_half_written_file(tmp_path):
    directory = write(tmp_path / "a")
    path = directory / "records.jsonl"
    path.write_text(path.read_text().rstrip("\n"))
    assert broken(directory, "grave") == {"crash"}


@pytest.mark.parametrize("rule, change", [
    ("plot-caption", lambda f: f.update(facts=None)),
    ("plot-caption", lambda f: f["facts"].update(machine=None)),
    ("plot-caption", lambda f: f["facts"].update(samples=None)),
    ("plot-caption", lambda f: f["facts"].update(interval=None)),
    ("plot-base", lambda f: f["facts"].update(base=None)),
    ("plot-lines", lambda f: f.update(lines_across_categories=["x: kernels"])),
    ("plot-legible", lambda f: f.update(smallest_text_pt=4.0)),
    ("plot-legible", lambda f: f.update(size_inches=[9.0, 3.0])),
    ("plot-grey", lambda f: f.update(alike_in_grey=[["a", "b"]])),
    ("plot-current", lambda f: f.update(records="0")),
])
def test_figures(tmp_path, reported, rule, change):
    directory = shutil.copytree(reported, tmp_path / "a")
    path = next((directory / "figures").glob("scaling_*.json"))
    figure = json.loads(path.read_text())
    change(figure)
    path.write_text(json.dumps(figure))
    result = lint.lint(analyse(directory))
    expected = {rule} | ({"plot-base"} if figure["facts"] is None else set())
    assert {v.rule.id for v in result.verdicts if v.findings} == expected
    assert {f.file for f in result.findings} == {f"figures/{path.name}"}


def test_a_picture_that_nothing_describes(tmp_path, reported):
    directory = shutil.copytree(reported, tmp_path / "a")
    (directory / "figures/by_hand.png").write_bytes(b"")
    result = lint.lint(analyse(directory))
    assert [(v.rule.id, f.file) for v in result.verdicts for f in v.findings] == [("plot-caption", "figures/by_hand.png")]


def test_a_vector_picture_and_what_is_no_sidecar(tmp_path, reported):
    directory = shutil.copytree(reported, tmp_path / "a")
    (directory / "figures/numbers.json").write_text("[1]")  # no picture beside it: somebody's data
    (directory / "figures/by_hand.svg").write_text("")
    assert {f.file for f in lint.lint(analyse(directory)).findings} == {"figures/by_hand.svg"}


def test_a_report_on_accuracy_keeps_the_rules_of_figures(tmp_path):
    """Its axes are logarithms with labels of their own, such as 1,000."""
    plan = synthetic.plan(scenes={"layers": (20000, 60.0, [1280, 720])}, kernels=["bounding_box", "tile_parallel"], schedules=FEW[:1],
                          threads=[1], untimed=False, launches=5, blocks=3, edit=synthetic_modes.spread(synthetic_modes.MODES, hardness=(8.0,)))
    directory = synthetic.write(tmp_path / "a", plan)
    assert program.main(["report", str(directory)]) == 0
    pareto = [path for path in (directory / "figures").glob("pareto_*.json")]
    assert pareto and any(f.is_file() for f in pareto)
    found = [f for v in lint.lint(analyse(directory)).verdicts if v.rule.id == "plot-lines" for f in v.findings]
    assert found == []


def test_labels_with_thousands_are_numbers():
    assert not drawn(lambda axes: (axes.plot([0, 3], [1, 2]), axes.set_xticks([0, 3], ["1", "1,000"])))["lines_across_categories"]
    assert drawn(lambda axes: (axes.plot([0, 3], [1, 2]), axes.set_xticks([0, 3], ["a, b", "c"])))["lines_across_categories"]


@pytest.mark.parametrize("key, value", [("size_inches", "x"), ("facts", []), ("axes", None), ("alike_in_grey", [["a"]]), ("schema", 2),
                                        ("smallest_text_pt", "7"), ("lines_across_categories", 3), ("records", None), ("title", 1)])
def test_bad_sidecars(tmp_path, reported, capsys, key, value):
    directory = shutil.copytree(reported, tmp_path / "a")
    path = next((directory / "figures").glob("time_*.json"))
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    assert program.main(["lint", str(directory)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and f"{path.name}: {key}" in err


def drawn(plot):
    with matplotlib.rc_context(style.RC):
        figure = Figure(figsize=(3, 2))
        axes = figure.add_subplot()
        plot(axes)
        figure.draw_without_rendering()  # ticks have no labels before
        return sidecars.describe(Drawing("x", "s", figure, Caption("t", "b", "r")), "")


def test_sidecars_see_lines_across_categories():
    assert drawn(lambda axes: axes.plot(["static", "dynamic", "guided"], [1, 2, 3]))["lines_across_categories"]
    assert not drawn(lambda axes: axes.plot(["static", "dynamic", "guided"], [1, 2, 3], "o"))["lines_across_categories"]
    assert not drawn(lambda axes: axes.plot([1, 2, 4], [1, 2, 3]))["lines_across_categories"]
    assert not drawn(lambda axes: (axes.plot([1, 2], [0, 0]), axes.set_yticks([0, 1], ["static", "guided"])))["lines_across_categories"]


def test_sidecars_see_what_is_alike_in_grey():
    def pair(one, two):
        return lambda axes: (axes.plot([1, 2], [1, 2], label="a", **one), axes.plot([1, 2], [2, 1], label="b", **two), axes.legend())

    red, green = dict(color="#C00000"), dict(color="#008000")
    assert drawn(pair(red, green))["alike_in_grey"] == [["a", "b"]]
    assert drawn(pair(red | dict(marker="o"), green | dict(marker="s")))["alike_in_grey"] == []
    assert drawn(pair(red, green | dict(ls="--")))["alike_in_grey"] == []
    assert drawn(pair(red, dict(color="#FFC0C0")))["alike_in_grey"] == []


def test_sidecars_see_small_text():
    assert drawn(lambda axes: axes.text(0, 0, "x", fontsize=3))["smallest_text_pt"] == 3
    assert drawn(lambda axes: axes.text(0, 0, " ", fontsize=3))["smallest_text_pt"] > 5


def test_bad_input(tmp_path, capsys):
    assert program.main(["lint", str(tmp_path / "none")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    directory = write(tmp_path / "a")
    (directory / "journal.jsonl").write_text("{\n")
    assert program.main(["lint", str(directory)]) == 2
    assert "journal.jsonl:1" in capsys.readouterr().err


def openmp(change):
    """The change made to the first OpenMP point."""
    return lambda records: change(next(entry for entry in records if entry["config"]["backend"] == "openmp"))


def said_of_runtimes(directory):
    """Findings of the rule, and what the report says of it."""
    analysis = analyse(directory)
    (verdict,) = [v for v in lint.lint(analysis).verdicts if v.rule.id == "runtime"]
    return verdict.findings, [warn for warn in checks.check(analysis) if "untime" in warn.text]


def test_another_runtime_than_was_asked_for(tmp_path):
    directory = write(tmp_path / "a", openmp(lambda r: r.update(runtime_observed="libomp", config=r["config"] | {"runtime": "libgomp"})))
    findings, warnings = said_of_runtimes(directory)
    assert "libomp ran its loops, libgomp was asked for" in {f.problem for f in findings} and {f.severity for f in findings} == {"grave"}
    assert any("1 of" in w.text and w.severity == checks.NOT_PUBLISHABLE for w in warnings)


def test_the_programs_own_runtime_is_that_of_the_context(tmp_path):
    """All points by LLVM's runtime (a preloaded one, say), where the program has gcc's: one runtime, but not its own."""
    def edit(records):
        for entry in records:
            if entry["config"]["backend"] == "openmp":
                entry["config"]["runtime"], entry["runtime_observed"] = "default", "libomp"

    directory = write(tmp_path / "a", edit)
    findings, warnings = said_of_runtimes(directory)
    assert {f.problem for f in findings} == {"libomp ran its loops, libgomp, the program's own, was asked for"} and len(warnings) == 1
    for known in ("libomp 16", "differs between nodes: libgomp 201511; libomp 16"):  # of merged families: whose it was is not known
        rewrite_context(directory, lambda context: context["libraries"].update(openmp=known))
        assert said_of_runtimes(directory) == ([], [])


def test_one_name_stands_for_one_runtime(tmp_path):
    def edit(records):
        points = [entry for entry in records if entry["config"]["backend"] == "openmp"]
        for entry in points:
            entry["config"]["runtime"] = "default"
        points[0]["runtime_observed"] = "libomp"

    directory = write(tmp_path / "a", edit)
    rewrite_context(directory, lambda context: context["libraries"].update(openmp="unavailable: not asked"))  # so that no point is wrong by itself
    ((finding,), (warning,)) = said_of_runtimes(directory)
    assert finding.place == "config.runtime default" and finding.problem == "points of libgomp and libomp"
    assert "libgomp and libomp ran points that all say runtime default" in warning.text


def test_runtimes_as_an_axis_are_no_mixture(tmp_path):
    def edit(records):
        openmp(lambda r: r.update(runtime_observed="libomp", config=r["config"] | {"runtime": "libomp"}))(records)

    assert said_of_runtimes(write(tmp_path / "a", edit)) == ([], [])


def test_older_records_say_nothing_of_runtimes(tmp_path):
    def edit(records):
        for entry in records:
            entry.pop("runtime_observed")

    assert said_of_runtimes(write(tmp_path / "a", edit)) == ([], [])


def test_a_runtime_that_is_no_text_is_bad_input(tmp_path, capsys):
    directory = write(tmp_path / "a", openmp(lambda r: r.update(runtime_observed=3)))
    assert program.main(["lint", str(directory)]) == 2
    assert "runtime_observed" in capsys.readouterr().err
