"""Studies that are stopped in the middle: by Ctrl-C, by a kill of either process, by a full disk, by a second study."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections import Counter
from pathlib import Path
from typing import Callable, Iterator

import pytest

from .program import TIMEOUT, Outcome, command, environment, events, json_lines, records, refused, run, sampling, snapshot, sweep, write_study

SAMPLES = 40
POINTS = 6


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study of some seconds: POINTS x SAMPLES samples of some milliseconds."""
    write_study(tmp_path / "s.toml", sampling(SAMPLES), sweep(["tile_parallel", "triangle_atomics", "scanline"], ["serial", "openmp:dynamic"],
                                                              scene="teapot:triangles=5000", size="480x360", threads=1))
    return tmp_path


def wait_for(condition: Callable[[], bool], what: str, seconds: float = TIMEOUT / 2) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.002)


@contextlib.contextmanager
def started(folder: Path, *options: object, file: str = "s.toml", out: str = "out") -> Iterator[subprocess.Popen[bytes]]:
    """A study in a session of its own, as a shell would start it; never left running."""
    process = subprocess.Popen(command("study", file, "--out", out, *options), cwd=folder, env=environment(), start_new_session=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def ended(process: subprocess.Popen[bytes]) -> Outcome:
    stdout, stderr = process.communicate(timeout=TIMEOUT)
    return Outcome(process.returncode, stdout.decode(), stderr.decode())


def complete_lines(folder: Path) -> list[str]:
    journal = folder / "out/journal.jsonl"
    return journal.read_text().split("\n")[:-1] if journal.exists() else []


def samples(folder: Path) -> list[str]:
    return [line for line in complete_lines(folder) if line.startswith('{"event":"sample"')]


def until_sampling(folder: Path, process: subprocess.Popen[bytes], at_least: int = 20) -> None:
    wait_for(lambda: len(samples(folder)) >= at_least or process.poll() is not None, f"{at_least} samples")
    assert process.poll() is None and not (folder / "out/records.jsonl").exists(), "the study ended before it could be interrupted"


def children(pid: int) -> list[int]:
    """Processes that are not dead and whose parent is `pid`."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, parent = stat.read_text().rpartition(")")[2].split()[:2]
            if int(parent) == pid and state not in "ZX":
                found.append(int(stat.parent.name))
    return found


def alive(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    return False


def assert_resumes(folder: Path, before: list[str], out: str = "out") -> None:
    """--resume keeps every line, takes what is missing and nothing twice."""
    outcome = run("study", "s.toml", "--out", out, "--resume", cwd=folder).ok()
    after = (folder / out / "journal.jsonl").read_text().splitlines()
    assert after[:len(before)] == before
    taken = Counter((e["id"], e["block"]) for e in events(folder / out, "sample"))
    assert set(taken.values()) == {1}
    assert len(taken) == POINTS * SAMPLES
    verified = Counter(e["id"] for e in events(folder / out, "verify"))
    assert set(verified.values()) == {1} and len(verified) == POINTS
    finished = records(folder / out)
    assert [r["status"] for r in finished] == ["ok"] * POINTS
    assert all(r["blocks"] == list(range(SAMPLES)) for r in finished)
    assert f"{POINTS} planned, {POINTS} run" in outcome.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "TERM"])
def test_interrupted_study_resumes_and_repeats_nothing(number: signal.Signals, folder: Path) -> None:
    with started(folder) as process:
        until_sampling(folder, process)
        runners = children(process.pid)
        os.killpg(process.pid, number)  # a terminal signals the whole group
        outcome = ended(process)
    assert outcome.code not in (0, 2) and outcome.stdout == ""
    (line,) = [line for line in outcome.errors if not line.startswith(("verifying: ", "bandwidth: ", "sampling: "))]
    assert line.startswith("rasterbench: ") and "interrupted" in line and "--resume" in line and "out/journal.jsonl" in line
    assert runners and not any(map(alive, runners))
    before = complete_lines(folder)
    assert (folder / "out/journal.jsonl").read_text() == "\n".join(before) + "\n"
    assert 20 <= len(samples(folder)) < POINTS * SAMPLES
    assert not (folder / "out/records.jsonl").exists() and not (folder / "out/context.json").exists()
    assert_resumes(folder, before)


def test_interrupted_while_verifying(tmp_path: Path) -> None:
    write_study(tmp_path / "s.toml", sampling(), sweep("triangle_locks", "serial", scene="teapot:triangles=100000",
                                                       size=["1500x1000", "1501x1000", "1502x1000"]))
    with started(tmp_path) as process:
        wait_for(lambda: bool(complete_lines(tmp_path)), "the journal")
        process.send_signal(signal.SIGINT)
        outcome = ended(process)
    assert outcome.code == 1 and "interrupted" in outcome.errors[-1]
    assert not (tmp_path / "out/records.jsonl").exists() and not samples(tmp_path)


def test_twice_interrupted(folder: Path) -> None:
    before: list[str] = []
    for at_least in (20, 120):
        with started(folder, *["--resume"] * bool(before)) as process:
            until_sampling(folder, process, at_least)
            process.send_signal(signal.SIGINT)
            assert ended(process).code == 1
        assert complete_lines(folder)[:len(before)] == before
        before = complete_lines(folder)
    assert_resumes(folder, before)


def test_killed_coordinator_leaves_no_process_and_resumes(folder: Path) -> None:
    with started(folder) as process:
        until_sampling(folder, process)
        runners = children(process.pid)
        process.kill()
        assert ended(process).code == -signal.SIGKILL
    assert runners
    wait_for(lambda: not any(map(alive, runners)), "the end of the runners", seconds=10)
    before = complete_lines(folder)
    with (folder / "out/journal.jsonl").open("a") as journal:  # what a power cut leaves of the next line
        journal.write('{"event":"sample","block":')
    assert_resumes(folder, before)


@pytest.mark.parametrize("content", ["", '{"event":"sta'], ids=["empty", "half a line"])
def test_killed_before_the_first_line(content: str, folder: Path) -> None:
    """Nothing was measured yet: --resume starts the study."""
    (folder / "out").mkdir()
    (folder / "out/journal.jsonl").write_text(content)
    assert_resumes(folder, [])


def test_killed_runner_fails_its_point_only(folder: Path) -> None:
    with started(folder) as process:
        until_sampling(folder, process)
        (runner,) = children(process.pid)
        os.kill(runner, signal.SIGKILL)
        outcome = ended(process)
    assert outcome.code == 1
    failed = [r for r in records(folder / "out") if r["status"] != "ok"]
    assert [r["status"] for r in failed] == ["failed"] and "signal 9" in failed[0]["reason"]
    assert failed[0]["samples_ms"] == [] and failed[0]["median_ms"] is None
    assert [len(r["samples_ms"]) for r in records(folder / "out") if r["status"] == "ok"] == [SAMPLES] * (POINTS - 1)
    assert sum(f"FAILED {failed[0]['name']}: " in line for line in outcome.errors) == 1


def test_killed_runners_of_several_environments(tmp_path: Path) -> None:
    """One runs and one is paused when they die; each fails the point that it is asked for next, and the study goes on."""
    write_study(tmp_path / "s.toml", sampling(SAMPLES), sweep(["tile_parallel", "row_parallel", "scanline"], "openmp:dynamic", scene="teapot:triangles=5000",
                                                              size="480x360", threads=1, binding=["none", "close"]))
    with started(tmp_path) as process:
        until_sampling(tmp_path, process)
        runners = children(process.pid)
        assert len(runners) == 2
        for runner in runners:
            os.kill(runner, signal.SIGKILL)
        assert ended(process).code == 1
    status = Counter((r["config"]["binding"], r["status"]) for r in records(tmp_path / "out"))
    assert status == {("none", "ok"): 2, ("none", "failed"): 1, ("close", "ok"): 2, ("close", "failed"): 1}


@pytest.mark.parametrize("options, words", [([], ["another study"]), (["--resume"], ["another study"]), (["--replace"], ["another study"])],
                         ids=["plain", "resume", "replace"])
def test_second_study_in_the_same_folder_is_refused(options: list[str], words: list[str], folder: Path) -> None:
    with started(folder) as process:
        until_sampling(folder, process)
        process.send_signal(signal.SIGSTOP)  # so that nothing changes while it is compared
        before = snapshot(folder)
        try:
            refused(run("study", "s.toml", "--out", "out", *options, cwd=folder), "out", *words)
            assert snapshot(folder) == before
        finally:
            process.send_signal(signal.SIGCONT)
        assert ended(process).code == 0
    assert len(records(folder / "out")) == POINTS


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 64 KiB that can be made larger."""
    if os.geteuid() != 0:
        pytest.skip("only root may mount a small file system to fill")
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], capture_output=True, text=True, check=False)
    if mounted.returncode != 0:
        pytest.skip(f"this machine does not let a test mount a file system: {mounted.stderr.strip()}")
    yield disk
    subprocess.run(["umount", disk], check=True)


