"""Conventions of transparent surfaces: how much light a shadow ray loses in them."""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.acne import CONSTANT, width_of_view
from notabug.references.models.model import Model
from notabug.references.models.visibility import FLOAT
from notabug.scenes_usd.scene import Scene

_EPSILON = (
    "Haines 1989, in Glassner, An Introduction to Ray Tracing; POV-Ray 3.7 passes over what a ray meets within .001"
)
LARGEST = 0.5  # pixels: an epsilon of more detaches shadows that are seen


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and surfaces that let something through."""
    glass = any(any(material.transmission) for material in scene.materials)
    if not scene.lights or not (glass or any(material.fades for material in scene.materials)):
        return
    if scene.objects:
        yield from _crossings(scene)
    if any(material.fades for material in scene.materials):
        yield Model(
            name="opaque_shadow",
            kind="convention",
            claim="a surface with opacity casts the shadow of an opaque one",
            cites="Whitted 1980: shadow rays are not refracted; USD: opacity is presence or transparency",
            options={"transparent_shadows": "opaque"},
            when=("opacity_shadow", "opaque"),
        )
    if glass:
        yield Model(
            name="glass_shadowless",
            kind="convention",
            claim="glass casts no shadow",
            cites="Whitted 1980",
            options={"transparent_shadows": "free"},
            when=("glass_shadow", "none"),
        )
        yield Model(
            name="glass_shadow_attenuated",
            kind="convention",
            claim="glass casts the shadow of its transmission",
            cites="POV-Ray 3.7 documentation: shadow rays go straight through transparent surfaces",
            options={"transparent_shadows": "glass"},
            when=("glass_shadow", "attenuate"),
        )
        yield Model(
            name="whole_reflection",
            kind="convention",
            claim="total internal reflection sends on all of the light, whatever the transmission",
            cites="POV-Ray 3.7 documentation: reflection and refraction",
            options={"whole_reflection": True},
            when=("total_reflection", "whole"),
        )
        yield Model(
            name="glass_counted",
            kind="convention",
            claim="whether a ray enters glass or leaves it is counted, not taken from the side of the facet it meets",
            cites="POV-Ray 3.7: a ray keeps a list of the interiors that it is in",
            options={"counted_glass": True},
            when=("glass_side", "counted"),
        )


def _crossings(scene: Scene) -> Iterator[Model]:
    """Rays that go on from a point moved by an epsilon, and so pass over a second surface that lies nearer.

    The epsilon is the declared one. Else it is one that keeps no surface apart from another but those that float32
    cannot tell apart, or a constant one, of .001, where that is less than half a pixel.
    """
    seen = width_of_view(scene)
    for gap in (FLOAT["float32"] * seen, CONSTANT):
        if gap > LARGEST * seen / scene.width:
            continue
        for switches, rays, loses in (
            (("shadow_gap",), "shadow rays cross only one of them", "crossings"),
            (("shadow_gap",), "shadow rays leave out the whole second object, its back included", "objects"),
            (("shadow_gap", "ray_gap"), "shadow rays and the rays that go on cross only one of them", "crossings"),
            (("ray_gap",), "the rays that go on cross only one of them", "crossings"),
        ):
            yield Model(
                name="crossed_once",
                kind="limitation",
                claim=f"where transparent surfaces lie within epsilon of each other (the declared one, else {gap:.2g}),"
                f" {rays}",
                cites=_EPSILON,
                options={**dict.fromkeys(switches, gap), "gap_loses": loses},
                when=("crossings", "once"),
                declared=tuple(f"{switch}=epsilon" for switch in switches),
            )
