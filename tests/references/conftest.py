"""Scenes made of a few arrays, for tests of the tracer, its models and the store."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.scenes_usd.scene import Camera, Card, Floats, Light, Material, Mesh, Object, Scene, Sphere, Texture

WHITE = Material("/White", (1.0, 1.0, 1.0))


class Maker:
    """Builds scenes. ``full`` adds one of every feature behind the camera, so that the code for it takes part."""

    def mesh(
        self,
        points: Any,
        faces: Sequence[Sequence[int]],
        material: int = 0,
        normals: Any = None,
        uv: Any = None,
        path: str = "/Mesh",
    ) -> Mesh:
        """``normals`` and ``uv`` are per point."""
        corners = np.concatenate([np.asarray(each) for each in faces]).astype(np.int32)
        return Mesh(
            path,
            np.ascontiguousarray(points, np.float64),
            np.array([len(each) for each in faces], np.int32),
            corners,
            material,
            None if normals is None else np.ascontiguousarray(np.asarray(normals, np.float64)[corners]),
            None if uv is None else np.ascontiguousarray(np.asarray(uv, np.float64)[corners]),
        )

    def rectangle(self, z: float = 0.0, size: float = 50.0, material: int = 0, uv: Any = None) -> Mesh:
        """A square of half side ``size`` in the plane z, facing +z."""
        points = [(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)]
        return self.mesh(points, [(0, 1, 2, 3)], material, uv=uv, path=f"/Rectangle{z}")

    def sphere(self, centre: Any, radius: float, material: int = 0) -> Sphere:
        place = np.eye(4)
        place[3, :3] = centre
        return Sphere("/Sphere", radius, material, place)

    def camera(self, eye: Any, target: Any, tangent: float = 0.4, up: Any = (0.0, 1.0, 0.0)) -> Camera:
        eye, target = np.asarray(eye, float), np.asarray(target, float)
        z = (eye - target) / np.linalg.norm(eye - target)
        x = np.cross(up, z)
        x /= np.linalg.norm(x)
        place = np.eye(4)
        place[:3, :3] = x, np.cross(z, x), z
        place[3, :3] = eye
        return Camera("/Camera", place, tangent, tangent, 1e-3, 1e6)

    def point(self, position: Any, intensity: float = 1.0) -> Light:
        return Light("/Point", "point", (intensity,) * 3, tuple(position))

    def distant(self, direction: Any, irradiance: float = 1.0) -> Light:
        d = np.asarray(direction, float)
        return Light("/Distant", "distant", (irradiance,) * 3, direction=tuple(d / np.linalg.norm(d)))

    def scene(
        self,
        objects: Sequence[Object],
        lights: Sequence[Light],
        camera: Camera,
        *,
        materials: Sequence[Material] = (WHITE,),
        textures: Sequence[Texture] = (),
        size: int = 64,
        full: bool = False,
        intent: Mesh | None = None,
    ) -> Scene:
        objects, materials, textures = list(objects), list(materials), list(textures)
        if full:
            eye, back = camera.to_world[3, :3], camera.to_world[2, :3]
            place = eye + 2.0 * back
            points = place + 0.01 * np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
            textures.append(Texture(Path("furniture"), np.ones((1, 1, 3))))
            materials.append(Material("/Furniture", (1.0, 1.0, 1.0), len(textures) - 1, (0.1,) * 3, opacity=0.5))
            objects.append(
                self.mesh(points, [(0, 1, 2, 3)], len(materials) - 1, uv=points[:, :2], path="/Furniture/Quad")
            )
            objects.append(self.sphere(place + 0.1 * back, 0.01, len(materials) - 1))
        return Scene(
            "test/scene", Path("scene.usda"), {}, Card("calibration", "A test."), camera, size, size, tuple(objects),
            tuple(lights), tuple(materials), tuple(textures), intent,
        )  # fmt: skip


@pytest.fixture(scope="session")
def make() -> Maker:
    return Maker()


def pixel_rays(scene: Scene) -> tuple[Floats, Floats]:
    """Origin (3,) and unit directions (h, w, 3) through the pixel centres, by the camera's definition."""
    c = scene.camera
    x = (2 * (np.arange(scene.width) + 0.5) / scene.width - 1) * c.tan_x
    y = (1 - 2 * (np.arange(scene.height) + 0.5) / scene.height) * c.tan_y
    local = np.stack([*np.meshgrid(x, y), -np.ones((scene.height, scene.width))], axis=2)
    world = local @ c.to_world[:3, :3]
    return c.to_world[3, :3], world / np.linalg.norm(world, axis=2, keepdims=True)


@pytest.fixture(scope="session")
def rays() -> Any:
    """``rays(scene)``: see pixel_rays."""
    return pixel_rays
