"""Ray against triangle and sphere, and the inverse of a bilinear map: the three formulas everything rests on.

Each works in the precision of its arguments; the numbers 1, 2 ... are made in that precision (``type(x)(1)``), or
float32 arithmetic would silently become float64. Tested against a 50-digit oracle in tests/references/test_oracle.py.
"""

from __future__ import annotations

import math

from notabug.references.tracer.jit import kernel


@kernel
def shear(dx, dy, dz):
    """The shear that turns the direction (dx, dy, dz) into +z: (kx, ky, kz, sx, sy, sz).

    Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1).
    """
    ax, ay, az = abs(dx), abs(dy), abs(dz)
    if az >= ax and az >= ay:
        kx, ky, kz = 0, 1, 2
        a, b, c = dx, dy, dz
    elif ax >= ay:
        kx, ky, kz = 1, 2, 0
        a, b, c = dy, dz, dx
    else:
        kx, ky, kz = 2, 0, 1
        a, b, c = dz, dx, dy
    if c < 0:  # keeps the winding, so that the sign of the determinant tells front from back
        kx, ky = ky, kx
        a, b = b, a
    return kx, ky, kz, a / c, b / c, type(c)(1) / c


@kernel
def ray_triangle(ox, oy, oz, kx, ky, kz, sx, sy, sz, p, i):
    """Intersect a ray with triangle ``i`` of ``p`` (n, 9): (t, b0, b1, b2), t = inf on a miss.

    The edge tests of two triangles that share an edge use the same products, so no ray passes between them. ``t`` is in
    units of the direction's length and may be negative: the caller bounds it.
    """
    o = (ox, oy, oz)
    okx, oky, okz = o[kx], o[ky], o[kz]
    az = p[i, kz] - okz
    bz = p[i, 3 + kz] - okz
    cz = p[i, 6 + kz] - okz
    ax = (p[i, kx] - okx) - sx * az
    ay = (p[i, ky] - oky) - sy * az
    bx = (p[i, 3 + kx] - okx) - sx * bz
    by = (p[i, 3 + ky] - oky) - sy * bz
    cx = (p[i, 6 + kx] - okx) - sx * cz
    cy = (p[i, 6 + ky] - oky) - sy * cz
    u = cx * by - cy * bx
    v = ax * cy - ay * cx
    w = bx * ay - by * ax
    zero = type(u)(0)
    miss = type(u)(math.inf)
    if (u < zero or v < zero or w < zero) and (u > zero or v > zero or w > zero):
        return miss, zero, zero, zero
    det = u + v + w
    if det == zero:
        return miss, zero, zero, zero
    u, v, w = u / det, v / det, w / det  # first: a product of three lengths would underflow on tiny triangles
    return (u * az + v * bz + w * cz) * sz, u, v, w


@kernel
def ray_sphere(ox, oy, oz, dx, dy, dz, radius):
    """Both roots (near, far) of a ray against the sphere of ``radius`` about the origin; (inf, inf) on a miss.

    Haines, Guenther and Akenine-Moeller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems 7:
    the discriminant from the vector between centre and ray, the roots without cancellation.
    """
    a = dx * dx + dy * dy + dz * dz
    b = -(ox * dx + oy * dy + oz * dz)
    c = ox * ox + oy * oy + oz * oz - radius * radius
    s = b / a
    lx, ly, lz = ox + s * dx, oy + s * dy, oz + s * dz
    discriminant = radius * radius - (lx * lx + ly * ly + lz * lz)
    if discriminant < 0:
        miss = type(a)(math.inf)
        return miss, miss
    root = math.sqrt(a * discriminant)
    q = b + root if b >= 0 else b - root
    if q == 0:
        return -root / a, root / a
    t0, t1 = c / q, q / a
    if t0 > t1:
        t0, t1 = t1, t0
    return t0, t1


@kernel
def inverse_bilinear(x, y, q, i):
    """(s, t) in [0, 1]^2 with P = (1-s)(1-t) q0 + s(1-t) q1 + st q2 + (1-s)t q3, for the convex quad ``q[i]`` (n, 8).

    The quadratic in t is solved by the root that does not cancel; where the quad is a parallelogram its leading
    coefficient vanishes and the same formula gives the linear root. Results are clamped to [0, 1].
    """
    ex, ey = q[i, 2] - q[i, 0], q[i, 3] - q[i, 1]
    fx, fy = q[i, 6] - q[i, 0], q[i, 7] - q[i, 1]
    gx, gy = (q[i, 4] - q[i, 6]) - ex, (q[i, 5] - q[i, 7]) - ey
    hx, hy = x - q[i, 0], y - q[i, 1]
    zero, one = type(x)(0), type(x)(1)
    two, four = type(x)(2), type(x)(4)
    a = gx * fy - gy * fx
    b = ex * fy - ey * fx + hx * gy - hy * gx
    c = hx * ey - hy * ex
    discriminant = b * b - four * a * c
    root = math.sqrt(discriminant) if discriminant > zero else zero
    k = -(b + root) / two if b >= zero else -(b - root) / two
    t = zero
    if k != zero:
        t = c / k
        if a != zero:
            other = k / a
            if abs(other - one / two) < abs(t - one / two):
                t = other
    elif a != zero:
        t = -b / (two * a)
    t = min(max(t, zero), one)
    rx, ry = ex + gx * t, ey + gy * t
    numerator, denominator = hx - fx * t, rx
    if abs(rx) < abs(ry):
        numerator, denominator = hy - fy * t, ry
    s = numerator / denominator if denominator != zero else zero
    return min(max(s, zero), one), t
