"""What disturbed the sampling."""

from __future__ import annotations

import statistics
import subprocess
import sys
from pathlib import Path

import pytest

from .program import CPUS, events, sampling, sweep
from .studies import Study, needs_two_cpus
from .study_schema import NOISE, obey


def test_noise_is_watched(study: Study) -> None:
    noise = study.context["noise"]
    obey(noise, NOISE, "noise")
    windows = events(study.folder, "noise")
    assert noise["windows"] == len(windows) >= 1
    assert noise["seconds"] == pytest.approx(sum(w["seconds"] for w in windows))
    blocks = max(b for r in study.records for b in r["blocks"])
    spans = [w["blocks"] for w in windows]
    assert spans[0][0] == 0 and spans[-1][1] <= blocks and all(a[1] + 1 == b[0] for a, b in zip(spans, spans[1:]))
    for key in ("other_load_cpus", "steal_share", "load_average"):
        values = [w[key] for w in windows]
        assert noise[key]["median"] == pytest.approx(statistics.median(values)) and noise[key]["worst"] == max(values)
    assert all(0 <= w["steal_share"] <= 1 and 0 <= w["other_load_cpus"] for w in windows)
    said = [line for line in study.outcome.errors if line.startswith("noisy machine: ")]
    assert len(said) == bool(noise["warnings"]) and all(warning in said[0] for warning in noise["warnings"])


@needs_two_cpus
def test_other_load_is_seen_and_ones_own_is_not(tmp_path: Path) -> None:
    """Beside a program that spins; and beside none, where this machine allows to tell."""
    for name in ("quiet", "loud"):
        (tmp_path / name).mkdir()
    quiet = Study(tmp_path / "quiet", sampling(400), sweep("row_parallel", "openmp:static", threads=1, size="400x300"), options=("--time-limit", 2))
    other = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        loud = Study(tmp_path / "loud", sampling(400), sweep("row_parallel", "openmp:static", threads=1, size="400x300"), options=("--time-limit", 2))
    finally:
        other.kill()
        other.wait()
    noise = loud.context["noise"]
    assert noise["other_load_cpus"]["median"] > 0.3 and any("other programs kept" in warning for warning in noise["warnings"])
    assert any(line.startswith("noisy machine: other programs kept") for line in loud.outcome.errors)
    # The study alone keeps a CPU busy: were it counted, this would be above 0.8 on a machine without any other load.
    if quiet.context["noise"]["load_average"]["worst"] < 0.5:
        assert quiet.context["noise"]["other_load_cpus"]["median"] < 0.3


def test_unbound_threads_are_a_remark(good: Study) -> None:
    assert len(good.context["noise"]["remarks"]) == (CPUS > 1)
