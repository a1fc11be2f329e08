"""UsdLux lights to Lights: points and distant ones, and those with a size; light profiles and filters are refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from pxr import Usd, UsdLux

from notabug.scenes_usd.emitters import area
from notabug.scenes_usd.framing import bounds_of
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.reader_dome import with_picture
from notabug.scenes_usd.reader_values import (
    ORTHOGONAL,
    ROUNDED,
    Colour,
    check_colour,
    check_plain,
    fault,
    number,
    opinion,
    read,
    same,
    value,
    where,
    world_matrix,
)
from notabug.scenes_usd.reading import DIRECT_ONLY, going_on, note, recovered, refuse
from notabug.scenes_usd.scene import Emitter, Floats, Light, Object, ShadowMap, Shaping

_PLAIN = (  # attribute, its type, the only value the contract can say, where the schema's own fallback may differ
    ("inputs:shadow:enable", "bool", True),
    ("inputs:shadow:color", "color3f", (0.0, 0.0, 0.0)),
    ("inputs:shadow:distance", "float", -1.0),
)
PENUMBRA = 0.1  # pixels: a narrower penumbra cannot be told from an edge
SHADED = 1e-3  # of the full irradiance: so far may a point in the light's place be off beside the terminator
_MAP = "notabug:shadowMap:"
_SHAPING = "inputs:shaping:"
FINEST_MAP = 16384.0  # texels along an edge: what graphics hardware has
_HORIZON = 2.0 / (3.0 * math.pi)  # irradiance of the half of a small disk that is above the horizon, over pi s^2, per s
_BRIGHTEST = 1e30  # pictures are float32
_FILTERS = "light:filters"


def read_light(prim: Usd.Prim, root: Path | None = None) -> Light:
    """The light ``prim``; spheres and distant lights as if they had no size: see ``with_size``.

    A dome's picture must be below ``root``, unless it is None.
    """
    if prim.IsA(UsdLux.SphereLight):
        return read_point(prim)
    if prim.IsA(UsdLux.DistantLight):
        return read_distant(prim)
    light = read_shape(prim, str(prim.GetTypeName()).removesuffix("_1").removesuffix("Light").lower())
    if light.kind != "dome" or light.emitter is None:
        return light
    emitter = light.emitter
    return replace(light, emitter=recovered(lambda: with_picture(prim, emitter, root), emitter))


def read_point(prim: Usd.Prim) -> Light:
    """A SphereLight as a point: radiant intensity I [W/sr].

    normalize on: I = intensity * 2^exposure * color / 4 at any radius; off: that times pi r^2 without the 1/4.
    """
    matrix = recovered(lambda: world_matrix(prim), np.eye(4))
    emitted = recovered(lambda: _emitted(prim), (1.0, 1.0, 1.0))
    radius = number(prim, "inputs:radius", 0.5, low=0.0)
    if value(prim, "inputs:normalize", "flag", False):
        factor = 0.25
    elif _is_rigid(matrix):
        factor = math.pi * radius * radius
    elif value(prim, "treatAsPoint", "flag", False):
        factor = math.pi * radius * radius
        refuse(
            fault(
                prim,
                "xformOpOrder",
                "a scaled sphere light that is a point has no defined area",
                do="author inputs:normalize = true",
                mends=_normalised(prim, matrix, radius),
            )
        )
    else:  # a quarter of the surface is what is seen of it on the average
        factor = 0.25 * area(_placed(prim, "sphere", matrix, radius)) if radius > 0.0 else 0.0
    x, y, z = matrix[3, :3].tolist()
    light = Light(
        str(prim.GetPath()), "point", _times(emitted, factor), position=(x, y, z), shadow_map=read_shadow_map(prim)
    )
    return _selective(prim, light, matrix)


def _normalised(prim: Usd.Prim, matrix: Floats, radius: float) -> tuple[Opinion, ...]:
    """The same light, normalised: 4 pi r^2 of its intensity, by the scale squared."""
    area = 4.0 * math.pi * radius * radius * abs(float(np.linalg.det(matrix[:3, :3]))) ** (2.0 / 3.0)
    bright = number(prim, "inputs:intensity", 1.0) * area
    said = opinion(prim, "inputs:normalize", "bool", True)
    return said + opinion(prim, "inputs:intensity", "float", bright, "the light with the area of its world space")


def with_size(prim: Usd.Prim, light: Light, objects: Sequence[Object], pixel: Callable[[Floats], Floats]) -> Light:
    """``light`` with the size that ``prim`` gives it, or as it is where no picture of ``objects`` would show that.

    ``pixel`` is the world size of a pixel at places (n, 3). A light of the angular radius s, seen from the farthest
    receiver, softens an edge of a shadow over at most 2 s times the distance of blocker and receiver, which the
    bounds' diagonal is not below, and shades by at most ``_HORIZON`` s of the full irradiance near the terminator,
    where part of it is below the horizon.
    """
    if light.kind == "point":
        name = "treatAsPoint"
        if value(prim, name, "flag", False):
            return light
        radius = number(prim, "inputs:radius", 0.5, low=0.0)
        size = radius * float(np.linalg.norm(world_matrix(prim)[:3, :3], axis=1).max())
    elif light.kind == "distant":
        name = "inputs:angle"
        angle = number(prim, name, 0.53)
        size = 0.0 if same(angle, 0.0) else math.radians(angle) / 2.0
    else:
        return light
    if not size > 0.0:
        return light
    if objects:
        low, high = bounds_of(objects)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        apparent = size
        if light.kind == "point":
            nearest = float(np.linalg.norm(np.clip(light.position, low, high) - np.asarray(light.position)))
            apparent = size / nearest if nearest > size else math.inf
        softened = 2.0 * apparent * float(np.linalg.norm(high - low)) / float(pixel(corners).min())
        if softened <= PENUMBRA and _HORIZON * apparent <= SHADED:
            note("approximated", where(prim, name), f"as a point: its penumbras are below {softened:.1g} pixel")
            return light
    return read_shape(prim, "sphere" if light.kind == "point" else "sun")


def read_shape(prim: Usd.Prim, kind: str) -> Light:
    """A light with a size of the ``kind`` that ``Light`` has: its radiance, and its shape in world space.

    UsdLux: the radiance is intensity * 2^exposure * color, with normalize divided by ``emitters.area``; a dome's never.
    """
    matrix = recovered(lambda: world_matrix(prim), np.eye(4))
    emitted = recovered(lambda: _emitted(prim), (1.0, 1.0, 1.0))
    light = _placed(prim, kind, matrix, number(prim, "inputs:radius", 0.5, low=0.0))
    emitter = light.emitter
    assert emitter is not None
    name = "inputs:texture:file"
    file = getattr(value(prim, name, "asset"), "path", "")
    if file and kind != "dome":
        none = opinion(prim, name, "asset", "")
        what = f"a texture on a {kind} light is not supported"
        refuse(fault(prim, name, what, expected="a constant colour, or a dome", mends=none))
    note("approximated", where(prim), f"{DIRECT_ONLY}: the light itself is not seen")
    normalized = kind != "dome" and bool(value(prim, "inputs:normalize", "flag", False))
    exposure = number(prim, "inputs:exposure", 0.0, low=-1000.0, high=1000.0)
    size = area(light)
    if not size > 0.0:
        gone = opinion(prim, "visibility", "token", "invisible")
        raise fault(prim, "", "a light without an area", expected="a size above 0", do="make it invisible", mends=gone)
    light = replace(
        light,
        intensity=_times(emitted, 1.0 / size if normalized else 1.0),
        emitter=replace(emitter, normalized=normalized, exposure=exposure),
    )
    return _selective(prim, light, matrix)


def _placed(prim: Usd.Prim, kind: str, matrix: Floats, radius: float) -> Light:
    """The light's shape alone."""
    scale = np.ones(3)
    half = 0.0
    if kind == "rect":
        scale[0] = number(prim, "inputs:width", 1.0, low=0.0) / 2.0
        scale[1] = number(prim, "inputs:height", 1.0, low=0.0) / 2.0
    elif kind == "disk":
        scale[:2] = radius
    elif kind == "sphere":
        scale[:] = radius
    elif kind == "cylinder":
        scale[:] = number(prim, "inputs:length", 1.0, low=0.0) / 2.0, radius, radius
    elif kind == "sun":
        half = min(math.radians(number(prim, "inputs:angle", 0.53, low=0.0)) / 2.0, math.pi)
    axes = np.ascontiguousarray(matrix[:3, :3] * scale[:, None])
    x, y, z = matrix[3, :3].tolist()
    made = Light(str(prim.GetPath()), cast(Any, kind), (1.0, 1.0, 1.0), position=(x, y, z), emitter=Emitter(axes, half))
    return replace(made, direction=_along(matrix))


