"""UsdPreviewSurface: which masking GGX has, and what readers and shaders of it get wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

from notabug.references.models.model import Model, edit_materials, in_strengths
from notabug.scenes_usd.scene import Material, Preview, Scene, Texture

_SPECIFICATION = "UsdPreviewSurface, Core Nodes: Preview Surface"
_USUAL = Preview()
_MASKING: dict[Literal["correlated", "schlick"], tuple[str, str]] = {
    "correlated": ("GGX has Smith's masking of both directions as one", "Heitz 2014, equation 99"),
    "schlick": (
        "GGX has Schlick's fit of Smith's masking, k = alpha / 2",
        "Karis 2013; OpenUSD, previewSurface.glslfx, Geometric",
    ),
}
Change = Callable[[Preview], Preview]


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights and such surfaces."""
    found = [each.preview for each in (scene.materials[shape.material] for shape in scene.objects) if each.preview]
    if not found:
        return
    if scene.lights:
        yield from _lobes(found)
        yield from _maps(scene, found)
    if any(any(each.emission) or each.emission_map >= 0 for each in found):
        yield _fault(
            "emission_missing",
            "emissiveColor is ignored",
            lambda each: replace(each, emission=(0.0, 0.0, 0.0), emission_map=-1),
        )


def _lobes(found: list[Preview]) -> Iterator[Model]:
    for masking, (claim, cites) in _MASKING.items():
        yield Model(
            name=f"masking_{masking}",
            kind="convention",
            claim=claim,
            cites=cites,
            edit=_edit(lambda each, masking=masking: replace(each, masking=masking)),  # type: ignore[misc]
            when=("masking", masking),
        )
    for name, claim, power in (
        ("roughness_squared_twice", "alpha is roughness^4: it is squared twice", 2.0),
        ("roughness_not_squared", "alpha is the roughness, not its square", 0.5),
    ):
        yield _fault(name, claim, lambda each, power=power: _powered(each, power), whole=_powered_maps(power))  # type: ignore[misc]
    yield in_strengths(
        lambda strength: _fault(
            "roughness",
            f"roughness is {strength:.3g} times the right one",
            lambda each: replace(each, roughness=min(each.roughness * strength, 1.0)),
        ),
        1.1,
        neutral=1.0,
    )
    if any(not each.specular_workflow and (each.metallic or each.metallic_map >= 0) for each in found):
        yield _fault(
            "metallic_ignored", "metallic is ignored", lambda each: replace(each, metallic=0.0, metallic_map=-1)
        )
    yield _fault(
        "workflow_exchanged",
        "useSpecularWorkflow is read the wrong way round",
        lambda each: replace(each, specular_workflow=not each.specular_workflow),
        cites=f"{_SPECIFICATION}: useSpecularWorkflow; arnold-usd 1183",
    )
    by_ior = [each for each in found if not each.specular_workflow or each.clearcoat]
    if any(each.ior != _USUAL.ior for each in by_ior):
        yield _fault("ior_ignored", "ior is taken for 1.5", lambda each: replace(each, ior=_USUAL.ior))
    if any(each.clearcoat for each in found):
        yield _fault("clearcoat_missing", "clearcoat is ignored", lambda each: replace(each, clearcoat=0.0))


def _maps(scene: Scene, found: list[Preview]) -> Iterator[Model]:
    numbers = {k for each in found for k in (each.roughness_map, each.metallic_map)} - {-1}
    if any(scene.textures[k].colour_space == "raw" for k in numbers):
        from notabug.scenes_usd.srgb import decode_srgb

        yield Model(
            name="number_map_as_srgb",
            kind="fault",
            claim="the maps of roughness and metallic are decoded as sRGB, though they are raw",
            cites="UsdUVTexture: sourceColorSpace; usd-wg/assets 98",
            edit=lambda scene: _edit_maps(
                scene,
                {k for material in scene.materials if material.preview for k in material.preview.maps[:2]},
                lambda each: replace(each, pixels=decode_srgb(each.pixels)) if each.colour_space == "raw" else each,
            ),
        )


def _fault(
    name: str,
    claim: str,
    change: Change,
    *,
    cites: str = _SPECIFICATION,
    whole: Callable[[Scene], Scene] = lambda scene: scene,
) -> Model:
    return Model(name=name, kind="fault", claim=claim, cites=cites, edit=lambda scene: _edit(change)(whole(scene)))


def _edit(change: Change) -> Callable[[Scene], Scene]:
    def changed(material: Material) -> Material:
        return material if material.preview is None else replace(material, preview=change(material.preview))

    return lambda scene: edit_materials(scene, changed)


def _powered(surface: Preview, power: float) -> Preview:
    """``surface`` whose roughnesses are taken to ``power``."""
    return replace(
        surface,
        roughness=math.pow(surface.roughness, power),
        clearcoat_roughness=math.pow(surface.clearcoat_roughness, power),
    )


def _powered_maps(power: float) -> Callable[[Scene], Scene]:
    return lambda scene: _edit_maps(
        scene,
        {material.preview.roughness_map for material in scene.materials if material.preview},
        lambda each: replace(each, pixels=each.pixels**power),
    )


def _edit_maps(scene: Scene, which: set[int], change: Callable[[Texture], Texture]) -> Scene:
    """``scene`` with the textures ``which``, -1 among them or not, changed."""
    if not which - {-1}:
        return scene
    return replace(scene, textures=tuple(change(each) if k in which else each for k, each in enumerate(scene.textures)))
