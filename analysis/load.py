"""Reads and checks what a study wrote (harness/records.md): DIR/context.json and DIR/records.jsonl."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .statistics.numbers import is_number
from .statistics.samples import Samples


SCHEMA = 1
LOOP_KEYS = ("busy_mean_ms", "busy_longest_ms", "imbalance_ms", "outside_ms")  # of raster_loop; absent in older records
HELD_UP_KEYS = ("lock_wait_ms", "contended_locks", "failed_exchanges")  # likewise, and absent in some that have the others
STAGES = ("clear", "geometry", "raster", "resolve")
# What tables and plots of accuracy count; null where a mode has none.
COUNTED = {"wrong", "exact_ties", "edge", "depth", "unexplained", "unbounded", "predicted", "wrong_on_snapped", "worst_distance_px",
           "max_depth_error_steps", "ambiguous", "edge_ties", "depth_ties", "errors", "false_positives", "false_negatives"}
STATUSES = ("ok", "failed", "skipped")
TECHNIQUES = ("fragments", "blocks", "front_to_back", "streaming", "huge_pages")  # in the program's order
PEERS = ("llvmpipe",)  # other programs that draw the same pictures; as a record's backend


MOST_THREADS = 65536  # of any file: beyond it arrays of one entry a thread are a mistake, not a machine
MOST_CHUNK = 2**30


class InputError(Exception):
    """Bad input, as one line that names the file, the place and the field."""

    def __init__(self, path: Path, problem: str, line: int | None = None, field: str | None = None) -> None:
        place = str(path) + (f":{line}" if line is not None else "")
        super().__init__(f"{place}: {field + ': ' if field else ''}{problem}".replace("\n", " "))


@dataclass(frozen=True)
class Config:
    """The axes of a point. Those without a default decide which points may be compared, so they must be there."""

    scene: str
    size: tuple[int, int]
    kernel: str
    numeric: str
    fill: str
    near: str
    backend: str
    schedule: str | None
    chunk: int | None
    threads: int
    isa: str
    output: str
    cache: str
    scene_hash: str | None = None
    binding: str | None = None
    wait_policy: str | None = None
    runtime: str | None = None
    tile: int | str | None = None
    generality: str | None = None
    techniques: str | None = None  # "all", "none", "all-NAME" or names joined by "+"; None of peers and in older records

    @property
    def is_peer(self) -> bool:
        return self.backend in PEERS


@dataclass(frozen=True)
class Record:
    line: int
    id: str
    name: str
    config: Config
    status: str
    reason: str
    samples: Samples | None  # None unless the point was timed and conforms
    stages: dict[str, np.ndarray]
    stop: str | None
    verify: dict[str, Any]
    work: dict[str, Any]
    threads_observed: int | None
    per_thread: tuple[dict[str, Any], ...]
    recorded_median: float | None
    recorded_interval: tuple[float, float] | None
    context: str | None
    raw: dict[str, Any] = field(repr=False, default_factory=dict)
    floor_ms: float | None = None  # absent in older records
    loop: np.ndarray | None = None  # the part of each raster stage in the loop under study, ms; absent in older records, and of peers
    origin: dict[str, Any] | None = None  # of merged studies: the node, its type, the job
    runtime_observed: str | None = None  # the OpenMP runtime that ran; None: another backend, or an older record

    @property
    def ok(self) -> bool:
        return self.samples is not None


@dataclass(frozen=True)
class Hypothesis:
    """A claim of the study file: time of slower / time of faster is at least 1 + by. Several names stand for the fastest of them."""

    claim: str
    by: float
    faster: tuple[str, ...]  # names of points
    slower: tuple[str, ...]
    untested: str  # why it could select nothing, or empty


@dataclass(frozen=True)
class WeakSeries:
    """Pictures that grow with the threads."""

    kind: str  # "triangles" or "pixels": what grows
    scene: str  # as the study file writes them
    size: str
    steps: dict[int, tuple[str, tuple[int, int]]]  # by threads: scene and size of the points


@dataclass(frozen=True)
class Study:
    """A study; its records are of kernels, with those of peers beside them: a peer is shown, never compared as a kernel is."""

    directory: Path
    context: dict[str, Any]
    records: list[Record]
    peers: list[Record] = field(default_factory=list)
    records_hash: str = ""  # of the bytes of records.jsonl
    raw_context: dict[str, Any] = field(default_factory=dict)  # as context.json has it, without the defaults of _context

    @cached_property
    def hypotheses(self) -> list[Hypothesis]:
        """Those that the context has; empty in older studies."""
        return _hypotheses(self.directory / "context.json", self.context["study"].get("hypotheses"))

    @cached_property
    def weak(self) -> list[WeakSeries]:
        return _weak(self.directory / "context.json", self.context["study"].get("weak"))

    @property
    def every_record(self) -> list[Record]:
        return [*self.records, *self.peers]

    @property
    def name(self) -> str:
        return str(self.context["study"].get("name", self.directory.name))

    @property
    def timed(self) -> list[Record]:
        return [record for record in self.records if record.ok]

    @property
    def target(self) -> float:
        sampling = self.context["study"].get("sampling")
        target = sampling.get("target") if isinstance(sampling, dict) else None
        return float(target) if is_number(target) and 0 < target < 1 else 0.02

    def frame(self) -> pd.DataFrame:
        """One row a record: the axes, then what was measured."""
        rows = []
        for record in self.every_record:
            row: dict[str, Any] = {axis.name: getattr(record.config, axis.name) for axis in fields(Config)}
            row["size"] = "x".join(map(str, record.config.size))
            row |= {"id": record.id, "name": record.name, "status": record.status, "reason": record.reason,
                    "stop": record.stop, "n": record.samples.n if record.ok else 0,
                    "launches": record.samples.launch_count if record.ok else 0,
                    "median_ms": float(np.median(record.samples.values)) if record.ok else np.nan,
                    "conforms": record.verify.get("conforms"), "threads_observed": record.threads_observed}
            rows.append(row)
        return pd.DataFrame(rows)


def is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value > 0


def is_thread_count(value: object) -> bool:
    return is_whole(value) and value <= MOST_THREADS


def chunk_of(word: str) -> int | None:
    """The chunk that a schedule's text ends in, or None where it is no number from 1 to MOST_CHUNK."""
    good = word.isascii() and word.isdecimal() and len(word) <= len(str(MOST_CHUNK)) and 1 <= int(word) <= MOST_CHUNK
    return int(word) if good else None


