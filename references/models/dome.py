"""Faults of a dome's picture: where it points, what its numbers mean, and whether it is there at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Floats, Light, Scene, Texture
from notabug.scenes_usd.srgb import decode_srgb, encode_srgb
from notabug.scenes_usd.transform import rotation

_USD = "UsdLux DomeLight, after OpenEXR's latitude-longitude map"
_POLE, _ACROSS = (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with a dome that has a picture."""
    pictures = [light.emitter.texture for light in scene.lights if light.emitter is not None and light.emitter.texture]
    if not pictures:
        return
    for degrees in (90.0, 180.0, -90.0):
        claim = f"the dome's picture is turned about its pole by {degrees:g} degrees"
        yield _fault("dome_turned", claim, _turned(rotation(_POLE, degrees)[:3, :3]))
    yield _fault("dome_mirrored", "the dome's picture is mirrored: left and right are exchanged", _repainted(_mirrored))
    yield _fault("dome_upside_down", "the dome's picture is upside down", _repainted(_flipped))
    for degrees in (90.0, -90.0):
        claim = f"the dome's pole is tilted by {degrees:g} degrees about its x axis: y and z are exchanged"
        yield _fault("dome_pole", claim, _turned(rotation(_ACROSS, degrees)[:3, :3]))
    yield _fault("dome_texture_ignored", "the dome has its colour alone, and no picture", _plain)
    if any(picture.colour_space == "raw" for picture in pictures):
        claim = "the dome's picture is decoded as sRGB, where its numbers are linear"
        yield _fault("dome_map_as_srgb", claim, _repainted(_decoded))
    if any(picture.colour_space == "sRGB" for picture in pictures):
        claim = "the dome's picture is not decoded, where it is sRGB"
        yield _fault("dome_map_as_raw", claim, _repainted(_encoded))
    yield Model(
        name="dome_rows_at_poles",
        kind="convention",
        claim="the poles are at the centres of the picture's first and last row, not at its edges",
        cites=f"{_USD}: 'pixel (dataWindow.min.x, dataWindow.min.y) has latitude +pi/2'",
        edit=lambda scene: _edited(scene, _repainted(_at_poles)),
    )


def _fault(name: str, claim: str, change: Callable[[Light], Light]) -> Model:
    return Model(name=name, kind="fault", claim=claim, cites=_USD, edit=lambda scene: _edited(scene, change))


def _edited(scene: Scene, change: Callable[[Light], Light]) -> Scene:
    """``scene`` with ``change`` done to its domes with a picture."""
    has_picture = [light.emitter is not None and light.emitter.texture is not None for light in scene.lights]
    lights = (change(light) if has else light for light, has in zip(scene.lights, has_picture, strict=True))
    return replace(scene, lights=tuple(lights))


def _turned(linear: Floats) -> Callable[[Light], Light]:
    """The dome turned by ``linear`` (3, 3) in its own frame."""

    def change(light: Light) -> Light:
        assert light.emitter is not None
        axes = np.ascontiguousarray(linear @ light.emitter.axes)
        return replace(light, emitter=replace(light.emitter, axes=axes))

    return change


def _repainted(change: Callable[[Texture], Floats]) -> Callable[[Light], Light]:
    """The dome whose picture has the pixels that ``change`` makes of it."""

    def repaint(light: Light) -> Light:
        assert light.emitter is not None
        assert light.emitter.texture is not None
        picture = light.emitter.texture
        made = replace(picture, path=picture.path.with_name("as-drawn"), pixels=np.ascontiguousarray(change(picture)))
        return replace(light, emitter=replace(light.emitter, texture=made))

    return repaint


def _plain(light: Light) -> Light:
    assert light.emitter is not None
    return replace(light, emitter=replace(light.emitter, texture=None))


def _mirrored(picture: Texture) -> Floats:
    return picture.pixels[:, ::-1]


def _flipped(picture: Texture) -> Floats:
    return picture.pixels[::-1]


def _decoded(picture: Texture) -> Floats:
    return np.asarray(decode_srgb(picture.pixels)) if picture.colour_space == "raw" else picture.pixels


def _encoded(picture: Texture) -> Floats:
    return np.asarray(encode_srgb(picture.pixels)) if picture.colour_space == "sRGB" else picture.pixels


_FINER = 8  # rows in the place of one, for what lies between rows elsewhere
_MOST_ROWS = 1024


def _at_poles(picture: Texture) -> Floats:
    """The picture as rows whose first and last centre are the poles show it, in finer rows of our kind."""
    rows = picture.pixels.shape[0]
    if rows < 2:
        return picture.pixels
    finer = max(1, min(_FINER, _MOST_ROWS // rows))
    down = (np.arange(rows * finer) + 0.5) / (rows * finer) * (rows - 1)
    above = np.minimum(down.astype(int), rows - 2)
    share = (down - above)[:, None, None]
    return np.asarray((1.0 - share) * picture.pixels[above] + share * picture.pixels[above + 1])
