"""Phong versus Phong: two reflection models and three interpolations under one name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from notabug.references.models.model import Model, edit_materials, edit_meshes, in_strengths
from notabug.scenes_usd.scene import Material, Scene
from notabug.scenes_usd.triangulate import split_ngons

_PAPER = "Woo, Pearce and Ouellette 1996, Phong versus Phong"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and interpolated normals, or with highlights."""
    if scene.lights and any(each.normals is not None for each in scene.meshes):
        yield from _interpolations()
    shiny = [each for each in scene.materials if any(each.specular)]
    if not shiny:
        return
    for lobe in ("phong", "blinn"):
        if any(each.lobe != lobe for each in shiny):
            yield Model(
                name=f"lobe_{lobe}",
                kind="limitation",
                claim=f"highlights have {lobe.capitalize()}'s lobe at the same exponent",
                cites=f"{_PAPER}; Phong 1975; Blinn 1977",
                edit=lambda scene, lobe=lobe: with_lobe(scene, lobe),  # type: ignore[misc]
                when=("lobe", lobe),
            )
            yield Model(
                name=f"lobe_{lobe}_matched",
                kind="limitation",
                claim=f"highlights have {lobe.capitalize()}'s lobe at the exponent that Fisher and Woo match",
                cites=f"{_PAPER}; Fisher and Woo 1994, R.E versus N.H specular highlights, Graphics Gems IV",
                edit=lambda scene, lobe=lobe: with_lobe(scene, f"{lobe}_matched"),  # type: ignore[misc]
                when=("lobe", f"{lobe}_matched"),
            )
    for name, rule, factor in (
        ("n2", "(n + 2)/2", lambda n: (n + 2) / 2),
        ("n8", "(n + 8)/8", lambda n: (n + 8) / 8),
    ):
        yield Model(
            name=f"lobe_normalised_{name}",
            kind="limitation",
            claim=f"highlights are normalised by {rule}",
            cites="Lewis 1994, Making shaders more physically plausible; Akenine-Moeller et al. 2018, section 9.8",
            edit=_shiny(lambda each, factor=factor: scaled(each, factor(each.exponent))),  # type: ignore[misc]
            when=("normalised", name),
        )
    yield in_strengths(
        lambda strength: Model(
            name="exponent",
            kind="fault",
            claim=f"the exponent of every highlight is {strength:.3g} times too large",
            cites=_PAPER,
            edit=_shiny(lambda each: replace(each, exponent=each.exponent * strength)),
        ),
        1.3,
        neutral=1.0,
    )
    if any(each.lobe == "phong" for each in shiny):
        yield Model(
            name="reflection_of_unnormalised_light",
            kind="fault",
            claim="R is computed from a light vector that was not normalised",
            cites="Phong 1975",
            options={"raw_vectors": True},
        )
    if any(each.lobe == "blinn" for each in shiny):
        yield Model(
            name="halfway_not_normalised",
            kind="fault",
            claim="the halfway vector is not normalised",
            cites="Blinn 1977",
            options={"raw_vectors": True},
        )


def _interpolations() -> Iterator[Model]:
    """What else than normals may be interpolated over a smooth mesh; shadows go with the light, so to the corners."""
    yield Model(
        name="gouraud_interpolation",
        kind="limitation",
        claim="smooth meshes are lit at the corners of their triangles, and the colours are interpolated",
        cites=f"{_PAPER}; Gouraud 1971",
        edit=lambda scene: edit_meshes(scene, lambda mesh: mesh if mesh.normals is None else split_ngons(mesh, "02")),
        options={"gouraud": True},
        when=("interpolation", "gouraud"),
    )
    yield Model(
        name="flat_interpolation",
        kind="limitation",
        claim="nothing is interpolated: smooth meshes are lit by the normals of their facets",
        cites=f"{_PAPER}; Bouknight 1970",
        edit=lambda scene: edit_meshes(scene, lambda mesh: replace(mesh, normals=None)),
        when=("interpolation", "flat"),
    )


def matched(material: Material, lobe: str) -> Material:
    """``material`` with the other lobe at a matching exponent: Phong's n is close to Blinn's 4n (Fisher and Woo)."""
    if material.lobe == lobe:
        return material
    factor = 4.0 if lobe == "blinn" else 0.25
    return replace(material, lobe=lobe, exponent=material.exponent * factor)  # type: ignore[arg-type]


def with_lobe(scene: Scene, lobe: str) -> Scene:
    """``scene`` as a renderer draws it that has one lobe only; ``lobe`` as in an adapter's declaration."""
    if lobe == "authored":
        return scene
    kind, _, at = lobe.partition("_")
    if at:
        return _shiny(lambda each: matched(each, kind))(scene)
    return _shiny(lambda each: replace(each, lobe=kind))(scene)  # type: ignore[arg-type]


def scaled(material: Material, factor: float) -> Material:
    """``material`` with its highlight ``factor`` times as bright."""
    r, g, b = material.specular
    return replace(material, specular=(r * factor, g * factor, b * factor))


def _shiny(change: Callable[[Material], Material]) -> Callable[[Scene], Scene]:
    return lambda scene: edit_materials(scene, lambda each: change(each) if any(each.specular) else each)
