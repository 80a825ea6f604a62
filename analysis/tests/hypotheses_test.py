"""Hypotheses: verdicts on effects that are known, their error rate where nothing is true, and where they are shown."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any, Callable

import pytest

from .. import findings, hypotheses, lint, report
from ..figures.hypotheses import draw
from ..hypotheses import NOT_TESTED, REFUTED, SUPPORTED, UNDECIDED
from ..load import InputError
from .conftest import analyse

MakeStudy = Callable[..., Path]
ON = "teapot/640x360/tile_parallel/f32/top-left/clip/"
STATIC, DYNAMIC, TBB = f"{ON}openmp:static/2", f"{ON}openmp:dynamic,1/2", f"{ON}tbb:auto/2"


def claim(faster: str | list[str], slower: str | list[str], by: float = 0.0, untested: str | None = None) -> dict[str, Any]:
    names = [[side] if isinstance(side, str) else side for side in (faster, slower)]
    return {"claim": f"{by:+g}", "by": by, "faster": names[0], "slower": names[1], "untested": untested}


def state(directory: Path, *claims: dict[str, Any], key: str = "hypotheses") -> None:
    path = directory / "context.json"
    context = json.loads(path.read_text())
    context["study"][key] = list(claims)
    path.write_text(json.dumps(context, indent=1) + "\n")


SMALL = dict(launches=5, blocks=4, kernels=["tile_parallel"], threads=[2], untimed=False)


def words(directory: Path) -> list[str]:
    return [v.word for v in hypotheses.verdicts(analyse(directory))]


def test_known_effects(study: MakeStudy) -> None:
    """static takes 1.25 times as long as dynamic, and as long as tbb:auto."""
    directory = study(**SMALL)
    state(directory, claim(DYNAMIC, STATIC, 0.1), claim(DYNAMIC, STATIC, 0.4), claim(TBB, STATIC), claim(STATIC, DYNAMIC),
          claim(STATIC, DYNAMIC, -0.5), claim(TBB, STATIC, -0.1))
    assert words(directory) == [SUPPORTED, REFUTED, UNDECIDED, REFUTED, SUPPORTED, SUPPORTED]
    first = hypotheses.verdicts(analyse(directory))[0]
    assert first.ratio.low < 1.25 < first.ratio.high and first.ratio.n == 20 and first.bound == pytest.approx(1.1)
    assert first.faster.name == DYNAMIC and first.slower.name == STATIC


def test_the_best_of_several(study: MakeStudy) -> None:
    directory = study(**SMALL)
    state(directory, claim([STATIC, DYNAMIC, TBB], f"{ON}serial/1", 0.1), claim([STATIC, DYNAMIC], TBB, 0.1), claim(DYNAMIC, [STATIC, TBB], 0.1),
          claim(STATIC, [DYNAMIC, TBB]), claim([STATIC, TBB], DYNAMIC))
    found = hypotheses.verdicts(analyse(directory))
    assert [v.word for v in found] == [SUPPORTED, SUPPORTED, SUPPORTED, REFUTED, REFUTED]
    assert found[0].faster.name == DYNAMIC and found[0].sides == (3, 1)
    alone = analyse(directory).speedup(found[0].faster, found[0].slower)
    assert found[0].ratio.low < alone.low and found[0].ratio.high > alone.high, "it was picked, so its interval is wider"


def test_p_is_corrected_over_the_hypotheses(study: MakeStudy) -> None:
    directory = study(**SMALL)
    state(directory, claim(DYNAMIC, STATIC, 0.2))
    (alone,) = hypotheses.verdicts(analyse(directory))
    state(directory, claim(DYNAMIC, STATIC, 0.2), *[claim(TBB, STATIC, 0.001 * i) for i in range(9)])
    among = hypotheses.verdicts(analyse(directory))[0]
    assert alone.p_holm == alone.p and among.p == alone.p and among.p_holm == pytest.approx(10 * alone.p)


def test_few_samples_decide_nothing(study: MakeStudy) -> None:
    directory = study(**SMALL | {"launches": 1})
    state(directory, claim(DYNAMIC, STATIC, 0.1))
    assert words(directory) == [UNDECIDED]


@pytest.mark.parametrize("several", [False, True])
def test_error_rate_where_the_truth_is_the_bound(study: MakeStudy, several: bool) -> None:
    """An A/A study claims that nothing is faster by 0: a verdict is an error, also where the fastest was picked. At 5 % of 40
    studies 6 errors or more come in one test of seventy."""
    errors = 0
    for seed in range(40):
        directory = study(**SMALL, same=True, seed=seed)
        state(directory, claim([DYNAMIC, TBB] if several else DYNAMIC, STATIC))
        errors += words(directory) != [UNDECIDED]
    assert errors < 6


def test_launches_that_disagree_decide_nothing(study: MakeStudy) -> None:
    """In two launches of five one side is far faster: blocks alone would see a certain difference."""
    directory = study(**SMALL | {"blocks": 10}, same=True)
    lines = [json.loads(line) for line in (directory / "records.jsonl").read_text().splitlines()]
    for value in lines:
        if value["name"] == STATIC:
            shift = {0: 1.5, 1: 1.4, 2: 1.05, 3: 1.04, 4: 1.03}
            value["samples_ms"] = [ms * shift[launch] for ms, launch in zip(value["samples_ms"], value["launches"])]
            value["interval_ms"] = None
    (directory / "records.jsonl").write_text("".join(json.dumps(value) + "\n" for value in lines))
    state(directory, claim(DYNAMIC, STATIC))
    assert words(directory) == [UNDECIDED]


def test_what_cannot_be_tested_says_why(study: MakeStudy) -> None:
    directory = study(**SMALL | {"untimed": True, "threads": [1, 2]})
    failed = next(r for r in analyse(directory).study.records if r.status == "failed")
    state(directory, claim(DYNAMIC, "elsewhere/1"), claim(DYNAMIC, failed.name), claim([], [], untested="--scene replaces it"),
          claim(f"{ON}serial/1", DYNAMIC))
    found = hypotheses.verdicts(analyse(directory))
    assert [v.word for v in found[:3]] == [NOT_TESTED] * 3 and found[3].p == found[3].p_holm, "only what is tested is corrected for"
    assert "elsewhere/1 is not in these records" in found[0].reason and "failed" in found[1].reason and found[2].reason == "--scene replaces it"
    rule = next(v for v in lint.lint(analyse(directory)).verdicts if v.rule.id == "hypotheses")
    assert len(rule.findings) == 3 and rule.words == lint.NOTED


def test_report_table_figure_and_finding(study: MakeStudy) -> None:
    directory = study(**SMALL)
    state(directory, claim(DYNAMIC, STATIC, 0.1), claim(DYNAMIC, STATIC, 0.4), claim(TBB, STATIC), claim([], [], untested="no such scene here"))
    analysis = analyse(directory)
    (drawing,) = draw(analysis)
    assert "supports the claim" in drawing.caption.reading and "Holm" in drawing.caption.body
    written = report.write(analysis)
    assert written.findings[0].kind == "hypotheses" and written.findings[0] == findings.top(analysis)[0]
    for word in ("1 supported", "1 refuted", "1 undecided", "1 not tested"):
        assert word in written.findings[0].text
    page = written.path.read_text()
    assert page.index("<h2>Hypotheses</h2>") < page.index("<h2>Rules of measuring</h2>") and page.count("<h2>Hypotheses</h2>") == 1
    rows = list(csv.DictReader((directory / "tables/hypotheses.csv").open()))
    assert [row["verdict"] for row in rows] == [SUPPORTED, REFUTED, UNDECIDED, NOT_TESTED] and rows[3]["reason"] == "no such scene here"
    assert float(rows[0]["ratio_low"]) > 1.1 and rows[0]["slower"] == STATIC
    assert "tab:hypotheses" in (directory / "tables/hypotheses.tex").read_text()
    assert not [f for f in lint.lint(analysis).findings if f.file.startswith("figures/hypotheses")]


def test_a_study_without_claims_shows_nothing_of_them(study: MakeStudy) -> None:
    directory = study(**SMALL)
    analysis = analyse(directory)
    assert hypotheses.verdicts(analysis) == [] and list(hypotheses.tables(analysis)) == [] and hypotheses.summary(analysis) is None
    assert "Hypotheses</h2>" not in report.write(analysis).path.read_text()


def test_a_claim_that_was_changed_after_the_run_is_found(study: MakeStudy) -> None:
    directory = study(**SMALL)
    stated = claim(DYNAMIC, STATIC, 0.1)
    (directory / "journal.jsonl").write_text(json.dumps({"event": "start", "hypotheses": [stated]}) + "\n")
    state(directory, stated)

    def problems() -> list[str]:
        return [f.problem for v in lint.lint(analyse(directory)).verdicts if v.rule.id == "hypotheses" for f in v.findings]

    assert problems() == []
    state(directory, claim(DYNAMIC, STATIC, 0.05))
    assert ["before the first sample" in problem for problem in problems()] == [True]


@pytest.mark.parametrize("wrong", [7, {"claim": "x"}, claim(DYNAMIC, STATIC) | {"by": -1}, claim(DYNAMIC, []), claim(DYNAMIC, STATIC) | {"faster": DYNAMIC}])
def test_bad_hypotheses_are_refused(study: MakeStudy, wrong: Any) -> None:
    directory = study(**SMALL)
    state(directory, wrong)
    with pytest.raises(InputError, match=r"context.json: study.hypotheses\[0\]: "):
        analyse(directory)
