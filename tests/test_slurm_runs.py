"""Studies from submit to report on real SLURM daemons, and what goes wrong on the way."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any, Iterator

import pytest

from .program import ROOT, TIMEOUT, environment, json_lines, program, records, sampling, snapshot, sweep, write_study
from .slurm_cluster import Cluster, families, logs, manifest, needs_slurm, one_line, submission, tasks, wait_for

pytestmark = needs_slurm

NODES, CPUS_OF_A_NODE, MAX_ARRAY_SIZE = 4, 16, 5
LONG = 200  # samples of a study that is stopped in the middle


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    """4 nodes of 16 CPUs, most of which are not there: nothing is bound."""
    yield from Cluster.started("--nodes", NODES, "--cpus", CPUS_OF_A_NODE,
                               "--max-array-size", MAX_ARRAY_SIZE)


@pytest.fixture(scope="module")
def bound_cluster() -> Iterator[Cluster]:
    """One node with the CPUs of this machine, and task/affinity, which binds."""
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("a mask of one CPU shows nothing: this machine has one")
    yield from Cluster.started("--nodes", 1, "--cpus", os.cpu_count())


def tiny(path: Path, name: str = "tiny", **axes: Any) -> Path:
    """32 points in 8 families: 2 scenes, 2 sizes, 2 modes; serial and three thread counts."""
    standard = dict(scene=["teapot:triangles=300", "terrain:triangles=300"], size=["64x48", "48x32"], numeric=["f32", "fixed_8"],
                    execution=["serial", "openmp:static"], threads=[1, 2, 4],
                    wait_policy="passive")  # threads that spin on CPUs that are not there take 100 ms a frame
    return write_study(path, f'name = "{name}"', sampling(), sweep(**(standard | axes)))


def long(path: Path, samples: int = LONG, **axes: Any) -> Path:
    """Families of two points on one thread that take seconds each."""
    standard = dict(scene="teapot:triangles=5000", size=["480x360", "470x360", "460x360", "450x360"], execution=["serial", "openmp:static"],
                    threads=1)
    return write_study(path, 'name = "long"', sampling(samples), sweep(**(standard | axes)))


def journals(out: Path, family: str) -> list[Path]:
    return sorted((out / "slurm/work").glob(f"{family}@*/journal.jsonl"))


def samples_in(path: Path) -> int:
    with suppress(FileNotFoundError):
        return path.read_text().count('"event":"sample"')
    return 0


def state_of(outcome_text: str, family: str) -> str:
    return next(line for line in outcome_text.splitlines() if f" {family[:8]} " in line)


# From submit to report.

def test_from_submit_to_report_with_one_failure(cluster: Cluster, tmp_path: Path) -> None:
    """A failure is named, exactly it is submitted again, and then the study is complete. Spaces in every path, and a % for sbatch."""
    folder = tmp_path / "a study"
    folder.mkdir()
    study, out = tiny(folder / "tiny study.toml"), folder / "out 50%j put"
    planned = cluster.submit(study, out, "--oversubscribe", "--dry-run").ok()
    assert not out.exists(), "a dry run wrote something"

    # The fault is there before the jobs are: a file where one family would keep its unfinished work, on every node.
    blocked = re.findall(r"^4 ([0-9a-f]{32}) ", planned.stdout, re.MULTILINE)
    assert len(blocked) == 1, "only the first array has an element 4"
    work = out / "slurm/work"
    work.mkdir(parents=True)
    for node in range(1, NODES + 1):
        (work / f"{blocked[0]}@n{node}").write_text("in the way")

    said = cluster.submit(study, out, "--oversubscribe", "--no-report").ok()
    arrays = submission(out, 1)["arrays"]
    assert [array["elements"] for array in arrays] == [MAX_ARRAY_SIZE, 8 - MAX_ARRAY_SIZE], "split at MaxArraySize"
    assert said.stdout.count("submitted c4-") == 2 and "32 points in 8 families" in said.stdout
    cluster.wait_until_empty()

    plan = manifest(out)
    assert len(plan["families"]) == 8 and sum(len(f["points"]) for f in plan["families"]) == 32
    assert {p["threads"] for f in plan["families"] for p in f["points"]} == {1, 2, 4}
    assert families(out) == sorted(f["id"] for f in plan["families"] if f["id"] != blocked[0]), logs(out)

    merged = cluster.merge(out, "--no-report")
    assert merged.code == 3, merged.stderr
    (missing,) = [line for line in merged.stdout.splitlines() if line.startswith("missing: ")]
    assert blocked[0][:8] in missing and "failed" in missing and "cannot be made" in missing and "28 of 32 points" in merged.stdout
    assert len(records(out)) == 28
    assert "28 of 32 points" in logs(out), "the merge job did not merge what there is"
    assert cluster.status(out).code == 3 and "1 failed" in cluster.status(out, "--quiet").stdout

    for path in work.glob(f"{blocked[0]}@*"):
        path.unlink()
    before = snapshot(out / "slurm/families")
    again = cluster.submit(study, out, "--oversubscribe").ok()
    assert [line[2] for line in tasks(out, 2)] == blocked and "7 done" in again.stdout
    cluster.wait_until_empty()
    after = snapshot(out / "slurm/families")
    assert {name: after[name] for name in before} == before, "what was done was touched"

    merged = cluster.merge(out, "--no-report")
    assert merged.code == 0, merged.stdout + merged.stderr
    assert cluster.status(out).code == 0 and "32 of 32 points" in cluster.status(out).stdout
    finished = records(out)
    assert [r["id"] for r in finished] == [p["id"] for f in plan["families"] for p in f["points"]]
    assert {r["status"] for r in finished} == {"ok"}
    context = json.loads((out / "context.json").read_text())
    assert {r["context"] for r in finished} == {context["id"]} and context["points"] == {"planned": 32, "run": 32, "skipped": 0, "failed": 0}
    for part in context["parts"]:
        assert part["provenance"]["cpus_per_task"] == 4 and part["provenance"]["exclusive"] is True
        assert part["provenance"]["mask_cpus"] == len(os.sched_getaffinity(0))
    assert {part["provenance"]["node"] for part in context["parts"]} == {f"n{i}" for i in range(1, NODES + 1)}, "not all nodes were used"
    for family in plan["families"]:
        assert len({r["origin"]["node"] for r in finished if r["origin"]["family"] == family["id"]}) == 1
    assert (out / "report.html").is_file(), "the merge job drew no report:\n" + logs(out)
    page = (out / "report.html").read_text()
    assert "measured on 4 nodes of one type" in page

    whole = {name: data for name, data in snapshot(out).items() if name in ("records.jsonl", "context.json")}
    cluster.merge(out, "--no-report").ok()
    assert {name: data for name, data in snapshot(out).items() if name in whole} == whole, "merge is not idempotent"
    assert "nothing to submit" in cluster.submit(study, out, "--oversubscribe").ok().stdout
    assert cluster.queue() == []


def test_the_limit_of_arrays_is_real(cluster: Cluster) -> None:
    refused = cluster.command("sbatch", f"--array=0-{MAX_ARRAY_SIZE}", "--test-only", "--wrap", "true")
    assert refused.code != 0 and "Invalid job array specification" in refused.stderr


def test_only_checked(cluster: Cluster, tmp_path: Path) -> None:
    study, out = tiny(tmp_path / "s.toml"), tmp_path / "out"
    assert cluster.submit(study, out, "--test-only").ok().stdout.count("to start at") == 2
    assert not out.exists() and cluster.queue() == []
    refused = cluster.submit(study, out, "--test-only", "--", "--partition=nowhere")
    assert refused.code == 1 and "invalid partition" in refused.stdout


def test_variables_of_the_submitter_reach_no_job(cluster: Cluster, tmp_path: Path) -> None:
    """OMP_* would change what is measured, SBATCH_* what is asked for, SLURM_* belong to the job that submit may run in."""
    study = tiny(tmp_path / "s.toml", scene="teapot:triangles=300", size="64x48", numeric="f32", threads=1)
    out = tmp_path / "out"
    said = cluster.submit(study, out, "--no-report", OMP_NUM_THREADS="7", OMP_PROC_BIND="true", KMP_AFFINITY="compact", SBATCH_TIMELIMIT="0",
                          SBATCH_PARTITION="nowhere", SLURM_CPUS_PER_TASK="9", SLURM_JOB_ID="1", SLURM_MEM_PER_NODE="1", LD_PRELOAD="").ok()
    assert "SBATCH_PARTITION of the environment is left out" in said.stderr
    cluster.wait_until_empty()
    cluster.merge(out, "--no-report").ok()
    variables = json.loads((out / "context.json").read_text())["environment"]
    assert not [name for name in variables if name.startswith(("OMP_", "KMP_", "SBATCH_", "LD_PRELOAD"))]
    assert variables["SLURM_JOB_NAME"] == "tiny-c1"


# Faults.

@pytest.fixture(scope="module")
def faults(cluster: Cluster, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Four elements on four nodes, each stopped in the middle in its own way: TERM, its node DOWN, scancel, a runner killed."""
    folder = tmp_path_factory.mktemp("faults")
    study, out = long(folder / "long.toml"), folder / "out"
    cluster.submit(study, out, "--no-report").ok()
    job = submission(out, 1)["arrays"][0]["job"]
    names = ["term", "down", "cancel", "kill"]
    family = dict(zip(names, (line[2] for line in tasks(out, 1))))

    def all_sampling() -> bool:
        return all(any(samples_in(path) >= 20 for path in journals(out, family[name])) for name in names)

    wait_for(all_sampling, "samples of all four", explain=lambda: logs(out))
    begun = {name: journals(out, family[name])[0].parent.name.partition("@")[2] for name in names}
    journal_before = journals(out, family["term"])[0].read_text()
    running = cluster.status(out)
    assert len(set(begun.values())) == NODES, "not one element a node"

    runners = [pid for pid, words in processes() if "runner" in words and job_of(pid) == f"{job}_3"]
    assert runners
    for pid in runners:
        os.kill(pid, signal.SIGKILL)
    cluster.command("scontrol", "update", f"NodeName={begun['down']}", "State=DOWN", "Reason=test").ok()
    cluster.command("scancel", "--signal=TERM", "--batch", f"{job}_0").ok()
    cluster.command("scancel", f"{job}_2").ok()
    at_once = families(out)
    cluster.wait_until_empty()
    cluster.command("scontrol", "update", f"NodeName={begun['down']}", "State=RESUME").ok()
    merged = cluster.merge(out, "--no-report")
    return {"study": study, "out": out, "job": job, "family": family, "begun": begun, "journal": journal_before, "at_once": at_once,
            "running": running, "merged": merged}


