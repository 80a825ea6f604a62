"""The rules of measuring (Hoefler & Belli, SC'15, and what users of other suites asked for), each as a function that finds what
breaks it in the files of a study. analysis/lint.py runs them."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, Iterator

import numpy as np
from scipy import stats

from . import checks, hypotheses, lint_figures, openmp_runtimes, severity, steadiness, text, weak
from .lint import Finding, Folder, Rule
from .load import Record
from .raster_loop import busy
from .severity import GRAVE, NOTE
from .statistics import intervals, rank_tests
from .statistics.numbers import is_close, is_number

ORDER_P = 1e-3  # of as many identical orders by chance
STAGE_ROUNDING = 1e-3  # of a sample, by which its stages may exceed it


def base_case(folder: Folder) -> Iterator[Finding]:
    analysis = folder.analysis
    weak_bases = weak.bases(analysis)
    for record in folder.study.timed:
        if record.config.backend == "serial":
            continue
        bases = {"(a), a serial kernel with equal picture, numeric mode and instruction set": analysis.serial_base[record.id],
                 "(b), the same point on one thread": analysis.thread_base[record.id] or weak_bases.get(record.id)}
        for name, base in bases.items():
            if base is None:
                yield folder.record(record, severity.NO_BASE, f"no base {name}", "add it to the sweep: without it no speedup is shown")
            elif base is not record and (speedup := analysis.speedup(record, base)) and speedup.note:
                yield folder.record(record, severity.BASE_CAVEAT, f"base {name}: {speedup.note}", "measure the base in every block of the point")


def two_verdicts(folder: Folder) -> Iterator[Finding]:
    for record in folder.study.every_record:
        raw = record.raw
        if raw.get("status") == "ok" and not record.ok:
            yield folder.record(record, severity.NOT_CONFORMING, f"status ok, but {record.reason}", "verify it; such a point shows no speed")
        if raw.get("status") != "ok" and raw.get("samples_ms"):
            yield folder.record(record, GRAVE, f"status {raw['status']} with times", "run it again: what failed has no times")
        if record.ok and not record.config.is_peer and not any(record.verify.get(k) for k in ("oracle", "end_to_end", "embree")):
            yield folder.record(record, NOTE, "no verdict on accuracy", "verify against the oracle, or say that nobody judged it")
        oracle, bound = record.verify.get("oracle") or {}, record.verify.get("bound") or {}
        if record.ok and bound.get("bounded") and oracle.get("within_bound") is False:
            yield folder.record(record, GRAVE, "the picture is outside the bound of its mode, and has times",
                                "find the pixels with `rasterbench verify --difference`; the bound or the kernel is wrong")


def subsets(folder: Folder) -> Iterator[Finding]:
    counts, records = folder.study.context["points"], folder.study.every_record
    found = {"planned": len(records)} | {key: sum(r.raw.get("status") == status for r in records)
                                         for key, status in (("run", "ok"), ("skipped", "skipped"), ("failed", "failed"))}
    for key, many in found.items():
        if counts.get(key) is None:
            yield folder.context(f"points.{key}", GRAVE, "not recorded", "run the study again, or say how many points were left out")
        # `run` of a study that failed points ran, too, counts them in some versions
        elif counts[key] != many and not (key == "run" and counts[key] == many + found["failed"]):
            yield folder.context(f"points.{key}", severity.COUNTS_DISAGREE, f"{counts[key]}, the records hold {many}",
                                 "keep every record of a study: leaving points out selects")


def means(folder: Folder) -> Iterator[Finding]:
    for record in folder.timed:
        median = float(np.median(record.samples.values))
        if record.recorded_median is None:
            yield folder.record(record, NOTE, "no median recorded", "write the median beside the samples")
        elif not is_close(record.recorded_median, median):
            kind = "their mean" if math.isclose(record.recorded_median, float(np.mean(record.samples.values)), rel_tol=1e-6) else "not theirs"
            yield folder.record(record, severity.OTHER_STATISTICS, f"median_ms {record.recorded_median:g}, the samples give {median:g} ({kind})",
                                "compute it from the samples")


def determinism(folder: Folder) -> Iterator[Finding]:
    pictures: dict[tuple, tuple[int, Record]] = {}
    for record in folder.study.timed:
        if record.verify.get("differing_pixels"):
            yield folder.record(record, GRAVE, f"{record.verify['differing_pixels']} pixels differ from the scalar specification",
                                "make the kernel equal it bit for bit")
        covered, c = record.work.get("covered_pixels"), record.config
        if covered is None:
            continue
        key = (c.scene, c.scene_hash, c.size, c.numeric, c.fill, c.near, c.isa)
        first = pictures.setdefault(key, (covered, record))
        if covered != first[0]:
            yield folder.record(record, GRAVE, f"covers {covered} pixels, {first[1].name} {first[0]}: the same mode drew two pictures",
                                "find the kernel that depends on its schedule, threads or tiles")


def confidence(folder: Folder) -> Iterator[Finding]:
    for record in folder.timed:
        samples, raw = record.samples, record.raw
        if samples.launch_count < intervals.MIN_LAUNCHES:
            yield folder.record(record, severity.FEW_LAUNCHES, text.count(samples.launch_count, "launch", "launches"),
                                f"set sampling.launches to {intervals.MIN_LAUNCHES} or more: one process has one memory layout")
        if samples.n < intervals.MIN_SAMPLES:
            yield folder.record(record, severity.FEW_SAMPLES, text.count(samples.n, "sample"), "set sampling.min_samples to 6 or more: fewer have no"
                                " interval")
        bounds = intervals.order_interval(samples.values)
        stored = record.recorded_interval
        if (bounds is None) != (stored is None) or bounds and not all(map(is_close, bounds, stored)):
            yield folder.record(record, severity.OTHER_STATISTICS, f"interval_ms {stored}, the samples give {bounds}", "compute it from the samples")
        if samples.n < checks.P95_SAMPLES and raw.get("p95_ms") is not None:
            yield folder.record(record, GRAVE, f"a 95th percentile of {text.count(samples.n, 'sample')}",
                                f"show none below {checks.P95_SAMPLES}: the largest sample is no percentile")


def stopping(folder: Folder) -> Iterator[Finding]:
    for record in folder.timed:
        if not record.stop:
            yield folder.record(record, severity.NO_STOP, "no reason for its last sample", "record why sampling stopped")
        elif record.stop == "target" and not _reached(record.samples.values, folder.study.target):
            yield folder.record(record, GRAVE, f"stopped by target, but its interval never was within {text.percent(folder.study.target)}",
                                "sample until the interval is within the target, or record the limit that stopped it")
        elif record.stop != "target":
            yield folder.record(record, severity.STOPPED_BY_LIMIT, f"stopped by {record.stop}, not by its interval", "raise that limit, or state the interval")


def _reached(values: np.ndarray, target: float) -> bool:
    """Whether the interval was within the target after any sample: bases are sampled on after they stopped."""
    for n in range(len(values), intervals.MIN_SAMPLES - 1, -1):
        low, high = intervals.order_interval(values[:n])
        if (high - low) / 2 <= target * float(np.median(values[:n])) * (1 + 1e-9):
            return True
    return False


def comparison(folder: Folder) -> Iterator[Finding]:
    for group in folder.analysis.groups:
        assumed = [c for c in group.comparisons.values() if c.test in (rank_tests.WELCH, "none") and c.verdict != "best"]
        if assumed:
            yield Finding(severity.ASSUMED_TEST, "records.jsonl", group.title, f"too few samples for a rank test in {text.count(len(assumed), 'comparison')}"
                          " with the fastest", "take more samples or blocks, or compare fewer points")


def raw_data(folder: Folder) -> Iterator[Finding]:
    for record in folder.timed:
        values, raw = record.samples.values, record.raw
        for key, value in (("min_ms", values.min()), ("max_ms", values.max())):
            if raw.get(key) is None:
                yield folder.record(record, NOTE, f"no {key}", "store the extremes: the largest time is a result, too")
            elif is_number(raw[key]) and not is_close(raw[key], float(value)):
                yield folder.record(record, GRAVE, f"{key} {raw[key]:g}, the samples give {value:g}: samples were dropped",
                                    "store every sample; label outliers, never drop them")


def journalled(folder: Folder) -> Iterator[Finding]:
    taken = Counter(event["id"] for event in _samples(folder))
    for record in folder.timed:
        if taken[record.id] != record.samples.n:
            yield folder.record(record, GRAVE, f"{text.count(record.samples.n, 'sample')}, the journal has {taken[record.id]}",
                                "make records from the whole journal")
    for identity in sorted(taken.keys() - {record.id for record in folder.study.every_record}):
        yield Finding(GRAVE, "journal.jsonl", identity, "was sampled and has no record", "make the records from the whole journal")


def _samples(folder: Folder) -> Iterator[dict[str, Any]]:
    return (event for event in folder.journal or () if event["event"] == "sample")


def blocks(folder: Folder) -> Iterator[Finding]:
    for record in folder.timed:
        pairs = list(zip(record.samples.launches.tolist(), record.samples.blocks.tolist()))
        if len(set(pairs)) < len(pairs):
            yield folder.record(record, GRAVE, "several samples in one block", "take every point once per block")


def order(folder: Folder) -> Iterator[Finding]:
    """Of k points that two blocks share, chance gives both the same order once in k!."""
    taken: dict[tuple[int, int], list[str]] = {}
    for event in _samples(folder):
        taken.setdefault((event["launch"], event["block"]), []).append(event["id"])
    orders = list(taken.values())
    identical, expected, most = 0, 0.0, 0
    for left, right in zip(orders, orders[1:]):
        shared = set(left) & set(right)
        if len(shared) < 2:
            continue
        expected += 1 / math.factorial(len(shared))
        if [i for i in left if i in shared] == [i for i in right if i in shared]:
            identical, most = identical + 1, max(most, len(shared))
    if identical and stats.poisson.sf(identical - 1, expected) < ORDER_P:
        yield Finding(GRAVE, "journal.jsonl", "samples", f"{text.count(identical, 'pair')} of consecutive blocks took up to"
                      f" {text.count(most, 'point')} in the same order, where chance has {expected:.2g}",
                      "shuffle each block: else drift and caches favour the same points each time")


def clock(folder: Folder) -> Iterator[Finding]:
    if not folder.study.context.get("region"):
        yield folder.context("region", GRAVE, "not recorded", "say what a sample times: which stages, clears, allocation")
    for record in folder.timed:
        if not is_number(record.raw.get("frames_per_sample")):
            yield folder.record(record, GRAVE, "frames_per_sample is not recorded", "record how many frames a sample is the mean of")
        stages = [values for values in record.stages.values() if values is not None]
        if stages and np.any(np.sum(stages, axis=0) > record.samples.values * (1 + STAGE_ROUNDING)):
            yield folder.record(record, GRAVE, "its stages take longer than its frame", "time them with one clock, within the frame")


def set_up(folder: Folder) -> Iterator[Finding]:
    context = folder.study.context
    if context["program"].get("dirty") is not False:
        yield folder.context("program.dirty", severity.DIRTY, "built from a dirty commit" if context["program"].get("dirty") else "not recorded",
                             "commit, build and run again: nobody else has this source")
    for key in checks.unrecorded(folder.study):
        yield folder.context(key, severity.NOT_RECORDED, "not recorded", "record it, or \"unavailable: REASON\"")
    for record in checks.unhashed(folder.study):
        yield folder.record(record, severity.NOT_RECORDED, "no config.scene_hash", "record the hash of the scene: another file may have its name")
    for record in folder.study.every_record:
        if context.get("id") and record.context not in (None, context["id"]):
            yield folder.record(record, severity.OTHER_CONTEXT, "recorded under another context than context.json", "never mix machines or builds")
        if not record.ok:
            continue
        if record.threads_observed is None:
            yield folder.record(record, NOTE, "threads that ran were not observed", "observe them: a binding may leave one worker")
        elif record.threads_observed < record.config.threads:
            yield folder.record(record, severity.FEWER_THREADS, f"{record.threads_observed} of {text.count(record.config.threads, 'thread')} ran",
                                "remove what limits them (binding, cgroup), or ask for fewer")
        if record.config.threads > 1 and str(record.config.binding or "none").lower() in ("none", "false", "off"):
            yield folder.record(record, severity.NOT_PINNED, "its threads were not pinned", "add binding = [\"close\"] to the study")
        if record.config.is_peer:
            continue  # its threads are its own
        placement = steadiness.placement(record)
        if placement is None:
            yield folder.record(record, severity.NOT_WATCHED, "where its threads ran was not observed", "run the study again: each sample looks")
        elif placement.get("binding") not in (None, "kept"):
            yield folder.record(record, severity.BINDING_BROKEN, f"its binding was not kept: {placement['binding']}", "such a point has failed")
        elif shared := checks.sharing(folder.study, record):
            yield folder.record(record, severity.SHARED_CORE, f"two of its threads were on one core in {shared}", "bind them, or ask for fewer threads than cores")
        times = busy(record)
        if times and min(times) < 0.01 * max(times):
            yield folder.record(record, severity.IDLE_THREAD, "a thread did next to nothing", "read its time as that of fewer threads")


def runtime(folder: Folder) -> Iterator[Finding]:
    for record in folder.study.timed:
        if said := openmp_runtimes.other(folder.study, record):
            yield folder.record(record, severity.OTHER_RUNTIME, said, "see that no LD_PRELOAD or library path puts another runtime in its place")
    for axis, names in openmp_runtimes.mixed(folder.study).items():
        yield Finding(severity.OTHER_RUNTIME, "records.jsonl", f"config.runtime {axis}", f"points of {text.listing(names)}",
                      "make the runtime an axis of the study, or run all points in one environment")


def noise(folder: Folder) -> Iterator[Finding]:
    machine = folder.study.context["machine"]
    load, cpus = checks.first_load(machine.get("load_average")), machine.get("cpus_online")
    if load is None and not str(machine.get("load_average")).startswith("unavailable: "):
        yield folder.context("machine.load_average", GRAVE, "not recorded", "record it, or \"unavailable: REASON\"")
    elif load is not None and load > 0.25 * (cpus if isinstance(cpus, int) and cpus > 0 else 1):
        yield folder.context("machine.load_average", severity.BUSY_MACHINE, f"{load:g} at the start: something else was running", "run on a quiet machine")
    watched = checks.watched_noise(folder.study)
    if watched is None:
        yield folder.context("noise", severity.NOT_WATCHED, "not recorded", "run the study again: other load, steal and frequency are read between blocks")
    for warning in (watched or {}).get("warnings", ()):
        yield folder.context("noise", severity.BUSY_MACHINE, str(warning), "run on a quiet machine, with bound threads")
    for record in folder.timed:
        found = folder.analysis.steadiness[record.id]
        if found.outliers:
            yield folder.record(record, severity.NOT_STEADY, f"{text.count(found.outliers, 'outlier')}, up to {found.largest:.3g} times the median (kept)",
                                "look at p95 and the largest time; find what disturbed them")
        if found.drift is not None:
            yield folder.record(record, severity.NOT_STEADY, f"its times changed by {100 * found.drift:+.1f} % over the run: drift",
                                "trust paired ratios, not single times; let the machine settle")


def verification(folder: Folder) -> Iterator[Finding]:
    for record in folder.study.timed:
        if not record.verify.get("checked_against"):
            yield folder.record(record, GRAVE, "not said what it was checked against", "verify it against the scalar specification")


def verified_first(folder: Folder) -> Iterator[Finding]:
    verified: set[str] = set()
    for event in folder.journal or ():
        if event["event"] == "verify":
            verified.add(event["id"])
        elif event["event"] == "sample" and event["id"] not in verified:
            verified.add(event["id"])  # once a point
            yield Finding(GRAVE, "journal.jsonl", event["id"], "timed before it was verified", "verify, then time")


def bounds(folder: Folder) -> Iterator[Finding]:
    for record in folder.study.timed:
        if record.floor_ms is None:
            yield folder.record(record, NOTE, "no floor", "let the study measure the memory bandwidth")
        elif folder.analysis.estimates[record.id].value < record.floor_ms:
            yield folder.record(record, severity.BELOW_FLOOR, "faster than its floor", "measure the bandwidth again: other load disturbed it, or caches"
                                " held the picture")


def stated_before(folder: Folder) -> Iterator[Finding]:
    """Hypotheses are those of the journal's start, all of them are judged, and by pairs."""
    claimed = folder.study.context["study"].get("hypotheses") or []
    start = next((event for event in folder.journal or () if event["event"] == "start"), None)
    if start is not None and (start.get("hypotheses") or []) != claimed:
        yield folder.context("study.hypotheses", GRAVE, "not those that the journal has from before the first sample",
                             "take context.json from the run: a claim that was made after it is none")
    for verdict in hypotheses.verdicts(folder.analysis):
        place = f"study.hypotheses[{verdict.number - 1}]"
        if not verdict.tested:
            yield folder.context(place, severity.NOT_TESTED, f"not tested: {verdict.reason}", "say so beside the others, or run what is missing")
        elif verdict.ratio.note:
            yield folder.context(place, severity.BASE_CAVEAT, verdict.ratio.note, "sample both sides in the same blocks")


