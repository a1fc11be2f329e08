"""Ray-triangle, ray-sphere and the inverse bilinear map against exact arithmetic, on random and adversarial cases.

Signs come from integers, which are exact, and roots from mpmath with 50 digits, both on the inputs as rounded to the
precision under test. An error is counted in *units*: u times the error that a relative change of 1 in every
intermediate length of the formula would make, to first order, as derived at each unit. A backward stable formula stays
below a few units however bad the case; one that cancels needlessly does not. ``pytest -s`` prints the table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np
import pytest

from notabug.references import _native

CASES = 3_000  # of each kind of case; more of them find no other errors, and each costs 50 digits
PRECISIONS = [np.float64, np.float32]
BOUND = 8.0  # units; also the width of the band, about an exact zero, in which a sign may come out either way

mpf = mpmath.mpf


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    with mpmath.workdps(50):
        yield


@dataclass
class Worst:
    """The largest errors by kind of case: in units, and plainly in ulp where the case is well conditioned."""

    what: str
    dtype: Any
    units: dict[str, float] = field(default_factory=dict)
    ulps: dict[str, float] = field(default_factory=dict)
    wrong: int = 0
    margin: float = 0.0

    def error(self, kind: str, got: Any, exact: Any, unit: Any) -> None:
        """``exact`` is an mpf or an exact fraction of two integers, ``unit`` the case's, u included."""
        if not math.isfinite(got):
            self.units[kind] = math.inf
            return
        if isinstance(exact, tuple):
            over, under = exact
            n, d = float(got).as_integer_ratio()
            wrong, exact = abs(n * under - over * d) / abs(under * d), abs(over / under)
        else:
            wrong, exact = float(abs(mpf(float(got)) - exact)), float(abs(exact))
        unit = float(unit)
        self.units[kind] = max(self.units.get(kind, 0.0), wrong / unit)
        ulp = unit_roundoff(self.dtype) * 2 * exact
        if exact != 0 and unit < 8 * ulp:  # then the formula may lose three bits at most
            self.ulps[kind] = max(self.ulps.get(kind, 0.0), wrong / ulp)

    def undecided(self, kind: str, margin: float) -> None:
        """A hit taken for a miss, or the reverse, ``margin`` units from the exact zero that decides."""
        assert margin < BOUND, f"{self.what}: wrong hit or miss {margin} units from the edge ({kind})"
        self.wrong += 1
        self.margin = max(self.margin, margin)

    def close(self, cases: int) -> None:
        print(f"\n{self.what}, {np.dtype(self.dtype).name}: {cases} cases; kind: largest error in units | in ulp")
        for kind in self.units:
            print(f"  {kind:14} {self.units[kind]:8.2f} | {self.ulps.get(kind, math.nan):8.2f}")
        if self.wrong:
            print(f"  hit for miss or miss for hit: {self.wrong}, all within {self.margin:.2f} units of the edge")
        assert max(self.units.values()) < BOUND


def unit_roundoff(dtype: Any) -> float:
    return float(np.finfo(dtype).eps) / 2


def unit_vectors(rng: np.random.Generator, n: int) -> Any:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def integers(values: Any) -> tuple[list[int], int]:
    """``values`` as exact integers times 2^-shift."""
    ratios = [float(v).as_integer_ratio() for v in values]
    shift = max(d.bit_length() for _, d in ratios) - 1
    return [n << (shift + 1 - d.bit_length()) for n, d in ratios], shift


# --- ray and triangle ---------------------------------------------------------------------------------------------


