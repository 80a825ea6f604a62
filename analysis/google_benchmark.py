"""Reads the JSON of Google Benchmark as a run with points: what `rasterbench study --benchmark_out` writes, and any other program
that was run with --benchmark_repetitions. It holds no launches and no blocks: all repetitions are one launch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .load import InputError, parse, read_text
from .statistics.numbers import is_number
from .statistics.samples import Samples

# Of a run, not of its conditions; the executable is a path.
MEASURED = ("date", "executable", "load_avg")
SHARED = {"host_name": "hostname", "num_cpus": "cpus_online"}  # keys that a study's context has under `machine`, too
MILLISECONDS = {"s": 1e3, "ms": 1.0, "us": 1e-3, "ns": 1e-6}


@dataclass(frozen=True)
class Runs:
    """samples: name -> times in milliseconds; errors: name -> why it has none, each name in one of them. context: host and CPUs
    under the keys of context.json, the rest under google_benchmark."""

    context: dict[str, Any]
    samples: dict[str, Samples]
    errors: dict[str, str]


def read(path: Path) -> Runs:
    value = parse(read_text(path, "no such file"), path, None, nan=True)  # what it cannot compute is NaN there
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
        if run.get("error_occurred") or run.get("skipped"):
            errors.setdefault(name, str(run.get("error_message") or run.get("skip_message") or "no reason given"))
            continue
        unit = run.get("time_unit")
        if not isinstance(unit, str) or unit not in MILLISECONDS:
            raise InputError(path, f"is {unit!r}, expected one of {', '.join(MILLISECONDS)}", None,
                             f"{place}.time_unit")
        time = run.get("real_time")
        if not is_number(time) or time <= 0:
            raise InputError(path, f"expected a number above 0, found {time!r}", None, f"{place}.real_time")
        times.setdefault(name, []).append(time * MILLISECONDS[unit])
    if not times and not errors:
        raise InputError(path, "holds no runs, only aggregates or nothing: run it without --benchmark_report_aggregates_only",
                         None, "benchmarks")
    for name in errors.keys() & times.keys():  # half of a benchmark selects: those that failed might have been the slow ones
        errors[name] += f" (its {len(times.pop(name))} other repetitions are not used)"
    context = {"machine": {ours: about[key] for key, ours in SHARED.items() if about.get(key) is not None},
               "google_benchmark": {key: item for key, item in about.items() if key not in (*SHARED, *MEASURED)}}
    return Runs(context, {name: one_launch(values) for name, values in times.items()}, errors)


def one_launch(values: list[float]) -> Samples:
    n = len(values)
    return Samples(np.array(values), np.zeros(n, dtype=int), np.arange(n))
