"""Amdahl's law and the Universal Scalability Law, fitted to measured times where the measurements can tell.

Amdahl (1967): T(p) = T1 (s + (1 - s) / p), s the serial share. USL (Gunther, 1993): T(p) = T1 (1 + a (p - 1) + b p (p - 1)) / p,
a contention, b coherency. Relative errors count alike; intervals are those of Student's t at 95 %, from the fit's covariance.
A law is "not identifiable" with fewer thread counts than its parameters and two.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Callable, Sequence

import numpy as np
from scipy import optimize, stats

from .statistics.estimates import Estimate
from .statistics.intervals import CONFIDENCE


SPARE = 2  # thread counts beyond the parameters


@dataclass(frozen=True)
class Law:
    name: str
    time: Callable[..., np.ndarray]  # of threads and the parameters
    parameters: tuple[str, ...]  # the first is T1, in milliseconds


@dataclass(frozen=True)
class Fit:
    law: Law
    threads: tuple[int, ...]
    estimates: dict[str, Estimate]  # empty: not identifiable
    reason: str = ""

    def speedup(self, threads: np.ndarray) -> np.ndarray:
        values = [self.estimates[name].value for name in self.law.parameters]
        return values[0] / self.law.time(threads, *values)


AMDAHL = Law("Amdahl", lambda p, t1, s: t1 * (s + (1 - s) / p), ("T1", "serial share"))
USL = Law("USL", lambda p, t1, a, b: t1 * (1 + a * (p - 1) + b * p * (p - 1)) / p, ("T1", "contention", "coherency"))
LAWS = (AMDAHL, USL)


def fit(law: Law, threads: Sequence[int], times: Sequence[float]) -> Fit:
    """times: one median a thread count, in milliseconds. Parameters are not held within their range, so that an interval which
    leaves it says so."""
    counts = tuple(sorted(set(threads)))
    needed = len(law.parameters) + SPARE
    if len(counts) < needed:
        return Fit(law, counts, {}, f"not identifiable: {len(counts)} thread counts, {needed} needed")
    p, t = np.array(threads, dtype=float), np.array(times, dtype=float)
    start = (float(t[np.argmin(p)] * p.min()), *(0.01 for _ in law.parameters[1:]))
    with warnings.catch_warnings():
        warnings.simplefilter("error", optimize.OptimizeWarning)
        try:
            values, covariance = optimize.curve_fit(law.time, p, t, p0=start, sigma=t)
        except (RuntimeError, optimize.OptimizeWarning) as error:
            return Fit(law, counts, {}, f"not identifiable: {error}")
    reach = stats.t.ppf((1 + CONFIDENCE) / 2, len(p) - len(values)) * np.sqrt(np.diag(covariance))
    return Fit(law, counts, {name: Estimate(float(v), float(v - r), float(v + r), len(p), "Student's t of the fit")
                             for name, v, r in zip(law.parameters, values, reach)})
