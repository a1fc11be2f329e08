"""Polygons to triangles: the one place where an n-gon is cut, with the diagonal stated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.scene import Floats, Ints, Mesh

Diagonal = Literal["02", "13"]


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
    """Cut every polygon into a fan of triangles, faces in order.

    ``02`` starts the fan at corner 0, so a quad is cut along the diagonal from corner 0 to corner 2; ``13`` starts it
    at corner 1.
    """
    start = int(diagonal[0])
    counts = mesh.counts.astype(np.int64)
    first = np.concatenate([[0], np.cumsum(counts)[:-1]]) if len(counts) else np.zeros(0, np.int64)
    per_face = counts - 2
    face = np.repeat(np.arange(len(counts)), per_face)
    step = np.arange(len(face)) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    size = counts[face]
    begin: npt.NDArray[np.int64] = np.where(size > 3, start, 0)
    local = np.stack([begin, begin + 1 + step, begin + 2 + step], axis=1) % size[:, None]
    corner = (first[face][:, None] + local).astype(np.int32)
    point = mesh.corners[corner]
    return Triangles(corner, point, mesh.points[point], face.astype(np.int32))


def split_ngons(mesh: Mesh, diagonal: Diagonal) -> Mesh:
    """The mesh as a renderer sees it whose importer cuts n-gons: triangles only, normals and uv linear in each."""
    cut = triangulate(mesh, diagonal)
    flat = cut.corner.ravel()
    return replace(
        mesh,
        counts=np.full(len(cut.face), 3, np.int32),
        corners=np.ascontiguousarray(mesh.corners[flat]),
        normals=None if mesh.normals is None else np.ascontiguousarray(mesh.normals[flat]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[flat]),
    )
