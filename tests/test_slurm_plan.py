"""slurm/submit, merge and status without a cluster: exact commands, bad input, results that are not what they should be."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any, Callable

import pytest

from .program import ROOT, json_lines, program, records, run, sampling, snapshot, sweep, write_study
from .slurm_cluster import Cluster, manifest, missing_daemons, one_line

GOLDEN = Path(__file__).parent / "golden"
NOWHERE = Cluster(None)
SCRIPTS = ["submit", "merge", "status", "task", "step", "merge-task", "local", "scaling.sbatch"]


@pytest.fixture
def no_slurm(tmp_path: Path) -> dict[str, str]:
    """A PATH that has no command of SLURM."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in ("bash", "cat", "env", "grep"):
        (folder / name).symlink_to(shutil.which(name) or f"/bin/{name}")
    (folder / "python3").symlink_to("/usr/bin/python3")
    return {"PATH": str(folder)}


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Two shapes: four families of up to 4 threads, one of up to 2."""
    return write_study(tmp_path / "s.toml", 'name = "golden"', sampling(),
                       sweep(execution=["serial", "openmp:static"], size=["64x48", "48x32"], numeric=["f32", "fixed_8"], threads=[1, 2, 4]),
                       sweep(execution=["serial", "openmp:static"], size="32x24", threads=[1, 2]))


def normal(text: str, folder: Path) -> str:
    """With names in place of what differs between machines and builds."""
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "CHECKOUT").replace(str(program().parent), "BIN")
    text = re.sub(r"rasterbench-[0-9a-f]{8}-", "rasterbench-TOKEN-", text)
    ids: dict[str, str] = {}
    return re.sub(r"\b[0-9a-f]{32}\b", lambda match: ids.setdefault(match[0], f"FAMILY_{len(ids) + 1}"), text)


@pytest.mark.parametrize("name, options", [
    ("plain", []),
    ("split", ["--per-task", "1", "--max-array-size", "3", "--at-most", "2"]),
    ("packed", ["--per-task", "3", "--shared", "--filter", "f32", "--oversubscribe", "--isa", "sse4"]),
    ("options", ["--", "--partition=fast", "--account", "my project", "-t", "10"]),
    ("ceci", ["--site", "ceci-nic5", "--", "--time=00:30:00"])])
def test_dry_run_prints_the_exact_commands(name: str, options: list[str], study: Path, tmp_path: Path, no_slurm: dict[str, str]) -> None:
    """To renew the files: UPDATE_GOLDEN=1 scripts/python -m pytest tests/test_slurm_plan.py"""
    own, after = (options[:options.index("--")], options[options.index("--"):]) if "--" in options else (options, [])
    before = snapshot(tmp_path)
    # A module command that does nothing, as an exported function of bash.
    said = NOWHERE.submit(study, tmp_path / "out", "--dry-run", "--cpus", 16, *own, *after, cwd=tmp_path, **no_slurm,
                          **{"BASH_FUNC_module%%": "() { :; }", "HOME": "/nonexistent"}).ok()
    assert snapshot(tmp_path) == before, "a dry run wrote something"
    text, file = normal(said.stdout, tmp_path), GOLDEN / f"slurm_{name}.txt"
    if os.environ.get("UPDATE_GOLDEN"):
        file.write_text(text)
    assert text == file.read_text()


def test_a_dry_run_plans_for_the_cpus_that_it_is_told(tmp_path: Path, no_slurm: dict[str, str]) -> None:
    study = write_study(tmp_path / "s.toml", sampling(), sweep(execution="openmp:static", threads=["1..max"]))
    said = NOWHERE.submit(study, tmp_path / "out", "--dry-run", "--cpus", 64, **no_slurm).ok()
    assert "array c64: 1 elements of 64 CPUs, 1 families, 11 points" in said.stdout and "--cpus-per-task=64" in said.stdout
    said = NOWHERE.submit(study, tmp_path / "out", "--dry-run", **no_slurm).ok()
    assert "those of this process" in said.stderr and f"array c{len(os.sched_getaffinity(0))}:" in said.stdout


def test_without_a_cluster_nothing_is_submitted(study: Path, tmp_path: Path, no_slurm: dict[str, str]) -> None:
    one_line(NOWHERE.submit(study, tmp_path / "out", **no_slurm), "slurm/submit", 1, ["sbatch", "--dry-run"])
    if not missing_daemons():
        one_line(NOWHERE.submit(study, tmp_path / "out", "--cpus", 4), "slurm/submit", 1, ["scontrol"])
    assert not (tmp_path / "out").exists()


# Bad input.

@pytest.mark.parametrize("change, words", [
    (["--per-task", "0"], ["--per-task", "'0'"]), (["--cpus", "many"], ["--cpus", "'many'"]), (["--bogus"], ["--bogus"]),
    (["--site", "mars"], ["--site", "mars", "ceci-nic5", "generic"]), (["--isa", "mmx"], ["--isa", "mmx"]),
    (["--filter", "["], ["--filter"]), (["--filter", "nothing at all"], ["no point"]), (["--program", "/none"], ["/none", "no such program"]),
    (["--", "--array=0-3"], ["--array=0-3", "sets this option"]), (["--", "-c", "4"], ["-c", "sets this option"]),
    (["--", "-c4"], ["-c4"]), (["--", "script.sh"], ["script.sh", "no option"]), (["--", "--wrap=ls"], ["--wrap=ls"])])
def test_bad_options_of_submit(change: list[str], words: list[str], study: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    refused = NOWHERE.submit(study, out, "--dry-run", *(["--cpus", "4"] if "--cpus" not in change else []), *change)
    one_line(refused, "slurm/submit", 2, words)
    assert refused.stdout == "" and not out.exists()


def test_bad_studies_and_folders(study: Path, tmp_path: Path) -> None:
    def refused(out: Path, *words: str, file: Path = study) -> None:
        one_line(NOWHERE.submit(file, out, "--dry-run", "--cpus", 4), "slurm/submit", 2, list(words))

    refused(tmp_path / "out", "none.toml", "no such study", file=tmp_path / "none.toml")
    bad = write_study(tmp_path / "bad.toml", sampling(), "[[sweep]]\nkernel = 3\n")
    refused(tmp_path / "out", "bad.toml:", "kernel", file=bad)
    (tmp_path / "file").write_text("precious")
    refused(tmp_path / "file", "file", "is not a folder")
    (tmp_path / "other").mkdir()
    (tmp_path / "other/journal.jsonl").write_text("{}\n")
    refused(tmp_path / "other", "other", "not submitted from here")
    (tmp_path / "broken/slurm").mkdir(parents=True)
    for text, word in (("", "not JSON"), ("[]", "an object"), ('{"schema": 1}', "no plan"), ("\0\xff", "not JSON")):
        (tmp_path / "broken/slurm/manifest.json").write_text(text)
        refused(tmp_path / "broken", "manifest.json", word)
    for command in (NOWHERE.merge, NOWHERE.status):
        name = f"slurm/{command.__name__}"
        one_line(command(tmp_path / "none"), name, 2, ["none", "no such folder"])
        one_line(command(tmp_path / "other"), name, 2, ["other", "nothing was submitted"])
        one_line(command(tmp_path / "broken"), name, 2, ["manifest.json"])
        assert command(tmp_path, "--bogus").code == 2 and command("--help").code == 0


def test_a_site_that_fails_is_named(study: Path, tmp_path: Path) -> None:
    (tmp_path / "site.sh").write_text("echo chatter\nfalse_module load nothing\n")
    refused = NOWHERE.submit(study, tmp_path / "out", "--dry-run", "--cpus", 4, "--site", tmp_path / "site.sh")
    one_line(refused, "slurm/submit", 2, ["site.sh", "false_module"])


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read and write everything")
def test_folders_without_permission(study: Path, tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    one_line(NOWHERE.submit(study, tmp_path / "locked/out", "--cpus", 4), "slurm/submit", 2, ["locked"])


# Merging, of results that were made without jobs.

@pytest.fixture(scope="module")
def done_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A DIR whose three families are done, as step leaves them."""
    folder = tmp_path_factory.mktemp("done")
    study, out = write_study(folder / "s.toml", sampling(), sweep(size=["32x24", "24x16", "16x9"], threads=1)), folder / "out"
    (out / "slurm").mkdir(parents=True)
    options = ["--cpus", "4", "--isa", "baseline"]
    plan = json.loads(run("study", study, "--list", "--json", *options).ok().stdout)
    (out / "slurm/manifest.json").write_text(json.dumps(plan | {"file": str(study), "options": options}))
    for number, family in enumerate(plan["families"]):
        path = out / "slurm/families" / family["id"]
        run("study", study, *options, "--shard", family["shard"], "--family", family["id"], "--out", path).ok()
        (path / "provenance.json").write_text(json.dumps({
            "schema": 1, "family": family["id"], "node": f"n{number % 2}", "array_job": 7, "array_task": number, "restart": 0}))
    return out


