"""Lights with a size, beams and multipliers as the native code reads them: Emitter of references/native/scene.h."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.emitters import area, side
from notabug.scenes_usd.scene import Emitter, Light, Shaping

SHAPES = ("none", "sphere", "rect", "disk", "cylinder", "sun", "dome")  # in the order of Shape in native/emitter.h
DIRECTIONS = 55  # to each light with a size, from every sample of a pixel
CENTRE_DIRECTIONS = 233  # and from its centre, whose value stands alone
DRAWN_DIRECTIONS = 987  # and from a centre that a picture consists of: what it is off counts as its renderer's error
PREVIEW_DIRECTIONS = 55  # and from the centre of a preview, of which only differences to others of its kind count


def has_emitters(lights: Sequence[Light]) -> bool:
    """Whether any light is more than a point or a direction."""
    return not all(light.is_plain for light in lights)


def emitters(lights: Sequence[Light], dtype: npt.DTypeLike) -> npt.NDArray[np.floating] | None:
    """The rows (lights, 42), or None where every light is plain."""
    if not has_emitters(lights):
        return None
    domes = textured(lights)
    return np.ascontiguousarray([_row(light, domes) for light in lights], dtype)


def textured(lights: Sequence[Light]) -> list[Light]:
    """The domes with a picture, which has their number here."""
    return [light for light in lights if light.emitter is not None and light.emitter.texture is not None]


def _row(light: Light, domes: Sequence[Light]) -> list[float]:
    shape = SHAPES.index(light.kind) if light.emitter is not None else 0
    emitter = light.emitter or Emitter()
    beam = light.shaping or Shaping()
    cone = math.radians(beam.cone)
    flat = light.kind in ("rect", "disk")
    return [
        float(shape),
        light.diffuse,
        light.specular,
        float(light.shaping is not None),
        cone,
        (1.0 - beam.softness) * cone,
        beam.focus,
        *beam.tint,
        area(light) if flat else 0.0,
        abs(float(np.linalg.det(emitter.axes))),
        2.0 * math.sin(emitter.half_angle / 2.0) ** 2,
        *light.position,
        *light.direction,
        *(side(emitter) if flat else light.direction),
        *emitter.axes.ravel().tolist(),
        *np.linalg.inv(emitter.axes).T.ravel().tolist(),
        float(next((number for number, dome in enumerate(domes) if dome is light), -1)),
    ]
