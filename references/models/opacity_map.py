"""Opacity from a map: what readers get wrong of it, of its threshold, and of colours that have an alpha.

UsdPreviewSurface has the colour and the opacity as two inputs, each filtered by itself. Who filters them together, as
compositing has it, brings no colour of clear texels into the border: a convention of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from notabug.references.models.model import Edit, Model, edit_materials
from notabug.scenes_usd.scene import CUTOFF_ROUNDED, Floats, Material, Scene, Texture
from notabug.scenes_usd.srgb import decode_srgb, encode_srgb

_SPECIFICATION = "UsdPreviewSurface: opacity, opacityThreshold"
_TEXTURE = "UsdUVTexture: outputs:a, sourceColorSpace"
_ALPHA = "Porter and Duff 1984, Compositing Digital Images; Blinn 1994, Compositing, Part 1: Theory"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene that shows surfaces with a map of opacity."""
    shown = [scene.materials[index] for index in sorted({shape.material for shape in scene.objects})]
    mapped = [material for material in shown if material.opacity_map >= 0]
    if not mapped:
        return
    yield _fault(
        "opacity_ignored", "opacity is ignored", _materials(lambda each: replace(each, opacity_map=-1, cutoff=0.0))
    )
    inverted = edit_masks(lambda _, mask: 1.0 - mask.pixels)
    yield _fault("opacity_inverted", "opacity is taken for transparency", inverted)
    yield from _channels(scene, mapped)
    yield from _colours(scene, mapped)
    if any(material.cutoff for material in mapped):
        unmasked = _materials(lambda each: replace(each, cutoff=0.0))
        yield _fault("opacity_threshold_ignored", "opacityThreshold is ignored", unmasked)
        if any(_meets(scene.textures[material.opacity_map], material.cutoff) for material in mapped):
            claim = "an opacity that is as large as opacityThreshold is none"
            strict = _materials(lambda each: replace(each, cutoff=each.cutoff * (1.0 + 2.0 * CUTOFF_ROUNDED)))
            yield _fault("opacity_threshold_strict", claim, strict)
        if scene.lights:
            yield Model(
                name="cutout_shadow_whole",
                kind="fault",
                claim="what a map cuts away casts a shadow",
                cites=_SPECIFICATION,
                options={"whole_cutouts": True},
            )


def _meets(mask: Texture, cutoff: float) -> bool:
    """Whether a texel of ``mask`` is as large as ``cutoff``, up to rounding."""
    return bool((np.abs(mask.pixels - cutoff) <= CUTOFF_ROUNDED * cutoff).any())


def _channels(scene: Scene, mapped: list[Material]) -> Iterator[Model]:
    """Other numbers that are taken for the opacity."""
    grey = any(0.0 < level < 1.0 for each in mapped for level in np.unique(scene.textures[each.opacity_map].pixels))
    if grey:
        decoded = edit_masks(lambda _, mask: decode_srgb(mask.pixels))
        yield _fault("opacity_decoded", "opacity is decoded from sRGB", decoded, _TEXTURE)
        encoded = edit_masks(lambda _, mask: encode_srgb(mask.pixels))
        yield _fault("opacity_encoded", "opacity is encoded as sRGB, or not decoded", encoded, _TEXTURE)
    painted = [each for each in mapped if each.texture >= 0]
    if not painted:
        return
    red = edit_masks(lambda colour, mask: mask.pixels if colour is None else _red(colour.pixels))
    yield _fault("opacity_of_red", "the colour's red is taken for the opacity", red, _TEXTURE)
    if any(scene.textures[each.texture].colour_space == "sRGB" for each in painted):
        stored = edit_masks(lambda colour, mask: mask.pixels if colour is None else _red(encode_srgb(colour.pixels)))
        yield _fault("opacity_of_red", "the colour's red, not decoded, is taken for the opacity", stored, _TEXTURE)


