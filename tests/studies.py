"""A finished study for the end-to-end tests, and what this machine and the built program can run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, records, run, write_study

Record = dict[str, Any]
STAGES = ["clear", "geometry", "raster", "resolve"]
SMALL = "teapot:triangles=300"
ISAS = [isa["name"] for isa in json.loads(run("list", "isas", "--json").ok().stdout) if isa["available"]]
LIBOMP = any(Path(p).exists() for p in ("/usr/lib/x86_64-linux-gnu/libomp.so.5", "/usr/lib/aarch64-linux-gnu/libomp.so.5",
                                        "/usr/lib64/libomp.so", "/usr/lib/libomp.so"))
OWN_RUNTIME = next(b["runtime"] for b in json.loads(run("list", "backends", "--json").ok().stdout) if b["name"] == "openmp")
needs_both_runtimes = pytest.mark.skipif(not LIBOMP or OWN_RUNTIME != "libgomp", reason="needs a program of gcc's and LLVM's libomp")
needs_two_cpus = pytest.mark.skipif(CPUS < 2, reason="this machine has one CPU")


class Study:
    """A finished study: its folder, exit code and records."""

    def __init__(self, folder: Path, *tables: str, options: tuple[object, ...] = (), **variables: str) -> None:
        self.folder = folder / "out"
        self.outcome = run("study", write_study(folder / "study.toml", 'name = "small"\nquestion = "Does it work?"\nseed = 5', *tables),
                           "--out", self.folder, *options, **variables)
        assert self.outcome.code in (0, 1), self.outcome.stderr
        self.records = records(self.folder)
        self.context = json.loads((self.folder / "context.json").read_text())

    def where(self, **axes: Any) -> list[Record]:
        return [r for r in self.records if all(r["config"][axis] == value for axis, value in axes.items())]

    def the(self, **axes: Any) -> Record:
        (record,) = self.where(**axes)
        return record
