"""Order and completeness of the journal: blocks, launches, and what stops a point."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from .program import events, json_lines, sampling, sweep
from .studies import Record, Study


def test_blocks_are_complete_and_in_random_order(study: Study) -> None:
    """In each block every point that is not finished has exactly one sample; finished ones only as bases of others."""
    timed = {r["id"]: r for r in study.records if r["status"] == "ok"}
    finished: set[str] = set()
    orders: list[list[str]] = []
    journal = [e for e in json_lines(study.folder / "journal.jsonl") if e["event"] in ("sample", "stop")]
    for kind, group in groupby(journal, key=lambda e: (e["event"], e.get("block"))):
        ids = [e["id"] for e in group]
        if kind[0] == "stop":
            finished.update(ids)
            continue
        assert kind[1] == len(orders), "blocks are numbered in order and not interleaved"
        assert len(ids) == len(set(ids)), "a point twice in a block"
        assert set(timed) - finished <= set(ids), "an open point was left out"
        for extra in set(ids) & finished:
            assert timed[extra]["config"]["threads"] == 1
        orders.append(ids)
    assert finished == set(timed)
    assert len({tuple(order) for order in orders}) > len(orders) / 2
    assert len({order[0] for order in orders}) > 2


def test_records_repeat_the_journal(study: Study) -> None:
    taken: dict[str, list[Record]] = {}
    for e in events(study.folder, "sample"):
        taken.setdefault(e["id"], []).append(e)
    for r in (r for r in study.records if r["status"] == "ok"):
        mine = taken[r["id"]]
        assert [e["answer"]["ms"] for e in mine] == r["samples_ms"] and [e["block"] for e in mine] == r["blocks"]
        assert [e["launch"] for e in mine] == r["launches"]
        (stop,) = [e["reason"] for e in events(study.folder, "stop") if e["id"] == r["id"]]
        assert stop == r["stop"]


def test_stopping(good: Study, mixed: Study) -> None:
    assert all(r["stop"] in ("target", "max_samples") and len(r["samples_ms"]) == 60 for r in good.records)
    for r in (r for r in mixed.records if r["status"] == "ok"):
        assert r["stop"] in ("target", "max_samples") and 6 <= len(r["samples_ms"])


def test_launches_alternate(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(8, launches=2), sweep("row_parallel", ["serial", "openmp:static"], threads=1, binding=["none", "close"]))
    assert study.outcome.code == 0
    for r in (r for r in study.records if r["status"] == "ok"):
        assert r["blocks"] == list(range(8)) and r["launches"] == [0, 1] * 4


def test_time_limit_leaves_at_least_one_sample(tmp_path: Path) -> None:
    study = Study(tmp_path, sampling(5000), sweep("row_parallel", ["serial", "openmp:static"], size="400x300", threads=1), options=("--time-limit", 1))
    assert study.outcome.code == 0
    for r in study.records:
        assert (r["status"], r["stop"]) == ("ok", "time_limit") and 1 <= len(r["samples_ms"]) < 5000
