"""Lights of exports as text: of every shape, with a size, whose strength is said in one of UsdLux's ways."""

from __future__ import annotations

import math

import numpy as np

from notabug.bench.generality.features.decks import Features
from notabug.bench.generality.looks import colour, picture
from notabug.bench.generality.placing import matrix_op
from notabug.bench.generality.shapes import Floats
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.usda import block, number, vector
from notabug.scenes_usd.framing import direction, look_at

LIT = 3.0  # W/m^2 that all lights together give about, face on at the middle
UP = np.array([0.0, 1.0, 0.0])


def lights(rng: np.random.Generator, what: Features, middle: Floats, near: float, eye: float) -> tuple[list[str], dict[str, bytes]]:
    """The lights as text, and the pictures of domes by their files' names.

    ``near`` is half the distance of the camera, whose azimuth is ``eye`` degrees; ``middle`` is what it looks at.
    """
    kinds = [what.light] + ([what.second_light] if what.second_light != "none" else [])
    texts, files = list[str](), dict[str, bytes]()
    for k, kind in enumerate(kinds):
        side = eye + float(rng.uniform(-110.0, 110.0))
        towards = direction(side, float(rng.uniform(25.0, 80.0)))
        away = near * float(rng.uniform(1.5, 3.0))
        power = LIT / len(kinds) * float(rng.uniform(0.7, 1.2))
        text, made = _light(rng, what, f"Light{k}", kind, middle, towards, away, power)
        texts.append(text)
        files |= made
    return texts, files


def _light(
    rng: np.random.Generator,
    what: Features,
    name: str,
    kind: str,
    middle: Floats,
    towards: Floats,
    away: float,
    power: float,
) -> tuple[str, dict[str, bytes]]:
    lines, files = [], dict[str, bytes]()
    scale = np.ones(3)
    if kind in ("sphere", "rect", "disk", "cylinder") and what.light_scale != "no":
        scale = np.full(3, float(rng.uniform(0.5, 1.6)))
        if what.light_scale == "uneven":
            scale = scale * rng.uniform(0.6, 1.4, 3)
            if kind in ("sphere", "cylinder"):  # Mitsuba has no ellipsoids that shine
                scale = np.full(3, scale[0])
    where = look_at(middle + away * towards, middle, UP)
    if kind in ("sphere", "point"):
        radius = 0.0 if kind == "point" else away * float(rng.uniform(0.1, 0.35))
        lines += [f"float inputs:radius = {number(radius)}"] + (["bool treatAsPoint = 1"] if kind == "point" else [])
        area = 4 * math.pi * max(radius, 1e-3) ** 2
        seen = math.pi * radius**2
    elif kind == "rect":
        width, height = away * float(rng.uniform(0.2, 0.8)), away * float(rng.uniform(0.2, 0.8))
        lines += [f"float inputs:width = {number(width)}", f"float inputs:height = {number(height)}"]
        area = seen = width * height
    elif kind == "disk":
        radius = away * float(rng.uniform(0.15, 0.4))
        lines += [f"float inputs:radius = {number(radius)}"]
        area = seen = math.pi * radius**2
    elif kind == "cylinder":
        radius, length = away * float(rng.uniform(0.05, 0.15)), away * float(rng.uniform(0.3, 0.9))
        lines += [f"float inputs:radius = {number(radius)}", f"float inputs:length = {number(length)}"]
        area, seen = 2 * math.pi * radius * length, 2 * radius * length
    else:
        area = seen = 1.0
    scale_area = float(scale[0] * scale[1])
    if kind in ("sun", "distant"):
        angle = 0.0 if kind == "distant" else float(rng.uniform(1.0, 12.0))
        lines.append(f"float inputs:angle = {number(angle)}")
        normalised = kind == "distant" or what.normalised == "yes"
        solid = math.pi * math.sin(math.radians(angle / 2)) ** 2
        strength = power if normalised else power / solid
    elif kind in ("dome", "sky"):
        normalised = False
        strength = power / math.pi
    elif kind == "point":
        normalised = True
        strength = 4.0 * power * away**2
    else:
        normalised = what.normalised == "yes"
        strength = power * away**2 / (seen * scale_area)
        if normalised:
            strength *= area * scale_area
    if normalised:
        lines.append("bool inputs:normalize = 1")
    lines += _strength(rng, what.strength if name == "Light0" else "intensity", strength)
    if kind == "sky":
        files[f"{name}.png"] = png(picture(rng))
        lines += [f"asset inputs:texture:file = @./{name}.png@", 'token inputs:texture:format = "latlong"']
    if kind in ("dome", "sky"):
        lines += [f"float xformOp:rotateY = {number(float(rng.uniform(0, 360)))}"]
        lines += ['uniform token[] xformOpOrder = ["xformOp:rotateY"]']
    else:
        where[:3, :3] = np.diag(scale) @ where[:3, :3]
        lines.append(matrix_op(where))
    schema = {"point": "Sphere", "sun": "Distant", "sky": "Dome"}.get(kind, kind.capitalize())
    return block(f'def {schema}Light "{name}"', "\n".join(lines)), files


def _strength(rng: np.random.Generator, how: str, strength: float) -> list[str]:
    """``strength`` as intensity alone, with an exposure, a colour, or a colour temperature."""
    if how == "exposure":
        stops = int(rng.integers(-4, 9))
        return [f"float inputs:exposure = {stops}", f"float inputs:intensity = {number(strength / 2.0**stops)}"]
    lines = [f"float inputs:intensity = {number(strength)}"]
    if how == "colour":
        lines.append(f"color3f inputs:color = {vector(colour(rng, 0.5, 1.0))}")
    if how == "temperature":
        kelvin = round(float(rng.uniform(2500.0, 9000.0)))
        lines += ["bool inputs:enableColorTemperature = 1", f"float inputs:colorTemperature = {kelvin}"]
    return lines
