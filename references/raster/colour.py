"""From the winner of each sample to its radiance: the tracer's formulas, with a shadow map in the place of shadow rays.

Everything a rasteriser knows of the world is the triangle in front and the coordinates on it.
"""

from __future__ import annotations

import math

from notabug.references.tracer.jit import kernel
from notabug.references.tracer.shade import albedo, highlight

# Columns of the options array: see RasterOptions in picture.py.
NORMALS, SILHOUETTE, AFFINE = range(3)
SMOOTH, GOURAUD, FLAT = range(3)


@kernel
def in_shadow(maps, k, x, y, z):
    """Whether the map of light ``k`` shows something nearer to the light than (x, y, z), by more than the bias."""
    if maps is None:
        return False
    for m in range(maps.first[k], maps.first[k + 1]):
        v = maps.frame[m]
        x, y, z = x - v[0], y - v[1], z - v[2]
        depth = x * v[9] + y * v[10] + z * v[11]
        one = type(depth)(1)
        w = one if maps.parallel[m] else depth
        if w > 0:
            across = (x * v[3] + y * v[4] + z * v[5]) / w
            up = (x * v[6] + y * v[7] + z * v[8]) / w
            if abs(across) <= one and abs(up) <= one:
                cells = maps.depth.shape[1]
                half = type(depth)(cells) / type(depth)(2)
                column, row = min(int((across + one) * half), cells - 1), min(int((one - up) * half), cells - 1)
                return depth > maps.depth[m, row, column] + maps.bias
        x, y, z = x + v[0], y + v[1], z + v[2]
    return False


@kernel
def light_on(flat, lobes, maps, material, x, y, z, nx, ny, nz, vx, vy, vz):
    """Diffuse and specular light at a point, without the surface's colours: (dr, dg, db, sr, sg, sb)."""
    zero, one = type(x)(0), type(x)(1)
    dr, dg, db, sr, sg, sb = zero, zero, zero, zero, zero, zero
    for k in range(flat.light.shape[0]):
        light = flat.light[k]
        if light[0] == 0:
            lx, ly, lz = light[1] - x, light[2] - y, light[3] - z
            square = lx * lx + ly * ly + lz * lz
            distance = math.sqrt(square)
            lx, ly, lz = lx / distance, ly / distance, lz / distance
            falloff = one / square
        else:
            lx, ly, lz = -light[1], -light[2], -light[3]
            falloff = one
        nl = nx * lx + ny * ly + nz * lz
        if nl <= 0 or in_shadow(maps, k, x, y, z):
            continue
        h = highlight(lobes, material, nx, ny, nz, lx, ly, lz, vx, vy, vz, type(nx)(0))
        e = falloff * type(x)(1 / math.pi)
        er, eg, eb = e * light[4], e * light[5], e * light[6]
        dr, dg, db = dr + er * nl, dg + eg * nl, db + eb * nl
        sr, sg, sb = sr + er * h, sg + eg * h, sb + eb * h
    return dr, dg, db, sr, sg, sb


@kernel
def _lit(flat, lobes, maps, silhouette, material, side, x, y, z, nx, ny, nz):
    """light_on for a normal that need not be of unit length nor face the viewer."""
    c = flat.camera
    vx, vy, vz = c[0] - x, c[1] - y, c[2] - z
    scale = type(x)(1) / math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx * scale, vy * scale, vz * scale
    scale = side / math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx * scale, ny * scale, nz * scale
    if silhouette != 0 and nx * vx + ny * vy + nz * vz < 0:
        if silhouette == 2:
            zero = type(x)(0)
            return zero, zero, zero, zero, zero, zero
        nx, ny, nz = -nx, -ny, -nz
    return light_on(flat, lobes, maps, material, x, y, z, nx, ny, nz, vx, vy, vz)


