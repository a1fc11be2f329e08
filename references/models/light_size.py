"""Faults of lights with a size, beams, multipliers and links: what UsdLux says of them is left out, or doubled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.model import Edit, Model
from notabug.scenes_usd.emitters import area, resized, scaled
from notabug.scenes_usd.scene import Light, Scene

_USD = "UsdLux LightAPI and ShapingAPI"
FLAT = ("rect", "disk")
POINT = 1.0 / 64.0  # of a light's size: as good as a point
SAME = 1e-3  # relative difference of two brightnesses that shows nothing


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with such lights."""
    sized = [each for each in scene.lights if each.emitter is not None and each.kind != "dome"]
    if sized:
        yield _fault(
            "light_size_ignored",
            "lights with a size are drawn as points, and those of a distant light's angle as one direction",
            lambda each: resized(each, POINT, keep_power=True),
        )
        for factor, word in ((2.0, "twice"), (0.5, "half")):
            for keep, what in ((True, "with the same power"), (False, "with the same radiance")):
                yield _fault(
                    "light_size",
                    f"lights are {word} as large, {what}",
                    lambda each, factor=factor, keep=keep: resized(each, factor, keep_power=keep),  # type: ignore[misc]
                )
    if any(each.kind in FLAT for each in sized):
        yield _fault("light_shape", "rectangular lights are drawn as disks, and disks as squares", _reshaped)
        yield Model(
            name="light_both_sides",
            kind="fault",
            claim="rectangular and disk lights shine to both sides",
            cites=_USD,
            edit=_doubled,
        )
        yield Model(
            name="light_cosine_ignored",
            kind="fault",
            claim="each point of a rectangular or disk light sends as much light to every side as straight ahead",
            cites=f"{_USD}; Lambert 1760, Photometria",
            options={"light_uncosined": True},
        )
    if any(abs(area(each) - 1.0) > SAME for each in sized):
        yield _fault(
            "normalize_ignored", "inputs:normalize of lights is ignored, or taken as on where it is off", _other
        )
    if any(each.emitter is not None and each.emitter.exposure for each in scene.lights):
        yield _fault("exposure_ignored", "inputs:exposure of lights is ignored", _unexposed)
    if any(each.shaping is not None for each in scene.lights):
        yield _fault("cone_ignored", "the beam of lights is ignored", lambda each: replace(each, shaping=None))
    if any(each.unlit for each in scene.lights):
        yield _fault(
            "light_link_ignored",
            "lightLink of lights is ignored: they light every object",
            lambda each: replace(each, unlit=()),
        )
    if any(each.unshadowing for each in scene.lights):
        yield _fault(
            "shadow_link_ignored",
            "shadowLink of lights is ignored: every object casts their shadows",
            lambda each: replace(each, unshadowing=()),
        )
    if any(each.diffuse != 1.0 or each.specular != 1.0 for each in scene.lights):
        yield _fault(
            "light_multiplier_ignored",
            "inputs:diffuse and inputs:specular of lights are ignored",
            lambda each: replace(each, diffuse=1.0, specular=1.0),
        )


def _other(light: Light) -> Light:
    """``light`` as if normalize were what it is not."""
    if light.emitter is None or light.kind == "dome":
        return light
    return scaled(light, area(light) if light.emitter.normalized else 1.0 / area(light))


def _reshaped(light: Light) -> Light:
    """``light`` as a disk within the rectangle, or as the square about the disk; its power stays."""
    if light.kind not in FLAT:
        return light
    made = replace(light, kind="disk" if light.kind == "rect" else "rect")
    return scaled(made, area(light) / area(made))


def _doubled(scene: Scene) -> Scene:
    """``scene`` with a light to the other side behind each rectangle and disk."""
    backs = []
    for each in scene.lights:
        if each.kind in FLAT and each.emitter is not None:
            turned = each.emitter.axes * np.array([[1.0], [1.0], [-1.0]])
            x, y, z = (-part for part in each.direction)
            backs.append(replace(each, direction=(x, y, z), emitter=replace(each.emitter, axes=turned)))
    return replace(scene, lights=(*scene.lights, *backs))


def _unexposed(light: Light) -> Light:
    return light if light.emitter is None else scaled(light, 2.0**-light.emitter.exposure)


def _fault(name: str, claim: str, change: Callable[[Light], Light]) -> Model:
    edit: Edit = lambda scene: replace(scene, lights=tuple(change(each) for each in scene.lights))  # noqa: E731
    return Model(name=name, kind="fault", claim=claim, cites=_USD, edit=edit)
