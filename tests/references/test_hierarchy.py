"""The hierarchy of eight boxes a node: it holds every triangle once, and loses no hit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from notabug.references import _native
from notabug.references.tracer import bvh
from notabug.references.tracer.flatten import flatten


def test_wide_nodes_hold_what_the_binary_ones_do() -> None:
    """Every triangle is in one leaf, in order, and within the boxes above it; and no traversal outgrows its stack."""
    rng = np.random.default_rng(5)
    triangles = (
        rng.normal(size=(500, 1, 3)) * rng.choice([1e-3, 1.0, 30.0], (500, 1, 1)) + rng.normal(size=(500, 3, 3)) * 0.01
    )
    triangles[:9] = triangles[0]  # a leaf of more than four that cannot be told apart
    bounds, child, count, order = bvh.build(triangles.reshape(-1, 9))
    nodes, leaves, frame = bvh.widen(bounds, child, count)
    corners = triangles[order] - frame[:3]
    sides, below, held = nodes[:, :48].view(np.float32).reshape(-1, 2, 3, 8), nodes[:, 48:56], nodes[:, 56:]
    assert np.abs(corners).max() <= frame[3]
    seen: list[int] = []
    stack = [(0, np.full(3, -np.inf), np.full(3, np.inf), 0)]
    while stack:
        node, lo, hi, waiting = stack.pop()
        assert waiting < bvh.STACK
        for k in range(8):
            if held[node, k] < 0:
                continue
            low, high = np.maximum(lo, sides[node, 0, :, k]), np.minimum(hi, sides[node, 1, :, k])
            if held[node, k] == 0:
                stack.append((int(below[node, k]), low, high, waiting + 7))
            for first, n in leaves[below[node, k] : below[node, k] + held[node, k]]:
                assert 0 < n <= 4
                seen += range(first, first + n)
                assert (corners[first : first + n] >= low).all()
                assert (corners[first : first + n] <= high).all()
    assert sorted(seen) == list(range(500))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(("place", "away"), [(0.0, 3.0), (1e3, 3.0), (0.0, 1e5), (1e-4, 1e-3), (0.0, 0.0)])
def test_the_hierarchy_loses_no_hit(make: Any, dtype: Any, place: float, away: float) -> None:
    """The nearest hits are those of all triangles one by one, ties included: quads, two of each in one place.

    Rays along axes, in planes of boxes, from far away, from within; scenes far from the origin.
    """
    rng = np.random.default_rng(7)
    corners = rng.integers(-4, 5, (30, 4, 3)).astype(float)
    corners[:, 3] = corners[:, 0] + corners[:, 2] - corners[:, 1]
    points = np.concatenate([corners, corners]).reshape(-1, 3) * 0.25 + place
    faces = [tuple(range(4 * k, 4 * k + 4)) for k in range(60)]
    scene = make.scene([make.mesh(points, faces)], [], make.camera((0, 0, 5), (0, 0, 0)))
    flat = flatten(scene, dtype)
    directions = np.concatenate([rng.integers(-2, 3, (60, 3)).astype(float), rng.normal(size=(60, 3))])
    directions = directions[(directions != 0).any(axis=1)]
    through = points[rng.integers(0, len(points), len(directions))]
    origins = np.ascontiguousarray(through - away * directions, dtype)
    directions = np.ascontiguousarray(directions, dtype)
    hits, distances, _ = _native.trace(flat, origins, directions)
    blocked = _native.occluded(flat, origins, directions, np.full(len(origins), 1e30, dtype))
    some = 0
    for o, d, hit, distance, dark in zip(origins, directions, hits, distances, blocked, strict=True):
        met = np.array([_native.ray_triangle(o, d, each)[0] for each in flat.points])
        met[~(met > 0)] = np.inf
        nearest = met == met.min()
        assert distance == met.min()
        assert dark == (met.min() < 1e30)
        if np.isfinite(distance):
            some += 1
            assert nearest[hit]
            assert flat.face[hit] == flat.face[nearest].min()
        else:
            assert hit == -1
    assert some > 50
