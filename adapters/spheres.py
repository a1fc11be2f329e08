"""Spheres for renderers that have a centre and a radius for them, and no ellipsoids."""

from __future__ import annotations

import math

import numpy as np

from notabug.adapters.base import UnsupportedError
from notabug.scenes_usd.scene import Sphere

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
