"""Cube, Cylinder, Cone, Capsule and Plane to faces: flat ones exactly, round ones as near as a tenth of a pixel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pxr import Usd

from notabug.scenes_usd.primvar import Places
from notabug.scenes_usd.reader_values import fault, number, value, where
from notabug.scenes_usd.reading import note
from notabug.scenes_usd.scene import Floats
from notabug.scenes_usd.schemes import TOLERANCE

SOLIDS = ("Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane")
_FEWEST, _MOST = 16, 2048  # facets round an axis
_AXES = {"X": (2, 0, 1), "Y": (1, 2, 0), "Z": (0, 1, 2)}  # where x, y and the axis go: column k of (x, y, axis)


@dataclass(frozen=True, slots=True, eq=False)
class Faces:
    """Local ``points``, ``counts`` and ``corners``, counter-clockwise from outside; ``normals`` (c, 3) or None."""

    points: Floats
    counts: Places
    corners: Places
    normals: Floats | None


@dataclass(frozen=True, slots=True)
class _Station:
    """A place on a profile: distance from the axis, along it, and the normal there."""

    radius: float
    along: float
    out: float
    up: float


def solid_faces(prim: Usd.Prim, pixel: Callable[[Floats], Floats]) -> Faces:
    """The faces of the solid at ``prim``; ``pixel`` gives the local size of a pixel at local places."""
    kind = str(prim.GetTypeName())
    if kind == "Cube":
        return _cube(_length(prim, "size", 2.0))
    if kind == "Plane":
        return _plane(prim)
    axis = _axis(prim)
    profile = _profile(prim, kind, pixel, axis)
    radius = max(station.radius for part in profile for station in part)
    around = _facets(radius, _nearest(profile, pixel, axis))
    bound = radius * (1.0 - math.cos(math.pi / around)) / _nearest(profile, pixel, axis)
    note("approximated", where(prim), f"{kind} by {around} facets round its axis, {bound:.1g} pixel off at most")
    return _revolved(profile, around, axis)


def _length(prim: Usd.Prim, name: str, fallback: float) -> float:
    found = number(prim, name, fallback, low=0.0)
    if found == 0.0:
        raise fault(prim, name, "out of range", expected="above 0", got="0")
    return found


def _axis(prim: Usd.Prim) -> str:
    axis = str(value(prim, "axis", "word", "Z"))
    if axis not in _AXES:
        raise fault(prim, "axis", "unknown axis", expected="X, Y or Z", got=axis)
    return axis


def _turned(rows: Floats, axis: str) -> Floats:
    """``rows`` (n, 3) of (x, y, along the axis) in the prim's own order."""
    return np.ascontiguousarray(rows[:, _AXES[axis]])


def _cube(size: float) -> Faces:
    half = size / 2.0
    points = half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    corners = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
    return Faces(points, np.full(6, 4), corners, None)


def _plane(prim: Usd.Prim) -> Faces:
    """A rectangle; its width is along x, or z where x is the axis, its length along the other one."""
    width, length = _length(prim, "width", 2.0) / 2.0, _length(prim, "length", 2.0) / 2.0
    axis = _axis(prim)
    across = {
        "X": [[0.0, -length, width], [0.0, -length, -width], [0.0, length, -width], [0.0, length, width]],
        "Y": [[-width, 0.0, length], [width, 0.0, length], [width, 0.0, -length], [-width, 0.0, -length]],
        "Z": [[-width, -length, 0.0], [width, -length, 0.0], [width, length, 0.0], [-width, length, 0.0]],
    }
    return Faces(np.array(across[axis], np.float64), np.array([4]), np.arange(4), None)


