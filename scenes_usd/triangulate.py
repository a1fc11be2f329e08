"""Polygons to triangles: the one place where an n-gon is cut, with the diagonal stated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd import ears
from notabug.scenes_usd.faces import FLAT, flattened, local_points, rounding, shapes, slack
from notabug.scenes_usd.once import once
from notabug.scenes_usd.scene import Floats, Ints, Mesh

Diagonal = Literal["02", "13", "shorter", "fan"]
"""How a face of more than three corners is cut.

``02``, ``13`` : as a fan from corner 0 or 1, so a quad along the diagonal between these corners. Where a triangle of
    the fan would be turned round or lie on a line, as in a concave face, the face is cut ear by ear instead.
``shorter`` : a quad along its shorter diagonal, of two equal ones along 02; larger faces ear by ear.
``fan`` : as a fan from corner 0, whatever comes of it.
"""

Places = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """A mesh's triangles.

    ``corner`` (t, 3) face corners (index normals and uv), ``point`` (t, 3) into the mesh's points, ``points`` (t, 3, 3)
    positions, ``face`` (t,) the polygon each was cut from.
    """

    corner: Ints
    point: Ints
    points: Floats
    face: Ints


def triangulate(mesh: Mesh, diagonal: Diagonal = "02") -> Triangles:
    """Cut every polygon into triangles, faces in order: see ``Diagonal``.

    Triangles without an area, which polygons with corners in one place or on a line leave, are left out.
    """
    counts = mesh.counts.astype(np.int64)
    first = np.cumsum(counts) - counts
    per_face = counts - 2
    face = np.repeat(np.arange(len(counts)), per_face)
    step = np.arange(len(face)) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    size = counts[face]
    begin = np.where(size > 3, _starts(mesh, first, diagonal)[face], 0)
    local = np.stack([begin, begin + 1 + step, begin + 2 + step], axis=1) % size[:, None]
    kept = _cut_the_rest(mesh, first, diagonal, local)
    if not kept.all():
        local, face = local[kept], face[kept]
    corner = (first[face][:, None] + local).astype(np.int32)
    point = mesh.corners[corner]
    return Triangles(corner, point, mesh.points[point], face.astype(np.int32))


def split_ngons(mesh: Mesh, diagonal: Diagonal) -> Mesh:
    """The mesh as a renderer sees it whose importer cuts n-gons: triangles only, normals and uv linear in each.

    Of one mesh it is one mesh, however often it is asked for.
    """
    return _SPLIT[diagonal](mesh)


def _split(mesh: Mesh, diagonal: Diagonal) -> Mesh:
    cut = triangulate(mesh, diagonal)
    flat = cut.corner.ravel()
    return replace(
        mesh,
        counts=np.full(len(cut.face), 3, np.int32),
        corners=np.ascontiguousarray(mesh.corners[flat]),
        normals=None if mesh.normals is None else np.ascontiguousarray(mesh.normals[flat]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[flat]),
    )


_SPLIT = {diagonal: once(partial(_split, diagonal=diagonal)) for diagonal in get_args(Diagonal)}


def _starts(mesh: Mesh, first: Places, diagonal: Diagonal) -> Places:
    """The corner (f,) that the fan of each face starts at."""
    if diagonal != "shorter":
        return np.full(len(first), int(diagonal == "13"), np.int64)
    starts = mesh.counts.astype(np.int64) - 1  # cut ear by ear from its first corner, a convex face is this fan
    quads = np.flatnonzero(mesh.counts == 4)
    a, b, c, d = (mesh.points[mesh.corners[first[quads] + k]] for k in range(4))
    starts[quads] = np.linalg.norm(d - b, axis=1) < (1.0 - FLAT) * np.linalg.norm(c - a, axis=1)
    return starts


def _cut_the_rest(mesh: Mesh, first: Places, diagonal: Diagonal, local: Places) -> npt.NDArray[np.bool_]:
    """Cut the faces that are not strictly convex one by one into ``local`` (t, 3); which triangles (t,) to keep."""
    kept = np.ones(len(local), np.bool_)
    odd = np.flatnonzero(~shapes(mesh).convex)
    if not len(odd):
        return kept
    points = local_points(mesh)
    slots = np.cumsum(mesh.counts - 2, dtype=np.int64) - (mesh.counts - 2)
    for face in odd.tolist():
        count = int(mesh.counts[face])
        corners = points[mesh.corners[first[face] : first[face] + count]]
        slot = slice(int(slots[face]), int(slots[face]) + count - 2)
        triples = [(a, b, c) for a, b, c in local[slot].tolist()]
        if diagonal != "fan":
            plane, room = flattened(corners), float(slack(corners[None])[0])
            if not ears.fits(triples, plane, room):
                triples = ears.ears(plane, room) or triples
        local[slot] = triples
        kept[slot] = _heights(corners[np.asarray(triples)]) > rounding(corners[None])[0]
    return kept


def _heights(points: Floats) -> Floats:
    """The least height (t,) of each triangle (t, 3, 3)."""
    edges = points - np.roll(points, -1, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return np.asarray(area / np.maximum(longest, np.finfo(np.float64).tiny))
