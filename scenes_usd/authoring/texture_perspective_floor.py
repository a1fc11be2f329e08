"""texture/perspective_floor: a chequered floor that runs away from the viewer."""

from __future__ import annotations

import numpy as np

from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.stage import camera, distant_light, looking, materials, mesh, stage, textured
from notabug.scenes_usd.authoring.texture_uneven_quad import checker

CARD = {
    "class": "texture",
    "claim": (
        "On a floor seen at a slant the far half of the texture is much smaller than the near half: uv must be "
        "interpolated in space, or over w. Interpolated on the screen instead, the pattern bends at the diagonal of "
        "the quadrilateral; that is a coding error and not a limitation."
    ),
    "figure": "texture section",
    "cites": "Woo, Pearce and Ouellette 1996; Heckbert 1986; Blinn 1992",
}


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    floor = mesh(
        "Floor",
        [(-2.3, 0.0, 1.6), (2.1, 0.0, 1.6), (2.1, 0.0, -9.0), (-2.3, 0.0, -9.0)],
        [(0, 1, 2, 3)],
        uv=[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
        material="Checker",
    )
    parts = [
        camera((0.25, 1.9, 3.4), looking((-0.4, -2.6, -5.0)), 0.46, (0.1, 100.0)),
        distant_light(looking((0.4, -1.0, -0.35)), 3.3),
        materials(textured("Checker", "./textures/checker.png")),
        floor,
    ]
    return {
        "texture/perspective_floor.usda": stage(CARD, parts, requires=("mesh", "texture", "uv", "distant_light")),
        "texture/textures/checker.png": png(np.kron(checker(), np.ones((2, 2, 1), np.uint8))),
    }
