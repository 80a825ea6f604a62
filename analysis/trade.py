"""Speed against accuracy: the numeric modes of each picture, and of several scenes together.

The base is the literal program of the course text: serial, in mode two_product, visiting every pixel for every triangle, or
every pixel of a triangle's bounding box where the former was not timed. There are two views of a picture. In one each mode
stands for its fastest timed point, which is what a user can choose from; kernel and execution are part of what is compared. In
the other every mode stands in the loop of the literal program, so that only the arithmetic differs. Over scenes a mode stands
for one kernel and execution, the fastest of those that were timed on all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from . import text
from .comparison import GROUP_AXES, Analysis, slug
from .fronts import LITERAL, MEASURES, WRONG, Front, Mark, Measure, Worst, front
from .load import Record
from .statistics import estimates, intervals, launch_tests, rank_tests
from .statistics.estimates import Estimate

SECTION = "Speed against accuracy"
LITERAL_MODE, LITERAL_KERNELS = "two_product", ("all_pixels", "bounding_box")
REFERENCE_MODE = "f32"
PICTURE_AXES = tuple(axis for axis in GROUP_AXES if axis != "numeric")
KIND_AXES = ("fill", "near", "output", "cache")
# What two points must share for their ratio to be the price of the arithmetic alone; the instruction set where it can be.
LIKE_AXES = ("kernel", "backend", "schedule", "chunk", "threads", "tile", "binding", "wait_policy", "runtime", "generality", "techniques")


@dataclass(eq=False)
class Picture:
    """One scene at one size under one set of rules, drawn in several numeric modes."""

    key: tuple
    title: str
    short: str  # the title without what all pictures share
    slug: str
    records: list[Record]

    def axis(self, name: str) -> object:
        return self.key[PICTURE_AXES.index(name)]


@dataclass(eq=False)
class View:
    """Points to be compared: of each mode one record a picture."""

    title: str
    slug: str
    pictures: list[Picture]
    bases: list[Record]  # one a picture, of one mode and kernel; empty where the pictures share none
    modes: dict[str, list[Record]]
    missing: list[str]  # modes that were not timed and judged on every picture

    @property
    def several(self) -> bool:
        return len(self.pictures) > 1

    @property
    def one_loop(self) -> bool:
        """Whether all modes were timed in one kernel and execution, so that only their arithmetic differs."""
        return len({_like(record) for records in self.modes.values() for record in records}) == 1

    def same_points(self, other: View) -> bool:
        def ids(view: View) -> list[str]:
            return sorted(r.id for records in (view.bases, *view.modes.values()) for r in records)

        return ids(self) == ids(other)


class Trade:
    def __init__(self, analysis: Analysis) -> None:
        self.analysis = analysis
        self.pictures = self._pictures()
        self._fronts: dict[tuple[int, str], Front] = {}
        self.fastest = {picture.slug: self._view([picture], picture.title, picture.slug) for picture in self.pictures}
        self.loops = {picture.slug: loop for picture in self.pictures
                      if (loop := self._loop([picture], picture.title, picture.slug)) is not None
                      and not loop.same_points(self.fastest[picture.slug])}
        self.over_scenes = self._over_scenes()

    # selection

    def _pictures(self) -> list[Picture]:
        found: dict[tuple, list[Record]] = {}
        for record in self.analysis.study.records:
            found.setdefault(tuple(getattr(record.config, axis) for axis in PICTURE_AXES), []).append(record)
        found = {key: records for key, records in found.items()
                 if len({r.config.numeric for r in records if WRONG.of(r) is not None}) > 1}
        varying = [axis for axis in KIND_AXES if len({key[PICTURE_AXES.index(axis)] for key in found}) > 1]
        titles = {key: f"{r.config.scene} {r.config.size[0]}x{r.config.size[1]}" + "".join(f" {getattr(r.config, a)}" for a in varying)
                  for key, (r, *_) in found.items()}
        scenes = [records[0].config.scene for records in found.values()]
        pictures: list[Picture] = []
        for key, records in found.items():
            short = records[0].config.scene if len(set(scenes)) == len(scenes) else titles[key]
            own, count = slug(titles[key]), 1
            while any(picture.slug == own for picture in pictures):
                count += 1
                own = f"{slug(titles[key])}_{count}"
            pictures.append(Picture(key, titles[key], short, own, records))
        return pictures

    def _view(self, pictures: list[Picture], title: str, name: str, kernel: str | None = None) -> View:
        """Every mode in the kernel and execution that is the fastest over the pictures; with a kernel in its serial loop."""
        places: list[dict[str, dict[tuple, Record]]] = []
        for picture in pictures:
            modes: dict[str, dict[tuple, Record]] = {}
            for r in picture.records:
                if r.ok and any(m.of(r) is not None for m in MEASURES) and (
                        kernel is None or (r.config.kernel, r.config.backend) == (kernel, "serial")):
                    modes.setdefault(r.config.numeric, {})[*_like(r), r.config.isa] = r
            places.append(modes)
        every = list(dict.fromkeys(r.config.numeric for picture in pictures for r in picture.records))
        chosen: dict[str, list[Record]] = {}
        for mode in every:
            common = [key for key in places[0].get(mode, {}) if all(key in modes.get(mode, {}) for modes in places)]
            if common:
                best = min(common, key=lambda key: sum(np.log(self._median(modes[mode][key])) for modes in places))
                chosen[mode] = [modes[mode][best] for modes in places]
        literal = (self._literal(pictures, k) for k in ((kernel,) if kernel else LITERAL_KERNELS))
        bases = next((found for found in literal if found), chosen.get(REFERENCE_MODE, []))
        return View(title, name, pictures, bases, chosen, [mode for mode in every if mode not in chosen])

    def _loop(self, pictures: list[Picture], title: str, name: str) -> View | None:
        """Every mode in the serial loop of the literal program, in the kernel that carries most modes."""
        views = [self._view(pictures, f"{title}, every mode in the literal program's loop", f"{name}_loop", kernel)
                 for kernel in LITERAL_KERNELS if self._literal(pictures, kernel)]
        best = max(views, key=lambda view: len(view.modes), default=None)
        return best if best is not None and len(best.modes) > 2 else None

    def _literal(self, pictures: list[Picture], kernel: str) -> list[Record]:
        """The literal program for each picture, empty if one lacks it; it may have other near and fill rules."""
        result = []
        for picture in pictures:
            same = ("scene", "scene_hash", "size", "output", "cache")
            found = [r for r in self.analysis.study.timed if r.config.numeric == LITERAL_MODE and r.config.kernel == kernel
                     and r.config.backend == "serial" and all(getattr(r.config, axis) == picture.axis(axis) for axis in same)]
            if not found:
                return []
            result.append(min(found, key=lambda r: (r.config.fill != picture.axis("fill"), r.config.near != picture.axis("near"),
                                                    r.config.isa != "baseline", self._median(r))))
        return result

    def _over_scenes(self) -> list[View]:
        """For each set of rules: every mode in the literal program's loop, then every mode where it is fastest."""
        kinds: dict[tuple, list[Picture]] = {}
        for picture in self.pictures:
            if len(self.fastest[picture.slug].modes) > 1:
                kinds.setdefault(tuple(map(picture.axis, KIND_AXES)), []).append(picture)
        kinds = {kind: pictures for kind, pictures in kinds.items() if len(pictures) > 1}
        views = []
        for kind, pictures in kinds.items():
            rules = " ".join(v for i, v in enumerate(kind) if len({k[i] for k in kinds}) > 1)
            title = " ".join(filter(None, [text.count(len(pictures), "scene"), rules]))
            name = "_".join(filter(None, ["over_scenes", slug(rules)]))
            fastest, loop = self._view(pictures, title, name), self._loop(pictures, title, name)
            views += [fastest] if loop is None or loop.same_points(fastest) else [loop, fastest]
        return views

    def views(self) -> list[View]:
        """In the order of the report."""
        single = [view for p in self.pictures for view in (self.fastest[p.slug], self.loops.get(p.slug)) if view is not None]
        return [*self.over_scenes, *single]

    def entries(self, picture: Picture) -> dict[str, Record]:
        """One record a mode, in the order of the study: its fastest point, or one that tells why there is none."""
        timed, untimed = self.fastest[picture.slug].modes, _untimed(picture.records)
        return {mode: timed[mode][0] if mode in timed else record for mode, record in untimed.items()}

    def base(self, picture: Picture) -> Record | None:
        return next(iter(self.fastest[picture.slug].bases), None)

    # speed

    def _median(self, record: Record) -> float:
        return self.analysis.estimates[record.id].value

    def over(self, base: Record, record: Record) -> Estimate:
        """Time of the base / time of the record; 1 for the base itself."""
        found = self.analysis.speedup(record, base)
        return Estimate(1.0, 1.0, 1.0, record.samples.n, "base") if found is None else found

    def against(self, bases: list[Record], records: list[Record]) -> Estimate:
        """The speedup on one picture, or its geometric mean over several."""
        ratios = [self.over(base, record) for base, record in zip(bases, records)]
        return ratios[0] if len(ratios) == 1 else estimates.geometric_mean(ratios)

    def is_literal(self, record: Record | None) -> bool:
        config = record.config if record is not None else None
        return config is not None and (config.numeric, config.backend) == (LITERAL_MODE, "serial") and config.kernel in LITERAL_KERNELS

    # fronts

    def front(self, view: View, measure: Measure) -> Front | None:
        """None where fewer than two modes have a value and a speedup."""
        key = (id(view), measure.key)
        if key not in self._fronts:
            self._fronts[key] = self._front(view, measure)
        found = self._fronts[key]
        return found if sum(mark.name != LITERAL for mark in found.marks) > 1 else None

    def fronts(self, view: View) -> list[Front]:
        return [found for measure in MEASURES if (found := self.front(view, measure)) is not None]

    def _front(self, view: View, measure: Measure) -> Front:
        if not view.bases:
            return Front(measure, [], [], {}, [])
        chosen = view.modes
        if self.is_literal(view.bases[0]):
            chosen = {LITERAL: view.bases} | {mode: records for mode, records in chosen.items()
                                              if any(r is not b for r, b in zip(records, view.bases))}
        marks = [self._mark(name, view, records, [measure.of(r) for r in records])
                 for name, records in chosen.items() if all(measure.of(r) is not None for r in records)]
        pairs = len(marks) * (len(marks) - 1) / 2

        def dominates(better: Mark, worse: Mark) -> bool:
            ratio = self.against(list(worse.records), list(better.records))
            if not ratio.has_interval:
                return False
            if better.error < worse.error and ratio.low > 1 - self.analysis.study.target:
                return True  # less wrong, and by its interval not slower by more than the study resolves
            if view.several:
                return estimates.widened(ratio, pairs).low > 1
            return ratio.low > 1 and self._significant(worse.records[0], better.records[0], pairs * len(self.pictures))

        return front(measure, marks, dominates)

    def _mark(self, name: str, view: View, records: list[Record], errors: list[float]) -> Mark:
        speedup = self.against(view.bases, records)
        if not view.several:
            return Mark(name, tuple(records), speedup, errors[0])
        each = [Worst(picture.short, self.over(base, record).value, error)
                for picture, base, record, error in zip(view.pictures, view.bases, records, errors)]
        return Mark(name, tuple(records), speedup, float(np.mean(errors)), max(each, key=lambda w: (w.error, -w.speedup)))

    def _significant(self, slower: Record, faster: Record, family: float) -> bool:
        """The tests of compare_with_best, for all pairs of modes of all pictures (Bonferroni)."""
        p = max(rank_tests.rank_test(slower.samples, faster.samples, family)[0],
                launch_tests.launch_tests([slower.samples, faster.samples], best=1)[0])
        return p * family < 1 - intervals.CONFIDENCE


def _like(record: Record) -> tuple:
    return tuple(getattr(record.config, axis) for axis in LIKE_AXES)


def _untimed(records: list[Record]) -> dict[str, Record]:
    """One record a mode in the order of the study, one that was judged before one that was not."""
    found: dict[str, Record] = {record.config.numeric: record for record in reversed(records)}
    found = {mode: found[mode] for mode in dict.fromkeys(record.config.numeric for record in records)}
    for record in reversed(records):
        if WRONG.of(record) is not None:
            found[record.config.numeric] = record
    return found


@lru_cache(maxsize=1)
def of(analysis: Analysis) -> Trade:
    """Figures, tables and findings share one: its tests are the costly part."""
    return Trade(analysis)
