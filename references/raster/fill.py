"""The z-buffer: which triangle wins each sample, at which depth, and where on it.

Triangles are clipped at the near and the far plane, projected, and filled by edge functions with the top-left rule. A
depth is computed at the vertices and interpolated linearly in window space, as depth buffers do (Akenine-Moeller,
Haines and Hoffman, Real-Time Rendering, section 23.7), then stored in the format asked for.
"""

from __future__ import annotations

import math

import numpy as np

from notabug.references.tracer.jit import allocating, kernel

# Formats of a stored depth. Every one is kept as a number that grows with the distance: reversed z is negated.
EXACT, FIXED, FLOAT, REVERSED, DISTANCE = range(5)
# Columns of the arrays of a clipped polygon's corners: position in the view, share of the triangle's three corners.
_POLYGON = 6
# ... and of what its corners carry into the window: 1/w, depth, share of the three corners.
_CARRIED = 5


@kernel
def _clip(source, count, into, sign, limit):
    """Keep what has sign * Z >= sign * limit (Sutherland and Hodgman 1974); returns how many corners are left.

    A new corner is always computed from the kept one to the lost one, so that two triangles agree on a common edge.
    """
    kept = 0
    for j in range(count):
        k = j + 1 if j + 1 < count else 0
        inside = sign * source[j, 2] >= sign * limit
        if inside:
            for c in range(_POLYGON):
                into[kept, c] = source[j, c]
            kept += 1
        if inside != (sign * source[k, 2] >= sign * limit):
            a, b = (j, k) if inside else (k, j)
            t = (limit - source[a, 2]) / (source[b, 2] - source[a, 2])
            for c in range(_POLYGON):
                into[kept, c] = source[a, c] + t * (source[b, c] - source[a, c])
            into[kept, 2] = limit
            kept += 1
    return kept


@kernel
def _edge(ax, ay, bx, by, px, py):
    """Twice the signed area of a, b, p; exactly the negative of what b, a, p gives, so no sample is lost or doubled."""
    if ax > bx or (ax == bx and ay > by):
        return (ay - by) * (px - bx) - (ax - bx) * (py - by)
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@kernel
def _covers(e, ax, ay, bx, by):
    """Whether a sample with the edge function ``e`` is inside; on the edge itself, if that is a top or a left one."""
    if e != 0:
        return e > 0
    return by < ay or (by == ay and bx > ax)


@kernel
def _depth(z, near, far, parallel, form):
    """The depth of a corner before it is stored: 0 at the near plane, 1 at the far one (reversed: 1 and 0)."""
    one = type(z)(1)
    if form == DISTANCE:
        return z
    scale = one if parallel else z
    if form == REVERSED:
        return (near if not parallel else one) * (far - z) / ((far - near) * scale)
    return (far if not parallel else one) * (z - near) / ((far - near) * scale)


@kernel
def _stored(depth, form, steps):
    """``depth`` as the buffer keeps it; fixed point is rounded to the nearest of ``steps`` + 1 values."""
    if form == DISTANCE:
        return np.float64(depth)
    d = min(max(np.float64(depth), 0.0), 1.0)
    if form == FIXED:
        return math.floor(d * steps + 0.5) / steps
    if form == FLOAT:
        return np.float64(np.float32(d))
    if form == REVERSED:
        return -np.float64(np.float32(d))
    return d


