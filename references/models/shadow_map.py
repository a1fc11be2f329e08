"""Shadow maps: what a map of few texels, compared with a bias, does in the place of shadow rays.

A shadow map (Williams 1978) holds the depth of what a light sees first in the middle of each texel. Where no bias keeps
a surface from being compared with itself there are stripes of acne; with a bias a shadow comes off what throws it; and
at its edge the texels show as steps. All three follow from the width of a texel, the slope of the surface and the bias,
and so does where they can be: nothing else of a picture may change.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from notabug.references.models.acne import lost_lights
from notabug.references.models.model import Model, in_strengths
from notabug.scenes_usd.framing import bounds_of
from notabug.scenes_usd.scene import Scene

_WILLIAMS = "Williams 1978, Casting curved shadows on curved surfaces"
_REEVES = "Reeves, Salesin and Cook 1987, Rendering antialiased shadows with depth maps"
_BIAS = "King 2004, Shadow mapping tricks and traps, in GPU Gems; Akenine-Moeller et al. 2018, section 7.4"

# Where nobody says how many texels a map has: no renderer's default is coarser (three.js 512, Panda3D 512, Godot 2048).
COARSEST = 512
# Where nobody says how large the bias is it may be up to so many texels' widths: beyond it a shadow's start is lost.
LARGEST_BIAS = 2.0
# How far the middle of a texel that counts may lie beside the point: half a texel's diagonal, or, where the four texels
# around it are weighed, a whole one.
REACH = {"nearest": math.sqrt(0.5), "linear": math.sqrt(2.0)}
ERROR = 32 * 2.0**-24  # of coordinates and size: a few roundings of the float32 depths that two transforms give
MOVED = 0.02  # of the map's width: a shift that is seen
STATED = ("map_cells=shadow_resolution", "map_normal_bias=shadow_normal_bias", "map_bias=shadow_bias")
OF_A_MAP = ("shadow_algorithm", "map")


@dataclass(frozen=True, slots=True)
class Settings:
    """What the lights of a scene say of their maps, in the scene's unit; None where they do not, or not the same."""

    cells: int
    width: float
    bias: float | None
    normal_bias: float | None

    @property
    def texel(self) -> float:
        return self.width / self.cells


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and something to be hit, for renderers that declare shadow maps."""
    if (
        all(each.emitter is not None for each in scene.lights) or not scene.objects
    ):  # a map is of a point, or of one way
        return
    said = settings(scene)
    for each, reach in REACH.items():
        yield from _limitations(said, len(scene.lights), each, reach)
    yield from _faults(said)


def settings(scene: Scene) -> Settings:
    """What the lights of ``scene`` say: the coarsest resolution, and the biases where all have one."""
    maps = {each.shadow_map for each in scene.lights}
    found = [each for each in maps if each is not None]
    biases = {each.bias for each in found} if len(found) == len(maps) else set()
    normals = {each.normal_bias for each in found} if len(found) == len(maps) else set()
    low, high = bounds_of(scene.objects)
    return Settings(
        min((each.resolution for each in found), default=COARSEST),
        max(float(np.linalg.norm(high - low)), float(np.finfo(np.float32).tiny)),
        biases.pop() if len(biases) == 1 else None,
        normals.pop() if len(normals) == 1 else None,
    )


def _limitations(said: Settings, lights: int, texels: str, reach: float) -> Iterator[Model]:
    """Acne, steps and detached shadows, of maps that are read by their nearest texel or between texels."""
    shape = {"map_width": said.width, "map_cells": said.cells, "map_reach": reach, "map_error": ERROR}
    shape["map_normal_bias"] = said.normal_bias or 0.0
    least = {**shape, "map_bias": said.bias or 0.0}
    most = {**shape, "map_bias": LARGEST_BIAS * said.texel if said.bias is None else said.bias}
    masks = lost_lights(lights)
    for name, claim, cites, ways in (
        (
            "shadow_map_acne",
            "a surface shadows itself in stripes: its shadow map's texels are wider than the bias allows for its slope",
            f"{_REEVES}; {_BIAS}",
            (("acne", least),),
        ),
        (
            "shadow_map_steps",
            "a shadow's edge follows the texels of its shadow map",
            f"{_WILLIAMS}; {_REEVES}",
            (("dark_edge", least), ("lit_edge", most)),
        ),
        (
            "shadow_map_detached",
            "a shadow does not reach what throws it, nearer than the shadow map's bias",
            f"{_BIAS}: peter-panning",
            (("detached", most),),
        ),
    ):
        values = [{"shadow_map": way, "map_lights": mask, **numbers} for way, numbers in ways for mask in masks]
        yield Model(
            name=name,
            kind="limitation",
            rule="set" if texels == "nearest" else "hull",
            claim=claim if texels == "nearest" else f"{claim}; texels are weighed",
            cites=cites,
            options=values[0],
            others=tuple(values[1:]),
            also=(OF_A_MAP, ("shadow_filter", texels)),
            strict=True,
            shows="stripes" if name == "shadow_map_acne" else "anything",
            declared=(*STATED, "map_width=shadow_width"),
        )


def _faults(said: Settings) -> Iterator[Model]:
    """A map that is compared, biased or placed wrongly; what a renderer without one cannot have."""
    shape = {"map_width": said.width, "map_cells": said.cells, "map_error": ERROR}
    shape |= {"map_normal_bias": said.normal_bias or 0.0, "map_bias": said.bias or 0.0}
    yield Model(
        name="shadow_map_reversed",
        kind="fault",
        claim="a shadow map's comparison is reversed: what is in shadow is lit, and nothing else",
        cites=_WILLIAMS,
        options={"shadow_map": "reversed"},
        also=(OF_A_MAP,),
        strict=True,
    )
    bias = said.bias or LARGEST_BIAS * said.texel
    yield Model(
        name="shadow_bias_negated",
        kind="fault",
        claim="a shadow map's bias has the wrong sign: every surface is in its own shadow",
        cites=_BIAS,
        options={"shadow_map": "moved", **shape, "map_bias": -bias},
        also=(OF_A_MAP,),
        strict=True,
    )
    for axis in ("right", "up"):
        yield in_strengths(
            lambda strength, axis=axis: Model(  # type: ignore[misc]
                name="shadow_map_moved",
                kind="fault",
                claim=f"shadow maps are looked up {strength:.3g} of their width beside the place, along {axis}",
                cites=_WILLIAMS,
                options={"shadow_map": "moved", **shape, f"map_{axis}": strength * said.width},
                also=(OF_A_MAP,),
                strict=True,
                declared=STATED,
            ),
            MOVED,
        )
