"""texture_space/cutout: a ring of leaves that the alpha of a picture cuts from a sheet, over a floor that it shades."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.stage import (
    camera,
    distant_light,
    lambert,
    looking,
    materials,
    mesh,
    over,
    selected,
    stage,
    variant_set,
)
from notabug.scenes_usd.authoring.texture_spaces import REQUIRES, SIZE, looked_up, painted, space, wraps

CARD = {
    "class": "texture_space",
    "claim": (
        "Where a picture's alpha cuts a sheet, or lets it fade, the border shows which number is taken for the opacity "
        "and which colours mix there: colour and alpha are filtered apart, so the colour of clear texels comes in as a "
        "thin fringe, and none is dark. Light falls through the holes and nowhere else."
    ),
    "cites": (
        "UsdPreviewSurface: opacity, opacityThreshold; Porter and Duff 1984, Compositing Digital Images; Blinn 1994, "
        "Compositing, Part 1: Theory; Forsyth 2006, Premultiplied alpha"
    ),
}
PICTURE = "textures/ring.png"
TEXELS = 13  # along an edge of the picture
THRESHOLD = "0.16"  # clear texels' colour is seen; no alpha is near it, one red of the leaf is less, one more
SURFACE = "Materials/Leaf/Surface"


def picture() -> npt.NDArray[np.uint8]:
    """(13, 13, 4): a ring of two greens on violet that is clear, its border one texel of in-between alphas."""
    row, column = np.mgrid[0:TEXELS, 0:TEXELS]
    middle = (TEXELS - 1) / 2
    away = np.hypot(row - middle + 0.3, column - middle - 0.2)  # beside the middle: no turn or flip looks the same
    share = np.clip(np.minimum(away - 1.4, 5.1 - away), 0.0, 1.0)
    notch = (row < 5) & (column > 7)  # an L, so that the ring has a side
    alpha = np.rint(255 * np.where(notch, 0.0, share)).astype(np.uint8)
    leaf = np.where(((row + column) % 3 == 0)[..., None], (20, 140, 60), (150, 210, 70))
    colours = np.where((alpha > 0)[..., None], leaf, (230, 60, 220)).astype(np.uint8)
    return np.concatenate([colours, alpha[..., None]], axis=2)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    leaf = painted(
        "Leaf",
        space("sRGB"),
        looked_up("Leaf", "Coordinates"),
        *wraps("clamp", "clamp"),
        file=PICTURE,
        alpha=True,
    )
    sheet = mesh(
        "Sheet",
        [(-1.0, -0.9, 0.25), (0.9, -1.0, 0.25), (1.0, 0.9, 0.45), (-0.9, 1.0, 0.45)],
        [(0, 1, 2), (0, 2, 3)],
        uv=[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
        material="Leaf",
    )
    floor = mesh("Floor", [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], [(0, 1, 2, 3)], material="Ground")
    parts = [
        camera((0.35, -0.5, 4.6), looking((-0.25, 0.45, -4.6)), 0.3, (0.1, 100.0)),
        distant_light(looking((0.45, -0.3, -1.0)), 3.2),
        materials(leaf, lambert("Ground", (0.55, 0.5, 0.45))),
        floor,
        sheet,
        variant_set(
            "alpha",
            {
                "cut": over(SURFACE, f"float inputs:opacityThreshold = {THRESHOLD}"),
                "fade": over(SURFACE, "float inputs:opacityThreshold = 0"),
            },
        ),
    ]
    data = stage(CARD, parts, requires=(*REQUIRES, "shadows"), metadata=selected(alpha="cut"), size=SIZE)
    return {"texture_space/cutout.usda": data, f"texture_space/{PICTURE}": png(picture())}
