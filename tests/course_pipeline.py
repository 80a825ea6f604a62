"""A second rasterizer of the course's pipeline, in double precision, written from its formulas alone.

View coordinates (u, v, w) with e_U, e_V, e_W of a camera at M that looks at the origin; clip at w = -n; project;
closed edges; the smallest (depth, id) wins. Slow and plain on purpose: nothing here is shared with the project.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .program import Parameters


@dataclass(frozen=True)
class Picture:
    ids: np.ndarray     # int, (H, W), -1 = background
    depths: np.ndarray  # float64, (H, W), 1 = background
    pieces: dict[int, list[np.ndarray]]  # by id: its screen triangles, (3, 3): x and y in pixels, d


def view(points: np.ndarray, camera: tuple[float, float, float]) -> np.ndarray:
    m = np.array(camera)
    mx, my, mz = m
    distance, ground = np.linalg.norm(m), np.hypot(mx, mz)
    if ground > 0:
        e_u = np.array([mz, 0, -mx]) / ground
        e_v = np.array([-mx * my, mz**2 + mx**2, -my * mz]) / (ground * distance)
    else:
        e_u, e_v = np.array([1.0, 0, 0]), np.array([0, 0, -np.sign(my)])
    return (points - m) @ np.column_stack([e_u, e_v, m / distance])


def clip_at_near(polygon: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """The part with -w >= n, and which of its corners lie on the near plane."""
    corners, on_plane = [], []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0)):
        a_in, b_in = -a[2] > near, -b[2] > near
        if a_in:
            corners.append(a)
            on_plane.append(False)
        if a_in != b_in:
            inside, outside = (a, b) if a_in else (b, a)
            t = (-near - inside[2]) / (outside[2] - inside[2])
            corners.append(inside + t * (outside - inside))
            on_plane.append(True)
    return np.array(corners), np.array(on_plane)


def project(corners: np.ndarray, on_plane: np.ndarray, p: Parameters) -> np.ndarray:
    """x and y in pixels (row 0 on top), and d."""
    s_y = 1 / np.tan(p.theta / 2)
    s_x = s_y / (p.width / p.height)
    n, f = p.near, p.far
    u, v, w = corners.T
    w = np.where(on_plane, -n, w)
    x, y = s_x * u / -w, s_y * v / -w
    d = np.where(on_plane, -1.0, ((n + f) / (n - f) * w + 2 * n * f / (n - f)) / -w)
    return np.column_stack([(x + 1) * p.width / 2, (1 - y) * p.height / 2, d])


def draw(triangles: np.ndarray, p: Parameters) -> Picture:
    picture = Picture(np.full((p.height, p.width), -1), np.ones((p.height, p.width)), {})
    for number, triangle in enumerate(triangles):
        corners, on_plane = clip_at_near(view(triangle, p.camera), p.near)
        if len(corners) < 3:
            continue
        screen = project(corners, on_plane, p)
        picture.pieces[number] = [screen[[0, k, k + 1]] for k in range(1, len(screen) - 1)]
        for piece in picture.pieces[number]:
            draw_piece(picture, number, piece)
    return picture


def draw_piece(picture: Picture, number: int, piece: np.ndarray) -> None:
    (xa, ya, da), (xb, yb, db), (xc, yc, dc) = piece
    area = (xb - xa) * (yc - ya) - (yb - ya) * (xc - xa)
    if area == 0:
        return
    height, width = picture.ids.shape
    low, high = piece[:, :2].min(axis=0), piece[:, :2].max(axis=0)
    x0, y0 = np.clip(np.floor(low), 0, [width, height]).astype(int)
    x1, y1 = np.clip(np.ceil(high), 0, [width, height]).astype(int)
    x, y = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
    alpha = ((xc - xb) * (y - yb) - (yc - yb) * (x - xb)) / area
    beta = ((xa - xc) * (y - yc) - (ya - yc) * (x - xc)) / area
    gamma = ((xb - xa) * (y - ya) - (yb - ya) * (x - xa)) / area
    d = alpha * da + beta * db + gamma * dc
    window = np.s_[y0:y1, x0:x1]
    wins = (alpha >= 0) & (beta >= 0) & (gamma >= 0) & (d < 1) & (d < picture.depths[window])
    picture.ids[window][wins] = number
    picture.depths[window][wins] = d[wins]


def distance_to_edges(piece: np.ndarray, x: float, y: float) -> float:
    """Pixels from a point to the nearest of a screen triangle's three sides."""
    point = np.array([x, y])
    best = np.inf
    for a, b in zip(piece[:, :2], np.roll(piece[:, :2], -1, axis=0)):
        length = (b - a) @ (b - a)
        t = np.clip((point - a) @ (b - a) / length, 0, 1) if length > 0 else 0.0
        best = min(best, float(np.linalg.norm(a + t * (b - a) - point)))
    return best


def unexplained(picture: Picture, ids: np.ndarray, depths: np.ndarray, tolerance: float, depth_gap: float) -> list[str]:
    """The pixels of another picture that differ and that neither an edge within `tolerance` pixels nor a depth gap excuses."""
    wrong = []
    for row, column in np.argwhere(picture.ids != ids):
        mine, theirs = int(picture.ids[row, column]), int(ids[row, column])
        pieces = [piece for number in {mine, theirs} - {-1} for piece in picture.pieces.get(number, [])]
        nearest = min((distance_to_edges(piece, column + 0.5, row + 0.5) for piece in pieces), default=np.inf)
        gap = abs(float(picture.depths[row, column]) - float(depths[row, column]))
        if nearest > tolerance and gap > depth_gap:
            wrong.append(f"row {row} column {column}: {mine} here, {theirs} there; {nearest:.3g} px from an edge, depths {gap:.3g} apart")
    return wrong


def shades(triangles: np.ndarray) -> np.ndarray:
    """s of each triangle: max(0, -n.L), n = AB x AC normalised, L = (-1, -1, -1)/sqrt(3)."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    return np.maximum(0, normal.sum(axis=1) / (np.where(length > 0, length, 1) * np.sqrt(3)))


def colours(ids: np.ndarray, triangles: np.ndarray, p: Parameters) -> np.ndarray:
    """uint8, (H, W, 3): trunc(s C) where a triangle is seen."""
    shaded = np.trunc(shades(triangles)[:, None] * np.array(p.object))
    return np.where(ids[..., None] >= 0, shaded[ids], np.array(p.background)).astype(np.uint8)
