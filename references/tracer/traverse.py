"""Walks through the hierarchy: the closest hit, and how much light reaches a point."""

from __future__ import annotations

import math

from notabug.references.tracer.intersect import ray_sphere, ray_triangle, shear
from notabug.references.tracer.jit import kernel


@kernel
def _near_sides(ix, iy, iz):
    """For each axis the column of a box's bounds that a ray with these inverse directions meets first."""
    return 0 if ix >= 0 else 3, 1 if iy >= 0 else 4, 2 if iz >= 0 else 5


@kernel
def _enter(bounds, node, ox, oy, oz, ix, iy, iz, nx, ny, nz, tmin, tmax):
    """Where a ray enters a box, or inf. Written so that 0 * inf, which is NaN, never loses a box.

    (nx, ny, nz) are the ray's ``_near_sides``; the far side of an axis is 3 columns from the near one.
    """
    near, far = tmin, tmax
    x0, x1 = (bounds[node, nx] - ox) * ix, (bounds[node, 3 - nx] - ox) * ix
    y0, y1 = (bounds[node, ny] - oy) * iy, (bounds[node, 5 - ny] - oy) * iy
    z0, z1 = (bounds[node, nz] - oz) * iz, (bounds[node, 7 - nz] - oz) * iz
    if x0 > near:
        near = x0
    if y0 > near:
        near = y0
    if z0 > near:
        near = z0
    if x1 < far:
        far = x1
    if y1 < far:
        far = y1
    if z1 < far:
        far = z1
    # rounding: a few ulp more keep the test conservative (Ize 2013, "Robust BVH Ray Traversal")
    slack = far * type(far)(1e-6 if bounds.itemsize == 4 else 1e-15)
    return near if near <= far + slack else type(near)(math.inf)


@kernel
def closest(bounds, child, count, points, face, ox, oy, oz, dx, dy, dz, tmin, tmax, skip, stack):
    """The nearest triangle with tmin < t < tmax whose face is not ``skip``: (triangle or -1, t, b0, b1, b2).

    Of two at exactly the same t the one that comes first in the scene wins.
    """
    kx, ky, kz, sx, sy, sz = shear(dx, dy, dz)
    one = type(dx)(1)
    ix, iy, iz = one / dx, one / dy, one / dz
    nx, ny, nz = _near_sides(ix, iy, iz)
    hit = -1
    best, b0, b1, b2 = tmax, one, one, one
    node, top = 0, 0
    if _enter(bounds, 0, ox, oy, oz, ix, iy, iz, nx, ny, nz, tmin, best) == math.inf:
        return hit, best, b0, b1, b2
    while True:
        n = count[node]
        first = child[node]
        if n:
            for i in range(first, first + n):
                t, u, v, w = ray_triangle(ox, oy, oz, kx, ky, kz, sx, sy, sz, points, i)
                if t > tmin and (t < best or (t == best and hit >= 0 and face[i] < face[hit])) and face[i] != skip:
                    hit, best, b0, b1, b2 = i, t, u, v, w
        else:
            t0 = _enter(bounds, first, ox, oy, oz, ix, iy, iz, nx, ny, nz, tmin, best)
            t1 = _enter(bounds, first + 1, ox, oy, oz, ix, iy, iz, nx, ny, nz, tmin, best)
            if t0 <= t1:
                if t0 != math.inf:
                    if t1 != math.inf:
                        stack[top] = first + 1
                        top += 1
                    node = first
                    continue
            elif t1 != math.inf:
                if t0 != math.inf:
                    stack[top] = first
                    top += 1
                node = first + 1
                continue
        if top == 0:
            return hit, best, b0, b1, b2
        top -= 1
        node = stack[top]


