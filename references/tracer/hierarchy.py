"""The hierarchy of boxes that rays are traced through, kept for the last triangles that it was built over."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from notabug.references.tracer import bvh

Array = npt.NDArray[Any]


class Corners:
    """The corners ``points`` (t, 9) of triangles; the same numbers are the same key."""

    def __init__(self, points: npt.NDArray[np.float64]) -> None:
        self.points = np.ascontiguousarray(points)
        self._digest = hashlib.blake2b(self.points.data, digest_size=16).digest()

    def __hash__(self) -> int:
        return hash(self._digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Corners) and other._digest == self._digest


class Hierarchy(NamedTuple):
    """What of a Flat follows from where triangles are; ``order`` (t,) is that of its leaves."""

    nodes: Array
    boxes: Array
    leaves: Array
    first: Array
    points: Array
    order: Array


@lru_cache(maxsize=2)  # models that edit normals or coordinates alone, or cut faces as the reference does, share it
def hierarchy_of(corners: Corners, dtype: np.dtype[np.generic]) -> Hierarchy:
    """The hierarchy over ``corners``, in ``dtype``; it is built in float64 either way."""
    bounds, child, count, order = bvh.build(corners.points)
    if dtype == np.float32:  # rounding must not move a corner out of its box
        lo = np.nextafter(bounds[:, :3].astype(np.float32), np.float32(-np.inf))
        hi = np.nextafter(bounds[:, 3:].astype(np.float32), np.float32(np.inf))
        bounds = np.hstack([lo, hi]).astype(np.float64)
    nodes, leaves, boxes = bvh.widen(bounds, child, count)
    drawn = np.ascontiguousarray(corners.points[order], dtype)
    return Hierarchy(nodes, boxes, bvh.side_by_side(drawn, leaves), np.ascontiguousarray(leaves[:, 0]), drawn, order)
