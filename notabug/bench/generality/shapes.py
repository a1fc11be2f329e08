"""Meshes to draw scenes of, with polygons of three, four or more corners; all about a unit in size, about the origin.

Quads are flat: those of a surface of revolution are trapezoids. A polygon of more corners is flat, convex, and has uv
that are affine in its plane where the shape gives it any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Profile = Sequence[tuple[float, float]]
Vector = tuple[float, float, float]
Corner = tuple[int, Vector, tuple[float, float]]  # point, normal, uv


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """``points`` (p, 3), ``faces`` of indices into them, and for each corner of each face ``normals`` (c, 3) of the
    smooth surface and ``uv`` (c, 2). ``closed`` shapes have an inside."""

    points: Floats
    faces: tuple[tuple[int, ...], ...]
    normals: Floats
    uv: Floats
    closed: bool

    @property
    def corners(self) -> npt.NDArray[np.int64]:
        """(c,) the point of each corner."""
        return np.array([each for face in self.faces for each in face], np.int64)


class _Builder:
    """Gathers faces with their corners' normals and uv."""

    def __init__(self) -> None:
        self.points: list[tuple[float, float, float]] = []
        self.faces: list[tuple[int, ...]] = []
        self.normals: list[tuple[float, float, float]] = []
        self.uv: list[tuple[float, float]] = []

    def face(
        self, corners: Sequence[int], normals: Sequence[tuple[float, float, float]], uv: Sequence[tuple[float, float]]
    ) -> None:
        self.faces.append(tuple(corners))
        self.normals += normals
        self.uv += uv

    def polygon(self, corners: Sequence[Corner]) -> None:
        self.face(
            [corner[0] for corner in corners], [corner[1] for corner in corners], [corner[2] for corner in corners]
        )

    def made(self, *, closed: bool) -> Shape:
        normals = np.array(self.normals)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return Shape(np.array(self.points), tuple(self.faces), normals, np.array(self.uv), closed)


def box(rng: np.random.Generator, cells: str) -> Shape:
    """A box: its sides are quads, two triangles, or octagons with a corner in the middle of each edge."""
    made = _Builder()
    half = rng.uniform(0.45, 1.0, 3)
    index: dict[tuple[float, float, float], int] = {}

    def point(place: Floats) -> int:
        x, y, z = (float(each) for each in place)
        if (x, y, z) not in index:
            index[x, y, z] = len(made.points)
            made.points.append((x, y, z))
        return index[x, y, z]

    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            across, along = (u, v) if side > 0 else (v, u)
            ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            if cells == "ngons":
                ring = [each for a, b in zip(ring, ring[1:] + ring[:1], strict=True) for each in (a, _middle(a, b))]
            normal = side * np.eye(3)[axis]
            corners = [point((a * across + b * along + normal) * half) for a, b in ring]
            uv = [((a + 1) / 2, (b + 1) / 2) for a, b in ring]
            n = (float(normal[0]), float(normal[1]), float(normal[2]))
            parts = [(0, 1, 2), (0, 2, 3)] if cells == "triangles" else [tuple(range(len(ring)))]
            for part in parts:
                made.face([corners[k] for k in part], [n] * len(part), [uv[k] for k in part])
    return made.made(closed=True)


