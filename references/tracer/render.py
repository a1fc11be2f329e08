"""The picture kernel: camera rays, lights, Whitted's recursion, and statistics of the subsamples of each pixel."""

from __future__ import annotations

import math

import numpy as np

from notabug.references.tracer.bvh import STACK
from notabug.references.tracer.envelope import SEEN
from notabug.references.tracer.jit import kernel
from notabug.references.tracer.shade import albedo, corner, corner_weights, highlight, screen_weights
from notabug.references.tracer.start import ABSOLUTE, ERROR_BOUND, bounded, clearance
from notabug.references.tracer.traverse import cancelling, closest, closest_sphere, excused, rises, rival, transmittance

# Columns of the options array: see Options in envelope.py.
(
    SHADOWS,
    NORMALS,
    SILHOUETTE,
    AFFINE,
    RAW_VECTORS,
    UNCUT,
    MIRRORED,
    RETRO,
    TRANSPARENT,
    TIE,
    ACNE,
    WHOLE,
    SELF_REFLECTION,
    SELF_REFRACTION,
    COUNTED,
    GOURAUD,
    START,
    REFINE,
    FALLOFF,
    SHADOW_RAYS,
    LOST,
    BOUNCES,
    COUNT_PASSAGES,
    NEAREST,
    GAP_LOSES,
) = range(25)
# Columns of the numbers array.
RESOLUTION, NEAR_RESOLUTION, HIT_ERROR, EPSILON, OFFSET, SHADOW_GAP, RAY_GAP, SPHERE_ERROR = range(8)
EXACT = 2.0**-25  # of the scene's size: what float32 points of one place may lie apart; nearer, surfaces coincide
FACING = 1048573  # a prime: of the lights that make highlights so much goes into what is seen
DARK = 8388593  # a prime below 2^23: of the lights that are blocked so much goes into the bits above
RAY = 15  # columns of a ray that waits: see radiance
PROBES = 8  # halvings of the way between two samples of a pixel
PENDING = 64  # rays that may wait in the recursion's stack: three a hit, one of them followed at once
PASSAGES = 64  # straight passages through opacity a path may have; they are no bounces


@kernel
def _uniform(pixel, sample, seed, axis):
    """A uniform number in [0, 1) from a counter (splitmix64; Steele, Lea and Flood 2014): the same on every machine."""
    z = np.uint64(pixel) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(sample) * np.uint64(0xD1B54A32D192ED03)
    z += np.uint64(seed) * np.uint64(0x8CB92BA72F3D8DD7) + np.uint64(axis) * np.uint64(0xABC98388FB8FAC03)
    for _ in range(2):
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return np.float64(z >> np.uint64(11)) * 2.0**-53


