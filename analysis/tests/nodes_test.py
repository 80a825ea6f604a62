"""Merged studies: what was measured on several nodes says so wherever it is compared."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable

import pytest

from .. import checks, findings, nodes, report
from .. import __main__ as program
from . import synthetic
from .conftest import analyse

OLD, NEW = "Old CPU, 4 cores in 1 packages", "New CPU, 64 cores in 2 packages"


def on(places: dict[str, tuple[str, str]]) -> Callable[[list[dict[str, Any]]], None]:
    """Gives each scene's records the node and type of `places`."""
    def edit(records: list[dict[str, Any]]) -> None:
        for entry in records:
            node, kind = places[entry["config"]["scene"]]
            entry["origin"] = {"node": node, "node_type": kind, "family": entry["config"]["scene"], "job": "7_1", "restart": 0}
    return edit


@pytest.fixture
def scenes() -> dict[str, Any]:
    return {name: synthetic.SCENES[name] for name in list(synthetic.SCENES)[:2]}


def test_a_study_of_one_machine_says_nothing_of_nodes(study: Callable[..., Path]) -> None:
    analysis = analyse(study())
    assert nodes.tables(analysis) == [] and nodes.remark(analysis.study) == ""
    assert "Example CPU 9000" in analysis.machine


def test_two_types_are_named_where_they_meet(study: Callable[..., Path], scenes: dict[str, Any]) -> None:
    first, second = scenes
    analysis = analyse(study(scenes=scenes, edit=on({first: ("n1", OLD), second: ("n2", NEW)})))
    warned = [w for w in checks.check(analysis) if "types of nodes" in w.text]
    assert [w.severity for w in warned] == [checks.NOT_PUBLISHABLE] and OLD in warned[0].text and NEW in warned[0].text
    assert not any("compared were measured on different nodes" in w.text for w in checks.check(analysis))
    of = {scene: [r for r in analysis.study.records if r.config.scene == scene] for scene in scenes}
    assert nodes.machine(of[first]) == f"{OLD} (node n1)" and nodes.machine(of[second]) == f"{NEW} (node n2)"
    assert nodes.machine(analysis.study.records).startswith("mixed: ")
    assert all("2 types of nodes" in finding.text for finding in findings.top(analysis))
    (table,) = nodes.tables(analysis)
    assert list(table.words["node"]) == ["n1", "n2"] and list(table.words["type"]) == [OLD, NEW]
    written = report.write(analysis)
    page = written.path.read_text()
    captions = (written.path.parent / "figures/captions.txt").read_text()
    assert OLD in page and NEW in page and f"Machine: {OLD} (node n1)." in captions and f"Machine: {NEW} (node n2)." in captions


def test_one_type_on_two_nodes_is_a_note(study: Callable[..., Path], scenes: dict[str, Any]) -> None:
    first, second = scenes
    analysis = analyse(study(scenes=scenes, edit=on({first: ("n1", OLD), second: ("n2", OLD)})))
    assert [w.severity for w in checks.check(analysis) if "2 nodes of one type" in w.text] == [checks.NOTE]
    assert nodes.remark(analysis.study) == ""


def test_a_group_on_two_nodes_is_not_publishable(study: Callable[..., Path]) -> None:
    def edit(records: list[dict[str, Any]]) -> None:
        for number, entry in enumerate(records):
            entry["origin"] = {"node": f"n{number % 2}", "node_type": OLD}
    analysis = analyse(study(edit=edit))
    assert any("compared were measured on different nodes" in w.text and w.severity == checks.NOT_PUBLISHABLE for w in checks.check(analysis))


@pytest.mark.parametrize("origin", [7, {"node": 3, "node_type": "x"}, {"node": "n1"}])
def test_a_wrong_origin_is_refused(origin: object, study: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    directory = study(edit=lambda records: records[0].update(origin=origin))
    assert program.main(["report", str(directory)]) == 2
    assert "records.jsonl:1: origin" in capsys.readouterr().err


@pytest.mark.parametrize("job, warned", [
    ({"mask_cpus": 4, "cpus_per_task": 4, "exclusive": True}, []),
    ({"mask_cpus": 8, "cpus_per_task": 4, "exclusive": True}, []),  # hardware threads
    ({"mask_cpus": 1, "cpus_per_task": 4, "exclusive": True}, ["fewer CPUs than they reserved (first: 1 of 4 on n1)"]),
    ({"mask_cpus": 4, "cpus_per_task": 4, "exclusive": False}, ["did not have their node to themselves"])])
def test_jobs_that_were_given_less_are_called_so(job: dict[str, Any], warned: list[str], study: Callable[..., Path]) -> None:
    directory = study()
    context = json.loads((directory / "context.json").read_text())
    context["parts"] = [{"family": "f", "provenance": job | {"node": "n1"}}]
    (directory / "context.json").write_text(json.dumps(context))
    said = [w.text for w in checks.check(analyse(directory)) if "of 1 job" in w.text]
    assert len(said) == len(warned) and all(words in text for words, text in zip(warned, said))