@allocating
def fill(points, order, view, parallel, form, steps, last, size, top, behind, depth, winner, correct, affine):
    """Draw the triangles ``points[order]`` into the rows from ``top`` on of a window of ``size`` (width, height).

    Parameters
    ----------
    points : (t, 9); order : (n,) which of them are drawn, in which order.
    view : (14,) eye, x axis / tan_x, y axis / tan_y, forward axis, near, far. With ``parallel`` there is no division by
        the depth, and the axes are divided by half the window's extent.
    form, steps : the depth format, and 2^bits - 1 for fixed point.
    last : of equal depths the last drawn wins (less or equal), not the first (less).
    behind : None, or the depths (rows, width) and places in ``order`` (rows, width) of an earlier pass: only what comes
        after those is drawn (depth peeling; Everitt 2001).
    depth : (rows, width) float64, cleared by the caller; winner : (rows, width) place in ``order``, or -1.
    correct, affine : (rows, width, 3) barycentric coordinates of the winner, with perspective and without.
    """
    width, height = size
    rows = depth.shape[0]
    near, far = view[12], view[13]
    one, half = type(near)(1), type(near)(0.5)
    polygon = np.empty((8, _POLYGON), points.dtype)
    clipped = np.empty((8, _POLYGON), points.dtype)
    place = np.empty((8, 2))  # edge functions are exact in hardware (fixed point), so here they are float64
    carried = np.empty((8, _CARRIED), points.dtype)
    for k in range(order.size):
        p = points[order[k]]
        lost_near, lost_far = 0, 0
        for j in range(3):
            x, y, z = p[3 * j] - view[0], p[3 * j + 1] - view[1], p[3 * j + 2] - view[2]
            polygon[j, 0] = x * view[3] + y * view[4] + z * view[5]
            polygon[j, 1] = x * view[6] + y * view[7] + z * view[8]
            polygon[j, 2] = x * view[9] + y * view[10] + z * view[11]
            for c in range(3):
                polygon[j, 3 + c] = one if c == j else one - one
            lost_near += polygon[j, 2] < near
            lost_far += polygon[j, 2] > far
        if lost_near == 3 or lost_far == 3:
            continue
        corners = 3
        if lost_near or lost_far:
            corners = _clip(polygon, 3, clipped, one, near)
            corners = _clip(clipped, corners, polygon, -one, far)
        for j in range(corners):
            z = polygon[j, 2]
            w = one if parallel else z
            place[j, 0] = (polygon[j, 0] / w + one) * half * type(near)(width)
            place[j, 1] = (one - polygon[j, 1] / w) * half * type(near)(height)
            carried[j, 0] = one / w
            carried[j, 1] = _depth(z, near, far, parallel, form)
            carried[j, 2], carried[j, 3], carried[j, 4] = polygon[j, 3], polygon[j, 4], polygon[j, 5]
        for j in range(1, corners - 1):
            _fill_triangle(
                place, carried, j, j + 1, k, form, steps, last, width, top, rows,
                behind, depth, winner, correct, affine,
            )  # fmt: skip


@kernel
def _fill_triangle(
    place, carried, second, third, k, form, steps, last, width, top, rows, behind, depth, winner, correct, affine
):  # fmt: skip
    """Draw the triangle of the polygon's corners 0, ``second`` and ``third``."""
    one = type(carried[0, 0])(1)
    area = _edge(place[0, 0], place[0, 1], place[second, 0], place[second, 1], place[third, 0], place[third, 1])
    if not abs(area) > 0 or abs(area) == math.inf:
        return
    if area < 0:
        second, third = third, second
    ax, ay = place[0]
    bx, by = place[second]
    cx, cy = place[third]
    a, b, c = carried[0], carried[second], carried[third]
    left, right = int(max(min(ax, bx, cx) - 1.0, 0.0)), int(min(max(ax, bx, cx) + 1.0, width))
    upper, lower = int(max(min(ay, by, cy) - 1.0, top)), int(min(max(ay, by, cy) + 1.0, top + rows))
    for row in range(upper, lower):
        py = row + 0.5
        for column in range(left, right):
            px = column + 0.5
            ec = _edge(ax, ay, bx, by, px, py)
            ea = _edge(bx, by, cx, cy, px, py)
            eb = _edge(cx, cy, ax, ay, px, py)
            if not (_covers(ec, ax, ay, bx, by) and _covers(ea, bx, by, cx, cy) and _covers(eb, cx, cy, ax, ay)):
                continue
            total = ea + eb + ec
            sa, sb, sc = type(one)(ea / total), type(one)(eb / total), type(one)(ec / total)
            wa, wb, wc = sa * a[0], sb * b[0], sc * c[0]
            inverse = one / (wa + wb + wc)
            wa, wb, wc = wa * inverse, wb * inverse, wc * inverse
            ka, kb, kc = sa, sb, sc
            if form == DISTANCE:  # linear in space, not in the window
                ka, kb, kc = wa, wb, wc
            key = _stored(ka * a[1] + kb * b[1] + kc * c[1], form, steps)
            at = row - top
            if behind is not None:
                before = behind[0][at, column]
                if key < before:
                    continue
                if key == before:
                    was = behind[1][at, column]
                    if (k >= was) if last else (k <= was):
                        continue
            if key < depth[at, column] or (last and key == depth[at, column]):
                depth[at, column] = key
                winner[at, column] = k
                for j in range(3):
                    correct[at, column, j] = wa * a[2 + j] + wb * b[2 + j] + wc * c[2 + j]
                    affine[at, column, j] = sa * a[2 + j] + sb * b[2 + j] + sc * c[2 + j]
