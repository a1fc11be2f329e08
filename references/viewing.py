"""Where a scene's camera sees what: the pixels of points, and the rays of pixels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


def projected(scene: Scene, points: Floats) -> tuple[Floats, Floats]:
    """Raster positions (..., 2) of world ``points`` (..., 3), and their depths along the camera's axis."""
    camera = scene.camera
    x, y, z, eye = (camera.to_world[i, :3] for i in range(4))
    off = points - eye
    depth = -(off @ z)
    safe = np.where(np.abs(depth) > 1e-12, depth, 1e-12)
    span = camera.spans(safe)
    across = (off @ x) / span / camera.tan_x - camera.shift_x
    up = (off @ y) / span / camera.tan_y - camera.shift_y
    return np.stack([(across + 1.0) * 0.5 * scene.width, (1.0 - up) * 0.5 * scene.height], axis=-1), depth


def centre_rays(scene: Scene) -> tuple[Floats, Floats]:
    """Starts and directions (h, w, 3) of the rays through the pixels' centres; a direction goes 1 along the axis."""
    camera = scene.camera
    right, up, back, eye = (camera.to_world[i, :3] for i in range(4))
    across = (2.0 * (np.arange(scene.width) + 0.5) / scene.width - 1.0 + camera.shift_x) * camera.tan_x
    high = (1.0 - 2.0 * (np.arange(scene.height) + 0.5) / scene.height + camera.shift_y) * camera.tan_y
    aside = across[None, :, None] * right + high[:, None, None] * up
    if camera.orthographic:
        return eye + aside, np.broadcast_to(-back, aside.shape)
    return np.broadcast_to(eye, aside.shape), aside - back
