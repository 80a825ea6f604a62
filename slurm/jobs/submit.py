"""slurm/submit: a study as job arrays, of what is missing."""

from __future__ import annotations

import argparse
import contextlib
import os
import secrets
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Iterator, Sequence

from . import cluster, options as sbatch, states
from .folder import Element, Failure, Folder, InputError, Manifest, comment_of, dump, write_whole
from .plan import (ROOT, Array, array_command, arrays_of, check_plan, frozen_study, merge_command, outside, plan_of, plan_script,
                   stored_plan)
from .site import HERE, Site
from .usage import Parser, guarded

SHORTEST_MIN = 5  # of --time, without a warning
SCRIPTS = ("task", "step", "merge-task")


def parser() -> Parser:
    main = Parser(prog="slurm/submit", description="Runs a study as SLURM job arrays: what is compared stays on one node, and only what"
                  " is missing in DIR is submitted. Run it again to continue.",
                  epilog="What follows -- goes to every sbatch: -- --partition=batch --account=NAME --time=02:00:00 --mem=16G."
                         " Exit codes: 0 submitted, or nothing is missing; 1 SLURM, the build or the disk failed; 2 bad input or usage.",
                  usage="%(prog)s STUDY.toml --out DIR [options] [-- SBATCH OPTIONS]")
    main.add_argument("study", metavar="STUDY.toml", type=Path, help="study file, as of `rasterbench study`")
    main.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder of the results, on a file system that all nodes share")
    main.add_argument("--dry-run", action="store_true", help="print the commands and the plan, write and submit nothing; needs no SLURM")
    main.add_argument("--test-only", action="store_true", help="let sbatch check each array and say when it would start; submit nothing")
    main.add_argument("--per-task", metavar="K", type=whole, default=1, help="families per element of an array (default: 1)")
    main.add_argument("--at-most", metavar="N", type=whole, help="elements of an array that may run at once (default: as SLURM likes)")
    main.add_argument("--cpus", metavar="N", type=whole, help="CPUs of a node: what `max` means (default: as DIR was planned; at first cores"
                      " of the cluster's largest node, or, without SLURM, CPUs of this process)")
    main.add_argument("--isa", help="instruction set of the nodes: what `best` means (default: as DIR was planned; at first this CPU's)")
    main.add_argument("--no-report", action="store_true", help="let the merge job merge only; the report needs matplotlib on the node")
    main.add_argument("--shared", action="store_true", help="do not ask for whole nodes (recorded; other jobs disturb times)")
    main.add_argument("--oversubscribe", action="store_true", help="allow more threads than CPUs")
    main.add_argument("--filter", metavar="REGEX", help="only points whose name this matches, as of `rasterbench study`")
    main.add_argument("--site", metavar="SITE", default="generic", help="a name in slurm/sites, or a file (default: generic)")
    main.add_argument("--program", metavar="FILE", type=Path, help="a rasterbench that is built already (default: the one with which DIR was"
                      " begun; at first build/release/bin, built before the arrays are submitted)")
    main.add_argument("--rebuild", action="store_true", help="build and take build/release/bin although DIR was begun with another program")
    main.add_argument("--replan", action="store_true", help="give DIR a new plan: results that are not in it are kept aside, and not merged")
    main.add_argument("--max-array-size", metavar="N", type=whole, help="in place of the cluster's MaxArraySize (a dry run without SLURM"
                      f" takes {cluster.MAX_ARRAY_SIZE})")
    return main