def _profile(prim: Usd.Prim, kind: str, pixel: Callable[[Floats], Floats], axis: str) -> Sequence[Sequence[_Station]]:
    """The outline in parts with a normal that does not jump, from the bottom to the top."""
    half = _length(prim, "height", 1.0 if kind.startswith("Capsule") else 2.0) / 2.0
    default = 0.5 if kind.startswith("Capsule") else 1.0
    if kind.endswith("_1"):
        low, high = _length(prim, "radiusBottom", default), _length(prim, "radiusTop", default)
    else:
        low = high = _length(prim, "radius", default)
    if kind == "Cone":
        high = 0.0
    if kind.startswith("Capsule"):
        if low != high:
            got = f"{low:g} and {high:g}"
            raise fault(prim, "radiusTop", "a capsule of two radii is not supported", expected=f"{low:g}", got=got)
        ends = np.array([[0.0, 0.0, -half - low], [0.0, 0.0, half + low], [low, 0.0, 0.0], [-low, 0.0, 0.0]])
        size = float(pixel(_turned(ends, axis)).min())
        quarter = max(_FEWEST // 4, -(-_facets(low, size) // 4))
        angles = [math.pi / 2.0 * step / quarter for step in range(quarter + 1)]
        bottom = [_Station(low * math.sin(a), -half - low * math.cos(a), math.sin(a), -math.cos(a)) for a in angles]
        top = [_Station(part.radius, -part.along, part.out, -part.up) for part in reversed(bottom)]
        return [[*bottom, *top]]
    lean = math.hypot(2.0 * half, low - high)
    out, up = 2.0 * half / lean, (low - high) / lean
    side = [_Station(low, -half, out, up), _Station(high, half, out, up)]
    parts = [[_Station(0.0, -half, 0.0, -1.0), _Station(low, -half, 0.0, -1.0)], side]
    if high > 0.0:
        parts.append([_Station(high, half, 0.0, 1.0), _Station(0.0, half, 0.0, 1.0)])
    return parts


def _nearest(profile: Sequence[Sequence[_Station]], pixel: Callable[[Floats], Floats], axis: str) -> float:
    """The size of a pixel at the nearest of some places on the surface."""
    turns = np.arange(8) * math.pi / 4.0
    rows = [
        [station.radius * math.cos(turn), station.radius * math.sin(turn), station.along]
        for part in profile
        for station in (part[0], part[-1])
        for turn in turns
    ]
    return max(float(pixel(_turned(np.array(rows), axis)).min()), 1e-300)


def _facets(radius: float, pixel: float) -> int:
    """How many facets keep a circle within the tolerance."""
    room = min(TOLERANCE * pixel / radius, 1.0)
    wanted = math.pi / math.acos(1.0 - room) if room > 1e-9 else _MOST
    return int(min(max(math.ceil(wanted), _FEWEST), _MOST))


def _revolved(profile: Sequence[Sequence[_Station]], around: int, axis: str) -> Faces:
    """The profile turned about the axis: quads, and triangles where it meets the axis."""
    turn = 2.0 * math.pi * np.arange(around) / around
    cos, sin = np.cos(turn), np.sin(turn)
    points, faces, normals, first = [], [], [], 0
    for part in profile:
        for low, high in pairwise(part):
            rows = [np.stack([s.radius * cos, s.radius * sin, np.full(around, s.along)], axis=1) for s in (low, high)]
            outs = [np.stack([s.out * cos, s.out * sin, np.full(around, s.up)], axis=1) for s in (low, high)]
            points += rows
            here = np.arange(around)
            beyond = (here + 1) % around
            quad = np.stack([first + here, first + beyond, first + around + beyond, first + around + here], axis=1)
            normal = np.stack([outs[0][here], outs[0][beyond], outs[1][beyond], outs[1][here]], axis=1)
            faces.append(quad)
            normals.append(normal)
            first += 2 * around
    corners = np.concatenate(faces).reshape(-1)
    every = np.concatenate(normals).reshape(-1, 3)
    return Faces(
        _turned(np.concatenate(points), axis),
        np.full(len(corners) // 4, 4),
        corners,
        _turned(every, axis),
    )
