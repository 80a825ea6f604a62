"""What-if: the answers of known loops, fits that can and cannot be identified, bad input in one line, the files of the command."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree

import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from .. import __main__ as program
from .. import scaling_laws, whatif
from ..loop_costs import read
from . import loops, synthetic


def model(tmp_path, costs, **changes):
    return whatif.Model(read(loops.write(tmp_path / "costs.json", costs, **changes)))


def rule(schedule, backend="openmp", runtime=""):
    return whatif.Rule(backend, schedule, runtime)


def test_an_even_loop_without_dispatch_scales_with_its_threads(tmp_path):
    m = model(tmp_path, np.full(1024, 10.0), dispatch_us={})
    for threads in (1, 16, 1024):
        assert m.predict(rule("static"), None, threads).speedup == pytest.approx(threads)


def test_one_large_iteration_bounds_every_schedule(tmp_path):
    m = model(tmp_path, [1000.0, *[1.0] * 999])
    best = m.best(64)[0]
    assert best.speedup <= best.iteration_bound == pytest.approx(1.999)
    assert all(p.speedup <= min(p.threads, p.chunk_bound) * (1 + 1e-3) for p in m.at(64))


def test_a_hot_end_is_no_case_for_static(tmp_path):
    m = model(tmp_path, np.r_[np.ones(960), np.full(64, 50.0)], dispatch_us={})
    assert rule("static") not in {p.rule for p in m.best(16) if p.chunk is None}
    assert m.predict(rule("static"), None, 16).efficiency < 0.5 < m.predict(rule("dynamic"), 1, 16).efficiency


def test_the_overhead_of_the_nearest_chunk_stands_for_one_that_was_not_measured(tmp_path):
    costs = read(loops.write(tmp_path / "costs.json", [1.0]))
    assert costs.overhead("openmp", "dynamic", 1) == (0.3, "openmp:dynamic,1")
    assert costs.overhead("openmp", "dynamic", 2) == (0.3, "openmp:dynamic,1")
    assert costs.overhead("openmp", "dynamic", 8) == (0.5, "openmp:dynamic,16")
    assert costs.overhead("openmp", "guided", 8) == (0.4, "openmp:guided")
    assert costs.overhead("tbb", "affinity", 1) == (0.0, "not measured")


def test_costs_of_blocks_are_spread_over_their_iterations(tmp_path):
    costs = read(loops.write(tmp_path / "costs.json", [4.0, 6.0, 1.0], iterations=10, iterations_a_cost=4))
    assert costs.n == 10 and costs.total == pytest.approx(11.0)
    assert costs.costs.tolist() == pytest.approx([1.0] * 4 + [1.5] * 4 + [0.5] * 2)


def test_laws_are_found_again_and_only_where_they_can_be():
    threads = [1, 2, 4, 8, 16]
    times = [10 * (0.1 + 0.9 / p) for p in threads]
    amdahl = scaling_laws.fit(scaling_laws.AMDAHL, threads, times)
    assert amdahl.estimates["serial share"].value == pytest.approx(0.1)
    usl = scaling_laws.fit(scaling_laws.USL, threads, [10 * (1 + 0.05 * (p - 1) + 0.01 * p * (p - 1)) / p for p in threads])
    assert usl.estimates["contention"].value == pytest.approx(0.05)
    assert usl.estimates["coherency"].value == pytest.approx(0.01)
    for law, enough in ((scaling_laws.AMDAHL, 4), (scaling_laws.USL, 5)):
        assert scaling_laws.fit(law, threads[:enough], times[:enough]).estimates
        refused = scaling_laws.fit(law, threads[:enough - 1], times[:enough - 1])
        assert not refused.estimates and "not identifiable" in refused.reason


def test_the_interval_of_a_law_holds_its_parameter():
    rng = np.random.default_rng(5)
    threads, inside = np.array([1, 2, 4, 8, 16]), 0
    for _ in range(200):
        times = 10 * (0.1 + 0.9 / threads) * np.exp(rng.normal(0, 0.01, len(threads)))
        e = scaling_laws.fit(scaling_laws.AMDAHL, threads.tolist(), times.tolist()).estimates["serial share"]
        inside += e.low <= 0.1 <= e.high
    assert 180 <= inside <= 199


@pytest.mark.parametrize("changes, field", [
    ({"unit": "furlong"}, "unit"), ({"kernel": ...}, "kernel"), ({"iterations": 0}, "iterations"), ({"iterations": 4}, "cost_us"),
    ({"cost_us": [1, -1, 1]}, "cost_us"), ({"cost_us": [0, 0, 0]}, "cost_us"), ({"size": [1]}, "size"), ({"tile": 0}, "tile"),
    ({"serial_us": "long"}, "serial_us"), ({"dispatch_us": {"openmp:static": -1}}, "dispatch_us.openmp:static"), ({"steal_us": -1}, "steal_us"), ({"threads": True}, "threads"), ({"threads": 65537}, "threads"), ({"schema": ...}, "schema"),
    ({"schema": 2}, "schema"), ({"cost_us": [1e308, 1e308, 1]}, "cost_us"), ({"isa": 3}, "isa")])
def test_bad_fields_are_named(tmp_path, capsys, changes, field):
    path = loops.write(tmp_path / "costs.json", [1.0, 2.0, 3.0], **changes)
    assert program.main(["whatif", str(path), "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and f"costs.json: {field}:" in err
    assert not (tmp_path / "out").exists()


def today(records):
    """Axes that the records of older versions do not have."""
    for entry in records:
        entry["config"].update(techniques="all", generality="minimal")


def plan(**changes):
    return synthetic.plan(**(dict(edit=today, kernels=["row_parallel"], scenes={"teapot": (6320, 45.0, [1920, 1080])}, untimed=False,
                                  threads=[1, 2, 4, 8]) | changes))


def test_command_compares_with_a_study(tmp_path, capsys):
    costs = loops.write(tmp_path / "costs.json", loops.heavy(1080))
    study = synthetic.write(tmp_path / "study", plan())
    assert program.main(["whatif", str(costs), "--measured", str(study), "--out", str(tmp_path / "out")]) == 0
    out, err = capsys.readouterr()
    assert err == "" and "64 threads:" in out and "contention-free" in out and "not identifiable: 4 thread counts, 5 needed" in out
    folder = tmp_path / "out"
    table = pd.read_csv(folder / "whatif_measured.csv")
    assert set(table.threads) == {1, 2, 4, 8}
    assert table.error.to_list() == pytest.approx((table.predicted_ms / table.measured_ms - 1).to_list())
    # The synthetic serial share is 1 - 0.95.
    fits = pd.read_csv(folder / "whatif_fits.csv").set_index(["schedule", "law", "parameter"])
    assert fits.loc[("openmp dynamic,16", "Amdahl", "serial share"), "value"] == pytest.approx(0.05, abs=0.03)
    for figure in ("whatif_curves", "whatif_schedules"):
        ElementTree.parse(folder / f"{figure}.svg")
        assert "contention-free" in (folder / f"{figure}.txt").read_text()
        image = matplotlib.image.imread(folder / f"{figure}.png")
        for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
            assert edge[..., :3].min() > 0.99
    assert "Machine: Example CPU 9000" in (folder / "whatif_curves.txt").read_text()


def test_a_study_of_something_else_or_of_several_scenes_is_refused(tmp_path, capsys):
    costs = loops.write(tmp_path / "costs.json", loops.heavy(100), kernel="tile_parallel")
    study = synthetic.write(tmp_path / "study", plan())
    assert program.main(["whatif", str(costs), "--measured", str(study), "--out", str(tmp_path / "out")]) == 2
    assert "holds no timed point of tile_parallel" in capsys.readouterr().err
    def alike(records):
        today(records)
        for entry in records:
            entry["config"]["scene_hash"] = synthetic.digest("teapot")

    two = synthetic.write(tmp_path / "two", plan(edit=alike, scenes={name: (6320, 45.0, [1920, 1080]) for name in ("teapot", "city")}))
    costs = loops.write(tmp_path / "costs.json", loops.heavy(100))
    arguments = ["whatif", str(costs), "--measured", str(two), "--out", str(tmp_path / "out")]
    assert program.main(arguments) == 2
    assert "name one with --scene" in capsys.readouterr().err
    assert program.main([*arguments, "--scene", "city"]) == 0


@pytest.mark.parametrize("axis, value", [("scene_hash", "another"), ("fill", "closed"), ("near", "off"), ("isa", "avx2"), ("techniques", "none"),
                                         ("generality", "full")])
def test_costs_of_another_loop_are_not_compared(tmp_path, capsys, axis, value):
    study = synthetic.write(tmp_path / "study", plan())
    arguments = ["--measured", str(study), "--out", str(tmp_path / "out")]
    costs = loops.write(tmp_path / "costs.json", loops.heavy(100), **{axis: value})
    assert program.main(["whatif", str(costs), *arguments]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and f"config.{axis}:" in err and value in err
    older = loops.write(tmp_path / "older.json", loops.heavy(100), **{axis: ...})
    assert program.main(["whatif", str(older), *arguments]) == 2
    assert f"older.json: {axis}: missing, as in traces of older versions" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_points_under_other_conditions_are_series_of_their_own(tmp_path):
    def cold(records):
        today(records)
        for entry in [json.loads(json.dumps(entry)) for entry in records]:
            entry["config"]["cache"] = "cold"
            entry |= {"id": synthetic.digest(entry["config"]), "name": entry["name"] + "/cold", "samples_ms": [3 * t for t in entry["samples_ms"]]}
            entry["loop_ms"] = [3 * t for t in entry["loop_ms"]]
            records.append(entry)

    m = model(tmp_path, loops.heavy(100))
    study = synthetic.write(tmp_path / "study", plan(edit=cold, threads=[1, 2]))
    found = whatif.measured(m, study, None)
    assert {"openmp dynamic,1, cache warm", "openmp dynamic,1, cache cold"} <= set(found.fits)
    warm, cool = ({(p.prediction.name, p.prediction.threads): p.speedup.value for p in found.points if p.record.config.cache == c} for c in ("warm", "cold"))
    assert warm and warm == pytest.approx(cool)  # each over one thread of its own


def test_the_loop_is_compared_and_the_stage_where_a_record_does_not_tell_it(tmp_path):
    def older(records):
        today(records)
        records[-1].pop("loop_ms")

    def stampless(records):
        today(records)
        records[-1]["loop_ms"] = [0.0] * len(records[-1]["loop_ms"])

    m = model(tmp_path, loops.heavy(100))
    new, *old = (whatif.measured(m, synthetic.write(tmp_path / edit.__name__, plan(edit=edit, threads=[1, 2])), None) for edit in (today, older, stampless))
    assert new.of_loop and "measured loop, 2 threads" in "\n".join(whatif.findings(m, new)) and whatif.measured_table(new).note.startswith("The loop.")
    for study in old:
        assert not study.of_loop and "do not tell the loop" in "\n".join(whatif.findings(m, study))
        assert [p.time.value / 0.76 for p in study.points] == pytest.approx([p.time.value / 0.7 for p in new.points], rel=1e-4)


def test_an_unmeasured_overhead_is_said(tmp_path):
    m = model(tmp_path, [1.0, 2.0], dispatch_us=loops.DISPATCH | {"openmp:guided": None})
    assert m.costs.overhead("openmp", "guided", 8) == (0.0, "not measured")
    assert any("No overhead of a chunk was measured for openmp guided (libgomp)" in line for line in whatif.cautions(m))


@pytest.mark.parametrize("changes, words", [
    ({"threads": 1}, "measured on 1 thread, where nobody contends"),
    ({"threads": 2, "steal_us": None}, "measured on 2 threads, of oneTBB on one"),
    ({"threads": 2}, "measured on 2 threads; with more"),  # an older file: oneTBB as all others
    ({}, "not measured: that of a chunk stands for it"),
    ({"steal_us": None}, "not measured: that of a chunk stands for it"),
    ({"steal_us": 0.75}, "steals takes it 0.750 us more"),
])
def test_where_the_overheads_are_from_is_said(tmp_path, changes, words):
    assert any(words in line for line in whatif.cautions(model(tmp_path, [1.0, 2.0], **changes)))


def test_a_measured_steal_is_counted(tmp_path):
    costs = np.r_[np.ones(960), np.full(64, 50.0)]
    rule = next(r for r in whatif.RULES if (r.backend, r.schedule) == ("tbb", "simple"))
    times = [model(tmp_path, costs, steal_us=steal).predict(rule, 1, 16).outcome.time for steal in (0.0, 5.0)]
    assert times[1] > times[0] + 4


def test_a_range_of_auto_costs_that_of_simple_where_it_was_not_measured(tmp_path):
    m = model(tmp_path, [1.0, 2.0], dispatch_us={"tbb:simple": 0.3, "tbb:simple,1": 0.25, "tbb:auto": None})
    assert m.costs.overhead("tbb", "auto", None) == (0.3, "tbb:simple") and m.costs.overhead("tbb", "auto", 2) == (0.25, "tbb:simple,1")


def replay(tmp_path, **changes):
    """As `rasterbench replay --json` writes it: two threads, dynamic,1, each iteration 1 ms, measured 5 % late."""
    value = {"execution": "openmp:dynamic,1", "runtime": "libgomp", "threads": 2, "iterations": 4,
             "repetitions": [{"measured_ms": 2.1, "slept_ms": [1.0] * 4, "workers": [0, 1, 0, 1], "contradiction": None,
                              "order_contradiction": None}], "can_be_contradicted": False} | changes
    path = tmp_path / "replay.json"
    path.write_text(json.dumps(value))
    return path


def test_the_error_of_a_replay_is_stated(tmp_path, capsys):
    costs = loops.write(tmp_path / "costs.json", loops.heavy(100))
    assert program.main(["whatif", str(costs), "--replay", str(replay(tmp_path)), "--out", str(tmp_path / "out")]) == 0
    assert "Sleep replay" in capsys.readouterr().out
    assert pd.read_csv(tmp_path / "out/whatif_replay.csv").error.to_list() == pytest.approx([2.0 / 2.1 - 1])


def test_a_contradicted_replay_is_named(tmp_path, capsys):
    costs = loops.write(tmp_path / "costs.json", loops.heavy(100))
    run = {"measured_ms": 2.1, "slept_ms": [1.0] * 4, "workers": [0, 1, 0, 1], "contradiction": None, "order_contradiction": None}
    arguments = ["whatif", str(costs), "--replay", str(tmp_path / "replay.json"), "--out", str(tmp_path / "out")]
    replay(tmp_path)
    assert program.main(arguments) == 0
    assert "cannot be contradicted" in (said := capsys.readouterr().out) and "CONTRADICTS" not in said
    for key in ("contradiction", "order_contradiction"):
        replay(tmp_path, repetitions=[run, run | {key: 2}])
        assert program.main(arguments) == 0
        said = capsys.readouterr().out
        assert "CONTRADICTED by 1 of 2" in said and "CONTRADICTS the rule of libgomp in 1 of 2 repetitions" in said
        assert pd.read_csv(tmp_path / "out/whatif_replay.csv").contradicted.to_list() == [1]


@pytest.mark.parametrize("changes, field", [({"execution": "openmp:auto"}, "execution"), *(({"execution": f"openmp:dynamic,{word}"}, "execution")
                                            for word in ("", "0", "x", "\u00b2", "-1", "9" * 30)), ({"threads": 65537}, "threads"),
                                            ({"repetitions": [{"measured_ms": 2.1, "slept_ms": [1.0] * 4, "workers": [0, 1, 0, 1]}]}, "repetitions"),
                                            ({"repetitions": [{"measured_ms": 2.1, "slept_ms": [1.0] * 4, "workers": [0] * 4, "contradiction": 4}]},
                                             "repetitions"), ({"runtime": "other"}, "runtime"), ({"threads": 0}, "threads"),
                                            ({"iterations": 3}, "repetitions"), ({"repetitions": []}, "repetitions")])
def test_bad_replays_are_refused(tmp_path, capsys, changes, field):
    costs = loops.write(tmp_path / "costs.json", loops.heavy(100))
    assert program.main(["whatif", str(costs), "--replay", str(replay(tmp_path, **changes)), "--out", str(tmp_path / "out")]) == 2
    assert f"replay.json: {field}:" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
