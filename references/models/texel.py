"""Faults of texture lookup: colour space, wrap mode, channels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.model import Edit, Model
from notabug.scenes_usd.scene import Floats, Scene, Texture, Wrap
from notabug.scenes_usd.srgb import decode_srgb, encode_srgb

POWER = 2.2  # the exponent that is widely used in the place of sRGB's curve
_USD = "UsdUVTexture: sourceColorSpace, wrapS, wrapT"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with textured objects: of colours where a map has some, of look-ups where any map is shown."""
    if not scene.shown_textures:
        return
    colours = {scene.materials[shape.material].texture for shape in scene.objects} - {-1}
    changes: list[tuple[str, str, Edit]] = []
    if colours:
        changes += [
            ("texture_decoded", "the texture is decoded from sRGB once too often", pixels(decode_srgb)),
            ("texture_encoded", "the texture is not decoded from sRGB, or encoded once too often", pixels(encode_srgb)),
            (
                "texture_channels_swapped",
                "red and blue of the texture are exchanged",
                pixels(lambda rgb: rgb[..., ::-1]),
            ),
        ]
    changes += [("texture_wrap", claim, edit) for claim, edit in _wraps(scene)]
    if any(scene.textures[index].colour_space == "sRGB" for index in colours):
        claim = f"the texture is decoded by the power {POWER}, not by sRGB's curve"
        changes.append(("texture_decoded_by_power", claim, _textures(_by_power)))
    for name, claim, edit in changes:
        yield Model(name=name, kind="fault", claim=claim, cites=_USD, edit=edit)
    yield Model(
        name="texture_nearest",
        kind="fault",
        claim="the nearest texel is taken, where bilinear lookup is declared",
        cites="Heckbert 1989, section 3.5",
        options={"texels": "nearest"},
    )


def pixels(change: Callable[[Floats], Floats]) -> Edit:
    """An edit of the texels (h, w, 3) of every texture."""
    return _textures(lambda each: replace(each, pixels=np.ascontiguousarray(change(each.pixels))))


def _textures(change: Callable[[Texture], Texture]) -> Edit:
    return lambda scene: replace(scene, textures=tuple(change(texture) for texture in scene.textures))


def _by_power(texture: Texture) -> Texture:
    if texture.colour_space != "sRGB":
        return texture
    return replace(texture, pixels=np.ascontiguousarray(encode_srgb(texture.pixels) ** POWER))


_HOW: dict[Wrap, str] = {
    "repeat": "repeats",
    "clamp": "is clamped",
    "mirror": "is mirrored",
    "black": "is black beyond its border",
}


def _wraps(scene: Scene) -> Iterator[tuple[str, Edit]]:
    """Every other wrap mode than the textures that are shown have, where it shows; those of the two axes exchanged."""
    modes = {(scene.textures[index].wrap_s, scene.textures[index].wrap_t) for index in scene.shown_textures}
    apart = leaves(scene)
    for mode, how in _HOW.items():
        # within 0..1 what is mirrored is what is clamped
        if modes != {(mode, mode)} and (apart or mode != "mirror"):
            yield f"the texture {how} on both axes", _textures(lambda each, m=mode: replace(each, wrap_s=m, wrap_t=m))  # type: ignore[misc]
    if any(s != t for s, t in modes):
        exchanged = _textures(lambda each: replace(each, wrap_s=each.wrap_t, wrap_t=each.wrap_s))
        yield "the texture's wrap modes of u and v are exchanged", exchanged


def leaves(scene: Scene) -> bool:
    """Whether a texture is looked up beyond 0..1."""
    shown = (each.uv for each in scene.meshes if scene.materials[each.material].textures)
    return any(uv is not None and uv.size and (uv.min() < 0.0 or uv.max() > 1.0) for uv in shown)
