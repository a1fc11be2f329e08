"""Conventions of transparent surfaces: how much light a shadow ray loses in them."""

from __future__ import annotations

from collections.abc import Iterator

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and surfaces that let something through."""
    glass = any(any(each.transmission) for each in scene.materials)
    if not scene.lights or not (glass or any(each.opacity < 1 for each in scene.materials)):
        return
    if any(each.opacity < 1 for each in scene.materials):
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
