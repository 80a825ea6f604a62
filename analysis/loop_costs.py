"""Reads the costs of a loop's iterations, as `rasterbench trace --costs` writes them (costs.json)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from . import load
from .load import InputError, is_thread_count, is_whole
from .statistics.numbers import is_number

# Axes of a point that decide what an iteration costs, beside those that name the loop; a study's points must have the same.
AXES = ("scene_hash", "fill", "near", "isa", "techniques", "generality")
UNITS = ("row", "tile", "triangle", "pixel")
MOST_ITERATIONS = 100_000_000  # beyond it the arrays of the simulation do not fit in common memory


@dataclass(frozen=True)
class LoopCosts:
    """One loop: what each iteration takes on one thread, and what handing out a chunk takes. All times in microseconds."""

    path: Path
    unit: str
    kernel: str
    numeric: str
    size: tuple[int, int]
    tile: int | None
    threads: int  # that dispatch was measured on
    costs: np.ndarray
    serial: float | None  # the loop on one thread, without stamps
    dispatch: dict[str, float | None]  # "openmp:dynamic,1" -> a chunk's overhead; None: not beyond the noise
    axes: dict[str, str | None] = field(default_factory=dict)  # by AXES; None: of an older version, which did not write it
    block: int = 1  # iterations that share a cost in the file, and were given equal parts of it
    raw: dict[str, Any] = field(repr=False, default_factory=dict)
    steal: float | None = None  # of a oneTBB thread, for a range of another one, beyond one of its own; None: not measured

    @property
    def machine(self) -> str | None:
        """Of the costs, as captions name it; None in older files."""
        said = [value for key in ("cpu", "runtime") if isinstance(value := self.raw.get(key), str) and value]
        return ", ".join(said) or None

    @property
    def n(self) -> int:
        return len(self.costs)

    @property
    def total(self) -> float:
        return float(self.costs.sum())

    @property
    def largest(self) -> float:
        return float(self.costs.max())

    @property
    def name(self) -> str:
        w, h = self.size
        return f"{self.kernel}, {self.numeric}, {w}x{h}" + (f", tiles of {self.tile}" if self.tile else "")

    def overhead(self, backend: str, schedule: str, chunk: int | None) -> tuple[float, str]:
        """The measured overhead of a chunk and the name that it was measured under: the schedule's own with this chunk, else with
        the nearest chunk by ratio, else 0 and "not measured". Of oneTBB's auto, which makes too few ranges on one thread to measure them,
        it is that of simple: a range costs the same whoever splits it."""
        wanted = f"{backend}:{schedule}" + ("" if chunk is None else f",{chunk}")
        if (found := self.dispatch.get(wanted)) is not None:
            return found, wanted
        known = {}
        for name, cost in self.dispatch.items():
            kind, comma, own = name.partition(",")
            if cost is not None and kind == f"{backend}:{schedule}" and (not comma or load.chunk_of(own)):
                known[name] = load.chunk_of(own) or 0
        if chunk is not None and any(known.values()):
            # A default chunk may be n / threads, whose overhead is another thing: only where nothing else was measured.
            nearest = min((n for n in known if known[n]), key=lambda n: abs(np.log(chunk / known[n])))
            return self.dispatch[nearest], nearest
        if f"{backend}:{schedule}" in known:
            return self.dispatch[f"{backend}:{schedule}"], f"{backend}:{schedule}"
        if known:
            smallest = min(known, key=lambda n: known[n])
            return self.dispatch[smallest], smallest
        if (backend, schedule) == ("tbb", "auto"):
            return self.overhead("tbb", "simple", chunk)
        return 0.0, "not measured"


def read(path: Path) -> LoopCosts:
    value = load.parse(load.read_text(path, "no such file (rasterbench trace --costs writes one)"), path, None)

    def fail(key: str, expected: str) -> InputError:
        found = repr(value[key]) if key in value else ""
        return InputError(path, f"expected {expected}, found {found[:60]}" if found else "missing", None, key)

    if value.get("schema") != load.SCHEMA:
        raise fail("schema", f"{load.SCHEMA}")
    if value.get("unit") not in UNITS:
        raise fail("unit", f"one of {', '.join(UNITS)}")
    for key in ("kernel", "numeric"):
        if not isinstance(value.get(key), str) or not value[key]:
            raise fail(key, "text")
    if not is_whole(value.get("iterations")):
        raise fail("iterations", "a whole number above 0")
    if not is_thread_count(value.get("threads")):
        raise fail("threads", f"a whole number from 1 to {load.MOST_THREADS}")
    for key in (*AXES, "model"):
        if value.get(key) is not None and not (isinstance(value[key], str) and value[key]):
            raise fail(key, "text")
    size, tile = value.get("size"), value.get("tile")
    if not (isinstance(size, list) and len(size) == 2 and all(map(is_whole, size))):
        raise fail("size", "[width, height]")
    if tile is not None and not is_whole(tile):
        raise fail("tile", "a whole number above 0 or null")
    n, block = value["iterations"], value.get("iterations_a_cost", 1)
    if n > MOST_ITERATIONS:
        raise fail("iterations", f"at most {MOST_ITERATIONS}")
    if not is_whole(block):
        raise fail("iterations_a_cost", "a whole number above 0")
    costs = value.get("cost_us")
    if not isinstance(costs, list) or not all(is_number(c) and c >= 0 for c in costs):
        raise fail("cost_us", "numbers that are not below 0")
    if len(costs) != -(-n // block):
        raise InputError(path, f"holds {len(costs)} costs, expected {-(-n // block)} of {n} iterations", None, "cost_us")
    if not math.isfinite(sum(map(float, costs))):
        raise InputError(path, "adds up to infinity", None, "cost_us")
    if not any(costs):
        raise InputError(path, "every iteration costs 0", None, "cost_us")
    serial, dispatch = value.get("serial_us"), value.get("dispatch_us", {})
    if serial is not None and not (is_number(serial) and serial > 0):
        raise fail("serial_us", "a number above 0 or null")
    if not isinstance(dispatch, dict):
        raise fail("dispatch_us", "an object")
    for name, cost in dispatch.items():
        if cost is not None and not (is_number(cost) and cost >= 0):
            raise InputError(path, f"expected a number that is not below 0, or null, found {cost!r}", None, f"dispatch_us.{name}")
    steal = value.get("steal_us")
    if steal is not None and not (is_number(steal) and steal >= 0):
        raise fail("steal_us", "a number that is not below 0, or null")
    return LoopCosts(path, value["unit"], value["kernel"], value["numeric"], tuple(size), tile, value["threads"],
                     _spread(np.array(costs, dtype=float), n, block), None if serial is None else float(serial),
                     {name: None if cost is None else float(cost) for name, cost in dispatch.items()},
                     {key: value.get(key) for key in AXES}, block,
                     {key: v for key, v in value.items() if key != "cost_us"}, None if steal is None else float(steal))


def _spread(costs: np.ndarray, n: int, block: int) -> np.ndarray:
    """One cost an iteration; those of a block are equal, and add up to what the file has."""
    if block == 1:
        return costs
    sizes = np.full(len(costs), block)
    sizes[-1] = n - block * (len(costs) - 1)
    return np.repeat(costs / sizes, sizes)