def processes() -> Iterator[tuple[int, list[str]]]:
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            yield int(path.parent.name), path.read_bytes().decode(errors="replace").split("\0")


def job_of(pid: int) -> str | None:
    with suppress(OSError):
        variables = dict(v.split("=", 1) for v in Path(f"/proc/{pid}/environ").read_text(errors="replace").split("\0") if "=" in v)
        if "SLURM_ARRAY_JOB_ID" in variables:
            return f"{variables['SLURM_ARRAY_JOB_ID']}_{variables['SLURM_ARRAY_TASK_ID']}"
    return None


def provenance(faults: dict[str, Any], name: str) -> dict[str, Any]:
    return json.loads((faults["out"] / "slurm/families" / faults["family"][name] / "provenance.json").read_text())


def ends(faults: dict[str, Any], name: str) -> list[str]:
    folder = faults["out"] / "slurm/attempts" / faults["family"][name]
    return [path.read_text().splitlines()[-1] for path in sorted(folder.glob("*.end"))]


def complete(folder: Path) -> None:
    finished = json_lines(folder / "records.jsonl")
    assert len(finished) == 2 and all(len(r["samples_ms"]) == LONG for r in finished)


def test_what_runs_is_said(faults: dict[str, Any]) -> None:
    said = faults["running"]
    assert said.code == 3 and "4 running" in said.stdout
    for name, family in faults["family"].items():
        line = state_of(said.stdout, family)
        assert line.startswith("running ") and f"on {faults['begun'][name]}" in line


