"""The rules of measuring that these data break, each said in the report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Iterator

from . import nodes, openmp_runtimes, severity, text, weak
from .comparison import Analysis
from .contexts import leaves
from .load import Record, Study
from .raster_loop import busy
from .severity import GRAVE, NOTE
from .statistics import intervals, rank_tests
from .statistics.numbers import is_close
from .steadiness import placement

NOT_PUBLISHABLE = "not publishable"  # what the report calls a grave one
P95_SAMPLES = 59  # with fewer, the 95th percentile of a sample says nothing with 95 % confidence
NEEDED = {"program": ("commit", "compiler", "flags", "build_id"), "machine": ("cpu", "cpus_allowed", "caches", "governor", "smt", "numa_nodes")}


@dataclass(frozen=True)
class Warn:
    grade: str  # of severity.py
    text: str

    @property
    def severity(self) -> str:
        return NOT_PUBLISHABLE if self.grade == GRAVE else self.grade


def unrecorded(study: Study) -> list[str]:
    """Keys of the set-up of which context.json, as it was written, says nothing; what is unavailable is said."""
    raw = study.raw_context
    silent = [f"{part}.{key}" for part, keys in NEEDED.items() for key in keys if raw[part].get(key) in (None, "")]
    silent += [part for part in ("libraries", "environment") if raw.get(part) is None]  # no variable set is {}
    if not raw.get("libraries") and "libraries" not in silent:
        silent.append("libraries")
    return silent


def unhashed(study: Study) -> list[Record]:
    """Points of which nothing says what their scene held."""
    return [record for record in study.every_record if record.ok and not record.config.scene_hash]


def check(analysis: Analysis) -> list[Warn]:
    """The grave ones first."""
    found = [warn for rule in (_launches, _samples, _stops, _provenance, _nodes, _jobs, _load, _noise, _bases, _pinning, _placement, _steadiness, _threads, _runtimes, _floors,
                               _families, _agreement, _images) for warn in rule(analysis)]
    return sorted(found, key=lambda warn: warn.grade != GRAVE)


def _some(records: list[Record], analysis: Analysis) -> str:
    return f"{len(records)} of {text.count(len(analysis.study.timed), 'timed point')}"


def _launches(analysis: Analysis) -> Iterator[Warn]:
    counts = {record.samples.launch_count for record in analysis.study.timed}
    if counts and min(counts) < intervals.MIN_LAUNCHES:
        many = "one launch" if max(counts) == 1 else text.count(min(counts), "launch", "launches")
        many += " for some points" if len(counts) > 1 else ""
        yield Warn(severity.FEW_LAUNCHES, f"{many}: published results need at least {intervals.MIN_LAUNCHES}, because one process has one"
                   " memory layout; the intervals here do not cover what another launch would change.")


def _samples(analysis: Analysis) -> Iterator[Warn]:
    few = [r for r in analysis.study.timed if r.samples.n < intervals.MIN_SAMPLES]
    if few:
        yield Warn(severity.FEW_SAMPLES, f"fewer than {intervals.MIN_SAMPLES} samples for {_some(few, analysis)}: they have no interval and"
                   " nothing is claimed of them.")


def _stops(analysis: Analysis) -> Iterator[Warn]:
    for stop in ("time_limit", "point_seconds", "max_samples"):
        stopped = [r for r in analysis.study.timed if r.stop == stop]
        if stopped:
            widths = [(e.high - e.low) / e.value / 2 for r in stopped if (e := analysis.estimates[r.id]).has_interval]
            wide = f"; the widest interval is ±{text.percent(max(widths))} of its median" if widths else ""
            why = {"time_limit": "the time limit of the study", "point_seconds": "the time limit of a point",
                   "max_samples": "the largest number of samples"}[stop]
            yield Warn(severity.STOPPED_BY_LIMIT, f"{_some(stopped, analysis)} stopped by {why}, not because the interval was within the target{wide}.")
    unsaid = [r for r in analysis.study.timed if not r.stop]
    if unsaid:
        yield Warn(severity.NO_STOP, f"no stop reason recorded for {_some(unsaid, analysis)}.")


def _provenance(analysis: Analysis) -> Iterator[Warn]:
    context = analysis.study.context
    if context["program"].get("dirty") is not False:
        yield Warn(severity.DIRTY, "the program was built from a dirty commit: its source cannot be had again from the commit."
                   if context["program"].get("dirty") else "the record does not say whether the commit was dirty.")
    if silent := unrecorded(analysis.study):
        yield Warn(severity.NOT_RECORDED, f"the context says nothing of {text.listing(silent, 8)}.")
    if nameless := unhashed(analysis.study):
        yield Warn(severity.NOT_RECORDED, f"no hash of the scene for {text.count(len(nameless), 'timed point')}: another file may have its name.")
    missing = [f"{path} ({value.split(':', 1)[1].strip() if ':' in value else 'no reason'})" for path, value in leaves(context)
               if isinstance(value, str) and value.startswith("unavailable")]
    if missing:
        yield Warn(NOTE, f"not available on this machine: {text.listing(missing, 6)}.")


def _nodes(analysis: Analysis) -> Iterator[Warn]:
    """What was measured on several nodes compares machines."""
    types = nodes.node_types(analysis.study.every_record)
    names = nodes.nodes(analysis.study.every_record)
    if mixed := nodes.mixed_groups(analysis):
        yield Warn(GRAVE, f"points that are compared were measured on different nodes: {text.listing(mixed, 4)}.")
    if len(types) > 1:
        yield Warn(GRAVE, f"{len(types)} types of nodes: {text.listing(types, 4)}. What goes over several pictures (time against"
                   " work, where each strategy wins, speed against accuracy, sums over scenes) compares machines, too.")
    elif len(names) > 1:
        yield Warn(NOTE, f"measured on {len(names)} nodes of one type ({types[0]}): each picture and numeric mode on one of them, so"
                   " curves over several of these hold the differences between nodes.")


def _jobs(analysis: Analysis) -> Iterator[Warn]:
    """What the jobs of a merged study were given, against what they asked for."""
    found = analysis.study.context.get("parts")
    jobs = [part["provenance"] for part in found if isinstance(part, dict) and isinstance(part.get("provenance"), dict)] \
        if isinstance(found, list) else []
    narrow = [job for job in jobs if _is_count(job.get("mask_cpus")) and _is_count(job.get("cpus_per_task"))
              and job["mask_cpus"] < job["cpus_per_task"]]
    if narrow:
        yield Warn(GRAVE, f"{len(narrow)} of {text.count(len(jobs), 'job')} might use fewer CPUs than they reserved (first:"
                   f" {narrow[0]['mask_cpus']} of {narrow[0]['cpus_per_task']} on {narrow[0].get('node')}): threads shared a core.")
    shared = [job for job in jobs if job.get("exclusive") is not True]
    if shared:
        yield Warn(NOTE, f"{len(shared)} of {text.count(len(jobs), 'job')} did not have their node to themselves, or do not say so: other"
                   " jobs may have disturbed them.")


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def first_load(value: Any) -> float | None:
    """The one-minute load average, from a number, a list or the text of /proc/loadavg."""
    if isinstance(value, (list, tuple)) and value:
        value = value[0]
    if isinstance(value, str):
        value = value.split()[0].rstrip(",") if value.split() else None
    try:
        load = float(value)
    except (TypeError, ValueError):
        return None
    return load if math.isfinite(load) else None


def _load(analysis: Analysis) -> Iterator[Warn]:
    machine = analysis.study.context["machine"]
    load = first_load(machine.get("load_average"))
    cpus = machine.get("cpus_online")
    cpus = cpus if isinstance(cpus, int) and cpus > 0 else 1
    if load is not None and load > 0.25 * cpus:
        yield Warn(severity.BUSY_MACHINE, f"load average {load:g} on {text.count(cpus, 'CPU')} at the start: something else was running.")


def watched_noise(study: Study) -> dict[str, Any] | None:
    """What the study saw of other load between its blocks; None where it did not look."""
    noise = study.context.get("noise")
    return noise if isinstance(noise, dict) else None


def _noise(analysis: Analysis) -> Iterator[Warn]:
    for warning in (watched_noise(analysis.study) or {}).get("warnings", ()):
        yield Warn(severity.BUSY_MACHINE, f"noisy machine while sampling: {warning}.")


def sharing(study: Study, record: Record) -> str:
    """In how many samples two threads were seen on one core, where there are cores for all of them; else empty: more threads
    than cores must share."""
    seen = placement(record) or {}
    samples, cores = seen.get("samples_sharing_core"), study.context["machine"].get("cores")
    if not _is_count(samples) or not samples or (_is_count(cores) and record.config.threads > cores):
        return ""
    return f"{samples} of {text.count(record.samples.n, 'sample')}"


def _placement(analysis: Analysis) -> Iterator[Warn]:
    timed = analysis.study.timed
    shared = [r for r in timed if sharing(analysis.study, r)]
    if shared:
        yield Warn(severity.SHARED_CORE, f"two threads were seen on one core in {_some(shared, analysis)}, though there are cores for all (first:"
                   f" {analysis.label(shared[0])}, in {sharing(analysis.study, shared[0])}).")
    broken = [r for r in timed if (placement(r) or {}).get("binding") not in (None, "kept")]
    if broken:
        yield Warn(severity.BINDING_BROKEN, f"the binding was not kept in {_some(broken, analysis)}.")


def _steadiness(analysis: Analysis) -> Iterator[Warn]:
    found = [(r, analysis.steadiness[r.id]) for r in analysis.study.timed]
    drifting = [s.drift for _, s in found if s.drift is not None]
    if drifting:
        yield Warn(severity.NOT_STEADY, f"times drifted in {_some([r for r, s in found if s.drift is not None], analysis)}, by up to"
                   f" {100 * max(drifting, key=abs):+.1f} % over the run: trust ratios of samples of one block, not single times.")
    outlying = [r for r, s in found if s.outliers]
    if outlying:
        yield Warn(severity.NOT_STEADY, f"outliers in {_some(outlying, analysis)}, all kept: the largest is"
                   f" {max(s.largest for _, s in found):.3g} times its median.")


def _bases(analysis: Analysis) -> Iterator[Warn]:
    timed = analysis.study.timed
    parallel = [r for r in timed if r.config.backend != "serial"]
    no_serial = [r for r in parallel if analysis.serial_base[r.id] is None]
    weak_bases = weak.bases(analysis)  # of a picture that grows with the threads, that of one
    no_thread = [r for r in parallel if analysis.thread_base[r.id] is None and r.id not in weak_bases]
    if no_serial:
        yield Warn(severity.NO_BASE, f"no base (a), a serial kernel with equal picture, numeric mode and instruction set, for"
                   f" {_some(no_serial, analysis)}.")
    if no_thread:
        yield Warn(severity.NO_BASE, f"no base (b), the same point on one thread, for {_some(no_thread, analysis)}: they show no efficiency.")
    notes: dict[str, int] = {}
    for record in timed:
        for base in (analysis.serial_base[record.id], analysis.thread_base[record.id]):
            speedup = analysis.speedup(record, base)
            if speedup is not None and speedup.note:
                notes[speedup.note] = notes.get(speedup.note, 0) + 1
    for note, many in notes.items():
        yield Warn(severity.BASE_CAVEAT, f"{text.count(many, 'speedup')} with a caveat: {note}.")


def _pinning(analysis: Analysis) -> Iterator[Warn]:
    loose = [r for r in analysis.study.timed if r.config.threads > 1
             and str(r.config.binding or "none").lower() in ("none", "false", "off")]
    if loose:
        yield Warn(severity.NOT_PINNED, f"threads were not pinned for {_some(loose, analysis)}: the scheduler may have moved them.")


def _threads(analysis: Analysis) -> Iterator[Warn]:
    fewer = [r for r in analysis.study.timed if r.threads_observed is not None and r.threads_observed < r.config.threads]
    if fewer:
        yield Warn(severity.FEWER_THREADS, f"fewer threads ran than were asked for in {_some(fewer, analysis)}.")
    idle = [r for r in analysis.study.timed if (times := busy(r)) and min(times) < 0.01 * max(times)]
    if idle:
        yield Warn(severity.IDLE_THREAD, f"a thread did next to nothing (under 1 % of the busiest one's time) in {_some(idle, analysis)}: these times are"
                   f" those of fewer threads than their label says (first: {analysis.label(idle[0])}).")
    allowed = analysis.study.context["machine"].get("cpus_allowed")
    if isinstance(allowed, list) and allowed:
        over = [r for r in analysis.study.timed if r.config.threads > len(allowed)]
        if over:
            yield Warn(NOTE, f"more threads than the {text.count(len(allowed), 'allowed CPU')} in {_some(over, analysis)}.")


def _runtimes(analysis: Analysis) -> Iterator[Warn]:
    study = analysis.study
    wrong = [(r, said) for r in study.timed if (said := openmp_runtimes.other(study, r))]
    if wrong:
        yield Warn(severity.OTHER_RUNTIME, f"another OpenMP runtime than the one that was asked for ran {_some([r for r, _ in wrong], analysis)} (first:"
                   f" {analysis.label(wrong[0][0])}: {wrong[0][1]}).")
    for axis, names in openmp_runtimes.mixed(study).items():
        yield Warn(severity.OTHER_RUNTIME, f"{text.listing(names)} ran points that all say runtime {axis}: they deal the same schedule differently, and"
                   " nothing in these points' names tells them apart.")


def _floors(analysis: Analysis) -> Iterator[Warn]:
    """A limit that is broken was measured wrongly, or is none: the floor assumes stores that go past the caches."""
    below = [r for r in analysis.study.timed if r.floor_ms is not None and analysis.estimates[r.id].value < r.floor_ms]
    if below:
        yield Warn(severity.BELOW_FLOOR, f"{_some(below, analysis)} took less time than the floor: other load disturbed its measurement, or the picture"
                   " stays in the caches, which ordinary stores can fill faster than streaming stores reach memory.")


def _families(analysis: Analysis) -> Iterator[Warn]:
    """Many comparisons with few samples: no rank test can be significant after the correction, whatever the times."""
    assumed = [c for group in analysis.groups for c in group.comparisons.values() if c.test == rank_tests.WELCH]
    if assumed:
        most = max(len(group.timed) - 1 for group in analysis.groups)
        yield Warn(severity.ASSUMED_TEST, f"too few samples for a rank test among up to {text.count(most, 'comparison')}: {len(assumed)} comparisons with the"
                   " fastest of a scene use Welch's t test on logarithms instead, which assumes a distribution.")


def _agreement(analysis: Analysis) -> Iterator[Warn]:
    study = analysis.study
    counts = study.context["points"]
    records = study.every_record
    run = len([r for r in records if r.raw.get("status") == "ok"])
    planned = counts.get("planned")
    if isinstance(planned, int) and planned != len(records):
        yield Warn(severity.COUNTS_DISAGREE, f"the context plans {planned} points, the records hold {len(records)}.")
    elif isinstance(counts.get("run"), int) and counts["run"] not in (run, len(records)):
        yield Warn(severity.COUNTS_DISAGREE, f"the context counts {counts['run']} points as run, the records {run}.")
    own = study.context.get("id")
    strangers = [r for r in records if own and r.context not in (None, own)]
    if strangers:
        yield Warn(severity.OTHER_CONTEXT, f"{text.count(len(strangers), 'record')} of another context than context.json: their machine or build"
                   " may differ.")
    contradicted = [r for r in records if r.raw.get("status") == "ok" and not r.ok]
    if contradicted:
        yield Warn(severity.NOT_CONFORMING, f"{text.count(len(contradicted), 'record')} with status ok but without a verdict that it conforms:"
                   " shown as failed.")
    off = []
    for record in study.timed:
        bounds = intervals.order_interval(record.samples.values)
        stored = record.recorded_interval
        if (bounds is None) != (stored is None) or (bounds and not all(map(is_close, bounds, stored))) or (
                record.recorded_median is not None and not is_close(record.recorded_median, analysis.estimates[record.id].value)):
            off.append(record)
    if off:
        yield Warn(severity.OTHER_STATISTICS, f"median or interval stored in {_some(off, analysis)} differs from what their samples give; the report uses the"
                   f" samples (first: line {off[0].line}).")


def _images(analysis: Analysis) -> Iterator[Warn]:
    directory = analysis.study.directory.resolve()
    lost = []
    for scene, name in analysis.study.context["images"].items():
        path = (directory / str(name)).resolve()
        if not path.is_relative_to(directory) or not path.is_file():
            lost.append(str(scene))
    if lost:
        yield Warn(NOTE, f"no picture found for {text.listing(lost)}.")
