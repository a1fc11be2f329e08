"""The areas of lights' shapes, and lights that are moved, turned or made larger with their shapes."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np

from notabug.scenes_usd.scene import Emitter, Floats, Light

_NODES = 256  # of a quadrature over one turn or one diameter: of axes 1 : 20 the area is known to 1e-12


def area(light: Light) -> float:
    """The area of the shape in world space; of a ``sun`` UsdLux's size factor; 1 of all that has none.

    UsdLux LightAPI, ``inputs:normalize``: the luminance is divided by the surface area, and that of a distant light by
    pi sin^2 of half its angle, or pi (2 - sin^2) beyond a right angle.
    """
    emitter = light.emitter
    if emitter is None or light.kind == "dome":
        return 1.0
    x, y, z = emitter.axes
    if light.kind == "sun":
        square = math.sin(emitter.half_angle) ** 2
        return math.pi * (square if emitter.half_angle <= math.pi / 2.0 else 2.0 - square)
    turn = (np.arange(_NODES) + 0.5) * (2.0 * math.pi / _NODES)
    if light.kind == "cylinder":
        across = np.sin(turn)[:, None] * -y + np.cos(turn)[:, None] * z
        return float(np.linalg.norm(np.cross(x, across), axis=1).mean() * 2.0 * math.pi * 2.0)
    if light.kind == "sphere":
        heights, weights = _gauss()
        inverse = np.linalg.inv(emitter.axes)  # a row vector of the unit sphere is a world vector times this
        round_ = np.sqrt(1.0 - heights**2)
        normals = np.stack(
            [round_[:, None] * np.cos(turn), round_[:, None] * np.sin(turn), heights[:, None] + 0.0 * turn], axis=2
        )
        grown = np.linalg.norm(normals @ inverse.T, axis=2) * abs(float(np.linalg.det(emitter.axes)))
        return float((weights[:, None] * grown).sum() * (2.0 * math.pi / _NODES))
    flat = float(np.linalg.norm(np.cross(x, y)))
    return math.pi * flat if light.kind == "disk" else 4.0 * flat


@cache
def _gauss() -> tuple[Floats, Floats]:
    """Gauss and Legendre's nodes and weights."""
    return np.polynomial.legendre.leggauss(_NODES)


def side(emitter: Emitter) -> Floats:
    """The unit normal (3,) of a rectangle or disk on the side that it shines to: that of its own -z."""
    x, y, z = emitter.axes
    normal = np.cross(x, y)
    normal = normal / np.linalg.norm(normal)
    return np.asarray(normal if normal @ z < 0.0 else -normal)


def resized(light: Light, factor: float, *, keep_power: bool) -> Light:
    """``light`` with a shape ``factor`` times as large: of the same power, or of the same radiance.

    Of a sun the sine of half its angle is ``factor`` times as large, and at most 1.
    """
    emitter = light.emitter
    if emitter is None or light.kind == "dome":
        return light
    if light.kind == "sun":
        half = math.asin(min(1.0, math.sin(min(emitter.half_angle, math.pi / 2.0)) * factor))
        made = replace(light, emitter=replace(emitter, half_angle=half))
    else:
        made = replace(light, emitter=replace(emitter, axes=emitter.axes * factor))
    return scaled(made, area(light) / area(made)) if keep_power else made


def scaled(light: Light, factor: float) -> Light:
    """``light`` with ``factor`` times its intensity."""
    r, g, b = light.intensity
    return replace(light, intensity=(r * factor, g * factor, b * factor))


def turned(light: Light, linear: Floats) -> Light:
    """``light`` whose shape's axes and direction, row vectors, are multiplied by ``linear`` (3, 3)."""
    direction = np.asarray(light.direction) @ linear
    x, y, z = (direction / np.linalg.norm(direction) + 0.0).tolist()
    emitter = light.emitter
    if emitter is not None:
        emitter = replace(emitter, axes=np.ascontiguousarray(emitter.axes @ linear))
    return replace(light, direction=(x, y, z), emitter=emitter)