def whole(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1")
    return int(text)


def split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Ours, and what follows --."""
    words = list(arguments)
    if "--" not in words:
        return words, []
    at = words.index("--")
    return words[:at], words[at + 1:]


def build(site: Site) -> None:
    """Once, here: jobs that build at the same time wait for one another, or for ever, on a network file system."""
    if not (ROOT / "build/release/build.ninja").is_file():
        print("Configuring build/release", flush=True)
        site.run(["cmake", "-S", ROOT, "--preset", "release"])
    print("Building build/release", flush=True)
    site.run(["cmake", "--build", ROOT / "build/release", "--target", "rasterbench"])


def copy_program(program: Path, folder: Folder, build_id: str) -> Path:
    """A build while jobs wait must not change what they run."""
    target = folder.slurm / "programs" / build_id / "rasterbench"
    if not target.is_file():
        write_whole(target, program.read_bytes())
    target.chmod(0o755)
    return target


def set_aside(path: Path, kind: str) -> Path | None:
    """A result that is run again is kept under another name, which is given: task skips what is there."""
    if not path.exists():
        return None
    number = 1
    while (target := path.with_name(f"{path.name}.{kind}-{number}")).exists():
        number += 1
    return path.rename(target)


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Ctrl-C, a lost connection and kill wait, for sbatch too: none comes between a job and its id."""
    signals = {signal.SIGINT, signal.SIGHUP, signal.SIGTERM}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def run(options: argparse.Namespace, sbatch_options: list[str]) -> int:
    if not options.study.is_file():
        raise InputError(options.study, "no such study file")
    for path in (options.study, options.out):
        try:
            str(path.absolute()).encode()
        except UnicodeEncodeError:
            raise InputError(repr(str(path)), "its name is not UTF-8: choose another") from None
    user_options = sbatch.parsed(sbatch_options)
    folder, site = Folder(options.out), Site(options.site)
    site_options = sbatch.parsed(site.sbatch_options())
    extra = sbatch.joined(site_options, user_options)
    warn_of_short_time([*site_options, *user_options])
    old = stored_plan(folder)
    offline = options.dry_run and not cluster.answers()
    if not offline and not cluster.is_installed():
        raise Failure("sbatch and squeue are not on the PATH: is this a login node of a cluster? --dry-run works without")
    for variable in cluster.ignored_variables():
        print(f"slurm/submit: {variable} of the environment is left out; give the option after --", file=sys.stderr)
    program = program_of(site, folder, old, options)

    cpus = options.cpus or (old.value["cpus"] if old and not options.replan else None)
    if cpus is None:
        cpus = len(os.sched_getaffinity(0)) if offline else cluster.cores_of_nodes()
        print(f"slurm/submit: planned for {cpus} CPUs, {'those of this process' if offline else 'the cores of the largest node'}"
              " (--cpus)", file=sys.stderr)
    isa = options.isa or (old.value["isa"] if old and not options.replan else None)
    manifest = plan_of(site, program, options.study, options, cpus, isa)
    size = options.max_array_size or (cluster.MAX_ARRAY_SIZE if offline else cluster.max_array_size())
    name = str(manifest.value["study"]).replace(" ", "_")
    if old:
        check_plan(folder, old, manifest, options.replan)
    if options.dry_run or options.test_only:
        return show(folder, manifest, options, extra, size, name, offline)
    with folder.lock("submit"):
        return submit(folder, manifest, site, program, options, extra, size, name)


def warn_of_short_time(given: Sequence[sbatch.Option]) -> None:
    limits = [sbatch.minutes(option.value or "") for option in given if option.name == "time"]
    if limits and limits[-1] is not None and limits[-1] < SHORTEST_MIN:
        print(f"slurm/submit: --time: jobs of less than {SHORTEST_MIN} minutes get TERM, 2 minutes before their end, when they have hardly"
              " begun, and are requeued three times for little", file=sys.stderr)


def program_of(site: Site, folder: Folder, old: Manifest | None, options: argparse.Namespace) -> Path:
    """To resume is to go on with the program that DIR was begun with: points of another build are other points."""
    if options.program:
        program = options.program.resolve()
    else:
        program = folder.slurm / "programs" / old.build_id / "rasterbench" if old else Path()
        if options.rebuild or options.replan or not program.is_file():
            program = ROOT / "build/release/bin/rasterbench"
            if not options.dry_run:
                build(site)
    if not program.is_file():
        raise InputError(program, "no such program: build it first (scripts/setup, or README, On a cluster)")
    return program


def describe(manifest: Manifest, arrays: Sequence[Array], everything: Sequence[states.State]) -> None:
    skipped = [p for family in manifest.families for p in family.points if p["skip"]]
    many = states.counts(list(everything))
    print(f"{manifest.value['study']}: {manifest.points} points in {len(manifest.families)} families"
          + (f", {len(skipped)} of them skipped (first: {skipped[0]['name']}: {skipped[0]['skip']})" if skipped else ""))
    print("families: " + ", ".join(f"{count} {kind}" for kind, count in many.items()))
    for array in arrays:
        families = [family for element in array.elements for family in element]
        print(f"array {array.name}: {len(array.elements)} elements of {array.cpus} CPUs, {len(families)} families,"
              f" {sum(len(family.points) for family in families)} points")


def to_submit(folder: Folder, manifest: Manifest, ask_slurm: bool) -> tuple[list[states.State], list[states.State]]:
    everything = states.of_families(folder, manifest, ask_slurm)
    return everything, [s for s in everything if s.kind in ("failed", "missing") and not s.in_queue]


def show(folder: Folder, manifest: Manifest, options: argparse.Namespace, extra: list[str], size: int, name: str, offline: bool) -> int:
    if not offline:
        check_queue(folder, manifest)
    everything, missing = to_submit(folder, manifest, not offline)
    arrays = arrays_of([s.family for s in missing], options.per_task, size, manifest.value["cpus"])
    describe(manifest, arrays, everything)
    submission = folder.slurm / "submissions" / str(max(folder.submissions(), default=0) + 1)
    token = secrets.token_hex(4)
    commands = [array_command(array, folder, submission, options, name, token, extra) for array in arrays]
    if options.test_only:
        # --output names a folder that is not there yet; sbatch reads the script, so it is the one of this checkout.
        for command in commands:
            command[command.index(str(submission / "task"))] = str(HERE / "task")
            done = subprocess.run(["sbatch", "--test-only", *command[1:]], env=cluster.environment(), capture_output=True, text=True,
                                  check=False)
            print((done.stderr + done.stdout).strip())
            if done.returncode != 0:
                raise Failure(f"sbatch --test-only refuses {shlex.join(command)}")
        return 0
    for array, command in zip(arrays, commands):
        print(shlex.join(command))
    if arrays:
        print(shlex.join(merge_command([f"JOB_{array.name}" for array in arrays], folder, submission, options, name, token, extra)))
        print(f"\n# plan: {folder.manifest_path}")
        for array in arrays:
            print(f"# {submission / array.tasks}\n{array.lines()}", end="")
    return 0


def submit(folder: Folder, manifest: Manifest, site: Site, program: Path, options: argparse.Namespace, extra: list[str], size: int,
           name: str) -> int:
    find_lost_jobs(folder)
    check_queue(folder, manifest)
    everything, missing = to_submit(folder, manifest, True)
    arrays = arrays_of([s.family for s in missing], options.per_task, size, manifest.value["cpus"])
    describe(manifest, arrays, everything)
    for path in outside(folder, manifest):
        print(f"slurm/submit: of an earlier plan, kept: {set_aside(path, 'replanned')}")
    write_whole(folder.manifest_path, dump(manifest.value))
    submit_lost_merges(folder, options, name, extra)
    if not arrays:
        print("nothing to submit" + ("" if all(s.kind == "done" for s in everything) else ": what is missing is in the queue"))
        return 0
    number = max(folder.submissions(), default=0) + 1
    submission = folder.slurm / "submissions" / str(number)
    (folder.slurm / "logs").mkdir(parents=True, exist_ok=True)  # a job whose log has no folder fails without a word
    copied = copy_program(program, folder, manifest.build_id)
    for script in SCRIPTS:
        write_whole(submission / script, (HERE / script).read_bytes())
        (submission / script).chmod(0o755)
    write_whole(submission / "site.sh", site.text)
    write_whole(submission / "plan.sh", plan_script(folder, manifest, frozen_study(site, copied, submission, options, manifest), copied))
    write_whole(submission / "manifest.json", dump(manifest.value))
    for array in arrays:
        write_whole(submission / array.tasks, array.lines())
    for state in missing:  # what a killed job had half copied
        for part in (folder.slurm / "families").glob(f".{state.family.id}.*"):
            shutil.rmtree(part)
    return submit_arrays(folder, submission, arrays, {s.family.id: s for s in missing}, options, name, extra)


def submit_arrays(folder: Folder, submission: Path, arrays: Sequence[Array], missing: dict[str, states.State],
                  options: argparse.Namespace, name: str, extra: list[str]) -> int:
    """Job ids are written down one by one: whatever stops this, the next submit knows what is in the queue."""
    token = secrets.token_hex(4)
    record: dict[str, Any] = {"schema": 1, "submitted": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "token": token, "arrays": [],
                              "merge": None}
    path = submission / "submission.json"
    for array in arrays:
        record["arrays"].append({"tasks": array.tasks, "cpus": array.cpus, "elements": len(array.elements), "job": None,
                                 "command": array_command(array, folder, submission, options, name, token, extra)})
    write_whole(path, dump(record))
    problem: Failure | None = None
    for array, entry in zip(arrays, record["arrays"]):
        with uninterrupted():
            # Before sbatch: an element that starts at once would skip what is there.
            aside = [(folder.slurm / "families" / family.id, missing[family.id].result.kind)
                     for element in array.elements for family in element]
            moved = [(place, target) for place, kind in aside if (target := set_aside(place, kind))]
            try:
                entry["job"] = submitted(entry["command"], comment_of(token, array.name))
            except Failure as error:
                for place, target in moved:
                    target.rename(place)
                problem = error
                break
            try:
                write_whole(path, dump(record))
            except OSError:
                cluster.ask(["scancel", str(entry["job"])])  # or nobody would know of it
                raise
        print(f"submitted {array.name} as job {entry['job']}")
    jobs = [entry["job"] for entry in record["arrays"] if entry["job"] is not None]
    if jobs:
        submit_merge(folder, submission, record, options, name, extra)
        print(f"submitted merge as job {record['merge']}; slurm/status {shlex.quote(str(folder.root))} says how far it is")
    if problem:
        raise Failure(f"{problem}; {len(jobs)} of {len(arrays)} arrays are submitted: run the same command again for the rest")
    return 0


def submitted(command: Sequence[str], comment: str) -> int:
    """The job's id, also where sbatch was given up and the controller took the job all the same. Throws Failure."""
    try:
        return cluster.sbatch(command)
    except cluster.NoAnswer:
        job = cluster.jobs_by_comment().get(comment)
        if job is None:
            raise
        return job


def submit_merge(folder: Folder, submission: Path, record: dict[str, Any], options: argparse.Namespace, name: str,
                 extra: Sequence[str]) -> None:
    jobs = [entry["job"] for entry in record["arrays"] if entry["job"] is not None]
    with uninterrupted():
        record["merge"] = submitted(merge_command(jobs, folder, submission, options, name, record["token"], extra),
                                    comment_of(record["token"], "merge"))
        write_whole(submission / "submission.json", dump(record))


def check_queue(folder: Folder, manifest: Manifest) -> None:
    """Jobs run the program and the study that were frozen when they were submitted: what they still measure for another plan
    would cost time and stand in the way of this one. To cancel them is left to the user, because some may have measured for
    hours. Throws InputError that says the command."""
    planned = {family.id for family in manifest.families}
    builds = {number: folder.build_of(number) for number in folder.submissions()}
    elements = states.elements_of(folder)

    def is_other(family: str, element: Element) -> bool:
        return family not in planned or builds[element.submission] not in (None, manifest.build_id)

    active = cluster.active([element for found in elements.values() for element in found])
    other = {element for family, found in elements.items() for element in found if element in active and is_other(family, element)}
    if not other:
        return
    words = []
    for job in sorted({element.job for element in other}):
        indices = sorted(element.index for element in other if element.job == job)
        is_whole = all(element in other for element in active if element.job == job)
        words.append(str(job) if is_whole else f"{job}_[{','.join(map(str, indices))}]")
    running = sum(not active[element].is_pending for element in other)
    raise InputError(folder.root, f"{len(other)} jobs of an earlier plan are in the queue, {running} of them running: cancel them, then"
                     f" submit again: {shlex.join(['scancel', *words])}")


def find_lost_jobs(folder: Folder) -> None:
    """Writes down jobs that were taken after sbatch had been given up, or while submit was killed: they are not missing."""
    open_ones = list(folder.unfinished())
    known = cluster.jobs_by_comment() if open_ones else {}
    for number, record in open_ones:
        for entry in record["arrays"]:
            if entry["job"] is None:
                entry["job"] = known.get(comment_of(record["token"], entry["tasks"].removesuffix(".tasks")))
        record["merge"] = record.get("merge") or known.get(comment_of(record["token"], "merge"))
        write_whole(folder.slurm / "submissions" / str(number) / "submission.json", dump(record))


def submit_lost_merges(folder: Folder, options: argparse.Namespace, name: str, extra: Sequence[str]) -> None:
    """The merge job of arrays that are in the queue, where sbatch refused it when they were submitted."""
    for number, record in folder.unfinished():
        elements = [element for found in folder.elements().values() for element in found if element.submission == number]
        if record.get("merge") is None and cluster.active(elements):
            submit_merge(folder, folder.slurm / "submissions" / str(number), record, options, name, extra)
            print(f"submitted merge of submission {number} as job {record['merge']}")


def main(arguments: Sequence[str] | None = None) -> int:
    ours, sbatch_options = split_arguments(sys.argv[1:] if arguments is None else arguments)
    return guarded("slurm/submit", lambda: run(parser().parse_args(ours), sbatch_options))
