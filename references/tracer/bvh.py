"""A bounding volume hierarchy over triangles: binned surface-area heuristic, flat arrays, built in float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.references.tracer.jit import allocating, kernel

LEAF = 4  # triangles per leaf at most, unless they cannot be told apart
BINS = 16
DEPTH = 48  # below this depth ranges are halved, so no tree is deeper than DEPTH + log2(triangles)
STACK = 96  # nodes that a traversal may have to remember


@kernel
def _area(lo, hi):
    x, y, z = hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]
    return x * y + y * z + z * x


@allocating
def _build(lo, hi, order, bounds, child, count):
    """Fill ``bounds`` (2n, 6), ``child`` and ``count`` (2n,), permuting ``order``; returns the number of nodes.

    A node with count > 0 is a leaf of ``order[child : child + count]``; else its children are child and child + 1.
    """
    n = order.size
    stack = np.empty((2 * DEPTH + 64, 4), np.int64)
    stack[0] = (0, 0, n, 0)
    top, used = 1, 1
    bin_lo, bin_hi = np.empty((BINS, 3)), np.empty((BINS, 3))
    bin_n = np.empty(BINS, np.int64)
    right_cost = np.empty(BINS)
    while top:
        top -= 1
        node, first, last, depth = stack[top]
        nlo, nhi = np.full(3, np.inf), np.full(3, -np.inf)
        clo, chi = np.full(3, np.inf), np.full(3, -np.inf)
        for j in range(first, last):
            i = order[j]
            for k in range(3):
                nlo[k] = min(nlo[k], lo[i, k])
                nhi[k] = max(nhi[k], hi[i, k])
                c = lo[i, k] + hi[i, k]
                clo[k] = min(clo[k], c)
                chi[k] = max(chi[k], c)
        bounds[node, :3] = nlo
        bounds[node, 3:] = nhi
        size = last - first
        best, axis, cut = np.inf, -1, 0
        if size > 2:
            for k in range(3):
                extent = chi[k] - clo[k]
                if not extent > 0:
                    continue
                bin_n[:] = 0
                bin_lo[:] = np.inf
                bin_hi[:] = -np.inf
                for j in range(first, last):
                    i = order[j]
                    b = min(BINS - 1, int(BINS * (lo[i, k] + hi[i, k] - clo[k]) / extent))
                    bin_n[b] += 1
                    for m in range(3):
                        bin_lo[b, m] = min(bin_lo[b, m], lo[i, m])
                        bin_hi[b, m] = max(bin_hi[b, m], hi[i, m])
                alo, ahi, an = np.full(3, np.inf), np.full(3, -np.inf), 0
                for b in range(BINS - 1, 0, -1):
                    an += bin_n[b]
                    for m in range(3):
                        alo[m] = min(alo[m], bin_lo[b, m])
                        ahi[m] = max(ahi[m], bin_hi[b, m])
                    right_cost[b] = an * _area(alo, ahi) if an else 0.0
                alo[:] = np.inf
                ahi[:] = -np.inf
                an = 0
                for b in range(BINS - 1):
                    an += bin_n[b]
                    for m in range(3):
                        alo[m] = min(alo[m], bin_lo[b, m])
                        ahi[m] = max(ahi[m], bin_hi[b, m])
                    if an and an < size:
                        cost = an * _area(alo, ahi) + right_cost[b + 1]
                        if cost < best:
                            best, axis, cut = cost, k, b
        leaf_cost = size * _area(nlo, nhi)
        if axis < 0 or (size <= LEAF and best + _area(nlo, nhi) >= leaf_cost):
            child[node], count[node] = first, size
            continue
        extent = chi[axis] - clo[axis]
        i, j = first, last - 1
        while i <= j and depth < DEPTH:
            b = min(BINS - 1, int(BINS * (lo[order[i], axis] + hi[order[i], axis] - clo[axis]) / extent))
            if b <= cut:
                i += 1
            else:
                order[i], order[j] = order[j], order[i]
                j -= 1
        if depth >= DEPTH:  # an adversarial mesh: halve what is left, so that the stack of the traversal suffices
            i = (first + last) // 2
        child[node], count[node] = used, 0
        stack[top] = (used, first, i, depth + 1)
        stack[top + 1] = (used + 1, i, last, depth + 1)
        top += 2
        used += 2
    return used


def build(
    triangles: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32], npt.NDArray[np.int32], npt.NDArray[np.int64]]:
    """Build over ``triangles`` (n, 9): (bounds (m, 6), child (m,), count (m,), order (n,) into triangles).

    An empty input gives one empty leaf whose bounds no ray meets.
    """
    n = len(triangles)
    order = np.arange(n)
    if n == 0:
        empty = np.array([[np.inf] * 3 + [-np.inf] * 3])
        return empty, np.zeros(1, np.int32), np.zeros(1, np.int32), order
    corners = triangles.reshape(n, 3, 3)
    bounds = np.empty((2 * n, 6))
    child, count = np.zeros(2 * n, np.int32), np.zeros(2 * n, np.int32)
    used = _build(corners.min(1), corners.max(1), order, bounds, child, count)
    return bounds[:used].copy(), child[:used].copy(), count[:used].copy(), order
