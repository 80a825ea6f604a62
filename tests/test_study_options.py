"""Options of `study`: plans, filters, shards, folders, and Google Benchmark's own."""

from __future__ import annotations

import csv
import io
import json
import os
from pathlib import Path
from typing import Any

import pytest

from .program import CPUS, Outcome, json_lines, read_png, read_ppm, records, refused, run, sampling, snapshot, sweep, write_study

TINY = [sampling(), sweep(["tile_parallel", "triangle_atomics"], ["serial", "openmp:dynamic,4", "openmp:static"], threads=[1, CPUS])]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_study(tmp_path / "tiny.toml", 'name = "tiny"', *TINY)
    return tmp_path


def study(folder: Path, *options: object, file: str = "tiny.toml") -> Outcome:
    return run("study", file, *options, cwd=folder)


def listed(folder: Path, *options: object) -> list[str]:
    return study(folder, "--list", *options).ok().stdout.splitlines()


# Plans.

@pytest.mark.parametrize("option", ["--list", "--dry-run", "--benchmark_list_tests", "--benchmark_list_tests=true"])
def test_plans_run_and_write_nothing(option: str, folder: Path) -> None:
    before = snapshot(folder)
    outcome = study(folder, option).ok()
    assert outcome.stderr == "" and snapshot(folder) == before
    assert outcome.stdout.startswith("teapot:triangles=300/64x48/tile_parallel/f32/closed/clip/serial/1\n")


def test_list_is_what_the_records_are_named(folder: Path) -> None:
    study(folder, "--out", "out").ok()
    names = [r["name"] for r in records(folder / "out")]
    assert names == listed(folder) == study(folder, "--benchmark_list_tests").ok().stdout.splitlines()
    assert len(names) == (10 if CPUS > 1 else 6)


def test_dry_run_says_what_is_skipped(folder: Path) -> None:
    write_study(folder / "s.toml", sampling(launches=3), sweep(["triangle_atomics", "row_parallel"], "serial", numeric=["f32", "f64"]))
    lines = study(folder, "--dry-run", file="s.toml").ok().stdout.splitlines()
    assert [line.split("/")[2] for line in lines if "skipped: " in line] == ["triangle_atomics"]
    assert any("4 points, 3 to run, 1 skipped; 3 runner processes" in line for line in lines)


def test_chunks_multiply_only_schedules_that_take_one(folder: Path) -> None:
    write_study(folder / "s.toml", sweep("row_parallel", ["serial", "openmp:auto", "openmp:static", "openmp:guided,8"], chunk=["default", 2], threads=1))
    executions = [line.split("/")[6] for line in study(folder, "--list", file="s.toml").ok().stdout.splitlines()]
    assert executions == ["serial", "openmp:auto", "openmp:static", "openmp:static,2", "openmp:guided,8"]


def test_points_of_two_sweeps_are_taken_once(folder: Path) -> None:
    write_study(folder / "s.toml", *[sweep("row_parallel", ["serial", "openmp:static"], threads=[1, 1])] * 2)
    assert len(study(folder, "--list", file="s.toml").ok().stdout.splitlines()) == 2


def test_threads_by_word(folder: Path) -> None:
    def threads(value: object) -> list[int]:
        write_study(folder / "s.toml", sweep("row_parallel", "openmp:static", threads=value))
        return [int(line.split("/")[7]) for line in study(folder, "--list", file="s.toml").ok().stdout.splitlines()]

    assert threads("max") == [CPUS]
    assert threads("1..max")[0] == 1 and threads("1..max")[-1] == CPUS and threads(["max", 1]) == list(dict.fromkeys([CPUS, 1]))


def test_filter_and_its_negation_part_the_points(folder: Path) -> None:
    every = listed(folder)
    kept, dropped = listed(folder, "--filter", "atomics.*openmp"), listed(folder, "--filter", "-atomics.*openmp")
    assert kept and dropped and sorted(kept + dropped) == sorted(every)
    assert all("atomics" in name and "openmp" in name for name in kept)
    assert listed(folder, "--benchmark_filter=atomics.*openmp") == kept
    assert listed(folder, "--benchmark_filter=-atomics.*openmp") == dropped


FOUR = ("--size", "64x48", "--size", "48x64", "--size", "32x32", "--size", "9x7")  # comparisons


