"""Places the names of points beside them: no name covers another, a point or an interval; a far one gets a leader line."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from .. import style

# All lengths are typographic points.
SIZE = 7.0
HEIGHT = 8.5  # of a line of text
DISTANCES = (5, 9, 14, 20, 27, 35, 44, 54, 65, 77, 90, 105, 122, 140)  # from the mark's centre
DIRECTIONS = 24
CLEAR = 5.0  # a leader line starts this far from the mark's centre
FAR = 11.0  # a name further from its mark than this has a leader line
# Costs beside the distance: an overlap is worse than any distance, a crossed leader worse than a long one.
TOUCH, OVERLAP, CROSSING, OUTSIDE = 40.0, 10.0, 25.0, 100.0
SWEEPS = 6  # every name is placed again, knowing the others; it settles after a few


@dataclass(frozen=True)
class Name:
    """A text for the point at x, y (data coordinates)."""

    x: float
    y: float
    words: str
    bold: bool = False


def candidates(point: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Boxes (left, bottom, right, top) round a point, each touching a circle with the side that faces the point."""
    distance = np.repeat(DISTANCES, DIRECTIONS).astype(float)
    angle = np.tile(2 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS, len(DISTANCES))
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    side = np.where(np.abs(way) < 0.3, 0.0, np.sign(way))
    centre = point + distance[:, None] * way + 0.5 * size * side
    return np.concatenate([centre - size / 2, centre + size / 2], axis=1)


def covering(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The cost of what each box covers."""
    area = overlaps(boxes, others)
    return TOUCH * (area > 0) + OVERLAP * area


def overlaps(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The area that each box shares with all others together."""
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    return np.prod(np.clip(high - low, 0, None), axis=2).sum(axis=1)


def nearest(point: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """The point of each box that is nearest to a mark: where its leader ends."""
    return np.clip(point, boxes[..., :2], boxes[..., 2:])


def through(starts: np.ndarray, ends: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Whether each leader line passes through each box, (lines, boxes), judged by nine places on it."""
    length = np.hypot(*(ends - starts).T)[:, None, None]
    share = CLEAR / np.maximum(length, CLEAR)
    steps = share + (1 - share) * np.linspace(0, 1, 9)[None, :, None]
    places = (starts[:, None] + steps * (ends - starts)[:, None])[:, :, None]
    return np.all((places > boxes[..., :2]) & (places < boxes[..., 2:]), axis=3).any(axis=1)


def crossings(point: np.ndarray, ends: np.ndarray, starts: np.ndarray, others: np.ndarray) -> np.ndarray:
    """How many of the lines from starts to others each line from the point to one of the ends crosses."""
    def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return np.sign((b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0]))

    end = ends[:, None]
    return ((side(point, end, starts) * side(point, end, others) < 0)
            & (side(starts, others, point) * side(starts, others, end) < 0)).sum(axis=1)


def place(points: np.ndarray, sizes: np.ndarray, obstacles: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Boxes for names of the given sizes at the given points, (n, 4). Greedy with repetition: each name takes the candidate
    of the least cost given the others."""
    boxes = [candidates(point, size) for point, size in zip(points, sizes)]
    ends = [nearest(point, mine) for point, mine in zip(points, boxes)]
    far = [np.hypot(*(end - point).T) > FAR for point, end in zip(points, ends)]
    fixed = []
    for i, point in enumerate(points):
        starts = np.broadcast_to(point, ends[i].shape)
        outside = np.clip(bounds[:2] - boxes[i][:, :2], 0, None).sum(axis=1) + np.clip(boxes[i][:, 2:] - bounds[2:], 0, None).sum(axis=1)
        fixed.append(np.hypot(*(ends[i] - point).T) + OUTSIDE * outside + covering(boxes[i], obstacles)
                     + CROSSING * far[i] * through(starts, ends[i], obstacles).sum(axis=1))
    chosen = [int(np.argmin(cost)) for cost in fixed]
    for _ in range(SWEEPS):
        before = list(chosen)
        for i, point in enumerate(points):
            others = [j for j in range(len(points)) if j != i]
            if not others:
                continue
            taken = np.array([boxes[j][chosen[j]] for j in others])
            led = [j for j in others if far[j][chosen[j]]]
            starts = np.broadcast_to(point, ends[i].shape)
            cost = fixed[i] + covering(boxes[i], taken) + CROSSING * far[i] * through(starts, ends[i], taken).sum(axis=1)
            if led:
                lines = points[led], np.array([ends[j][chosen[j]] for j in led])
                cost = cost + CROSSING * (through(*lines, boxes[i]).sum(axis=0) + far[i] * crossings(point, ends[i], *lines))
            chosen[i] = int(np.argmin(cost))
        if chosen == before:
            break
    return np.array([mine[c] for mine, c in zip(boxes, chosen)])


def draw(axes: Axes, names: list[Name], obstacles: np.ndarray) -> np.ndarray:
    """Writes the names clear of the obstacles, boxes (n, 4) in points from the figure's lower left corner. Returns the boxes
    of the names."""
    scale = 72 / axes.figure.dpi
    points = axes.transData.transform([(n.x, n.y) for n in names]) * scale
    sizes = np.array([(72 * style.text_width([n.words], SIZE, bold=n.bold) + 5, HEIGHT) for n in names])
    boxes = place(points, sizes, np.asarray(obstacles, dtype=float).reshape(-1, 4), axes.get_window_extent().extents * scale)
    for name, point, box in zip(names, points, boxes):
        end = nearest(point, box)
        if np.hypot(*(end - point)) > FAR:
            line = axes.transData.inverted().transform(np.array([point, end]) / scale)
            axes.plot(*line.T, color=style.GREY, lw=0.4, zorder=2.5)
        axes.annotate(name.words, (name.x, name.y), xytext=(box[:2] + box[2:]) / 2 - point, textcoords="offset points",
                      fontsize=SIZE, ha="center", va="center", weight="bold" if name.bold else "normal", zorder=6,
                      annotation_clip=False)
    return boxes