@kernel
def rival(flat, spheres, ox, oy, oz, dx, dy, dz, tmin, tmax, winner, face, other, stack):
    """Among the surfaces met between tmin and tmax, the first in scene order, or the first that is not ``winner``.

    ``winner`` is the object that was hit, ``face`` its face there; ``other`` 1 asks for another one: also for another
    face of one mesh, where it is folded or its back is near; 2 asks for the nearest of them, whatever their order.
    Gives (triangle, sphere, t, b0, b1, b2, object), object -1 where there is none. Of one object's triangles the
    nearest counts.
    """
    one, zero = type(dx)(1), type(dx)(0)
    triangle, ball, owner = -1, -1, -1
    best, c0, c1, c2 = tmax, zero, zero, zero
    if flat.points.shape[0]:
        kx, ky, kz, sx, sy, sz = shear(dx, dy, dz)
        ix, iy, iz = one / dx, one / dy, one / dz
        nx, ny, nz = _near_sides(ix, iy, iz)
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            node = stack[top]
            if _enter(flat.bounds, node, ox, oy, oz, ix, iy, iz, nx, ny, nz, tmin, tmax) == math.inf:
                continue
            n = flat.size[node]
            first = flat.child[node]
            if n == 0:
                stack[top] = first + 1
                stack[top + 1] = first
                top += 2
                continue
            for i in range(first, first + n):
                mine = flat.object[i]
                if (other and flat.face[i] == face) or (other < 2 and owner >= 0 and mine > owner):
                    continue
                t, b0, b1, b2 = ray_triangle(ox, oy, oz, kx, ky, kz, sx, sy, sz, flat.points, i)
                if t >= tmin and t <= tmax and (owner < 0 or t < best or (other < 2 and mine < owner)):
                    triangle, owner, best, c0, c1, c2 = i, mine, t, b0, b1, b2
    if spheres is not None:
        for i in range(spheres.radius.size):
            mine = spheres.object[i]
            if (other and mine == winner) or (other < 2 and owner >= 0 and mine >= owner):
                continue
            t0, t1 = sphere_roots(spheres, i, ox, oy, oz, dx, dy, dz)
            for t in (t0, t1):
                if t >= tmin and t <= tmax and ball != i and (other < 2 or owner < 0 or t < best):
                    triangle, ball, owner, best = -1, i, mine, t
    return triangle, ball, best, c0, c1, c2, owner


@kernel
def closest_sphere(spheres, ox, oy, oz, dx, dy, dz, tmin, tmax, skip):
    """The nearest analytic sphere: (sphere or -1, t). ``skip`` is left by the ray from outside and not hit again."""
    hit, best = -1, tmax
    for i in range(spheres.radius.size):
        if i == skip:
            continue
        t0, t1 = sphere_roots(spheres, i, ox, oy, oz, dx, dy, dz)
        t = t0 if t0 > tmin else t1
        if t > tmin and t < best:
            hit, best = i, t
    return hit, best


@kernel
def sphere_roots(spheres, i, ox, oy, oz, dx, dy, dz):
    """Both roots of a world-space ray against sphere ``i``; an affine map keeps t."""
    m = spheres.to_local[i]
    return ray_sphere(
        m[0] * ox + m[1] * oy + m[2] * oz + m[3],
        m[4] * ox + m[5] * oy + m[6] * oz + m[7],
        m[8] * ox + m[9] * oy + m[10] * oz + m[11],
        m[0] * dx + m[1] * dy + m[2] * dz,
        m[4] * dx + m[5] * dy + m[6] * dz,
        m[8] * dx + m[9] * dy + m[10] * dz,
        spheres.radius[i],
    )


@kernel
def cancelling(spheres, i, ox, oy, oz, dx, dy, dz):
    """|O - C|^2 / r of sphere ``i`` in the world's unit: a relative error of |O - C|^2 puts a hit so much off it.

    An error e of the discriminant moves t by e / (2 sqrt(discriminant)), and the hit by its cosine times as much along
    the normal; both are r cos: e / (2 r), from wherever the sphere is seen.
    """
    m = spheres.to_local[i]
    lx = m[0] * ox + m[1] * oy + m[2] * oz + m[3]
    ly = m[4] * ox + m[5] * oy + m[6] * oz + m[7]
    lz = m[8] * ox + m[9] * oy + m[10] * oz + m[11]
    ux, uy, uz = (
        m[0] * dx + m[1] * dy + m[2] * dz, m[4] * dx + m[5] * dy + m[6] * dz, m[8] * dx + m[9] * dy + m[10] * dz
    )  # fmt: skip
    return (lx * lx + ly * ly + lz * lz) / (spheres.radius[i] * math.sqrt(ux * ux + uy * uy + uz * uz))


@kernel
def let_through(secondary, material, transparent, one):
    """1 - the opacity of ``material``; without secondary rays in the scene every surface is opaque.

    ``transparent`` 1 takes transparent surfaces for opaque, 2 lets all light through glass, 3 its transmission (the
    mean of the channels).
    """
    if secondary is None:
        return one - one
    c = secondary.coefficients[material]
    if transparent == 1:
        return one - one
    if transparent == 2 and (c[4] > 0 or c[5] > 0 or c[6] > 0):
        return one
    if transparent == 3:
        return one - c[0] + (c[4] + c[5] + c[6]) / type(one)(3)
    return one - c[0]


@kernel
def rises(flat, i, dx, dy, dz):
    """The facet's own g.L, g not normalised, of triangle ``i`` and the direction L = (dx, dy, dz)."""
    p = flat.points[i]
    ex, ey, ez = p[3] - p[0], p[4] - p[1], p[5] - p[2]
    fx, fy, fz = p[6] - p[0], p[7] - p[1], p[8] - p[2]
    return (ey * fz - ez * fy) * dx + (ez * fx - ex * fz) * dy + (ex * fy - ey * fx) * dz