def technique_set(words: str) -> frozenset[str]:
    """The techniques that a record's text stands for (harness/records.md)."""
    if words in ("all", "none"):
        return frozenset(TECHNIQUES if words == "all" else ())
    without = words.startswith("all-")
    names = words.removeprefix("all-").split("-" if without else "+")
    unknown = [name for name in names if name not in TECHNIQUES]
    if unknown:
        raise ValueError(f"unknown technique {unknown[0]!r}")
    return frozenset(TECHNIQUES).difference(names) if without else frozenset(names)


def load(directory: Path) -> Study:
    directory = Path(directory)
    if not directory.is_dir():
        raise InputError(directory, "no such folder (expected the folder that a study wrote)")
    context, raw = _context(directory / "context.json")
    records = _records(directory / "records.jsonl")
    study = Study(directory, context, [r for r in records if not r.config.is_peer], [r for r in records if r.config.is_peer],
                  digest(directory / "records.jsonl"), raw)
    study.hypotheses, study.weak  # read now, so that what is wrong with them is found first
    return study


def read_text(path: Path, missing: str = "no such file (was the study interrupted? run it again with --resume)") -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(path, missing) from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read: {error}") from None


def digest(path: Path) -> str:
    """What tells a file from its later versions."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:32]


def parse(text: str, path: Path, line: int | None, nan: bool = False) -> dict[str, Any]:
    """An object. nan: NaN and infinities are let through, for who checks the numbers that are used."""
    def refuse(name: str) -> float:
        raise ValueError(f"{name} is not a JSON number")

    try:
        value = json.loads(text, parse_constant=None if nan else refuse)
    except json.JSONDecodeError as error:
        raise InputError(path, f"not JSON: {error.msg} at column {error.colno}", line or error.lineno) from None
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"not JSON: {error}", line) from None
    if not isinstance(value, dict):
        raise InputError(path, "expected an object", line)
    return value


def check_schema(value: dict[str, Any], path: Path, line: int | None) -> None:
    if "schema" not in value:
        raise InputError(path, "missing", line, "schema")
    if value["schema"] != SCHEMA or isinstance(value["schema"], bool):
        raise InputError(path, f"is {value['schema']!r}, this program reads {SCHEMA}", line, "schema")


def _context(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """With its defaults, and as it was written."""
    context = parse(read_text(path), path, None)
    raw = dict(context)
    check_schema(context, path, None)
    for key in ("program", "machine", "study"):
        if key not in context:
            raise InputError(path, "missing", None, key)
        if not isinstance(context[key], dict):
            raise InputError(path, "expected an object", None, key)
    for key in ("points", "images", "libraries", "environment", "custom"):  # absent in small or older studies
        if context.get(key) is None:
            context[key] = {}
        elif not isinstance(context[key], dict):
            raise InputError(path, "expected an object", None, key)
    return context, raw


def _hypotheses(path: Path, value: Any) -> list[Hypothesis]:
    def names(side: Any) -> bool:
        return isinstance(side, list) and all(isinstance(name, str) for name in side)

    if value is None:
        return []
    if not isinstance(value, list):
        raise InputError(path, "expected an array", None, "study.hypotheses")
    found = []
    for i, one in enumerate(value):
        right = (isinstance(one, dict) and isinstance(one.get("claim"), str) and is_number(one.get("by")) and one["by"] > -1
                 and names(one.get("faster")) and names(one.get("slower")) and isinstance(one.get("untested"), (str, type(None)))
                 and (one.get("untested") or one["faster"] and one["slower"]))
        if not right:
            raise InputError(path, f"{one!r} is not what `rasterbench study` writes", None, f"study.hypotheses[{i}]")
        found.append(Hypothesis(one["claim"], float(one["by"]), tuple(one["faster"]), tuple(one["slower"]), one.get("untested") or ""))
    return found


def _weak(path: Path, value: Any) -> list[WeakSeries]:
    if value is None:
        return []
    if not isinstance(value, list):
        raise InputError(path, "expected an array", None, "study.weak")
    found = []
    for i, one in enumerate(value):
        try:
            steps = {step["threads"]: (step["scene"], tuple(step["size"])) for step in one["steps"]}
            words = [one[key] for key in ("kind", "scene", "size")] + [scene for scene, _ in steps.values()]
            right = all(isinstance(word, str) for word in words) and all(
                is_whole(p) and len(size) == 2 and all(map(is_whole, size)) for p, (_, size) in steps.items())
        except (KeyError, TypeError):
            right = False
        if not right:
            raise InputError(path, f"{one!r} is not what `rasterbench study` writes", None, f"study.weak[{i}]")
        found.append(WeakSeries(one["kind"], one["scene"], one["size"], steps))
    return found


def _records(path: Path) -> list[Record]:
    records: list[Record] = []
    seen: dict[str, int] = {}
    for line, text in enumerate(read_text(path).split("\n"), start=1):
        if not text.strip():
            continue
        value = parse(text, path, line)
        record = _Reader(path, line, value).record()
        if record.id in seen:
            raise InputError(path, f"{record.id} is also on line {seen[record.id]}", line, "id")
        seen[record.id] = line
        records.append(record)
    if not records:
        raise InputError(path, "holds no records")
    return records


class _Reader:
    """One line of records.jsonl. Unknown keys are kept in raw and otherwise ignored, so that a schema may grow."""

    def __init__(self, path: Path, line: int, value: dict[str, Any]) -> None:
        self.path, self.line, self.value = path, line, value

    def fail(self, name: str, problem: str) -> InputError:
        return InputError(self.path, problem, self.line, name)

    def text(self, source: dict[str, Any], key: str, prefix: str = "") -> str:
        if key not in source:
            raise self.fail(prefix + key, "missing")
        if not isinstance(source[key], str) or not source[key]:
            raise self.fail(prefix + key, f"expected text, found {source[key]!r}")
        return source[key]

    def record(self) -> Record:
        value = self.value
        check_schema(value, self.path, self.line)
        identity, name = self.text(value, "id"), self.text(value, "name")
        config = self.config()
        status = self.text(value, "status")
        if status not in STATUSES:
            raise self.fail("status", f"is {status!r}, expected one of {', '.join(STATUSES)}")
        reason = str(value.get("reason") or "")
        if status != "ok" and not reason:
            raise self.fail("reason", f"missing, status is {status!r}")
        verify = self.verdicts(required=status == "ok")
        samples = self.samples() if status == "ok" else None
        stages, loop = (self.stages(samples.n), self.loop(samples.n)) if samples else ({}, None)
        if status == "ok" and config.is_peer:
            # A peer has no specification to conform to: it must be within its bound of the truth.
            if (verify.get("end_to_end") or {}).get("errors") != 0:
                status, samples, stages, reason = "failed", None, {}, "not known to be within its bound"
        elif status == "ok" and verify.get("conforms") is not True:
            # Invariant 1: what is not known to conform shows no speed, whatever the status says.
            status, samples, stages = "failed", None, {}
            reason = "does not conform" if verify.get("conforms") is False else "conformity was not checked"
        per_thread = value.get("per_thread") or []
        if not isinstance(per_thread, list) or any(not isinstance(entry, dict) for entry in per_thread):
            raise self.fail("per_thread", "expected an array of objects")
        self.raster_loop()
        median = value.get("median_ms")
        recorded = value.get("interval_ms")
        if recorded is not None and not (isinstance(recorded, list) and len(recorded) == 2 and all(map(is_number, recorded))):
            raise self.fail("interval_ms", "expected [low, high] or null")
        observed = value.get("threads_observed")
        runtime = None if value.get("runtime_observed") is None else self.text(value, "runtime_observed")
        return Record(self.line, identity, name, config, status, reason, samples, stages, value.get("stop"), verify,
                      self.mapping("work"), observed if is_number(observed) else None, tuple(per_thread),
                      float(median) if is_number(median) else None, tuple(recorded) if recorded else None,
                      value.get("context"), value, self.floor(), loop if samples else None, self.origin(), runtime)

    def origin(self) -> dict[str, Any] | None:
        origin = self.mapping("origin")
        for key in ("node", "node_type") if origin else ():
            self.text(origin, key, "origin.")
        return origin or None

    def floor(self) -> float | None:
        floor = self.value.get("floor_ms")
        if floor is not None and not (is_number(floor) and floor > 0):
            raise self.fail("floor_ms", f"expected a number above 0 or null, found {floor!r}")
        return None if floor is None else float(floor)

    def raster_loop(self) -> None:
        loop = self.mapping("raster_loop")
        known = [key for key in HELD_UP_KEYS if key in loop]
        for key in [*LOOP_KEYS, *known] if self.value.get("raster_loop") is not None else ():
            if not (is_number(loop.get(key)) and loop[key] >= 0):
                raise self.fail(f"raster_loop.{key}", f"expected a number that is not below 0, found {loop.get(key)!r}")

    def mapping(self, key: str, required: bool = False) -> dict[str, Any]:
        if required and key not in self.value:
            raise self.fail(key, "missing")
        value = self.value.get(key)
        if value is not None and not isinstance(value, dict):
            raise self.fail(key, "expected an object")
        return value or {}

    def verdicts(self, required: bool) -> dict[str, Any]:
        verify = self.mapping("verify", required)
        for part in ("oracle", "end_to_end", "embree", "embree_robust", "bound"):
            if verify.get(part) is None:
                continue
            if not isinstance(verify[part], dict):
                raise self.fail(f"verify.{part}", "expected an object or null")
            for key in COUNTED & verify[part].keys():
                value = verify[part][key]
                if value is not None and not (is_number(value) and (value >= 0 or key == "predicted")):
                    raise self.fail(f"verify.{part}.{key}", f"expected a number that is not below 0, or null, found {value!r}")
        return verify

    def config(self) -> Config:
        if "config" not in self.value:
            raise self.fail("config", "missing")
        config = self.mapping("config")
        for key in ("scene", "kernel", "numeric", "fill", "near", "backend", "isa", "output", "cache"):
            self.text(config, key, "config.")
        for key in ("size", "schedule", "chunk", "threads"):
            if key not in config:
                raise self.fail(f"config.{key}", "missing")
        size, threads, chunk = config["size"], config["threads"], config["chunk"]
        if not (isinstance(size, list) and len(size) == 2 and all(map(is_whole, size))):
            raise self.fail("config.size", f"expected [width, height], found {size!r}")
        if not is_whole(threads):
            raise self.fail("config.threads", f"expected a whole number above 0, found {threads!r}")
        if chunk is not None and not is_whole(chunk):
            raise self.fail("config.chunk", f"expected a whole number above 0 or null, found {chunk!r}")
        if config["schedule"] is not None:
            self.text(config, "schedule", "config.")
        known = {axis.name: config.get(axis.name) for axis in fields(Config)}
        if known["techniques"] is not None:
            try:
                technique_set(self.text(config, "techniques", "config."))
            except ValueError as error:
                raise self.fail("config.techniques", str(error)) from None
        for key in ("scene_hash", "binding", "wait_policy", "runtime", "tile", "generality"):
            if isinstance(known[key], (list, dict)):  # a tile of [32, 32], say: kept as text, it is only a label
                known[key] = json.dumps(known[key])
        return Config(**(known | {"size": tuple(size)}))

    def numbers(self, source: dict[str, Any], key: str, prefix: str = "") -> np.ndarray:
        if key not in source:
            raise self.fail(prefix + key, "missing")
        values = source[key]
        if not isinstance(values, list) or not all(map(is_number, values)):
            raise self.fail(prefix + key, "expected an array of numbers")
        return np.array(values, dtype=float)

    def samples(self) -> Samples:
        values = self.numbers(self.value, "samples_ms")
        if len(values) == 0:
            raise self.fail("samples_ms", "is empty, status is 'ok'")
        if np.any(values <= 0):
            raise self.fail("samples_ms", "holds a time that is not above 0")
        places = []
        for key in ("launches", "blocks"):
            place = self.numbers(self.value, key)
            if len(place) != len(values):
                raise self.fail(key, f"holds {len(place)} values for {len(values)} samples")
            places.append(place.astype(int))
        return Samples(values, *places)

    def loop(self, n: int) -> np.ndarray | None:
        if self.value.get("loop_ms") is None:
            return None
        values = self.numbers(self.value, "loop_ms")
        if len(values) != n:
            raise self.fail("loop_ms", f"holds {len(values)} values for {n} samples")
        return values if len(values) and values.min() > 0 else None  # zeros: frames without stamps, in older records

    def stages(self, n: int) -> dict[str, np.ndarray]:
        source = self.mapping("stages_ms")
        stages = {}
        for key in [*STAGES, *(k for k in source if k not in STAGES)]:
            if source.get(key) is None:
                continue
            stages[key] = self.numbers(source, key, "stages_ms.")
            if len(stages[key]) != n:
                raise self.fail(f"stages_ms.{key}", f"holds {len(stages[key])} values for {n} samples")
        return stages