def _along(matrix: Floats) -> tuple[float, float, float]:
    """Where the local -z axis points to."""
    axis = -matrix[2, :3]
    x, y, z = (axis / np.linalg.norm(axis) + 0.0).tolist()
    return x, y, z


def _selective(prim: Usd.Prim, light: Light, matrix: Floats) -> Light:
    """``light`` with the multipliers of UsdLux LightAPI and the beam of its ShapingAPI."""
    diffuse, specular = (number(prim, f"inputs:{name}", 1.0, low=0.0) for name in ("diffuse", "specular"))
    shaping = _shaping(prim, light.kind)
    if shaping is not None and light.kind == "point":
        light = replace(light, direction=_along(matrix))
    return replace(light, diffuse=diffuse, specular=specular, shaping=shaping)


def _shaping(prim: Usd.Prim, kind: str) -> Shaping | None:
    """The beam, or None where it changes nothing.

    Rectangles and disks shine to one side only, and the schema's own cone of 90 degrees is all of that; so it is of a
    light that has no place, on which exporters put the schema as well.
    """
    cone = min(number(prim, f"{_SHAPING}cone:angle", 180.0, low=0.0), 180.0)
    softness = min(max(number(prim, f"{_SHAPING}cone:softness", 0.0), 0.0), 1.0)
    focus = max(number(prim, f"{_SHAPING}focus", 0.0), 0.0)
    wide = 180.0 if kind in ("point", "sphere", "cylinder") else 90.0
    if cone >= wide * (1.0 - ROUNDED) and (softness == 0.0 or not prim.HasAPI(UsdLux.ShapingAPI)) and focus == 0.0:
        return None
    black = (0.0, 0.0, 0.0)
    found = value(prim, f"{_SHAPING}focusTint", "numbers", black)
    tint = recovered(lambda: check_colour(prim, f"{_SHAPING}focusTint", found, high=math.inf), black)
    if kind in ("dome", "distant", "sun"):
        name = f"{_SHAPING}cone:angle"
        wide_ = opinion(prim, name, "float", 180.0) + opinion(prim, f"{_SHAPING}focus", "float", 0.0)
        refuse(fault(prim, name, "a light without a place has no beam", expected="no ShapingAPI", mends=wide_))
        return None
    return Shaping(cone, softness, focus, tint)