@kernel
def hollow(flat, i, dx, dy, dz, side):
    """Whether N.L falls along the direction L on triangle ``i``, as its interpolated normals imply.

    A smooth surface that is hollow there meets a ray of small N.L again after 2 N.L over its curvature: the point is in
    shadow. But the facet turns its back to the light, so its shadow ray slips out behind the neighbours: a leak.
    """
    p = flat.points[i]
    ex, ey, ez = p[3] - p[0], p[4] - p[1], p[5] - p[2]
    fx, fy, fz = p[6] - p[0], p[7] - p[1], p[8] - p[2]
    gx, gy, gz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    # the change of the barycentric coordinates b1 and b2 along L, times |g|^2
    d1 = (dy * fz - dz * fy) * gx + (dz * fx - dx * fz) * gy + (dx * fy - dy * fx) * gz
    d2 = (ey * dz - ez * dy) * gx + (ez * dx - ex * dz) * gy + (ex * dy - ey * dx) * gz
    c0, c1, c2 = flat.corner[i]
    n = flat.normal
    first = (n[c1, 0] - n[c0, 0]) * dx + (n[c1, 1] - n[c0, 1]) * dy + (n[c1, 2] - n[c0, 2]) * dz
    second = (n[c2, 0] - n[c0, 0]) * dx + (n[c2, 1] - n[c0, 1]) * dy + (n[c2, 2] - n[c0, 2]) * dz
    return (d1 * first + d2 * second) * side < 0


@kernel
def excused(flat, i, b0, b1, b2, t, dx, dy, dz, side, slope, depth):
    """Whether the hit of a shadow ray that started beneath its own facet is facet self-shadow, not a real shadow.

    The ray must leave the body there (``side`` is -1 where the viewer sees the mesh from behind), and its chord of
    length ``t`` must stay within the sagitta: a smooth curve that leaves the chord's ends with the slopes N'.L deviates
    from it by at most t/4 times the larger slope. ``slope`` and ``depth`` are those of the chord's start.
    """
    if flat.sagitta[i] < 0 or rises(flat, i, dx, dy, dz) * side <= 0:
        return False
    c0, c1, c2 = flat.corner[i]
    n = flat.normal
    nx = b0 * n[c0, 0] + b1 * n[c1, 0] + b2 * n[c2, 0]
    ny = b0 * n[c0, 1] + b1 * n[c1, 1] + b2 * n[c2, 1]
    nz = b0 * n[c0, 2] + b1 * n[c1, 2] + b2 * n[c2, 2]
    end = abs(nx * dx + ny * dy + nz * dz) / math.sqrt(nx * nx + ny * ny + nz * nz)
    return t * max(slope, end) <= type(t)(4) * max(depth, flat.sagitta[i])


@kernel
def _stepped(
    flat, spheres, secondary, ox, oy, oz, dx, dy, dz, tmin, tmax, skip, own, sphere, side, slope, depth, transparent,
    culled, gap, whole, stack,
):  # fmt: skip
    """As ``transmittance``, from one crossing to the next: of those within ``gap`` of the last one none counts.

    ``skip`` is the face that the ray leaves, ``own`` the object whose facets may be forgiven, or -1. ``whole``: of an
    object that is met within ``gap`` the next crossing does not count either, where the ray leaves it again.
    """
    one = type(dx)(1)
    light, forgiven = one, False
    last, lost = type(dx)(-math.inf), -1
    while True:
        i, t, b0, b1, b2 = closest(
            flat.bounds, flat.child, flat.size, flat.points, flat.face, ox, oy, oz, dx, dy, dz, tmin, tmax, skip, stack
        )
        ball = -1
        if spheres is not None:
            ball, ts = closest_sphere(spheres, ox, oy, oz, dx, dy, dz, tmin, t, sphere)
            if ball >= 0:
                i, t = -1, ts
        if i < 0 and ball < 0:
            return light, forgiven
        if i >= 0:
            excuse = flat.object[i] == own and excused(flat, i, b0, b1, b2, t, dx, dy, dz, side, slope, depth)
            if excuse or (culled and rises(flat, i, dx, dy, dz) > 0):
                forgiven = forgiven or excuse
                tmin = t
                continue
        owner = flat.object[i] if i >= 0 else spheres.object[ball] if spheres is not None else 0
        if whole and (t - last < gap or owner == lost):
            lost = owner if t - last < gap else -1
            last = tmin = t
            continue
        light *= let_through(secondary, flat.material[owner], transparent, one)
        if light <= one - one:
            return light, False
        last, tmin = t, t if whole else t + gap