def _colours(scene: Scene, mapped: list[Material]) -> Iterator[Model]:
    """Colours that are multiplied by the opacity, in the texture and again where the surface is composed."""
    painted = [each for each in mapped if _is_one_picture(scene, each)]
    if not painted:
        return
    for claim, times in (
        ("the colour is multiplied by its alpha: dark fringes", lambda colour, alpha: colour * alpha),
        (
            "the colour as stored, encoded as sRGB, is multiplied by its alpha: dark fringes",
            lambda colour, alpha: decode_srgb(encode_srgb(colour) * alpha),
        ),
    ):
        if "encoded" in claim and all(scene.textures[each.texture].colour_space == "raw" for each in painted):
            continue
        yield _fault("colour_times_alpha", claim, multiplied(times), _ALPHA)
    if len(painted) < sum(each.texture >= 0 for each in mapped):  # the switch is of every such surface
        return
    yield from _together()


def _together() -> Iterator[Model]:
    """Colours that are filtered with their alpha: a choice, and a fault of who declares that they are not."""
    claim = "colours are mixed as multiplied by their alpha: no colour of what is cut away bleeds into the border"
    cites = f"{_ALPHA}; Forsyth 2006, Premultiplied alpha"
    edit, options = multiplied(lambda colour, alpha: colour * alpha), {"associated": True}
    yield Model(
        name="associated_filter",
        kind="convention",
        claim=claim,
        cites=cites,
        edit=edit,
        options=options,
        when=("opacity_filter", "together"),
    )
    yield Model(
        name="filtered_with_alpha",
        kind="fault",
        claim=f"{claim}, although it is declared that each is filtered apart",
        cites=cites,
        edit=edit,
        options=options,
        when=("opacity_filter", "separate"),
        strict=True,
    )


def _red(pixels: Floats) -> Floats:
    return np.repeat(pixels[..., :1], 3, axis=2)


def _is_one_picture(scene: Scene, material: Material) -> bool:
    """Whether the colour's texels are those of the opacity."""
    if material.texture < 0 or material.opacity_map < 0:
        return False
    colour, mask = scene.textures[material.texture], scene.textures[material.opacity_map]
    alike = (colour.wrap_s, colour.wrap_t) == (mask.wrap_s, mask.wrap_t)
    return alike and colour.pixels.shape == mask.pixels.shape


def multiplied(times: Callable[[Floats, Floats], Floats]) -> Edit:
    """An edit by which the colours of textures with an opacity beside them are ``times`` it."""

    def edit(scene: Scene) -> Scene:
        textures, materials = list(scene.textures), []
        for material in scene.materials:
            if _is_one_picture(scene, material):
                colour, mask = textures[material.texture], textures[material.opacity_map]
                textures.append(replace(colour, pixels=times(colour.pixels, mask.pixels)))
                material = replace(material, texture=len(textures) - 1)
            materials.append(material)
        return replace(scene, textures=tuple(textures), materials=tuple(materials))

    return edit


def edit_masks(change: Callable[[Texture | None, Texture], Floats]) -> Edit:
    """An edit of the opacity (h, w, 3) of every material, from the texture of its colour, if it has one, and its own.

    Other maps that are the same texture keep theirs.
    """

    def edit(scene: Scene) -> Scene:
        textures, materials = list(scene.textures), []
        for material in scene.materials:
            if material.opacity_map >= 0:
                colour = textures[material.texture] if material.texture >= 0 else None
                mask = textures[material.opacity_map]
                pixels = np.ascontiguousarray(np.clip(change(colour, mask), 0.0, 1.0))
                textures.append(Texture(Path("opacity"), pixels, mask.wrap_s, mask.wrap_t))
                material = replace(material, opacity_map=len(textures) - 1)
            materials.append(material)
        return replace(scene, textures=tuple(textures), materials=tuple(materials))

    return edit


def _materials(change: Callable[[Material], Material]) -> Edit:
    return lambda scene: edit_materials(scene, lambda each: change(each) if each.opacity_map >= 0 else each)


def _fault(name: str, claim: str, edit: Edit, cites: str = _SPECIFICATION) -> Model:
    return Model(name=name, kind="fault", claim=claim, cites=cites, edit=edit)
