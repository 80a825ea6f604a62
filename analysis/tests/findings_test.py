"""Findings say what the data support, and nothing else."""

from __future__ import annotations

import re

import pytest

from .. import findings
from . import synthetic
from .conftest import analyse

CLAIM = re.compile(r"faster than|slower than|matters by|scales best|no kernel gains|depends on|is the fastest kernel")


def test_three_findings_with_intervals(full):
    _, analysis, written = full
    assert len(written.findings) == 3
    assert len({f.kind for f in written.findings}) == 3
    for finding in written.findings:
        assert "\n" not in finding.text and re.search(r"\[[\d.]+, [\d.]+\]", finding.text)
    assert "tile_parallel" in written.findings[0].text and "fastest" in written.findings[0].text


def test_claimed_numbers_are_those_of_the_model(full):
    _, analysis, _ = full
    said = next(f.text for f in findings.candidates(analysis) if f.kind == "schedule" and "tile_parallel" in f.text)
    value, low, high = map(float, re.search(r"matters by ([\d.]+)x \[([\d.]+), ([\d.]+)\]", said).groups())
    assert low <= value <= high and value == pytest.approx(1.25, rel=0.03)
    assert any(f.kind == "no schedule effect" and "triangle_atomics" in f.text for f in findings.candidates(analysis))


def test_copies_of_one_point_are_not_told_apart(study):
    def copy(records):
        for entry in records:
            for key in ("samples_ms", "stages_ms", "median_ms", "interval_ms"):
                entry[key] = records[0][key]

    analysis = analyse(study(untimed=False, edit=copy))
    assert not any(CLAIM.search(f.text) for f in findings.candidates(analysis))
    assert any("cannot be told apart" in f.text for f in findings.top(analysis))


def test_equal_points_hardly_ever_give_a_claim(tmp_path):
    wrong = 0
    for seed in range(25):
        plan = synthetic.plan(same=True, untimed=False, seed=seed, kernels=["bounding_box", "row_parallel", "tile_parallel", "scanline"],
                              schedules=synthetic.SCHEDULES[:4], threads=[2], blocks=12)
        analysis = analyse(synthetic.write(tmp_path / str(seed), plan, pictures=False))
        wrong += any(CLAIM.search(f.text) for f in findings.candidates(analysis))
    assert wrong <= 3


def test_few_samples_claim_nothing(study):
    analysis = analyse(study(blocks=4))
    assert not any(CLAIM.search(f.text) for f in findings.candidates(analysis))
    assert len(findings.top(analysis)) == 3


def test_two_launches_are_too_few_and_say_so(study):
    def layout(records):
        records[0]["samples_ms"] = [x * (1.08 if launch else 1) for x, launch in zip(records[0]["samples_ms"], records[0]["launches"])]

    analysis = analyse(study(kernels=["bounding_box", "tile_parallel"], schedules=[], launches=2, untimed=False, edit=layout))
    (said,) = (f.text for f in findings.candidates(analysis) if f.kind == "fastest")
    assert "in these 2 launches, too few to say so of others" in said


def test_instruction_sets_are_no_schedules(study):
    def other_isa(records):
        for entry in records:
            if entry["config"]["schedule"] == "dynamic":
                entry["config"]["isa"] = "avx512"

    schedules = [("openmp", "static", None), ("openmp", "dynamic", 1)]
    kinds = {edit: {f.kind for f in findings.candidates(analyse(study(schedules=schedules, edit=edit)))} & {"schedule", "no schedule effect"}
             for edit in (None, other_isa)}
    assert kinds[None] and not kinds[other_isa]


def test_failed_points_are_a_finding(study):
    def fail(records):
        for entry in records[::2]:
            synthetic.withhold(entry, "failed", "differs from the scalar specification")

    found = findings.candidates(analyse(study(edit=fail)))
    assert any(f.kind == "failed" and "differs from the scalar specification" in f.text for f in found)
