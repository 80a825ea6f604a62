"""slurm/ where the cluster or DIR misbehaves in ways that a throw-away cluster does not show: commands of SLURM that are scripts."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from .program import ROOT, TIMEOUT, Outcome, program, sampling, sweep, write_dat, write_study
from .slurm_cluster import families, manifest, one_line, submission, wait_for, without_slurm

COMMANDS = {
    "sbatch": """
        if [ -e "$FAKE/refuse" ] && [[ "$*" == *"$(cat "$FAKE/refuse")"* ]]; then echo 'sbatch: error: refused' >&2; exit 1; fi
        id=$(($(cat "$FAKE/last") + 1))
        echo $id >"$FAKE/last"
        for word; do case $word in --comment=*) echo "$id|${word#*=}" >>"$FAKE/jobs" ;; esac; done
        [ ! -e "$FAKE/slow" ] || sleep "$(cat "$FAKE/slow")"
        echo $id""",
    # All elements wait for ever.
    "squeue": """
        [ -z "${SQUEUE_STATES:-}" ] || exit 0
        case $* in
          *%k*) cat "$FAKE/jobs" ;;
          *%F_%K*) while IFS='|' read -r id comment; do for i in 0 1 2 3; do echo "${id}_$i|PENDING||Priority"; done; done <"$FAKE/jobs" ;;
          *%T*) echo RUNNING ;;
        esac""",
    "scontrol": """
        echo "$*" >>"$FAKE/scontrol"
        case $* in *config) echo "MaxArraySize = $(cat "$FAKE/size")" ;; "show job"*) cat "$FAKE/show" ;; esac""",
    "sinfo": "echo 1 16", "scancel": "", "sacct": "exit 1",
    "cmake": "echo 'nothing is to be built here' >&2; exit 1"}


@dataclass(frozen=True)
class Fake:
    folder: Path

    def environment(self, **variables: str) -> dict[str, str]:
        return without_slurm(FAKE=str(self.folder), PATH=f"{self.folder}/bin:{os.environ['PATH']}", **variables)

    def run(self, *words: object, cwd: Path | None = None, **variables: str) -> Outcome:
        done = subprocess.run(list(map(str, words)), cwd=cwd, env=self.environment(**variables), capture_output=True, text=True,
                              errors="surrogateescape", timeout=TIMEOUT, check=False)
        return Outcome(done.returncode, done.stdout, done.stderr)

    def submit(self, study: Path, out: Path, *options: object, cwd: Path | None = None, **variables: str) -> Outcome:
        return self.run(ROOT / "slurm/submit", study, "--out", out, *options, cwd=cwd, **variables)

    def queue(self) -> list[str]:
        return (self.folder / "jobs").read_text().splitlines()

    def set(self, name: str, value: object) -> None:
        (self.folder / name).write_text(str(value))


@pytest.fixture
def fake(tmp_path: Path) -> Fake:
    folder = tmp_path / "fake"
    (folder / "bin").mkdir(parents=True)
    for name, text in COMMANDS.items():
        (folder / "bin" / name).write_text(f"#!/bin/bash\n{text}\n")
        (folder / "bin" / name).chmod(0o755)
    for name, text in (("jobs", ""), ("last", "100"), ("size", "1001"), ("show", "")):
        (folder / name).write_text(text)
    return Fake(folder)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Two families of up to 4 threads."""
    (tmp_path / "studies").mkdir()
    return write_study(tmp_path / "studies/s.toml", 'name = "small"', sampling(),
                       sweep(execution=["serial", "openmp:static"], size=["64x48", "48x32"], threads=[1, 4]))


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


@pytest.fixture
def jobs(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(ROOT / "slurm"))
    import jobs.cluster
    import jobs.folder
    import jobs.states
    import jobs.submit
    return jobs


def other_build(path: Path) -> Path:
    """The program under test, as a build with another id."""
    path.write_text(f"#!/bin/sh\n'{program()}' \"$@\" | sed 's/\"build_id\": \"[^\"]*\"/\"build_id\": \"other\"/'\n")
    path.chmod(0o755)
    return path


