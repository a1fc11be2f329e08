"""Faces as exporters write them to faces that can be drawn: corners in one place are one, faces without area are none.

The rows of quads at a ball's poles, repeated indices, needles: what is left of such a face is drawn, and no more.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.faces import FLAT, ULPS
from notabug.scenes_usd.scene import Floats, Ints

Bools = npt.NDArray[np.bool_]
Places = npt.NDArray[np.int64]


def sound_faces(
    points: Floats, counts: Ints, corners: Ints, normals: Floats | None, uv: Floats | None
) -> tuple[Places, Ints]:
    """The corners (k,) to keep of a mesh, and the corners of each face that then is left (f',).

    ``points`` (p, 3) are in the mesh's own frame; ``normals`` (c, 3), not normalised, and ``uv`` (c, 2) per corner. A
    corner goes that lies where the one before it does, within the rounding of float32, and has the same normal and uv.
    Where these differ it stays: which of the two counts depends on how the face is cut. A face goes whose corners all
    lie on one line.
    """
    places = points[corners]
    room = _by_face(ULPS * np.abs(places).max(axis=1), counts, np.maximum)
    kept = np.arange(len(corners), dtype=np.int64)
    while len(counts):
        alike = _repeated(places[kept], counts, room, *(None if each is None else each[kept] for each in (normals, uv)))
        if not alike.any():
            break
        left = np.add.reduceat((~alike).astype(np.int32), np.cumsum(counts) - counts).astype(np.int32)
        drawn = left >= 3
        kept = kept[~alike & np.repeat(drawn, counts)]
        counts, room = left[drawn], room[drawn]
    wide = _have_area(places[kept], counts, room) if len(counts) else np.zeros(0, np.bool_)
    return kept[np.repeat(wide, counts)], counts[wide]


def _repeated(places: Floats, counts: Ints, room: Floats, normals: Floats | None, uv: Floats | None) -> Bools:
    """The corners (c,) that lie where another of their face does beside them, and add nothing to it.

    Of a row of them the first stays, and the face's own first corner always; one that then closes a face on its first
    is found when this is asked again.
    """
    starts = np.cumsum(counts) - counts
    before = np.arange(len(places)) - 1
    before[starts] = starts + counts - 1
    alike = np.linalg.norm(places - places[before], axis=1) <= np.repeat(room, counts)
    if normals is not None:
        alike &= _agree(normals, normals[before])
    if uv is not None:
        alike &= _agree(uv, uv[before])
    closes = alike[starts]  # the first corner lies where the last does: the last goes
    alike[starts] = False
    alike[(starts + counts - 1)[closes]] = True
    return np.asarray(alike)


def _agree(a: Floats, b: Floats) -> Bools:
    size = np.maximum(np.abs(a).max(axis=1), np.abs(b).max(axis=1))
    return np.asarray(np.abs(a - b).max(axis=1) <= FLAT * size)


def _have_area(places: Floats, counts: Ints, room: Floats) -> Bools:
    """The faces (f,) with a corner off the line from their first corner to the one farthest from it."""
    starts = np.cumsum(counts) - counts
    reach = places - np.repeat(places[starts], counts, axis=0)
    distance = np.linalg.norm(reach, axis=1)
    longest = _by_face(distance, counts, np.maximum)
    far = np.flatnonzero(distance == np.repeat(longest, counts))
    face = np.repeat(np.arange(len(counts)), counts)[far]
    line = reach[far[np.searchsorted(face, np.arange(len(counts)))]]
    line /= np.maximum(longest, np.finfo(np.float64).tiny)[:, None]
    aside = np.linalg.norm(np.cross(reach, np.repeat(line, counts, axis=0)), axis=1)
    return np.asarray(_by_face(aside, counts, np.maximum) > room)


def _by_face(values: Floats, counts: Ints, combine: np.ufunc) -> Floats:
    """``values`` (c,) of the corners combined for each face (f,)."""
    return np.asarray(combine.reduceat(values, np.cumsum(counts) - counts))
