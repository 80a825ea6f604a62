# Tests of slurm/ run against real daemons: slurmctld, slurmd and munged on loopback, started by slurm/local.
"""A throw-away cluster, and the commands of slurm/ on it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Iterator, Sequence

import pytest

from .program import ROOT, TIMEOUT, Outcome, environment, program

DAEMONS = ("slurmctld", "slurmd", "munged", "sbatch")


def missing_daemons() -> list[str]:
    path = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
    return [name for name in DAEMONS if shutil.which(name, path=path) is None]


needs_slurm = pytest.mark.skipif(bool(missing_daemons()), reason=f"no {', '.join(missing_daemons())}: scripts/setup installs slurm-wlm and munge")


def wait_for(condition: Callable[[], Any], what: str, seconds: float = TIMEOUT / 2, explain: Callable[[], str] | None = None) -> Any:
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, f"waited in vain for {what}" + (f":\n{explain()}" if explain else "")
        time.sleep(0.1)
    return found


def without_slurm(**changes: str) -> dict[str, str]:
    """The environment of a machine that has no cluster."""
    shed = ("SLURM", "SBATCH_", "SRUN_")
    return {name: value for name, value in environment().items() if not name.startswith(shed)} | changes


@dataclass(frozen=True)
class Cluster:
    """A running cluster; `conf` is its SLURM_CONF. None: a machine without one."""

    conf: str | None

    @classmethod
    def started(cls, *options: object) -> Iterator["Cluster"]:
        """For fixtures: ends with the test, whatever happens in it."""
        parent = Path(tempfile.mkdtemp(prefix="rasterbench-slurm-"))
        parent.chmod(0o755)  # munged wants its folder to be open to all, which pytest's are not
        folder = parent / "cluster"
        done = subprocess.run([ROOT / "slurm/local", "start", folder, *map(str, options)], env=without_slurm(), capture_output=True,
                              text=True, timeout=TIMEOUT, check=False)
        assert done.returncode == 0, done.stderr
        try:
            yield cls(done.stdout.strip().partition("SLURM_CONF=")[2])
        finally:
            subprocess.run([ROOT / "slurm/local", "stop", folder], env=without_slurm(), timeout=TIMEOUT, check=True)
            parent.rmdir()  # stop leaves nothing

    def environment(self, **changes: str) -> dict[str, str]:
        # An installed sbatch without a cluster has an empty configuration; one that is not there would be waited for.
        return without_slurm(SLURM_CONF=self.conf or "/dev/null", **changes)

    def command(self, *words: object, cwd: Path | None = None, **variables: str) -> Outcome:
        done = subprocess.run(list(map(str, words)), cwd=cwd, env=self.environment(**variables), capture_output=True, text=True,
                              timeout=TIMEOUT, check=False)
        return Outcome(done.returncode, done.stdout, done.stderr)

    def submit(self, study: Path, out: Path, *options: object, cwd: Path | None = None, **variables: str) -> Outcome:
        """With the program under test, which is built already."""
        return self.command(ROOT / "slurm/submit", study, "--out", out, "--program", program(), *options, cwd=cwd, **variables)

    def merge(self, out: Path, *options: object) -> Outcome:
        return self.command(ROOT / "slurm/merge", out, *options)

    def status(self, out: Path, *options: object) -> Outcome:
        return self.command(ROOT / "slurm/status", out, *options)

    def queue(self) -> list[str]:
        return self.command("squeue", "-h", "-r", "-o", "%F_%K %T %N %r").ok().stdout.splitlines()

    def wait_until_empty(self, seconds: float = TIMEOUT) -> None:
        wait_for(lambda: not self.queue(), "the queue to be empty", seconds, lambda: "\n".join(self.queue()))


def manifest(out: Path) -> dict[str, Any]:
    return json.loads((out / "slurm/manifest.json").read_text())


def submission(out: Path, number: int) -> dict[str, Any]:
    return json.loads((out / f"slurm/submissions/{number}/submission.json").read_text())


def tasks(out: Path, number: int) -> list[list[str]]:
    """[array's file, index, family, shard] of every line of a submission."""
    return [[array["tasks"], *line.split()] for array in submission(out, number)["arrays"]
            for line in (out / f"slurm/submissions/{number}" / array["tasks"]).read_text().splitlines()]


def families(out: Path) -> list[str]:
    """Names of the folders of completed families."""
    folder = out / "slurm/families"
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


def logs(out: Path) -> str:
    return "\n".join(f"{path.name}:\n{path.read_text()}" for path in sorted((out / "slurm/logs").glob("*")))


def one_line(outcome: Outcome, name: str, code: int, words: Sequence[str]) -> str:
    """What an error looks like: its exit code, and one line on stderr that begins with the program's name."""
    assert outcome.code == code, f"exit code {outcome.code}: {outcome.stdout}{outcome.stderr}"
    lines = [line for line in outcome.errors if "planned for" not in line]
    assert len(lines) == 1 and lines[0].startswith(f"{name}: "), outcome.stderr
    for word in words:
        assert word in lines[0], f"{word!r} is not in {lines[0]!r}"
    return lines[0]