@kernel
def transmittance(
    flat,
    spheres,
    secondary,
    ox,
    oy,
    oz,
    dx,
    dy,
    dz,
    tmin,
    tmax,
    triangle,
    sphere,
    leaves,
    forgive,
    side,
    slope,
    transparent,
    culled,
    gap,
    whole,
    stack,
):
    """The share of light that reaches (ox, oy, oz) along a unit direction, and whether facets of its own were forgiven.

    ``triangle`` and ``sphere`` (or -1) are what the point lies on; the sphere is never hit, nor is the triangle's face
    if the ray ``leaves`` it exactly. ``forgive`` 1 is the reference: where the facet turns its back to the light (the
    interpolated normal does not, or nobody would ask), its ray runs beneath the surface. Then hits on the same mesh
    are passed over where ``excused`` says so, and light into a ``hollow`` is held back; both count as forgiven. At a
    corner, where facets disagree, ``forgive`` 2 asks ``excused`` whichever way this one faces. ``side`` is -1 where the
    point is seen from behind, ``slope`` its N'.L. Each crossing of a surface with opacity attenuates by 1 - opacity, or
    as ``transparent`` has it (see ``let_through``); within ``gap`` of the start and of the last one there is none
    (``whole``: see ``_stepped``).
    ``culled`` is the fault of passing through faces that the ray meets from behind.
    """
    one, zero = type(dx)(1), type(dx)(0)
    light = one
    forgiven = False
    face, owner, depth, own_mesh = -1, -1, zero, False
    if triangle >= 0:
        owner, depth = flat.object[triangle], flat.sagitta[triangle]
        if leaves:
            face = flat.face[triangle]
        under = forgive > 0 and depth >= 0 and rises(flat, triangle, dx, dy, dz) * side <= 0
        if under and hollow(flat, triangle, dx, dy, dz, side):
            return zero, True
        own_mesh = under or (forgive > 1 and depth >= 0)
    if gap > zero:
        return _stepped(
            flat, spheres, secondary, ox, oy, oz, dx, dy, dz, max(tmin, gap), tmax, face, owner if own_mesh else -1,
            sphere, side, slope, depth, transparent, culled, gap, whole, stack,
        )  # fmt: skip
    bounds, child, count, points = flat.bounds, flat.child, flat.size, flat.points
    if points.shape[0]:
        kx, ky, kz, sx, sy, sz = shear(dx, dy, dz)
        ix, iy, iz = one / dx, one / dy, one / dz
        nx, ny, nz = _near_sides(ix, iy, iz)
        stack[0] = 0
        top = 1
        while top:
            top -= 1
            node = stack[top]
            if _enter(bounds, node, ox, oy, oz, ix, iy, iz, nx, ny, nz, tmin, tmax) == math.inf:
                continue
            n = count[node]
            first = child[node]
            if n == 0:
                stack[top] = first + 1
                stack[top + 1] = first
                top += 2
                continue
            for i in range(first, first + n):
                t, b0, b1, b2 = ray_triangle(ox, oy, oz, kx, ky, kz, sx, sy, sz, points, i)
                if t > tmin and t < tmax and flat.face[i] != face:
                    if culled and rises(flat, i, dx, dy, dz) > 0:
                        continue
                    own = own_mesh and flat.object[i] == owner
                    if own and excused(flat, i, b0, b1, b2, t, dx, dy, dz, side, slope, depth):
                        forgiven = True
                        continue
                    light *= let_through(secondary, flat.material[flat.object[i]], transparent, one)
                    if light <= zero:
                        return zero, False
    if spheres is not None:
        for i in range(spheres.radius.size):
            if i == sphere:
                continue
            t0, t1 = sphere_roots(spheres, i, ox, oy, oz, dx, dy, dz)
            crossings = int(tmin < t0 < tmax) + int(tmin < t1 < tmax)
            for _ in range(crossings):
                light *= let_through(secondary, flat.material[spheres.object[i]], transparent, one)
            if light <= zero:
                return zero, False
    return light, forgiven


@kernel
def trace(flat, origins, directions, hits, distances, barycentric, stack):
    """Closest triangles for many rays, (n, 3) origins and directions; fills (n,), (n,), (n, 3); ``stack`` (STACK,)."""
    zero, far = type(origins[0, 0])(0), type(origins[0, 0])(math.inf)
    for r in range(len(origins)):
        ox, oy, oz = origins[r, 0], origins[r, 1], origins[r, 2]
        dx, dy, dz = directions[r, 0], directions[r, 1], directions[r, 2]
        i, t, b0, b1, b2 = closest(
            flat.bounds, flat.child, flat.size, flat.points, flat.face, ox, oy, oz, dx, dy, dz, zero, far, -1, stack
        )
        hits[r] = i
        distances[r] = t
        barycentric[r, 0], barycentric[r, 1], barycentric[r, 2] = b0, b1, b2
