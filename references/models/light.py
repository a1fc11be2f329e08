"""Faults of lights, which any scene with a light can show."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Scene

GAIN = 1.05


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with lights."""
    if scene.lights:
        yield Model(
            name="light_gain",
            kind="fault",
            claim="every light is too bright or too dark by one factor",
            cites="UsdLux: intensity, exposure and normalize",
            edit=_brighter,
        )


def _brighter(scene: Scene) -> Scene:
    def one(intensity: tuple[float, float, float]) -> tuple[float, float, float]:
        r, g, b = intensity
        return (r * GAIN, g * GAIN, b * GAIN)

    return replace(scene, lights=tuple(replace(each, intensity=one(each.intensity)) for each in scene.lights))
