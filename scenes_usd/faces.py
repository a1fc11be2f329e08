"""The shape of a mesh's faces: which are flat, convex, or mean a bilinear patch. One tolerance decides all.

Points come as float32, so no real quad is exactly flat, and no edge exactly straight. What counts is measured in the
frame of the mesh, where its points were authored and rounded: a transform of the prim changes no answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.once import once
from notabug.scenes_usd.scene import Floats, Mesh

FLAT = 1e-6  # of a face's diameter: by so much it may bend and is flat, by so much values may bend and are affine
ULPS = 4 * 2.0**-24  # of the largest coordinate: points, normals and uv are stored in float32

Bools = npt.NDArray[np.bool_]
Places = npt.NDArray[np.int64]

_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """What each face of a mesh is; arrays are (f,).

    Attributes
    ----------
    flat : its corners lie in a plane, within the tolerance.
    convex : seen along its normal, every corner turns the same way by more than the tolerance, once round.
    """

    flat: Bools
    convex: Bools


def rounding(corners: Floats) -> Floats:
    """By how much (m,) the float32 rounding of their points may move the corners of faces (m, n, 3)."""
    return np.asarray(ULPS * np.abs(corners).max(axis=(1, 2)))


def slack(corners: Floats) -> Floats:
    """The tolerance (m,), a length, by which faces (m, n, 3) may bend and count as flat, or turn and as straight."""
    centred = corners - corners.mean(axis=1, keepdims=True)
    return np.asarray(FLAT * _size(centred) + rounding(corners))


def local_points(mesh: Mesh) -> Floats:
    """The points (p, 3) of ``mesh`` in its own frame, where they were authored."""
    if np.array_equal(mesh.to_world, np.eye(4)):
        return mesh.points
    return np.asarray((mesh.points - mesh.to_world[3, :3]) @ np.linalg.inv(mesh.to_world[:3, :3]))


@once  # each mesh is asked about by the tracer and by several models
def shapes(mesh: Mesh) -> Shapes:
    """What the faces of ``mesh`` are; a triangle is flat and convex."""
    found = Shapes(np.ones(len(mesh.counts), np.bool_), np.ones(len(mesh.counts), np.bool_))
    if mesh.has_ngons:
        points = local_points(mesh)
        for faces, places in polygons(mesh):
            found.flat[faces], found.convex[faces] = _measure(points[mesh.corners[places]])
    return found


def patches(mesh: Mesh) -> Bools:
    """The faces (f,) that mean the bilinear patch of their corners: flat, strictly convex quads.

    Only theirs has an inverse that is unique. Every other face is its triangles.
    """
    found = shapes(mesh)
    return np.asarray((mesh.counts == 4) & found.flat & found.convex)


def polygons(mesh: Mesh) -> Iterator[tuple[Places, Places]]:
    """The faces of more than three corners, together where they have as many: (faces (m,), corners (m, n))."""
    starts = np.cumsum(mesh.counts, dtype=np.int64) - mesh.counts
    for n in sorted(set(mesh.counts[mesh.counts > 3].tolist())):
        faces = np.flatnonzero(mesh.counts == n)
        yield faces, starts[faces][:, None] + np.arange(n)


def normals_of(corners: Floats) -> tuple[Floats, Bools]:
    """The unit normals (m, 3) of faces (m, n, 3) by Newell's formula, and which faces (m,) have one.

    A face without area, or one that crosses itself so that its halves cancel, has none: (0, 0, 0).
    """
    centred = corners - corners.mean(axis=1, keepdims=True)
    newell = _cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1)  # twice the area along the normal
    length = np.linalg.norm(newell, axis=1)
    sound = length > slack(corners) * _size(centred)
    return newell / np.where(sound, length, np.inf)[:, None], sound


def are_affine(corners: Floats, values: Floats) -> Bools:
    """The faces (m,) whose corners' ``values`` (m, n, k) are an affine function in their plane: no cut moves them."""
    normal, sound = normals_of(corners)
    centred = corners - corners.mean(axis=1, keepdims=True)
    x, y = _axes(normal)
    unit = np.maximum(_size(centred), np.finfo(np.float64).tiny)[:, None]
    across, up = (np.einsum("mni,mi->mn", centred, axis) / unit for axis in (x, y))
    basis = np.stack([across, up, np.ones_like(across)], axis=2)
    fitted = basis @ (np.linalg.pinv(basis, rcond=FLAT) @ values)
    misfit = np.abs(fitted - values).max(axis=(1, 2))
    span = np.ptp(values, axis=1).max(axis=1)
    return np.asarray(sound & (misfit <= FLAT * span + 4 * ULPS * np.abs(values).max(axis=(1, 2))))


def flattened(corners: Floats) -> Floats:
    """One face (n, 3) in the coordinates (n, 2) of its plane, counter-clockwise where it has an area."""
    normal, _ = normals_of(corners[None])
    x, y = _axes(normal)
    return np.stack([corners @ x[0], corners @ y[0]], axis=1)


def _measure(corners: Floats) -> tuple[Bools, Bools]:
    """Which of the faces (m, n, 3) are flat, and which strictly convex."""
    tolerance = slack(corners)
    normal, sound = normals_of(corners)
    centred = corners - corners.mean(axis=1, keepdims=True)
    height = np.abs(np.einsum("mni,mi->mn", centred, normal)).max(axis=1)
    edge = np.roll(centred, -1, axis=1) - centred
    following = np.roll(edge, -1, axis=1)
    turn = np.einsum("mni,mi->mn", _cross(edge, following), normal)
    angle = np.arctan2(turn, np.einsum("mni,mni->mn", edge, following))
    room = tolerance[:, None] * np.maximum(np.linalg.norm(edge, axis=2), np.linalg.norm(following, axis=2))
    once = np.where(np.abs(turn) > room, angle, 0.0).sum(axis=1) < 3 * np.pi  # 2 pi; 4 pi where a star winds twice
    return sound & (height <= tolerance), sound & (turn > room).all(axis=1) & once


def _size(centred: Floats) -> Floats:
    """The diameters (m,) of faces about their middle."""
    return np.asarray(2 * np.linalg.norm(centred, axis=2).max(axis=1))


def _axes(normal: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (m, 3) across each unit ``normal`` (m, 3), right-handed with it; (0, 0, 0) has none."""
    aside = np.eye(3)[np.abs(normal).argmin(axis=1)]
    x = _cross(aside, normal)
    x = x / np.maximum(np.linalg.norm(x, axis=1), np.finfo(np.float64).tiny)[:, None]
    return x, _cross(normal, x)


def _cross(a: Floats, b: Floats) -> Floats:
    """The cross product over the last axis; of a few vectors numpy's own takes ten times as long."""
    return np.asarray(a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT])