def test_term_requeues_its_element_which_completes(faults: dict[str, Any]) -> None:
    where = provenance(faults, "term")
    assert where["restart"] == 1 and f"{where['array_job']}_{where['array_task']}" == f"{faults['job']}_0"
    assert ends(faults, "term") == ["requeued", "done"], logs(faults["out"])
    attempts = faults["out"] / "slurm/attempts" / faults["family"]["term"]
    first = min(attempts.glob("*.0.end")).read_text()
    assert "interrupted; what was measured is in" in first, f"the program did not end in good order: {first}"
    assert not list(attempts.glob("*.pid"))
    folder = faults["out"] / "slurm/families" / faults["family"]["term"]
    complete(folder)
    journal = (folder / "journal.jsonl").read_text()
    first_lines = faults["journal"][:faults["journal"].rindex("\n") + 1]
    if where["node"] == faults["begun"]["term"]:
        assert journal.startswith(first_lines), "what was measured on this node was measured again"
    else:
        assert '"event":"resume"' not in journal, "a journal moved to another node"


def test_a_requeue_is_of_one_element(faults: dict[str, Any]) -> None:
    assert [provenance(faults, name)["restart"] for name in ("kill",)] == [0], "another element was restarted"


def test_a_node_that_goes_down_leaves_no_record(faults: dict[str, Any]) -> None:
    assert faults["family"]["down"] not in faults["at_once"], "a result of a lost node"
    where = provenance(faults, "down")
    assert where["node"] != faults["begun"]["down"] and where["restart"] >= 1
    folder = faults["out"] / "slurm/families" / faults["family"]["down"]
    complete(folder)
    assert '"event":"resume"' not in (folder / "journal.jsonl").read_text(), "samples of two machines in one family"


