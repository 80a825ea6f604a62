"""compare: planted differences are found, equal runs are not told apart, other contexts are refused."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from .. import __main__ as program
from .. import compare, comparison_output, writing
from ..statistics import launch_tests, runs
from ..statistics.samples import Samples
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


@pytest.mark.parametrize("ratios, shift", [([1.1] * 5, None), ([1.1] * 6, 1.1), ([1.1] * 7 + [0.9] * 3, None), ([0.9] * 19 + [1.1], 0.9), ([], None)])
def test_a_common_shift_takes_a_sign_test(ratios, shift):
    rows = [SimpleNamespace(ratio=SimpleNamespace(value=ratio)) for ratio in ratios] + [SimpleNamespace(ratio=None)]
    assert compare.common_shift(SimpleNamespace(rows=rows)) == shift


def test_wide_intervals_are_ambiguous(tmp_path):
    rows, _ = verdicts(run(tmp_path / "a", 1, noise=0.4), run(tmp_path / "b", 2, noise=0.4))
    assert {row.verdict for row in rows.values()} == {"AMBIGUOUS"}


def test_one_launch_is_ambiguous_unless_allowed(tmp_path):
    a, b = run(tmp_path / "a", 1, launches=1, blocks=12), run(tmp_path / "b", 2, launches=1, blocks=12, edit=times(1.5, "/"))
    rows, outcome = verdicts(a, b)
    assert {row.verdict for row in rows.values()} == {"AMBIGUOUS"} and outcome.status == 4
    said = comparison_output.plain(outcome)
    assert "fewer than 5 launches on a side" in said and "No point has the samples and launches" in said and "UNDECIDED" in said
    rows, outcome = verdicts(a, b, few_launches=True)
    assert {row.verdict for row in rows.values()} == {"SLOWER"}
    assert "judged with fewer than 5 launches" in comparison_output.plain(outcome)


def test_four_launches_are_too_few(tmp_path):
    a, b = run(tmp_path / "a", 1, launches=4, blocks=6), run(tmp_path / "b", 2, launches=4, blocks=6, edit=times(1.5, "/"))
    assert verdicts(a, b)[1].status == 4 and verdicts(a, b, few_launches=True)[1].status == 1
    enough = run(tmp_path / "c", 2, launches=5, blocks=6, edit=times(1.5, "/"))
    assert verdicts(a, enough, ignore=["study"])[1].status == 4  # the side that has fewer counts
    assert verdicts(run(tmp_path / "d", 1, launches=5, blocks=6), enough)[1].status == 1


def many_points(factor, points, samples, launches, seed, common=0.0, own=0.0):
    """A run of points whose samples vary by 0.2 %, and what the run adds to all and to each."""
    rng = np.random.default_rng(seed)
    shift = rng.normal(0, common)
    times = {f"p{i}": 10 * factor * np.exp(shift + rng.normal(0, own) + rng.normal(0, 0.002, samples)) for i in range(points)}
    places = np.arange(samples)
    return compare.Run(Path("run"), {}, {name: Samples(values, places % launches, places) for name, values in times.items()},
                       {}, {}, {}, 0.02, True)


@pytest.mark.parametrize("points, samples", [(300, 10), (120, 6), (1, 6), (30, 10)])
def test_a_slowdown_is_found_in_a_study_of_any_size(points, samples):
    outcome = compare.compare(many_points(1, points, samples, 5, 1), many_points(2, points, samples, 5, 2))
    assert {row.verdict for row in outcome.rows} == {"SLOWER"} and outcome.status == 1
    assert ("Welch's t on logarithms" in comparison_output.plain(outcome)) == (samples == 6 and points > 1)


def test_launches_out_of_reach_are_said():
    outcome = compare.compare(many_points(1, 100, 8, 2, 1), many_points(1.1, 100, 8, 2, 2), few_launches=True)
    assert "standard errors of the launches" in comparison_output.plain(outcome)


def test_a_point_without_a_test_costs_the_others_nothing():
    """Points of too few samples are no part of the family that Holm corrects for."""
    a, b = many_points(1, 40, 12, 6, 1), many_points(1.01, 40, 12, 6, 2)
    alone = {row.name: row.p for row in compare.compare(a, b).rows}
    for run_ in (a, b):
        run_.samples.update({f"few{i}": Samples(np.ones(3), np.arange(3), np.arange(3)) for i in range(500)})
    assert {row.name: row.p for row in compare.compare(a, b).rows if row.name in alone} == pytest.approx(alone)


def test_most_points_undecided_is_a_code_of_its_own():
    a, b = many_points(1, 4, 12, 6, 1), many_points(1, 4, 12, 6, 2)
    assert compare.compare(a, b).status == 0
    few = Samples(np.ones(3), np.arange(3), np.arange(3))
    for name in ("p0", "p1"):
        b.samples[name] = few
    assert compare.compare(a, b).status == 0  # half of them
    b.samples["p2"] = few
    assert compare.compare(a, b).status == 4
    b.samples["p3"] = Samples(2 * a.samples["p3"].values, a.samples["p3"].launches, a.samples["p3"].blocks)
    assert compare.compare(a, b).status == 1  # one that is slower is known, whatever the others


def test_repeats_of_a_are_the_yardstick():
    """Runs that move by 2 %, their points by 1 % more: without repeats nearly all comparisons of a program with itself find a
    difference, with them no more than 5 %; twice the time is found with two repeats."""
    false, naive, found, trials = 0, 0, 0, 40
    for seed in range(trials):
        a, b, *repeats = (many_points(1, 5, 10, 5, 10 * seed + i, 0.02, 0.01) for i in range(4))
        differ = [any(row.verdict in ("FASTER", "SLOWER") for row in compare.compare(a, b, repeats=known).rows) for known in ([], repeats)]
        naive, false = naive + differ[0], false + differ[1]
        found += {row.verdict for row in compare.compare(a, many_points(2, 5, 10, 5, 10 * seed + 9, 0.02, 0.01), repeats=repeats).rows} == {
            "SLOWER"}
    assert naive > 0.8 * trials
    assert false <= 5  # 2 of 40 are stated; more than 5 has a chance of 1.4 %
    assert found > 0.8 * trials


@pytest.mark.parametrize("common, own", [(0.02, 0.0), (0.0, 0.02), (0.01, 0.01)])
@pytest.mark.parametrize("repeats", [1, 3])
def test_the_yardstick_holds_what_it_states(common, own, repeats):
    rng = np.random.default_rng(4)
    missed, trials = 0, 1500
    for _ in range(trials):
        logs = rng.normal(0, common, repeats + 2) + rng.normal(0, own, (12, repeats + 2))
        missed += bool(np.any(np.abs(logs[:, -1] - logs[:, 0]) > runs.yardstick(logs[:, :-1])))
    assert missed < 0.065 * trials  # 5 % of whole comparisons of 12 points


def test_repeats_are_said_and_checked(tmp_path, capsys):
    a, b, again = (run(tmp_path / name, seed) for name, seed in (("a", 1), ("b", 2), ("again", 3)))
    program.main(["compare", str(a), str(b)])
    assert "were not interleaved" in capsys.readouterr().out
    program.main(["compare", str(a), str(b), "--repeat", str(again), "--json"])
    value = json.loads(capsys.readouterr().out)
    assert any("1 repeat of A" in line for line in value["remarks"]) and value["repeats"][0]["path"] == str(again)
    assert all(point["moved_by_repeats"] > 0 for point in value["points"])
    rewrite_context(again, lambda c: c["program"].update(commit="another"))
    assert program.main(["compare", str(a), str(b), "--repeat", str(again), "--ignore", "program"]) == 2
    assert "under the conditions of A" in capsys.readouterr().err


def test_few_points_that_moved_together_are_said():
    outcome = compare.compare(many_points(1, 8, 10, 5, 1), many_points(1.1, 8, 10, 5, 2))
    assert "every point moved" in comparison_output.plain(outcome)


def test_ignoring_what_is_not_there(tmp_path, capsys):
    a = run(tmp_path / "a", 1)
    for name in ("progam", "machine.", ""):
        assert program.main(["compare", str(a), str(a), "--ignore", name]) == 2
        assert repr(name) in capsys.readouterr().err
    assert program.main(["compare", str(a), str(a), "--ignore", "program", "--ignore", "points", "--ignore", "frames_per_sample"]) != 2


def test_runs_are_not_paired():
    """Equal launch and block numbers of two runs share nothing: shuffling one changes neither the ratio nor p."""
    rng = np.random.default_rng(5)
    launches, blocks = np.repeat(np.arange(5), 4), np.tile(np.arange(4), 5)
    values, others = np.exp(rng.normal(0, 0.1, (2, 20)))
    base = Samples(others, launches, blocks)
    straight = runs.between_runs(Samples(values, launches, blocks), base)
    turned = runs.between_runs(Samples(values, 4 - launches, 3 - blocks), base)
    assert straight[0].value == turned[0].value and straight[1] == pytest.approx(turned[1])


def test_welch_over_launches_agrees_with_scipy():
    from scipy import stats
    rng = np.random.default_rng(6)
    launches = np.repeat(np.arange(6), 3)
    a, b = (Samples(np.exp(rng.normal(m, 0.05, 18)), launches, np.tile(np.arange(3), 6)) for m in (0.0, 0.1))
    expected = stats.ttest_ind(launch_tests.launch_medians(b), launch_tests.launch_medians(a), equal_var=False)
    estimate, p, _ = runs.between_runs(b, a)
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
    ("config.binding", lambda r: r["config"].pop("binding")),
])
def test_a_point_that_is_another_is_refused(tmp_path, capsys, key, change):
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1, edit=lambda records: change(records[-1]))
    assert program.main(["compare", str(a), str(b)]) == 2
    err = capsys.readouterr().err
    assert key in err and "first in teapot/" in err
    assert program.main(["compare", str(a), str(b), "--ignore", key]) == 0


@pytest.mark.parametrize("change", [lambda r: r.update(frames_per_sample=7), lambda r: r.pop("frames_per_sample")])
def test_another_number_of_frames_is_said(tmp_path, capsys, change):
    """It is not refused: the program chooses it from times, which differ between two runs of one program."""
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 1, edit=lambda records: change(records[-1]))
    assert program.main(["compare", str(a), str(b)]) == 0
    assert "frames_per_sample: 1 in A" in capsys.readouterr().out


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
    rows, outcome = verdicts(a, b, few_launches=True)
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
    rows, _ = verdicts(directory, path, few_launches=True)
    assert len(rows) == len(entries) and {row.ratio.value for row in rows.values()} == {1.0}


@pytest.mark.parametrize("edit, field", [
    (lambda v: v.pop("benchmarks"), "Google Benchmark"),
    (lambda v: v["benchmarks"][3].update(real_time="fast"), "benchmarks[3].real_time"),
    (lambda v: v["benchmarks"][3].update(real_time=-1), "benchmarks[3].real_time"),
    (lambda v: v["benchmarks"][3].update(time_unit="days"), "benchmarks[3].time_unit"),
    (lambda v: v["benchmarks"][3].update(time_unit=[]), "benchmarks[3].time_unit"),
    (lambda v: v["benchmarks"][3].update(real_time=10**400), "benchmarks[3].real_time"),
    (lambda v: v["benchmarks"][3].update(real_time=float("nan")), "benchmarks[3].real_time"),
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


def test_an_error_wins_over_samples(tmp_path, capsys):
    def half(value):
        for entry in value["benchmarks"][18:24]:
            entry.update(error_occurred=True, error_message="no memory")

    good, bad = google(tmp_path / "a.json", 1), google(tmp_path / "b.json", 1, edit=half)
    rows, outcome = verdicts(good, bad)
    assert rows["two"].verdict == "LOST" and rows["two"].why == "no memory (its 6 other repetitions are not used)" and outcome.status == 3
    assert "Without times in A: two (no memory" in comparison_output.plain(verdicts(bad, good)[1])


def test_a_skipped_benchmark_has_no_times(tmp_path):
    def skip(value):
        value["benchmarks"].append({"name": "gpu", "run_name": "gpu", "run_type": "iteration", "skipped": True, "skip_message": "no GPU",
                                    "real_time": 0.0, "time_unit": "ns"})

    found = compare.read(google(tmp_path / "a.json", 1, edit=skip))
    assert found.untimed == {"gpu": "no GPU"} and set(found.samples) == {"one", "two"}


def test_nan_that_nobody_reads(tmp_path):
    def cannot(value):
        value["benchmarks"][-1].update(aggregate_name="cv", real_time=float("nan"))
        value["benchmarks"][0].update(counter=float("nan"))

    assert set(compare.read(google(tmp_path / "a.json", 1, edit=cannot)).samples) == {"one", "two"}


@pytest.mark.parametrize("key, value", [("library_build_type", "debug"), ("mhz_per_cpu", 3000), ("cpu_scaling_enabled", True), ("mine", "x")])
def test_the_context_of_google_benchmark_is_compared(tmp_path, capsys, key, value):
    about = {"library_build_type": "release", "mhz_per_cpu": 2000, "cpu_scaling_enabled": False}
    a = google(tmp_path / "a.json", 1, edit=lambda v: v["context"].update(about, date="1", executable="a", load_avg=[1]))
    b = google(tmp_path / "b.json", 1, edit=lambda v: v["context"].update(about | {key: value}, date="2", executable="b", load_avg=[2]))
    assert program.main(["compare", str(a), str(b)]) == 2
    err = capsys.readouterr().err
    assert f"google_benchmark.{key}" in err and err.count("\n") == 2
    assert program.main(["compare", str(a), str(b), "--ignore", f"google_benchmark.{key}"]) == 4


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


def test_a_comparison_leaves_others_files_alone(tmp_path, capsys):
    """Beside the figures of a report; a second comparison replaces the first, and a second report neither."""
    a, b = run(tmp_path / "a", 1), run(tmp_path / "b", 2)
    assert program.main(["report", str(a)]) == 0
    figures = {path.name for path in (a / "figures").iterdir()}
    for _ in range(2):
        assert program.main(["compare", str(a), str(b), "-o", str(a / "figures")]) in (0, 1, 4)
    both = {path.name for path in (a / "figures").iterdir()}
    assert figures < both and "comparison.json" in both
    assert program.main(["report", str(a)]) == 0
    assert {path.name for path in (a / "figures").iterdir()} == both
    # What this writer does not write any more is removed.
    writing.write_folder(a / "figures", {"comparison.json": "{}"}, "compare")
    assert {path.name for path in (a / "figures").iterdir()} == figures | {"comparison.json"}


def test_an_input_is_never_written_over(tmp_path, capsys):
    a = google(tmp_path / "comparison.json", 1)
    before = a.read_bytes()
    link = tmp_path / "link.json"
    link.symlink_to(a)
    for given in (a, link):
        assert program.main(["compare", str(given), str(given), "-o", str(tmp_path)]) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1 and "comparison.json" in err and a.read_bytes() == before
    study = run(tmp_path / "a", 1)
    assert program.main(["report", str(study), "--out", str(study / "records.jsonl")]) == 2
    assert (study / "records.jsonl").read_text().startswith("{") and not (study / "figures").exists()


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
