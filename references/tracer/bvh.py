"""A bounding volume hierarchy over triangles; built by references/native/bvh.cpp."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.references import _native

STACK: int = _native.STACK  # nodes that a traversal may have to remember


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