def test_a_cancelled_element_stays_cancelled(faults: dict[str, Any]) -> None:
    assert faults["family"]["cancel"] not in families(faults["out"])
    line = next(line for line in faults["merged"].stdout.splitlines() if line.startswith("missing") and faults["family"]["cancel"][:8] in line)
    assert "cancelled" in line and f"{faults['job']}_2" in line
    assert "requeued" not in ends(faults, "cancel")


def test_a_point_that_failed_is_named(faults: dict[str, Any]) -> None:
    line = next(line for line in faults["merged"].stdout.splitlines() if line.startswith("missing") and faults["family"]["kill"][:8] in line)
    assert "tile_parallel" in line and "failed" in line and faults["merged"].code == 3
    assert {r["status"] for r in records(faults["out"])} == {"ok", "failed"}, "the report must show that a point failed"


def test_what_is_missing_is_submitted_again_and_completes(faults: dict[str, Any], cluster: Cluster) -> None:
    out, family = faults["out"], faults["family"]
    cluster.submit(faults["study"], out, "--no-report").ok()
    assert sorted(line[2] for line in tasks(out, 2)) == sorted([family["cancel"], family["kill"]])
    assert f"{family['kill']}.failed-1" in families(out), "a failed result is kept under another name"
    cluster.wait_until_empty()
    cluster.merge(out, "--no-report").ok()
    assert len(records(out)) == 8 and {r["status"] for r in records(out)} == {"ok"}


