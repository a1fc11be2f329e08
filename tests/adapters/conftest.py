"""Small scenes built by hand, the pictures that renderers make of them, and rays to compute the same in numpy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Adapter, Quality
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import (
    Camera,
    Card,
    Floats,
    Light,
    Material,
    Mesh,
    Object,
    Scene,
    Sphere,
    Texture,
)

CENTRES = Quality(samples=1)


@dataclass(frozen=True)
class Stage:
    """Builders of scenes, and what a picture of them must be."""

    out: Path
    centres: Quality = CENTRES

    def camera(self, eye: Sequence[float], target: Sequence[float] = (0, 0, 0), tan: float = 0.5) -> Camera:
        z = np.array(eye, float) - np.array(target, float)
        z /= np.linalg.norm(z)
        x = np.cross((0.0, 1.0, 0.0), z)
        x /= np.linalg.norm(x)
        to_world = np.eye(4)
        to_world[:3, :3] = x, np.cross(z, x), z
        to_world[3, :3] = eye
        return Camera("/Scene/Camera", to_world, tan, tan, 0.01, 1e4)

    def quad(
        self, half: float = 9.0, at: Sequence[float] = (0, 0, 0), material: int = 0, uv: Floats | None = None
    ) -> Mesh:
        """A square in a plane of constant z, facing +z; ``uv`` of its corners, from lower left, counter-clockwise."""
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float) * half + np.array(at, float)
        return Mesh("/Scene/Quad", corners, np.array([4], np.int32), np.arange(4, dtype=np.int32), material, uv=uv)

    def ball(self, around: int = 24, high: int = 12) -> Mesh:
        """A unit sphere of quads and polar triangles, with the sphere's normals."""
        theta, phi = np.linspace(0, np.pi, high + 1), np.arange(around) / around * 2 * np.pi
        ring = [[np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)] for t in theta[1:-1] for p in phi]
        points = np.array([[0, 0, 1], *ring, [0, 0, -1]], float)
        counts, corners = [], []
        for i in range(around):
            j = (i + 1) % around
            corners += [0, 1 + i, 1 + j]
            counts.append(3)
            for row in range(high - 2):
                a, b = 1 + row * around, 1 + (row + 1) * around
                corners += [a + i, b + i, b + j, a + j]
                counts.append(4)
            last = 1 + (high - 2) * around
            corners += [last + i, len(points) - 1, last + j]
            counts.append(3)
        index = np.array(corners, np.int32)
        return Mesh("/Scene/Ball", points, np.array(counts, np.int32), index, 0, normals=points[index])

    def distant(self, towards: Sequence[float], irradiance: Sequence[float] = (1, 1, 1)) -> Light:
        """A distant light; ``towards`` is L, the direction to the light."""
        L = np.array(towards, float)
        return Light("/Scene/Sun", "distant", tuple(irradiance), direction=tuple(-L / np.linalg.norm(L)))

    def point(self, position: Sequence[float], intensity: Sequence[float] = (6, 6, 6)) -> Light:
        return Light("/Scene/Lamp", "point", tuple(intensity), position=tuple(position))

    def grey(self, albedo: float = 0.8) -> Material:
        return Material("/Scene/Grey", (albedo,) * 3)

    def scene(
        self,
        objects: Sequence[Object],
        lights: Sequence[Light],
        camera: Camera,
        materials: Sequence[Material] = (),
        textures: Sequence[Texture] = (),
        size: tuple[int, int] = (64, 64),
    ) -> Scene:
        return Scene(
            "hand/made",
            Path("made.usda"),
            {},
            Card("calibration", "made by hand"),
            camera,
            *size,
            objects=tuple(objects),
            lights=tuple(lights),
            materials=tuple(materials) or (self.grey(),),
            textures=tuple(textures),
        )

    def draw(self, adapter: Adapter, scene: Scene, quality: Quality = CENTRES) -> Floats:
        """The mean of the adapter's pictures (h, w, 3), float64."""
        pictures = [read_picture(each.image).pixels for each in adapter.render(scene, self.out, quality)]
        return np.mean(pictures, axis=0, dtype=np.float64)

    def rays(self, scene: Scene) -> tuple[Floats, Floats]:
        """Origin (3,) and unit directions (h, w, 3) of the rays through the pixel centres."""
        camera = scene.camera
        y, x = np.mgrid[0 : scene.height, 0 : scene.width] + 0.5
        across = (2 * x / scene.width - 1) * camera.tan_x
        up = (1 - 2 * y / scene.height) * camera.tan_y
        local = np.stack([across, up, -np.ones_like(x)], axis=-1)
        D = local @ camera.to_world[:3, :3]
        return camera.to_world[3, :3], D / np.linalg.norm(D, axis=-1, keepdims=True)

    def on_plane(self, scene: Scene) -> Floats:
        """Where those rays meet z = 0."""
        O, D = self.rays(scene)  # noqa: E741 - origin
        return O + D * (-O[2] / D[..., 2])[..., None]

    def on_sphere(self, scene: Scene, sphere: Sphere) -> tuple[npt.NDArray[np.bool_], Floats, Floats]:
        """Which rays meet the sphere under its matrix, where, and the unit normals there."""
        O, D = self.rays(scene)  # noqa: E741 - origin
        back = np.linalg.inv(sphere.to_world)
        o, d = O @ back[:3, :3] + back[3, :3], D @ back[:3, :3]
        a, b, c = (d * d).sum(-1), d @ o, o @ o - sphere.radius**2
        inside = b * b - a * c
        t = (-b - np.sqrt(np.maximum(inside, 0))) / a
        local = o + t[..., None] * d
        N = local @ back[:3, :3].T  # by the inverse transpose
        return inside > 0, O + t[..., None] * D, N / np.linalg.norm(N, axis=-1, keepdims=True)

    def lit(self, P: Floats, N: Floats, light: Light) -> tuple[Floats, Floats]:
        """Irradiance at normal incidence (h, w, 1) of the red channel, and N.L (h, w, 1), at the points P."""
        if light.kind == "distant":
            L = np.broadcast_to(-np.array(light.direction), P.shape)
            E = np.full(P.shape[:-1], light.intensity[0])
        else:
            to = np.array(light.position) - P
            square = (to * to).sum(-1)
            L, E = to / np.sqrt(square)[..., None], light.intensity[0] / square
        return E, np.maximum((N * L).sum(-1), 0.0)

    def replace(self, given: Any, **changes: Any) -> Any:
        return replace(given, **changes)


@pytest.fixture
def stage(tmp_path: Path) -> Stage:
    return Stage(tmp_path)
