"""The input contract: what is accepted, and that bad input is one line that names file, line and field."""

from __future__ import annotations

import json
import re

import pytest

from .. import __main__ as program
from .. import load


def rewrite(directory, line, change):
    path = directory / "records.jsonl"
    lines = path.read_text().splitlines()
    entry = json.loads(lines[line - 1])
    change(entry)
    lines[line - 1] = json.dumps(entry)
    path.write_text("\n".join(lines) + "\n")


def fails(capsys, directory, *parts):
    for command in ("report", "table"):
        assert program.main([command, str(directory)]) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and "Traceback" not in err
        for part in parts:
            assert part in err
    assert not (directory / "report.html").exists()


def test_missing_directory(tmp_path, capsys):
    fails(capsys, tmp_path / "nowhere", "nowhere", "no such folder")


@pytest.mark.parametrize("name", ["context.json", "records.jsonl"])
def test_missing_file(study, capsys, name):
    directory = study()
    (directory / name).unlink()
    fails(capsys, directory, name, "no such file")


def test_malformed_line(study, capsys):
    directory = study()
    path = directory / "records.jsonl"
    lines = path.read_text().splitlines()
    lines[3] = lines[3][:50]
    path.write_text("\n".join(lines))
    fails(capsys, directory, "records.jsonl:4", "not JSON")


@pytest.mark.parametrize("change, field", [
    (lambda r: r.pop("config"), "config"),
    (lambda r: r["config"].pop("kernel"), "config.kernel"),
    (lambda r: r["config"].update(size=[0, 4]), "config.size"),
    (lambda r: r["config"].update(threads="two"), "config.threads"),
    (lambda r: r.pop("samples_ms"), "samples_ms"),
    (lambda r: r.update(samples_ms=[]), "samples_ms"),
    (lambda r: r["samples_ms"].__setitem__(2, "fast"), "samples_ms"),
    (lambda r: r["samples_ms"].__setitem__(2, -1.0), "samples_ms"),
    (lambda r: r["blocks"].pop(), "blocks"),
    (lambda r: r["stages_ms"]["raster"].pop(), "stages_ms.raster"),
    (lambda r: r.pop("verify"), "verify"),
    (lambda r: r.update(status="fine"), "status"),
    (lambda r: r.update(status="failed"), "reason"),
    (lambda r: r.update(schema=2), "schema"),
    (lambda r: r.pop("schema"), "schema"),
    (lambda r: r.update(interval_ms=[1]), "interval_ms"),
    (lambda r: r.update(per_thread=[1, 2]), "per_thread"),
    (lambda r: r["verify"].update(oracle=3), "verify.oracle"),
    (lambda r: r["verify"]["oracle"].update(wrong="many"), "verify.oracle.wrong"),
    (lambda r: r["verify"].update(end_to_end={"wrong": -2}), "verify.end_to_end.wrong"),
])
def test_bad_field_is_named(study, capsys, change, field):
    directory = study()
    rewrite(directory, 1, change)
    fails(capsys, directory, "records.jsonl:1", field + ":")


def test_not_a_number_is_refused(study, capsys):
    directory = study()
    path = directory / "records.jsonl"
    path.write_text(re.sub(r'"samples_ms": \[[^,]+', '"samples_ms": [NaN', path.read_text(), count=1))
    fails(capsys, directory, "records.jsonl:1", "NaN")


def test_empty_records(study, capsys):
    directory = study()
    (directory / "records.jsonl").write_text("\n")
    fails(capsys, directory, "records.jsonl", "no records")


def test_doubled_record(study, capsys):
    directory = study()
    path = directory / "records.jsonl"
    path.write_text(path.read_text() + path.read_text().splitlines()[0] + "\n")
    fails(capsys, directory, "also on line 1", "id:")


@pytest.mark.parametrize("content, part", [("[]", "object"), ("{", "not JSON"), ('{"schema": 7}', "schema: is 7"), ('{"schema": 1}', "program: missing")])
def test_bad_context(study, capsys, content, part):
    directory = study()
    (directory / "context.json").write_text(content)
    fails(capsys, directory, "context.json", part)


def test_usage_is_one_line(capsys):
    for arguments in ([], ["draw"], ["report"], ["report", "x", "--colour"]):
        with pytest.raises(SystemExit) as stop:
            program.main(arguments)
        assert stop.value.code == 2
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("arguments", [["--help"], ["report", "--help"], ["table", "--help"], ["--version"]])
def test_help(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        program.main(arguments)
    assert stop.value.code == 0 and capsys.readouterr().out


def test_unknown_keys_are_tolerated(study):
    directory = study()
    rewrite(directory, 2, lambda r: (r.update(energy_joule=3), r["config"].update(colour="red"), r["stages_ms"].update(
        merge=[0.1] * len(r["samples_ms"]))))
    records = load.load(directory).records
    assert records[1].raw["energy_joule"] == 3 and "merge" in records[1].stages


def test_what_does_not_conform_has_no_speed(study):
    directory = study()
    rewrite(directory, 1, lambda r: r["verify"].update(conforms=False))
    record = load.load(directory).records[0]
    assert record.status == "failed" and record.samples is None and not record.stages


def test_frame_has_a_row_a_record(study):
    loaded = load.load(study())
    frame = loaded.frame()
    assert len(frame) == len(loaded.records)
    assert frame["status"].value_counts().to_dict() == {"ok": len(frame) - 2, "failed": 1, "skipped": 1}
    assert frame.loc[frame.status != "ok", "median_ms"].isna().all()
