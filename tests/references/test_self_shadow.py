"""Facet self-shadow is forgiven, real self-shadow is not: against an analytic torus and an analytic bowl.

The truth is computed here, on the smooth surface, from its equation; the tracer sees facets with interpolated normals.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from notabug.references import _native
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.flatten import flatten
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Mesh

MAJOR, MINOR = 1.0, 0.4
SIZE = 144
TANGENT = 0.32


def grid(n: int, m: int, closed: bool, at: Callable[[Any, Any], tuple[Any, Any]]) -> tuple[Any, Any, list[Any]]:
    """Points, normals and triangles of a surface over (i / n, j / m), periodic in i and, if ``closed``, in j."""
    rows = m if closed else m + 1
    i, j = np.meshgrid(np.arange(n) / n, np.arange(rows) / m, indexing="xy")
    points, normals = at(i.ravel(), j.ravel())
    faces = []
    for b in range(m):
        for a in range(n):
            p, q = b * n + a, b * n + (a + 1) % n
            r, s = ((b + 1) % rows) * n + (a + 1) % n, ((b + 1) % rows) * n + a
            faces += [(p, q, r), (p, r, s)]
    used = [f for f in faces if np.linalg.norm(np.cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]])) > 0]
    for p, q, r in used:  # counter-clockwise seen from where the normals point to
        assert np.cross(points[q] - points[p], points[r] - points[p]) @ (normals[p] + normals[q] + normals[r]) > 0
    return points, normals, used


def torus(n: int, m: int) -> tuple[Any, Any, list[Any]]:
    def at(i: Any, j: Any) -> tuple[Any, Any]:
        a, b = 2 * np.pi * i, 2 * np.pi * j
        normal = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)
        ring = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
        return MAJOR * ring + MINOR * normal, normal

    return grid(n, m, True, at)


def on_torus(p: Any) -> tuple[Any, Any]:
    """The nearest point of the smooth torus, and its normal."""
    ring = p * [1, 1, 0]
    ring *= MAJOR / np.linalg.norm(ring, axis=-1, keepdims=True)
    normal = (p - ring) / np.linalg.norm(p - ring, axis=-1, keepdims=True)
    return ring + MINOR * normal, normal


def torus_shadow(p: Any, d: Any) -> Any:
    """Whether the ray from ``p`` on the torus meets it again.

    With f(p) = (|p|^2 + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2), f(p + t d) is a quartic in t whose constant term is 0; what
    is left over t is a cubic, positive at once where N.L > 0: blocked where its local minimum beyond 0 is negative.
    """
    k = (p * p).sum(-1) + MAJOR**2 - MINOR**2
    b = 2 * (p * d).sum(-1)
    flat_pd, flat_dd = (p[:, :2] * d[:2]).sum(-1), (d[:2] ** 2).sum()
    c2, c1, c0 = 2 * b, b * b + 2 * k - 4 * MAJOR**2 * flat_dd, 2 * k * b - 8 * MAJOR**2 * flat_pd
    disc = c2 * c2 - 3 * c1  # of the derivative 3 t^2 + 2 c2 t + c1
    t = (-c2 + np.sqrt(np.maximum(disc, 0))) / 3
    return (disc > 0) & (t > 0) & (((t + c2) * t + c1) * t + c0 < 0)


def bowl(n: int, m: int) -> tuple[Any, Any, list[Any]]:
    """The half sphere y < 0 of radius 1, normals and faces outwards, open above."""

    def at(i: Any, j: Any) -> tuple[Any, Any]:
        a, b = 2 * np.pi * i, np.pi / 2 * (1 - j)
        normal = np.stack([np.sin(b) * np.cos(a), -np.cos(b), np.sin(b) * np.sin(a)], axis=1)
        return normal, normal

    return grid(n, m, False, at)


def on_bowl_inside(p: Any) -> tuple[Any, Any]:
    q = p / np.linalg.norm(p, axis=-1, keepdims=True)
    return q, -q


def bowl_shadow(p: Any, d: Any) -> Any:
    """Inside a sphere the ray leaves at p - 2 (p.d) d; blocked where that is below the rim."""
    return p[:, 1] - 2 * (p @ d) * d[1] < 0


def compare(make: Any, rays: Any, mesh: Mesh, light: Any, eye: Any, smooth: Any, shadow: Any) -> dict[str, Any]:
    """Counts of pixels, and how far on the surface the farthest wrong one is from where it would be right."""
    up = (0.0, 0.0, 1.0) if abs(eye[1]) > abs(eye[2]) else (0.0, 1.0, 0.0)
    scene = make.scene([mesh], [make.distant(light)], make.camera(eye, (0, 0, 0), TANGENT, up), size=SIZE)
    L = -np.asarray(light) / np.linalg.norm(light)
    origin, directions = rays(scene)
    directions = np.ascontiguousarray(directions.reshape(-1, 3))
    hits, t, _ = _native.trace(flatten(scene), np.tile(origin, (SIZE**2, 1)), directions)
    seen = np.flatnonzero(hits >= 0)
    p, normal = smooth(origin + t[seen, None] * directions[seen])
    facing = (normal * directions[seen]).sum(1) < 0  # else facets show what the smooth surface hides
    seen, p, normal = seen[facing], p[facing], normal[facing]
    true = (normal @ L > 0) & ~shadow(p, L)
    drawn = {
        each: (trace_picture(scene, Options(shadows=each), threads=1)[:, :, 0] > 0).ravel()[seen]
        for each in ("forgiving", "facets")
    }
    wrong = drawn["forgiving"] != true
    far = 0.0
    for value in (False, True):
        if (wrong & (true == value)).any():
            far = max(far, cKDTree(p[true != value]).query(p[wrong & (true == value)])[0].max())
    real = (normal @ L > 0) & ~true
    return {
        "lit": int(true.sum()), "darkened": int((true & ~drawn["forgiving"]).sum()),
        "darkened by facets": int((true & ~drawn["facets"]).sum()),
        "real shadow": int(real.sum()), "lost": int((real & drawn["forgiving"]).sum()),
        "farthest": round(float(far), 4),
    }  # fmt: skip


SHAPES = {
    "torus": (torus, on_torus, torus_shadow, 2 * math.pi * (MAJOR + MINOR)),
    "bowl": (bowl, on_bowl_inside, bowl_shadow, 2 * math.pi),
}
VIEWS = {
    "torus": [((-1, 0.1, -0.1), (1, 0.5, 5)), ((-1, 0.2, -0.35), (-3, 2, 2)), ((-1, 0.1, -0.1), (2.5, -3, 4))],
    "bowl": [((-1, -1, 0.2), (0.5, 5, 1)), ((-1, -0.3, 0.1), (0.5, 5, 1)), ((0.1, -1, 0), (0.5, 5, 1))],
}


@pytest.mark.parametrize("orientation", ["out", "in"])
@pytest.mark.parametrize("shape", SHAPES)
def test_real_self_shadows_survive_and_facets_do_not_show(make: Any, rays: Any, shape: str, orientation: str) -> None:
    """Whatever the reference gets wrong lies within half a facet, and two pixels, of a true shadow's boundary.

    ``in``: the same mesh with faces and normals turned round, which must not matter.
    """
    surface, smooth, shadow, girth = SHAPES[shape]
    resolutions = (16, 32, 64) if orientation == "out" else (16,)
    lost, darkened = [], []
    for n in resolutions:
        points, normals, faces = surface(n, n // 4 if shape == "bowl" else n // 2)
        if orientation == "in":
            normals, faces = -normals, [face[::-1] for face in faces]
        found = [
            compare(make, rays, make.mesh(points, faces, 0, normals), light, eye, smooth, shadow)
            for light, eye in VIEWS[shape]
        ]
        pixel = 2 * TANGENT * 5.5 / SIZE
        for (light, _), each in zip(VIEWS[shape], found, strict=True):
            print(f"\n{shape} {n} facets around, faces {orientation}, light {light}:", each)
            assert each["farthest"] < 0.5 * girth / n + 2 * pixel
        total = {key: sum(each[key] for each in found) for key in found[0]}
        lost.append(total["lost"] / total["real shadow"])
        darkened.append(total["darkened"] / total["lit"])
        print(f"  share of the real shadow lost {lost[-1]:.4f}, of the lit surface darkened {darkened[-1]:.4f}")
        if shape == "torus":
            assert total["darkened by facets"] > 3 * total["darkened"]
    if orientation == "out":
        assert lost[2] < 0.02
        assert lost[2] < 0.4 * lost[1] < 0.4 * lost[0] or lost[1] < 0.02
        assert darkened[2] < 0.005
        assert darkened[2] < 0.6 * darkened[0]


def test_an_open_shell_shadows_another_of_the_same_mesh(make: Any) -> None:
    """Two half pipes, one inside the other, as one mesh: light from outside meets only the back of the outer one."""
    n, gap = 24, 0.01  # the gap is of the facets' own sagitta
    points, normals, faces = [], [], []
    for radius, low, high in ((1.0, -1.0, 1.0), (1.0 + gap, 0.0, 1.0)):
        base = len(points)
        for i in range(n + 1):
            a = math.pi * i / n
            for y in (low, high):
                points.append((radius * math.cos(a), y, radius * math.sin(a)))
                normals.append((math.cos(a), 0.0, math.sin(a)))
        faces += [(base + 2 * i + 1, base + 2 * i + 3, base + 2 * i) for i in range(n)]
        faces += [(base + 2 * i + 3, base + 2 * i + 2, base + 2 * i) for i in range(n)]
    mesh = make.mesh(points, faces, 0, normals)
    light = make.distant((0.3, 0.4, -1))  # from +z and below: lights the inner pipe under the outer one's edge only
    camera = make.camera((0, -6, 3), (0, 0, 0.5), 0.3, (0, 0, 1))
    scene = make.scene([mesh], [light], camera, size=48)
    whole = [trace_picture(scene, Options(shadows=each)) for each in ("forgiving", "facets")]
    parts = [
        make.mesh(points, some, 0, normals, path=f"/{k}") for k, some in enumerate((faces[: 2 * n], faces[2 * n :]))
    ]
    apart = trace_picture(make.scene(parts, [light], camera, size=48))
    assert (whole[1] > 0).any()
    assert np.array_equal(apart > 0, whole[0] > 0)  # two meshes never forgive each other
