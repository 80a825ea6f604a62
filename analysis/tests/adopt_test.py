"""Times of an adopted program: known speedups, bad input in one line, and the files of the command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pandas as pd
import pytest

from .. import __main__ as program
from .. import adopt
from ..figures import adoption as drawing
from ..load import InputError


def points(seconds: dict[tuple[str | None, int], float], n: int = 12, noise: float = 0.01) -> list[dict[str, Any]]:
    rng = np.random.default_rng(3)
    drift = 1 + 0.2 * np.arange(n) / n  # hits all points of a block alike
    return [{"threads": threads, "schedule": schedule, "samples_ms": list(1000 * mean * drift * (1 + noise * rng.standard_normal(n))),
             "cpus_busy": float(threads), "own_times": []} for (schedule, threads), mean in seconds.items()]


def result(seconds: dict[tuple[str | None, int], float] | None = None, **timing: Any) -> dict[str, Any]:
    seconds = seconds or {("static", 1): 1.0, ("static", 2): 0.8, ("dynamic,1", 1): 1.0, ("dynamic,1", 2): 0.5}
    return {"schema": 1, "program": {"path": "/data/graphics"}, "scene": {"model": "/data/car.dat", "size": [640, 480]},
            "machine": {"cpu": "A CPU", "cpus_allowed": [0, 1]},
            "timing": {"region": "the whole process", "stop": "target", "other_load_cpus": 0.01, "points": points(seconds)} | timing}


def written(folder: Path, value: dict[str, Any]) -> Path:
    (folder / "adopt.json").write_text(json.dumps(value))
    return folder


def test_speedups_are_paired(tmp_path):
    adoption = adopt.read(written(tmp_path, result()))
    speedups = {(p.schedule, p.threads): adoption.speedup(p) for p in adoption.points}
    assert speedups["dynamic,1", 2].low < 2 < speedups["dynamic,1", 2].high
    assert speedups["dynamic,1", 2].high - speedups["dynamic,1", 2].low < 0.1, "the drift of 20 % is not in a paired ratio"
    assert speedups["static", 2].low < 1.25 < speedups["static", 2].high
    assert speedups["static", 1].value == 1 and not speedups["static", 1].has_interval


def test_table(tmp_path):
    table = adopt.table(adopt.read(written(tmp_path, result())))
    rows = table.numbers.set_index(["schedule", "threads"])
    assert rows.loc[("dynamic,1", 2), "verdict"] == "best" and rows.loc[("static", 1), "verdict"] == "slower"
    assert rows.loc[("dynamic,1", 2), "efficiency"] == pytest.approx(1, abs=0.03)
    assert "n = 12" in table.note and "A CPU, 2 CPUs allowed" in table.note and "own_median" not in rows
    assert list(table.words["speedup"])[0] == "base"


def test_equal_points_are_not_told_apart(tmp_path):
    same = {(s, n): 1.0 for s in ("static", "guided") for n in (1, 2)}
    adoption = adopt.read(written(tmp_path, result(same)))
    assert "slower" not in {c.verdict for c in adoption.comparisons}


def test_own_times(tmp_path):
    value = result()
    for point in value["timing"]["points"]:
        point["own_times"] = [3.0, 4.0, 5.0]
    table = adopt.table(adopt.read(written(tmp_path, value)))
    assert set(table.numbers["own_median"]) == {4.0} and "own time" in table.words


def test_captions_say_base_interval_n_and_machine(tmp_path):
    quiet = list(drawing.draw(adopt.read(written(tmp_path, result()))))
    assert [d.name for d in quiet] == ["adopt_scaling", "adopt_times"]
    for drawn in quiet:
        for words in ("95 % intervals", "n = 12", "A CPU", "the whole process"):
            assert words in drawn.caption.body, words
        assert "Noisy" not in drawn.caption.body
    assert "OMP_NUM_THREADS=1" in quiet[0].caption.body
    noisy = next(drawing.draw(adopt.read(written(tmp_path, result(other_load_cpus=0.9)))))
    assert "Noisy machine: other programs kept 0.900 CPUs busy" in noisy.caption.body


def test_few_samples_have_no_intervals(tmp_path):
    adoption = adopt.read(written(tmp_path, result(points=points({(None, 1): 1.0, (None, 2): 0.5}, n=3))))
    assert adoption.schedules == [adopt.AS_COMPILED]
    assert not any(adoption.speedup(p).has_interval for p in adoption.points)
    assert "without intervals" in next(drawing.draw(adoption)).caption.body


def test_one_thread_has_no_curve(tmp_path):
    drawn = list(drawing.draw(adopt.read(written(tmp_path, result({("static", 1): 1.0, ("guided", 1): 1.1})))))
    assert [d.name for d in drawn] == ["adopt_times"]


def test_many_schedules_share_pages(tmp_path):
    many = {(f"dynamic,{chunk}", n): 1 / n for chunk in range(1, 61) for n in (1, 2)}
    names = [d.name for d in drawing.draw(adopt.read(written(tmp_path, result(many))))]
    assert names == ["adopt_scaling", "adopt_times_1", "adopt_times_2"]


def test_files(tmp_path, capsys):
    written(tmp_path, result())
    assert program.main(["adopt", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "dynamic,1" in out and "fastest" in out
    for name in ("adopt_scaling", "adopt_times"):
        assert matplotlib.image.imread(tmp_path / f"figures/{name}.png").shape[1] > 800
        assert (tmp_path / f"figures/{name}.svg").stat().st_size > 1000
        assert len((tmp_path / f"figures/{name}.txt").read_text().splitlines()) == 2
    assert len(pd.read_csv(tmp_path / "tables/adopt.csv")) == 4
    assert r"\toprule" in (tmp_path / "tables/adopt.tex").read_text()


def broken(change) -> dict[str, Any]:
    value = result()
    change(value)
    return value


@pytest.mark.parametrize("value, words", [
    (broken(lambda v: v.pop("schema")), ["schema"]),
    (broken(lambda v: v.update(schema=9)), ["schema", "9"]),
    (broken(lambda v: v.update(timing=None)), ["timing", "judged wrong"]),
    (broken(lambda v: v.update(machine=3)), ["machine"]),
    (broken(lambda v: v["timing"].update(points=[])), ["timing.points"]),
    (broken(lambda v: v["timing"]["points"].insert(0, 3)), ["timing.points[0]"]),
    (broken(lambda v: v["timing"]["points"][1].update(threads=0)), ["timing.points[1].threads", "0"]),
    (broken(lambda v: v["timing"]["points"][1].update(schedule=4)), ["timing.points[1].schedule"]),
    (broken(lambda v: v["timing"]["points"][1].update(samples_ms=[1, -1])), ["timing.points[1].samples_ms"]),
    (broken(lambda v: v["timing"]["points"][1].update(cpus_busy="2")), ["timing.points[1].cpus_busy"]),
    (broken(lambda v: v["timing"]["points"][1].update(own_times=["2"])), ["timing.points[1].own_times"]),
    (broken(lambda v: v["timing"]["points"].pop(0)), ["static", "1 among them"]),
    (broken(lambda v: v["timing"]["points"][0]["samples_ms"].pop()), ["different numbers of samples"]),
], ids=lambda value: "" if isinstance(value, dict) else value[0])
def test_bad_input(value, words, tmp_path, capsys):
    with pytest.raises(InputError) as error:
        adopt.read(written(tmp_path, value))
    assert all(word in str(error.value) for word in ["adopt.json", *words]) and "\n" not in str(error.value)
    assert program.main(["adopt", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_no_such_folder(tmp_path, capsys):
    assert program.main(["adopt", str(tmp_path / "none")]) == 2
    assert "rasterbench adopt" in capsys.readouterr().err