def test_full_disk_stops_the_study_and_spoils_nothing(small_disk: Path, folder: Path) -> None:
    (small_disk / "other.txt").write_text("precious")
    outcome = run("study", "s.toml", "--out", small_disk / "out", cwd=folder)
    assert outcome.code == 1 and outcome.stdout == ""
    (line,) = [line for line in outcome.errors if not line.startswith(("verifying: ", "bandwidth: ", "sampling: "))]
    assert "journal.jsonl" in line and "No space left" in line and "--resume" in line
    assert (small_disk / "other.txt").read_text() == "precious"
    assert not (small_disk / "out/records.jsonl").exists() and not (small_disk / "out/context.json").exists()
    text = (small_disk / "out/journal.jsonl").read_text()
    before = text[:text.rindex("\n")].splitlines()
    assert len(before) > POINTS
    subprocess.run(["mount", "-o", "remount,size=16m", small_disk], check=True)
    assert_resumes(folder, before, out=str(small_disk / "out"))


def test_full_disk_after_the_last_sample(small_disk: Path, folder: Path) -> None:
    """Room for the journal, but not for the report's picture and the records: nothing half-written, nothing measured is lost."""
    run("study", "s.toml", "--out", "out", "--filter", "serial", cwd=folder).ok()
    subprocess.run(["mount", "-o", "remount,size=256k", small_disk], check=True)
    (small_disk / "out").mkdir()
    (small_disk / "out/journal.jsonl").write_bytes((folder / "out/journal.jsonl").read_bytes())
    disk = os.statvfs(small_disk)
    (small_disk / "filler").write_bytes(b"x" * (disk.f_bavail * disk.f_frsize - 8192))
    arguments = ["study", "s.toml", "--out", small_disk / "out", "--filter", "serial", "--resume"]
    outcome = run(*arguments, cwd=folder)
    assert outcome.code != 0 and "No space left" in outcome.errors[-1]
    assert not (small_disk / "out/records.jsonl").exists()
    subprocess.run(["mount", "-o", "remount,size=16m", small_disk], check=True)
    run(*arguments, cwd=folder).ok()
    before, after = (([{**r, "context": ""} for r in records(out)]) for out in (folder / "out", small_disk / "out"))
    assert after == before


def test_a_picture_that_cannot_be_written_fails_no_point(folder: Path) -> None:
    """The report's picture is a side matter: what was measured stays valid."""
    arguments = ["study", "s.toml", "--out", "out", "--filter", "scanline.*serial"]
    run(*arguments, cwd=folder).ok()
    (picture,) = (folder / "out/images").iterdir()
    picture.unlink()
    picture.mkdir()
    run(*arguments, "--resume", cwd=folder)
    assert [r["status"] for r in records(folder / "out")] == ["ok"]


def test_the_journal_is_one_object_a_line(folder: Path) -> None:
    run("study", "s.toml", "--out", "out", "--filter", "scanline.*serial", cwd=folder).ok()
    kinds = [e["event"] for e in json_lines(folder / "out/journal.jsonl") if e["event"] != "noise"]  # of every half second
    assert kinds == ["start", "verify", "limit"] + ["sample"] * SAMPLES + ["stop"]