def planned_families(study: Path) -> set[str]:
    """On the 16 CPUs that the cluster of commands says it has."""
    said = subprocess.run([program(), "study", study, "--list", "--json", "--cpus", "16"], capture_output=True, text=True, check=True)
    return {family["id"] for family in json.loads(said.stdout)["families"]}


# Submitted once, and no more.

@pytest.mark.parametrize("variable", ["SQUEUE_STATES", "SQUEUE_PARTITION", "SINFO_PARTITION", "SACCT_FORMAT", "SCONTROL_ALL",
                                      "SCANCEL_STATE", "SBATCH_ACCOUNT", "SRUN_CPU_BIND", "SLURM_JOB_ID"])
def test_options_of_the_environment_reach_no_command(variable: str, jobs: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(variable, "PENDING")
    assert variable not in jobs.cluster.environment()


def test_what_is_queued_is_seen_whatever_squeue_is_told(fake: Fake, study: Path, out: Path) -> None:
    fake.submit(study, out, "--program", program()).ok()
    again = fake.submit(study, out, SQUEUE_STATES="RUNNING").ok()
    assert "what is missing is in the queue" in again.stdout and len(fake.queue()) == 2


def test_a_slow_sbatch_is_not_asked_twice(fake: Fake, study: Path, out: Path, jobs: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in fake.environment().items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(jobs.cluster, "TIMEOUT_S", 1)
    fake.set("slow", 2)
    assert jobs.submit.main([str(study), "--out", str(out), "--program", str(program())]) == 0
    assert [array["job"] for array in submission(out, 1)["arrays"]] == [101] and submission(out, 1)["merge"] == 102


def test_a_job_of_a_submit_that_died_is_found(fake: Fake, study: Path, out: Path) -> None:
    fake.submit(study, out, "--program", program()).ok()
    path = out / "slurm/submissions/1/submission.json"
    record = json.loads(path.read_text())
    record["arrays"][0]["job"] = record["merge"] = None
    path.write_text(json.dumps(record))
    assert "what is missing is in the queue" in fake.submit(study, out).ok().stdout
    assert submission(out, 1)["arrays"][0]["job"] == 101 and submission(out, 1)["merge"] == 102 and len(fake.queue()) == 2


def test_status_and_a_dry_run_know_the_job_of_a_submit_that_died(fake: Fake, study: Path, out: Path) -> None:
    """And write nothing: that is for submit, which holds the lock."""
    fake.submit(study, out, "--program", program()).ok()
    path = out / "slurm/submissions/1/submission.json"
    record = json.loads(path.read_text())
    record["arrays"][0]["job"] = None
    path.write_text(json.dumps(record))
    said = fake.run(ROOT / "slurm/status", out)
    assert said.code == 3 and "job 101_0: Priority" in said.stdout and "2 pending, 0 failed, 0 missing" in said.stdout
    assert "families: 0 done, 0 running, 2 pending" in fake.submit(study, out, "--dry-run").ok().stdout
    assert json.loads(path.read_text()) == record
    fake.set("jobs", "")
    assert "not submitted" in fake.run(ROOT / "slurm/status", out).stdout


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_no_signal_comes_between_a_job_and_its_id(number: signal.Signals, fake: Fake, study: Path, out: Path) -> None:
    fake.set("slow", 1)
    process = subprocess.Popen([ROOT / "slurm/submit", study, "--out", out, "--program", program()], env=fake.environment(),
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    wait_for(fake.queue, "sbatch")
    os.killpg(process.pid, number)  # as Ctrl-C in a terminal, sbatch too
    assert process.wait(timeout=TIMEOUT) != 0
    assert submission(out, 1)["arrays"][0]["job"] == 101


def test_a_merge_job_that_was_refused_is_submitted_later(fake: Fake, study: Path, out: Path) -> None:
    fake.set("refuse", "small-merge")
    one_line(fake.submit(study, out, "--program", program()), "slurm/submit", 1, ["refused"])
    (fake.folder / "refuse").unlink()
    assert "submitted merge of submission 1" in fake.submit(study, out).ok().stdout
    assert submission(out, 1)["merge"] == 102
    fake.submit(study, out).ok()
    assert len(fake.queue()) == 2, "the merge was submitted twice"


def test_a_failed_result_stays_where_sbatch_refuses(fake: Fake, study: Path, out: Path) -> None:
    fake.submit(study, out, "--program", program()).ok()
    fake.set("jobs", "")
    family = manifest(out)["families"][0]["id"]
    (out / "slurm/families" / family).mkdir(parents=True)
    fake.set("refuse", "--array")
    assert fake.submit(study, out).code == 1 and families(out) == [family]
    (fake.folder / "refuse").unlink()
    fake.submit(study, out).ok()
    assert families(out) == [f"{family}.damaged-1"]


# One DIR, one plan.

def test_to_resume_is_to_go_on_with_the_same_program(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    fake.submit(study, out, "--program", other_build(tmp_path / "other")).ok()
    fake.set("jobs", "")
    fake.submit(study, out).ok()  # cmake would fail
    assert manifest(out)["build_id"] == "other"
    assert f"program={out}/slurm/programs/other/rasterbench\n" in (out / "slurm/submissions/2/plan.sh").read_text()
    one_line(fake.submit(study, out, "--rebuild"), "slurm/submit", 1, ["nothing is to be built here"])


def test_another_plan_is_refused(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    fake.submit(study, out, "--cpus", 4, "--program", program()).ok()
    fake.set("jobs", "")
    before = (out / "slurm/manifest.json").read_bytes()
    one_line(fake.submit(study, out, "--cpus", 8), "slurm/submit", 2, ["--cpus 4", "--cpus 8", "--replan"])
    one_line(fake.submit(study, out, "--filter", "64x48"), "slurm/submit", 2, ["--filter", "choose another --out or --replan"])
    text = study.read_text()
    study.write_text(text.replace("48x32", "32x24"))
    one_line(fake.submit(study, out), "slurm/submit", 2, ["another text", "--replan"])
    study.write_text(text)
    stale = out / "slurm/families" / ("0" * 32)
    stale.mkdir(parents=True)
    one_line(fake.submit(study, out, "--dry-run"), "slurm/submit", 2, ["1 results", "--replan"])
    assert (out / "slurm/manifest.json").read_bytes() == before and fake.queue() == []
    said = fake.submit(study, out, "--cpus", 8, "--replan", "--program", program()).ok()
    assert families(out) == [f"{stale.name}.replanned-1"] and stale.name in said.stdout and manifest(out)["cpus"] == 8
    assert fake.submit(study, out, "--cpus", 8).code == 0


def test_jobs_of_an_earlier_plan_are_not_left_in_the_queue(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    """Of another study text, and of another program whose families have the same names."""
    fake.submit(study, out, "--program", program()).ok()
    before, text = (out / "slurm/manifest.json").read_bytes(), study.read_text()
    words = ["2 jobs of an earlier plan", "0 of them running", "scancel 101"]
    for options in (["--replan", "--dry-run"], ["--replan"], []):  # no result is there yet: a program alone needs no --replan
        one_line(fake.submit(study, out, *options, "--program", other_build(tmp_path / "other")), "slurm/submit", 2, words)
    study.write_text(text.replace("64x48", "32x24"))
    line = one_line(fake.submit(study, out, "--replan", "--program", program()), "slurm/submit", 2, ["1 jobs", "scancel '101_["])
    (stale,) = {family["id"] for family in json.loads(before)["families"]} - planned_families(study)
    index = next(number for number, family, _ in map(str.split, (out / "slurm/submissions/1/c4.tasks").read_text().splitlines())
                 if family == stale)
    assert line.endswith(f"scancel '101_[{index}]'"), "what both plans have may go on"
    assert (out / "slurm/manifest.json").read_bytes() == before and len(fake.queue()) == 2 and not (out / "slurm/submissions/2").exists()
    fake.set("jobs", "")
    fake.submit(study, out, "--replan", "--program", program()).ok()
    assert (out / "slurm/manifest.json").read_bytes() != before and len(fake.queue()) == 2


def test_records_of_an_earlier_plan_are_set_aside(fake: Fake, study: Path, out: Path) -> None:
    fake.submit(study, out, "--program", program()).ok()
    for name in ("records.jsonl", "context.json"):
        (out / name).write_text("old")
    said = fake.run(ROOT / "slurm/merge", out, "--no-report")
    assert said.code == 3 and "records.stale-1.jsonl" in said.stdout
    assert not (out / "records.jsonl").exists() and (out / "context.stale-1.json").read_text() == "old"


def test_the_study_is_frozen(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    """With a model that lies beside it, for which a copy looks elsewhere."""
    write_dat(study.parent / "one.dat", [[0, 0, 0, 1, 0, 0, 0, 1, 0]])
    write_study(study, 'name = "small"', sampling(), sweep(scene=["one.dat", "teapot:triangles=300"]))
    text = study.read_text()
    fake.submit(study, out, "--program", program(), cwd=tmp_path).ok()
    study.write_text("")
    copy = out / "slurm/submissions/1/study/s.toml"
    assert f"study={copy}\n" in (out / "slurm/submissions/1/plan.sh").read_text() and copy.read_text() == text
    said = fake.run(program(), "study", copy, "--list", "--json", *manifest(out)["options"]).ok()
    assert [f["id"] for f in json.loads(said.stdout)["families"]] == [f["id"] for f in manifest(out)["families"]]


def test_a_study_that_cannot_be_copied_is_read_where_it_is(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    write_dat(tmp_path / "one.dat", [[0, 0, 0, 1, 0, 0, 0, 1, 0]])
    write_study(study, 'name = "small"', sampling(), sweep(scene="../one.dat"))
    said = fake.submit(study, out, "--program", program()).ok()
    assert "do not edit it" in said.stderr and f"study={study}\n" in (out / "slurm/submissions/1/plan.sh").read_text()


# Names and numbers.

def test_percent_signs_and_backslashes_in_dir(fake: Fake, study: Path, tmp_path: Path) -> None:
    said = fake.submit(study, tmp_path / "50%j", "--dry-run", "--program", program()).ok()
    assert f"--output={tmp_path}/50%%j/slurm/logs/%A_%a.out" in said.stdout
    assert f"--output={tmp_path}/50%%j/slurm/logs/merge-%j.out" in said.stdout
    one_line(fake.submit(study, tmp_path / "a\\b", "--program", program()), "slurm/submit", 2, ["backslash"])
    one_line(fake.submit(study, Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff")), "--program", program()), "slurm/submit", 2, ["UTF-8"])
    one_line(fake.submit(study, ROOT, "--program", program()), "slurm/submit", 2, ["checkout"])
    assert fake.queue() == [] and not (ROOT / "slurm/.submit.lock").exists()


def test_a_program_is_a_file_and_not_a_word(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    shutil.copy(other_build(tmp_path / "other"), fake.folder / "bin/mine")
    shutil.copy(program(), tmp_path / "mine")
    fake.submit(study, out, "--program", "mine", cwd=tmp_path).ok()
    assert manifest(out)["build_id"] != "other"
    one_line(fake.submit(study, tmp_path / "out2", "--program", "/bin/true"), "slurm/submit", 2, ["/true", "rasterbench"])


def test_threads_beyond_a_node_reserve_the_node(fake: Fake, study: Path, out: Path) -> None:
    said = fake.submit(study, out, "--dry-run", "--program", program(), "--cpus", 2, "--oversubscribe").ok()
    assert "array c2: 2 elements of 2 CPUs" in said.stdout and "--cpus-per-task=4" not in said.stdout


def test_a_cluster_without_arrays(fake: Fake, study: Path, out: Path) -> None:
    fake.set("size", 0)
    one_line(fake.submit(study, out, "--program", program()), "slurm/submit", 1, ["MaxArraySize"])


@pytest.mark.parametrize("options, word", [
    (["--hold", "other.sh"], "other.sh"), (["--hold", "--", "other.sh"], "--"), (["-H", "other.sh"], "other.sh"), (["--arr=0-3"], "--array"),
    (["--outp", "x"], "--output"), (["-Hc1"], "-Hc1"), (["-B", "1"], "-B"), (["-k"], "-k"), (["-M", "x"], "-M"), (["--account"], "--account"),
    (["--nice", "5"], "5"), (["--comment=x"], "--comment"), (["--no-kill"], "--no-kill"), ([""], "''")])
def test_no_option_hides_a_script_or_another(options: list[str], word: str, fake: Fake, study: Path, out: Path) -> None:
    one_line(fake.submit(study, out, "--program", program(), "--", *options), "slurm/submit", 2, [word])
    assert fake.queue() == []


@pytest.mark.parametrize("options", [["-Ht10"], ["-t", "10", "--hold"], ["--nice=5", "-A", "me"], ["--time", "10", "--exclusive=user"]])
def test_options_that_are_the_users(options: list[str], fake: Fake, study: Path, out: Path, jobs: Any) -> None:
    said = fake.submit(study, out, "--dry-run", "--program", program(), "--", *options).ok()
    assert "warning" not in said.stderr and len(said.stdout.splitlines()) > 3


def test_memory_of_the_user_replaces_that_of_the_site(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    (tmp_path / "site.sh").write_text("sbatch_options=(--time=04:00:00 --mem-per-cpu 2000)\n")
    submit = [study, out, "--dry-run", "--program", program(), "--site", tmp_path / "site.sh"]
    assert "--mem-per-cpu" in fake.submit(*submit).ok().stdout
    said = fake.submit(*submit, "--", "--mem=16G").ok().stdout
    assert "--mem-per-cpu" not in said and " 2000 " not in said and "--time=04:00:00 --mem=16G" in said


def test_site_files(fake: Fake, study: Path, out: Path, tmp_path: Path) -> None:
    site = tmp_path / "site.sh"
    site.write_text("module() { false; }\nmodule load nothing\nsbatch_options=()\n")
    one_line(fake.submit(study, out, "--program", program(), "--site", site), "slurm/submit", 2, ["site.sh", "module load nothing"])
    site.write_text("[ -d /nowhere ] && echo x\nsbatch_options=()\n")
    fake.submit(study, out, "--dry-run", "--program", program(), "--site", site).ok()
    site.write_bytes(b"# \xff\n")
    one_line(fake.submit(study, out, "--program", program(), "--site", site), "slurm/submit", 2, ["site.sh", "UTF-8"])


@pytest.mark.parametrize("given, warned", [("2", True), ("4:59", True), ("5", False), ("0-00:03", True), ("1:00:00", False), ("1-0", False),
                                           ("0", False), ("00:04:00", True)])
def test_little_time_is_said(given: str, warned: bool, fake: Fake, study: Path, out: Path) -> None:
    said = fake.submit(study, out, "--dry-run", "--cpus", 4, "--program", program(), "--", f"--time={given}").ok()
    assert ("--time" in said.stderr) == warned


# What became of jobs.

def test_how_elements_ended_that_never_began(jobs: Any, fake: Fake, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", f"{fake.folder}/bin:{os.environ['PATH']}")
    monkeypatch.setenv("FAKE", str(fake.folder))
    elements = [jobs.folder.Element(1, 7, index) for index in range(4)]
    fake.set("show", "JobId=7 ArrayJobId=7 ArrayTaskId=4294967294 JobState=CANCELLED\n"
                     "JobId=9 ArrayJobId=7 ArrayTaskId=1 JobState=TIMEOUT\n")
    assert {e.index: s for e, s in jobs.cluster.ended(elements).items()} == {0: "CANCELLED", 1: "TIMEOUT", 2: "CANCELLED", 3: "CANCELLED"}
    (fake.folder / "bin/sacct").write_text("#!/bin/sh\necho '7_[0-2%1]|CANCELLED by 1000'\necho '7_3|COMPLETED'\n")
    assert {e.index: s for e, s in jobs.cluster.ended(elements).items()} == {0: "CANCELLED", 1: "CANCELLED", 2: "CANCELLED", 3: "COMPLETED"}


def test_the_latest_attempt_is_not_that_of_the_fastest_clock(jobs: Any, out: Path) -> None:
    folder = out / "slurm/attempts/f"
    folder.mkdir(parents=True)
    for name, node in (("900.7_1.0", "first"), ("500.7_1.10", "eleventh"), ("700.7_1.9", "tenth"), ("999.7_11.12", "another")):
        (folder / f"{name}.json").write_text(json.dumps({"node": node}))
    where, _ = jobs.folder.Folder(out).last_attempt("f", jobs.folder.Element(1, 7, 1))
    assert where["node"] == "eleventh"
    assert jobs.folder.Folder(out).last_attempt("f", jobs.folder.Element(1, 8, 1)) is None


def test_a_damaged_dir_is_one_line(fake: Fake, study: Path, out: Path) -> None:
    fake.submit(study, out, "--program", program()).ok()
    (out / "slurm/submissions/²").mkdir()
    for command in ("status", "merge"):
        assert fake.run(ROOT / "slurm" / command, out).code == 3
    for name, text, word in (("submission.json", "{}", "arrays"), ("submission.json", '{"arrays": [{"tasks": "c4.tasks"}]}', "arrays"),
                             ("submission.json", '{"arrays": [7]}', "arrays"), ("c4.tasks", "0 x 1/2\n1 x\n", "c4.tasks:2"),
                             ("c4.tasks", "x y z\n", "c4.tasks:1")):
        path = out / "slurm/submissions/1" / name
        before = path.read_text()
        path.write_text(text)
        one_line(fake.run(ROOT / "slurm/status", out), "slurm/status", 2, [name, word])
        path.write_text(before)
    path.write_text("x\n")
    one_line(fake.run(ROOT / "slurm/merge", out), "slurm/merge", 2, ["c4.tasks:1"])
    one_line(fake.submit(study, out), "slurm/submit", 2, ["c4.tasks:1"])


# Scripts.

def submission_folder(folder: Path, program_text: str) -> Path:
    """What submit leaves for task and step, with a program that is a script."""
    (folder / "submission").mkdir(parents=True)
    (folder / "program").write_text(f"#!/bin/bash\n{program_text}\n")
    (folder / "program").chmod(0o755)
    (folder / "submission/site.sh").write_text("sbatch_options=()\n")
    (folder / "submission/plan.sh").write_text(f"dir={folder}/out\nstudy=s.toml\nprogram={folder}/program\ncwd={folder}\n"
                                               "scratch_name=x\noptions=()\n")
    (folder / "submission/c1.tasks").write_text("0 family 1/1\n")
    shutil.copy(ROOT / "slurm/step", folder / "submission/step")
    return folder / "submission"


JOB = {"SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": "0", "SLURM_JOB_ID": "7", "SLURM_CPUS_PER_TASK": "1", "SLURMD_NODENAME": "n1"}
SAYS_HOW_IT_ENDS = ("trap 'echo \"rasterbench: interrupted; continue with --resume\" >&2; exit 130' TERM\necho begun >&2\ntouch begun\n"
                    "while :; do sleep 0.05; done")


def only(folder: Path, pattern: str) -> Path:
    (path,) = folder.glob(pattern)
    return path


@pytest.mark.parametrize("srun, said", [
    ('exec "${@:7}"', "interrupted; continue with --resume"),
    # One whose program hangs: srun gets TERM, which ends all of the step.
    ('attempt=${@: -1}; mkdir -p "${attempt%/*}"; touch begun; exec sleep 100', "killed: it did not end within 1 s of TERM")])
def test_term_ends_the_program_and_requeues(srun: str, said: str, fake: Fake, tmp_path: Path) -> None:
    """Also where the submitter's environment would let squeue say nothing."""
    folder = submission_folder(tmp_path / "job", SAYS_HOW_IT_ENDS)
    (fake.folder / "bin/srun").write_text(f"#!/bin/bash\ntrap 'exit 1' TERM # and kills\n{srun}\n")
    (fake.folder / "bin/srun").chmod(0o755)
    task = tmp_path / "task"
    task.write_text((ROOT / "slurm/task").read_text().replace("end_s=60", "end_s=1" if "sleep 100" in srun else "end_s=20"))
    process = subprocess.Popen(["bash", task, folder, "c1.tasks"], env=fake.environment(SQUEUE_STATES="PENDING") | JOB, cwd=folder.parent,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    wait_for((folder.parent / "begun").exists, "the program")
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=TIMEOUT)
    lines = only(folder.parent / "out/slurm/attempts/family", "*.end").read_text().splitlines()
    assert process.returncode == 0 and lines[-1] == "requeued" and any(said in line for line in lines[:-1]), output
    assert "requeue 7_0" in (fake.folder / "scontrol").read_text()


def test_term_to_all_of_a_step_is_still_told(fake: Fake, tmp_path: Path) -> None:
    """As scancel and the end of the time send it; what a killed start of this job had half copied is removed."""
    folder = submission_folder(tmp_path / "job", SAYS_HOW_IT_ENDS)
    half = folder.parent / "out/slurm/families/.family.7.0"
    half.mkdir(parents=True)
    process = subprocess.Popen([folder / "step", folder, "family", "1/1", tmp_path / "attempt"], env=fake.environment() | JOB,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
    wait_for((folder.parent / "begun").exists, "the program")
    os.killpg(process.pid, signal.SIGTERM)
    output, _ = process.communicate(timeout=TIMEOUT)
    assert "exit code 130: rasterbench: interrupted" in (tmp_path / "attempt.end").read_text() and "begun" in output
    assert not half.exists() and not (tmp_path / "attempt.pid").exists()


def test_a_site_file_that_fails_in_a_job_ends_it(fake: Fake, tmp_path: Path) -> None:
    folder = submission_folder(tmp_path / "job", "true")
    (folder / "site.sh").write_text("module() { false; }\nmodule load nothing\nsbatch_options=()\n")
    for words in (["task", folder, "c1.tasks"], ["merge-task", folder, ROOT, tmp_path]):
        done = fake.run(ROOT / "slurm" / words[0], *words[1:], **JOB)
        assert done.code == 1 and "fails near line 2: module load nothing" in done.stdout + done.stderr


def test_scaling_says_that_the_report_failed(fake: Fake, tmp_path: Path) -> None:
    """Also with a program outside the checkout."""
    (fake.folder / "bin/srun").write_text('#!/bin/bash\nenv >"$FAKE/env"\nmkdir -p "$FAKE/out"; echo "{}" >"$FAKE/out/records.jsonl"\n')
    (fake.folder / "bin/srun").chmod(0o755)
    words = ["bash", ROOT / "slurm/scaling.sbatch", "s.toml", fake.folder / "out"]
    variables = {"SLURM_CPUS_PER_TASK": "1", "SLURM_JOB_ID": "7", "RASTERBENCH": "/elsewhere/rasterbench", "TBB_MALLOC_USE_HUGE_PAGES": "1"}
    done = fake.run(*words, cwd=ROOT, **variables)
    assert done.code == 1 and "but the report was not drawn" in done.stderr and "TBB_" not in (fake.folder / "env").read_text()
    (fake.folder / "env").unlink()
    done = fake.run(*words, cwd=tmp_path, **variables)
    assert done.code == 2 and "top of the checkout" in done.stderr and not (fake.folder / "env").exists()


def test_folders_that_local_refuses(tmp_path: Path) -> None:
    def refused(*words: object) -> None:
        done = subprocess.run([ROOT / "slurm/local", *map(str, words)], cwd=tmp_path, capture_output=True, text=True, timeout=TIMEOUT, check=False)
        assert done.returncode == 2 and done.stderr.startswith("slurm/local: "), done.stderr
        assert list(tmp_path.iterdir()) == []

    for folder in ("-x", "--nodes", "", "/", "/..", "//"):
        refused("status", folder)  # the least that it may do wrong, should it not refuse
    refused("stop", tmp_path / "none/at all")
