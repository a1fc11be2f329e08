"""Which polygons have one meaning only: planar, convex, simple, and with uv that a renderer can interpolate.

Triangles always do. A quad with uv means the bilinear patch of its corners, whose inverse is unique only for a strictly
convex quad; more corners have no such map, so their uv must be affine in the plane of the face.
"""

from __future__ import annotations

import numpy as np
from pxr import Usd

from notabug.scenes_usd.reader_values import fault
from notabug.scenes_usd.scene import Floats, Ints

FLAT = 1e-6  # of the face's diameter
ULPS = 4 * 2.0**-24  # of the largest coordinate: stages hold points and uv in float32


def check_polygons(prim: Usd.Prim, points: Floats, counts: Ints, corners: Ints, uv: Floats | None) -> None:
    """Raise SceneError for the first face of more than three corners that is not planar, convex and well mapped.

    ``points`` (p, 3) local, ``counts`` (f,), ``corners`` (c,), ``uv`` (c, 2) per corner or None.
    """
    starts = np.cumsum(counts) - counts
    for n in np.unique(counts[counts > 3]):
        faces = np.flatnonzero(counts == n).astype(np.int32)
        each = starts[faces][:, None] + np.arange(n)
        _check_faces(prim, faces, points[corners[each]], None if uv is None else uv[each])


def _check_faces(prim: Usd.Prim, faces: Ints, shape: Floats, uv: Floats | None) -> None:
    """``shape`` (m, n, 3) and ``uv`` (m, n, 2) of the faces numbered ``faces`` (m,), all of n corners."""
    n = shape.shape[1]
    centred = shape - shape.mean(axis=1, keepdims=True)
    size = 2 * np.linalg.norm(centred, axis=2).max(axis=1)
    slack = FLAT * size + ULPS * np.abs(shape).max(axis=(1, 2))
    after = np.arange(1, n + 1) % n
    ahead = centred[:, after]
    newell = _cross(centred, ahead).sum(axis=1)  # twice the area along the normal
    length = np.linalg.norm(newell, axis=1)
    _refuse(prim, faces, length <= slack * size, "has no area or crosses itself")
    normal = newell / length[:, None]
    height = np.abs(np.einsum("mni,mi->mn", centred, normal)).max(axis=1)
    _refuse(prim, faces, height > slack, "is not planar", do="cut it into triangles")

    edge = ahead - centred
    following = edge[:, after]
    turn = np.einsum("mni,mi->mn", _cross(edge, following), normal)
    angle = np.arctan2(turn, np.einsum("mni,mni->mn", edge, following))
    room = slack[:, None] * np.maximum(np.linalg.norm(edge, axis=2), np.linalg.norm(following, axis=2))
    turns = np.where(np.abs(turn) > room, angle, 0.0).sum(axis=1)  # 2 pi; 4 pi where a star winds twice
    _refuse(prim, faces, (turn < -room).any(axis=1) | (turns > 3 * np.pi), "is concave or crosses itself", do=_CUT)
    if uv is None:
        return
    if n == 4:
        _refuse(prim, faces, (turn <= room).any(axis=1), "has uv and a corner of 180 degrees", do=_CUT)
        return
    span = np.ptp(uv, axis=1).max(axis=1)
    basis = np.concatenate([centred / size[:, None, None], np.ones((*centred.shape[:2], 1))], axis=2)
    fitted = basis @ (np.linalg.pinv(basis, rcond=1e-5) @ uv)
    misfit = np.abs(fitted - uv).max(axis=(1, 2))
    tolerance = FLAT * span + 4 * ULPS * np.abs(uv).max(axis=(1, 2))
    _refuse(prim, faces, misfit > tolerance, f"has {n} corners and uv that are not affine", do=_CUT)


def _cross(a: Floats, b: Floats) -> Floats:
    """The cross product over the last axis; of a few vectors numpy's own takes ten times as long."""
    return a[..., _NEXT] * b[..., _LAST] - a[..., _LAST] * b[..., _NEXT]


_NEXT, _LAST = [1, 2, 0], [2, 0, 1]
_CUT = "cut it into triangles or convex quads"


def _refuse(
    prim: Usd.Prim, faces: Ints, bad: np.ndarray[tuple[int], np.dtype[np.bool_]], what: str, do: str = ""
) -> None:
    if bad.any():
        raise fault(prim, "faceVertexIndices", f"face {faces[int(np.argmax(bad))]} {what}", do=do)
