"""calibration/card: a flat test card seen straight on: gain, gamma, place and field of view."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.stage import camera, distant_light, materials, mesh, stage, textured

CARD = {
    "class": "calibration",
    "claim": (
        "A flat card lit straight on shows its texture unchanged: each pixel's radiance is the albedo times the "
        "irradiance over pi, so gain, gamma, flips, shifts and the field of view can be read off before anything "
        "is judged."
    ),
    "cites": "Whitted 1980 for the shading; UsdPreviewSurface for the Lambert term",
}

SIDE = 128  # texels
CELL = 16
GREYS = (5, 13, 26, 51, 89, 135, 184, 230)  # of 255: .02 to .9
PAPER, INK = (115, 115, 115), (20, 20, 20)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    card = mesh(
        "Card",
        [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)],
        [(0, 1, 2, 3)],
        uv=[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
        material="Target",
    )
    parts = [
        camera((0.0, 0.0, 4.0), (), 0.3, (0.1, 100.0)),
        distant_light((), math.pi),
        materials(textured("Target", "./textures/card.png")),
        card,
    ]
    return {
        "calibration/card.usda": stage(CARD, parts, requires=("mesh", "texture", "uv", "distant_light")),
        "calibration/textures/card.png": png(target()),
    }


def target() -> npt.NDArray[np.uint8]:
    """(128, 128, 3): a grey ramp on top, colours at the left, an F, stripes of 1, 2 and 4 texels, a wedge."""
    image = np.empty((SIDE, SIDE, 3), np.uint8)
    image[:] = PAPER
    for i, grey in enumerate(GREYS):
        image[: 2 * CELL, i * CELL : (i + 1) * CELL] = grey
    for i, colour in enumerate(((204, 26, 26), (26, 204, 26), (26, 26, 204))):
        image[(3 + i) * CELL : (4 + i) * CELL, : 2 * CELL] = colour
    for top, left, height, width in ((40, 48, 56, 10), (40, 48, 10, 36), (62, 48, 10, 24)):  # the F
        image[top : top + height, left : left + width] = INK
    for i, pitch in enumerate((4, 2, 1)):  # upright stripes, coarse to fine
        row, columns = 40 + 16 * i, np.arange(24)
        image[row : row + 12, 96 : 96 + 24][:, (columns // pitch) % 2 == 0] = (217, 217, 217)
    for row in range(CELL, 2 * CELL):  # a wedge: a slanted edge across the bottom, from nothing to 16 texels
        y = SIDE - 2 * CELL + row
        width = 8 * (row - CELL)
        image[y, SIDE - width :] = (217, 173, 51)
    image[104:120, 8:24] = (51, 140, 166)
    return image
