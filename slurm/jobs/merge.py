"""slurm/merge: the results of all families as one study (harness/records.md, Merged studies)."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Iterable, Sequence

from . import states
from .folder import Failure, Folder, Manifest, dump, write_whole
from .states import State
from .usage import Parser, guarded

ROOT = Path(__file__).resolve().parent.parent.parent
LOCK_WAIT_S = 120  # a merge job may be at it
# Of one type are nodes with equal values of these; memory within 4 GiB, because the kernel keeps some of it.
_TYPE = ("cpu", "cpus_online", "cores", "packages", "numa_nodes", "smt", "caches")


def type_key(machine: dict[str, Any]) -> str:
    memory = machine.get("memory_bytes")
    return json.dumps([*(machine.get(key) for key in _TYPE), round(memory / 2**32) if isinstance(memory, int) else memory], sort_keys=True)


def type_names(machines: Iterable[dict[str, Any]]) -> dict[str, str]:
    """By type_key: words for people; two types with the same words are numbered."""
    names: dict[str, str] = {}
    for machine in machines:
        key = type_key(machine)
        if key not in names:
            words = f"{machine.get('cpu', 'unknown CPU')}, {machine.get('cores', '?')} cores in {machine.get('packages', '?')} packages"
            same = sum(name == words or name.startswith(words + " (type ") for name in names.values())
            names[key] = words + (f" (type {same + 1})" if same else "")
    return names


def joined(values: Sequence[Any]) -> Any:
    """One value for all nodes, or words that say how they differ."""
    distinct = [value for i, value in enumerate(values) if value not in values[:i]]
    if len(distinct) == 1:
        return distinct[0]
    said = [value if isinstance(value, str) else json.dumps(value, ensure_ascii=False) for value in distinct]
    return "differs between nodes: " + "; ".join(said[:4]) + (f"; and {len(said) - 4} more" if len(said) > 4 else "")


def highest_load(values: Sequence[Any]) -> Any:
    """The load average of the busiest node: the report warns by it."""
    def first(value: Any) -> float:
        try:
            return float(str(value).split()[0])
        except (ValueError, IndexError):
            return -1.0
    return max(values, key=first)


def merged_context(manifest: Manifest, parts: Sequence[State], images: dict[str, str]) -> dict[str, Any]:
    contexts = [part.result.context or {} for part in parts]
    names = type_names(context["machine"] for context in contexts)
    context = json.loads(json.dumps(contexts[0]))
    for key in ("id", "limits", "images", "noise"):
        context.pop(key, None)
    context["started"] = min(c["started"] for c in contexts)
    context["finished"] = max(c["finished"] for c in contexts)
    machines = [c["machine"] for c in contexts]
    context["machine"] = {key: joined([machine.get(key) for machine in machines]) for key in machines[0]}
    context["machine"]["load_average"] = highest_load([machine.get("load_average") for machine in machines])
    context["environment"] = {key: value for key, value in contexts[0]["environment"].items()
                              if all(c["environment"].get(key) == value for c in contexts)}
    context["study"] |= {"shard": "1/1", "file": manifest.value["file"]}
    context["scenes"] = {name: value for c in contexts for name, value in c["scenes"].items()}
    # A runtime may be preloaded for some families: a value that is not of all must not be blamed on all.
    context["libraries"] = {name: joined([c["libraries"][name] for c in contexts if name in c["libraries"]])
                            for name in dict.fromkeys(name for c in contexts for name in c["libraries"])}
    limits = [c["limits"] for c in contexts if "limits" in c]
    if limits:
        rates = {json.dumps(rate, sort_keys=True): rate for limit in limits for rate in limit["rates"]}
        context["limits"] = limits[0] | {"rates": list(rates.values())}
    context["images"] = images
    records = [record for part in parts for record in part.result.records]
    context["points"] = {"planned": manifest.points} | {
        key: sum(record["status"] == status for record in records)
        for key, status in (("run", "ok"), ("skipped", "skipped"), ("failed", "failed"))}
    context["parts"] = [{"family": part.family.id, "shard": part.family.shard, "context": c["id"],
                         "node_type": names[type_key(c["machine"])], "provenance": part.result.provenance, "noise": c.get("noise")}
                        for part, c in zip(parts, contexts)]
    noises = [(part["node_type"], part["noise"]) for part in context["parts"] if isinstance(part["noise"], dict)]
    if noises:
        context["noise"] = {"warnings": list(dict.fromkeys(f"{node}: {words}" for node, noise in noises for words in noise["warnings"])),
                            "remarks": list(dict.fromkeys(words for _, noise in noises for words in noise["remarks"]))}
    digest = hashlib.sha256(json.dumps(context, sort_keys=True).encode()).hexdigest()[:32]
    return {"schema": context.pop("schema"), "id": digest, **context}


def merged_records(parts: Sequence[State], context: dict[str, Any]) -> str:
    lines = []
    for part, about in zip(parts, context["parts"]):
        where = part.result.provenance or {}
        origin = {"node": where["node"], "node_type": about["node_type"], "family": part.family.id,
                  "job": f"{where.get('array_job')}_{where.get('array_task')}", "restart": where.get("restart"),
                  "context": about["context"]}
        lines += [json.dumps(record | {"context": context["id"], "origin": origin}, ensure_ascii=False, separators=(",", ":")) + "\n"
                  for record in part.result.records]
    return "".join(lines)


def merge_images(folder: Folder, parts: Sequence[State]) -> dict[str, str]:
    """A picture of each scene, from the first family that drew it."""
    images: dict[str, str] = {}
    for part in parts:
        source = folder.slurm / "families" / part.family.id
        for scene, name in ((part.result.context or {}).get("images") or {}).items():
            if scene in images or not (source / name).is_file():
                continue
            target, number = Path(name), 2
            while target.as_posix() in images.values():
                target = Path(name).with_name(f"{Path(name).stem}_{number}{Path(name).suffix}")
                number += 1
            write_whole(folder.root / target, (source / name).read_bytes())
            images[scene] = target.as_posix()
    return images


def set_stale_aside(folder: Folder) -> None:
    """What an earlier merge made of results that are no longer there: it is not of this plan."""
    for name in ("records.jsonl", "context.json"):
        path, number = folder.root / name, 1
        if path.exists():
            while (target := path.with_name(f"{path.stem}.stale-{number}{path.suffix}")).exists():
                number += 1
            path.rename(target)
            print(f"no result is there any more: the {name} of an earlier merge is kept as {target.name}")


def run(directory: Path, report: bool) -> int:
    folder = Folder.existing(directory)
    with folder.lock("merge", LOCK_WAIT_S):
        manifest = folder.manifest()
        found, problem = states.of_files_only(folder, manifest)
        if problem:
            print(f"slurm/merge: {problem}: reasons are from result files alone", file=sys.stderr)
        parts = [state for state in found if state.result.kind in ("done", "failed")]
        if parts:
            context = merged_context(manifest, parts, merge_images(folder, parts))
            # The records first: a reader of the old context finds records of another id, and says so.
            write_whole(folder.root / "records.jsonl", merged_records(parts, context))
            write_whole(folder.root / "context.json", dump(context))
            nodes = sorted({part["provenance"]["node"] for part in context["parts"]})
            types = sorted({part["node_type"] for part in context["parts"]})
            print(f"merged {sum(len(part.result.records) for part in parts)} of {manifest.points} points, measured on"
                  f" {', '.join(nodes)} ({'; '.join(types)})")
            if len(types) > 1:
                print(f"these are {len(types)} types of nodes: only points of one family may be compared")
        else:
            set_stale_aside(folder)
        missing = [state for state in found if state.kind != "done"]
        for state in missing:
            print(f"missing: {state.family.title} (family {state.family.id[:8]}, {len(state.family.points)} points): {state.kind}:"
                  f" {state.reason}")
        print(states.progress(found))
        if missing:  # before the report, which may fail
            print(f"slurm/merge: {directory}: incomplete: {len(missing)} of {len(found)} families are missing; run slurm/submit again",
                  file=sys.stderr)
        if report and parts:
            try:
                draw(folder.root)
            except Failure as error:
                if not missing:
                    raise
                print(f"slurm/merge: {error}", file=sys.stderr)
    return 3 if missing else 0


def draw(directory: Path) -> None:
    """The report of what there is, unless it is drawn already. Throws Failure."""
    report = directory / "report.html"
    if report.is_file() and all(report.stat().st_mtime_ns > (directory / name).stat().st_mtime_ns for name in ("records.jsonl", "context.json")):
        print(f"report: {report} (of these records already)")
        return
    done = subprocess.run([ROOT / "scripts/python", "-m", "analysis", "report", directory], stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise Failure(f"the records are merged, but the report was not drawn: {last}")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = Parser(prog="slurm/merge", description="Makes DIR/context.json and DIR/records.jsonl of all families that are done, lists what"
                    " is missing and why, and draws the report. May be run at any time, and again.",
                    epilog="Exit codes: 0 complete; 3 something is missing (what is there is merged and in the report); 1 the report"
                    " of a complete study, or the disk, failed; 2 bad input or usage.")
    parser.add_argument("directory", metavar="DIR", type=Path, help="the --out of slurm/submit")
    parser.add_argument("--no-report", action="store_true", help="merge only")
    options = parser.parse_args(arguments)
    return guarded("slurm/merge", lambda: run(options.directory, not options.no_report))
