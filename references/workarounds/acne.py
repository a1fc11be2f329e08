"""Workarounds of surface acne: where secondary rays start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from notabug.references.models.model import Edit, unchanged
from notabug.references.workarounds.workaround import Setting, Workaround
from notabug.scenes_usd.scene import Floats, Light, Mesh, Object, Scene
from notabug.scenes_usd.transform import rescaled

_PAPER = "Woo, Pearce and Ouellette 1996, surface acne"
_ACNE = ("acne", "no_epsilon")
# a block that has lost its shadow casts none, and is near to one that is missing
_LEAK = (
    "epsilon_too_large",
    "epsilon_not_scaled",
    "loser_wins",
    "no_shadow",
    "object_missing",
)  # what light under the blocks is taken for


def scaled(by: float) -> Edit:
    """An edit that makes the whole scene ``by`` times as large, camera and lights too: its picture is the same."""

    def place(to_world: Floats) -> Floats:
        moved = to_world.copy()
        moved[:, :3] *= by
        return moved

    def thing(each: Object) -> Object:
        if isinstance(each, Mesh):
            return replace(each, points=np.ascontiguousarray(each.points * by), to_world=place(each.to_world))
        return replace(each, to_world=place(each.to_world))

    def light(each: Light) -> Light:
        if each.kind == "distant":
            return each
        (x, y, z), (r, g, b) = each.position, each.intensity
        square = by * by
        return replace(each, position=(x * by, y * by, z * by), intensity=(r * square, g * square, b * square))

    def edit(scene: Scene) -> Scene:
        camera = scene.camera
        to_world = camera.to_world.copy()
        to_world[3, :3] *= by
        return replace(
            scene,
            camera=rescaled(replace(camera, to_world=to_world), by),
            objects=tuple(thing(shape) for shape in scene.objects),
            lights=tuple(light(each) for each in scene.lights),
        )

    return edit


def _starts(
    label: str, scene: str = "acne/grazing_plane", edit: Edit = unchanged, **attributes: str | float
) -> Setting:
    """The scene from near by, in single precision, by the in-house tracer with ``attributes``."""
    adapters = {"inhouse": {"precision": "float32", **attributes}}
    return Setting(scene, {"camera_distance": "10"}, label, edit, adapters=adapters)


def _absolute(epsilon: str) -> Setting:
    return _starts(f"epsilon {epsilon}", start="absolute", epsilon=float(epsilon))


def _relative(epsilon: str) -> Setting:
    label = f"1000 times smaller, relative epsilon {epsilon}"
    return _starts(label, edit=scaled(1e-3), start="relative", epsilon=float(epsilon))


WORKAROUNDS = (
    Workaround(
        name="epsilon",
        artifact_class="acne",
        claim="secondary rays pass over hits nearer than an epsilon",
        cites=f"{_PAPER}; Haines 1989, in Glassner, An Introduction to Ray Tracing",
        reduces=_ACNE,
        before=_starts("no epsilon", start="none"),
        after=_absolute("1e-3"),
        caveat="too small it leaves dots, too large it lets light in under things that stand on a surface",
        limits=(_absolute("1e-5"), _absolute(".3")),
    ),
    Workaround(
        name="relative_epsilon",
        artifact_class="acne",
        claim="the epsilon grows with the coordinates and the distance that rounding grows with",
        cites=f"{_PAPER}; Haines 1989",
        reduces=_LEAK,
        before=_starts("1000 times smaller, epsilon 1e-3", edit=scaled(1e-3), start="absolute", epsilon=1e-3),
        after=_relative("1e-5"),
        caveat="its factor, too, can be too small or too large",
        limits=(_relative("1e-6"), _relative(".02")),
    ),
    Workaround(
        name="error_bound",
        artifact_class="acne",
        claim="the hit is computed anew from the facet, and rays start beside it by the bound of that point's error",
        cites="Pharr, Jakob and Humphreys 2023, Physically Based Rendering, section 6.8",
        reduces=_ACNE,
        before=_absolute("1e-5"),
        after=_starts("error bound", start="error_bound"),
        caveat="it frees a facet from itself, not from its neighbours: the terminator problem stays",
        limits=(_starts("error bound", "acne/with_terminator", start="error_bound"),),
    ),
    Workaround(
        name="reverse_ray_refinement",
        artifact_class="acne",
        claim="the ray is shot back at the facet's plane, which corrects the hit: x' = x - t'D",
        cites=f"{_PAPER}: t' = (d - N.x) / (-N.D)",
        reduces=_ACNE,
        before=_absolute("1e-5"),
        after=_starts("epsilon 1e-5, refined", start="absolute", epsilon=1e-5, refine=True),
        caveat="for planar polygons; the corrected point is rounded too, so a small epsilon is still needed",
        limits=(_starts("refined, no epsilon", start="none", refine=True),),
    ),
)
