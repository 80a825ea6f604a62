"""The report's verdicts on points compared with themselves."""

from __future__ import annotations

import json

import numpy as np
import pytest

from .. import __main__ as program
from .. import selftest


def write(path, comparisons=60, factor=1.0, launch_spread=0.02, same_launches=True, seed=1):
    """Labels that share launches and blocks, whose launches differ, and which drift; b takes `factor` times as long."""
    rng = np.random.default_rng(seed)
    lines = []
    for index in range(comparisons):
        blocks = np.arange(25)
        launches = blocks % 5
        common = np.exp(rng.normal(0, launch_spread, 5)[launches] + 0.002 * blocks)
        entry = {"comparison": index}
        for label, times in (("a", 1.0), ("b", factor)):
            own = 1.0 if same_launches else np.exp(rng.normal(0, launch_spread, 5)[launches])
            values = times * 10 * common * own * np.exp(rng.normal(0, 0.01, 25))
            entry[label] = {"samples_ms": values.tolist(), "blocks": blocks.tolist(), "launches": launches.tolist(), "stop": "target"}
        lines.append(json.dumps(entry))
    path.write_text("\n".join(lines) + "\n")
    return path


def test_equal_labels(tmp_path, capsys):
    """Drift and launches that both labels meet make no difference."""
    path = write(tmp_path / "self.jsonl")
    assert program.main(["selftest", str(path)]) == 0
    outcome = selftest.judge(selftest.read(path))
    assert outcome.verdicts["slower"] <= 6 and outcome.false_ratios <= 8  # 3 of 60 are stated
    out = capsys.readouterr().out
    assert "60 comparisons" in out and "no more often than stated" in out


def test_launches_of_their_own_do_not_make_the_report_differ(tmp_path):
    """The report asks the launches, too; an interval over blocks alone would not."""
    outcome = selftest.judge(selftest.read(write(tmp_path / "self.jsonl", same_launches=False)))
    assert outcome.verdicts["slower"] <= 6


def test_labels_that_do_differ_are_told(tmp_path, capsys):
    path = write(tmp_path / "self.jsonl", factor=1.1)
    assert program.main(["selftest", str(path)]) == 1
    assert "BROKEN" in capsys.readouterr().out
    assert selftest.judge(selftest.read(path)).verdicts["slower"] == 60


@pytest.mark.parametrize("change, place", [
    (lambda v: v.pop("a"), "a"), (lambda v: v["b"].update(samples_ms=[]), "b.samples_ms"), (lambda v: v["b"].update(blocks="x"), "b.blocks"),
    (lambda v: v["a"]["samples_ms"].__setitem__(0, -1.0), "a.samples_ms"), (lambda v: v["a"]["launches"].pop(), "a.samples_ms"),
])
def test_bad_input(tmp_path, capsys, change, place):
    path = write(tmp_path / "self.jsonl", comparisons=3)
    lines = path.read_text().splitlines()
    value = json.loads(lines[1])
    change(value)
    path.write_text("\n".join([lines[0], json.dumps(value), lines[2]]))
    assert program.main(["selftest", str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and f"self.jsonl:2: {place}" in err


def test_missing_or_empty(tmp_path, capsys):
    (tmp_path / "empty").write_text("")
    for name in ("none", "empty"):
        assert program.main(["selftest", str(tmp_path / name)]) == 2
        assert name in capsys.readouterr().err