def test_after_three_requeues_an_element_gives_up(cluster: Cluster, tmp_path: Path) -> None:
    """The batch script says that this is its fourth start; all else is as submit submits it."""
    study, out = long(tmp_path / "long.toml", size="480x360"), tmp_path / "out"
    plan = cluster.submit(study, out, "--dry-run").ok().stdout
    cluster.submit(study, out, "--no-report", "--", "--hold").ok()
    job = submission(out, 1)["arrays"][0]["job"]
    cluster.command("scancel", job, submission(out, 1)["merge"]).ok()
    folder = out / "slurm/submissions/1"
    fourth = cluster.command("sbatch", "--parsable", "--array=0", "--ntasks=1", "--cpus-per-task=1", "--requeue", f"--output={tmp_path}/log",
                             "--wrap", f"export SLURM_RESTART_COUNT=3; exec {folder}/task {folder} c1.tasks").ok().stdout.strip()
    family = tasks(out, 1)[0][2]
    assert family in plan
    wait_for(lambda: any(samples_in(path) >= 5 for path in journals(out, family)), "samples")
    cluster.command("scancel", "--signal=TERM", "--batch", f"{fourth}_0").ok()
    cluster.wait_until_empty()
    assert "State=FAILED" in cluster.command("scontrol", "show", "job", fourth).ok().stdout
    (end,) = (out / "slurm/attempts" / family).glob("*.end")
    assert "interrupted" in end.read_text()
    assert end.read_text().splitlines()[-1] == "timed out: TERM came again after 3 requeues"
    assert families(out) == []


def test_two_submitters_at_once(cluster: Cluster, tmp_path: Path) -> None:
    study, out = tiny(tmp_path / "s.toml", threads=1), tmp_path / "out"
    command = [ROOT / "slurm/submit", study, "--out", out, "--program", program(), "--", "--hold"]
    both = [subprocess.Popen(command, env=cluster.environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    said = [process.communicate(timeout=TIMEOUT) for process in both]
    codes = [process.returncode for process in both]
    assert 0 in codes and set(codes) <= {0, 2}, said
    if 2 in codes:
        assert "another slurm/submit is at work" in said[codes.index(2)][1]
    lines = [line[2] for number in (1, 2) if (out / f"slurm/submissions/{number}").exists() for line in tasks(out, number)]
    assert len(lines) == len(set(lines)) == 8, "a family was submitted twice"
    assert "what is missing is in the queue" in cluster.submit(study, out, "--no-report").ok().stdout
    assert cluster.status(out, "--quiet").stdout.count("8 pending") == 1
    cluster.command("scancel", "--user", str(os.getuid())).ok()
    cluster.wait_until_empty()


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    if os.geteuid() != 0:
        pytest.skip("only root may mount a small file system to fill")
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], capture_output=True, text=True, check=False)
    if mounted.returncode != 0:
        pytest.skip(f"this machine does not let a test mount a file system: {mounted.stderr.strip()}")
    yield disk
    subprocess.run(["umount", "-l", disk], check=True)


def test_a_full_disk(cluster: Cluster, small_disk: Path, tmp_path: Path) -> None:
    """Nothing is submitted to a disk that is full; one that fills up later costs what could not be written, and nothing else."""
    study, out = tiny(tmp_path / "s.toml", size="64x48", numeric="f32", threads=1), small_disk / "out"
    one_line(cluster.submit(study, out), "slurm/submit", 1, ["No space left"])
    assert cluster.queue() == []
    subprocess.run(["mount", "-o", "remount,size=64m", small_disk], check=True)
    cluster.submit(study, out, "--no-report", "--", "--hold").ok()
    disk = os.statvfs(small_disk)
    (small_disk / "filler").write_bytes(b"x" * (disk.f_bavail * disk.f_frsize - 16384))
    cluster.command("scontrol", "release", submission(out, 1)["arrays"][0]["job"]).ok()
    wait_for(lambda: not [line for line in cluster.queue() if "Dependency" not in line and "JobHeldUser" not in line], "the array")
    assert families(out) == [], "a result on a full disk"
    assert not list((out / "slurm/families").glob(".*")) if (out / "slurm/families").exists() else True, "half a result was left"
    cluster.command("scancel", submission(out, 1)["merge"]).ok()
    merged = cluster.merge(out, "--no-report")
    assert merged.code == 3 and merged.stdout.count("missing: ") == 2
    (small_disk / "filler").unlink()
    cluster.submit(study, out, "--no-report").ok()
    cluster.wait_until_empty()
    cluster.merge(out, "--no-report").ok()
    assert len(records(out)) == 4


