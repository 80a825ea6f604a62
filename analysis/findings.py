"""The three most interesting findings, chosen by score from what the finders below can support with intervals.

A finder looks for one kind of fact and yields candidates. A score is the interest of the kind plus a term for the size of
the effect, taken at the cautious end of its interval, so that a large but uncertain effect does not beat a certain one.
A difference is claimed only if the rank test (Holm-corrected within its family) and the interval both support it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Callable, Iterator

from . import hypotheses, nodes, text, trade_text
from .comparison import EXTRA_AXES, Analysis, Group, Panel
from .figures.balance import imbalance
from .figures.scaling import curves
from .load import Record
from .statistics import estimates, intervals, rank_tests
from .statistics.estimates import Estimate
from .statistics.fastest import Comparison, compare_with_best
from .statistics.samples import paired_samples

COUNT = 3


@dataclass(frozen=True)
class Finding:
    kind: str
    score: float
    text: str


def cautious(estimate: Estimate) -> float:
    """Effect size in doublings at the end of the interval that is nearer to no effect; 0 if that is covered."""
    if not estimate.excludes_one or estimate.low <= 0:
        return 0.0
    return min(abs(math.log2(estimate.low)), abs(math.log2(estimate.high)), 3.0)


def by(estimate: Estimate) -> str:
    """'1.82x [1.79, 1.85]'; a bound that is not 1 is not rounded to 1."""
    if estimate.has_interval and any(b != 1 and f"{b:.2f}" == "1.00" for b in (estimate.low, estimate.high)):
        return f"{estimate.value:.4f}x [{estimate.low:.4f}, {estimate.high:.4f}]"
    return text.estimate(estimate.value, estimate.low, estimate.high, "x")


def where(group: Group) -> str:
    return group.title


def fastest(analysis: Analysis) -> Iterator[Finding]:
    """The fastest kernel of a scene against the best point of any other kernel."""
    for group in analysis.groups:
        rivals = [r for r in group.timed if group.best is not None and r.config.kernel != group.best.config.kernel]
        if not rivals:
            continue
        best, runner = group.best, analysis.fastest(rivals)
        equal = [r for r in rivals if group.comparisons[r.id].verdict != "slower"]
        if not equal:
            ratio = group.comparisons[runner.id].ratio
            own = [r for r in group.timed if r.config.kernel == best.config.kernel and r is not best
                   and group.comparisons[r.id].verdict != "slower"]
            tail = f"; {text.count(len(own), 'other point')} of {best.config.kernel} cannot be told apart from it" if own else ""
            yield Finding("fastest", 4 + min(1.5, cautious(ratio)), f"On {where(group)} {analysis.label(best)} is the fastest kernel:"
                          f" {analysis.time(best)}, {by(ratio)} faster than the runner-up {analysis.label(runner)}{tail}.")
        elif 1 < best.samples.launch_count < intervals.MIN_LAUNCHES and all(group.comparisons[r.id].ratio.excludes_one for r in equal):
            # A test over two or three launches finds nothing, however far apart they are.
            yield Finding("fastest", 2.5, f"On {where(group)} {analysis.label(best)} ({analysis.time(best)}) is"
                          f" {by(group.comparisons[runner.id].ratio)} faster than the runner-up {analysis.label(runner)} in these"
                          f" {best.samples.launch_count} launches, too few to say so of others ({intervals.MIN_LAUNCHES} would do).")
        else:
            equal = sorted(equal, key=lambda r: analysis.estimates[r.id].value)
            names = text.listing([f"{analysis.label(r)} ({analysis.time(r)})" for r in equal], 2)
            yield Finding("fastest", 2.5, f"On {where(group)} no fastest kernel can be named: {analysis.label(best)}"
                          f" ({analysis.time(best)}) cannot be told apart from {names}.")


def winners(analysis: Analysis) -> Iterator[Finding]:
    """Whether the choice of kernel depends on the scene; only where each scene has a winner that stands."""
    named: dict[str, dict[str, list[str]]] = {}  # by everything but the scene: another arithmetic is another question
    for group in analysis.groups:
        rivals = [r for r in group.timed if group.best is not None and r.config.kernel != group.best.config.kernel]
        if not rivals or any(group.comparisons[r.id].verdict != "slower" for r in rivals):
            continue
        rules = group.title.removeprefix(f"{group.best.config.scene} ").partition(" ")[2]
        named.setdefault(rules, {}).setdefault(group.best.config.kernel, []).append(f"{where(group)} ({analysis.time(group.best)})")
    for kernels in named.values():
        if len(kernels) > 1:
            said = text.listing([f"{kernel} on {text.listing(places, 2)}" for kernel, places in kernels.items()], 4)
            yield Finding("winners", 4.5, f"The fastest kernel depends on the scene: {said}.")


def parallel_gain(analysis: Analysis) -> Iterator[Finding]:
    """The fastest parallel point against the fastest serial kernel."""
    for group in analysis.groups:
        parallel = analysis.fastest([r for r in group.timed if r.config.backend != "serial"
                                     and analysis.serial_base[r.id] is not None])
        if parallel is None or parallel.config.threads < 2:
            continue
        base = analysis.serial_base[parallel.id]
        gain = analysis.speedup(parallel, base)
        if not gain.has_interval:
            continue
        # Both are the best of several, so the test is corrected for all points that could have been picked.
        family = len(analysis.study.timed)
        p = family * rank_tests.rank_test(base.samples, parallel.samples, family)[0]
        over = f"the fastest serial kernel ({base.config.kernel}, {analysis.time(base)})"
        if gain.excludes_one and p < 0.05:
            word = "faster" if gain.value > 1 else "slower"
            amount = gain if gain.value > 1 else gain.inverse()
            yield Finding("parallel", 2.6 + 0.6 * cautious(gain) + (1.2 if word == "slower" else 0),
                          f"On {where(group)} the fastest parallel point, {analysis.label(parallel)}, is {by(amount)} {word} than"
                          f" {over}.")
        else:
            yield Finding("parallel", 3.0, f"On {where(group)} the fastest parallel point, {analysis.label(parallel)}"
                          f" ({analysis.time(parallel)}), cannot be told apart from {over}: ratio {by(gain)}.")


def scaling(analysis: Analysis) -> Iterator[Finding]:
    """The kernel that scales least, against the one that scales best, at the highest thread count."""
    for group in analysis.groups:
        reached: list[tuple[Estimate, Record]] = []
        threads = max((r.config.threads for r in group.timed), default=1)
        best: dict[str, Record] = {}
        for (kernel, _), records in curves(analysis, group).items():
            last = records[-1]
            if last.config.threads == threads and (kernel not in best or _median(analysis, last) < _median(analysis, best[kernel])):
                best[kernel] = last
        for record in best.values():
            speedup = analysis.speedup(record, analysis.thread_base[record.id])
            if speedup is not None and speedup.has_interval:
                reached.append((speedup, record))
        if not reached or threads < 2:
            continue
        reached.sort(key=lambda pair: pair[0].value)
        (least, worst), (most, good) = reached[0], reached[-1]
        bases = f"one-thread times {_seconds(analysis, good)} s and {_seconds(analysis, worst)} s"
        # Speedups are compared as samples of their own: time on all threads / time on one, the lowest is the best.
        relative = [paired_samples(r.samples, analysis.thread_base[r.id].samples) for _, r in reached]
        apart = len(reached) > 1 and all(samples.n for samples in relative) and compare_with_best(
            relative, analysis.study.target, len(analysis.groups))[1][0].verdict == "slower" and most.low > least.high
        if most.high < 1:
            yield Finding("scaling", 3.0 + min(1.0, cautious(most)), f"On {where(group)} no kernel gains from {threads} threads: {good.config.kernel}"
                          f" ({analysis.execution(good)}) comes closest with {by(most)} its speed on one thread, {worst.config.kernel}"
                          f" ({analysis.execution(worst)}) is last with {by(least)} ({bases}).")
        elif apart:
            yield Finding("scaling", 2.2 + min(1.5, math.log2(most.low / least.high)) + (0.8 if least.high < 1 else 0),
                          f"On {where(group)} with {threads} threads {good.config.kernel} ({analysis.execution(good)}) scales best,"
                          f" {by(most)} over itself on one thread, and {worst.config.kernel} ({analysis.execution(worst)}) least,"
                          f" {by(least)} ({bases}).")
        else:
            efficiency = estimates.efficiency(most, threads)
            yield Finding("scaling", 1.6, f"On {where(group)} {analysis.label(good)} runs {by(most)} as fast as on one thread"
                          f" ({_seconds(analysis, good)} s), an efficiency of"
                          f" {text.estimate(efficiency.value, efficiency.low, efficiency.high)}"
                          + (f"; the {len(reached)} kernels cannot all be told apart by their speedup." if len(reached) > 1 else "."))


def _median(analysis: Analysis, record: Record) -> float:
    return analysis.estimates[record.id].value


def _seconds(analysis: Analysis, record: Record) -> str:
    return text.number(_median(analysis, analysis.thread_base[record.id]) / 1000)


def schedules(analysis: Analysis) -> Iterator[Finding]:
    """How much the schedule, the partitioner and the chunk matter to a kernel."""
    flat: list[tuple[int, str]] = []
    cases: list[tuple[Panel, str, list[Record]]] = []
    for panel in analysis.panels:
        timed = [r for r in panel.cells.values() if r.ok]
        # Within one backend: OpenMP against oneTBB is a finding of its own. Instruction sets and techniques are no schedules.
        alike: dict[tuple, list[Record]] = {}
        for record in timed:
            alike.setdefault((record.config.backend, *(getattr(record.config, axis) for axis in EXTRA_AXES)), []).append(record)
        cases += [(panel, records[0].config.backend, records) for records in alike.values() if len(records) > 1]
    for panel, backend, timed in cases:
        group, threads = panel.group, text.count(panel.threads, "thread")
        index, comparisons = compare_with_best([r.samples for r in timed], analysis.study.target, len(cases))
        best = timed[index]
        slower = [(c, r) for c, r in zip(comparisons, timed) if c.verdict == "slower"]
        if slower:
            worst, record = max(slower, key=lambda pair: pair[0].ratio.value)
            near = len(timed) - 1 - len(slower)
            tail = f"; {text.count(near, 'other choice')} cannot be told apart from the best" if near else ""
            # A schedule of a kernel that is far from the fastest is of less use.
            behind = math.log2(_median(analysis, best) / _median(analysis, group.best))
            yield Finding("schedule", 2.4 + 1.5 * min(1.5, cautious(worst.ratio)) - 0.25 * min(behind, 4),
                          f"On {where(group)} with {threads} the {backend} schedule of {panel.kernel} matters by {by(worst.ratio)}:"
                          f" {analysis.execution(best)} takes {analysis.time(best)}, {analysis.execution(record)}"
                          f" {analysis.time(record)}{tail}.")
        elif all(c.ratio.has_interval for c in comparisons if c.verdict != "best"):
            widest = max((c.ratio.high for c in comparisons if c.verdict != "best"), default=1.0)
            flat.append((len(timed), f"On {where(group)} with {threads} the {len(timed)} {backend} schedules of {panel.kernel} cannot be"
                         f" told apart (fastest {analysis.execution(best)}, {analysis.time(best)}; by their intervals the others take at"
                         f" most {text.number(widest)} times as long)."))
    if flat:
        yield Finding("no schedule effect", 1.9, max(flat)[1])


def backends(analysis: Analysis) -> Iterator[Finding]:
    """OpenMP against oneTBB: the best of each for one kernel at one thread count."""
    cases: list[tuple[Group, str, int, list[Record]]] = []
    for group in analysis.groups:
        for kernel in group.kernels:
            records = [r for r in group.timed if r.config.kernel == kernel and r.config.backend != "serial"]
            threads = max((r.config.threads for r in records), default=0)
            records = [r for r in records if r.config.threads == threads]
            if len({r.config.backend for r in records}) > 1:
                cases.append((group, kernel, threads, records))
    for group, kernel, threads, records in cases:
        sides = [analysis.fastest([r for r in records if r.config.backend == b])
                 for b in dict.fromkeys(r.config.backend for r in records)]
        # Each side is its own best of several, so the family is all points of both sides.
        _, comparisons = compare_with_best([r.samples for r in records], analysis.study.target, len(cases))
        judged: dict[str, Comparison] = {r.id: c for r, c in zip(records, comparisons)}
        sides.sort(key=lambda r: _median(analysis, r))
        first, second = sides[0], sides[1]
        rest = [r for r in records if r.config.backend != first.config.backend]
        if all(judged[r.id].verdict == "slower" for r in rest):
            ratio = judged[second.id].ratio
            yield Finding("backend", 2.0 + min(1.5, 1.5 * cautious(ratio)), f"On {where(group)} with {text.count(threads, 'thread')}"
                          f" {kernel} is {by(ratio)} faster with {analysis.execution(first)} ({analysis.time(first)}) than with"
                          f" the best of {second.config.backend}, {analysis.execution(second)} ({analysis.time(second)}).")


def stage_share(analysis: Analysis) -> Iterator[Finding]:
    """What fills the frame of the fastest point."""
    for group in analysis.groups:
        best = group.best
        if best is None or not best.stages:
            continue
        shares = {name: estimates.share(values, best.samples.values) for name, values in best.stages.items()}
        name, share = max(shares.items(), key=lambda item: item[1].value)
        if share.has_interval:
            yield Finding("stage", 1.2 + (0.8 if name != "raster" else 0), f"On {where(group)} {name} is the longest stage of"
                          f" {analysis.label(best)}: {100 * share.value:.1f} % [{100 * share.low:.1f}, {100 * share.high:.1f}] of"
                          f" {analysis.time(best)}.")


def balance(analysis: Analysis) -> Iterator[Finding]:
    """The most uneven sharing; a description, because records hold medians and no interval."""
    found = [(value, r) for r in analysis.study.timed if (value := imbalance(r)) is not None]
    if found:
        value, record = max(found, key=lambda pair: pair[0])
        if value > 1.2:
            yield Finding("balance", 1.0 + min(1.0, value - 1), f"On {where(analysis.group_of(record))} the threads of"
                          f" {analysis.label(record)} are the least even: the longest of a sample works {value:.2f} times the mean"
                          " (medians, no interval recorded).")


def untimed(analysis: Analysis) -> Iterator[Finding]:
    records = analysis.study.every_record
    for status, weight in (("failed", 2.0), ("skipped", 1.0)):
        chosen = [r for r in records if r.status == status]
        if not chosen:
            continue
        reasons: dict[str, int] = {}
        for record in chosen:
            reasons[record.reason] = reasons.get(record.reason, 0) + 1
        reason, many = max(reasons.items(), key=lambda item: item[1])
        score = weight + 3 * len(chosen) / len(records) + (2 if not analysis.study.timed else 0)
        yield Finding(status, score, f"{len(chosen)} of {text.count(len(records), 'point')} {status}; the most common reason"
                      f" ({text.count(many, 'point')}): {text.shorten(reason, 160)}.")


def accuracy_limits(analysis: Analysis) -> Iterator[Finding]:
    """Fast but outside the stated bound: a reader must know before choosing it."""
    outside = [r for r in analysis.study.timed if isinstance(r.verify.get("oracle"), dict)
               and r.verify["oracle"].get("within_bound") is False]
    if outside:
        modes = text.listing(sorted({r.config.numeric for r in outside}))
        yield Finding("accuracy", 2.8, f"{len(outside)} of {text.count(len(analysis.study.timed), 'timed point')} conform but are outside the"
                      f" accuracy bound against the oracle (numeric {modes}).")


def claims(analysis: Analysis) -> Iterator[Finding]:
    """What the study claimed before it ran: that is its question."""
    said = hypotheses.summary(analysis)
    if said is not None:
        yield Finding("hypotheses", 9.0, said)


def trade_off(analysis: Analysis) -> Iterator[Finding]:
    """What accuracy costs, where a study measured it: then it is what the study was made for."""
    said = trade_text.finding(analysis)
    if said is not None:
        yield Finding("trade", 6.0, said)


def plain_facts(analysis: Analysis) -> Iterator[Finding]:
    """What can always be said, so that a small study has three lines too."""
    study = analysis.study
    if not study.timed:
        what = "No point of a kernel in" if study.peers else "No point of"
        yield Finding("nothing", 4, f"{what} {study.name} was timed, so nothing can be said about speed.")
        yield Finding("compared", 0.1, "No comparison was made: it takes two timed points of one scene.")
        kernels = list(dict.fromkeys(r.config.kernel for r in study.records))
        yield Finding("planned", 0.2, f"{text.count(len(study.records), 'point')} of {text.count(len(kernels), 'kernel')} were planned.")
        return
    if len(study.timed) == 1 or all(len(g.timed) < 2 for g in analysis.groups):
        record = study.timed[0]
        yield Finding("single", 3, f"On {where(analysis.group_of(record))} {analysis.label(record)} takes {analysis.time(record)}"
                      f" (n = {record.samples.n}); no other point of {'a kernel on ' if study.peers else ''}this scene was timed, so it is"
                      " compared with nothing.")
    widths = [((e.high - e.low) / e.value / 2, r) for r in study.timed if (e := analysis.estimates[r.id]).has_interval]
    if widths:
        width, record = max(widths, key=lambda pair: pair[0])
        yield Finding("noise", 0.5, f"The widest interval is ±{text.percent(width)} of its median ({analysis.label(record)} on"
                      f" {where(analysis.group_of(record))}, {analysis.time(record)}); the target is ±{text.percent(study.target)}.")
    else:
        yield Finding("noise", 0.5, f"No point has {intervals.MIN_SAMPLES} samples, so there are no intervals and no differences can"
                      " be claimed.")
    samples = sum(r.samples.n for r in study.timed)
    yield Finding("extent", 0.3, f"{text.count(len(study.timed), 'point')} conform to their numeric mode and were timed, with"
                  f" {text.count(samples, 'sample')} in all.")
    launches = max(r.samples.launch_count for r in study.timed)
    yield Finding("launches", 0.2, f"All samples come from {text.count(launches, 'launch', 'launches')}; what another memory layout would"
                  " change is " + ("not known." if launches < 2 else "part of the intervals of ratios."))


FINDERS: tuple[Callable[[Analysis], Iterator[Finding]], ...] = (
    fastest, winners, parallel_gain, scaling, schedules, backends, stage_share, balance, untimed, accuracy_limits, trade_off, claims,
    plain_facts)


def candidates(analysis: Analysis) -> list[Finding]:
    found = [finding for finder in FINDERS for finding in finder(analysis)]
    return sorted(found, key=lambda finding: -finding.score)  # stable: at equal scores in the order of the finders


def top(analysis: Analysis, count: int = COUNT) -> list[Finding]:
    """The highest scores, one of each kind: three versions of one fact are one finding."""
    ranked = candidates(analysis)
    chosen: list[Finding] = []
    for finding in ranked:
        if len(chosen) < count and all(finding.kind != other.kind for other in chosen):
            chosen.append(replace(finding, text=finding.text + nodes.remark(analysis.study)))
    return chosen
