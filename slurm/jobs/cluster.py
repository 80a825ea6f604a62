"""What SLURM says: its limits, its queue, and how a job that left the queue ended."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from typing import Sequence

from .folder import Element, Failure

TIMEOUT_S = 60  # of one question; a busy controller may take its time
MAX_ARRAY_SIZE = 1001  # SLURM's default: indices are below it
_REST_OF_ARRAY = "4294967294"  # NO_VAL: scontrol's index of the elements that were cancelled before they began

# What SLURM's commands read as options: SQUEUE_STATES=RUNNING would hide what is queued.
_OPTIONS = ("SBATCH_", "SRUN_", "SLURM_", "SLURMD_", "SQUEUE_", "SINFO_", "SACCT_", "SCONTROL_", "SCANCEL_")
# Of the submitter's SLURM_ variables only these are for the commands; the others are of a job that submit runs in, and
# sbatch would take the memory or CPUs of that job for those of the new one.
_KEPT = ("SLURM_CONF", "SLURM_CONF_SERVER", "SLURM_CLUSTERS", "SLURM_TIME_FORMAT")


class NoAnswer(Failure):
    """A command was given up: what it asked for may have been done, or may yet be."""


@dataclass(frozen=True)
class Active:
    """An element in the queue."""

    state: str  # SLURM's: PENDING, RUNNING, COMPLETING, ...
    node: str
    reason: str

    @property
    def is_pending(self) -> bool:
        return self.state in ("PENDING", "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "SPECIAL_EXIT", "RESV_DEL_HOLD")


def environment() -> dict[str, str]:
    """For SLURM's commands: without options that nobody sees on the command line."""
    return {name: value for name, value in os.environ.items() if not name.startswith(_OPTIONS) or name in _KEPT}


def ignored_variables() -> list[str]:
    return sorted(name for name in os.environ if name.startswith("SBATCH_"))


def is_installed() -> bool:
    return shutil.which("sbatch") is not None and shutil.which("squeue") is not None


def answers() -> bool:
    """Whether there is a cluster to ask."""
    try:
        return is_installed() and bool(ask(["sinfo", "-h"]))
    except Failure:
        return False


def ask(command: Sequence[str]) -> str:
    """The output of a SLURM command. Throws Failure with its last line on stderr."""
    try:
        done = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except FileNotFoundError:
        raise Failure(f"{command[0]}: not found: is SLURM installed, and its commands on the PATH?") from None
    except subprocess.TimeoutExpired:
        raise NoAnswer(f"{command[0]}: no answer for {TIMEOUT_S} s") from None
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise Failure(f"{command[0]}: {lines[-1].removeprefix(command[0] + ': ')}")
    return done.stdout


def sbatch(command: Sequence[str]) -> int:
    """Submits and gives the job's id. Throws NoAnswer where nobody knows whether there is one: look for its comment."""
    if command[0] != "sbatch" or "--parsable" not in command:
        raise ValueError("not a command of submit")
    output = ask(command)
    match = re.match(r"(\d+)(;|$)", output.strip())
    if not match:
        raise Failure(f"sbatch: said {output.strip()!r} where a job id was expected")
    return int(match[1])


def jobs_by_comment() -> dict[str, int]:
    """Jobs of this user that the controller knows and that have a comment."""
    output = ask(["squeue", "-h", "-t", "all", "-u", str(os.getuid()), "-o", "%F|%k"])
    pairs = (line.partition("|") for line in output.splitlines())
    return {comment: int(job) for job, _, comment in pairs if job.isdecimal() and comment not in ("", "(null)")}


def max_array_size() -> int:
    """Indices are below it. Throws Failure where the cluster allows no arrays."""
    match = re.search(r"^MaxArraySize\s*=\s*(\d+)", ask(["scontrol", "show", "config"]), re.MULTILINE)
    size = int(match[1]) if match else MAX_ARRAY_SIZE
    if size < 1:
        raise Failure("scontrol: this cluster allows no job arrays (MaxArraySize = 0)")
    return size


def cores_of_nodes() -> int:
    """Cores of the largest node."""
    found = [int(sockets) * int(cores) for sockets, cores in (line.split() for line in ask(["sinfo", "-h", "-o", "%X %Y"]).splitlines()
                                                              ) if sockets.isdigit() and cores.isdigit()]
    if not found:
        raise Failure("sinfo: knows no node")
    return max(found)


def active(elements: Sequence[Element]) -> dict[Element, Active]:
    """Those of `elements` that are in the queue."""
    if not elements:
        return {}
    by_name = {str(element): element for element in elements}
    found: dict[Element, Active] = {}
    for line in ask(["squeue", "-h", "-r", "-u", str(os.getuid()), "-o", "%F_%K|%T|%N|%r"]).splitlines():
        name, state, node, reason = line.split("|", 3)
        if name in by_name:
            found[by_name[name]] = Active(state, node, reason)
    return found


def ended(elements: Sequence[Element]) -> dict[Element, str]:
    """How elements that left the queue ended, as SLURM's state: of the accounting where there is one, else of what the
    controller still remembers. Those that nobody knows of are not in the answer."""
    jobs = sorted({element.job for element in elements})
    if not jobs:
        return {}
    states: dict[str, str] = {}  # by element, or by job for the elements of an array that are not named one by one
    try:
        output = ask(["sacct", "-n", "-X", "-P", "-j", ",".join(map(str, jobs)), "-o", "JobID,State"])
        for name, _, state in (line.partition("|") for line in output.splitlines()):
            job, _, index = name.partition("_")
            if index.startswith("["):  # never began: 7_[0-3]
                states |= {f"{job}_{i}": state for i in _indices(index.strip("[]"))}
            elif index:
                states[name] = state
    except Failure:  # no accounting: many small clusters have none
        pass
    if not states:
        for job in jobs:
            try:
                output = ask(["scontrol", "show", "job", "-o", str(job)])
            except Failure:  # forgotten after MinJobAge
                continue
            for line in output.splitlines():
                fields = dict(word.split("=", 1) for word in line.split() if "=" in word)
                array, index = fields.get("ArrayJobId", ""), fields.get("ArrayTaskId", "")
                if index == _REST_OF_ARRAY:
                    states[array] = fields.get("JobState", "")
                    continue
                for number in _indices(index):
                    states[f"{array}_{number}"] = fields.get("JobState", "")
    found = {element: (states.get(str(element)) or states.get(str(element.job), "")).split() for element in elements}
    return {element: words[0] for element, words in found.items() if words}


def _indices(text: str) -> list[int]:
    """Of '3' or '0-2,5%4'."""
    found: list[int] = []
    for part in text.partition("%")[0].split(","):
        low, _, high = part.partition("-")
        if low.isdigit() and (not high or high.isdigit()):
            found += range(int(low), int(high or low) + 1)
    return found
