"""Workarounds of surface acne: where secondary rays start."""

from __future__ import annotations

from typing import Any

from notabug.references.workarounds.workaround import Setting, Workaround

_PAPER = "Woo, Pearce and Ouellette 1996, surface acne"
_ACNE = ("acne", "no_epsilon", "epsilon_not_scaled")
_PLANE = "acne/grazing_plane"


def _starts(label: str, distance: str, **attributes: Any) -> Setting:
    """The grazing plane from ``distance``, in single precision, by the in-house tracer with ``attributes``."""
    return Setting(
        _PLANE,
        {"camera_distance": distance},
        label,
        adapters={"inhouse": {"precision": "float32", **attributes}},
    )


def _absolute(epsilon: str, distance: str) -> Setting:
    return _starts(f"epsilon {epsilon}", distance, start="absolute", epsilon=float(epsilon))


WORKAROUNDS = (
    Workaround(
        name="epsilon",
        artifact_class="acne",
        claim="secondary rays pass over hits nearer than an epsilon",
        cites=f"{_PAPER}; Haines 1989, in Glassner, An Introduction to Ray Tracing",
        reduces=_ACNE,
        before=_starts("no epsilon", "10", start="none"),
        after=_absolute("1e-3", "10"),
        caveat="too small it helps little, too large it lets light in under things, and no constant suits all distances",
        limits=(_absolute("1e-5", "10"), _absolute(".3", "10"), _absolute("1e-3", "1e3")),
    ),
    Workaround(
        name="relative_epsilon",
        artifact_class="acne",
        claim="the epsilon grows with the coordinates and the distance that rounding grows with",
        cites=f"{_PAPER}; Haines 1989",
        reduces=_ACNE,
        before=_absolute("1e-3", "1e3"),
        after=_starts("relative epsilon 1e-5", "1e3", start="relative", epsilon=1e-5),
        caveat="from far away it is as large as the things in the picture",
        limits=(_starts("relative epsilon 1e-5", "1e5", start="relative", epsilon=1e-5),),
    ),
    Workaround(
        name="error_bound",
        artifact_class="acne",
        claim="the hit is computed anew from the facet, and rays start beside it by the bound of that point's error",
        cites="Pharr, Jakob and Humphreys 2023, Physically Based Rendering, section 6.8",
        reduces=_ACNE,
        before=_absolute("1e-3", "1e3"),
        after=_starts("error bound", "1e3", start="error_bound"),
        caveat="which facet is hit, and where on it, stays as inexact as the distance makes it",
        limits=(_starts("error bound", "1e5", start="error_bound"),),
    ),
    Workaround(
        name="reverse_ray_refinement",
        artifact_class="acne",
        claim="the ray is shot back at the facet's plane, which corrects the hit: x' = x - t'D",
        cites=f"{_PAPER}: t' = (d - N.x) / (-N.D)",
        reduces=_ACNE,
        before=_absolute("1e-5", "1e3"),
        after=_starts("epsilon 1e-5, refined", "1e3", start="absolute", epsilon=1e-5, refine=True),
        caveat="for planar polygons; the corrected point is rounded too, so a small epsilon is still needed",
        limits=(_starts("refined, no epsilon", "1e3", start="none", refine=True),),
    ),
)
