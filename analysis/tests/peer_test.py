"""A peer is shown beside the kernels of its scene and size, called one, and takes part in no comparison between kernels."""

from __future__ import annotations

import copy
from typing import Any, Callable

import pytest

from .. import findings, load, report, tables
from ..comparison import PEER_AXES
from ..figures import times
from . import synthetic
from .conftest import FEW, analyse


def peer_of(entry: dict[str, Any], threads: int, factor: float = 0.01) -> dict[str, Any]:
    """A peer's record on the scene of `entry`; by default far faster than anything else, so that it would win if it took part."""
    own = copy.deepcopy(entry)
    own["config"] |= {"kernel": "llvmpipe", "numeric": "llvmpipe", "backend": "llvmpipe", "schedule": None, "chunk": None,
                      "threads": threads, "tile": None, "isa": "jit", "binding": "none", "wait_policy": "default", "runtime": "default"}
    own["samples_ms"] = [factor * ms for ms in own["samples_ms"]]
    for key in ("median_ms", "min_ms", "max_ms"):
        own[key] *= factor
    own["interval_ms"] = [factor * bound for bound in own["interval_ms"]]
    own["stages_ms"] = {"clear": None, "geometry": None, "raster": own["samples_ms"], "resolve": None}
    own |= {"id": synthetic.digest(own["config"]), "name": synthetic.name(own["config"]), "per_thread": [], "threads_observed": threads,
            "verify": {"conforms": None, "oracle": None, "embree": None, "end_to_end": {"identical": 9, "edge_ties": 1, "errors": 0},
                       "peer": {"renderer": "llvmpipe (LLVM 15.0.6, 256 bits)", "version": "4.5 (Core Profile) Mesa 22.3.6"}}}
    return own


def add_peers(entries: list[dict[str, Any]]) -> None:
    first = {entry["config"]["scene"]: entry for entry in reversed(entries)}
    entries += [peer_of(entry, threads) for entry in first.values() for threads in (1, 2)]


def only_peers(entries: list[dict[str, Any]]) -> None:
    add_peers(entries)
    entries[:] = [entry for entry in entries if entry["config"]["backend"] == "llvmpipe"]


def test_nothing_that_is_said_of_kernels_changes(study: Callable[..., Any], tmp_path: Any) -> None:
    alone, beside = analyse(study()), analyse(study(edit=add_peers))
    assert len(beside.study.peers) == 2 and beside.study.records != []
    assert [g.best.id for g in beside.groups] == [g.best.id for g in alone.groups]
    assert beside.serial_base.keys() == alone.serial_base.keys() == beside.thread_base.keys()
    assert {k: b and b.id for k, b in beside.serial_base.items()} == {k: b and b.id for k, b in alone.serial_base.items()}
    assert [f.text for f in findings.candidates(beside) if f.kind not in ("failed", "skipped")] == [
        f.text for f in findings.candidates(alone) if f.kind not in ("failed", "skipped")]
    for bases in (beside.serial_base, beside.thread_base):
        assert not any(base.config.is_peer for base in bases.values() if base is not None)


def test_it_is_beside_every_group_of_its_scene_and_size(study: Callable[..., Any]) -> None:
    analysis = analyse(study(scenes=synthetic.SCENES, edit=add_peers))
    for group in analysis.groups:
        assert [r.config.threads for r in group.peers] == [1, 2]
        for peer in group.peers:
            assert all(getattr(peer.config, axis) == getattr(group.records[0].config, axis) for axis in PEER_AXES)
    assert [g.kernels for g in analysis.groups if "llvmpipe" in g.kernels] == []


def test_tables_call_it_a_peer(study: Callable[..., Any]) -> None:
    analysis = analyse(study(edit=add_peers))
    table = tables.points(analysis, analysis.groups[0])
    rows = table.words[table.words["kernel"] == "llvmpipe (peer)"]
    assert len(rows) == 2 and set(rows["verdict"]) == {"within its bound"} and set(rows["speedup (a)"]) == set(rows["speedup (b)"]) == {""}
    assert "llvmpipe" not in set(table.words["kernel"]) and "no base" in table.note
    numbers = table.numbers[table.numbers["kernel"] == "llvmpipe (peer)"]
    assert (numbers["time_over_fastest"] < 1).all() and numbers["base_a"].isna().all()
    assert "llvmpipe (peer)" in tables.plain(analysis)


def test_the_figure_of_times_has_its_own_block(study: Callable[..., Any]) -> None:
    analysis = analyse(study(edit=add_peers))
    (drawing,) = times.draw(analysis)
    said = [t.get_text() for axes in drawing.figure.axes for t in axes.texts] + [t.get_text() for t in drawing.figure.texts]
    assert "llvmpipe (peer)" in said and "llvmpipe (peer)" not in [t for t in said if t.endswith("fastest")]
    assert "A peer is another program" in drawing.caption.body


@pytest.mark.parametrize("edit", [add_peers, only_peers])
def test_a_report_holds_it(study: Callable[..., Any], edit: Any) -> None:
    written = report.write(analyse(study(edit=edit)))
    page = written.path.read_text()
    assert "llvmpipe (peer)" in page and len(written.findings) == 3
    assert "time_teapot" in page and "the context plans" not in page and "without a verdict that it conforms" not in page


def test_a_report_of_small_groups_holds_it(study: Callable[..., Any]) -> None:
    """Several numeric modes, each with too few points for figures of its own."""
    def more_modes(entries: list[dict[str, Any]]) -> None:
        for entry in list(entries):
            other = copy.deepcopy(entry)
            other["config"]["numeric"] = "f64"
            entries.append(other | {"id": synthetic.digest(other["config"]), "name": synthetic.name(other["config"])})
        add_peers(entries)

    page = report.write(analyse(study(kernels=["scanline", "tile_parallel"], schedules=FEW[:1], edit=more_modes))).path.read_text()
    assert "numerics_teapot" in page and "llvmpipe (peer)" in page


@pytest.mark.parametrize("verify", [{}, {"end_to_end": None}, {"end_to_end": {"errors": 3}}])
def test_one_that_is_not_within_its_bound_shows_no_speed(study: Callable[..., Any], verify: dict[str, Any]) -> None:
    def spoil(entries: list[dict[str, Any]]) -> None:
        add_peers(entries)
        entries[-1]["verify"] = verify

    loaded = load.load(study(edit=spoil))
    assert [p.ok for p in loaded.peers] == [True, False]
    assert "bound" in loaded.peers[1].reason and loaded.peers[1].status == "failed"


def test_a_skipped_peer_is_listed_with_its_reason(study: Callable[..., Any]) -> None:
    def skip(entries: list[dict[str, Any]]) -> None:
        add_peers(entries)
        for entry in entries[-2:]:
            synthetic.withhold(entry, "skipped", "EGL and OpenGL were not found at build time")
            entry["verify"] = None

    analysis = analyse(study(edit=skip))
    assert any("EGL and OpenGL" in reason for reason in tables.not_timed(analysis).words["reason"])
    assert report.write(analysis).path.read_text().count("EGL and OpenGL were not found") > 0
