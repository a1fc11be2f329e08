"""normal_maps/identity: a map of one colour that says straight up, on a curved tile, with three ways to say it."""

from __future__ import annotations

import numpy as np

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.normal_maps import CITES, LEVEL, SIZE, SPECIFIED, mapped, tile, unmapped
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.usda import block

CARD = {
    "class": "normal_maps",
    "claim": (
        "A normal map that says straight up everywhere gives the picture that no map gives. With scale 2 and bias -1 "
        "bytes cannot say it: 128 is .0039, and every normal leans by .32 degrees along growing s and t. A renderer "
        "that takes 128 for nought gives the picture without a map there."
    ),
    "cites": f"{CITES}; Schueler 2013, Followup: Normal mapping without precomputed tangents",
}
COLOUR, WALL = (0.25, 0.42, 0.62), (0.6, 0.45, 0.3)
FILE = "./textures/up.png"


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    looks = {"none": ("Plain", "PlainWall"), "bytes": ("Mapped", "MappedWall"), "level": ("Level", "LevelWall")}
    maps = {
        name: "\n".join(
            block(
                f'over "{mesh_name}" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)',
                f"rel material:binding = </Scene/Materials/{look}>",
            )
            for mesh_name, look in zip(("Tile", "Wall"), bound, strict=True)
        )
        for name, bound in looks.items()
    }
    wall = [(-1.6, -1.6, -0.2), (1.6, -1.6, -0.2), (1.6, 1.6, -0.2), (-1.6, 1.6, -0.2)]
    parts = [
        usd.camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 0.34, (0.1, 100.0)),
        usd.point_light((-1.5, 1.3, 3.0), 75.0),
        usd.materials(
            *(
                mapped(f"{name}{part}", FILE, colour, roughness=rough, bias=bias)
                for name, bias in (("Mapped", SPECIFIED), ("Level", LEVEL))
                for part, colour, rough in (("", COLOUR, 0.35), ("Wall", WALL, 0.5))
            ),
            unmapped("Plain", COLOUR, roughness=0.35),
            unmapped("PlainWall", WALL, roughness=0.5),
        ),
        tile("Tile", "", rise=0.45, mirrored=False),
        usd.mesh("Wall", wall, [(0, 1, 2, 3)], uv=[(0, 0), (1, 0), (1, 1), (0, 1)]),
        usd.variant_set("map", maps),
    ]
    up = np.broadcast_to(np.array([128, 128, 255], np.uint8), (2, 2, 3))
    return {
        "normal_maps/textures/up.png": png(np.ascontiguousarray(up)),
        "normal_maps/identity.usda": usd.stage(
            CARD,
            parts,
            requires=("normals", "uv", "normal_map", "point_light"),
            metadata=usd.selected(map="bytes"),
            size=SIZE,
        ),
    }
