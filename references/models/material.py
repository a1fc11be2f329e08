"""Faults of materials that no other file holds: albedo, opacity, glass, and how highlights are scaled or cut off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from notabug.references.models.model import Edit, Model, edit_materials, in_strengths
from notabug.references.models.phong import scaled
from notabug.scenes_usd.scene import Material, Scene

Colour = tuple[float, float, float]


DENSER = (
    0.85,
    1.02,
    1.1,
    1.25,
)  # strengths of a wrong index from which it is fitted: what glass shows at one is unlike another


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights; those of glass and opacity where there is some."""
    if not scene.lights:
        return
    used = {shape.material for shape in scene.objects}
    for index, material in enumerate(scene.materials):
        if index in used and any(material.diffuse) and material.texture < 0:
            yield in_strengths(_albedo(index, material.path), 1.05, neutral=1.0)
        if index in used and any(material.mirror):
            yield in_strengths(_mirror(index, material.path), 1.1, neutral=1.0)
    if any(each.transmission != (0.0, 0.0, 0.0) for each in scene.materials):
        for strength in DENSER:
            yield in_strengths(_ior, strength, neutral=1.0)
        yield _fault(
            "ior_inverted",
            "glass is bent by the index of the wrong side",
            "Whitted 1980, section 2",
            lambda each: replace(each, ior=1.0 / each.ior),
        )
        yield Model(
            name="total_reflection_lost",
            kind="fault",
            claim="rays that are totally reflected are lost",
            cites="Whitted 1980, section 2",
            options={"lost_reflection": True},
        )
    if any(each.opacity < 1.0 for each in scene.materials):
        yield _fault(
            "opacity_inverted",
            "opacity is taken for transparency",
            "UsdPreviewSurface: opacity",
            lambda each: replace(each, opacity=1.0 - each.opacity) if each.opacity < 1.0 else each,
        )
        yield _fault(
            "opacity_ignored",
            "opacity is ignored",
            "UsdPreviewSurface: opacity",
            lambda each: replace(each, opacity=1.0),
        )
    if any(any(each.specular) for each in scene.materials):
        yield in_strengths(
            lambda strength: _fault(
                "specular_gain",
                f"highlights are {strength:.3g} times as bright",
                "Phong 1975",
                lambda each: scaled(each, strength),
            ),
            1.1,
            neutral=1.0,
        )
        yield _fault(
            "normalisation_precedence",
            "highlights are scaled by n + 1: by n + 2/2 or n + 8/8, where (n + 2)/2 or (n + 8)/8 was meant",
            "Lewis 1994; Akenine-Moeller et al. 2018, section 9.8",
            lambda each: scaled(each, each.exponent + 1.0),
        )
        yield Model(
            name="cutoff_missing",
            kind="fault",
            claim="highlights go on where N.L < 0",
            cites="Woo, Pearce and Ouellette 1996, figures 4 to 7",
            options={"uncut": True},
        )
        yield _fault(
            "lobe_exchanged",
            "highlights have the other lobe, at the same exponent",
            "Woo, Pearce and Ouellette 1996, Phong versus Phong",
            lambda each: replace(each, lobe="blinn" if each.lobe == "phong" else "phong"),
        )


def _ior(strength: float) -> Model:
    return _fault(
        "ior",
        f"the index of refraction is {strength:.4g} times too large",
        "Whitted 1980, section 2",
        lambda each: replace(each, ior=each.ior * strength),
    )


def _fault(name: str, claim: str, cites: str, change: Callable[[Material], Material]) -> Model:
    return Model(name=name, kind="fault", claim=claim, cites=cites, edit=lambda scene: edit_materials(scene, change))


def _times(colour: Colour, factor: float) -> Colour:
    r, g, b = colour
    return (r * factor, g * factor, b * factor)


def _only(index: int, change: Callable[[Material], Material]) -> Edit:
    return lambda scene: replace(
        scene, materials=tuple(change(each) if i == index else each for i, each in enumerate(scene.materials))
    )


def _albedo(index: int, path: str) -> Callable[[float], Model]:
    return lambda strength: Model(
        name="albedo",
        kind="fault",
        claim=f"the diffuse colour of {path} is {strength:.3g} times the right one",
        cites="UsdPreviewSurface: diffuseColor",
        edit=_only(index, lambda each: replace(each, diffuse=_times(each.diffuse, strength))),
    )


def _mirror(index: int, path: str) -> Callable[[float], Model]:
    return lambda strength: Model(
        name="mirror_gain",
        kind="fault",
        claim=f"the mirror {path} reflects {strength:.3g} times as much",
        cites="Whitted 1980, section 2",
        edit=_only(index, lambda each: replace(each, mirror=_times(each.mirror, strength))),
    )
