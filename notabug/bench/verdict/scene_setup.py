"""Edits of a scene that make room for a fault: a second light, a ceiling, another format. Picture and reference get
them alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from notabug.references.models.light import brighter
from notabug.references.models.model import edit_meshes
from notabug.scenes_usd.scene import Floats, Light, Material, Mesh, Scene


def _squashed(scene: Scene) -> Scene:
    """Meshes with normals at 0.6 of their height, by a transform that is no rotation."""
    scale = np.diag([1.0, 0.6, 1.0, 1.0])

    def one(mesh: Mesh) -> Mesh:
        if mesh.normals is None:
            return mesh
        middle = mesh.points.mean(axis=0) * np.array([1.0, 0.4, 1.0])
        middle[[0, 2]] = 0.0
        normals = mesh.normals @ np.linalg.inv(scale[:3, :3]).T
        return replace(
            mesh,
            points=np.ascontiguousarray(mesh.points @ scale[:3, :3] + middle),
            normals=np.ascontiguousarray(normals / np.linalg.norm(normals, axis=1, keepdims=True)),
            to_world=scale,
        )

    return edit_meshes(scene, one)


def _ceiling(scene: Scene) -> Scene:
    """A square behind each point light, as seen from the scene."""
    made = []
    for light in scene.lights:
        if light.kind != "point":
            continue
        position = np.array(light.position)
        away = position - _middle(scene)
        distance = float(np.linalg.norm(away))
        away = away / distance
        side = np.cross(away, (0.0, 0.0, 1.0) if abs(away[2]) < 0.9 else (1.0, 0.0, 0.0))
        side *= 0.3 * distance / np.linalg.norm(side)
        up = np.cross(away, side)
        centre = position + 0.3 * distance * away
        made.append(
            Mesh(
                path=f"{light.path}/Ceiling",
                points=np.array([centre - side - up, centre + side - up, centre + side + up, centre - side + up]),
                counts=np.array([4], np.int32),
                corners=np.arange(4, dtype=np.int32),
                material=len(scene.materials),
            )
        )
    if not made:
        return scene
    grey = Material("/Ceiling", (0.5, 0.5, 0.5))
    return replace(scene, objects=(*scene.objects, *made), materials=(*scene.materials, grey))


def _two_lights(scene: Scene) -> Scene:
    """Each light at 0.6, and a second one from the other side at 0.4."""
    middle = _middle(scene)
    first = tuple(brighter(light, 0.6) for light in scene.lights)
    flip = np.array([-1.0, 1.0, 1.0])
    second = tuple(
        replace(
            brighter(light, 0.4),
            path=f"{light.path}Second",
            position=_tuple((np.array(light.position) - middle) * flip + middle),
            direction=_tuple(np.array(light.direction) * flip),
        )
        for light in scene.lights
    )
    return replace(scene, lights=first + second)


def _wide(scene: Scene) -> Scene:
    """Twice as wide as high."""
    height = scene.height // 2
    return replace(scene, height=height, camera=replace(scene.camera, tan_y=scene.camera.tan_x * height / scene.width))


def _tiled(scene: Scene) -> Scene:
    """Textures that go beyond 1: twice as many, a quarter of a picture off."""
    return edit_meshes(
        scene, lambda mesh: mesh if mesh.uv is None else replace(mesh, uv=np.ascontiguousarray(mesh.uv * 2.0 - 0.25))
    )


def _near_light(scene: Scene) -> Scene:
    """A point light in the place of each distant one, so that its vector has a length."""
    middle = _middle(scene)

    def one(light: Light) -> Light:
        if light.kind == "point":
            return light
        away = 0.7 * float(np.linalg.norm(scene.camera.to_world[3, :3] - middle))
        position = middle - away * np.array(light.direction)
        return replace(brighter(light, away**2), kind="point", position=_tuple(position))

    return replace(scene, lights=tuple(one(each) for each in scene.lights))


STAGES: dict[str, Callable[[Scene], Scene]] = {
    "squashed": _squashed,
    "ceiling": _ceiling,
    "two_lights": _two_lights,
    "wide": _wide,
    "tiled": _tiled,
    "near_light": _near_light,
}


def jittered(scene: Scene, seed: int) -> Scene:
    """``scene`` seen and lit a little differently for every ``seed``; 0: as authored."""
    if not seed:
        return scene
    rng = np.random.default_rng(seed)
    zoom = float(rng.uniform(0.9, 1.1))
    camera = replace(scene.camera, tan_x=scene.camera.tan_x * zoom, tan_y=scene.camera.tan_y * zoom)
    middle = _middle(scene)

    def one(light: Light) -> Light:
        step = rng.uniform(-0.08, 0.08, 3)
        position = np.array(light.position)
        position = position + step * np.linalg.norm(position - middle)
        direction = np.array(light.direction) + 0.3 * step * np.abs(light.direction)
        return replace(light, position=_tuple(position), direction=_tuple(direction / np.linalg.norm(direction)))

    return replace(scene, camera=camera, lights=tuple(one(each) for each in scene.lights))


def resized(scene: Scene, side: int) -> Scene:
    """``scene`` with the longer side of its picture ``side`` pixels."""
    scale = side / max(scene.width, scene.height)
    return replace(scene, width=round(scene.width * scale), height=round(scene.height * scale))


def _middle(scene: Scene) -> Floats:
    points = [mesh.points.mean(axis=0) for mesh in scene.meshes] + [sphere.to_world[3, :3] for sphere in scene.spheres]
    return np.asarray(np.mean(points, axis=0))


def _tuple(values: Floats) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)
