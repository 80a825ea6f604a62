"""What slurm/submit plans: families as arrays, the commands that submit them, and whether DIR was planned so before."""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import shlex
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Sequence

from .folder import Failure, Family, Folder, InputError, Manifest, comment_of, manifest_of, write_whole
from .site import HERE, Site

ROOT = HERE.parent


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


def plan_of(site: Site, program: Path, study: Path, options: argparse.Namespace, cpus: int, isa: str | None) -> Manifest:
    """What `rasterbench study --list --json` says, with the options that the jobs need to say the same."""
    study_options = ["--cpus", str(cpus)]
    if options.oversubscribe:
        study_options.append("--oversubscribe")
    if options.filter:
        study_options += ["--filter", options.filter]
    isa_options = ["--isa", isa] if isa else []
    try:
        value = json.loads(site.run([program, "study", study, "--list", "--json", *study_options, *isa_options]))
        study_options += ["--isa", value["isa"]]  # a node with wider vectors would plan other points
    except (ValueError, TypeError, KeyError):
        raise InputError(program, "does not answer as rasterbench does") from None
    value["file"] = str(options.study.resolve())
    value["options"] = study_options
    manifest = manifest_of(value, program)
    if not manifest.families:
        raise InputError(options.study, "no point is left to run (--filter)")
    return manifest


def arrays_of(families: Sequence[Family], per_task: int, max_array_size: int, cpus_of_node: int) -> list[Array]:
    """One array per shape, which is the largest thread count of a family, or the node where --oversubscribe allows more
    threads than that; split where SLURM allows no more indices."""
    arrays = []
    shapes = {family.id: min(family.threads, cpus_of_node) for family in families}
    for cpus in sorted(set(shapes.values())):
        same = [family for family in families if shapes[family.id] == cpus]
        elements = [tuple(same[i:i + per_task]) for i in range(0, len(same), per_task)]
        parts = [tuple(elements[i:i + max_array_size]) for i in range(0, len(elements), max_array_size)]
        for number, part in enumerate(parts, start=1):
            arrays.append(Array(f"c{cpus}" + (f"-{number}" if len(parts) > 1 else ""), cpus, part))
    return arrays


def log_pattern(folder: Folder, name: str) -> str:
    return f"--output={str(folder.slurm / 'logs').replace('%', '%%')}/{name}.out"


def array_command(array: Array, folder: Folder, submission: Path, options: argparse.Namespace, name: str, token: str,
                  extra: Sequence[str]) -> list[str]:
    at_most = f"%{options.at_most}" if options.at_most else ""
    return ["sbatch", "--parsable", f"--job-name={name}-{array.name}", f"--array=0-{len(array.elements) - 1}{at_most}", "--nodes=1",
            "--ntasks=1", f"--cpus-per-task={array.cpus}", "--threads-per-core=1", *([] if options.shared else ["--exclusive"]),
            "--requeue", "--open-mode=append", "--signal=B:TERM@120", f"--chdir={Path.cwd()}",
            f"--comment={comment_of(token, array.name)}", log_pattern(folder, "%A_%a"), *extra, str(submission / "task"),
            str(submission), array.tasks]


def merge_command(jobs: Sequence[object], folder: Folder, submission: Path, options: argparse.Namespace, name: str, token: str,
                  extra: Sequence[str]) -> list[str]:
    # afterany: afterok would wait for ever after one failure, and it is the merge that says what is missing.
    return ["sbatch", "--parsable", f"--job-name={name}-merge", f"--dependency=afterany:{':'.join(map(str, jobs))}", "--nodes=1",
            "--ntasks=1", "--cpus-per-task=1", f"--chdir={Path.cwd()}", f"--comment={comment_of(token, 'merge')}",
            log_pattern(folder, "merge-%j"), *extra, str(submission / "merge-task"), str(submission), str(ROOT), str(folder.root),
            *(["--no-report"] if options.no_report else [])]


def plan_script(folder: Folder, manifest: Manifest, study: Path, program: Path) -> str:
    """What task and step read."""
    digest = hashlib.sha256(str(folder.root).encode()).hexdigest()[:8]
    values = {"dir": folder.root, "study": study, "program": program, "cwd": Path.cwd(),
              "scratch_name": f"rasterbench-{folder.root.name}-{digest}"}
    lines = [f"{name}={shlex.quote(str(value))}\n" for name, value in values.items()]
    return "".join(lines) + f"options=({' '.join(map(shlex.quote, manifest.value['options']))})\n"


def stored_plan(folder: Folder) -> Manifest | None:
    """The plan that DIR has already. Throws InputError where DIR cannot be a study's."""
    if "\\" in str(folder.root) or "\n" in str(folder.root):
        raise InputError(folder.root, "sbatch bears no backslash and no line break in the name of a log: choose another --out")
    if folder.root.exists() and not folder.root.is_dir():
        raise InputError(folder.root, "is not a folder")
    if (folder.slurm / "submit").is_file():
        raise InputError(folder.root, "is a checkout of rasterbench, and slurm/ in it the commands: choose another --out")
    if not folder.manifest_path.exists():
        if (folder.root / "journal.jsonl").exists() or (folder.root / "records.jsonl").exists():
            raise InputError(folder.root, "holds a study that was not submitted from here: choose another --out")
        return None
    return folder.manifest()


def check_plan(folder: Folder, old: Manifest, new: Manifest, replan: bool) -> None:
    """A plan takes the place of another only where that costs no result, or on request. Throws InputError."""
    if old.value["study"] != new.value["study"]:
        raise InputError(folder.root, f"holds the study '{old.value['study']}', not '{new.value['study']}': choose another --out")
    if replan:
        return
    advice = "choose another --out or --replan"
    if old.value["hash"] != new.value["hash"]:
        raise InputError(folder.root, f"was planned with another text of {new.value['file']}: {advice}")
    before, now = old.value.get("options", []), new.value["options"]
    if sorted(before) != sorted(now):
        raise InputError(folder.root, f"was planned with '{shlex.join(before)}', not '{shlex.join(now)}': {advice}")
    lost = outside(folder, new)
    if lost:
        raise InputError(folder.root, f"has {len(lost)} results that are not of this plan (program {new.build_id}; DIR was begun with"
                         f" {old.build_id}): {advice}")


def outside(folder: Folder, manifest: Manifest) -> list[Path]:
    """Results of families that `manifest` does not have."""
    path, planned = folder.slurm / "families", {family.id for family in manifest.families}
    return sorted(p for p in path.iterdir() if "." not in p.name and p.name not in planned) if path.is_dir() else []


def frozen_study(site: Site, program: Path, submission: Path, options: argparse.Namespace, manifest: Manifest) -> Path:
    """A copy of the study, which edits while jobs wait do not reach. Models are looked for beside a study: where the copy needs
    them, what is there is linked; where it is still another study (a model in ../), the jobs read the original, and refuse
    it when it changed."""
    copy, original = submission / "study" / options.study.name, options.study.resolve()
    write_whole(copy, original.read_bytes())

    def is_the_same() -> bool:
        with contextlib.suppress(Failure, InputError):
            again = plan_of(site, program, copy, options, manifest.value["cpus"], manifest.value["isa"])
            return [family.id for family in again.families] == [family.id for family in manifest.families]
        return False

    if is_the_same():
        return copy
    for path in original.parent.iterdir():
        if path.name != copy.name:
            (copy.parent / path.name).symlink_to(path)
    if is_the_same():
        return copy
    shutil.rmtree(copy.parent)
    print(f"slurm/submit: {options.study}: has models that a copy would not find: do not edit it before the study is done",
          file=sys.stderr)
    return original