# Masks.

def test_a_job_has_a_cpu_for_each_thread(bound_cluster: Cluster, tmp_path: Path) -> None:
    """Also where OMP_PROC_BIND narrows the program's threads: the mask is that of the job step."""
    study = tiny(tmp_path / "s.toml", scene="teapot:triangles=300", size="64x48", numeric="f32", threads=[1, 2], binding=["none", "close"])
    out = tmp_path / "out"
    bound_cluster.submit(study, out, "--no-report").ok()
    bound_cluster.wait_until_empty()
    bound_cluster.merge(out, "--no-report").ok()
    context = json.loads((out / "context.json").read_text())
    (part,) = context["parts"]
    assert part["provenance"]["mask_cpus"] == part["provenance"]["cpus_per_task"] == 2
    assert len(context["machine"]["cpus_allowed"]) == 2
    assert {r["config"]["threads"]: r["threads_observed"] for r in records(out)} == {1: 1, 2: 2}


def test_without_c_srun_gives_one_cpu_and_nothing_is_measured(bound_cluster: Cluster, tmp_path: Path) -> None:
    """The trap of srun 22.05: in a job of two CPUs, --cpu-bind=cores alone puts all threads on one core."""
    study = tiny(tmp_path / "s.toml", scene="teapot:triangles=300", size="64x48", numeric="f32", threads=[1, 2])
    out = tmp_path / "out"
    bound_cluster.submit(study, out, "--no-report", "--", "--hold").ok()
    bound_cluster.command("scancel", submission(out, 1)["arrays"][0]["job"], submission(out, 1)["merge"]).ok()
    folder, (_, _, family, shard) = out / "slurm/submissions/1", tasks(out, 1)[0]
    step = f"{folder}/step {folder} {family} {shard} {tmp_path}/attempt"
    bound_cluster.command("sbatch", "--array=0", "--ntasks=1", "--cpus-per-task=2", "--exclusive", f"--output={tmp_path}/log", "--wrap",
                          f"srun --cpu-bind=cores {step}").ok()
    bound_cluster.wait_until_empty()
    assert json.loads((tmp_path / "attempt.json").read_text())["mask_cpus"] == 1, "srun has lost its trap: the guard is no longer tested"
    assert "2 threads are planned and this process may use 1 CPU" in (tmp_path / "attempt.end").read_text()
    assert families(out) == []


def test_scaling_sbatch(bound_cluster: Cluster, tmp_path: Path) -> None:
    study = tiny(tmp_path / "s.toml", scene="teapot:triangles=300", size="64x48", numeric="f32", threads=["1..max"])
    done = bound_cluster.command("sbatch", "--wait", "--cpus-per-task=2", "--mem=1G", f"--output={tmp_path}/log", ROOT / "slurm/scaling.sbatch",
                                 study, tmp_path / "out", cwd=ROOT, RASTERBENCH=str(program()))
    assert done.code == 0, (tmp_path / "log").read_text()
    assert {r["config"]["threads"] for r in records(tmp_path / "out")} == {1, 2}
    assert "report: " in (tmp_path / "log").read_text()