def triangle_cases(dtype: Any, rng: np.random.Generator) -> Iterator[tuple[str, Any, Any, Any]]:
    """(kind, origin, direction, triangle), each of ``dtype``; half the rays aim inside, half around the triangle."""
    tiny = 1e-15 if dtype == np.float32 else 1e-145  # products of two lengths are then near the denormal numbers
    kinds = ("random", "sliver", "grazing", "far", "tiny", "edge", "vertex", "lattice")
    for kind in kinds:
        n = CASES if kind == "random" else CASES // (len(kinds) - 1) + 1
        p = rng.uniform(-1, 1, (n, 3, 3))
        b = rng.dirichlet((1, 1, 1), n)
        outside = rng.random(n) < 0.5
        b[outside] = rng.uniform(-1.5, 1.5, (outside.sum(), 3))
        b[:, 2] = 1 - b[:, 0] - b[:, 1]
        direction = unit_vectors(rng, n) * 10.0 ** rng.uniform(-2, 2, (n, 1))
        reach = 10.0 ** rng.uniform(-1, 1.5, n)
        if kind == "sliver":
            s = rng.uniform(0, 1, (n, 1))
            lift = 10.0 ** rng.uniform(-8, -2, (n, 1)) * unit_vectors(rng, n)
            p[:, 2] = (1 - s) * p[:, 0] + s * p[:, 1] + lift
        elif kind == "grazing":
            e = (p[:, 1] - p[:, 0]) * rng.normal(size=(n, 1)) + (p[:, 2] - p[:, 0]) * rng.normal(size=(n, 1))
            direction = e + 10.0 ** rng.uniform(-8, -2, (n, 1)) * unit_vectors(rng, n)
        elif kind == "far":
            reach = 10.0 ** rng.uniform(2, 6, n) / np.linalg.norm(direction, axis=1)
        elif kind == "tiny":
            p *= tiny
            reach *= tiny
        elif kind in ("edge", "vertex"):
            b = np.zeros((n, 3))
            b[:, 0] = 1 if kind == "vertex" else rng.uniform(0, 1, n)
            b[:, 1] = 1 - b[:, 0]
        target = np.einsum("ij,ijk->ik", b, p)
        origin = target - reach[:, None] * direction
        if kind == "lattice":  # small integers: edges are met exactly, and the kernel's products have no rounding
            p, origin = rng.integers(-3, 4, (n, 3, 3)), rng.integers(-3, 4, (n, 3))
            direction = rng.integers(-2, 3, (n, 3)) + np.array([0, 0, 5])
        for o, d, q in zip(origin.astype(dtype), direction.astype(dtype), p.astype(dtype), strict=True):
            yield kind, o, d, q


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_ray_triangle(dtype: Any) -> None:
    """The kernel shears space so that the ray is the z axis; its errors in the sheared frame, to first order:

    M largest |vertex - origin|, R largest distance of a vertex from the ray, Z the vertices' extent along it.
    A sheared coordinate is wrong by u M (inputs are exact, so |origin| itself does not enter), an edge function by
    u M R, a barycentric coordinate by u M R / det. t = sum b_i z_i, where the errors of the b_i cancel in their sum,
    so t is wrong by u (M + Z M R / det) / |D_z|. Underflow adds the smallest number eta to each product.
    """
    u, eta = unit_roundoff(dtype), float(np.finfo(dtype).smallest_subnormal)
    worst, count, met = Worst("ray and triangle, t and b0, b1, b2", dtype), 0, 0
    for kind, o, d, p in triangle_cases(dtype, np.random.default_rng(1)):
        count += 1
        t, *weights = _native.ray_triangle(o, d, np.ascontiguousarray(p))
        found = math.isfinite(t)

        (ints, shift), (di, dshift) = integers([*p.ravel(), *o]), integers(d)
        origin = ints[9:]
        a, b, c = ([ints[3 * j + k] - origin[k] for k in range(3)] for j in range(3))
        kz = _native.main_axis(d)
        volumes = [_triple(di, c, b), _triple(di, a, c), _triple(di, b, a)]
        det = sum(volumes)
        hit = det != 0 and (min(volumes) >= 0 or max(volumes) <= 0)

        scale = abs(di[kz]) << 2 * shift  # from integer volumes to the kernel's edge functions
        rel = p.astype(np.float64) - o.astype(np.float64)
        z = rel[:, kz]
        lateral = rel - z[:, None] * (d.astype(np.float64) / float(d[kz]))
        m = float(np.abs(rel).max())
        r = float(np.abs(lateral).max()) + u * m
        edge = u * m * r + eta
        if found != hit:
            near = min(abs(each) for each in (*volumes, det)) / scale
            worst.undecided(kind, near / edge)
            continue
        if not hit or abs(det) / scale <= BOUND * edge:  # an exact hit on a triangle seen edge-on has no useful t
            continue
        met += 1
        condition = edge / (abs(det) / scale)
        for got, volume in zip(weights, volumes, strict=True):
            worst.error(kind, got, (volume, det), condition + u)
        depth = sum(volume * v[kz] for volume, v in zip(volumes, (a, b, c), strict=True))
        unit = (u * m + condition * float(z.max() - z.min()) + eta) / abs(float(d[kz]))
        worst.error(kind, t, (depth << dshift, det * di[kz] << shift), unit)
    worst.close(count)
    assert met > CASES / 2


