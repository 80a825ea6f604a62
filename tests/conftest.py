"""Fixtures of the end-to-end tests."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from .program import Parameters, read_dat, read_parameters, run, write_dat


@dataclass(frozen=True)
class SmallScene:
    """A generated scene as files, and what they hold."""
    dat: Path
    txt: Path
    triangles: np.ndarray
    parameters: Parameters


def _small(folder: Path, specification: str, width: int, height: int) -> SmallScene:
    dat, txt = folder / "small.dat", folder / "small.txt"
    run("scene", specification, "-o", dat, "--parameters", txt).ok()
    p = read_parameters(txt)
    p = Parameters(p.object, p.background, p.camera, height, width, p.theta, p.near, p.far)
    p.write(txt)
    return SmallScene(dat, txt, read_dat(dat), p)


@pytest.fixture(scope="session")
def teapot(tmp_path_factory: pytest.TempPathFactory) -> SmallScene:
    return _small(tmp_path_factory.mktemp("teapot"), "teapot:triangles=300", 97, 61)


@pytest.fixture(scope="session")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> SmallScene:
    """A camera inside a cloud of triangles: many cross its near plane, lie behind it or reach far beyond the picture."""
    folder = tmp_path_factory.mktemp("crossing")
    triangles = np.random.default_rng(7).uniform(-3, 3, (150, 3, 3)).astype("<f4")
    p = Parameters(camera=(0.5, 0.4, 0.8), height=61, width=97, theta=1.2, near=0.25, far=4.5)
    dat, txt = write_dat(folder / "crossing.dat", triangles), p.write(folder / "crossing.txt")
    return SmallScene(dat, txt, triangles.astype(float), p)
