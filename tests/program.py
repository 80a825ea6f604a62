"""Runs the built programs as a user would, and writes and reads their files without the project's code."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Sequence

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
CPUS = len(os.sched_getaffinity(0))
TIMEOUT = 120  # seconds: a hang fails the test, whatever else the machine does

# What would change the programs' threads, schedules or answers behind a test's back.
_SHED = ("OMP_", "GOMP_", "KMP_", "TBB_", "LD_PRELOAD", "MALLOC_", "LP_", "GALLIUM_", "MESA_", "LIBGL_")


def program(name: str = "rasterbench") -> Path:
    """A built program: of the folder RASTERBENCH_BIN, or of the release build."""
    folder = Path(os.environ.get("RASTERBENCH_BIN", ROOT / "build/release/bin"))
    path = folder.resolve() / name
    if not path.is_file():
        pytest.fail(f"{path} is missing: run scripts/setup, or let RASTERBENCH_BIN name the folder of the programs", pytrace=False)
    return path


def environment(**changes: str) -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if not name.startswith(_SHED)} | changes


@dataclass(frozen=True)
class Outcome:
    code: int
    stdout: str
    stderr: str

    @property
    def errors(self) -> list[str]:
        return self.stderr.splitlines()

    def ok(self) -> "Outcome":
        assert self.code == 0, f"exit code {self.code}: {self.stderr}"
        return self


def command(*arguments: object, name: str = "rasterbench") -> list[str]:
    return [str(program(name)), *map(str, arguments)]


def run(*arguments: object, name: str = "rasterbench", cwd: Path | None = None, **variables: str) -> Outcome:
    """Runs a program to its end; keywords in capitals are environment variables."""
    done = subprocess.run(command(*arguments, name=name), cwd=cwd, env=environment(**variables), capture_output=True,
                          timeout=TIMEOUT, check=False)
    return Outcome(done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace"))


def refused(outcome: Outcome, *words: str, name: str = "rasterbench") -> str:
    """Bad input: exit code 2, nothing on stdout and one line on stderr with all of `words`. Gives the line."""
    assert outcome.code == 2, f"exit code {outcome.code}: {outcome.stderr or outcome.stdout}"
    assert outcome.stdout == ""
    assert len(outcome.errors) == 1, f"not one line: {outcome.stderr!r}"
    line = outcome.errors[0]
    assert line.startswith(f"{name}: ")
    for word in words:
        assert word in line, f"{word!r} is not in {line!r}"
    return line


def snapshot(folder: Path) -> dict[str, bytes | None]:
    """Every file below `folder` with its bytes (None: not a plain file), to show that nothing was touched."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


# Files in.

def write_dat(path: Path, triangles: Any, count: int | None = None) -> Path:
    """T, then 9 float32 a triangle; `count` is the T that the file claims."""
    corners = np.asarray(triangles, dtype="<f4").reshape(-1, 9)
    path.write_bytes(struct.pack("<i", len(corners) if count is None else count) + corners.tobytes())
    return path


@dataclass(frozen=True)
class Parameters:
    """The 14 numbers of a scene parameter file, in its order."""
    object: tuple[int, int, int] = (200, 150, 100)
    background: tuple[int, int, int] = (10, 20, 30)
    camera: tuple[float, float, float] = (1.0, 2.0, 4.0)
    height: int = 48
    width: int = 64
    theta: float = 0.9
    near: float = 0.5
    far: float = 20.0

    def text(self) -> str:
        rows = [self.object, self.background, self.camera, (self.height, self.width), (self.theta,), (self.near, self.far)]
        return "".join(" ".join(map(repr, row)) + "\n" for row in rows)

    def write(self, path: Path) -> Path:
        path.write_text(self.text())
        return path


def read_parameters(path: Path) -> Parameters:
    t = path.read_text().split()
    whole, real = [int(x) for x in t[:6]], [float(x) for x in t[6:9]]
    return Parameters(tuple(whole[:3]), tuple(whole[3:]), tuple(real), int(t[9]), int(t[10]), *map(float, t[11:14]))


def read_dat(path: Path) -> np.ndarray:
    """float64, shape (T, 3 corners, 3)."""
    data = path.read_bytes()
    (count,) = struct.unpack_from("<i", data)
    assert len(data) == 4 + 36 * count
    return np.frombuffer(data, "<f4", offset=4).reshape(count, 3, 3).astype(float)


# Files out.

def read_ppm(path: Path) -> np.ndarray:
    """uint8, shape (H, W, 3)."""
    magic, size, largest, pixels = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert (magic, largest) == (b"P6", b"255")
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)


def read_png(path: Path) -> np.ndarray:
    """uint8, shape (H, W, 3), of an RGB8 PNG without interlacing; checks the CRC of every chunk."""
    data = path.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    chunks: dict[bytes, bytes] = {}
    at = 8
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        assert struct.unpack_from(">I", data, at + 8 + length)[0] == zlib.crc32(kind + body)
        chunks[kind] = chunks.get(kind, b"") + body
        at += 12 + length
    width, height, *form = struct.unpack(">IIBBBBB", chunks[b"IHDR"])
    assert form == [8, 2, 0, 0, 0]
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, 1 + 3 * width)
    image = np.zeros((height + 1, width + 1, 3), np.int64)  # one row above and one pixel to the left are 0
    for y, row in enumerate(rows):
        filtered = row[1:].reshape(width, 3)
        for x in range(width):
            left, above, corner = image[y + 1, x], image[y, x + 1], image[y, x]
            image[y + 1, x + 1] = (filtered[x] + _predicted(int(row[0]), left, above, corner)) % 256
    return image[1:, 1:].astype(np.uint8)


def _predicted(kind: int, left: np.ndarray, above: np.ndarray, corner: np.ndarray) -> np.ndarray:
    if kind == 4:  # Paeth
        distances = np.abs([above - corner, left - corner, left + above - 2 * corner])
        return np.choose(distances.argmin(axis=0), [left, above, corner])
    return [np.zeros_like(left), left, above, (left + above) // 2][kind]


# What a study writes.

def json_lines(path: Path) -> list[dict[str, Any]]:
    text = path.read_text()
    assert text.endswith("\n")
    return [json.loads(line) for line in text.splitlines()]


def records(folder: Path) -> list[dict[str, Any]]:
    return json_lines(folder / "records.jsonl")


def events(folder: Path, kind: str) -> list[dict[str, Any]]:
    return [event for event in json_lines(folder / "journal.jsonl") if event["event"] == kind]


def sampling(samples: int = 6, most: int | None = None, **more: object) -> str:
    """A [sampling] table that takes `samples` of each point (up to `most`, if its interval is wide)."""
    values = dict(target=1.0 if most else 1e-4, min_samples=samples, max_samples=most or samples, point_seconds=60) | more
    return "[sampling]\n" + "".join(f"{key} = {value}\n" for key, value in values.items())


def sweep(kernel: str | Sequence[str] = "tile_parallel", execution: str | Sequence[str] = "serial",
          scene: str = "teapot:triangles=300", size: str = "64x48", **axes: Any) -> str:
    """A [[sweep]] table; JSON's strings, numbers and lists are TOML's too."""
    values = dict(scene=scene, size=size, kernel=kernel, execution=execution) | axes
    values = {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}
    return "[[sweep]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())


def write_study(path: Path, *tables: str) -> Path:
    path.write_text("\n".join(tables))
    return path