def _triple(d: list[int], a: list[int], b: list[int]) -> int:
    return d[0] * (a[1] * b[2] - a[2] * b[1]) + d[1] * (a[2] * b[0] - a[0] * b[2]) + d[2] * (a[0] * b[1] - a[1] * b[0])


# --- ray and sphere -----------------------------------------------------------------------------------------------


def sphere_cases(dtype: Any, rng: np.random.Generator) -> Iterator[tuple[str, Any, Any, Any]]:
    tiny = 1e-15 if dtype == np.float32 else 1e-140
    kinds = ("random", "grazing", "far", "surface", "tiny", "through centre", "large")
    for kind in kinds:
        n = CASES if kind == "random" else CASES // (len(kinds) - 1) + 1
        radius = 10.0 ** rng.uniform(-1, 1, n)
        axis = unit_vectors(rng, n)
        across = np.cross(axis, unit_vectors(rng, n))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        offset = rng.uniform(0, 1.5, n)
        reach = rng.uniform(-3, 10, n)
        length = np.ones(n)
        if kind == "grazing":
            offset = 1 + rng.choice([-1, 1], n) * 10.0 ** rng.uniform(-16, -2, n)
        elif kind == "far":
            reach = 10.0 ** rng.uniform(2, 6, n)
        elif kind == "surface":  # leaves from near the surface: one root nearly cancels
            offset = rng.uniform(0, 0.999, n)
            reach = np.sqrt(1 - offset**2) * rng.choice([-1, 1], n) * (1 + 10.0 ** rng.uniform(-16, -3, n))
        elif kind == "tiny":
            radius *= tiny
            length *= 10.0 ** rng.uniform(-3, 3, n)
        elif kind == "through centre":
            offset[:] = 0
        elif kind == "large":
            radius *= 1e12
        origin = radius[:, None] * (offset[:, None] * across - reach[:, None] * axis)
        direction = axis * length[:, None]
        for o, d, r in zip(origin.astype(dtype), direction.astype(dtype), radius.astype(dtype), strict=True):
            yield kind, o, d, r


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_ray_sphere(dtype: Any) -> None:
    """Errors to first order, with l the point of the ray nearest to the centre and disc = r^2 - l^2:

    l is wrong by u |o|, so disc by e = u (r^2 + l^2 + |l||o|) + (u |o|)^2; its root by min(e / root, sqrt(e)), times
    |d|; b by u |o||d|. q = b + root adds them, dq. The far root q/a is wrong by dq/a, the near one, c/q with
    c = o^2 - r^2, by (u (o^2 + r^2) + |t0| dq) / q. Underflow adds the smallest number eta to every square.
    """
    u, eta = unit_roundoff(dtype), float(np.finfo(dtype).smallest_subnormal)
    worst, count, met = Worst("ray and sphere, near and far t", dtype), 0, 0
    for kind, o, d, r in sphere_cases(dtype, np.random.default_rng(2)):
        count += 1
        near, far = _native.ray_sphere(o, d, r)
        eo, ed, er = [mpf(float(x)) for x in o], [mpf(float(x)) for x in d], mpf(float(r))
        a, oo = sum(x * x for x in ed), sum(x * x for x in eo)
        b = -sum(x * y for x, y in zip(eo, ed, strict=True))
        disc = er * er - (oo - b * b / a)
        ll = max(oo - b * b / a, mpf(0))
        size = mpmath.sqrt(oo)
        e = u * (er * er + ll + mpmath.sqrt(ll) * size) + (u * size) ** 2 + eta
        if (near != math.inf) != (disc >= 0):
            worst.undecided(kind, float(abs(disc) / e))
            continue
        if disc < 0:
            continue
        met += 1
        root = mpmath.sqrt(disc)
        length = mpmath.sqrt(a)
        q = abs(b) + length * root
        dq = length * (min(e / root if root else math.inf, mpmath.sqrt(e)) + u * size)
        big, small = q / a, (oo - er * er) / q
        units = ((dq / a + u * abs(big), big), ((u * (oo + er * er) + eta + abs(small) * dq) / q, small))
        if b < 0:
            units = tuple((unit, -exact) for unit, exact in units)
        for got, (unit, exact) in zip((near, far), sorted(units, key=lambda each: each[1]), strict=True):
            worst.error(kind, got, exact, unit)
    worst.close(count)
    assert met > CASES / 2


