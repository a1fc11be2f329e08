"""A bounding volume hierarchy over triangles; built by references/native/bvh.cpp, widened by wide.cpp."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.references import _native

STACK: int = _native.STACK  # boxes that a traversal may have to remember


def build(
    triangles: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.int64]]:
    """Build over ``triangles`` (n, 9): (bounds (m, 6), child (m,), count (m,), order (n,) into triangles).

    A node with count > 0 is a leaf of ``order[child : child + count]``; else its children are child and child + 1. An
    empty input gives one empty leaf whose bounds no ray meets.
    """
    n = len(triangles)
    if n == 0:
        empty = np.array([[np.inf] * 3 + [-np.inf] * 3])
        return empty, np.zeros(1, np.int32), np.zeros(1, np.int32), np.arange(0)
    corners = triangles.reshape(n, 3, 3)
    return _native.build(corners.min(1), corners.max(1))


def widen(
    bounds: npt.NDArray[np.float64], child: npt.NDArray[np.int32], count: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.float64]]:
    """The same hierarchy as nodes of eight boxes: (nodes (m, 64), leaves (l, 2), frame (5,)).

    Of a node's numbers the first 48 are float32, by their bits: the eight lower x, y, z, then the upper ones. The next
    eight are children, a node or the first leaf; the last eight how many leaves, 0 where the child is a node, -1 where
    there is no box. A leaf is its first triangle and how many, at most four. The frame is what boxes are relative to:
    a centre, their farthest coordinate from it, and its own. See wide.h.
    """
    if not count.any():
        return np.zeros((0, 64), np.int32), np.zeros((0, 2), np.int32), np.zeros(5)
    return _native.widen(bounds, child, count)


def side_by_side(triangles: npt.NDArray[np.floating], leaves: npt.NDArray[np.int32]) -> npt.NDArray[np.floating]:
    """The triangles (n, 9) of each leaf (l, 36): of each corner four x, four y and four z.

    Where a leaf has fewer its last triangle is repeated as the one point of its first corner, which no ray meets.
    """
    if not len(leaves):
        return np.zeros((0, 36), triangles.dtype)
    lane = np.arange(4)
    beyond = lane >= leaves[:, 1:]
    found = triangles[leaves[:, :1] + np.minimum(lane, leaves[:, 1:] - 1)].reshape(-1, 4, 3, 3)
    found[beyond] = found[beyond][:, :1]
    return np.ascontiguousarray(found.transpose(0, 2, 3, 1)).reshape(-1, 36)
