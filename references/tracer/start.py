"""Where a ray that leaves a surface starts: the rules that keep it from meeting that surface again.

A hit point is off its surface by rounding. ``EXACT``, the reference's rule, leaves out the facet that a ray starts on;
what renderers do is one of the others. ``ABSOLUTE`` and ``RELATIVE`` pass over hits nearer than an epsilon (Haines
1989), ``ERROR_BOUND`` starts at a point computed from the facet itself, and beside it by that point's own error (Pharr,
Jakob and Humphreys 2023, Physically Based Rendering, section 6.8). ``NONE`` does nothing and shows what the others are
there for.
"""

from __future__ import annotations

import math

from notabug.references.tracer.jit import kernel

EXACT, NONE, ABSOLUTE, RELATIVE, ERROR_BOUND = range(5)


@kernel
def clearance(flat, rule, epsilon, unit, x, y, z):
    """The smallest distance at which a ray from (x, y, z) may meet something; ``unit`` is 1's distance to the next
    number. Relative is to the scene's coordinates and the distance to the camera, which both carry rounding."""
    size = flat.radius + abs(x) + abs(y) + abs(z)
    if rule == EXACT:
        return type(x)(32) * unit * size
    if rule == ABSOLUTE:
        return type(x)(epsilon)
    if rule == RELATIVE:
        c = flat.camera
        return type(x)(epsilon) * (size + abs(x - c[0]) + abs(y - c[1]) + abs(z - c[2]))
    return type(x)(0)


@kernel
def bounded(flat, spheres, i, ball, b0, b1, b2, x, y, z, gx, gy, gz, unit):
    """The hit on triangle ``i`` or sphere ``ball`` anew, and how far along g a ray must start beside it: (x, y, z, d).

    Barycentric coordinates give a point of the facet within gamma(7) of its terms, whatever distance the ray has come;
    on a sphere the point is moved onto it, within gamma(5), and its two maps add gamma(3) each.
    """
    u = unit / type(x)(2)
    if i >= 0:
        p = flat.points[i]
        seven = type(x)(7) * u / (type(x)(1) - type(x)(7) * u) + u  # and the rounding of the start itself
        ax, bx, cx = b0 * p[0], b1 * p[3], b2 * p[6]
        ay, by, cy = b0 * p[1], b1 * p[4], b2 * p[7]
        az, bz, cz = b0 * p[2], b1 * p[5], b2 * p[8]
        error = abs(gx) * (abs(ax) + abs(bx) + abs(cx))
        error += abs(gy) * (abs(ay) + abs(by) + abs(cy))
        error += abs(gz) * (abs(az) + abs(bz) + abs(cz))
        return ax + bx + cx, ay + by + cy, az + bz + cz, seven * error
    if spheres is None:
        return x, y, z, type(x)(0)
    m, w = spheres.to_local[ball], spheres.to_world[ball]
    hx = m[0] * x + m[1] * y + m[2] * z + m[3]
    hy = m[4] * x + m[5] * y + m[6] * z + m[7]
    hz = m[8] * x + m[9] * y + m[10] * z + m[11]
    onto = spheres.radius[ball] / math.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = onto * hx, onto * hy, onto * hz
    error = abs(gx) * (abs(w[0] * hx) + abs(w[1] * hy) + abs(w[2] * hz) + abs(w[3]))
    error += abs(gy) * (abs(w[4] * hx) + abs(w[5] * hy) + abs(w[6] * hz) + abs(w[7]))
    error += abs(gz) * (abs(w[8] * hx) + abs(w[9] * hy) + abs(w[10] * hz) + abs(w[11]))
    return (
        w[0] * hx + w[1] * hy + w[2] * hz + w[3],
        w[4] * hx + w[5] * hy + w[6] * hz + w[7],
        w[8] * hx + w[9] * hy + w[10] * hz + w[11],
        type(x)(12) * u * error,
    )
