"""Separation of diffuse and specular reflection: the highlight's own place, and its cutoff where N.L = 0."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from notabug.references.models.model import Model, edit_materials
from notabug.references.models.phong import scaled
from notabug.scenes_usd.scene import Material, Scene

_PAPER = "Woo, Pearce and Ouellette 1996, figures 4 to 7"
_NONE = (0.0, 0.0, 0.0)


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with highlights."""
    shiny = [material for material in scene.materials if any(material.specular)]
    if not shiny:
        return
    if not all(each.cosine_weighted for each in shiny):
        yield Model(
            name="highlight_cosine",
            kind="limitation",
            claim="highlights are multiplied by N.L, so they fade out where the reference cuts them off",
            cites=f"{_PAPER}; Lewis 1994",
            edit=lambda scene: edit_materials(scene, lambda each: replace(each, cosine_weighted=True)),
            when=("highlight", "cosine"),
        )
    yield Model(
        name="highlight_uncut",
        kind="convention",
        claim="highlights go on where N.L < 0, as in shaders that test only the lobe",
        cites=_PAPER,
        options={"uncut": True},
        when=("highlight", "uncut"),
    )
    yield Model(
        name="specular_missing",
        kind="fault",
        claim="there is no highlight",
        cites=_PAPER,
        edit=lambda scene: edit_materials(scene, lambda each: replace(each, specular=_NONE)),
    )
    yield Model(
        name="specular_twice",
        kind="fault",
        claim="highlights are added twice",
        cites=_PAPER,
        edit=lambda scene: edit_materials(scene, lambda each: scaled(each, 2.0)),
    )
    if any(any(each.diffuse) or each.texture >= 0 for each in shiny):
        yield Model(
            name="diffuse_missing",
            kind="fault",
            claim="surfaces with a highlight have no diffuse part",
            cites=_PAPER,
            edit=lambda scene: edit_materials(scene, _without_diffuse),
        )
        yield Model(
            name="specular_tinted",
            kind="fault",
            claim="highlights are multiplied by the diffuse colour",
            cites="Phong 1975: the highlight has the light's colour",
            edit=lambda scene: edit_materials(scene, _tinted),
        )


def _without_diffuse(material: Material) -> Material:
    return replace(material, diffuse=_NONE, texture=-1) if any(material.specular) else material


def _tinted(material: Material) -> Material:
    r, g, b = (s * d for s, d in zip(material.specular, material.diffuse, strict=True))
    return replace(material, specular=(r, g, b))
