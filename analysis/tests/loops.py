"""Writes costs.json as `rasterbench trace --costs` does, from a model instead of a trace."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Sequence

import numpy as np

from .synthetic import digest

DISPATCH = {"openmp:static": 0.0, "openmp:static,1": 0.02, "openmp:dynamic": 0.3, "openmp:dynamic,1": 0.3, "openmp:dynamic,16": 0.5,
            "openmp:guided": 0.4, "tbb:auto": 0.2, "tbb:simple": 0.25}


def heavy(n: int, seed: int = 3) -> np.ndarray:
    """Microseconds with a heavy tail."""
    return np.random.default_rng(seed).pareto(1.6, n) * 5 + 1


def value(costs: Sequence[float], **changes: Any) -> dict[str, Any]:
    standard = {"schema": 1, "model": "teapot", "scene_hash": digest("teapot"), "fill": "top-left", "near": "clip", "isa": "baseline", "techniques": "all",
                "generality": "minimal", "unit": "row", "iterations": len(costs), "columns": 1, "tile": None, "size": [1920, 1080], "kernel": "row_parallel",
                "numeric": "f32", "schedule": "openmp:dynamic,1", "threads": 2, "cost_us": [round(float(c), 3) for c in costs],
                "stamp_us": 0.03, "serial_us": round(float(np.sum(costs)) * 1.02, 3), "dispatch_us": DISPATCH}
    return {key: v for key, v in (standard | changes).items() if v is not ...}


def write(path: Path, costs: Sequence[float], **changes: Any) -> Path:
    path.write_text(json.dumps(value(costs, **changes)))
    return path
