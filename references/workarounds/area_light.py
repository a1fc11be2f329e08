"""Workarounds of area shadows: more points on a light, and a bias of shadow rays shorter than walls are thick."""

from __future__ import annotations

from notabug.references.workarounds.workaround import Setting, Workaround

_POINTS = "area_shadows/near_light"
_WALL = "area_shadows/thin_wall"


def _points(side: int) -> Setting:
    """``side`` x ``side`` points stand for the light."""
    grid = {"light_grid": side}
    return Setting(_POINTS, {}, f"{side} x {side} points", adapters={"inhouse": grid, "povray": grid})


def _biased(by: float) -> Setting:
    """Shadow rays pass over what they meet within ``by`` of their start."""
    return Setting(_WALL, {}, f"bias {by:g}", adapters={"inhouse": {"shadow_bias": by}})


WORKAROUNDS = (
    Workaround(
        name="more_light_points",
        artifact_class="area_shadows",
        claim="more points stand for a light, so that its bands are fainter and its spots run together",
        cites="POV-Ray 3.7 documentation, area_light; Cook, Porter and Carpenter 1984, Distributed ray tracing",
        reduces=("light_grid",),
        before=_points(4),
        after=_points(16),
        caveat="half of a step takes four times as many shadow rays; and where points share their shadows, as POV-Ray's"
        " do, what is close to a light stays wrong",
        limits=(_points(8),),
    ),
    Workaround(
        name="shorter_ray_bias",
        artifact_class="area_shadows",
        claim="shadow rays pass over less than walls are thick",
        cites="Haines 1989, in Glassner, An Introduction to Ray Tracing",
        reduces=("light_leak",),
        before=_biased(0.25),
        after=_biased(0.005),
        caveat="one number for a whole scene is too long for its thinnest wall, or too short for its farthest surface",
        limits=(_biased(0.15),),
    ),
)
