"""One polygon that is not strictly convex, to triangles: a fan where it fits, else ear by ear (Meisters 1975)."""

from __future__ import annotations

import numpy as np

from notabug.scenes_usd.scene import Floats

Triple = tuple[int, int, int]


def fan(count: int, start: int) -> list[Triple]:
    """The triangles of a fan from the corner ``start``.

    >>> fan(5, 1)
    [(1, 2, 3), (1, 3, 4), (1, 4, 0)]
    """
    return [(start, (start + 1 + step) % count, (start + 2 + step) % count) for step in range(count - 2)]


def fits(triples: list[Triple], plane: Floats, room: float) -> bool:
    """Whether no triangle of ``triples`` is turned round or lies on a line, but for those with corners in one place.

    ``plane`` (n, 2) are the corners in their plane, ``room`` is the length below which they are in one place.
    """
    return all(_height(*plane[list(triple)]) > room or _pinched(plane, triple, room) for triple in triples)


def ears(plane: Floats, room: float) -> list[Triple] | None:
    """The triangles that are left when ears are cut off one by one, the first of the corners that are one first.

    An ear is a corner whose triangle with its two neighbours is turned as the face is and holds no other corner. None
    where there is none: the face crosses itself.
    """
    left, found = list(range(len(plane))), []
    while len(left) > 3:
        place = next((k for k in range(len(left)) if _is_ear(plane, left, k, room)), None)
        if place is None:
            return None
        found.append(_around(left, place))
        del left[place]
    return [*found, (left[0], left[1], left[2])]


def _around(left: list[int], place: int) -> Triple:
    return left[place - 1], left[place], left[(place + 1) % len(left)]


def _is_ear(plane: Floats, left: list[int], place: int, room: float) -> bool:
    triple = _around(left, place)
    a, b, c = plane[list(triple)]
    if _pinched(plane, triple, room):  # two corners in one place: a triangle of nothing, which may always go
        return bool(np.linalg.norm(b - a) <= room or np.linalg.norm(c - b) <= room)
    if _height(a, b, c) <= room:
        return False
    others = plane[[each for each in left if each not in triple]]
    inside = np.ones(len(others), np.bool_)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        inside &= edge[0] * (others[:, 1] - start[1]) - edge[1] * (others[:, 0] - start[0]) >= -room * _length(edge)
    apart = np.array([np.linalg.norm(others - each, axis=1) > room for each in (a, b, c)]).all(axis=0)
    return not (inside & apart).any()


def _pinched(plane: Floats, triple: Triple, room: float) -> bool:
    a, b, c = plane[list(triple)]
    return min(_length(b - a), _length(c - b), _length(a - c)) <= room


def _height(a: Floats, b: Floats, c: Floats) -> float:
    """The least height of a triangle in the plane, negative where it goes round clockwise."""
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    longest = max(_length(b - a), _length(c - b), _length(a - c))
    return float(area) / longest if longest else 0.0


def _length(edge: Floats) -> float:
    return float(np.hypot(edge[0], edge[1]))