@kernel
def colour(flat, lobes, textures, secondary, maps, option, order, winner, correct, affine, rest, into):
    """Add to ``into`` (rows, width, 3) the radiance of each sample's winner, weighted by what is left of ``rest``.

    ``rest`` (rows, width) is the share of light that passes all layers so far; it is multiplied by this one's
    1 - opacity. Returns whether anything is left to see behind this layer.
    """
    more = False
    n = flat.normal
    for row in range(winner.shape[0]):
        for column in range(winner.shape[1]):
            k = winner[row, column]
            if k < 0 or rest[row, column] <= 0:
                continue
            i = order[k]
            material = flat.material[flat.object[i]]
            p = flat.points[i]
            b0, b1, b2 = correct[row, column]
            x = b0 * p[0] + b1 * p[3] + b2 * p[6]
            y = b0 * p[1] + b1 * p[4] + b2 * p[7]
            z = b0 * p[2] + b1 * p[5] + b2 * p[8]
            w0, w1, w2 = b0, b1, b2
            if option[AFFINE] != 0:
                w0, w1, w2 = affine[row, column]
            ex, ey, ez = p[3] - p[0], p[4] - p[1], p[5] - p[2]
            fx, fy, fz = p[6] - p[0], p[7] - p[1], p[8] - p[2]
            gx, gy, gz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
            one = type(x)(1)
            c = flat.camera
            side = one if gx * (c[0] - x) + gy * (c[1] - y) + gz * (c[2] - z) >= 0 else -one
            smooth = flat.sagitta[i] >= 0 and option[NORMALS] != FLAT
            c0, c1, c2 = flat.corner[i]
            if smooth and option[NORMALS] == GOURAUD:
                a0, a1, a2, a3, a4, a5 = _lit(
                    flat, lobes, maps, option[SILHOUETTE], material, side,
                    p[0], p[1], p[2], n[c0, 0], n[c0, 1], n[c0, 2],
                )  # fmt: skip
                d0, d1, d2, d3, d4, d5 = _lit(
                    flat, lobes, maps, option[SILHOUETTE], material, side,
                    p[3], p[4], p[5], n[c1, 0], n[c1, 1], n[c1, 2],
                )  # fmt: skip
                h0, h1, h2, h3, h4, h5 = _lit(
                    flat, lobes, maps, option[SILHOUETTE], material, side,
                    p[6], p[7], p[8], n[c2, 0], n[c2, 1], n[c2, 2],
                )  # fmt: skip
                dr, dg, db = w0 * a0 + w1 * d0 + w2 * h0, w0 * a1 + w1 * d1 + w2 * h1, w0 * a2 + w1 * d2 + w2 * h2
                sr, sg, sb = w0 * a3 + w1 * d3 + w2 * h3, w0 * a4 + w1 * d4 + w2 * h4, w0 * a5 + w1 * d5 + w2 * h5
            else:
                if smooth:
                    gx = b0 * n[c0, 0] + b1 * n[c1, 0] + b2 * n[c2, 0]
                    gy = b0 * n[c0, 1] + b1 * n[c1, 1] + b2 * n[c2, 1]
                    gz = b0 * n[c0, 2] + b1 * n[c1, 2] + b2 * n[c2, 2]
                dr, dg, db, sr, sg, sb = _lit(
                    flat, lobes, maps, option[SILHOUETTE], material, side, x, y, z, gx, gy, gz
                )
            u = w0 * flat.uv[c0, 0] + w1 * flat.uv[c1, 0] + w2 * flat.uv[c2, 0]
            v = w0 * flat.uv[c0, 1] + w1 * flat.uv[c1, 1] + w2 * flat.uv[c2, 1]
            ar, ag, ab = albedo(flat, textures, material, u, v, 0)
            r, g, b = ar * dr, ag * dg, ab * db
            if lobes is not None:
                r += lobes.specular[material, 0] * sr
                g += lobes.specular[material, 1] * sg
                b += lobes.specular[material, 2] * sb
            opaque = one
            if secondary is not None:
                opaque = secondary.coefficients[material, 0]
            share = rest[row, column] * opaque
            into[row, column, 0] += share * r
            into[row, column, 1] += share * g
            into[row, column, 2] += share * b
            rest[row, column] *= one - opaque
            more = more or rest[row, column] > 0
    return more
