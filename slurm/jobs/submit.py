"""slurm/submit: a study as job arrays, of what is missing."""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Sequence

from . import cluster, states
from .folder import Failure, Family, Folder, InputError, Manifest, dump, manifest_of, read_json, write_whole
from .usage import Parser, guarded

HERE = Path(__file__).resolve().parent.parent
ROOT = HERE.parent
SCRIPTS = ("task", "step", "merge-task")
# Options of sbatch that decide what a result means, or where submit finds it: they are not the user's.
_OWN = {"array": "a", "cpus-per-task": "c", "nodes": "N", "ntasks": "n", "output": "o", "error": "e", "dependency": "d", "chdir": "D",
        "job-name": "J", "signal": "", "open-mode": "", "parsable": "", "requeue": "", "no-requeue": "", "wrap": "", "test-only": "",
        "threads-per-core": "", "hint": "", "export": "", "export-file": "", "wait": "W", "quiet": "Q", "help": "h", "version": "V"}


@dataclass(frozen=True)
class Array:
    """Families of equal shape, as one array: elements[i] are those of index i."""

    name: str
    cpus: int
    elements: tuple[tuple[Family, ...], ...]

    @property
    def tasks(self) -> str:
        return f"{self.name}.tasks"

    def lines(self) -> str:
        return "".join(f"{index} {family.id} {family.shard}\n" for index, element in enumerate(self.elements) for family in element)


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
    main.add_argument("--cpus", metavar="N", type=whole, help="CPUs of a node: what `max` means (default: cores of the cluster's largest"
                      " node; without SLURM, those of this process)")
    main.add_argument("--isa", help="instruction set of the nodes: what `best` means (default: this CPU's)")
    main.add_argument("--no-report", action="store_true", help="let the merge job merge only; the report needs matplotlib on the node")
    main.add_argument("--shared", action="store_true", help="do not ask for whole nodes (recorded; other jobs disturb times)")
    main.add_argument("--oversubscribe", action="store_true", help="allow more threads than CPUs")
    main.add_argument("--filter", metavar="REGEX", help="only points whose name this matches, as of `rasterbench study`")
    main.add_argument("--site", metavar="SITE", default="generic", help="a name in slurm/sites, or a file (default: generic)")
    main.add_argument("--program", metavar="FILE", type=Path, help="a rasterbench that is built already (default: build/release/bin, built"
                      " before the arrays are submitted)")
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


def check_sbatch_options(options: Sequence[str]) -> None:
    for position, word in enumerate(options):
        name = word[2:].partition("=")[0] if word.startswith("--") else word[1:2] if word.startswith("-") and len(word) > 1 else ""
        if word.startswith("-"):
            for long, short in _OWN.items():
                if name == long if word.startswith("--") else name == short and short:
                    raise InputError(word, "slurm/submit sets this option of sbatch itself")
        elif position == 0 or not options[position - 1].startswith("-") or "=" in options[position - 1]:
            raise InputError(word, "is no option of sbatch; a script is not expected after --")