@pytest.fixture
def finished(done_once: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(done_once, tmp_path / "out"))


def edit(path: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    value = json.loads(path.read_text())
    change(value)
    path.write_text(json.dumps(value))


def test_merged_files_are_a_study_and_say_where_they_come_from(finished: Path) -> None:
    plan, first = manifest(finished), manifest(finished)["families"][0]["id"]
    edit(finished / "slurm/families" / first / "context.json", lambda c: (c["machine"].update(cpu="Another CPU", cores=64),
                                                                                c["libraries"].update(openmp="another OpenMP")))
    said = NOWHERE.merge(finished, "--no-report")
    assert said.code == 0 and "2 types of nodes" in said.stdout, said.stderr
    merged, context = records(finished), json.loads((finished / "context.json").read_text())
    assert [r["id"] for r in merged] == [p["id"] for f in plan["families"] for p in f["points"]]
    assert {r["origin"]["node_type"] for r in merged if r["origin"]["family"] == first} == {"Another CPU, 64 cores in 1 packages"}
    assert context["machine"]["cpu"].startswith("differs between nodes: Another CPU; ") and len(context["parts"]) == 3
    assert context["libraries"]["openmp"].startswith("differs between nodes: another OpenMP; ")
    own = json_lines(finished / "slurm/families" / first / "records.jsonl")
    assert [r["samples_ms"] for r in merged[:len(own)]] == [r["samples_ms"] for r in own]
    before = snapshot(finished)
    assert NOWHERE.merge(finished, "--no-report").code == 0
    assert {n: d for n, d in snapshot(finished).items() if d is not None} == {n: d for n, d in before.items() if d is not None}


@pytest.mark.parametrize("damage, words", [
    (lambda f: (f / "records.jsonl").unlink(), ["damaged", "records.jsonl"]),
    (lambda f: (f / "records.jsonl").write_text((f / "records.jsonl").read_text()[:-5]), ["damaged", "cut off"]),
    (lambda f: (f / "records.jsonl").write_text(""), ["damaged", "cut off"]),
    (lambda f: (f / "records.jsonl").write_text((f / "records.jsonl").read_text() * 2), ["damaged", "not those of the manifest"]),
    (lambda f: (f / "records.jsonl").write_bytes(b"\xff\xfe\n"), ["damaged"]),
    (lambda f: (f / "records.jsonl").write_text("[]\n"), ["damaged"]),
    (lambda f: (f / "context.json").write_text("{"), ["damaged", "context.json"]),
    (lambda f: edit(f / "context.json", lambda c: c["program"].update(build_id="other")), ["damaged", "another program"]),
    (lambda f: edit(f / "context.json", lambda c: c.pop("machine")), ["damaged", "machine"]),
    (lambda f: edit(f / "context.json", lambda c: c.update(started=7)), ["damaged", "started"]),
    (lambda f: (f / "provenance.json").unlink(), ["damaged", "provenance.json"]),
    (lambda f: edit(f / "provenance.json", lambda p: p.update(family="other")), ["damaged", "another family"]),
    (lambda f: shutil.rmtree(f), ["not submitted"]),
    (lambda f: (shutil.rmtree(f), f.write_text("a file")), ["damaged"])])
def test_a_damaged_result_is_named_and_not_merged(damage: Callable[[Path], Any], words: list[str], finished: Path) -> None:
    family = manifest(finished)["families"][1]
    damage(finished / "slurm/families" / family["id"])
    said = NOWHERE.merge(finished, "--no-report")
    assert said.code == 3 and "Traceback" not in said.stderr, said.stderr
    (line,) = [line for line in said.stdout.splitlines() if line.startswith("missing: ")]
    assert family["id"][:8] in line and all(word in line for word in words), line
    assert len(records(finished)) == manifest_points(finished) - len(family["points"])
    assert NOWHERE.status(finished).code == 3


def manifest_points(out: Path) -> int:
    return sum(len(family["points"]) for family in manifest(out)["families"])


def test_a_failed_point_is_merged_and_named(finished: Path) -> None:
    family = manifest(finished)["families"][2]
    path = finished / "slurm/families" / family["id"] / "records.jsonl"
    lines = json_lines(path)
    lines[0] |= {"status": "failed", "reason": "a timed frame differs", "samples_ms": []}
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    said = NOWHERE.merge(finished, "--no-report")
    assert said.code == 3 and f"{lines[0]['name']}: a timed frame differs" in said.stdout
    assert [r["status"] for r in records(finished)].count("failed") == 1
    assert json.loads((finished / "context.json").read_text())["points"]["failed"] == 1


def test_nothing_is_there_yet(finished: Path) -> None:
    shutil.rmtree(finished / "slurm/families")
    said = NOWHERE.merge(finished)
    assert said.code == 3 and said.stdout.count("not submitted") == 3 and not (finished / "records.jsonl").exists()
    assert "0 of" in NOWHERE.status(finished, "--quiet").stdout


def test_a_report_that_cannot_be_drawn_is_said(finished: Path, tmp_path: Path) -> None:
    (finished / "figures").write_text("in the way")
    said = NOWHERE.merge(finished)
    assert said.code == 1 and "the records are merged, but the report was not drawn" in said.stderr and records(finished)


def test_a_report_that_fails_does_not_hide_what_is_missing(finished: Path) -> None:
    (finished / "figures").write_text("in the way")
    shutil.rmtree(finished / "slurm/families" / manifest(finished)["families"][0]["id"])
    said = NOWHERE.merge(finished)
    assert said.code == 3 and "report was not drawn" in said.stderr.splitlines()[-1]
    assert [line for line in said.stderr.splitlines() if "incomplete: 1 of 3" in line]


def test_ctrl_c_is_one_line(study: Path, tmp_path: Path) -> None:
    """A program that never answers, so that there is time to interrupt."""
    slow = tmp_path / "slow"
    slow.write_text("#!/bin/sh\ntouch started\nexec sleep 60\n")
    slow.chmod(0o755)
    process = subprocess.Popen([ROOT / "slurm/submit", study, "--out", tmp_path / "out", "--dry-run", "--cpus", "4", "--program", slow],
                               cwd=tmp_path, env=NOWHERE.environment(), stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                               start_new_session=True)
    while not (tmp_path / "started").exists():
        assert process.poll() is None
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130 and errors.startswith("slurm/submit: interrupted") and "Traceback" not in errors


# Parts.

@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The package of slurm/, for what no throw-away cluster shows."""
    monkeypatch.syspath_prepend(str(ROOT / "slurm"))
    import jobs.cluster
    import jobs.folder
    import jobs.merge
    return jobs


@pytest.mark.parametrize("text, indices", [("3", [3]), ("0-2,5%4", [0, 1, 2, 5]), ("7,9", [7, 9]), ("", []), ("N/A", [])])
def test_indices_of_an_array(text: str, indices: list[int], jobs: Any) -> None:
    assert jobs.cluster._indices(text) == indices


def test_where_there_is_accounting_it_says_how_jobs_ended(jobs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tests' clusters have no slurmdbd: this sacct prints what one prints."""
    (tmp_path / "sacct").write_text("#!/bin/sh\necho '7_0|TIMEOUT'\necho '7_1|CANCELLED by 1000'\necho '7_2|NODE_FAIL'\n")
    (tmp_path / "sacct").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    elements = [jobs.folder.Element(1, 7, index) for index in range(4)]
    assert {str(e): state for e, state in jobs.cluster.ended(elements).items()} == {
        "7_0": "TIMEOUT", "7_1": "CANCELLED", "7_2": "NODE_FAIL"}


def test_types_of_nodes(jobs: Any) -> None:
    machine = {"cpu": "A", "cores": 8, "packages": 1, "cpus_online": 8, "numa_nodes": 1, "smt": False, "caches": [], "memory_bytes": 64 * 2**30}
    almost, other, more = machine | {"memory_bytes": 64 * 2**30 - 2**20}, machine | {"cpu": "B"}, machine | {"memory_bytes": 128 * 2**30}
    names = jobs.merge.type_names([machine, almost, other, more])
    assert sorted(names.values()) == ["A, 8 cores in 1 packages", "A, 8 cores in 1 packages (type 2)", "B, 8 cores in 1 packages"]
    assert jobs.merge.type_key(machine) == jobs.merge.type_key(almost) != jobs.merge.type_key(more)
    assert jobs.merge.joined([1, 1]) == 1 and jobs.merge.joined(["a", "b", "a"]) == "differs between nodes: a; b"
    assert jobs.merge.highest_load(["0.5 1 1", "3.25 1 1", "unavailable"]) == "3.25 1 1"


# Scripts.

@pytest.mark.parametrize("script", SCRIPTS)
def test_scripts_may_be_run(script: str) -> None:
    assert os.access(ROOT / "slurm" / script, os.X_OK) == (script != "scaling.sbatch")


@pytest.mark.skipif(shutil.which("shellcheck") is None, reason="no shellcheck: scripts/setup installs it")
def test_shell_scripts_are_clean() -> None:
    files = [ROOT / "slurm" / name for name in SCRIPTS[3:]] + sorted((ROOT / "slurm/sites").glob("*.sh"))
    done = subprocess.run(["shellcheck", *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