def _middle(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    return (a[0] + b[0]) / 2, (a[1] + b[1]) / 2


def torus(rng: np.random.Generator, cells: str) -> Shape:
    """A torus; ``ngons`` have a corner more in the middle of each edge along the ring."""
    n, m = int(rng.integers(8, 21)), int(rng.integers(6, 13))
    tube = float(rng.uniform(0.25, 0.42))
    profile = [
        (1 - tube + tube * math.cos(-2 * math.pi * j / m), tube * math.sin(-2 * math.pi * j / m)) for j in range(m)
    ]
    across = [(math.cos(-2 * math.pi * j / m), math.sin(-2 * math.pi * j / m)) for j in range(m)]
    return _revolved(profile, across, n, cells, ring=True)


def ball(rng: np.random.Generator, cells: str) -> Shape:
    """A ball of facets; its ``ngons`` are two caps."""
    n, m = int(rng.integers(8, 25)), int(rng.integers(5, 13))
    turns = [math.pi * j / m for j in range(m + 1)]
    profile = [(math.sin(t), math.cos(t)) for t in turns]
    return _revolved(profile, profile, n, cells)


def capsule(rng: np.random.Generator, cells: str) -> Shape:
    """A cylinder with half a ball at each end."""
    n, m = int(rng.integers(8, 21)), int(rng.integers(3, 7))
    radius = float(rng.uniform(0.35, 0.6))
    turns = [math.pi / 2 * j / m for j in range(m + 1)]
    across = [(math.sin(t), math.cos(t)) for t in turns] + [(math.cos(t), -math.sin(t)) for t in turns]
    straight = 1 - radius
    profile = [(radius * x, radius * y + straight * (1 if k <= m else -1)) for k, (x, y) in enumerate(across)]
    return _revolved(profile, across, n, cells)


def _revolved(profile: Profile, across: Profile, n: int, cells: str, *, ring: bool = False) -> Shape:
    """The (radius, height) ``profile`` from top to bottom turned about y in ``n`` steps; ``across`` are its normals.

    A profile that is a ``ring`` is closed; one that is not begins and ends on the axis, in a point or, of ``ngons``, in
    the cap that is left where the point is cut off.
    """
    made = _Builder()
    m = len(profile)
    caps = cells == "ngons" and not ring
    rows = range(1, m - 1) if not ring else range(m)
    turns = [2 * math.pi * i / n for i in range(n)]
    at: dict[tuple[int, int], int] = {}
    middle: dict[tuple[int, int], int] = {}

    def lifted(pair: tuple[float, float], turn: float) -> tuple[float, float, float]:
        return pair[0] * math.sin(turn), pair[1], pair[0] * math.cos(turn)

    for j in rows:
        for i in range(n):
            at[j, i] = len(made.points)
            made.points.append(lifted(profile[j], turns[i]))
    if cells == "ngons" and ring:  # a corner more in the middle of each edge along the ring
        for j in rows:
            for i in range(n):
                middle[j, i] = len(made.points)
                a, b = made.points[at[j, i]], made.points[at[j, (i + 1) % n]]
                made.points.append(((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2))

    def corner(j: int, step: float, i: int) -> Corner:
        row = j % m
        known = middle[row, i % n] if step % 1 else at[row, i % n]
        normal = lifted(across[row], 2 * math.pi * step / n)
        share = m if ring else m - 1
        return known, normal, (step / n, 1 - j / share)

    for j in range(m) if ring else range(1, m - 2):
        for i in range(n):
            four = [corner(j, i, i), corner(j + 1, i, i), corner(j + 1, i + 1, i + 1), corner(j, i + 1, i + 1)]
            if middle:
                four = [*four[:2], corner(j + 1, i + 0.5, i), *four[2:], corner(j, i + 0.5, i)]
            parts = [(0, 1, 2), (0, 2, 3)] if cells == "triangles" else [tuple(range(len(four)))]
            for part in parts:
                made.polygon([four[k] for k in part])
    if ring:
        return made.made(closed=True)
    for top in (True, False):
        j, pole = (1, 0) if top else (m - 2, m - 1)
        order = list(range(n)) if top else list(range(n - 1, -1, -1))
        upward = (0.0, 1.0 if top else -1.0, 0.0)
        if caps:
            flat = [(0.5 + 0.5 * math.sin(turns[i]), 0.5 + 0.5 * math.cos(turns[i])) for i in order]
            made.face([at[j, i] for i in order], [lifted(across[j], turns[i]) for i in order], flat)
            continue
        tip = len(made.points)
        made.points.append((0.0, profile[pole][1], 0.0))
        for i in order:
            sides = [corner(j, i, i), corner(j, i + 1, i + 1)]
            made.polygon([(tip, upward, ((i + 0.5) / n, 1.0 if top else 0.0)), *(sides if top else sides[::-1])])
    return made.made(closed=True)


def extrusion(rng: np.random.Generator, cells: str) -> Shape:
    """A prism over an uneven convex polygon of five to nine corners: ``ngons`` keep its ends whole."""
    made = _Builder()
    n = int(rng.integers(5, 10))
    turns = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    half = float(rng.uniform(0.3, 0.9))
    wide = float(rng.uniform(0.5, 1.0))
    outline = [(math.sin(t), wide * math.cos(t)) for t in turns]
    made.points = [(x, y, z) for y in (-half, half) for x, z in outline]
    smooth = [(x * wide * wide, 0.0, z) for x, z in outline]  # of the ellipse that the corners lie on
    for i in range(n):
        k = (i + 1) % n
        corners, shares = (i, k, n + k, n + i), ((i / n, 0.0), ((i + 1) / n, 0.0), ((i + 1) / n, 1.0), (i / n, 1.0))
        normals = (smooth[i], smooth[k], smooth[k], smooth[i])
        for part in [(0, 1, 2), (0, 2, 3)] if cells == "triangles" else [(0, 1, 2, 3)]:
            made.face([corners[c] for c in part], [normals[c] for c in part], [shares[c] for c in part])
    for first, order, up in ((0, list(range(n - 1, -1, -1)), -1.0), (n, list(range(n)), 1.0)):
        fan = [tuple(order)] if cells == "ngons" else [(order[0], a, b) for a, b in pairwise(order[1:])]
        for end in fan:
            uv = [(0.5 + 0.5 * outline[c][0], 0.5 + 0.5 * outline[c][1]) for c in end]
            made.face([first + c for c in end], [(0.0, up, 0.0)] * len(end), uv)
    return made.made(closed=True)


def sheet(rng: np.random.Generator, cells: str, *, bent: bool = False) -> Shape:
    """A height field of triangles, folds of flat quads (or, ``bent``, a height field of quads), or level hexagons."""
    if cells == "ngons":
        return _honeycomb(int(rng.integers(2, 5)))
    n, m = int(rng.integers(4, 13)), int(rng.integers(4, 13))
    high, waves, phase = float(rng.uniform(0.05, 0.2)), float(rng.uniform(1.0, 4.0)), float(rng.uniform(0.0, 6.0))
    both = cells == "triangles" or bent

    def height(x: float, z: float) -> float:
        return high * math.sin(waves * x + phase) * (math.cos(waves * z) if both else 1.0)

    def slope(x: float, z: float) -> tuple[float, float, float]:
        dx = high * waves * math.cos(waves * x + phase) * (math.cos(waves * z) if both else 1.0)
        dz = -high * waves * math.sin(waves * x + phase) * math.sin(waves * z) if both else 0.0
        return -dx, 1.0, -dz

    return _grid(n, m, 1.0, 1.0, height, slope, cells)


def floor(n: int, half_x: float, half_z: float, cells: str) -> Shape:
    """A level rectangle that faces up."""
    return _grid(n, n, half_x, half_z, lambda _x, _z: 0.0, lambda _x, _z: (0.0, 1.0, 0.0), cells)


def _grid(
    n: int,
    m: int,
    half_x: float,
    half_z: float,
    height: Callable[[float, float], float],
    slope: Callable[[float, float], tuple[float, float, float]],
    cells: str,
) -> Shape:
    made = _Builder()
    places = [(half_x * (2 * i / n - 1), half_z * (2 * j / m - 1)) for j in range(m + 1) for i in range(n + 1)]
    made.points = [(x, height(x, z), z) for x, z in places]
    shares = [(i / n, 1 - j / m) for j in range(m + 1) for i in range(n + 1)]
    for j in range(m):
        for i in range(n):
            a = j * (n + 1) + i
            four = (a, a + n + 1, a + n + 2, a + 1)
            for part in [(0, 1, 2), (0, 2, 3)] if cells == "triangles" else [(0, 1, 2, 3)]:
                corners = [four[k] for k in part]
                made.face(corners, [slope(*places[c]) for c in corners], [shares[c] for c in corners])
    return made.made(closed=False)


def _honeycomb(rings: int) -> Shape:
    """Level hexagons side by side, sharing their corners."""
    made = _Builder()
    size = 1.0 / (1.5 * rings + 1)
    index: dict[tuple[int, int], int] = {}
    for q in range(-rings, rings + 1):
        for r in range(max(-rings, -q - rings), min(rings, -q + rings) + 1):
            corners = []
            for k in range(6):
                turn = math.pi / 3 * k
                x = size * (1.5 * q + math.cos(turn))
                z = size * (math.sqrt(3) * (r + q / 2) - math.sin(turn))
                key = round(x / size * 8), round(z / size * 8)
                if key not in index:
                    index[key] = len(made.points)
                    made.points.append((x, 0.0, z))
                corners.append(index[key])
            uv = [((made.points[c][0] + 1) / 2, (1 - made.points[c][2]) / 2) for c in corners]
            made.face(corners, [(0.0, 1.0, 0.0)] * 6, uv)
    return made.made(closed=False)


SHAPES: dict[str, Callable[[np.random.Generator, str], Shape]] = {
    "box": box,
    "torus": torus,
    "ball": ball,
    "capsule": capsule,
    "extrusion": extrusion,
    "sheet": sheet,
}
