"""The scenes as they were drawn: what the numbers are about."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Iterator

import matplotlib.image
import numpy as np

from .. import captions, style, text
from ..comparison import Analysis
from ..load import Record
from .common import Drawing

COLUMNS, NARROWEST = 3, 2.0  # pictures beside each other, and inches of one
MAX_PIXELS = 640  # a thumbnail: the report stays light enough to mail


def draw(analysis: Analysis) -> Iterator[Drawing]:
    images = _images(analysis)
    if not images:
        return
    columns = min(style.panels_across(COLUMNS, NARROWEST), len(images))
    rows = math.ceil(len(images) / columns)
    gap, label = 0.12, 0.48
    width = min(3.2, (style.page_width() - gap * (columns + 1)) / columns)
    tallest = max(image.shape[0] / image.shape[1] for image in images.values())
    height = min(width * tallest, 3.2)
    total = rows * (height + label + gap) + gap
    figure = style.new_figure(columns * (width + gap) + gap, total)
    for i, (scene, image) in enumerate(images.items()):
        row, column = divmod(i, columns)
        axes = style.place(figure, gap + column * (width + gap), total - (row + 1) * (height + label + gap), width, height)
        axes.imshow(image, interpolation="nearest", cmap="gray", vmin=0, vmax=1 if image.dtype.kind == "f" else 255)
        axes.set_anchor("NW")  # pictures of several shapes keep their titles on one line
        axes.set_xticks([])
        axes.set_yticks([])
        for spine in axes.spines.values():
            spine.set(visible=True, color="#BBBBBB")
        fits = min(8.5, 8.5 * width / max(0.1, style.text_width([scene], 8.5, bold=True)))
        axes.set_title(scene, loc="left", weight="bold", pad=20, fontsize=max(5.0, fits), wrap=True)
        axes.text(0, 1.02, _facts(analysis, scene), transform=axes.transAxes, fontsize=7, va="bottom", linespacing=1.15)
    caption = captions.build(
        analysis, "The scenes", "What each scene asks of a rasterizer: many small triangles, few large ones, much overdraw.",
        [], estimates=None, notes=[_sentence(analysis, scene) for scene in images])
    yield Drawing("scenes", "The scenes", figure, caption, raster=True)


def _images(analysis: Analysis) -> dict[str, np.ndarray]:
    directory = analysis.study.directory.resolve()
    images = {}
    for scene, name in analysis.study.context["images"].items():
        path = (directory / str(name)).resolve()
        if not path.is_relative_to(directory) or not path.is_file():
            continue  # checks.py says so in the report
        try:
            image = matplotlib.image.imread(Path(path))
        except (OSError, ValueError, SyntaxError):
            continue
        step = max(1, math.ceil(max(image.shape[:2]) / MAX_PIXELS))
        images[str(scene)] = image[::step, ::step]
    return images


def _record(analysis: Analysis, scene: str) -> Record | None:
    """A record that says how much work the scene is: the largest of its sizes."""
    records = [r for r in analysis.study.every_record if r.config.scene == scene and r.work]
    return max(records, key=lambda r: r.config.size[0] * r.config.size[1], default=None)


def _parts(analysis: Analysis, scene: str) -> tuple[str, str, str]:
    record = _record(analysis, scene)
    if record is None:
        return "", "", ""
    triangles, covered = record.work.get("triangles"), record.work.get("covered_pixels")
    size = f"{record.config.size[0]}x{record.config.size[1]} px"
    many = f"{triangles:,} triangles" if isinstance(triangles, int) else ""
    pixels = record.config.size[0] * record.config.size[1]
    cover = f"{covered:,} px covered ({text.percent(covered / pixels)})" if isinstance(covered, int) else ""
    return many, size, cover


def _facts(analysis: Analysis, scene: str) -> str:
    many, size, cover = _parts(analysis, scene)
    return ", ".join(x for x in (many, size) if x) + ("\n" + cover if cover else "")


def _sentence(analysis: Analysis, scene: str) -> str:
    facts = ", ".join(x for x in _parts(analysis, scene) if x)
    return f"{scene}: {facts or 'no counts recorded'}."
