"""normal_maps/mirrored_uv: one map on both halves of a tile whose coordinates are mirrored in its middle."""

from __future__ import annotations

import math

import numpy as np

from notabug.scenes_usd.authoring.normal_maps import CITES, SIZE, Floats, encoded, mapped, places, tile
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.stage import camera, materials, point_light, selected, stage, variant_set

CARD = {
    "class": "normal_maps",
    "claim": (
        "Where texture coordinates are mirrored the frame of a normal map is left-handed: the second tangent follows "
        "growing t there, too. Both halves of the tile are the mirror image of each other, and so are their normals. "
        "Where the second tangent is N x T whatever the coordinates do, one half is lit from below."
    ),
    "cites": f"{CITES}; Mikkelsen 2008, Simulation of wrinkled surfaces revisited",
}
TEXELS = 32
FILE = "./textures/ridges.png"
LEAN = 0.9  # the slope of the ridges' flanks


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    tiles = {
        "curved": tile("Tile", "Ridges", rise=0.5, mirrored=True, repeats=3.0),
        "plane": tile("Tile", "Ridges", rise=0.0, mirrored=True, repeats=3.0, cut=2),
    }
    parts = [
        camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 0.23, (0.1, 100.0)),
        point_light((0.4, 2.6, 3.0), 126.0),
        materials(mapped("Ridges", FILE, (0.5, 0.55, 0.35), roughness=0.4)),
        variant_set("tile", tiles),
    ]
    return {
        "normal_maps/textures/ridges.png": png(encoded(ridges(TEXELS))),
        "normal_maps/mirrored_uv.usda": stage(
            CARD,
            parts,
            requires=("normals", "uv", "normal_map", "point_light"),
            metadata=selected(tile="curved"),
            size=SIZE,
        ),
    }


def ridges(size: int) -> Floats:
    """Normals (size, size, 3) of waves that run up at an angle: both channels of the map say something."""
    u, v = places(size)
    slope = LEAN * np.sin(2.0 * math.pi * (u - 2.0 * v))
    return np.stack([0.45 * slope, -0.9 * slope, np.ones_like(slope)], axis=2)
