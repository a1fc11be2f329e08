"""UsdLux lights to delta lights; whatever would make them soft, shaped or selective is refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from pxr import Usd, UsdLux

from notabug.scenes_usd.framing import bounds_of
from notabug.scenes_usd.opinion import Opinion
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
from notabug.scenes_usd.reading import going_on, note, recovered, refuse
from notabug.scenes_usd.scene import Floats, Light, Object, ShadowMap

_PLAIN = (  # attribute, its type, the only value the contract can say, where the schema's own fallback may differ
    ("inputs:diffuse", "float", 1.0),
    ("inputs:specular", "float", 1.0),
    ("inputs:shadow:enable", "bool", True),
    ("inputs:shadow:color", "color3f", (0.0, 0.0, 0.0)),
    ("inputs:shadow:distance", "float", -1.0),
    ("inputs:shaping:focus", "float", 0.0),
)
PENUMBRA = 0.1  # pixels: a narrower penumbra cannot be told from an edge
SHADED = 1e-3  # of the full irradiance: so far may a point in the light's place be off beside the terminator
_MAP = "notabug:shadowMap:"
FINEST_MAP = 16384.0  # texels along an edge: what graphics hardware has
_HORIZON = 2.0 / (3.0 * math.pi)  # irradiance of the half of a small disk that is above the horizon, over pi s^2, per s
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
    matrix = recovered(lambda: world_matrix(prim), np.eye(4))
    emitted = recovered(lambda: _emitted(prim), (1.0, 1.0, 1.0))
    radius = number(prim, "inputs:radius", 0.5, low=0.0)
    if value(prim, "inputs:normalize", "flag", False):
        factor = 0.25
    else:
        if not _is_rigid(matrix):
            refuse(
                fault(
                    prim,
                    "xformOpOrder",
                    "a scaled sphere light has no defined area",
                    do="author inputs:normalize = true",
                    mends=_normalised(prim, matrix, radius),
                )
            )
        factor = math.pi * radius * radius
    x, y, z = matrix[3, :3].tolist()
    return Light(
        str(prim.GetPath()), "point", _times(emitted, factor), position=(x, y, z), shadow_map=read_shadow_map(prim)
    )


def _normalised(prim: Usd.Prim, matrix: Floats, radius: float) -> tuple[Opinion, ...]:
    """The same light, normalised: 4 pi r^2 of its intensity, by the scale squared."""
    area = 4.0 * math.pi * radius * radius * abs(float(np.linalg.det(matrix[:3, :3]))) ** (2.0 / 3.0)
    bright = number(prim, "inputs:intensity", 1.0) * area
    said = opinion(prim, "inputs:normalize", "bool", True)
    return said + opinion(prim, "inputs:intensity", "float", bright, "the light with the area of its world space")


def check_size(prim: Usd.Prim, light: Light, objects: Sequence[Object], pixel: Callable[[Floats], Floats]) -> None:
    """Refuse a light whose size a picture of ``objects`` would show; note one that is as good as a point.

    ``pixel`` is the world size of a pixel at places (n, 3). A light of the angular radius s, seen from the farthest
    receiver, softens an edge of a shadow over at most 2 s times the distance of blocker and receiver, which the
    bounds' diagonal is not below, and shades by at most ``_HORIZON`` s of the full irradiance near the terminator,
    where part of it is below the horizon.
    """
    if light.kind == "point":
        name, kind = "treatAsPoint", "bool"
        if value(prim, name, "flag", False):
            return
        radius = number(prim, "inputs:radius", 0.5, low=0.0)
        size = radius * float(np.linalg.norm(world_matrix(prim)[:3, :3], axis=1).max())
        what, got = "a sphere light with a size casts soft shadows", "false"
    else:
        name, kind = "inputs:angle", "float"
        angle = number(prim, name, 0.53)
        if same(angle, 0.0):
            return
        size = math.radians(angle) / 2.0
        what, got = "a distant light with a size casts soft shadows", f"{angle:g}"
    if objects and size > 0.0:
        low, high = bounds_of(objects)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        if light.kind == "point":
            nearest = float(np.linalg.norm(np.clip(light.position, low, high) - np.asarray(light.position)))
            size = size / nearest if nearest > size else math.inf
        softened = 2.0 * size * float(np.linalg.norm(high - low)) / float(pixel(corners).min())
        if softened <= PENUMBRA and _HORIZON * size <= SHADED:
            note("approximated", where(prim, name), f"as a point: its penumbras are below {softened:.1g} pixel")
            return
    elif size == 0.0:
        return
    point = opinion(prim, name, kind, True if light.kind == "point" else 0.0)
    if light.kind == "distant" and (factor := _cone(prim)) != 1.0:
        dimmed = number(prim, "inputs:intensity", 1.0) * factor
        point += opinion(prim, "inputs:intensity", "float", dimmed, "the irradiance of the light with its angle")
    expected = "true" if light.kind == "point" else "0"
    refuse(fault(prim, name, what, expected=expected, got=got, mends=point))


def read_distant(prim: Usd.Prim) -> Light:
    """A DistantLight: irradiance intensity * 2^exposure * color [W/m^2] along the local -z axis.

    normalize off and an angle: that times pi sin(angle / 2)^2, as OpenUSD says.
    """
    axis = -recovered(lambda: world_matrix(prim), np.eye(4))[2, :3]
    x, y, z = (axis / np.linalg.norm(axis) + 0.0).tolist()
    emitted = _times(recovered(lambda: _emitted(prim), (1.0, 1.0, 1.0)), _cone(prim))
    return Light(str(prim.GetPath()), "distant", emitted, direction=(x, y, z), shadow_map=read_shadow_map(prim))


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
    """intensity * 2^exposure * color, after refusing all that a delta light cannot say."""
    for name, kind, plain in _PLAIN:
        with going_on():
            found = read(prim, name, prim.GetAttribute(name))
            check_plain(prim, name, found, plain, "not supported", mends=opinion(prim, name, kind, plain))
    name = "inputs:shaping:cone:angle"
    if number(prim, name, 180.0) < 180.0 * (1.0 - ROUNDED):
        wide = opinion(prim, name, "float", 180.0)
        refuse(fault(prim, name, "spot lights are not supported", expected="no ShapingAPI", mends=wide))
    name = "inputs:shaping:ies:file"
    if getattr(value(prim, name, "asset"), "path", ""):
        none = opinion(prim, name, "asset", "")
        refuse(fault(prim, name, "light profiles are not supported", expected="no ShapingAPI", mends=none))
    for name in _LINKS:
        relationship = prim.GetRelationship(name)
        if relationship and relationship.GetTargets():
            none = opinion(prim, name, "rel", [])
            do = "remove the targets"
            refuse(fault(prim, name, "light filters and linking are not supported", do=do, mends=none))
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
