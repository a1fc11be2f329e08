"""Polygons that the scene contract cannot say, cut into triangles: bent ones, concave ones, and those with odd uv."""

from __future__ import annotations

import numpy as np

from notabug.meshes.files import RawMesh
from notabug.scenes_usd.scene import Floats

FLAT = 2.5e-7  # of the face's diameter: well within what the reader calls flat
ROUNDED = 2.0**-23  # of the largest coordinate: float32


def cut(mesh: RawMesh, *, bent: bool = False) -> RawMesh:
    """``mesh`` with every face of more than three corners cut that is bent or concave, or has uv and five corners.

    ``bent`` keeps quads whole that are not flat.
    """
    counts: list[int] = []
    chosen: list[int] = []  # corner numbers of ``mesh``
    first = 0
    for n in mesh.counts.tolist():
        points = mesh.points[mesh.corners[first : first + n]]
        if n > 3 and not _is_plain(points, has_uv=mesh.uv is not None, bent=bent and n == 4):
            parts = clipped(points)
            counts += [3] * len(parts)
            chosen += [first + k for part in parts for k in part]
        else:
            counts.append(n)
            chosen += range(first, first + n)
        first += n
    at = np.array(chosen, np.int64)
    return RawMesh(
        points=mesh.points,
        counts=np.array(counts, np.int32),
        corners=np.ascontiguousarray(mesh.corners[at]),
        normals=None if mesh.normals is None else mesh.normals[at],
        uv=None if mesh.uv is None else mesh.uv[at],
    )


def _is_plain(points: Floats, *, has_uv: bool, bent: bool) -> bool:
    """Whether the polygon ``points`` (n, 3) is flat, strictly convex, and has few enough corners for any uv.

    One that may be ``bent`` need not be flat.
    """
    if has_uv and len(points) > 4:
        return False
    normal, turns = _turns(points)
    size = float(np.ptp(points, axis=0).max())
    if not normal.any() or not size:
        return False
    height = float(np.abs((points - points.mean(axis=0)) @ normal).max())
    flat = bent or height <= FLAT * size + ROUNDED * float(np.abs(points).max())
    return bool(flat and (turns > 1e-4).all() and turns.sum() < 2.5 * np.pi)


def _turns(points: Floats) -> tuple[Floats, Floats]:
    """The unit normal of the polygon (Newell), zero where it has no area, and the angle it turns by at each corner."""
    centred = points - points.mean(axis=0)
    normal = np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 1e-30 else np.zeros(3)
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    sine = np.cross(before, after) @ normal
    return normal, np.arctan2(sine, (before * after).sum(axis=1))


def clipped(points: Floats) -> list[tuple[int, int, int]]:
    """The triangles that ear clipping (Meisters 1975) makes of a polygon (n, 3); a fan where nothing can be clipped."""
    normal, _ = _turns(points)
    axis = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(axis, normal) if normal.any() else np.array([1.0, 0.0, 0.0])
    v = np.cross(normal, u) if normal.any() else np.array([0.0, 1.0, 0.0])
    flat = np.stack([points @ u, points @ v], axis=1)
    left = list(range(len(points)))
    made = []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(flat, left, k)), 1)
        a, b, c = left[ear - 1], left[ear], left[(ear + 1) % len(left)]
        made.append((a, b, c))
        del left[ear]
    return [*made, (left[0], left[1], left[2])]


def _is_ear(flat: Floats, left: list[int], k: int) -> bool:
    a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
    if _side(flat[a], flat[b], flat[c]) <= 0.0:
        return False
    others = [each for each in left if each not in (a, b, c)]
    return not any(
        _side(flat[a], flat[b], flat[p]) >= 0.0
        and _side(flat[b], flat[c], flat[p]) >= 0.0
        and _side(flat[c], flat[a], flat[p]) >= 0.0
        for p in others
    )


def _side(a: Floats, b: Floats, p: Floats) -> float:
    return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))
