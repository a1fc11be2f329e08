"""Lights with a size: what few points on a light show of it, and what a bias of shadow rays lets through.

A renderer that sends shadow rays from every place to the same n x n points of a rectangle draws n x n lights: n x n
hard shadows in the place of a penumbra, whose brightness takes steps, and close to the light a spot beneath each
point. All of it follows from n; umbra and full light, far from the light, are right. Where the shadows are not those
of each point, but the light of all of them is multiplied by the share that is seen, as POV-Ray does it, penumbras
close to the light differ even for many points. A renderer that chooses points anew at each place shows noise instead,
which its seeds tell, and needs no model.

A shadow ray that passes over what it meets nearer than a bias, or starts a bias off its surface, passes through what
is thinner. Such light at the foot of a wall is a limitation where the bias is declared, and only within its reach.
"""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.acne import LARGE, width_of_view
from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene

_GRID = "POV-Ray 3.7 documentation, area_light; Cook, Porter and Carpenter 1984, Distributed ray tracing"
_BIAS = (
    "Haines 1989, in Glassner, An Introduction to Ray Tracing; King 2004, Shadow mapping tricks and traps, in GPU Gems"
)

LARGEST_GRID = 16  # points along a side: beyond it the steps, of a 289th of the light, are below what a verdict tells
UNSAID_GRIDS = (2, 3, 4, 5, 6, 8)  # that are tried where nobody says how many points there are


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights that have a place on which points can lie, and something to be hit."""
    if not scene.objects:
        return
    if any(each.kind == "rect" for each in scene.lights):
        for points in range(2, LARGEST_GRID + 1):
            yield from _grid(points)
    if any(each.emitter is not None for each in scene.lights):
        yield from _leaks(scene)


def _grid(points: int) -> Iterator[Model]:
    when = ("light_grid", str(points))
    for shadow, how in (
        ("each", "as many hard shadows, and steps of brightness"),
        ("share", "penumbras are steps of the share of them that is seen, whichever they are"),
    ):
        also, options = (("light_grid_shadow", shadow),), {"light_grid": points, "light_grid_shared": shadow == "share"}
        yield Model(
            name="light_grid",
            kind="limitation",
            claim=f"{points} x {points} points stand for a rectangular light: {how}",
            cites=_GRID,
            options=options,
            when=when,
            also=also,
            needs=() if points in UNSAID_GRIDS else ("light_grid",),
        )
        yield Model(
            name="light_grid_to_edges",
            kind="fault",
            claim=f"the outermost of {points} x {points} points that stand for a rectangular light lie on its edges, as"
            f" if it were {points / (points - 1):.3g} times as large; {how}",
            cites=_GRID,
            options={**options, "light_grid_ends": True},
            when=when,
            also=also,
            needs=("light_grid",),
        )


def _leaks(scene: Scene) -> Iterator[Model]:
    unsaid = LARGE[0] * width_of_view(scene)
    for field, option, how in (
        ("shadow_bias", "shadow_gap", "pass over what is nearer to their start than a bias"),
        ("shadow_normal_bias", "shadow_lift", "start a bias off their surface"),
    ):
        yield Model(
            name="light_leak",
            kind="limitation",
            rule="hull",
            claim=f"shadow rays {how}: light falls through what is thinner, and where it stands on a surface",
            cites=_BIAS,
            options={option: unsaid},
            also=(("shadow_algorithm", "rays"),),
            needs=(field,),
            declared=(f"{option}={field}",),
        )
