"""Workarounds of shadow maps: what is subtracted from a depth before it is compared."""

from __future__ import annotations

from notabug.references.workarounds.workaround import Setting, Workaround

_SLOPES = "shadow_map/slopes"


def _map(bias: str, resolution: str = "1024") -> Setting:
    return Setting(_SLOPES, {"bias": bias, "resolution": resolution})


WORKAROUNDS = (
    Workaround(
        name="shadow_bias",
        artifact_class="shadow_map",
        claim="what a shadow map holds must be nearer to the light than a point by a bias before it shadows the point",
        cites="Williams 1978; Reeves, Salesin and Cook 1987; King 2004, Shadow mapping tricks and traps, in GPU Gems",
        reduces=("shadow_map_acne",),
        before=_map("0"),
        after=_map(".02"),
        caveat="too small for a texel's width it leaves stripes on slopes, too large it takes the feet of shadows away",
        limits=(_map(".02", "64"), _map(".15")),
    ),
)
