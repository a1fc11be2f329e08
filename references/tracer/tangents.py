"""Tangents at the corners of meshes with a normal map, as MikkTSpace makes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.once import once
from notabug.scenes_usd.scene import Mesh, Scene
from notabug.scenes_usd.triangulate import triangulate

Floats = npt.NDArray[np.float64]


def scene_tangents(scene: Scene) -> Floats | None:
    """The tangents (c, 3) of all the face corners of ``scene``, nought where none is asked for; None: nowhere.

    They follow each other as the corners of Flat do: those of spheres are none.
    """
    meshes = [each for each in scene.objects if isinstance(each, Mesh)]
    mapped = [has_normal_map(scene, each) for each in meshes]
    if not any(mapped):
        return None
    parts: Sequence[Floats] = [
        corner_tangents(each) if asked else np.zeros((len(each.corners), 3))
        for each, asked in zip(meshes, mapped, strict=True)
    ]
    return np.concatenate(parts)


def has_normal_map(scene: Scene, mesh: Mesh) -> bool:
    """Whether the normals of ``mesh`` are mapped: its material has a map of them, and it coordinates."""
    preview = scene.materials[mesh.material].preview
    return preview is not None and preview.normal_map >= 0 and mesh.uv is not None


@once
def corner_tangents(mesh: Mesh) -> Floats:
    """The tangents (c, 3) of the face corners of ``mesh``: of unit length, square to the normals.

    Mikkelsen 2008, "Simulation of wrinkled surfaces revisited", and his MikkTSpace: each triangle's dP/du in the plane
    of the corner's normal, of unit length, is weighted by the triangle's angle there, and added up over the corners
    that have place, normal, coordinates and the side of the coordinates in common.
    """
    assert mesh.uv is not None
    cut = triangulate(mesh)
    corner, points = cut.corner, cut.points
    uv = mesh.uv[corner]
    (u1, v1), (u2, v2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    first, second = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    area = u1 * v2 - u2 * v1
    along = np.sign(area)[:, None] * (v2[:, None] * first - v1[:, None] * second)
    if mesh.normals is None:
        normals = np.repeat(_unit(np.cross(first, second))[:, None], 3, axis=1)
    else:
        normals = _unit(mesh.normals[corner])
    flat = _unit(along[:, None] - (normals * along[:, None]).sum(axis=2, keepdims=True) * normals)
    weighted = (flat * _angles(points, normals)[..., None]).reshape(-1, 3)
    side = np.repeat(np.sign(area), 3)[:, None]
    keys = np.concatenate([points.reshape(-1, 3), normals.reshape(-1, 3), uv.reshape(-1, 2), side], axis=1)
    group = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    total = np.zeros((int(group.max(initial=-1)) + 1, 3))
    np.add.at(total, group, weighted)
    made = np.zeros((len(mesh.corners), 3))
    made[corner.ravel()] = _unit(total)[group]
    return made


def _angles(points: Floats, normals: Floats) -> Floats:
    """The angle (t, 3) of each triangle at each corner, seen along the corner's normal."""
    before, after = np.roll(points, 1, axis=1) - points, np.roll(points, -1, axis=1) - points
    one, other = (_unit(each - (normals * each).sum(axis=2, keepdims=True) * normals) for each in (before, after))
    return np.asarray(np.arccos(np.clip((one * other).sum(axis=2), -1.0, 1.0)))


def _unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) of unit length; nought stays nought."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(size > 0, size, 1.0))
