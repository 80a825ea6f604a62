"""What may be compared with what: groups of points, their names, their bases, the fastest of each group."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Callable, Collection, TypeVar

from . import nodes, steadiness, text
from .load import Config, Record, Study
from .statistics import estimates
from .statistics.estimates import Estimate
from .statistics.fastest import Comparison, compare_with_best
from .steadiness import Steadiness

# Two points are compared only if these are equal: same picture, same arithmetic, same region, same cache state.
GROUP_AXES = ("scene", "scene_hash", "size", "numeric", "fill", "near", "output", "cache")
# Always in a point's name: kernel, backend:schedule,chunk, threads. These only where a kernel has several values.
EXTRA_AXES = ("isa", "tile", "binding", "wait_policy", "runtime", "generality", "techniques")
PEER_AXES = ("scene", "scene_hash", "size")  # what a peer shares with the groups that it is shown beside
BASE_AXES = ("scene", "scene_hash", "size", "numeric", "fill", "near", "isa", "output", "cache")
T = TypeVar("T")


@dataclass(eq=False)
class Group:
    """The points of one picture in one arithmetic."""

    key: tuple
    title: str
    records: list[Record]
    peers: list[Record] = field(default_factory=list)  # other programs on the same scene and size
    best: Record | None = None
    comparisons: dict[str, Comparison] = field(default_factory=dict)
    slug: str = ""  # for file names; no two groups have the same

    @property
    def timed(self) -> list[Record]:
        return [record for record in self.records if record.ok]

    @property
    def untimed(self) -> list[Record]:
        return [record for record in self.records if not record.ok]

    @property
    def kernels(self) -> list[str]:
        return list(dict.fromkeys(record.config.kernel for record in self.records))

    @property
    def family_slug(self) -> str:
        config = (self.records or self.peers)[0].config
        return slug(f"{config.scene} {config.size[0]}x{config.size[1]}")


@dataclass(frozen=True)
class Panel:
    """The schedules and chunks of one kernel on one thread count."""

    group: Group
    kernel: str
    threads: int
    cells: dict[tuple[str, int | None], Record]
    comparisons: dict[str, Comparison]


def slug(title: str) -> str:
    """A title as a file name."""
    words = "".join(c.lower() if c.isalnum() and c.isascii() else " " for c in title).split()
    name = "_".join(words)
    if len(name) <= 64:
        return name
    # A long name keeps both ends, because size and numeric mode stand last; a digest tells it from its like.
    digest = hashlib.sha256(title.encode()).hexdigest()[:6]
    return f"{name[:30].rpartition('_')[0]}_{digest}_{name[-26:].partition('_')[2]}"


def _peer_key(record: Record) -> tuple:
    return tuple(getattr(record.config, axis) for axis in PEER_AXES)


def execution(config: Config) -> str:
    """'serial', 'openmp static', 'openmp dynamic,1', 'tbb auto'."""
    if config.backend == "serial" or config.schedule is None:
        return config.backend
    chunk = "" if config.chunk is None else f",{config.chunk}"
    return f"{config.backend} {config.schedule}{chunk}"


def strategy(record: Record) -> str:
    """The kernel, or the peer, which is called one."""
    return f"{record.config.kernel} (peer)" if record.config.is_peer else record.config.kernel


class Analysis:
    """A study with everything that is computed from it once and shown in several places."""

    def __init__(self, study: Study) -> None:
        self.study = study
        self._extra = self._varying_extras()
        self.estimates = {record.id: estimates.median_estimate(record.samples) for record in study.every_record if record.ok}
        self.groups = self._groups()
        self.serial_base = {record.id: self._find_serial_base(record) for record in study.timed}
        self.thread_base = {record.id: self._find_thread_base(record) for record in study.timed}
        self._ratios: dict[tuple[str, str], Estimate] = {}
        self._made: dict[tuple, Any] = {}

    def once(self, make: Callable[..., T], *arguments: Any) -> T:
        """What make(self, *arguments) returns, computed the first time only: figures, tables, findings and lint show the same
        numbers, and bootstraps take long. Nobody may change what is returned."""
        key = (make, *arguments)
        if key not in self._made:
            self._made[key] = make(self, *arguments)
        return self._made[key]

    # names

    def _varying_extras(self) -> dict[str, list[str]]:
        """For each kernel the axes without which two of its points would have one name."""
        values: dict[tuple, set] = {}
        for record in self.study.records:
            config = record.config
            named = (*(getattr(config, axis) for axis in GROUP_AXES), config.kernel, execution(config), config.threads)
            for axis in EXTRA_AXES:
                values.setdefault((config.kernel, axis, named), set()).add(getattr(config, axis))
        varying: dict[str, list[str]] = {}
        for (kernel, axis, _), found in values.items():
            if len(found) > 1 and axis not in varying.setdefault(kernel, []):
                varying[kernel].append(axis)
        return varying

    def execution(self, record: Record) -> str:
        extra = [f"{axis} {getattr(record.config, axis)}" for axis in self._extra.get(record.config.kernel, [])
                 if getattr(record.config, axis) is not None]
        return ", ".join([execution(record.config), *extra])

    def threads(self, record: Record) -> str:
        return text.count(record.config.threads, "thread")

    def label(self, record: Record) -> str:
        """'tile_parallel with openmp dynamic,1 on 2 threads', 'llvmpipe (peer) on 2 threads'."""
        if record.config.is_peer:
            return f"{strategy(record)} on {self.threads(record)}"
        where = "" if record.config.backend == "serial" else f" on {self.threads(record)}"
        return f"{record.config.kernel} with {self.execution(record)}{where}"

    def time(self, record: Record) -> str:
        e = self.estimates[record.id]
        return text.estimate(e.value, e.low, e.high, " ms")

    @cached_property
    def machine(self) -> str:
        """'AMD EPYC 7763, 8 CPUs' for captions."""
        return nodes.machine(self.study.every_record) or text.machine(self.study.context["machine"])

    # groups and bases

    def _groups(self) -> list[Group]:
        found: dict[tuple, list[Record]] = {}
        for record in self.study.records:
            found.setdefault(tuple(getattr(record.config, axis) for axis in GROUP_AXES), []).append(record)
        peers: dict[tuple, list[Record]] = {}
        for record in self.study.peers:
            peers.setdefault(_peer_key(record), []).append(record)
        beside = {key: peers.get(_peer_key(records[0]), []) for key, records in found.items()}
        drawn = {_peer_key(records[0]) for records in found.values()}
        for key in (key for key in peers if key not in drawn):  # no kernel drew that picture
            alone = tuple(getattr(peers[key][0].config, axis) for axis in GROUP_AXES)
            found[alone], beside[alone] = [], peers[key]
        varying = [axis for i, axis in enumerate(GROUP_AXES) if len({key[i] for key in found}) > 1]
        # A hash is said only where the same name stands for two contents.
        names = {key[0] for key in found}
        if len({key[:2] for key in found}) == len(names) and "scene_hash" in varying:
            varying.remove("scene_hash")
        families = sum(any(record.ok for record in records) for records in found.values())
        groups = []
        for key, records in found.items():
            config = (records or beside[key])[0].config
            title = f"{config.scene} {config.size[0]}x{config.size[1]} {config.numeric}"
            said = {"scene", "size", "numeric"}
            title += "".join(f" {getattr(config, axis)}" for axis in varying if axis not in said)
            groups.append(self._compared(Group(key, title, records, beside[key]), families))
        for group in groups:
            same = [other for other in groups if slug(other.title) == slug(group.title)]
            group.slug = slug(group.title) + (f"_{same.index(group) + 1}" if len(same) > 1 else "")
        return groups

    def _compared(self, group: Group, families: int) -> Group:
        timed = group.timed
        if timed:
            best, comparisons = compare_with_best([r.samples for r in timed], self.study.target, families)
            group.best = timed[best]
            group.comparisons = {record.id: c for record, c in zip(timed, comparisons)}
        return group

    def without(self, group: Group, kernels: Collection[str], families: int) -> Group:
        """The group without some kernels, its points compared afresh among themselves; families: as many groups are shown so."""
        left = Group(group.key, group.title, [r for r in group.records if r.config.kernel not in kernels], slug=group.slug)
        return self._compared(left, families)

    def group_of(self, record: Record) -> Group:
        return next(group for group in self.groups if any(r is record for r in (*group.records, *group.peers)))

    def _median(self, record: Record) -> float:
        return self.estimates[record.id].value

    def fastest(self, records: list[Record]) -> Record | None:
        return min(records, key=self._median, default=None)

    def slowest(self, records: list[Record]) -> Record | None:
        return max(records, key=self._median, default=None)

    def _find_serial_base(self, record: Record) -> Record | None:
        """Base (a): the fastest serial record with equal picture, numeric mode, instruction set, output, cache."""
        key = [getattr(record.config, axis) for axis in BASE_AXES]
        return self.fastest([r for r in self.study.timed if r.config.backend == "serial"
                             and [getattr(r.config, axis) for axis in BASE_AXES] == key])

    def _find_thread_base(self, record: Record) -> Record | None:
        """Base (b): the same point on one thread; a serial point is its own."""
        if record.config.threads == 1 or record.config.backend == "serial":
            return record

        def axes(config: Config) -> dict:
            return {**vars(config), "threads": None}

        same = axes(record.config)
        return next((r for r in self.study.timed if r.config.threads == 1 and axes(r.config) == same), None)

    def speedup(self, record: Record, base: Record | None) -> Estimate | None:
        """Time of the base / time of the point, from paired samples."""
        if base is None or base is record:
            return None
        key = (base.id, record.id)
        if key not in self._ratios:
            self._ratios[key] = estimates.ratio(base.samples, record.samples)
        return self._ratios[key]

    @cached_property
    def steadiness(self) -> dict[str, Steadiness]:
        """Drift and outliers of every timed point, peers included."""
        timed = [record for record in self.study.every_record if record.ok]
        return dict(zip((r.id for r in timed), steadiness.judge([r.samples for r in timed], self.study.target)))

    @cached_property
    def panels(self) -> list[Panel]:
        """Schedule x chunk of every kernel at the highest thread count of its group, each compared within itself."""
        found: list[tuple[Group, str, int, dict[tuple[str, int | None], Record]]] = []
        for group in self.groups:
            parallel = [r for r in group.records if r.config.backend != "serial" and r.config.schedule is not None]
            threads = max((r.config.threads for r in parallel if r.ok), default=0)
            for kernel in group.kernels:
                cells = {(self._without_chunk(r), r.config.chunk): r for r in parallel
                         if r.config.kernel == kernel and r.config.threads == threads}
                if sum(r.ok for r in cells.values()) > 1:
                    found.append((group, kernel, threads, cells))
        panels = []
        for group, kernel, threads, cells in found:
            timed = [r for r in cells.values() if r.ok]
            _, comparisons = compare_with_best([r.samples for r in timed], self.study.target, len(found))
            panels.append(Panel(group, kernel, threads, cells, {r.id: c for r, c in zip(timed, comparisons)}))
        return panels

    def _without_chunk(self, record: Record) -> str:
        name = self.execution(record)
        return name if record.config.chunk is None else name.replace(f",{record.config.chunk}", "", 1)

    # shared selections

    @property
    def thread_counts(self) -> list[int]:
        return sorted({r.config.threads for r in self.study.timed if r.config.backend != "serial"})

    def sampled(self, records: list[Record]) -> str:
        return text.span([record.samples.n for record in records if record.ok])

    def interval_kind(self, records: list[Record]) -> str:
        kinds = {self.estimates[r.id].kind for r in records if r.ok} - {"none"}
        return " / ".join(sorted(kinds))
