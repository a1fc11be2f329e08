"""Which polygons have one meaning only: planar, convex, simple, and with uv that a renderer can interpolate.

Triangles always do. A quad with uv means the bilinear patch of its corners, whose inverse is unique only for a strictly
convex quad; more corners have no such map, so their uv must be affine in the plane of the face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pxr import Usd

from notabug.scenes_usd.reader_values import fault
from notabug.scenes_usd.scene import Floats, Ints

FLAT = 1e-6  # of the face's diameter
ULPS = 4 * 2.0**-24  # of the largest coordinate: stages hold points and uv in float32


class Polygons:
    """The faces of more than three corners of a stage, gathered and then checked together: numpy's calls are dear."""

    def __init__(self) -> None:
        self._gathered: dict[tuple[int, bool], list[_Gathered]] = {}

    def add(self, prim: Usd.Prim, points: Floats, counts: Ints, corners: Ints, uv: Floats | None) -> None:
        """Gather the faces of a mesh: ``points`` (p, 3) local, ``counts`` (f,), ``corners`` (c,), ``uv`` (c, 2)."""
        starts = np.cumsum(counts) - counts
        for n in sorted(set(counts[counts > 3].tolist())):
            faces = np.flatnonzero(counts == n)
            each = starts[faces][:, None] + np.arange(n)
            found = _Gathered(prim, faces, points[corners[each]], None if uv is None else uv[each])
            self._gathered.setdefault((n, uv is not None), []).append(found)

    def check(self) -> None:
        """Raise SceneError for a face that is not planar, convex and well mapped."""
        for found in self._gathered.values():
            uv = [each.uv for each in found if each.uv is not None]
            shape = np.concatenate([each.shape for each in found])
            _check_faces(found, shape, np.concatenate(uv) if uv else None)


@dataclass(frozen=True, slots=True)
class _Gathered:
    """The faces of ``prim`` numbered ``faces`` (m,), all of n corners: ``shape`` (m, n, 3) and ``uv`` (m, n, 2)."""

    prim: Usd.Prim
    faces: npt.NDArray[np.int64]
    shape: Floats
    uv: Floats | None


def _check_faces(found: Sequence[_Gathered], shape: Floats, uv: Floats | None) -> None:
    """``shape`` (m, n, 3) and ``uv`` (m, n, 2) of all faces of ``found``."""
    n = shape.shape[1]
    centred = shape - shape.mean(axis=1, keepdims=True)
    size = 2 * np.linalg.norm(centred, axis=2).max(axis=1)
    slack = FLAT * size + ULPS * np.abs(shape).max(axis=(1, 2))
    after = np.arange(1, n + 1) % n
    ahead = centred[:, after]
    newell = _cross(centred, ahead).sum(axis=1)  # twice the area along the normal
    length = np.linalg.norm(newell, axis=1)
    _refuse(found, length <= slack * size, "has no area or crosses itself")
    normal = newell / length[:, None]
    height = np.abs(np.einsum("mni,mi->mn", centred, normal)).max(axis=1)
    _refuse(found, height > slack, "is not planar", do="cut it into triangles")

    edge = ahead - centred
    following = edge[:, after]
    turn = np.einsum("mni,mi->mn", _cross(edge, following), normal)
    angle = np.arctan2(turn, np.einsum("mni,mni->mn", edge, following))
    room = slack[:, None] * np.maximum(np.linalg.norm(edge, axis=2), np.linalg.norm(following, axis=2))
    turns = np.where(np.abs(turn) > room, angle, 0.0).sum(axis=1)  # 2 pi; 4 pi where a star winds twice
    _refuse(found, (turn < -room).any(axis=1) | (turns > 3 * np.pi), "is concave or crosses itself", do=_CUT)
    if uv is None:
        return
    if n == 4:
        _refuse(found, (turn <= room).any(axis=1), "has uv and a corner of 180 degrees", do=_CUT)
        return
    span = np.ptp(uv, axis=1).max(axis=1)
    basis = np.concatenate([centred / size[:, None, None], np.ones((*centred.shape[:2], 1))], axis=2)
    fitted = basis @ (np.linalg.pinv(basis, rcond=1e-5) @ uv)
    misfit = np.abs(fitted - uv).max(axis=(1, 2))
    tolerance = FLAT * span + 4 * ULPS * np.abs(uv).max(axis=(1, 2))
    _refuse(found, misfit > tolerance, f"has {n} corners and uv that are not affine", do=_CUT)


def _cross(a: Floats, b: Floats) -> Floats:
    """The cross product over the last axis; of a few vectors numpy's own takes ten times as long."""
    return a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT]


_NEXT, _LAST = [1, 2, 0], [2, 0, 1]
_CUT = "cut it into triangles or convex quads"


def _refuse(found: Sequence[_Gathered], bad: npt.NDArray[np.bool_], what: str, do: str = "") -> None:
    if not bad.any():
        return
    place = int(np.argmax(bad))
    for each in found:
        if place < len(each.faces):
            raise fault(each.prim, "faceVertexIndices", f"face {each.faces[place]} {what}", do=do)
        place -= len(each.faces)