# --- inverse bilinear map -----------------------------------------------------------------------------------------


def quad_cases(dtype: Any, rng: np.random.Generator) -> Iterator[tuple[str, Any, Any]]:
    """(kind, quad (8,), point): convex quads, the point at a random (s, t) of the unit square, rounded to ``dtype``."""
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    kinds = ("random", "parallelogram", "nearly one", "trapezium", "uneven", "thin", "corner", "small", "offset")
    for kind in kinds:
        n = CASES if kind == "random" else CASES // (len(kinds) - 1) + 1
        q = square + rng.uniform(-0.25, 0.25, (n, 4, 2))
        st = rng.uniform(0, 1, (n, 2))
        if kind in ("parallelogram", "nearly one"):
            q[:, 2] = q[:, 1] + q[:, 3] - q[:, 0]
            if kind == "nearly one":
                q[:, 2] += rng.normal(size=(n, 2)) * 10.0 ** rng.uniform(-16, -3, (n, 1))
        elif kind == "trapezium":  # a = 0 exactly, or s and t exchanged
            q[:] = square
            q[:, 1, 0] = rng.uniform(0.1, 4, n)
            q = np.where(rng.random((n, 1, 1)) < 0.5, q, q[:, [0, 3, 2, 1]][:, :, ::-1])
        elif kind == "uneven":  # one side up to a million times the opposite one, yet convex
            q[:] = square
            q[:, 1, 0] = 10.0 ** rng.uniform(0, 2, n)
            short = np.stack([np.ones(n), rng.uniform(-0.9, 0.9, n) / q[:, 1, 0]], axis=1)
            q[:, 2] = q[:, 3] + 10.0 ** rng.uniform(-6, -0.3, (n, 1)) * short
        elif kind == "thin":
            q[:, :, 1] *= 10.0 ** rng.uniform(-6, -1, (n, 1))
        elif kind == "corner":  # nearly a triangle: the corner at q2 is almost straight, the map almost singular there
            q[:, 2] = (q[:, 1] + q[:, 3]) / 2 + (q[:, 1] + q[:, 3] - 2 * q[:, 0]) * 10.0 ** rng.uniform(-8, -1, (n, 1))
            st = 1 - (1 - st) * 10.0 ** rng.uniform(-6, 0, (n, 1))
        elif kind == "small":
            q *= 1e-8 if dtype == np.float32 else 1e-70
        elif kind == "offset":
            q += rng.uniform(-1, 1, (n, 1, 2)) * 1e3
        turn = rng.uniform(0, 2 * np.pi, n)
        rotation = np.stack([np.cos(turn), -np.sin(turn), np.sin(turn), np.cos(turn)], axis=1).reshape(n, 2, 2)
        q = np.einsum("nij,nkj->nki", rotation, q) if kind not in ("trapezium", "offset") else q
        side = np.roll(q, -1, axis=1) - q
        turns = side[:, :, 0] * np.roll(side[:, :, 1], -1, axis=1) - side[:, :, 1] * np.roll(side[:, :, 0], -1, axis=1)
        convex = (turns.min(axis=1) > 0) | (turns.max(axis=1) < 0)
        assert convex.mean() > 0.9
        q, st = q[convex].astype(dtype), st[convex]
        s, t = st[:, :1], st[:, 1:]
        p = (1 - s) * (1 - t) * q[:, 0] + s * (1 - t) * q[:, 1] + s * t * q[:, 2] + (1 - s) * t * q[:, 3]
        for quad, point in zip(q.reshape(-1, 8), p.astype(dtype), strict=True):
            yield kind, quad, point


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_inverse_bilinear(dtype: Any) -> None:
    """t is a root of a t^2 + b t + c, whose slope there, J, is the Jacobian of the map.

    The terms of the coefficients are products of side lengths with relative errors of u each, so with K the sum of
    their absolute values t is wrong by u K / J, near a double root by sqrt(u K / a) at most. s = (h - f t) / (e + g t)
    in the larger component r of the denominator: |f + s g| dt / r, and the rounding of its terms.
    """
    u, eta = unit_roundoff(dtype), float(np.finfo(dtype).tiny)
    worst, count = Worst("inverse bilinear map, s and t", dtype), 0
    for kind, quad, point in quad_cases(dtype, np.random.default_rng(3)):
        count += 1
        got = _native.inverse_bilinear(point, quad)
        q = [mpf(float(x)) for x in quad]
        hx, hy = mpf(float(point[0])) - q[0], mpf(float(point[1])) - q[1]
        ex, ey, fx, fy = q[2] - q[0], q[3] - q[1], q[6] - q[0], q[7] - q[1]
        kx, ky = q[4] - q[6], q[5] - q[7]
        gx, gy = kx - ex, ky - ey
        a, b, c = gx * fy - gy * fx, ex * fy - ey * fx + hx * gy - hy * gx, hx * ey - hy * ex
        disc = b * b - 4 * a * c
        root = mpmath.sqrt(max(disc, mpf(0)))
        w = -(b + root) / 2 if b >= 0 else -(b - root) / 2
        best = None
        for over, under in ((c, w), (w, a)):  # the root whose (s, t) is nearest to the unit square
            if under == 0:
                continue
            t = over / under
            rx, ry = ex + gx * t, ey + gy * t
            if rx == ry == 0:  # the side that shrank to a point
                continue
            s = (hx - fx * t) / rx if abs(rx) >= abs(ry) else (hy - fy * t) / ry
            outside = max(abs(s - mpf(0.5)), abs(t - mpf(0.5)))
            if best is None or outside < best[0]:
                best = (outside, s, t, max(abs(rx), abs(ry)))
        assert best is not None
        _, s, t, r = best
        h, e, f, k = (abs(x) + abs(y) for x, y in ((hx, hy), (ex, ey), (fx, fy), (kx, ky)))
        total = (k + e) * f * t * t + (e * f + h * (k + e)) * abs(t) + h * e + eta / (u * e)
        dt = min(u * total / root if root else math.inf, mpmath.sqrt(u * total / abs(a)) if a else math.inf)
        across = abs(fx + s * gx) + abs(fy + s * gy)
        ds = (across * dt + u * (h + f * abs(t) + abs(s) * (k + e))) / r
        for value, exact, unit in ((got[0], s, ds), (got[1], t, dt)):
            worst.error(kind, value, min(max(exact, mpf(0)), mpf(1)), unit + u * abs(exact))
    worst.close(count)
