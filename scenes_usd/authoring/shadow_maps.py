"""What all scenes of shadow maps have: a light that says how its map is to be made, with variants of each number."""

from __future__ import annotations

from collections.abc import Sequence

from notabug.scenes_usd.authoring.stage import over, selected, variant_set
from notabug.scenes_usd.authoring.usda import number

SIZE = (128, 128)
RESOLUTIONS = ("64", "256", "1024")
RESOLUTION = "256"
CITES = (
    "Williams 1978, Casting curved shadows on curved surfaces; Reeves, Salesin and Cook 1987, Rendering antialiased "
    "shadows with depth maps; King 2004, Shadow mapping tricks and traps, in GPU Gems"
)


def map_sets(bias: Sequence[str], normal_bias: Sequence[str]) -> tuple[str, ...]:
    """The variant sets ``bias``, ``normal_bias`` and ``resolution`` of /Scene/Light."""
    return (
        variant_set("bias", {each: over("Light", _number("bias", each)) for each in bias}),
        variant_set("normal_bias", {each: over("Light", _number("normalBias", each)) for each in normal_bias}),
        variant_set(
            "resolution",
            {
                resolution: over("Light", f"custom int notabug:shadowMap:resolution = {resolution}")
                for resolution in RESOLUTIONS
            },
        ),
    )


def defaults(bias: str, normal_bias: str) -> str:
    """Metadata of the default prim: which variants are the default."""
    return selected(bias=bias, normal_bias=normal_bias, resolution=RESOLUTION)


def _number(name: str, value: str) -> str:
    return f"custom float notabug:shadowMap:{name} = {number(float(value))}"
