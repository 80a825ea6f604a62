"""DIR, the folder of a study that runs as job arrays: its plan, its results and what is known of each attempt.

    DIR/context.json, records.jsonl, images/, report.html     made by slurm/merge, as of a study on one machine
    DIR/slurm/manifest.json       the plan: `rasterbench study --list --json` with the options that made it
    DIR/slurm/programs/BUILD_ID/  the program as it was when the study was submitted
    DIR/slurm/submissions/N/      scripts, study file, tasks and job ids of the N-th submission
    DIR/slurm/work/FAMILY@NODE/   a study of one family that is under way on a node, with its journal
    DIR/slurm/families/FAMILY/    one that was completed: renamed into place as a whole
    DIR/slurm/attempts/FAMILY/    when.JOB_INDEX.RESTART.json and .end: where each attempt ran and how it ended
    DIR/slurm/logs/               what the jobs printed
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Iterator, Mapping

SCHEMA = 1
# What merge takes from a family's context.json.
_OF_CONTEXT = {"schema": int, "id": str, "started": str, "finished": str, "machine": dict, "environment": dict, "study": dict,
               "libraries": dict, "scenes": dict}


class InputError(Exception):
    """Bad input: one line that names the file, the place and the field; exit code 2."""

    def __init__(self, place: object, problem: str) -> None:
        super().__init__(f"{place}: {problem}".replace("\n", " "))


class Failure(Exception):
    """Something outside went wrong, in one line: SLURM, the build, the disk; exit code 1."""


@dataclass(frozen=True)
class Family:
    """Points that only one machine may measure (harness/records.md)."""

    id: str
    shard: str
    threads: int
    points: tuple[dict[str, Any], ...]

    @property
    def title(self) -> str:
        """What its points share, for people: 'teapot/1920x1080'."""
        return os.path.commonprefix([point["name"] + "/" for point in self.points]).rpartition("/")[0] or self.id[:8]


@dataclass(frozen=True)
class Manifest:
    value: dict[str, Any]
    families: tuple[Family, ...]

    @property
    def build_id(self) -> str:
        return str(self.value["build_id"])

    @property
    def points(self) -> int:
        return sum(len(family.points) for family in self.families)


@dataclass(frozen=True)
class Result:
    """What DIR/slurm/families has of a family. kind: done, failed (a point of it did), damaged, absent."""

    kind: str
    reason: str = ""
    records: tuple[dict[str, Any], ...] = ()
    context: dict[str, Any] | None = None
    provenance: dict[str, Any] | None = None


@dataclass(frozen=True)
class Element:
    """One element of a submitted array."""

    submission: int
    job: int
    index: int

    def __str__(self) -> str:
        return f"{self.job}_{self.index}"


def manifest_of(value: dict[str, Any], place: object) -> Manifest:
    try:
        families = tuple(Family(f["id"], f["shard"], int(f["threads"]), tuple(f["points"])) for f in value["families"])
        if value["schema"] != SCHEMA:
            raise InputError(place, f"schema: is {value['schema']!r}, this program reads {SCHEMA}")
        for key in ("study", "file", "hash", "build_id", "cpus", "isa"):
            value[key]
        if not isinstance(value["cpus"], int):
            raise TypeError("cpus")
        if any(not isinstance(point[key], str) for family in families for point in family.points for key in ("id", "name")):
            raise TypeError("a point")
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(place, f"is no plan of a study: {error}") from None
    return Manifest(value, families)


def read_json(path: Path) -> dict[str, Any]:
    """An object. Throws InputError that names the file."""
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(path, "no such file") from None
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(path, f"not JSON: {error}") from None
    if not isinstance(value, dict):
        raise InputError(path, "expected an object")
    return value


def write_whole(path: Path, content: str | bytes) -> None:
    """The file is there as a whole or as it was before; one with equal content is left alone."""
    data = content.encode() if isinstance(content, str) else content
    if path.is_file() and path.read_bytes() == data:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(name)
        raise


def comment_of(token: str, name: str) -> str:
    """By which a job is found whose sbatch was given up, or whose submit died, before the id was written down."""
    return f"rasterbench-{token}-{name}"


def dump(value: object) -> str:
    return json.dumps(value, indent=1, ensure_ascii=False) + "\n"


class Folder:
    def __init__(self, root: Path) -> None:
        self.root = root.absolute()
        self.slurm = self.root / "slurm"

    @classmethod
    def existing(cls, root: Path) -> "Folder":
        """A folder that something was submitted from. Throws InputError."""
        folder = cls(root)
        if not folder.root.is_dir():
            raise InputError(root, "no such folder (expected the DIR of slurm/submit --out DIR)")
        if not folder.manifest_path.is_file():
            raise InputError(root, "holds no slurm/manifest.json: nothing was submitted from here")
        return folder

    @property
    def manifest_path(self) -> Path:
        return self.slurm / "manifest.json"

    def manifest(self) -> Manifest:
        return manifest_of(read_json(self.manifest_path), self.manifest_path)

    @contextlib.contextmanager
    def lock(self, name: str, wait_s: float = 0) -> Iterator[None]:
        """Only one process at a time; the system drops the lock of one that dies."""
        self.slurm.mkdir(parents=True, exist_ok=True)
        with open(self.slurm / f".{name}.lock", "a+", encoding="utf-8") as file:
            end = time.monotonic() + wait_s
            while True:
                try:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    if time.monotonic() >= end:
                        raise InputError(self.root, f"another slurm/{name} is at work in this folder") from None
                    time.sleep(0.1)
            yield

    # Submissions.

    def submissions(self) -> list[int]:
        folder = self.slurm / "submissions"
        return sorted(int(path.name) for path in folder.iterdir() if re.fullmatch("[0-9]+", path.name)) if folder.is_dir() else []

    def submission(self, number: int) -> dict[str, Any]:
        """Its arrays and jobs; one that was killed before its first array has none. Throws InputError."""
        path = self.slurm / "submissions" / str(number) / "submission.json"
        if not path.exists():
            return {"arrays": [], "merge": None}
        value = read_json(path)
        arrays = value.get("arrays")
        if not isinstance(arrays, list) or not all(isinstance(a, dict) and isinstance(a.get("tasks"), str) and a.get("tasks")
                                                   and isinstance(a.get("job"), (int, type(None))) and "job" in a for a in arrays):
            raise InputError(path, "arrays: expected a list of {tasks, job, ...}")
        return value

    def unfinished(self) -> Iterator[tuple[int, dict[str, Any]]]:
        """Submissions that have no job for an array or for the merge."""
        for number in self.submissions():
            record = self.submission(number)
            if isinstance(record.get("token"), str) and None in [record.get("merge"), *(entry["job"] for entry in record["arrays"])]:
                yield number, record

    def elements(self, by_comment: Mapping[str, int] = MappingProxyType({})) -> dict[str, list[Element]]:
        """By family: the elements that were to measure it, the latest first. `by_comment`: SLURM's jobs, for arrays whose id was
        never written down."""
        found: dict[str, list[Element]] = {}
        for number in reversed(self.submissions()):
            record = self.submission(number)
            for array in record["arrays"]:
                job = array["job"] or by_comment.get(comment_of(str(record.get("token")), array["tasks"].removesuffix(".tasks")))
                if job is None:
                    continue
                for index, family in self.tasks(number, array["tasks"]):
                    found.setdefault(family, []).append(Element(number, job, index))
        return found

    def build_of(self, number: int) -> str | None:
        """The program of a submission; None where it was killed before it wrote its plan down. Throws InputError."""
        path = self.slurm / "submissions" / str(number) / "manifest.json"
        return manifest_of(read_json(path), path).build_id if path.exists() else None

    def tasks(self, number: int, name: str) -> list[tuple[int, str]]:
        """Index and family of each line. Throws InputError."""
        path = self.slurm / "submissions" / str(number) / name
        found = []
        try:
            for line in path.read_text(encoding="utf-8").splitlines():
                index, family, _ = line.split()
                found.append((int(index), family))
        except ValueError:  # of UTF-8 too
            raise InputError(f"{path}:{len(found) + 1}", "expected an index, a family and a shard") from None
        return found

    # Results.

    def result(self, family: Family, build_id: str) -> Result:
        path = self.slurm / "families" / family.id
        if not path.exists():
            return Result("absent")
        try:
            context, provenance = read_json(path / "context.json"), read_json(path / "provenance.json")
            text = (path / "records.jsonl").read_text(encoding="utf-8")
            if not text.endswith("\n"):
                raise InputError("records.jsonl", "its last line is cut off")
            records = tuple(json.loads(line) for line in text.splitlines())
            if context["program"]["build_id"] != build_id:
                raise InputError("context.json", "of another program")
            if sorted(record["id"] for record in records) != sorted(point["id"] for point in family.points):
                raise InputError("records.jsonl", "its points are not those of the manifest")
            if provenance["family"] != family.id or not isinstance(provenance["node"], str):
                raise InputError("provenance.json", "of another family")
            for key, kind in _OF_CONTEXT.items():
                if not isinstance(context[key], kind):
                    raise InputError("context.json", f"{key} is not as a study writes it")
            failed = [record for record in records if record["status"] == "failed"]
            reason = "; ".join(f"{record['name']}: {record.get('reason', 'no reason')}" for record in failed)
        except (InputError, OSError, UnicodeDecodeError, ValueError, KeyError, TypeError) as error:
            return Result("damaged", f"{path}: {type(error).__name__ if isinstance(error, KeyError) else ''}{error}")
        return Result("failed" if failed else "done", reason, records, context, provenance)

    def last_attempt(self, family: str, element: Element) -> tuple[dict[str, Any], list[str]] | None:
        """Where the latest attempt of `element` ran, and what it said at its end (nothing: it runs, or was killed). The latest
        is that of the highest restart: the clocks of nodes differ, so the time in the name decides only between equals."""
        found = [(int(match[2]), int(match[1]), path) for path in (self.slurm / "attempts" / family).glob(f"*.{element}.*.json")
                 if (match := re.fullmatch(rf"([0-9]+)\.{element}\.([0-9]+)\.json", path.name))]
        if not found:
            return None
        begun = max(found)[-1]
        end = begun.with_suffix(".end")
        try:
            where = read_json(begun)
        except InputError:  # the disk was full
            where = {}
        return where, end.read_text(encoding="utf-8", errors="replace").splitlines() if end.is_file() else []