@pytest.mark.parametrize("shards", [2, 3, 4])
def test_shards_part_the_points_and_keep_comparisons_whole(shards: int, folder: Path) -> None:
    parts = [listed(folder, *FOUR, "--shard", f"{i}/{shards}") for i in range(1, shards + 1)]
    assert all(parts)
    assert sorted(name for part in parts for name in part) == sorted(listed(folder, *FOUR))
    sizes = [{name.split("/")[1] for name in part} for part in parts]
    assert sum(map(len, sizes)) == len(set().union(*sizes)) == 4


def test_more_shards_than_comparisons_are_refused(folder: Path) -> None:
    refused(study(folder, *FOUR, "--shard", "5/5"), "--shard", "4 comparisons")


def test_a_shard_is_recorded(folder: Path) -> None:
    study(folder, *FOUR, "--out", "out", "--shard", "2/3").ok()
    assert json.loads((folder / "out/context.json").read_text())["study"]["shard"] == "2/3"
    assert [r["name"] for r in records(folder / "out")] == listed(folder, *FOUR, "--shard", "2/3")


# Families, for job arrays.

def plan(folder: Path, *options: object) -> dict[str, Any]:
    return json.loads(study(folder, "--list", "--json", *options).ok().stdout)


def test_families_are_the_whole_study_with_the_ids_of_its_records(folder: Path) -> None:
    planned = plan(folder, *FOUR)
    assert [f["shard"] for f in planned["families"]] == ["1/4", "2/4", "3/4", "4/4"]
    assert len({f["id"] for f in planned["families"]}) == 4
    assert sorted(p["name"] for f in planned["families"] for p in f["points"]) == sorted(listed(folder, *FOUR))
    second = planned["families"][1]
    study(folder, *FOUR, "--shard", "2/4", "--family", second["id"], "--out", "out").ok()
    assert [r["id"] for r in records(folder / "out")] == [p["id"] for p in second["points"]]
    assert second["threads"] == max(p["threads"] for p in second["points"])


def test_a_family_is_the_same_for_any_shard_and_another_for_other_sampling(folder: Path) -> None:
    planned = plan(folder, *FOUR)["families"]
    assert plan(folder, *FOUR, "--shard", "3/4")["families"] == [planned[2]]
    text = (folder / "tiny.toml").read_text()
    (folder / "tiny.toml").write_text(text.replace("max_samples = 6", "max_samples = 7"))
    others = plan(folder, *FOUR)["families"]
    assert [p["id"] for p in others[2]["points"]] == [p["id"] for p in planned[2]["points"]] and others[2]["id"] != planned[2]["id"]


def test_another_family_than_the_planned_one_is_refused(folder: Path) -> None:
    first, second = plan(folder, *FOUR)["families"][:2]
    refused(study(folder, *FOUR, "--shard", "2/4", "--family", first["id"], "--out", "out"), "--family", first["id"], second["id"])
    refused(study(folder, *FOUR, "--shard", "1/2", "--family", first["id"], "--out", "out"), "--family", "--shard I/4")
    assert not (folder / "out").exists()


def test_a_plan_for_more_cpus_is_refused_where_they_are_not(folder: Path) -> None:
    (folder / "tiny.toml").write_text(sampling() + sweep(execution="openmp:static", threads=["max"]))
    assert plan(folder, "--cpus", 300)["families"][0]["threads"] == 300
    refused(study(folder, "--cpus", 300, "--out", "out"), "--cpus", "300 threads", "--oversubscribe")
    refused(study(folder, "--isa", "mmx"), "--isa", "mmx", "avx2")
    assert not (folder / "out").exists()


# The folder.

def test_default_folder_is_named_after_the_study(folder: Path) -> None:
    study(folder, "--filter", "serial").ok()
    assert (folder / "results/tiny/records.jsonl").is_file()


@pytest.mark.parametrize("out", ["out", "out/", "deep/er/out", "./out"])
def test_a_study_is_never_overwritten_by_accident(out: str, folder: Path) -> None:
    study(folder, "--out", out, "--filter", "serial").ok()
    before = snapshot(folder)
    refused(study(folder, "--out", out, "--filter", "serial"), out.rstrip("/"), "--resume", "--replace")
    assert snapshot(folder) == before
    study(folder, "--out", out, "--filter", "static", "--replace").ok()
    at = (folder / out)
    previous = at.parent / (at.name + ".previous")
    old = {name: data for name, data in snapshot(previous).items()}
    assert old == {name: data for name, data in snapshot_of(before, at.relative_to(folder)).items()}
    assert all("static" in r["name"] for r in records(at))


