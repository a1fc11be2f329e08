"""A whole scene moved, turned or scaled: same picture, other numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notabug.scenes_usd.emitters import turned
from notabug.scenes_usd.scene import Camera, Floats, Light, Mesh, Object, Scene


def translation(x: float, y: float, z: float) -> Floats:
    """A (4, 4) matrix for row vectors."""
    matrix = np.eye(4)
    matrix[3, :3] = x, y, z
    return matrix


def rotation(axis: tuple[float, float, float], degrees: float) -> Floats:
    """A (4, 4) matrix for row vectors: ``degrees`` about ``axis``, right-handed (Rodrigues).

    >>> (np.array([1, 0, 0, 1]) @ rotation((0, 0, 1), 90)).round(12)[:3].tolist()
    [0.0, 1.0, 0.0]
    """
    x, y, z = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)).T
    return matrix


def transformed(scene: Scene, matrix: Floats) -> Scene:
    """``scene`` under the similarity ``matrix`` (4, 4), row vectors: camera, clipping planes and lights go along.

    Radiant intensities grow with the square of the scale, so that the picture stays what it was.
    """
    linear = matrix[:3, :3]
    scale = float(np.cbrt(np.linalg.det(linear)))
    if not scale > 0.0 or not np.allclose(linear @ linear.T, scale**2 * np.eye(3), rtol=0.0, atol=1e-9 * scale**2):
        raise ValueError("not a similarity: a picture would change")
    turn = linear / scale
    camera = scene.camera
    placed = np.eye(4)
    placed[:3, :3] = camera.to_world[:3, :3] @ turn
    placed[3, :3] = camera.to_world[3, :3] @ linear + matrix[3, :3]
    return replace(
        scene,
        camera=rescaled(replace(camera, to_world=placed), scale),
        lights=tuple(_light(each, matrix, turn, scale) for each in scene.lights),
        objects=tuple(_object(each, matrix, turn) for each in scene.objects),
        intent=None if scene.intent is None else _mesh(scene.intent, matrix, turn),
    )


def rescaled(camera: Camera, scale: float) -> Camera:
    """``camera`` in a world whose lengths are multiplied by ``scale``, but for its place."""
    seen = scale if camera.orthographic else 1.0
    return replace(
        camera,
        tan_x=camera.tan_x * seen,
        tan_y=camera.tan_y * seen,
        near=camera.near * scale,
        far=camera.far * scale,
    )


def _light(light: Light, matrix: Floats, turn: Floats, scale: float) -> Light:
    if light.kind == "distant":
        x, y, z = (np.asarray(light.direction) @ turn).tolist()
        return replace(light, direction=(x, y, z))
    x, y, z = (np.asarray(light.position) @ matrix[:3, :3] + matrix[3, :3]).tolist()
    if light.emitter is not None:  # a radiance is the same at every scale
        return replace(turned(light, matrix[:3, :3]), position=(x, y, z))
    r, g, b = light.intensity
    moved = replace(light, position=(x, y, z), intensity=(r * scale**2, g * scale**2, b * scale**2))
    return moved if light.shaping is None else turned(moved, turn)


def _object(each: Object, matrix: Floats, turn: Floats) -> Object:
    return _mesh(each, matrix, turn) if isinstance(each, Mesh) else replace(each, to_world=each.to_world @ matrix)


def _mesh(mesh: Mesh, matrix: Floats, turn: Floats) -> Mesh:
    return replace(
        mesh,
        points=np.ascontiguousarray(mesh.points @ matrix[:3, :3] + matrix[3, :3]),
        normals=None if mesh.normals is None else np.ascontiguousarray(mesh.normals @ turn),
        to_world=mesh.to_world @ matrix,
    )
