"""separation/t_highlight: a floor under one point light, whose highlight has the shape of a T."""

from __future__ import annotations

import math

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.reflection import Reflection, reflection
from notabug.scenes_usd.authoring.usda import vector

CARD = {
    "class": "separation",
    "claim": (
        "One light over one floor makes two bright places: the diffuse one right under the light, wide because the "
        "floor is seen at a slant, and the specular one nearer to the viewer, long because it follows the mirrored "
        "view; together they are a T, and that is what the reflection model says."
    ),
    "figure": "4, 5, 6",
    "cites": "Woo, Pearce and Ouellette 1996, Table 1, figures 4, 5 and 6; Phong 1975",
}

KD, KS, EXPONENT = 0.6, 1.0, 12.0
EYE, TARGET = (0.0, -6.0, 2.0), (0.0, 1.0, 0.0)
LIGHT = (0.0, 1.5, 1.2)
INTENSITY = 4.0 * 4.6  # UsdLux's: four times the radiant intensity


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    drop = math.degrees(math.atan2(EYE[2] - TARGET[2], TARGET[1] - EYE[1]))
    floor = [(-12.0, -7.0, 0.0), (12.0, -7.0, 0.0), (12.0, 17.0, 0.0), (-12.0, 17.0, 0.0)]
    parts = [
        usd.camera(EYE, (90.0 - drop, 0.0, 0.0), math.tan(math.radians(22.5)), (0.1, 100.0), 512 / 384),
        usd.point_light(LIGHT, INTENSITY),
        usd.materials(reflection("Varnish", Reflection(diffuse=None, specular=None, exponent=EXPONENT))),
        usd.mesh("Floor", floor, [(0, 1, 2, 3)], material="Varnish"),
        usd.variant_set("part", {"both": _part(KD, KS), "diffuse": _part(KD, 0.0), "specular": _part(0.0, KS)}),
    ]
    return {
        "separation/t_highlight.usda": usd.stage(
            CARD, parts, requires=("point_light",), metadata=usd.selected(part="both"), size=(512, 384), up="Z"
        )
    }


def _part(kd: float, ks: float) -> str:
    diffuse = f"color3f inputs:diffuseColor = {vector((kd,) * 3)}"
    specular = f"color3f inputs:specularColor = {vector((ks,) * 3)}"
    return usd.over("Materials/Varnish", usd.over("Reflection", diffuse, specular), usd.over("Surface", diffuse))
