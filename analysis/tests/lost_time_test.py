"""The lost-time identity: its terms on times that are known, that it closes, and where there is none."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import pytest

from .. import lost_time, report
from ..figures import balance
from ..figures.lost_time import draw, shares
from ..load import HELD_UP_KEYS, InputError
from .conftest import analyse
from .synthetic import loop_of, plan, write

MakeStudy = Callable[..., Path]


def set_times(directory: Path, times: Callable[[dict[str, Any]], tuple[float, list[float]] | None], others: float = 4.0) -> None:
    """Gives every record `raster` ms of raster stage, `busy` ms of each thread, and `others` ms of other stages."""
    lines = []
    for line in (directory / "records.jsonl").read_text().splitlines():
        value = json.loads(line)
        found = times(value["config"]) if value["status"] == "ok" else None
        if found:
            raster, busy = found
            n = len(value["samples_ms"])
            value["samples_ms"] = [raster + others] * n
            value["stages_ms"] = {"clear": [others / 4] * n, "geometry": [others / 2] * n, "raster": [raster] * n, "resolve": [others / 4] * n}
            value["per_thread"] = [{"busy_ms": b, "iterations": 10, "cpu": i} for i, b in enumerate(busy)]
            value["raster_loop"] = loop_of(busy, raster)
        lines.append(json.dumps(value))
    (directory / "records.jsonl").write_text("\n".join(lines) + "\n")


def known(config: dict[str, Any]) -> tuple[float, list[float]]:
    """Serial: 20 ms, 18 of them in loops. On one thread handing out takes 1 ms more; on two 12 and 9 ms are busy, of 15."""
    if config["backend"] == "serial":
        return 20.0, [18.0]
    return (21.0, [19.0]) if config["threads"] == 1 else (15.0, [12.0, 9.0])


def found(directory: Path, kernel: str = "tile_parallel") -> lost_time.LostTime:
    analysis = analyse(directory)
    return next(one for one in lost_time.lost_times(analysis, analysis.groups[0]) if one.record.config.kernel == kernel)


def test_terms_of_known_times(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    one = found(directory)
    assert one.over_serial and (one.total, one.useful, one.lost) == (38, 24, 14)
    assert one.terms == pytest.approx({"inflation": 2, "locks": 0, "imbalance": 3, "dispatch": 1, "synchronisation": 2, "serial": 2, "others": 4, "residual": 0})


def test_stages_are_of_frames_that_were_seen(study: MakeStudy) -> None:
    """A third of the frames takes 19 ms, a third 6 more in raster, a third 6 more in geometry: medians of 15, 4 and 25 ms do not add up."""
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)

    def three_kinds(value: dict[str, Any]) -> None:
        for i in range(len(value["samples_ms"])):
            value["samples_ms"][i] += 6.0 if i % 3 else 0.0
            value["stages_ms"]["raster"][i] += 6.0 if i % 3 == 1 else 0.0
            value["stages_ms"]["geometry"][i] += 6.0 if i % 3 == 2 else 0.0

    edit(directory, lambda value: three_kinds(value) if value["config"]["threads"] == 2 else None)
    one = found(directory)
    assert one.total == 50 and one.terms["others"] == pytest.approx(2 * (4 + 3) - 4, abs=2)  # half of the frames of 25 ms; medians say 4
    assert one.terms["residual"] == pytest.approx(6, abs=2)  # the synthetic busy times are those of the short raster stage


def test_a_serial_point_alone_is_base_enough(study: MakeStudy) -> None:
    def no_point_on_one_thread(records: list[dict[str, Any]]) -> None:
        records[:] = [r for r in records if r["config"]["backend"] == "serial" or r["config"]["threads"] > 1]

    directory = study(kernels=["tile_parallel"], edit=no_point_on_one_thread)
    set_times(directory, known)
    one = found(directory)
    assert one.over_serial and one.terms == pytest.approx(
        {"inflation": 3, "locks": 0, "imbalance": 3, "dispatch": None, "synchronisation": 2, "serial": 2, "others": 4, "residual": 0})
    assert "cannot be told" in lost_time.tables(analyse(directory))[0].note
    drawn = list(draw(analyse(directory)))
    assert drawn and "where the study has both (0 of" in drawn[0].caption.body


def test_waiting_for_locks_is_not_work_inflation(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    edit(directory, lambda value: (value["raster_loop"] or {}).update(lock_wait_ms=1.5 * (value["config"]["threads"] - 1), failed_exchanges=7.0))
    one = found(directory)
    assert (one.terms["locks"], one.terms["inflation"], one.terms["residual"], one.failed_exchanges) == (1.5, 0.5, 0, 7)
    numbers = lost_time.tables(analyse(directory))[0].numbers
    assert set(numbers["locks_ms"]) == {1.5} and set(numbers["failed_exchanges"]) == {7}


def test_records_from_before_contention_was_counted(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    edit(directory, lambda value: [(value["raster_loop"] or {}).pop(key, None) for key in HELD_UP_KEYS])
    one = found(directory)
    assert one.terms["locks"] is None and one.failed_exchanges is None and one.terms["residual"] == pytest.approx(0)
    (table,) = lost_time.tables(analyse(directory))
    assert set(table.words["waiting for locks"]) == {"–"} == set(table.words["failed exchanges"]) and "waiting for locks is not known" in table.note
    assert any("waiting for locks is not known" in drawn.caption.body for drawn in draw(analyse(directory)))
    edit(directory, lambda value: (value["raster_loop"] or {}).update(lock_wait_ms=-1))
    with pytest.raises(InputError, match="records.jsonl:1.*raster_loop.lock_wait_ms"):
        analyse(directory)


def test_without_a_serial_point_dispatch_is_unknown(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    kept = [line for line in (directory / "records.jsonl").read_text().splitlines() if json.loads(line)["config"]["backend"] != "serial"]
    (directory / "records.jsonl").write_text("\n".join(kept) + "\n")
    one = found(directory)
    assert not one.over_serial and (one.total, one.useful) == (38, 25) and one.terms["dispatch"] is None
    assert one.terms["residual"] == pytest.approx(0) and one.terms["serial"] == 2 and "dispatch" not in shares(one)
    (table,) = lost_time.tables(analyse(directory))
    assert "dispatch cannot be told" in table.note and set(table.words["dispatch"]) == {"–"}


def test_residual_is_what_the_stages_leave(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    lines = []
    for line in (directory / "records.jsonl").read_text().splitlines():
        value = json.loads(line)
        if value["config"]["threads"] == 2:
            value["samples_ms"] = [20.0] * len(value["samples_ms"])  # 1 ms in no stage
        lines.append(json.dumps(value))
    (directory / "records.jsonl").write_text("\n".join(lines) + "\n")
    one = found(directory)
    assert one.total == 40 and one.terms["residual"] == pytest.approx(2)
    assert lost_time.worst_residual([one]) == pytest.approx(0.05)


def edit(directory: Path, change: Callable[[dict[str, Any]], None]) -> None:
    values = [json.loads(line) for line in (directory / "records.jsonl").read_text().splitlines()]
    for value in values:
        change(value)
    (directory / "records.jsonl").write_text("\n".join(map(json.dumps, values)) + "\n")


def alternating(value: dict[str, Any]) -> None:
    """Frames of (10, 5) and (5, 10) ms busy: the medians of the threads are even, no frame is."""
    if value["config"]["threads"] == 2:
        value["per_thread"] = [{"busy_ms": 7.5, "iterations": 10, "cpu": i} for i in range(2)]
        value["raster_loop"] = loop_of([10.0, 5.0], 15.0)


def test_imbalance_is_that_of_the_samples_and_not_of_the_medians(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    edit(directory, alternating)
    one = found(directory)
    assert one.terms["imbalance"] == 5 and one.terms["inflation"] == -4 and one.terms["residual"] == pytest.approx(0)
    assert balance.imbalance(one.record) == pytest.approx(10 / 7.5)
    assert "older version" not in lost_time.tables(analyse(directory))[0].note


def test_older_records_are_said_to_have_medians_of_threads(study: MakeStudy) -> None:
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)
    edit(directory, lambda value: value.pop("raster_loop", None))
    one = found(directory)
    assert not one.per_sample and one.terms["imbalance"] == 3 and one.terms["synchronisation"] == 2
    assert "older version" in lost_time.tables(analyse(directory))[0].note
    analysis = analyse(directory)
    for drawings in (list(draw(analysis)), list(balance.draw(analysis))):
        assert drawings and all("older version" in d.caption.body for d in drawings)


def test_synchronisation_is_what_the_samples_say_and_not_the_remainder(study: MakeStudy) -> None:
    """Else the residual would be 0 whatever the busy times are."""
    directory = study(kernels=["tile_parallel"])
    set_times(directory, known)

    def beyond(value: dict[str, Any]) -> None:
        if value["config"]["threads"] == 2:  # busier than the stage is long: nothing can lie outside
            value["raster_loop"] = loop_of([18.0, 18.0], 15.0)

    edit(directory, beyond)
    one = found(directory)
    assert one.terms["synchronisation"] == -4 and one.terms["residual"] == pytest.approx(-6)


@pytest.mark.parametrize("loop", [{}, {"busy_mean_ms": 1}, [1], {"busy_mean_ms": 1, "busy_longest_ms": -1, "imbalance_ms": 0, "outside_ms": 0}])
def test_a_bad_raster_loop_is_named(study: MakeStudy, loop: Any) -> None:
    directory = study(kernels=["tile_parallel"])
    edit(directory, lambda value: value.update(raster_loop=loop))
    with pytest.raises(InputError, match="records.jsonl:1.*raster_loop"):
        analyse(directory)


@pytest.mark.parametrize("without", ["one thread", "stamps"])
def test_none_where_something_is_missing(study: MakeStudy, without: str) -> None:
    def no_base(records: list[dict[str, Any]]) -> None:
        records[:] = [r for r in records if r["config"]["threads"] > 1]

    directory = study(kernels=["tile_parallel"], edit=no_base if without == "one thread" else None)
    set_times(directory, lambda config: known(config) if without == "one thread" else (known(config)[0], [0.0] * config["threads"]))
    analysis = analyse(directory)
    assert lost_time.lost_times(analysis, analysis.groups[0]) == [] and lost_time.tables(analysis) == [] and list(draw(analysis)) == []


def test_figure_table_and_report(tmp_path: Path) -> None:
    directory = write(tmp_path / "study", plan(threads=[1, 2]))
    analysis = analyse(directory)
    for group in analysis.groups:
        for one in lost_time.lost_times(analysis, group):
            assert sum(term for term in one.terms.values() if term is not None) == pytest.approx(one.lost)
            assert sum(shares(one).values()) == pytest.approx(100)
    drawings = list(draw(analysis))
    assert drawings and all("largest residual" in d.caption.body and "T(1) is" in d.caption.body for d in drawings)
    written = report.write(analysis)
    assert f"<h2>{lost_time.SECTION}</h2>" in written.path.read_text()
    assert (directory / "tables/lost_time.csv").is_file()
