"""compare: planted differences are found, equal runs are not told apart, other contexts are refused."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from .. import __main__ as program
from .. import compare, comparison_output, statistics
from . import synthetic
from .conftest import FEW

SCENES = {"teapot": synthetic.SCENES["teapot"]}


def run(directory, seed, launches=6, edit=None, **changes):
    plan = synthetic.plan(**(dict(kernels=["tile_parallel", "row_parallel"], schedules=FEW, threads=[1, 2], scenes=SCENES,
                                  launches=launches, blocks=4, seed=seed, untimed=False, edit=edit) | changes))
    return synthetic.write(directory, plan, pictures=False)


def times(factor, part):
    """Multiplies the times of the points whose name holds the text."""
    def edit(records):
        for entry in records:
            if part in entry["name"]:
                entry["samples_ms"] = [factor * sample for sample in entry["samples_ms"]]
    return edit


def rewrite_context(directory, change):
    path = directory / "context.json"
    context = json.loads(path.read_text())
    change(context)
    path.write_text(json.dumps(context))


def verdicts(a, b, **options):
    outcome = compare.compare(compare.read(a), compare.read(b), **options)
    return {row.name: row for row in outcome.rows}, outcome


def test_planted_differences_are_found(tmp_path):
    def edit(records):
        times(1.3, "row_parallel/f32/top-left/clip/openmp:dynamic,1/2")(records)
        times(0.7, "row_parallel/f32/top-left/clip/openmp:static/2")(records)

    rows, outcome = verdicts(run(tmp_path / "a", 1), run(tmp_path / "b", 2, edit=edit))
    for part, verdict, factor in (("row_parallel/f32/top-left/clip/openmp:dynamic,1/2", "SLOWER", 1.3),
                                  ("row_parallel/f32/top-left/clip/openmp:static/2", "FASTER", 0.7)):
        row = next(row for name, row in rows.items() if part in name)
        assert row.verdict == verdict
        assert row.ratio.low < factor < row.ratio.high
        assert (row.superiority > 0.95) == (verdict == "SLOWER")
    others = [row for row in rows.values() if "row_parallel/f32/top-left/clip/openmp" not in row.name]
    assert others and not {row.verdict for row in others} & {"SLOWER", "FASTER"}
    assert outcome.rows[0].ratio.value == max(row.ratio.value for row in outcome.rows)
    assert outcome.status == 1
    assert compare.compare(outcome.b, outcome.a).rows[0].verdict == "SLOWER"  # the other way round


def test_equal_runs_rarely_differ(tmp_path):
    """A/A: launches that differ by 1 %, as the synthetic ones do, make a difference in at most 5 % of whole comparisons."""
    false = 0
    for seed in range(30):
        pair = [run(tmp_path / f"{name}{seed}", 2 * seed + i, schedules=FEW[:1]) for i, name in enumerate("ab")]
        rows, _ = verdicts(*pair)
        false += any(row.verdict in ("FASTER", "SLOWER") for row in rows.values())
    assert false <= 4  # of 30 at 5 %: more than 4 has a chance of 1.6 %


def test_quiet_equal_runs_are_the_same(tmp_path):
    rng = np.random.default_rng(3)

    def quiet(records):
        for entry in records:
            entry["samples_ms"] = (10 * np.exp(rng.normal(0, 0.002, len(entry["samples_ms"])))).tolist()

    rows, outcome = verdicts(run(tmp_path / "a", 1, edit=quiet), run(tmp_path / "b", 2, edit=quiet))
    assert {row.verdict for row in rows.values()} == {"SAME"} and outcome.status == 0
    # A significant difference within the margin is too small to care; a narrower margin cares.
    slow = run(tmp_path / "c", 2, edit=lambda records: (quiet(records), times(1.01, "/")(records)))
    rows, _ = verdicts(tmp_path / "a", slow)
    assert {row.verdict for row in rows.values()} == {"SAME"}
    rows, outcome = verdicts(tmp_path / "a", slow, margin=0.005)
    assert {row.verdict for row in rows.values()} == {"SLOWER"}
    assert compare.common_shift(outcome) == pytest.approx(1.01, abs=0.003)
    assert "every point moved" in comparison_output.plain(outcome)


def test_wide_intervals_are_ambiguous(tmp_path):
    rows, _ = verdicts(run(tmp_path / "a", 1, noise=0.4), run(tmp_path / "b", 2, noise=0.4))
    assert {row.verdict for row in rows.values()} == {"AMBIGUOUS"}


def test_one_launch_is_ambiguous_unless_allowed(tmp_path):
    a, b = run(tmp_path / "a", 1, launches=1, blocks=12), run(tmp_path / "b", 2, launches=1, blocks=12, edit=times(1.5, "/"))
    rows, outcome = verdicts(a, b)
    assert {row.verdict for row in rows.values()} == {"AMBIGUOUS"} and "one launch" in comparison_output.plain(outcome)
    rows, _ = verdicts(a, b, one_launch=True)
    assert {row.verdict for row in rows.values()} == {"SLOWER"}


def test_runs_are_not_paired():
    """Equal launch and block numbers of two runs share nothing: shuffling one changes neither the ratio nor p."""
    rng = np.random.default_rng(5)
    launches, blocks = np.repeat(np.arange(5), 4), np.tile(np.arange(4), 5)
    values, others = np.exp(rng.normal(0, 0.1, (2, 20)))
    base = statistics.Samples(others, launches, blocks)
    straight = statistics.between_runs(statistics.Samples(values, launches, blocks), base)
    turned = statistics.between_runs(statistics.Samples(values, 4 - launches, 3 - blocks), base)
    assert straight[0].value == turned[0].value and straight[1] == pytest.approx(turned[1])


def test_welch_over_launches_agrees_with_scipy():
    from scipy import stats
    rng = np.random.default_rng(6)
    launches = np.repeat(np.arange(6), 3)
    a, b = (statistics.Samples(np.exp(rng.normal(m, 0.05, 18)), launches, np.tile(np.arange(3), 6)) for m in (0.0, 0.1))
    expected = stats.ttest_ind(statistics.launch_medians(b), statistics.launch_medians(a), equal_var=False)
    estimate, p = statistics.between_runs(b, a)
    assert p == pytest.approx(expected.pvalue)
    assert estimate.low < np.exp(0.1) < estimate.high


@pytest.mark.parametrize("key, change", [
    ("program.commit", lambda c: c["program"].update(commit="another")),
    ("environment.OMP_WAIT_POLICY", lambda c: c["environment"].update(OMP_WAIT_POLICY="active")),
    ("machine.cpus_allowed", lambda c: c["machine"].update(cpus_allowed=[0, 1])),
    ("libraries.tbb", lambda c: c["libraries"].pop("tbb")),
    ("study.sampling.target", lambda c: c["study"]["sampling"].update(target=0.05)),
])
def test_another_context_is_refused(tmp_path, capsys, key, change):
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1)
    rewrite_context(b, change)
    assert program.main(["compare", str(a), str(b)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 2  # one line the difference, one what to do
    assert key in err and str(b) in err and "--ignore" in err
    for name in (key, key.split(".")[0]):
        assert program.main(["compare", str(a), str(b), "--ignore", name]) == 0
        assert key in capsys.readouterr().out  # what was allowed is said
    assert program.main(["compare", str(a), str(b), "--ignore", key[:-1]]) == 2  # a part of a name is none


def test_results_are_no_context(tmp_path):
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1)
    rewrite_context(b, lambda c: (c.update(id="beef", started="2025", finished="2025"), c["machine"].update(load_average=[3, 2, 1])))
    assert verdicts(a, b)[1].status == 0


@pytest.mark.parametrize("key, change", [
    ("threads_observed", lambda r: r.update(threads_observed=1)),
    ("work.covered_pixels", lambda r: r["work"].update(covered_pixels=1)),
    ("config.scene_hash", lambda r: r["config"].update(scene_hash="other")),
    ("config.binding", lambda r: r["config"].update(binding="spread")),
])
def test_a_point_that_is_another_is_refused(tmp_path, capsys, key, change):
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1, edit=lambda records: change(records[-1]))
    assert program.main(["compare", str(a), str(b)]) == 2
    err = capsys.readouterr().err
    assert key in err and "first in teapot/" in err
    assert program.main(["compare", str(a), str(b), "--ignore", key]) == 0


def test_lost_points_fail(tmp_path, capsys):
    def lose(records):
        synthetic.withhold(records[2], "failed", "does not conform")
        records.pop()

    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1, edit=lose)
    rows, outcome = verdicts(a, b)
    assert sum(row.verdict == "LOST" for row in rows.values()) == 2 and outcome.status == 3
    assert "does not conform" in comparison_output.plain(outcome)
    # Points that B never planned may be missing; one that failed may not.
    rows, outcome = verdicts(a, b, ignore=["points"])
    assert [row.why for row in rows.values() if row.verdict == "LOST"] == ["failed: does not conform"] and outcome.status == 3
    assert len(outcome.only_a) == 1 and outcome.only_a[0] in comparison_output.plain(outcome)
    assert len(verdicts(b, a)[1].only_b) == 2


def google(path, scale, n=12, host="node_1", seed=1, edit=None):
    rng = np.random.default_rng(seed)
    runs = [{"name": name, "run_name": name, "run_type": "iteration", "repetition_index": i, "iterations": 1,
             "real_time": factor * scale * float(np.exp(rng.normal(0, 0.003))), "cpu_time": 0.0, "time_unit": "us"}
            for name, factor in (("one", 100.0), ("two", 900.0)) for i in range(n)]
    runs.append({"name": "one_mean", "run_name": "one", "run_type": "aggregate", "aggregate_name": "mean", "real_time": 1e9,
                 "time_unit": "us"})
    value = {"context": {"host_name": host, "num_cpus": 4}, "benchmarks": runs}
    if edit:
        edit(value)
    path.write_text(json.dumps(value))
    return path


def test_google_benchmark_files(tmp_path, capsys):
    a, b = google(tmp_path / "a.json", 1.0), google(tmp_path / "b.json", 1.5, seed=2)
    rows, outcome = verdicts(a, b)
    assert {row.verdict for row in rows.values()} == {"AMBIGUOUS"}  # repetitions of one process
    rows, outcome = verdicts(a, b, one_launch=True)
    assert {row.verdict for row in rows.values()} == {"SLOWER"}
    assert np.median(rows["one"].a.values) == pytest.approx(0.1, rel=0.01)  # microseconds; the aggregate is not a sample
    assert "records little" in comparison_output.plain(outcome)
    assert program.main(["compare", str(a), str(google(tmp_path / "c.json", 1, host="elsewhere"))]) == 2
    assert "machine.hostname" in capsys.readouterr().err


def test_google_benchmark_beside_a_study(tmp_path):
    """The same samples, read from either file, are the same."""
    directory = run(tmp_path / "a", 1, launches=1, blocks=12, noise=0.002)
    entries = [json.loads(line) for line in (directory / "records.jsonl").read_text().splitlines()]
    path = google(tmp_path / "a.json", 1, edit=lambda value: value.update(benchmarks=[
        {"name": f"{e['name']}/repeats:12", "run_name": e["name"], "run_type": "iteration", "real_time": t, "time_unit": "ms"}
        for e in entries for t in e["samples_ms"]]))
    rows, _ = verdicts(directory, path, one_launch=True)
    assert len(rows) == len(entries) and {row.ratio.value for row in rows.values()} == {1.0}


@pytest.mark.parametrize("edit, field", [
    (lambda v: v.pop("benchmarks"), "Google Benchmark"),
    (lambda v: v["benchmarks"][3].update(real_time="fast"), "benchmarks[3].real_time"),
    (lambda v: v["benchmarks"][3].update(real_time=-1), "benchmarks[3].real_time"),
    (lambda v: v["benchmarks"][3].update(time_unit="days"), "benchmarks[3].time_unit"),
    (lambda v: v["benchmarks"].__setitem__(2, 5), "benchmarks[2]"),
    (lambda v: v.update(benchmarks=v["benchmarks"][-1:]), "only aggregates"),
])
def test_bad_google_benchmark_files(tmp_path, capsys, edit, field):
    bad, good = google(tmp_path / "bad.json", 1, edit=edit), google(tmp_path / "good.json", 1)
    assert program.main(["compare", str(bad), str(good)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and field in err and "bad.json" in err


def test_a_benchmark_that_failed_is_lost(tmp_path):
    def fail(value):
        value["benchmarks"] = [r for r in value["benchmarks"] if r["run_name"] != "two"] + [
            {"name": "two", "run_name": "two", "run_type": "iteration", "error_occurred": True, "error_message": "no memory"}]

    rows, outcome = verdicts(google(tmp_path / "a.json", 1), google(tmp_path / "b.json", 1, edit=fail))
    assert rows["two"].verdict == "LOST" and rows["two"].why == "no memory" and outcome.status == 3


def test_every_difference_is_named(tmp_path, capsys):
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1)
    rewrite_context(b, lambda c: (c["program"].update(commit="x", flags="-O2"), c["machine"].update(kernel="5.10")))
    assert program.main(["compare", str(a), str(b), "--ignore", "program"]) == 2
    assert capsys.readouterr().err.count("machine.kernel") == 1
    assert program.main(["compare", str(a), str(b)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[2] for line in lines[:-1]] == ["machine.kernel", "program.commit", "program.flags"]


def test_written_files(tmp_path, capsys):
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 2, edit=times(1.3, "row_parallel"))
    assert program.main(["compare", str(a), str(b), "--out", str(tmp_path / "out")]) == 1
    capsys.readouterr()
    assert program.main(["compare", str(a), str(b), "--json"]) == 1
    value = json.loads(capsys.readouterr().out)
    assert value == json.loads((tmp_path / "out/comparison.json").read_text()) | {"b": value["b"], "a": value["a"]}
    with (tmp_path / "out/comparison.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == [point["verdict"] for point in value["points"]] and len(rows) == 14
    slower = [row for row in rows if row["verdict"] == "SLOWER"]
    assert len(slower) == 7 and all(float(row["low"]) < 1.3 < float(row["high"]) and float(row["p_holm"]) < 0.05 for row in slower)
    assert {"ratios.svg", "ratios.pdf", "ratios.png", "ratios.json", "comparison.tex"} <= {p.name for p in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize("arguments", [["{a}"], ["{a}", "{a}", "--margin", "2"], ["{a}", "{a}", "--margin", "x"], ["{a}", "{a}/none"],
                                       ["{a}", "{a}", "--out", "{a}/context.json"]])
def test_usage(tmp_path, capsys, arguments):
    a = run(tmp_path / "a", 1)
    try:
        status = program.main(["compare", *(argument.format(a=a) for argument in arguments)])
    except SystemExit as error:
        status = error.code
    out, err = capsys.readouterr()
    assert status == 2 and err.count("\n") == 1
