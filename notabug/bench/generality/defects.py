"""Faces such as exporters leave behind: without area, with corners in one place, with a repeated index."""

from __future__ import annotations

import numpy as np

from notabug.bench.generality.shapes import Floats, Shape

FEW = 3  # faces of a shape at most that get a defect beside them


def with_defects(rng: np.random.Generator, shape: Shape) -> Shape:
    """``shape`` with up to ``FEW`` more faces that no ray can meet; what is seen stays the same.

    Each is made of corners of a face that is there: a corner twice (by index, or by a point of its own in the same
    place), or three corners on one line.
    """
    points, faces = [*shape.points.tolist()], [*shape.faces]
    normals, uv = [*shape.normals.tolist()], [*shape.uv.tolist()]
    starts = np.cumsum([0, *(len(face) for face in shape.faces)])
    for _ in range(int(rng.integers(1, FEW + 1))):
        which = int(rng.integers(len(shape.faces)))
        face, first = shape.faces[which], int(starts[which])
        kind = str(rng.choice(["repeated", "coincident", "line", "point"]))
        a, b = face[0], face[1]
        if kind == "repeated":
            corners, like = (a, b, b), (0, 1, 1)
        elif kind == "coincident":
            points.append(points[b])
            corners, like = (a, b, len(points) - 1), (0, 1, 1)
        elif kind == "line":
            points.append(_middle(shape.points, a, b))
            corners, like = (a, len(points) - 1, b), (0, 0, 1)
        else:
            corners, like = (a, a, a), (0, 0, 0)
        faces.append(corners)
        normals += [shape.normals[first + k].tolist() for k in like]
        uv += [shape.uv[first + k].tolist() for k in like]
    return Shape(np.array(points), tuple(faces), np.array(normals), np.array(uv), shape.closed)


def _middle(points: Floats, a: int, b: int) -> list[float]:
    middle: list[float] = ((points[a] + points[b]) / 2).tolist()
    return middle