def snapshot_of(whole: dict[str, bytes | None], folder: Path) -> dict[str, bytes | None]:
    return {str(Path(name).relative_to(folder)): data for name, data in whole.items() if Path(name).is_relative_to(folder) and Path(name) != folder}


def test_replace_deletes_nothing(folder: Path) -> None:
    (folder / "out.previous-2").mkdir()
    (folder / "out.previous-2/thesis.txt").write_text("precious")
    for kept in ("serial", "static", "dynamic"):
        study(folder, "--out", "out", "--filter", kept, "--replace").ok()
    for name, kept in (("out", "dynamic"), ("out.previous", "serial"), ("out.previous-3", "static")):
        assert kept in records(folder / name)[0]["name"]
    assert (folder / "out.previous-2/thesis.txt").read_text() == "precious"
    assert sorted(os.listdir(folder)) == ["out", "out.previous", "out.previous-2", "out.previous-3", "tiny.toml"]


def test_bad_input_does_not_replace(folder: Path) -> None:
    study(folder, "--out", "out", "--filter", "serial").ok()
    before = snapshot(folder)
    for options in (["--filter", "nothing like it"], ["--shard", "9"], ["--scene", "teapt"], ["--benchmark_bogus"]):
        refused(study(folder, "--out", "out", "--replace", *options))
    assert snapshot(folder) == before


def test_resume_of_a_finished_study_measures_nothing(folder: Path) -> None:
    study(folder, "--out", "out").ok()
    before = records(folder / "out")
    taken = [line for line in (folder / "out/journal.jsonl").read_text().splitlines() if '"sample"' in line]
    study(folder, "--out", "out", "--resume").ok()
    after = records(folder / "out")
    assert [line for line in (folder / "out/journal.jsonl").read_text().splitlines() if '"sample"' in line] == taken
    assert [{**r, "context": ""} for r in after] == [{**r, "context": ""} for r in before]


def test_resume_of_nothing_starts_a_study(folder: Path) -> None:
    study(folder, "--out", "out", "--resume", "--filter", "serial").ok()
    assert len(records(folder / "out")) == 2


@pytest.mark.parametrize("change, word", [
    (("64x48", "65x48"), "plan"), (('"triangle_atomics"', '"scanline"'), "plan"), (("triangles=300", "triangles=400"), "scenes"),
    (("max_samples = 6", "max_samples = 9"), "sampling"), (("[sampling]", "seed = 7\n[sampling]"), "sampling"), (('"tiny"', '"other"'), "study"),
], ids=lambda value: value[1].splitlines()[0] if isinstance(value, tuple) else "")
def test_resume_refuses_another_study(change: tuple[str, str], word: str, folder: Path) -> None:
    study(folder, "--out", "out").ok()
    (folder / "tiny.toml").write_text((folder / "tiny.toml").read_text().replace(*change))
    before = snapshot(folder)
    refused(study(folder, "--out", "out", "--resume"), "journal.jsonl:1: ", f"{word}: ", "--resume")
    assert snapshot(folder) == before


def test_resume_refuses_another_build(folder: Path) -> None:
    study(folder, "--out", "out", "--filter", "serial").ok()
    journal = folder / "out/journal.jsonl"
    build = json_lines(journal)[0]["build"]
    journal.write_text(journal.read_text().replace(build, build[::-1]))
    before = snapshot(folder)
    refused(study(folder, "--out", "out", "--filter", "serial", "--resume"), "journal.jsonl:1: ", "build: ")
    assert snapshot(folder) == before


@pytest.mark.parametrize("line, words", [("not JSON", [":3: ", "JSON"]), ('{"event": "sample"', [":3: ", "JSON"])])
def test_resume_refuses_a_damaged_journal(line: str, words: list[str], folder: Path) -> None:
    study(folder, "--out", "out", "--filter", "serial").ok()
    journal = folder / "out/journal.jsonl"
    rows = journal.read_text().splitlines()
    journal.write_text("\n".join([*rows[:2], line, *rows[3:]]) + "\n")
    refused(study(folder, "--out", "out", "--filter", "serial", "--resume"), "journal.jsonl", *words)


# Google Benchmark's options.

def test_repetitions_are_exact(folder: Path) -> None:
    study(folder, "--out", "out", "--benchmark_repetitions=7").ok()
    assert {len(r["samples_ms"]) for r in records(folder / "out")} == {7}