@kernel
def radiance(
    flat,
    quads,
    textures,
    spheres,
    lobes,
    secondary,
    option,
    number,
    pixel_angle,
    ox,
    oy,
    oz,
    dx,
    dy,
    dz,
    near,
    far,
    stack,
    rays,
):
    """Radiance along a ray: (r, g, b, id, forgiven).

    ``id`` tells apart what must not be mixed: in its lower bits, SEEN, the object, on flat facets the normal, and the
    lights whose highlights are not cut off; in the upper ones the lights that are blocked; 0 is the background.
    ``forgiven`` is True where the first hit was spared facet self-shadow. ``stack`` and ``rays`` (PENDING, RAY) are
    work space.
    """
    zero, one = type(dx)(0), type(dx)(1)
    r, g, b = zero, zero, zero
    seen, dark = 0, 0
    spared = False
    rays[0, 0], rays[0, 1], rays[0, 2] = ox, oy, oz
    rays[0, 3], rays[0, 4], rays[0, 5] = dx, dy, dz
    rays[0, 6], rays[0, 7], rays[0, 8] = one, one, one
    rays[0, 9], rays[0, 10], rays[0, 11] = zero, -one, -one  # depth, face and sphere that the ray leaves
    rays[0, 12], rays[0, 13], rays[0, 14] = zero, -one, -one  # N'.D, triangle that it leaves beneath, glass it is in
    wx, wy, wz = -dx, -dy, -dz
    pending = 1
    unit = type(dx)(1.1920929e-07 if flat.points.itemsize == 4 else 2.220446049250313e-16)
    inverse_pi = type(dx)(1 / math.pi)
    while pending:
        pending -= 1
        ox, oy, oz = rays[pending, 0], rays[pending, 1], rays[pending, 2]
        dx, dy, dz = rays[pending, 3], rays[pending, 4], rays[pending, 5]
        wr, wg, wb = rays[pending, 6], rays[pending, 7], rays[pending, 8]
        generation, skip, skip_sphere = int(rays[pending, 9]), int(rays[pending, 10]), int(rays[pending, 11])
        slope, beneath, inside = rays[pending, 12], int(rays[pending, 13]), int(rays[pending, 14])
        depth = generation // PASSAGES
        tmin = near
        if generation:
            tmin = max(clearance(flat, option[START], number[EPSILON], unit, ox, oy, oz), type(dx)(number[RAY_GAP]))
        if option[START]:
            skip, skip_sphere = -1, -1
        i, t, b0, b1, b2 = closest(
            flat.bounds, flat.child, flat.size, flat.points, flat.face, ox, oy, oz, dx, dy, dz, tmin, far, skip, stack
        )
        while beneath >= 0 and i >= 0 and flat.object[i] == flat.object[beneath]:
            # beneath its own facet, above the smooth surface: what the ray meets there is no surface
            turn = one if rises(flat, beneath, dx, dy, dz) <= 0 else -one
            if not excused(flat, i, b0, b1, b2, t, dx, dy, dz, turn, slope, flat.sagitta[beneath]):
                break
            tmin, skip = t, flat.face[i]
            i, t, b0, b1, b2 = closest(
                flat.bounds, flat.child, flat.size, flat.points, flat.face, ox, oy, oz, dx, dy, dz, tmin, far, skip,
                stack,
            )  # fmt: skip
        ball = -1
        if spheres is not None:
            ball, ts = closest_sphere(spheres, ox, oy, oz, dx, dy, dz, tmin, t, skip_sphere)
            if ball >= 0:
                i, t = -1, ts
        if i < 0 and ball < 0:
            continue
        unlit, blend = False, -1
        extent = flat.radius * type(dx)(EXACT) + type(dx)(32) * unit * t
        between = extent
        if option[TIE] > 0:
            # of coincident surfaces the first of the scene wins; within the renderer's resolution another one may
            found = spheres.object[ball] if ball >= 0 and spheres is not None else flat.object[i]
            triangle, sphere, along, a0, a1, a2, winner = rival(
                flat, spheres, ox, oy, oz, dx, dy, dz, t - extent, t + extent, found, -1, 0, stack
            )
            if winner >= 0 and winner != found:
                i, ball, t, b0, b1, b2, found = triangle, sphere, along, a0, a1, a2, winner
            if option[TIE] > 1:
                axial = t * abs(dx * flat.camera[9] + dy * flat.camera[10] + dz * flat.camera[11])
                extent += type(dx)(number[RESOLUTION]) * (t + flat.radius + abs(ox) + abs(oy) + abs(oz))
                extent += type(dx)(number[NEAR_RESOLUTION]) * axial * t
                triangle, sphere, along, a0, a1, a2, winner = rival(
                    flat, spheres, ox, oy, oz, dx, dy, dz, t - extent, t + extent, found,
                    flat.face[i] if i >= 0 else -1, 2 if option[TIE] == 6 else 1, stack,
                )  # fmt: skip
                if winner >= 0:
                    between = max(between, abs(along - t))
                    if option[TIE] == 5:  # a hole: the fault of losing both
                        continue
                    if option[TIE] == 4:
                        blend = flat.material[winner]
                    if option[TIE] == 2 or option[TIE] == 6:
                        i, ball, t, b0, b1, b2 = triangle, sphere, along, a0, a1, a2
                    unlit = option[TIE] == 3
        x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
        vx, vy, vz = -dx, -dy, -dz
        u, v, face, sag = zero, zero, -1, -one
        affine = option[AFFINE] != 0
        c0, c1, c2, c3, w0, w1, w2, w3, sides = 0, 0, 0, 0, zero, zero, zero, zero, 3
        if i >= 0:
            face = flat.face[i]
            owner = flat.object[i]
            p = flat.points[i]
            ex, ey, ez = p[3] - p[0], p[4] - p[1], p[5] - p[2]
            fx, fy, fz = p[6] - p[0], p[7] - p[1], p[8] - p[2]
            gx, gy, gz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
            length = math.sqrt(gx * gx + gy * gy + gz * gz)
            gx, gy, gz = gx / length, gy / length, gz / length
            side = one if gx * vx + gy * vy + gz * vz >= 0 else -one
            if option[REFINE]:  # the ray shot back at the facet's plane takes off what t was too long
                back = ((x - p[0]) * gx + (y - p[1]) * gy + (z - p[2]) * gz) / (dx * gx + dy * gy + dz * gz)
                x, y, z = x - back * dx, y - back * dy, z - back * dz
            c0, c1, c2, c3, w0, w1, w2, w3 = corner_weights(flat, quads, i, b0, b1, b2, x, y, z)
            sag = flat.sagitta[i]
            nx, ny, nz = gx, gy, gz
            if sag >= 0:
                n = flat.normal
                nx = w0 * n[c0, 0] + w1 * n[c1, 0] + w2 * n[c2, 0] + w3 * n[c3, 0]
                ny = w0 * n[c0, 1] + w1 * n[c1, 1] + w2 * n[c2, 1] + w3 * n[c3, 1]
                nz = w0 * n[c0, 2] + w1 * n[c1, 2] + w2 * n[c2, 2] + w3 * n[c3, 2]
                if option[NORMALS] == 0:
                    length = math.sqrt(nx * nx + ny * ny + nz * nz)
                    nx, ny, nz = nx / length, ny / length, nz / length
            if quads is not None and quads.of_triangle[i] >= 0:
                sides = 4
            if textures is not None:
                m0, m1, m2, m3 = w0, w1, w2, w3
                if affine:
                    m0, m1, m2 = screen_weights(flat, i, b0, b1, b2)
                    m3 = zero
                u = m0 * flat.uv[c0, 0] + m1 * flat.uv[c1, 0] + m2 * flat.uv[c2, 0] + m3 * flat.uv[c3, 0]
                v = m0 * flat.uv[c0, 1] + m1 * flat.uv[c1, 1] + m2 * flat.uv[c2, 1] + m3 * flat.uv[c3, 1]
        else:
            side = one
            owner = 0
            nx, ny, nz = zero, zero, one
            if spheres is not None:
                owner = spheres.object[ball]
                m = spheres.to_local[ball]
                hx = m[0] * x + m[1] * y + m[2] * z + m[3]
                hy = m[4] * x + m[5] * y + m[6] * z + m[7]
                hz = m[8] * x + m[9] * y + m[10] * z + m[11]
                nx = m[0] * hx + m[4] * hy + m[8] * hz  # the inverse transpose of to_world
                ny = m[1] * hx + m[5] * hy + m[9] * hz
                nz = m[2] * hx + m[6] * hy + m[10] * hz
                length = math.sqrt(nx * nx + ny * ny + nz * nz)
                nx, ny, nz = nx / length, ny / length, nz / length
                if nx * vx + ny * vy + nz * vz < 0:
                    side = -one
            gx, gy, gz = nx, ny, nz
        nx, ny, nz = nx * side, ny * side, nz * side
        painted, turned = True, False
        if nx * vx + ny * vy + nz * vz < 0:
            if option[SILHOUETTE] == 1 or option[SILHOUETTE] == 3:
                turned = option[SILHOUETTE] == 3
                nx, ny, nz = -nx, -ny, -nz
            elif option[SILHOUETTE] == 2:
                painted = False
        material = flat.material[owner]
        ar, ag, ab = albedo(flat, textures, material, u, v, option[NEAREST])
        if blend >= 0:
            half = one / type(dx)(2)
            br, bg, bb = albedo(flat, textures, blend, u, v, option[NEAREST])
            ar, ag, ab = half * (ar + br), half * (ag + bg), half * (ab + bb)
        opaque = one
        if secondary is not None:
            opaque = secondary.coefficients[material, 0]
        sr, sg, sb = zero, zero, zero
        blocked, facing = 0, 0
        forgiven_here = False
        start = clearance(flat, option[START], number[EPSILON], unit, x, y, z)
        sx, sy, sz, beside = x, y, z, zero  # where rays leave from, and how far beside it, on the side they go to
        if option[START] == ERROR_BOUND:
            sx, sy, sz, beside = bounded(flat, spheres, i, ball, b0, b1, b2, x, y, z, gx, gy, gz, unit)
        beside *= side
        lift = type(dx)(number[OFFSET]) * max(sag, zero)  # Snyder and Barr 1987: outwards by the facet's sagitta
        leaves = option[START] == 0
        gouraud = option[GOURAUD] != 0 and sag >= 0
        shadowed_here = not gouraud or option[GOURAUD] == 2  # at the point itself, not at the corners
        px, py, pz, qx, qy, qz = x, y, z, nx, ny, nz
        ex, ey, ez = sx, sy, sz
        share_of_corner = one
        for turn in range(flat.light.shape[0] * (sides if gouraud else 1) if painted or gouraud else 0):
            k = turn % flat.light.shape[0]
            if gouraud:  # the same light at the facet's corners, as seen from where the ray started
                which = turn // flat.light.shape[0]
                x, y, z, nx, ny, nz, vx, vy, vz, share_of_corner = corner(
                    flat, quads, i, which, c0 if which == 0 else c1 if which == 1 else c2 if which == 2 else c3,
                    w0 if which == 0 else w1 if which == 1 else w2 if which == 2 else w3, side, ox, oy, oz,
                    option[SILHOUETTE],
                )  # fmt: skip
                if not shadowed_here:
                    ex, ey, ez = x, y, z
            light = flat.light[k]
            if light[0] == 0:
                lx, ly, lz = light[1] - x, light[2] - y, light[3] - z
                distance = math.sqrt(lx * lx + ly * ly + lz * lz)
                lx, ly, lz = lx / distance, ly / distance, lz / distance
                end = distance
                falloff = one / (distance * distance)
                if option[FALLOFF]:
                    falloff = one / distance if option[FALLOFF] == 1 else one
                if option[SHADOW_RAYS] == 1:
                    end = type(dx)(math.inf)
            else:
                lx, ly, lz = -light[1], -light[2], -light[3]
                distance = end = type(dx)(math.inf)
                falloff = one
            nl = nx * lx + ny * ly + nz * lz
            if nl <= 0 and not (option[UNCUT] and lobes is not None):
                continue
            if lobes is not None and not gouraud:  # a highlight ends abruptly where N.L = 0; diffuse light does not
                facing |= 1 << k
            share = one
            dark = unlit
            if (option[ACNE] >> k) & 1:
                # the hit's own error lifts it off or sinks it in; the light meets the surface again at error / N.L,
                # and an epsilon of more than half a pixel's footprint would detach shadows that are real
                reach = abs(ox) + abs(oy) + abs(oz) + t + abs(x) + abs(y) + abs(z)
                steep = abs(gx * lx + gy * ly + gz * lz)
                limit = pixel_angle * t
                if option[START] == ABSOLUTE:  # or what the renderer's own epsilon prevents
                    limit = type(dx)(number[EPSILON])
                off = type(dx)(number[HIT_ERROR]) * reach
                if ball >= 0 and spheres is not None:
                    off += type(dx)(number[SPHERE_ERROR]) * cancelling(spheres, ball, ox, oy, oz, dx, dy, dz)
                if off > steep * limit:
                    dark = True
            begin = start
            if option[TIE] > 0:  # what coincides with this surface does not shadow it
                begin += type(dx)(4) * between / max(abs(gx * lx + gy * ly + gz * lz), type(dx)(0.001))
            if dark:
                share = zero
            elif option[SHADOWS] != 2 and nl > 0 and not turned and not (gouraud and option[GOURAUD] == 3):
                # behind, an uncut highlight belongs to a shader without shadows
                tx, ty, tz, slant = lx, ly, lz, nl
                if gouraud and shadowed_here and light[0] == 0:
                    tx, ty, tz = light[1] - px, light[2] - py, light[3] - pz
                    span = math.sqrt(tx * tx + ty * ty + tz * tz)
                    tx, ty, tz = tx / span, ty / span, tz / span
                    end = span if option[SHADOW_RAYS] != 1 else end
                if gouraud and shadowed_here:
                    slant = max(qx * tx + qy * ty + qz * tz, zero)
                gl = (gx * tx + gy * ty + gz * tz) * side
                to = beside if gl > 0 else -beside
                share, forgiven = transmittance(
                    flat, spheres, secondary,
                    ex + to * gx + lift * nx, ey + to * gy + lift * ny, ez + to * gz + lift * nz,
                    tx, ty, tz, begin, end, i, ball if gl > 0 and leaves else -1, leaves,
                    (1 if shadowed_here else 2) if option[SHADOWS] == 0 else 0, side, slant, option[TRANSPARENT],
                    option[SHADOW_RAYS] == 2, type(dx)(number[SHADOW_GAP]), option[GAP_LOSES] != 0, stack,
                )  # fmt: skip
                forgiven_here = forgiven_here or forgiven
            if share <= 0:
                blocked |= 1 << k if shadowed_here else 0
                continue
            if share < one and shadowed_here:  # the border of a transparent shadow is an edge too
                blocked += 65536 * (k + 1) * round(share * 1000)
            e = falloff * share * inverse_pi * share_of_corner
            ux, uy, uz = vx, vy, vz
            if depth > 0 and option[MIRRORED] == 1:  # the fault of one view vector for all rays: the camera's
                ux, uy, uz = wx, wy, wz
            raw = zero
            if option[RAW_VECTORS]:
                raw = distance if light[0] == 0 else one
            h = highlight(lobes, material, nx, ny, nz, lx, ly, lz, ux, uy, uz, raw)
            if depth > 0 and option[MIRRORED] == 2:
                h = zero
            er, eg, eb = e * light[4], e * light[5], e * light[6]
            sr += er * ar * max(nl, zero)
            sg += eg * ag * max(nl, zero)
            sb += eb * ab * max(nl, zero)
            if lobes is not None:
                sr += er * h * lobes.specular[material, 0]
                sg += eg * h * lobes.specular[material, 1]
                sb += eb * h * lobes.specular[material, 2]
        x, y, z, nx, ny, nz = px, py, pz, qx, qy, qz
        vx, vy, vz = -dx, -dy, -dz
        r += wr * opaque * sr
        g += wg * opaque * sg
        b += wb * opaque * sb
        seen, dark = seen * 31 + (owner + 1) + FACING * facing, dark * 31 + blocked
        if sag <= 0 and i >= 0:
            seen += 67108864 * (round(gx * 512) + 7 * round(gy * 512) + 49 * round(gz * 512))
        if generation == 0:
            spared = forgiven_here
        if secondary is not None:
            c = secondary.coefficients[material]
            passed = generation % PASSAGES
            spent = depth + (passed if option[COUNT_PASSAGES] else 0)
            nv = nx * vx + ny * vy + nz * vz
            two = type(dx)(2)
            mx, my, mz = two * nv * nx - vx, two * nv * ny - vy, two * nv * nz - vz
            if option[RETRO] == 1:
                mx, my, mz = vx, vy, vz
            elif option[RETRO] == 2 and nx * nx + nz * nz > 0:
                swing = two * (mx * nz - mz * nx) / (nx * nx + nz * nz)  # along y x N
                mx, mz = mx - swing * nz, mz + swing * nx
            mr, mg, mb = c[1], c[2], c[3]
            if spent < option[BOUNCES] and (c[4] > 0 or c[5] > 0 or c[6] > 0):
                enters = inside != owner if option[COUNTED] else side > 0
                eta = one / c[7] if enters else c[7]
                k2 = one - eta * eta * (one - nv * nv)
                if k2 < 0:  # total internal reflection: the ray goes on as a mirror ray
                    if not option[LOST]:
                        mr, mg, mb = mr + c[4], mg + c[5], mb + c[6]
                    if option[WHOLE]:
                        mr, mg, mb = one, one, one
                elif pending < PENDING:
                    s = eta * nv - math.sqrt(k2)
                    rx, ry, rz = s * nx - eta * vx, s * ny - eta * vy, s * nz - eta * vz
                    # N' and the facet disagree about whether it has come through
                    low = sag >= 0 and not option[SELF_REFRACTION] and (gx * rx + gy * ry + gz * rz) * side > 0
                    pending = _push(
                        rays, pending, sx - beside * gx, sy - beside * gy, sz - beside * gz, rx, ry, rz,
                        wr * c[4], wg * c[5], wb * c[6], generation + PASSAGES,
                        face, -1, -(nx * rx + ny * ry + nz * rz), i if low else -1, owner if enters else -1,
                    )  # fmt: skip
            if spent < option[BOUNCES] and (mr > 0 or mg > 0 or mb > 0) and pending < PENDING:
                rising = (gx * mx + gy * my + gz * mz) * side > 0
                to = beside if rising else -beside
                low = sag >= 0 and not option[SELF_REFLECTION] and not rising
                pending = _push(
                    rays, pending, sx + to * gx, sy + to * gy, sz + to * gz, mx, my, mz, wr * mr, wg * mg, wb * mb,
                    generation + PASSAGES, face, ball if rising and side > 0 else -1,
                    nv, i if low and nv > 0 else -1, inside,
                )  # fmt: skip
            on = passed < PASSAGES - 1 and (spent < option[BOUNCES] or not option[COUNT_PASSAGES])
            if opaque < 1 and pending < PENDING and on:
                rest = one - opaque
                pending = _push(
                    rays, pending, sx - beside * gx, sy - beside * gy, sz - beside * gz, dx, dy, dz,
                    wr * rest, wg * rest, wb * rest, generation + 1, face, -1, zero, -1, inside,
                )  # fmt: skip
    return r, g, b, (seen & SEEN) | ((dark % DARK) << 40), spared


