"""Shapes of polygons: points and faces, counter-clockwise seen from outside; y is up."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from notabug.scenes_usd.authoring.stage import Row

Shape = tuple[list[Row], list[tuple[int, ...]]]


def _regular(share: float) -> float:
    return share


def lat_long(n: int, m: int, around: Callable[[float], float] = _regular) -> Shape:
    """A unit sphere of ``n`` facets around and ``m`` from pole to pole (y): points and triangles, 2 n (m - 1) of them.

    The points are their own normals. ``around`` maps the share of a turn, 0 to 1, to where the line of longitude lies.
    """
    points: list[Row] = [(0.0, 1.0, 0.0)]
    for j in range(1, m):
        theta = math.pi * j / m
        for i in range(n):
            phi = 2 * math.pi * around(i / n)
            points.append((math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi)))
    points.append((0.0, -1.0, 0.0))
    last = len(points) - 1

    def at(j: int, i: int) -> int:
        return 1 + (j - 1) * n + i % n

    faces: list[tuple[int, ...]] = [(0, at(1, i), at(1, i + 1)) for i in range(n)]
    for j in range(1, m - 1):
        for i in range(n):
            a, b, c, d = at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1)
            faces += [(a, b, c), (a, c, d)]
    faces += [(at(m - 1, i), last, at(m - 1, i + 1)) for i in range(n)]
    return points, faces


def bowl(n: int, m: int) -> Shape:
    """The lower half of ``lat_long(n, m)``, m even, turned inside out: it faces its centre."""
    points, faces = lat_long(n, m)
    first = 1 + (m // 2 - 1) * n  # the rim
    kept = [tuple(corner - first for corner in reversed(face)) for face in faces if min(face) >= first]
    return points[first:], kept


def grid(nx: int, nz: int, half_x: float, half_z: float) -> Shape:
    """A level rectangle about the origin, facing up, of ``nx`` x ``nz`` cells, each cut into two triangles."""
    points: list[Row] = [
        (half_x * (2 * i / nx - 1), 0.0, half_z * (2 * j / nz - 1)) for j in range(nz + 1) for i in range(nx + 1)
    ]
    faces: list[tuple[int, ...]] = []
    for a, b, c, d in cells(nx, nz):
        faces += [(a, d, c), (a, c, b)]
    return points, faces


def cells(nx: int, nz: int) -> Iterable[tuple[int, int, int, int]]:
    """Corners of each cell of a grid of points, row by row: (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)."""
    for j in range(nz):
        for i in range(nx):
            a = j * (nx + 1) + i
            yield a, a + 1, a + nx + 2, a + nx + 1


def box(low: Row, high: Row) -> Shape:
    """A box of six quads."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    points: list[Row] = [
        (x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1), (x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1)
    ]  # fmt: skip
    faces: list[tuple[int, ...]] = [
        (0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)
    ]  # fmt: skip
    return points, faces


def slab(n: int, half: float, thickness: float) -> Shape:
    """A square slab about the origin; its large sides face +z and -z and are ``n`` x ``n`` cells of two triangles."""
    side = [half * (2 * i / n - 1) for i in range(n + 1)]
    points: list[Row] = [(x, y, z) for z in (thickness / 2, -thickness / 2) for y in side for x in side]
    under = (n + 1) ** 2
    faces: list[tuple[int, ...]] = []
    for a, b, c, d in cells(n, n):
        faces += [(a, b, c), (a, c, d)]
    for a, b, c, d in cells(n, n):
        faces += [(under + a, under + c, under + b), (under + a, under + d, under + c)]
    rim = [
        *range(n),
        *range(n, under - 1, n + 1),
        *range(under - 1, under - 1 - n, -1),
        *range(under - 1 - n, 0, -n - 1),
    ]
    for a, b in zip(rim, [*rim[1:], rim[0]], strict=True):
        faces += [(b, a, under + a), (b, under + a, under + b)]
    return points, faces


def cylinder(n: int, radius: float, height: float) -> Shape:
    """An upright prism of ``n`` sides on the level y = 0, with both ends."""
    turns = [2 * math.pi * i / n for i in range(n)]
    ring: list[Row] = [(radius * math.sin(turn), 0.0, radius * math.cos(turn)) for turn in turns]
    top: list[Row] = [(x, height, z) for x, _, z in ring]
    faces: list[tuple[int, ...]] = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    faces += [tuple(reversed(range(n))), tuple(range(n, 2 * n))]
    return ring + top, faces


def moved(shape: Shape, by: Row) -> Shape:
    """``shape`` elsewhere."""
    return [tuple(a + b for a, b in zip(point, by, strict=True)) for point in shape[0]], shape[1]


def joined(shapes: Sequence[Shape]) -> Shape:
    """All ``shapes`` in one."""
    points: list[Row] = []
    faces: list[tuple[int, ...]] = []
    for shape in shapes:
        faces += [tuple(corner + len(points) for corner in face) for face in shape[1]]
        points += shape[0]
    return points, faces
