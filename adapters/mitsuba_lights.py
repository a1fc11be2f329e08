"""Lights with a size for the Mitsuba child, measured with 3.9.1.

- A sphere, rectangle, disk or cylinder is Mitsuba's shape of that name with an ``area`` emitter, whose radiance is the
  light's. A ``rectangle`` is 2 x 2 and shines to its +z. A shape's own material reflects nothing.
- ``hide_emitters`` lets camera rays pass through these shapes, as the contract has it. In mirrors and glass they are
  seen, so there such lights are refused.
- Each light is drawn alone, so that no light's shape hides another light.
- A distant light with an angle is a sphere of that angle, so far away that its parallax shows in no pixel.
- A dome is ``constant``; with a picture it is ``envmap``, whose local frame is UsdLux's: +y the upper row, +z the
  middle, +x a quarter from the left. Its first and last row lie at the poles, where UsdLux's texels have their edges:
  it is given twice as many rows and one more, which is the same picture.
"""

from __future__ import annotations

import math

import numpy as np

from notabug.adapters.base import UnsupportedError
from notabug.adapters.job_types import Arrays, PlugIn
from notabug.scenes_usd.emitters import side
from notabug.scenes_usd.framing import bounds_of
from notabug.scenes_usd.scene import Emitter, Floats, Light, Scene

_SIMILAR = 1e-6  # relative deviation from a shape that Mitsuba has
_FAR = 1e4  # of a sun, in sizes of the scene
_WIDEST = math.radians(60.0)  # half of a sun's angle: a far ball that is wider would reach into the scene


def check_lights(scene: Scene, *, centres: bool, mirrors: bool) -> None:
    """Raise UnsupportedError where lights with a size cannot be drawn under ``scene``'s materials, at pixel centres.

    Nor can those with links: Mitsuba's lights light everything.
    """
    linked = next((light for light in scene.lights if light.is_linked), None)
    if linked is not None:
        raise UnsupportedError("Mitsuba has no light linking", where=linked.path, expected="a light that lights all")
    sized = next((each for each in scene.lights if each.emitter is not None), None)
    if sized is None:
        return
    if centres:
        raise UnsupportedError(
            "Mitsuba chooses at random where on a light a shadow ray goes",
            where=sized.path,
            expected="more than 1 sample per pixel for a light with a size",
            got="1",
            do="raise the samples",
        )
    if mirrors:
        raise UnsupportedError(
            "Mitsuba shows lights with a size in mirrors and glass, where the contract has none",
            where=sized.path,
            expected="no mirror and no transmission beside a light with a size",
            do="make the light a point (treatAsPoint), or choose another renderer",
        )


def with_size(light: Light, scene: Scene, arrays: Arrays) -> PlugIn:
    """The light as the child gets it; the picture of a dome is added to ``arrays``."""
    emitter = light.emitter
    assert emitter is not None
    radiance = {"type": "rgb", "value": list(light.intensity)}
    if light.kind == "dome" and emitter.texture is not None:
        name = f"sky{scene.lights.index(light)}"
        arrays[name] = (_rows_to_the_poles(emitter.texture.pixels) * np.asarray(light.intensity)).astype(np.float32)
        frame = np.eye(4)
        frame[:3, :3] = emitter.axes.T
        return {"type": "envmap", "bitmap": name, "to_world": frame.tolist()}
    if light.kind == "dome":
        return {"type": "constant", "radiance": radiance}
    shape = _sun(light, emitter, scene) if light.kind == "sun" else _shape(light, emitter)
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    return {**shape, "emitter": {"type": "area", "radiance": radiance}, "bsdf": black}


def _rows_to_the_poles(pixels: Floats) -> Floats:
    """The rows (2 h + 1, w, 3) of a map of h rows that lie at its poles, and every half of a row from there on."""
    down = np.arange(2 * len(pixels) + 1)  # an odd one is the centre of a row, an even one lies between two
    last = len(pixels) - 1
    return np.asarray((pixels[np.clip((down - 1) // 2, 0, last)] + pixels[np.clip(down // 2, 0, last)]) / 2.0)


def _sun(light: Light, emitter: Emitter, scene: Scene) -> PlugIn:
    if emitter.half_angle > _WIDEST:
        got = f"{2 * math.degrees(emitter.half_angle):g} degrees"
        raise UnsupportedError("a distant light's angle", where=light.path, expected="at most 120 degrees", got=got)
    low, high = bounds_of(scene.objects)
    distance = _FAR * float(np.linalg.norm(np.asarray(high) - low))
    middle = (np.asarray(low) + high) / 2.0
    centre = middle - distance * np.asarray(light.direction)
    return {"type": "sphere", "center": centre.tolist(), "radius": distance * math.sin(emitter.half_angle)}


def _shape(light: Light, emitter: Emitter) -> PlugIn:
    x, y, _ = emitter.axes
    centre = np.asarray(light.position)
    lengths = np.linalg.norm(emitter.axes, axis=1)
    cosines = np.abs(emitter.axes @ emitter.axes.T / np.outer(lengths, lengths) - np.eye(3))
    if light.kind == "sphere":
        _check(light, cosines.max(), np.ptp(lengths) / lengths.max(), "a sphere under a similarity")
        return {"type": "sphere", "center": centre.tolist(), "radius": float(lengths[0])}
    if light.kind == "cylinder":
        _check(light, cosines.max(), abs(lengths[1] - lengths[2]) / lengths[1], "a round cylinder")
        ends = {"p0": (centre - x).tolist(), "p1": (centre + x).tolist()}
        return {"type": "cylinder", **ends, "radius": float(lengths[1])}
    uneven = abs(lengths[0] - lengths[1]) / lengths[0] if light.kind == "disk" else 0.0
    _check(light, cosines[0, 1], uneven, "a round disk" if light.kind == "disk" else "right angles")
    normal = side(emitter)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = np.cross(y, normal), y, normal, centre
    matrix[:3, 0] *= lengths[0] / np.linalg.norm(matrix[:3, 0])
    return {"type": {"rect": "rectangle", "disk": "disk"}[light.kind], "to_world": matrix.tolist()}


def _check(light: Light, askew: float, uneven: float, expected: str) -> None:
    if max(askew, uneven) > _SIMILAR:
        raise UnsupportedError("Mitsuba's shapes of lights cannot be sheared", where=light.path, expected=expected)
