"""Where each family of a plan stands, and why one is missing: from result files first, then from the queue."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from . import cluster
from .folder import Element, Family, Failure, Folder, Manifest, Result

# What a state of SLURM's means for who reads why a family is missing.
_ENDED = {"TIMEOUT": "timed out", "NODE_FAIL": "node lost", "CANCELLED": "cancelled", "OUT_OF_MEMORY": "out of memory",
          "PREEMPTED": "preempted", "BOOT_FAIL": "node lost", "DEADLINE": "timed out", "FAILED": "failed"}


@dataclass(frozen=True)
class State:
    kind: str  # done, failed, running, pending, missing
    reason: str
    family: Family
    result: Result
    in_queue: bool = False


def elements_of(folder: Folder) -> dict[str, list[Element]]:
    """Folder.elements(), with jobs that are known by their comment only. Throws Failure where SLURM does not answer."""
    return folder.elements(cluster.jobs_by_comment() if any(folder.unfinished()) else {})


def of_families(folder: Folder, manifest: Manifest, ask_slurm: bool = True) -> list[State]:
    """In the plan's order. Throws Failure where SLURM should say more and does not answer."""
    elements = elements_of(folder) if ask_slurm else folder.elements()
    results = {family.id: folder.result(family, manifest.build_id) for family in manifest.families}
    open_elements = {family.id: elements.get(family.id, []) for family in manifest.families if results[family.id].kind != "done"}
    latest = [found[0] for found in open_elements.values() if found]
    active = cluster.active([e for found in open_elements.values() for e in found]) if ask_slurm else {}
    ended = cluster.ended([e for e in latest if e not in active]) if ask_slurm else {}
    return [_state(folder, family, results[family.id], open_elements.get(family.id, []), active, ended) for family in manifest.families]


def _state(folder: Folder, family: Family, result: Result, elements: list[Element], active: dict[Element, cluster.Active],
           ended: dict[Element, str]) -> State:
    if result.kind == "done":
        return State("done", f"on {(result.provenance or {}).get('node')}", family, result)
    for element in elements:
        if element in active:
            return _queued(family, result, element, active[element], folder.last_attempt(family.id, element))
    if result.kind in ("failed", "damaged"):
        return State("failed", f"{'damaged: ' if result.kind == 'damaged' else ''}{result.reason}", family, result)
    if not elements:
        return State("missing", "not submitted", family, result)
    element = elements[0]
    how = _ENDED.get(ended.get(element, ""), "")
    log = f"job {element}, {folder.slurm / 'logs' / f'{element}.out'}"
    attempt = folder.last_attempt(family.id, element)
    if attempt is None:
        return State("failed", f"{how or 'ended'} before it began ({log})", family, result)
    where, said = attempt
    node = where.get("node", "an unknown node")
    last = said[-1] if said else "killed, or its node was lost"
    if last in ("done", "a point failed", "done by another job in the meantime"):
        last += ", but its result is not in slurm/families"
    if how in ("", "failed") or said and last.startswith("timed out"):
        return State("failed", f"on {node}: {last} ({log})", family, result)
    return State("failed", f"{how} on {node}{': ' + last if said else ''} ({log})", family, result)


def _queued(family: Family, result: Result, element: Element, queued: cluster.Active,
            attempt: tuple[dict[str, Any], list[str]] | None) -> State:
    if queued.is_pending:
        return State("pending", f"job {element}: {queued.reason}", family, result, in_queue=True)
    if attempt is not None:
        where, said = attempt
        if not said:
            return State("running", f"job {element} on {where.get('node')}", family, result, in_queue=True)
        if said[-1] != "requeued":
            return State("failed", f"on {where.get('node')}: {said[-1]} (job {element})", family, result, in_queue=True)
    return State("pending", f"job {element} on {queued.node} has not come to it yet", family, result, in_queue=True)


def counts(states: list[State]) -> dict[str, int]:
    return {kind: sum(s.kind == kind for s in states) for kind in ("done", "running", "pending", "failed", "missing")}


def progress(states: list[State], width: int = 30) -> str:
    """'[#####.....] 12 of 24 points; families: 3 done, 1 running, 0 pending, 0 failed, 2 missing'."""
    points = sum(len(s.family.points) for s in states)
    done = sum(len(s.family.points) for s in states if s.kind == "done")
    filled = width * done // points if points else width
    families = ", ".join(f"{many} {kind}" for kind, many in counts(states).items())
    return f"[{'#' * filled}{'.' * (width - filled)}] {done} of {points} points; families: {families}"


def of_files_only(folder: Folder, manifest: Manifest) -> tuple[list[State], str]:
    """As of_families(); where SLURM cannot be asked, what the files say and why they are all there is."""
    try:
        return of_families(folder, manifest), ""
    except Failure as error:
        return of_families(folder, manifest, ask_slurm=False), str(error)