def crash(folder: Folder) -> Iterator[Finding]:
    for name in ("records.jsonl", "context.json"):
        if not (folder.directory / name).read_bytes().endswith(b"\n"):
            yield Finding(NOTE if name == "context.json" else GRAVE, name, "end", "its last line has no end: it was not written whole",
                          "make it again from the journal: rasterbench study --resume")


RULES = (
    Rule("base-case", "every speedup has its bases, measured in every block", base_case),
    Rule("two-verdicts", "what does not conform shows no speed; accuracy is judged beside it", two_verdicts),
    Rule("subsets", "all planned points are reported, every skip has a reason", subsets),
    Rule("means", "medians of the samples, no other mean", means),
    Rule("determinism", "a mode draws the same bits under every kernel, schedule and thread count", determinism),
    Rule("confidence", "95 % intervals, five launches, p95 from 59 samples", confidence),
    Rule("stopping", "a point stops by its interval or says which limit stopped it", stopping),
    Rule("comparison", "differences come from rank tests", comparison),
    Rule("raw-data", "every sample is stored, outliers included", raw_data),
    Rule("journal", "the records hold every sample of the journal, and no other", journalled, "journal"),
    Rule("blocks", "every point once a block", blocks),
    Rule("order", "randomised blocks", order, "journal"),
    Rule("clock", "the timed region is named, and its parts fit into it", clock),
    Rule("set-up", "machine, build and where the threads ran are recorded", set_up),
    Rule("runtime", "the OpenMP runtime that ran is the one that was asked for, and one name stands for one", runtime),
    Rule("noise", "load, steal, frequency, drift and outliers are labelled", noise),
    Rule("verification", "says what it was checked against", verification),
    Rule("verified-first", "checked before it was timed", verified_first, "journal"),
    Rule("bounds", "the measured floor stands beside the times", bounds),
    Rule("plot-caption", "a figure says n, interval and machine", lint_figures.caption, "figures"),
    Rule("plot-base", "a figure of speedups names its base", lint_figures.base, "figures"),
    Rule("plot-lines", "lines join ordered values only, never kernels", lint_figures.lines, "figures"),
    Rule("plot-legible", "a figure fits a page and its text can be read", lint_figures.legible, "figures"),
    Rule("plot-grey", "a legend can be told apart without colours", lint_figures.grey, "figures"),
    Rule("plot-current", "a figure was drawn from these records", lint_figures.current, "figures"),
    Rule("hypotheses", "claims are stated before the first sample, and every one is judged", stated_before),
    Rule("crash", "records and context were written whole", crash),
    Rule("exit", "a failed point makes the exit status non-zero", None, why_not="no file holds the exit status; tests/ has it"),
)
