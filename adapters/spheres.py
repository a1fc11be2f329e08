"""Spheres for renderers that have a centre and a radius for them and no ellipsoids, or meshes alone."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np

from notabug.adapters.base import Declaration, UnsupportedError
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.scene import Floats, Ints, Mesh, Scene, Sphere

AROUND, HIGH = 64, 32  # facets of a sphere's mesh around its axis and from pole to pole, as in the scenes of the corpus

_SIMILAR = 1e-6  # relative deviation from a similarity: one that float32 cannot show


def centre_and_radius(sphere: Sphere) -> tuple[list[float], float]:
    """Both in world space; raises UnsupportedError for what is an ellipsoid there."""
    linear = sphere.to_world[:3, :3]
    square = linear @ linear.T
    scale = float(np.trace(square)) / 3.0
    if np.abs(square - scale * np.eye(3)).max() > _SIMILAR * scale:
        raise UnsupportedError(
            "a sphere that is scaled unevenly or sheared",
            where=sphere.path,
            expected="rotation, translation and uniform scale",
            do="use a renderer with ellipsoids (povray), or a mesh",
        )
    return sphere.to_world[3, :3].tolist(), sphere.radius * math.sqrt(scale)


def as_given(scene: Scene, declaration: Declaration) -> Scene:
    """``scene`` as a renderer of ``declaration`` gets it, and is judged by: its spheres as meshes, where it says so."""
    return scene if declaration.spheres == "exact" else with_meshes(scene)


def with_meshes(scene: Scene) -> Scene:
    """``scene`` with a mesh in the place of each exact sphere; its notes say so."""
    count = sum(1 for _ in scene.spheres)
    if not count:
        return scene
    return replace(
        scene,
        objects=tuple(_as_mesh(shape) if isinstance(shape, Sphere) else shape for shape in scene.objects),
        card=replace(scene.card, requires=scene.card.requires - {"sphere"}),
        notes=(*scene.notes, f"of exact spheres, {count} here, meshes of {AROUND} x {HIGH} facets are drawn"),
    )


def _as_mesh(sphere: Sphere) -> Mesh:
    """Triangles with the sphere's own normals at their corners; of an ellipsoid too."""
    points, corners = _unit_mesh()
    linear, origin = sphere.to_world[:3, :3], sphere.to_world[3, :3]
    if np.linalg.det(linear) < 0.0:  # mirrored: seen from outside the corners run clockwise
        corners = corners[:, ::-1]
    normals = points @ np.linalg.inv(linear).T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(
        sphere.path,
        points=points * sphere.radius @ linear + origin,
        counts=np.full(len(corners), 3, np.int32),
        corners=np.ascontiguousarray(corners.reshape(-1)),
        material=sphere.material,
        normals=normals[corners.reshape(-1)],
        to_world=sphere.to_world,
    )


@cache
def _unit_mesh() -> tuple[Floats, Ints]:
    """Points (p, 3) of the unit sphere, which are their own normals, and corners (t, 3) of its triangles."""
    points, faces = lat_long(AROUND, HIGH)
    return np.array(points, np.float64), np.array(faces, np.int32)