@kernel
def _push(rays, n, ox, oy, oz, dx, dy, dz, wr, wg, wb, generation, face, ball, slope, beneath, inside):
    ray = rays[n]
    ray[12], ray[13], ray[14] = slope, beneath, inside
    ray[0], ray[1], ray[2], ray[3], ray[4], ray[5] = ox, oy, oz, dx, dy, dz
    ray[6], ray[7], ray[8], ray[9], ray[10], ray[11] = wr, wg, wb, generation, face, ball
    return n + 1


def work_space(dtype):
    """What one thread's calls of the kernels need: (stack, rays)."""
    return np.empty(STACK, np.int32), np.empty((PENDING, RAY), dtype)


@kernel
def render_pixels(
    flat, option, number, width, height, pixels, grid, samples, seed, mean, variance, lo, hi, ids, mixed, spared,
    stack, rays,
):  # fmt: skip
    """Render the pixels numbered y * width + x in ``pixels`` into the full-size arrays.

    ``samples`` positions a pixel: a regular ``grid`` x ``grid`` (grid > 0), the lattice whose generator is -``grid``
    (see ``envelope.lattice``), or uniformly random ones drawn from ``seed`` (0). Fills (h, w, 3) ``mean``,
    ``variance`` (of one sample), ``lo``, ``hi``; (h, w) ``ids`` of the first sample, ``mixed``: 1 where ids differ
    within the pixel, 2 where only the lights that are blocked do, from one sample to the next, or 3; ``spared`` the
    share of samples that were spared facet self-shadow. ``stack`` and ``rays`` are the work space that
    ``work_space`` makes.
    """
    c = flat.camera
    one, half, two = type(c[0])(1), type(c[0])(0.5), type(c[0])(2)
    half_pixel = math.sqrt(c[3] * c[3] + c[4] * c[4] + c[5] * c[5]) / type(half)(width)
    for pixel in pixels:
        row, column = pixel // width, pixel % width
        sr, sg, sb, qr, qg, qb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        first, last, differ, excuses, probes = 0, 0, 0, 0, 0
        jx, jy, ax, ay, bx, by, px, py, at, beyond = half, half, half, half, half, half, half, half, 0, 0
        for s in range(samples + PROBES):
            if s >= samples:  # halfway between two samples that see other objects, to what lies hidden at their border
                if s == samples + probes:
                    break
                jx, jy = (ax + bx) * half, (ay + by) * half
            elif grid > 0:
                cells = type(half)(grid)
                jx, jy = (type(half)(s % grid) + half) / cells, (type(half)(s // grid) + half) / cells
            elif grid < 0:
                cells = type(half)(samples)
                jx, jy = (type(half)(s) + half) / cells, (type(half)((-grid * s) % samples) + half) / cells
            else:
                jx, jy = type(half)(_uniform(pixel, s, seed, 0)), type(half)(_uniform(pixel, s, seed, 1))
            a = two * (type(half)(column) + jx) / type(half)(width) - one
            b = one - two * (type(half)(row) + jy) / type(half)(height)
            dx = a * c[3] + b * c[6] + c[9]
            dy = a * c[4] + b * c[7] + c[10]
            dz = a * c[5] + b * c[8] + c[11]
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            dx, dy, dz = dx / length, dy / length, dz / length
            r, g, bl, identity, forgiven = radiance(
                flat, flat.quads, flat.textures, flat.spheres, flat.lobes, flat.secondary, option, number, half_pixel,
                c[0], c[1], c[2], dx, dy, dz, c[12] * length, c[13] * length, stack, rays,
            )  # fmt: skip
            if s == 0:
                first = last = identity
                for k, value in enumerate((r, g, bl)):
                    lo[row, column, k] = value
                    hi[row, column, k] = value
            elif s < samples or (identity != at and identity != beyond):
                for k, value in enumerate((r, g, bl)):
                    lo[row, column, k] = min(lo[row, column, k], value)
                    hi[row, column, k] = max(hi[row, column, k], value)
            if s >= samples:
                if identity == at:
                    ax, ay = jx, jy
                elif identity == beyond:
                    bx, by = jx, jy
                else:  # a third: thinner than the samples lie apart
                    if (identity ^ at) & SEEN == 0 or (identity ^ beyond) & SEEN == 0:
                        differ |= 2
                    break
                continue
            if identity != first:
                differ |= 1
            if identity != last and (identity ^ last) & SEEN == 0:
                differ |= 2
            if grid < 0 and probes == 0 and (identity ^ last) & SEEN != 0:
                probes = PROBES
                ax, ay, at, bx, by, beyond = px, py, last, jx, jy, identity
            px, py = jx, jy
            last = identity
            excuses += forgiven
            sr, sg, sb = sr + r, sg + g, sb + bl
            qr, qg, qb = qr + r * r, qg + g * g, qb + bl * bl
        mr, mg, mb = sr / samples, sg / samples, sb / samples
        mean[row, column, 0], mean[row, column, 1], mean[row, column, 2] = mr, mg, mb
        variance[row, column, 0] = max(qr / samples - mr * mr, 0.0)
        variance[row, column, 1] = max(qg / samples - mg * mg, 0.0)
        variance[row, column, 2] = max(qb / samples - mb * mb, 0.0)
        ids[row, column] = first
        mixed[row, column] = differ
        spared[row, column] = excuses / samples
