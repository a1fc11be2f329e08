"""texture_space/wrap: a board whose texture coordinates run from -1.5 to 2.5, with each wrap mode and colour space."""

from __future__ import annotations

from notabug.scenes_usd.authoring import stage as usd
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.texture_spaces import (
    CITES,
    PICTURE,
    REQUIRES,
    SIZE,
    looked_up,
    painted,
    picture,
    space,
    wraps,
)
from notabug.scenes_usd.authoring.usda import block, vector

CARD = {
    "class": "texture_space",
    "claim": (
        "Beyond 0..1 a texture repeats, is mirrored, keeps its last texel or is black, as the scene says, on both "
        "sides alike; the texels at its borders mix with what lies beyond. A mode that is ignored, a negative "
        "coordinate that is rounded towards zero, a v that runs down, or colours that are decoded once too often show "
        "at once."
    ),
    "cites": CITES,
}

MODES = {  # variant: wrapS, wrapT
    "repeat": ("repeat", "repeat"),
    "mirror": ("mirror", "mirror"),
    "clamp": ("clamp", "clamp"),
    "black": ("black", "black"),
    "repeat_clamp": ("repeat", "clamp"),
}
TEXTURE, COORDINATES = "Materials/Letters/Texture", "/Scene/Materials/Letters/Coordinates"
LOW, HIGH = -1.5, 2.5
# UsdTransform2d: scaled, then turned, then moved. Any other order shows another part of the picture.
SCALE, ROTATION, TRANSLATION = (0.75, 0.5), 30.0, (0.4, -0.3)


def files() -> dict[str, bytes]:
    """The scene's files by their path below scenes_usd."""
    board = usd.mesh(
        "Board",
        [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)],
        [(0, 1, 2, 3)],
        uv=[(LOW, LOW), (HIGH, LOW), (HIGH, HIGH), (LOW, HIGH)],
        material="Letters",
    )
    parts = [
        usd.camera((0.5, 0.35, 4.2), usd.looking((-0.5, -0.35, -4.2)), 0.27, (0.1, 100.0)),
        usd.distant_light(usd.looking((0.3, -0.4, -1.0)), 3.2),
        usd.materials(painted("Letters")),
        board,
        usd.variant_set("wrap", {name: usd.over(TEXTURE, *wraps(*modes)) for name, modes in MODES.items()}),
        usd.variant_set(
            "space",
            {each: usd.over(TEXTURE, space(each)) for each in ("raw", "sRGB")},
        ),
        usd.variant_set(
            "transform", {"none": usd.over(TEXTURE, looked_up("Letters", "Coordinates")), "all": _placed()}
        ),
    ]
    data = usd.stage(
        CARD,
        parts,
        requires=REQUIRES,
        metadata=usd.selected(wrap="repeat", space="raw", transform="none"),
        size=SIZE,
    )
    return {"texture_space/wrap.usda": data, f"texture_space/{PICTURE}": png(picture())}


def _placed() -> str:
    """The texture looked up through a UsdTransform2d."""
    place = block(
        'def Shader "Place"',
        'uniform token info:id = "UsdTransform2d"\n'
        f"float2 inputs:in.connect = <{COORDINATES}.outputs:result>\n"
        f"float2 inputs:scale = {vector(SCALE)}\n"
        f"float inputs:rotation = {ROTATION:g}\n"
        f"float2 inputs:translation = {vector(TRANSLATION)}\n"
        "float2 outputs:result",
    )
    texture = usd.over("Texture", looked_up("Letters", "Place"))
    return usd.over("Materials/Letters", place, texture)
