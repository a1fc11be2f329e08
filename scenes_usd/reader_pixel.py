"""How large a pixel is in the world: what surfaces are refined by, and how soft an edge may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from notabug.scenes_usd.scene import Camera, Floats

_SIDE = 256  # pixels across the bounds where there is no camera yet: one will be placed that sees all of them


@dataclass(frozen=True, slots=True, eq=False)
class PixelGrid:
    """A picture's pixels. Called with places (n, 3) in world space: the size (n,) of a pixel there, in world units."""

    camera: Camera | None
    width: int
    height: int

    def __call__(self, places: Floats) -> Floats:
        camera = self.camera
        if camera is None:
            reach = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 1.0
            return np.full(len(places), max(reach, 1e-300) / _SIDE)
        local = (places - camera.to_world[3, :3]) @ camera.to_world[:3, :3].T
        depth = -local[:, 2]
        side = 2.0 * min(camera.tan_x / self.width, camera.tan_y / self.height)
        if camera.orthographic:
            return np.full(len(places), side)
        across = np.abs(local[:, 0] - depth * camera.tan_x * camera.shift_x)
        up = np.abs(local[:, 1] - depth * camera.tan_y * camera.shift_y)
        seen = (across <= depth * camera.tan_x) & (up <= depth * camera.tan_y)
        away = np.where(seen & (depth >= camera.near), depth, np.linalg.norm(local, axis=1))
        return np.asarray(side * np.maximum(away, camera.near))

    def within(self, matrix: Floats) -> LocalGrid:
        """The same for local places that ``matrix`` (4, 4), row vectors, brings to world space."""
        return LocalGrid(self, matrix, float(np.linalg.norm(matrix[:3, :3], 2)))


@dataclass(frozen=True, slots=True, eq=False)
class LocalGrid:
    """The pixels of a grid in a prim's own frame, whose lengths ``scale`` stretches at most."""

    grid: PixelGrid
    matrix: Floats
    scale: float

    def __call__(self, places: Floats) -> Floats:
        return self.grid(places @ self.matrix[:3, :3] + self.matrix[3, :3]) / self.scale