def read_distant(prim: Usd.Prim) -> Light:
    """A DistantLight: irradiance intensity * 2^exposure * color [W/m^2] along the local -z axis.

    normalize off and an angle: that times pi sin(angle / 2)^2, as OpenUSD says.
    """
    axis = -recovered(lambda: world_matrix(prim), np.eye(4))[2, :3]
    x, y, z = (axis / np.linalg.norm(axis) + 0.0).tolist()
    emitted = _times(recovered(lambda: _emitted(prim), (1.0, 1.0, 1.0)), _cone(prim))
    light = Light(str(prim.GetPath()), "distant", emitted, direction=(x, y, z), shadow_map=read_shadow_map(prim))
    return _selective(prim, light, np.eye(4))


def read_shadow_map(prim: Usd.Prim) -> ShadowMap | None:
    """What the light says of shadow maps in our own attributes; None where it names no resolution."""
    resolution = number(prim, f"{_MAP}resolution", 0.0, low=0.0, high=FINEST_MAP)
    if resolution < 1.0:
        return None
    bias, normal = (number(prim, f"{_MAP}{name}", 0.0, low=0.0) for name in ("bias", "normalBias"))
    return ShadowMap(int(resolution), bias, normal)


def _cone(prim: Usd.Prim) -> float:
    """What a distant light's intensity is multiplied by for its irradiance: the solid angle, weighted by the cosine."""
    half = math.radians(number(prim, "inputs:angle", 0.53)) / 2.0
    if half <= 0.0 or value(prim, "inputs:normalize", "flag", False):
        return 1.0
    return math.pi * math.sin(min(half, math.pi / 2.0)) ** 2


def _emitted(prim: Usd.Prim) -> Colour:
    """intensity * 2^exposure * color, after refusing all that a light of the contract cannot say."""
    for name, kind, plain in _PLAIN:
        with going_on():
            found = read(prim, name, prim.GetAttribute(name))
            check_plain(prim, name, found, plain, "not supported", mends=opinion(prim, name, kind, plain))
    name = "inputs:shaping:ies:file"
    if getattr(value(prim, name, "asset"), "path", ""):
        none = opinion(prim, name, "asset", "")
        refuse(fault(prim, name, "light profiles are not supported", expected="no ShapingAPI", mends=none))
    relationship = prim.GetRelationship(_FILTERS)
    if relationship and relationship.GetTargets():
        none = opinion(prim, _FILTERS, "rel", [])
        refuse(fault(prim, _FILTERS, "light filters are not supported", do="remove the targets", mends=none))
    intensity = number(prim, "inputs:intensity", 1.0, low=0.0)
    exposure = number(prim, "inputs:exposure", 0.0, low=-1000.0, high=1000.0)
    plain_colour = (1.0, 1.0, 1.0)
    found = value(prim, "inputs:color", "numbers", plain_colour)
    colour = recovered(lambda: check_colour(prim, "inputs:color", found, high=math.inf), plain_colour)
    if value(prim, "inputs:enableColorTemperature", "flag", False):
        colour = _tinted(colour, number(prim, "inputs:colorTemperature", 6500.0, low=1000.0, high=10000.0))
    emitted = _times(colour, intensity * 2.0**exposure)
    if max(emitted) > _BRIGHTEST:
        raise fault(prim, "inputs:exposure", "too bright", expected=f"at most {_BRIGHTEST:g}", got=f"{max(emitted):g}")
    return emitted


def _tinted(colour: Colour, kelvin: float) -> Colour:
    """``colour`` times that of a black body of ``kelvin``, as OpenUSD itself gives it: of luminance 1."""
    black_body = UsdLux.BlackbodyTemperatureAsRgb(kelvin)
    r, g, b = (given * float(tint) for given, tint in zip(colour, black_body, strict=True))
    return r, g, b


def _times(colour: Colour, factor: float) -> Colour:
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def _is_rigid(matrix: Floats) -> bool:
    linear = matrix[:3, :3]
    return bool(np.allclose(linear @ linear.T, np.eye(3), rtol=0.0, atol=ORTHOGONAL))
