"""UsdLux lights to delta lights; whatever would make them soft, shaped or selective is refused."""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd

from notabug.scenes_usd.reader_values import (
    ORTHOGONAL,
    ROUNDED,
    Colour,
    check_colour,
    check_plain,
    fault,
    number,
    read,
    same,
    value,
    world_matrix,
)
from notabug.scenes_usd.scene import Floats, Light

_PLAIN = (  # attribute, the only value the contract can say, where the schema's own fallback may differ
    ("inputs:enableColorTemperature", False),
    ("inputs:diffuse", 1.0),
    ("inputs:specular", 1.0),
    ("inputs:shadow:enable", True),
    ("inputs:shadow:color", (0.0, 0.0, 0.0)),
    ("inputs:shadow:distance", -1.0),
    ("inputs:shaping:focus", 0.0),
)
_BRIGHTEST = 1e30  # pictures are float32
_LINKS = (
    "light:filters",
    "collection:lightLink:includes",
    "collection:lightLink:excludes",
    "collection:shadowLink:includes",
    "collection:shadowLink:excludes",
)


def read_point(prim: Usd.Prim) -> Light:
    """A SphereLight with treatAsPoint: radiant intensity I [W/sr].

    normalize on: I = intensity * 2^exposure * color / 4 at any radius; off: that times pi r^2 without the 1/4.
    """
    if not value(prim, "treatAsPoint", "flag", False):
        raise fault(prim, "treatAsPoint", "a sphere light with a size casts soft shadows", expected="true", got="false")
    matrix = world_matrix(prim)
    emitted = _emitted(prim)
    if value(prim, "inputs:normalize", "flag", False):
        factor = 0.25
    else:
        radius = number(prim, "inputs:radius", 0.5, low=0.0)
        if not _is_rigid(matrix):
            raise fault(
                prim, "xformOpOrder", "a scaled sphere light has no defined area", do="author inputs:normalize = true"
            )
        factor = math.pi * radius * radius
    x, y, z = matrix[3, :3].tolist()
    return Light(str(prim.GetPath()), "point", _times(emitted, factor), position=(x, y, z))


def read_distant(prim: Usd.Prim) -> Light:
    """A DistantLight of angle 0: irradiance intensity * 2^exposure * color [W/m^2] along the local -z axis."""
    angle = number(prim, "inputs:angle", 0.53)
    if not same(angle, 0.0):
        raise fault(
            prim, "inputs:angle", "a distant light with a size casts soft shadows", expected="0", got=f"{angle:g}"
        )
    axis = -world_matrix(prim)[2, :3]
    x, y, z = (axis / np.linalg.norm(axis) + 0.0).tolist()
    return Light(str(prim.GetPath()), "distant", _emitted(prim), direction=(x, y, z))


def _emitted(prim: Usd.Prim) -> Colour:
    """intensity * 2^exposure * color, after refusing all that a delta light cannot say."""
    for name, plain in _PLAIN:
        check_plain(prim, name, read(prim, name, prim.GetAttribute(name)), plain, "not supported")
    if number(prim, "inputs:shaping:cone:angle", 180.0) < 180.0 * (1.0 - ROUNDED):
        raise fault(prim, "inputs:shaping:cone:angle", "spot lights are not supported", expected="no ShapingAPI")
    if getattr(value(prim, "inputs:shaping:ies:file", "asset"), "path", ""):
        raise fault(prim, "inputs:shaping:ies:file", "light profiles are not supported", expected="no ShapingAPI")
    for name in _LINKS:
        relationship = prim.GetRelationship(name)
        if relationship and relationship.GetTargets():
            raise fault(prim, name, "light filters and linking are not supported", do="remove the targets")
    intensity = number(prim, "inputs:intensity", 1.0, low=0.0)
    exposure = number(prim, "inputs:exposure", 0.0, low=-1000.0, high=1000.0)
    colour = check_colour(prim, "inputs:color", value(prim, "inputs:color", "numbers", (1.0, 1.0, 1.0)), high=math.inf)
    emitted = _times(colour, intensity * 2.0**exposure)
    if max(emitted) > _BRIGHTEST:
        raise fault(prim, "inputs:exposure", "too bright", expected=f"at most {_BRIGHTEST:g}", got=f"{max(emitted):g}")
    return emitted


def _times(colour: Colour, factor: float) -> Colour:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def _is_rigid(matrix: Floats) -> bool:
    linear = matrix[:3, :3]
    return bool(np.allclose(linear @ linear.T, np.eye(3), rtol=0.0, atol=ORTHOGONAL))