class Site:
    """A site file: bash that is read before the program runs, here and in every job."""

    def __init__(self, name: str) -> None:
        known = sorted(path.stem for path in (HERE / "sites").glob("*.sh"))
        self.path = HERE / "sites" / f"{name}.sh" if name in known else Path(name)
        if not self.path.is_file():
            raise InputError("--site", f"'{name}' is neither a file nor one of {', '.join(known)}")
        self.text = self.path.read_text(encoding="utf-8")

    def run(self, command: Sequence[object]) -> str:
        """The output of a command in the site's environment. Throws Failure; bad input of the program is InputError."""
        return self._shell('exec "$@"', *command)

    def sbatch_options(self) -> list[str]:
        return [word for word in self._shell('printf "%s\\0" "${sbatch_options[@]}"').split("\0") if word]

    def _shell(self, script: str, *words: object) -> str:
        """Runs a script after the site file; what that prints goes to stderr."""
        whole_script = f'. "$1" >&2 || exit 97; shift; {script}'
        done = subprocess.run(["bash", "-c", whole_script, "bash", str(self.path.absolute()), *map(str, words)], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode == 0:
            return done.stdout
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        if done.returncode == 97:
            raise InputError(self.path, f"fails: {last}")
        if done.returncode == 2 and last.startswith("rasterbench: "):
            place, _, problem = last.removeprefix("rasterbench: ").partition(": ")
            raise InputError(place, problem)
        raise Failure(f"{words[0] if words else self.path}: {last}")


def build(site: Site) -> None:
    """Once, here: jobs that build at the same time wait for one another, or for ever, on a network file system."""
    if not (ROOT / "build/release/build.ninja").is_file():
        print("Configuring build/release", flush=True)
        site.run(["cmake", "-S", ROOT, "--preset", "release"])
    print("Building build/release", flush=True)
    site.run(["cmake", "--build", ROOT / "build/release", "--target", "rasterbench"])


def plan_of(site: Site, program: Path, options: argparse.Namespace, cpus: int) -> Manifest:
    """What `rasterbench study --list --json` says, with the options that the jobs need to say the same."""
    study_options = ["--cpus", str(cpus)]
    if options.isa:
        study_options += ["--isa", options.isa]
    if options.oversubscribe:
        study_options.append("--oversubscribe")
    if options.filter:
        study_options += ["--filter", options.filter]
    value = json.loads(site.run([program, "study", options.study, "--list", "--json", *study_options]))
    if not options.isa:
        study_options += ["--isa", value["isa"]]  # a node with wider vectors would plan other points
    value["file"] = str(options.study.resolve())
    value["options"] = study_options
    manifest = manifest_of(value, program)
    if not manifest.families:
        raise InputError(options.study, "no point is left to run (--filter)")
    return manifest


def arrays_of(families: Sequence[Family], per_task: int, max_array_size: int) -> list[Array]:
    """One array per shape, which is the largest thread count of a family; split where SLURM allows no more indices."""
    arrays = []
    for cpus in sorted({family.threads for family in families}):
        same = [family for family in families if family.threads == cpus]
        elements = [tuple(same[i:i + per_task]) for i in range(0, len(same), per_task)]
        parts = [tuple(elements[i:i + max_array_size]) for i in range(0, len(elements), max_array_size)]
        for number, part in enumerate(parts, start=1):
            arrays.append(Array(f"c{cpus}" + (f"-{number}" if len(parts) > 1 else ""), cpus, part))
    return arrays


def array_command(array: Array, folder: Folder, submission: Path, options: argparse.Namespace, name: str, extra: Sequence[str]) -> list[str]:
    at_most = f"%{options.at_most}" if options.at_most else ""
    return ["sbatch", "--parsable", f"--job-name={name}-{array.name}", f"--array=0-{len(array.elements) - 1}{at_most}", "--nodes=1",
            "--ntasks=1", f"--cpus-per-task={array.cpus}", "--threads-per-core=1", *([] if options.shared else ["--exclusive"]),
            "--requeue", "--open-mode=append", "--signal=B:TERM@120", f"--chdir={Path.cwd()}",
            f"--output={folder.slurm}/logs/%A_%a.out", *extra, str(submission / "task"), str(submission), array.tasks]


def merge_command(jobs: Sequence[object], folder: Folder, submission: Path, options: argparse.Namespace, name: str,
                  extra: Sequence[str]) -> list[str]:
    # afterany: afterok would wait for ever after one failure, and it is the merge that says what is missing.
    return ["sbatch", "--parsable", f"--job-name={name}-merge", f"--dependency=afterany:{':'.join(map(str, jobs))}", "--nodes=1",
            "--ntasks=1", "--cpus-per-task=1", f"--chdir={Path.cwd()}", f"--output={folder.slurm}/logs/merge-%j.out", *extra,
            str(submission / "merge-task"), str(submission), str(ROOT), str(folder.root), *(["--no-report"] if options.no_report else [])]


def plan_script(folder: Folder, manifest: Manifest, program: Path) -> str:
    """What task and step read."""
    digest = hashlib.sha256(str(folder.root).encode()).hexdigest()[:8]
    values = {"dir": folder.root, "study": manifest.value["file"], "program": program, "cwd": Path.cwd(),
              "scratch_name": f"rasterbench-{folder.root.name}-{digest}"}
    lines = [f"{name}={shlex.quote(str(value))}\n" for name, value in values.items()]
    return "".join(lines) + f"options=({' '.join(map(shlex.quote, manifest.value['options']))})\n"


def check_folder(folder: Folder, study: str) -> Manifest | None:
    """The plan that DIR has already."""
    if folder.root.exists() and not folder.root.is_dir():
        raise InputError(folder.root, "is not a folder")
    if not folder.manifest_path.exists():
        if (folder.root / "journal.jsonl").exists() or (folder.root / "records.jsonl").exists():
            raise InputError(folder.root, "holds a study that was not submitted from here: choose another --out")
        return None
    manifest = folder.manifest()
    if manifest.value["study"] != study:
        raise InputError(folder.root, f"holds the study '{manifest.value['study']}', not '{study}': choose another --out")
    return manifest


def copy_program(program: Path, folder: Folder, build_id: str) -> Path:
    """A build while jobs wait must not change what they run."""
    target = folder.slurm / "programs" / build_id / "rasterbench"
    if not target.is_file():
        write_whole(target, program.read_bytes())
    target.chmod(0o755)
    return target


def set_aside(folder: Folder, state: states.State) -> None:
    """A result that is run again is kept under another name: task skips what is there."""
    path = folder.slurm / "families" / state.family.id
    if not path.exists():
        return
    number = 1
    while (target := path.with_name(f"{path.name}.{state.result.kind}-{number}")).exists():
        number += 1
    path.rename(target)


def run(options: argparse.Namespace, sbatch_options: list[str]) -> int:
    if not options.study.is_file():
        raise InputError(options.study, "no such study file")
    check_sbatch_options(sbatch_options)
    folder, site = Folder(options.out), Site(options.site)
    extra = site.sbatch_options() + sbatch_options
    offline = options.dry_run and not cluster.answers()
    if not offline and not cluster.is_installed():
        raise Failure("sbatch and squeue are not on the PATH: is this a login node of a cluster? --dry-run works without")
    for variable in cluster.ignored_variables():
        print(f"slurm/submit: {variable} of the environment is left out; give the option after --", file=sys.stderr)
    program = options.program or ROOT / "build/release/bin/rasterbench"
    if not options.program and not options.dry_run:
        build(site)
    if not program.is_file():
        raise InputError(program, "no such program: build it first (scripts/setup, or README, On a cluster)")

    cpus = options.cpus
    if cpus is None:
        cpus = len(os.sched_getaffinity(0)) if offline else cluster.cores_of_nodes()
        print(f"slurm/submit: planned for {cpus} CPUs, {'those of this process' if offline else 'the cores of the largest node'}"
              " (--cpus)", file=sys.stderr)
    manifest = plan_of(site, program, options, cpus)
    size = options.max_array_size or (cluster.MAX_ARRAY_SIZE if offline else cluster.max_array_size())
    name = str(manifest.value["study"]).replace(" ", "_")
    check_folder(folder, manifest.value["study"])
    if options.dry_run or options.test_only:
        return show(folder, manifest, options, extra, size, name, offline)
    with folder.lock("submit"):
        return submit(folder, manifest, site, program, options, extra, size, name)


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
    everything, missing = to_submit(folder, manifest, not offline)
    arrays = arrays_of([s.family for s in missing], options.per_task, size)
    describe(manifest, arrays, everything)
    submission = folder.slurm / "submissions" / str(max(folder.submissions(), default=0) + 1)
    commands = [array_command(array, folder, submission, options, name, extra) for array in arrays]
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
        print(shlex.join(merge_command([f"JOB_{array.name}" for array in arrays], folder, submission, options, name, extra)))
        print(f"\n# plan: {folder.manifest_path}")
        for array in arrays:
            print(f"# {submission / array.tasks}\n{array.lines()}", end="")
    return 0


def submit(folder: Folder, manifest: Manifest, site: Site, program: Path, options: argparse.Namespace, extra: list[str], size: int,
           name: str) -> int:
    everything, missing = to_submit(folder, manifest, True)
    arrays = arrays_of([s.family for s in missing], options.per_task, size)
    describe(manifest, arrays, everything)
    write_whole(folder.manifest_path, dump(manifest.value))
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
    write_whole(submission / "plan.sh", plan_script(folder, manifest, copied))
    write_whole(submission / "manifest.json", dump(manifest.value))
    for array in arrays:
        write_whole(submission / array.tasks, array.lines())
    for state in missing:
        set_aside(folder, state)
    return submit_arrays(folder, submission, arrays, options, name, extra)


def submit_arrays(folder: Folder, submission: Path, arrays: Sequence[Array], options: argparse.Namespace, name: str,
                  extra: list[str]) -> int:
    """Job ids are written down one by one: whatever stops this, the next submit knows what is in the queue."""
    record = {"schema": 1, "submitted": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "arrays": [], "merge": None}
    problem: Failure | None = None
    for array in arrays:
        command = array_command(array, folder, submission, options, name, extra)
        try:
            job = cluster.sbatch(command)
        except Failure as error:
            problem = error
            break
        record["arrays"].append({"tasks": array.tasks, "cpus": array.cpus, "elements": len(array.elements), "job": job,
                                 "command": command})
        try:
            write_whole(submission / "submission.json", dump(record))
        except OSError:
            cluster.ask(["scancel", str(job)])  # or nobody would know of it
            raise
        print(f"submitted {array.name} as job {job}")
    jobs = [entry["job"] for entry in record["arrays"]]
    if jobs:
        record["merge"] = cluster.sbatch(merge_command(jobs, folder, submission, options, name, extra))
        write_whole(submission / "submission.json", dump(record))
        print(f"submitted merge as job {record['merge']}; slurm/status {shlex.quote(str(folder.root))} says how far it is")
    if problem:
        raise Failure(f"{problem}; {len(jobs)} of {len(arrays)} arrays are submitted: run the same command again for the rest")
    return 0


def main(arguments: Sequence[str] | None = None) -> int:
    ours, sbatch_options = split_arguments(sys.argv[1:] if arguments is None else arguments)
    return guarded("slurm/submit", lambda: run(parser().parse_args(ours), sbatch_options))
