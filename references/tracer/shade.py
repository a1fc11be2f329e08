"""From a hit to radiance: interpolation of normals and uv, textures, and the reflection models."""

from __future__ import annotations

import math

from notabug.references.tracer.intersect import inverse_bilinear
from notabug.references.tracer.jit import kernel


@kernel
def corner_weights(flat, quads, i, b0, b1, b2, x, y, z):
    """Four corners and their weights at a hit: (c0, c1, c2, c3, w0, w1, w2, w3).

    A triangle's are its barycentric coordinates; a quad's follow from its inverse bilinear map at (x, y, z).
    """
    c0, c1, c2 = flat.corner[i]
    zero = type(b0)(0)
    if quads is None:
        return c0, c1, c2, c2, b0, b1, b2, zero
    q = quads.of_triangle[i]
    if q < 0:
        return c0, c1, c2, c2, b0, b1, b2, zero
    f = quads.frame[q]
    hx, hy, hz = x - f[0], y - f[1], z - f[2]
    s, t = inverse_bilinear(hx * f[3] + hy * f[4] + hz * f[5], hx * f[6] + hy * f[7] + hz * f[8], quads.plane, q)
    one = type(b0)(1)
    k0, k1, k2, k3 = quads.corners[q]
    return k0, k1, k2, k3, (one - s) * (one - t), s * (one - t), s * t, (one - s) * t


@kernel
def screen_weights(flat, i, b0, b1, b2):
    """The fault of affine interpolation: barycentric coordinates as they are on the screen.

    A vertex at depth z weighs b * z there (Heckbert 1989, section 2.3; Blinn 1992, "Hyperbolic Interpolation").
    """
    p, c = flat.points[i], flat.camera
    z0 = (p[0] - c[0]) * c[9] + (p[1] - c[1]) * c[10] + (p[2] - c[2]) * c[11]
    z1 = (p[3] - c[0]) * c[9] + (p[4] - c[1]) * c[10] + (p[5] - c[2]) * c[11]
    z2 = (p[6] - c[0]) * c[9] + (p[7] - c[1]) * c[10] + (p[8] - c[2]) * c[11]
    total = b0 * z0 + b1 * z1 + b2 * z2
    return b0 * z0 / total, b1 * z1 / total, b2 * z2 / total


@kernel
def _wrapped(index, size, clamp):
    if clamp:
        return min(max(index, 0), size - 1)
    return index % size


@kernel
def texel(textures, k, u, v, nearest):
    """Bilinear lookup of texture ``k`` at (u, v), or that of the ``nearest`` texel.

    Texel centres lie at half-integers, v = 0 is the bottom edge.
    """
    first, width, height, wrap_s, wrap_t = textures.info[k]
    half, one = type(u)(0.5), type(u)(1)
    x = u * type(u)(width) - half
    y = (one - v) * type(u)(height) - half
    if nearest:
        x, y = type(u)(math.floor(x + half)), type(u)(math.floor(y + half))
    fx, fy = math.floor(x), math.floor(y)
    ax, ay = x - type(u)(fx), y - type(u)(fy)
    x0, x1 = _wrapped(int(fx), width, wrap_s), _wrapped(int(fx) + 1, width, wrap_s)
    y0, y1 = _wrapped(int(fy), height, wrap_t), _wrapped(int(fy) + 1, height, wrap_t)
    t = textures.texels
    w00, w10, w01, w11 = (one - ax) * (one - ay), ax * (one - ay), (one - ax) * ay, ax * ay
    i00, i10 = first + y0 * width + x0, first + y0 * width + x1
    i01, i11 = first + y1 * width + x0, first + y1 * width + x1
    return (
        w00 * t[i00, 0] + w10 * t[i10, 0] + w01 * t[i01, 0] + w11 * t[i11, 0],
        w00 * t[i00, 1] + w10 * t[i10, 1] + w01 * t[i01, 1] + w11 * t[i11, 1],
        w00 * t[i00, 2] + w10 * t[i10, 2] + w01 * t[i01, 2] + w11 * t[i11, 2],
    )


@kernel
def albedo(flat, textures, material, u, v, nearest):
    """The diffuse colour of ``material`` at (u, v); ``nearest`` as in ``texel``."""
    if textures is not None and flat.texture[material] >= 0:
        return texel(textures, flat.texture[material], u, v, nearest)
    return flat.diffuse[material, 0], flat.diffuse[material, 1], flat.diffuse[material, 2]


@kernel
def highlight(lobes, material, nx, ny, nz, lx, ly, lz, vx, vy, vz, raw):
    """The lobe's value, without its colour: max(R.V, 0)^n (Phong 1975) or max(N.H, 0)^n (Blinn 1977); unit vectors.

    ``raw`` > 0 is the fault of vectors that were not normalised: R of a light vector of that length, H = (L + V)/2.
    """
    zero = type(nx)(0)
    if lobes is None:
        return zero
    kind = lobes.kind[material]
    if kind == 0:
        return zero
    nl = nx * lx + ny * ly + nz * lz
    if kind == 1 or kind == 3:
        two = type(nx)(2)
        cosine = two * nl * (nx * vx + ny * vy + nz * vz) - (lx * vx + ly * vy + lz * vz)
        if raw > zero:
            cosine *= raw
    else:
        hx, hy, hz = lx + vx, ly + vy, lz + vz
        length = math.sqrt(hx * hx + hy * hy + hz * hz) if raw <= zero else type(nx)(2)
        cosine = (nx * hx + ny * hy + nz * hz) / length
    if cosine <= zero:
        return zero
    value = cosine ** lobes.specular[material, 3]
    return value * nl if kind > 2 else value


@kernel
def corner(flat, quads, i, k, c, weight, side, ox, oy, oz, silhouette):
    """Corner ``k`` of triangle ``i``, or of its quad, for Gouraud: its place, unit normal, V to (ox, oy, oz), weight.

    ``c`` is the corner's place in ``flat.normal``, ``weight`` its share of the colour. ``side`` is -1 where the facet
    is seen from behind. A normal that faces away from the viewer is kept, flipped (1) or its corner painted black (2,
    weight 0).
    """
    p, n = flat.points[i], flat.normal[c]
    if quads is not None and quads.of_triangle[i] >= 0:
        p = quads.points[quads.of_triangle[i]]
    x, y, z = p[3 * k], p[3 * k + 1], p[3 * k + 2]
    vx, vy, vz = ox - x, oy - y, oz - z
    one = type(x)(1)
    scale = one / math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx * scale, vy * scale, vz * scale
    scale = side / math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    nx, ny, nz = n[0] * scale, n[1] * scale, n[2] * scale
    if silhouette != 0 and nx * vx + ny * vy + nz * vz < 0:
        if silhouette == 2:
            weight = one - one
        nx, ny, nz = -nx, -ny, -nz
    return x, y, z, nx, ny, nz, vx, vy, vz, weight
