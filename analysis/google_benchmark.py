"""Reads the JSON of Google Benchmark as a run with points: what `rasterbench study --benchmark_out` writes, and any other program
that was run with --benchmark_repetitions. It holds no launches and no blocks: all repetitions are one launch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .load import InputError, parse, read_text
from .statistics import Samples, is_number

MILLISECONDS = {"s": 1e3, "ms": 1.0, "us": 1e-3, "ns": 1e-6}


@dataclass(frozen=True)
class Runs:
    """name -> times in milliseconds, or None with the error under `errors`; context in the keys of context.json."""

    context: dict[str, Any]
    samples: dict[str, Samples]
    errors: dict[str, str]


def read(path: Path) -> Runs:
    value = parse(read_text(path, "no such file"), path, None)
    runs, about = value.get("benchmarks"), value.get("context")
    if not isinstance(runs, list) or not isinstance(about, dict):
        raise InputError(path, "expected the JSON of Google Benchmark: an object with context and benchmarks")
    times: dict[str, list[float]] = {}
    errors: dict[str, str] = {}
    for index, run in enumerate(runs):
        place = f"benchmarks[{index}]"
        if not isinstance(run, dict):
            raise InputError(path, f"expected an object, found {run!r}", None, place)
        if run.get("run_type", "iteration") != "iteration":
            continue  # an aggregate: the samples say more
        # run_name is without the suffixes that the library gives to repetitions
        name = run.get("run_name", run.get("name"))
        if not isinstance(name, str) or not name:
            raise InputError(path, f"expected text, found {name!r}", None, f"{place}.name")
        if run.get("error_occurred"):
            errors[name] = str(run.get("error_message") or "no reason given")
            continue
        if run.get("time_unit") not in MILLISECONDS:
            raise InputError(path, f"is {run.get('time_unit')!r}, expected one of {', '.join(MILLISECONDS)}", None,
                             f"{place}.time_unit")
        time = run.get("real_time")
        if not is_number(time) or time <= 0:
            raise InputError(path, f"expected a number above 0, found {time!r}", None, f"{place}.real_time")
        times.setdefault(name, []).append(time * MILLISECONDS[run["time_unit"]])
    if not times and not errors:
        raise InputError(path, "holds no runs, only aggregates or nothing: run it without --benchmark_report_aggregates_only",
                         None, "benchmarks")
    machine = {"hostname": about.get("host_name"), "cpus_online": about.get("num_cpus")}
    context = {"machine": {key: item for key, item in machine.items() if item is not None}}
    return Runs(context, {name: one_launch(values) for name, values in times.items()}, errors)


def one_launch(values: list[float]) -> Samples:
    n = len(values)
    return Samples(np.array(values), np.zeros(n, dtype=int), np.arange(n))
