"""calibration/plain_card: the test card for renderers without textures or without distant lights, cut from squares."""

from __future__ import annotations

import math

from notabug.scenes_usd.authoring import stage as usd

CARD = {
    "class": "calibration",
    "claim": (
        "Flat squares of different albedo lit straight on show it unchanged: each pixel's radiance is the albedo times "
        "the irradiance over pi, without a texture being looked up."
    ),
    "cites": "Whitted 1980 for the shading; UsdPreviewSurface for the Lambert term",
}

SQUARES = ("01234567", "RPPFFFFP", "GPPFPPPP", "BPPFFFPP", "PPPFPPPP", "PYPFPPCC", "PYPPPPCP", "PPPPPPPP")
COLOURS = {
    **{str(i): (grey,) * 3 for i, grey in enumerate((0.02, 0.05, 0.1, 0.2, 0.35, 0.53, 0.72, 0.9))},
    "R": (0.8, 0.1, 0.1),
    "G": (0.1, 0.8, 0.1),
    "B": (0.1, 0.1, 0.8),
    "P": (0.45, 0.45, 0.45),
    "F": (0.08, 0.08, 0.08),
    "Y": (0.85, 0.68, 0.2),
    "C": (0.2, 0.55, 0.65),
}
FAR = 50.0  # of the point light: its irradiance varies by 1 in 1000 over the card


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    lights = {
        "distant": usd.distant_light((), math.pi),
        "point": usd.point_light((0.0, 0.0, FAR), 4.0 * math.pi * FAR**2),
    }
    parts = [
        usd.camera((0.0, 0.0, 4.0), (), 0.3, (0.1, 100.0)),
        usd.materials(*(usd.lambert(f"Colour{key}", colour) for key, colour in COLOURS.items())),
        *(_squares(key) for key in COLOURS),
        usd.variant_set("light", lights),
    ]
    data = usd.stage(CARD, parts, requires=("mesh",), metadata=usd.selected(light="distant"))
    return {"calibration/plain_card.usda": data}


def _squares(key: str) -> str:
    """One mesh of all squares of the colour ``key``."""
    points: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int, int]] = []
    for row, line in enumerate(SQUARES):
        for column, each in enumerate(line):
            if each == key:
                x, y, first = -1.0 + column / 4.0, 1.0 - row / 4.0, len(points)
                points += [(x, y - 0.25, 0.0), (x + 0.25, y - 0.25, 0.0), (x + 0.25, y, 0.0), (x, y, 0.0)]
                faces.append((first, first + 1, first + 2, first + 3))
    return usd.mesh(f"Squares{key}", points, faces, material=f"Colour{key}")
