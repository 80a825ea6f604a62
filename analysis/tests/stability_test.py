"""Stability envelopes: breaking points of known sweeps, bad input in one line, and the files of the command."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import matplotlib.image
import pandas as pd
import pytest

from .. import __main__ as program
from .. import stability
from ..figures import envelopes as drawing
from ..load import InputError
from ..stability import SWEEPS, envelopes, read


def line(sweep="near_far", parameter=1.0, numeric="f32", wrong=0, drawn=100000, **more):
    return {"sweep": sweep, "parameter": parameter, "numeric": numeric, "pixels": 200000, "drawn": drawn, "wrong": wrong, "unexplained": 0,
            "worst_distance_px": 0.5, "max_depth_error_steps": None} | more


def write(tmp_path: Path, lines: list) -> Path:
    path = tmp_path / "stability.jsonl"
    path.write_text("".join((entry if isinstance(entry, str) else json.dumps(entry)) + "\n" for entry in lines))
    return path


def found(tmp_path, *counts, **more):
    """The envelope of one mode whose wrong pixels at 1, 10, 100, ... are these."""
    return envelopes(read(write(tmp_path, [line(parameter=10.0**i, wrong=n, **more) for i, n in enumerate(counts)])))[0]


@pytest.mark.parametrize("counts, held, breaks", [
    ((0, 0, 100, 101, 5000), (1, 100), [1000]),  # exactly 1e-3 still holds
    ((5000, 200, 100, 0), (100, 1000), [10]),  # small parameters are the hard ones
    ((900, 0, 0, 0, 900), (10, 1000), [1, 10000]),  # both ends
    ((0, 900, 0, 0, 900), (100, 1000), [10, 10000]),  # the longest run counts
    ((0, 0, 0), (1, 100), []),
    ((900, 900), None, [1])])
def test_breaking_points(tmp_path, counts, held, breaks):
    envelope = found(tmp_path, *counts)
    assert [s.parameter for s in envelope.breaks] == breaks
    assert (envelope.held[0].parameter, envelope.held[-1].parameter) == held if held else envelope.held == []


def test_the_input_is_not_written_over(tmp_path, capsys):
    path = write(tmp_path, [line()]).rename(tmp_path / "stability.json")
    before = path.read_bytes()
    assert program.main(["stability", str(path)]) == 2
    assert "stability.json: is read" in capsys.readouterr().err and path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["stability.json"]
    assert program.main(["stability", str(path), "-o", str(tmp_path / "out")]) == 0


def test_lines_may_come_in_any_order(tmp_path):
    path = write(tmp_path, [line(parameter=p, wrong=w) for p, w in ((100, 9000), (1, 0), (10, 0))])
    assert [s.parameter for s in envelopes(read(path))[0].breaks] == [100]


def test_the_caption_names_the_judges(tmp_path):
    path = write(tmp_path, [line(judge="truth"), line("image_size", 64.0, judge="oracle"), line("triangle_size", 1.0, judge="oracle")])
    caption = drawing.draw(envelopes(read(path))).caption
    assert "Judged by: truth (near and far planes); oracle (triangle size and image size)." in caption.body


def test_where_nothing_is_drawn(tmp_path):
    """An object that vanished is wrong everywhere; a picture without an object tells nothing."""
    assert [s.parameter for s in found(tmp_path, 0, 40, drawn=0).breaks] == [10]
    empty = found(tmp_path, 0, 0, drawn=0)
    assert not empty.breaks and all(s.share is None for s in empty.samples)


def test_table_names_every_mode_of_every_sweep(tmp_path):
    path = write(tmp_path, [line(sweep, p, mode, wrong=w, unexplained=w // 2) for sweep in SWEEPS for mode in ("f32", "f64")
                            for p, w in ((0.5, 0), (65535, 0 if mode == "f64" else 400))])
    made = stability.table(envelopes(read(path)))
    assert len(made.numbers) == 2 * len(SWEEPS)
    row = made.numbers.set_index(["sweep", "mode"]).loc[("image_size", "f32")]
    assert (row.holds_to, row.breaks_above_at, row.wrong_above, row.unexplained) == (0.5, 65535, 400, 200)
    assert row.largest_share == pytest.approx(0.004) and pd.isna(row.breaks_below_at)
    words = made.words.set_index(["sweep", "mode"])
    assert words.loc[("Image size", "f32"), "breaks at"] == "65,535 (400 of 100,000 px)"
    assert words.loc[("Image size", "f64"), "breaks at"] == "not in this range"
    assert made.tex().count("\\\\") == 2 * len(SWEEPS) + 1


@pytest.mark.parametrize("spoil, field", [
    (lambda v: v.update(sweep="colour"), "sweep"), (lambda v: v.pop("sweep"), "sweep"), (lambda v: v.update(sweep=["near_far"]), "sweep"),
    (lambda v: v.update(parameter=0), "parameter"), (lambda v: v.update(parameter="ten"), "parameter"), (lambda v: v.pop("numeric"), "numeric"),
    (lambda v: v.update(wrong=-1), "wrong"), (lambda v: v.update(wrong=1.5), "wrong"), (lambda v: v.update(wrong=200001), "wrong"),
    (lambda v: v.pop("drawn"), "drawn"), (lambda v: v.update(worst_distance_px="far"), "worst_distance_px"), (lambda v: v.update(wrong=0), "parameter")])
def test_bad_fields_are_named(tmp_path, capsys, spoil, field):
    bad = line(wrong=3)
    spoil(bad)
    path = write(tmp_path, [line(), bad if field != "parameter" or bad["parameter"] != 1.0 else line()])
    assert program.main(["stability", str(path), "-o", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and f"stability.jsonl:2: {field}:" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("content, part", [("", "no samples"), ("{", "not JSON"), ("[1]", "expected an object"),
                                           (json.dumps(line()).replace("1.0", "NaN"), "NaN")])
def test_bad_files(tmp_path, content, part):
    with pytest.raises(InputError, match=part):
        read(write(tmp_path, [content]))


def test_missing_file(tmp_path, capsys):
    assert program.main(["stability", str(tmp_path / "none.jsonl")]) == 2
    assert "none.jsonl: no such file" in capsys.readouterr().err


@pytest.mark.parametrize("sweeps, modes", [(list(SWEEPS), 14), (["near_far"], 2), (["near_far", "image_size", "translation"], 25)])
def test_command_writes_a_figure_and_a_table(tmp_path, capsys, sweeps, modes):
    lines = [line(sweep, 10.0**k, f"mode_{m}", wrong=max(0, 10 ** (k - m // 3) - 1) % 100000) for sweep in sweeps for m in range(modes)
             for k in range(5)]
    assert program.main(["stability", str(write(tmp_path, lines)), "-o", str(tmp_path / "out")]) == 0
    out, err = capsys.readouterr()
    assert err == "" and "breaks at" in out and out.count("mode_1") >= len(sweeps)
    folder = tmp_path / "out"
    ElementTree.parse(folder / "stability.svg")
    assert (folder / "stability.pdf").read_bytes().startswith(b"%PDF")
    assert len(pd.read_csv(folder / "stability.csv")) == len(sweeps) * modes
    image = matplotlib.image.imread(folder / "stability.png")
    assert image.shape[1] <= 1100 and image.shape[0] <= 1500
    for edge in (image[:2], image[-2:], image[:, :2], image[:, -2:]):
        assert edge[..., :3].min() > 0.99
