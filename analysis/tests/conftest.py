from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterator

import pytest

from .. import load, report, style
from ..comparison import Analysis
from . import synthetic

FEW = [("openmp", "static", None), ("openmp", "dynamic", 1), ("tbb", "auto", None)]


@pytest.fixture(scope="session", autouse=True)
def quick_fonts() -> Iterator[int]:
    """Gives what kind of fonts PDFs have, which is another one in tests that do not ask for `published_fonts`: to subset TrueType fonts
    takes a third of the time in which a report is drawn. The programs that tests/ runs embed the published kind."""
    kind = style.RC["pdf.fonttype"]
    style.RC["pdf.fonttype"] = 3
    yield kind
    style.RC["pdf.fonttype"] = kind


@pytest.fixture
def published_fonts(quick_fonts: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(style.RC, "pdf.fonttype", quick_fonts)


@pytest.fixture
def study(tmp_path: Path) -> Callable[..., Path]:
    """Writes a small synthetic study; the names of Plan's fields change it."""
    def make(**changes: Any) -> Path:
        standard = dict(kernels=["bounding_box", "triangle_atomics", "tile_parallel", "scanline"], schedules=FEW, threads=[1, 2],
                        scenes={"teapot": synthetic.SCENES["teapot"]})
        return synthetic.write(tmp_path / "study", synthetic.plan(**(standard | changes)))

    return make


def analyse(directory: Path) -> Analysis:
    return Analysis(load.load(directory))


@pytest.fixture(scope="session")
def full(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Analysis, report.Written]:
    """The report of a whole study, made once: eight kernels, two scenes, all schedules, three thread counts."""
    directory = synthetic.write(tmp_path_factory.mktemp("full"))
    analysis = analyse(directory)
    return directory, analysis, report.write(analysis)
