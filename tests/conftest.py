"""Fixtures of the end-to-end tests."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from .program import CPUS, Parameters, read_dat, read_parameters, run, sampling, sweep, write_dat

if TYPE_CHECKING:
    from .studies import Study


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


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Only points that can run; 60 samples of each, so that there is a 95th percentile."""
    from .studies import Study  # late: it asks the program what it can do, which not every test needs

    return Study(tmp_path_factory.mktemp("good"), sampling(60),
                 sweep(["tile_parallel", "triangle_atomics", "scanline"], ["serial", "openmp:dynamic,4", "tbb:auto"], threads=[1, min(2, CPUS)]),
                 options=("--benchmark_context=a=b,site=here",))


@pytest.fixture(scope="session")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Points that run, fail and are skipped, in several environments."""
    from .studies import ISAS, Study

    many = ["openmp:dynamic", "tbb:auto"]
    return Study(tmp_path_factory.mktemp("mixed"), sampling(6, 8, point_seconds=5),
                 sweep(["tile_parallel", "triangle_atomics"], "serial", numeric=["f32", "f64", "fixed_8"], fill=["closed", "top-left"]),
                 sweep("all_pixels", "serial", scene="confetti:triangles=20000", size="1000x1000"),
                 sweep("row_parallel", "openmp:static", threads=[1, CPUS + 1]),
                 sweep("null", "serial"),
                 sweep("row_parallel", many, threads=1, binding=["close", "spread"]),
                 sweep("row_parallel", many, threads=1, wait_policy=["active", "passive"]),
                 sweep("row_parallel", many, threads=1, runtime="libomp"),
                 sweep("tile_parallel", "serial", near="off", tile=[16, 32]),
                 sweep("scanline", "serial", cache=["warm", "cold"]),
                 sweep("bounding_box", "serial", generality=["minimal", "full"]),
                 sweep(["tile_parallel", "tile_simd"], "serial", numeric="fixed_8", isa=ISAS),
                 sweep(["scanline", "fused_tiles"], "serial", numeric="fixed_8", techniques=["none", "huge_pages+fragments", "all-streaming", "all"]))


@pytest.fixture(params=["good", "mixed"])
def study(request: pytest.FixtureRequest) -> Study:
    return request.getfixturevalue(request.param)