def test_benchmark_out_is_googles_json(folder: Path) -> None:
    write_study(folder / "s.toml", sampling(), sweep("row_parallel", ["serial", "openmp:static"], threads=1), sweep("null", "serial"))
    outcome = study(folder, "--out", "out", "--benchmark_out=x.json", file="s.toml")
    assert outcome.code == 1
    report = json.loads((folder / "x.json").read_text())
    assert {"date", "num_cpus", "library_build_type"} <= set(report["context"])
    for r in records(folder / "out"):
        mine = [b for b in report["benchmarks"] if b["run_name"] == r["name"]]
        if r["status"] != "ok":
            assert [b["error_occurred"] for b in mine] == [True] and r["reason"] in mine[0]["error_message"]
            continue
        iterations = [b for b in mine if b["run_type"] == "iteration"]
        assert [b["real_time"] for b in iterations] == pytest.approx(r["samples_ms"], rel=1e-9)
        assert [b["repetition_index"] for b in iterations] == list(range(6)) and {b["time_unit"] for b in mine} == {"ms"}
        assert {b["aggregate_name"]: b["real_time"] for b in mine if b["run_type"] == "aggregate"}["median"] == pytest.approx(r["median_ms"])


@pytest.mark.parametrize("form", ["json", "csv", "console"])
def test_benchmark_format_on_stdout(form: str, folder: Path) -> None:
    outcome = study(folder, "--out", "out", "--filter", "serial", f"--benchmark_format={form}").ok()
    if form == "json":
        assert len({b["run_name"] for b in json.loads(outcome.stdout)["benchmarks"]}) == 2
    elif form == "csv":
        table = outcome.stdout[outcome.stdout.index("name,"):]
        assert len({row["name"].removesuffix("_median") for row in csv.DictReader(io.StringIO(table)) if row["name"].endswith("_median")}) == 2
    else:
        assert "Benchmark" in outcome.stdout


@pytest.mark.parametrize("option", ["--benchmark_min_time=0.1", "--benchmark_time_unit=us", "--benchmark_perf_counters=CYCLES",
                                    "--benchmark_enable_random_interleaving=true", "--benchmark_counters_tabular=true"])
def test_other_options_pass_through(option: str, folder: Path) -> None:
    """They reach the library without harm: samples stay milliseconds, and one iteration each."""
    study(folder, "--out", "out", "--filter", "serial", option).ok()
    assert all(r["status"] == "ok" and 0 < r["median_ms"] < 1000 for r in records(folder / "out"))


def test_summary_on_stdout_names_every_point(folder: Path) -> None:
    write_study(folder / "s.toml", sampling(), sweep("row_parallel", "serial"), sweep("triangle_atomics", "serial", numeric="f64"), sweep("null", "serial"))
    outcome = study(folder, "--out", "out", file="s.toml")
    table = outcome.stdout.splitlines()
    for r, mark in zip(records(folder / "out"), ("max_samples", "skipped: ", "FAILED: ")):
        (row,) = [row for row in table if row.startswith(r["name"] + " ")]
        assert mark in row or mark == "max_samples"
    assert "3 planned, 1 run, 1 skipped, 1 failed" in outcome.stderr


def test_the_picture_of_a_study_is_that_of_render(folder: Path) -> None:
    study(folder, "--out", "out", "--filter", "serial").ok()
    run("render", "teapot:triangles=300", "--size", "64x48", "-o", folder / "x.ppm").ok()
    (picture,) = (folder / "out/images").iterdir()
    assert read_png(picture).tobytes() == read_ppm(folder / "x.ppm").tobytes()


def test_points_with_slow_frames_are_verified_and_skipped(tmp_path: Path) -> None:
    study = write_study(tmp_path / "slow.toml", sampling(6, frame_seconds=1e-9), sweep("scanline"))
    run("study", study, "--out", tmp_path / "out").ok()
    (record,) = records(tmp_path / "out")
    assert record["status"] == "skipped" and record["samples_ms"] == [] and record["verify"]["conforms"] is True
    assert "longer than the 1e-09 s of frame_seconds" in record["reason"]
    assert json.loads((tmp_path / "out/context.json").read_text())["study"]["sampling"]["frame_seconds"] == 1e-9
    run("study", write_study(tmp_path / "fast.toml", sampling(6, frame_seconds=60), sweep("scanline")), "--out", tmp_path / "fast").ok()
    assert [r["status"] for r in records(tmp_path / "fast")] == ["ok"]
