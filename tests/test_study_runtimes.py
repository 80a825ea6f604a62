"""OpenMP's runtimes as an axis: what was observed is what was asked for."""

from __future__ import annotations

import csv
import re
import subprocess
from pathlib import Path

import pytest

from .program import CPUS, ROOT, TIMEOUT, environment, program, sampling, sweep
from .studies import LIBOMP, Study, needs_both_runtimes


def test_other_openmp_runtime(mixed: Study) -> None:
    r = mixed.the(runtime="libomp", backend="openmp")
    assert r["status"] == ("ok" if LIBOMP else "skipped")
    assert LIBOMP or "libomp" in r["reason"]


@pytest.fixture(scope="module")
def runtimes(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Both runtimes by name, beside what has no part in them."""
    return Study(tmp_path_factory.mktemp("runtimes"), sampling(6, launches=2),
                 sweep("row_parallel", ["openmp:static", "openmp:guided,1"], threads=[min(2, CPUS)], runtime=["libgomp", "libomp"]),
                 sweep("row_parallel", ["serial", "tbb:auto"], threads=[1]))


@needs_both_runtimes
def test_records_say_which_runtime_was_observed(runtimes: Study) -> None:
    assert runtimes.outcome.code == 0
    for r in runtimes.where(backend="openmp"):
        assert r["status"] == "ok" and r["runtime_observed"] == r["config"]["runtime"]
        assert r["name"].endswith(f"/runtime:{r['config']['runtime']}")
    assert {r["runtime_observed"] for r in runtimes.where(backend="openmp")} == {"libgomp", "libomp"}
    assert {r["runtime_observed"] for r in runtimes.records if r["config"]["backend"] != "openmp"} == {None}


@needs_both_runtimes
def test_a_report_tells_the_runtimes_apart(runtimes: Study) -> None:
    for command in ("table", "report"):
        done = subprocess.run([str(ROOT / "scripts/python"), "-m", "analysis", command, str(runtimes.folder)], env=environment(),
                              capture_output=True, text=True, timeout=TIMEOUT, check=False)
        assert done.returncode == 0, done.stderr
        (table,) = (runtimes.folder / "tables").glob("points_*.tex") if command == "report" else [None]
        said = done.stdout if table is None else table.read_text()
        for schedule in ("static", "guided,1"):
            for runtime in ("libgomp", "libomp"):
                assert re.search(f"{schedule}.* runtime {runtime}", said), said
    (numbers,) = (runtimes.folder / "tables").glob("points_*.csv")
    with numbers.open() as file:
        rows = [row for row in csv.DictReader(file) if row["backend"] == "openmp"]
    assert len(rows) == 4 and all(row["runtime"] == row["runtime_observed"] for row in rows)


@needs_both_runtimes
@pytest.mark.parametrize("instead", ["libgomp", "nothing"])
def test_a_runtime_that_was_not_observed_fails_the_point(instead: str, tmp_path: Path) -> None:
    """RASTERBENCH_LIBOMP names a file that is not LLVM's runtime, or none: what runs is libgomp, whatever was asked for."""
    (library,) = re.findall(r"libgomp\S* => (\S+)", subprocess.run(["ldd", program()], capture_output=True, text=True, check=True).stdout)
    study = Study(tmp_path, sampling(), sweep("row_parallel", "openmp:static", threads=1, runtime=["libgomp", "libomp"]),
                  RASTERBENCH_LIBOMP=library if instead == "libgomp" else str(tmp_path / "none.so"))
    assert study.outcome.code == 1 and study.the(runtime="libgomp")["status"] == "ok"
    r = study.the(runtime="libomp")
    assert r["status"] == "failed" and r["reason"] == "libomp was asked for, libgomp ran the loops"
    assert r["samples_ms"] == [] and r["median_ms"] is None
