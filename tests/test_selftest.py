"""`rasterbench selftest`: the A/A test over real processes. Its statistics are tested in harness/selftest_test.cpp."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from .program import TIMEOUT, command, environment, json_lines, run

SMALL = ("teapot:triangles=300", "--size", "64x48", "--backend", "serial")


def test_every_sample_and_the_rate(tmp_path: Path) -> None:
    out = tmp_path / "self.jsonl"
    done = run("selftest", *SMALL, "--comparisons", 4, "--launches", 2, "--max-samples", 12, "--json", "-o", out)
    value = json.loads(done.stdout)
    lines = json_lines(out)
    assert len(lines) == value["comparisons"] == 4
    taken = 0
    for line in lines:
        times = {}
        for label in ("a", "b"):
            samples = line[label]
            n = len(samples["samples_ms"])
            taken += n
            assert 10 <= n <= 12 and samples["blocks"] == list(range(n)) and samples["stop"] in ("target", "max_samples")
            assert samples["launches"] == [block % 2 for block in range(n)] and min(samples["samples_ms"]) > 0
            times[label] = samples["samples_ms"]
        n = min(map(len, times.values()))
        ratios = np.array(times["a"][:n]) / np.array(times["b"][:n])
        assert line["ratio"] == pytest.approx(float(np.median(ratios)))
        low, high = line["interval"]
        assert low <= line["ratio"] <= high and line["differs"] == (low > 1 or high < 1)
        assert all(np.isclose(ratios, end).any() for end in (low, high))  # order statistics
    differences = sum(line["differs"] for line in lines)
    expected = stats.binomtest(differences, 4).proportion_ci(method="exact")
    assert value["samples"] == taken and value["differences"] == differences
    assert value["interval"] == pytest.approx([expected.low, expected.high], abs=1e-6)
    assert value["kept"] == (expected.low <= 0.05) and done.code == (0 if value["kept"] else 1)


def test_a_comparison_is_written_when_it_is_done(tmp_path: Path) -> None:
    """A run that is killed keeps what it has measured."""
    out = tmp_path / "self.jsonl"
    with subprocess.Popen(command("selftest", *SMALL, "--comparisons", 100000, "-o", out), stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL, env=environment()) as process:
        until = time.monotonic() + TIMEOUT
        while (not out.exists() or out.read_text().count("\n") < 2) and time.monotonic() < until and process.poll() is None:
            time.sleep(0.05)
        process.kill()
    whole = out.read_text().split("\n")[:-1]
    assert [json.loads(line)["comparison"] for line in whole][:2] == [0, 1]


def test_words() -> None:
    done = run("selftest", *SMALL, "--comparisons", 1, "--launches", 1, "--max-samples", 10)
    assert "1 comparisons cannot show a rate above 5 %" in done.stdout
    assert "of 1 comparisons of a point with itself came out different" in done.stdout and "stated 5 %" in done.stdout


@pytest.mark.parametrize("options, field", [
    (("--comparisons", "0"), "--comparisons"), (("--min-samples", "5"), "--min-samples"), (("--target", "nan"), "--target"),
    (("--min-samples", "20", "--max-samples", "10"), "--max-samples"), (("--kernel", "none"), "none"),
    (("--launches", "30", "--max-samples", "20"), "--max-samples"),
    (("--kernel", "ray_cast"), "ray_cast"), (("-o", "/nowhere/self.jsonl"), "/nowhere"), (("--launches", "x"), "--launches"),
])
def test_bad_input(options: tuple[str, ...], field: str) -> None:
    done = run("selftest", *SMALL, *options)
    assert done.code == 2 and not done.stdout and len(done.errors) == 1 and field in done.stderr
