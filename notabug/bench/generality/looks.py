"""Materials and textures of random scenes, as text of a stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring.usda import block, number, vector

LARGEST = 24  # texels along a side of a texture


@dataclass(frozen=True, slots=True)
class Look:
    """A material: its name and its text; ``texture`` is the file that it shows, or ""."""

    name: str
    text: str
    texture: str = ""


def colour(rng: np.random.Generator, low: float, high: float) -> tuple[float, float, float]:
    r, g, b = (round(float(each), 4) for each in rng.uniform(low, high, 3))
    return r, g, b


def grey(rng: np.random.Generator, low: float, high: float) -> tuple[float, float, float]:
    value = round(float(rng.uniform(low, high)), 4)
    return value, value, value


def picture(rng: np.random.Generator) -> npt.NDArray[np.uint8]:
    """A texture of random texels, or of random blocks."""
    height, width = (int(side) for side in rng.integers(4, LARGEST + 1, 2))
    if rng.uniform() < 0.5:
        return rng.integers(20, 256, (height, width, 3)).astype(np.uint8)
    coarse = rng.integers(20, 256, (-(-height // 3), -(-width // 3), 3))
    return np.kron(coarse, np.ones((3, 3, 1)))[:height, :width].astype(np.uint8)


def look(
    rng: np.random.Generator, name: str, kind: str, *, wrap: str = "clamp", colours: str = "raw", file: str = ""
) -> Look:
    """A random material of the ``kind`` that a deck names: lambert, textured, phong, blinn, mirror, glass, opacity."""
    albedo = colour(rng, 0.2, 0.9)
    if kind in ("lambert", "opacity"):
        opacity = round(float(rng.uniform(0.25, 0.85)), 4) if kind == "opacity" else 1.0
        return Look(name, _preview(name, f"color3f inputs:diffuseColor = {vector(albedo)}", opacity))
    if kind == "textured":
        shown = f"color3f inputs:diffuseColor.connect = <{_path(name)}/Texture.outputs:rgb>"
        if rng.uniform() < 0.3:  # beside a highlight
            lines = [shown, *_shine(rng, "phong" if rng.uniform() < 0.5 else "blinn")]
            return Look(name, _reflection(name, lines, _texture(name, file, wrap, colours)), file)
        return Look(name, _preview(name, shown, 1.0, _texture(name, file, wrap, colours)), file)
    if kind in ("phong", "blinn"):
        lines = [f"color3f inputs:diffuseColor = {vector(albedo)}", *_shine(rng, kind)]
        return Look(name, _reflection(name, lines))
    if kind == "mirror":
        dim = tuple(round(0.5 * each, 4) for each in albedo) if rng.uniform() < 0.7 else (0.0, 0.0, 0.0)
        image = colour(rng, 0.4, 0.9) if rng.uniform() < 0.4 else grey(rng, 0.4, 0.9)
        lines = [f"color3f inputs:diffuseColor = {vector(dim)}", f"color3f inputs:mirror = {vector(image)}"]
        return Look(name, _reflection(name, lines))
    through = colour(rng, 0.6, 0.95) if rng.uniform() < 0.4 else grey(rng, 0.7, 0.95)
    lines = [
        "color3f inputs:diffuseColor = (0, 0, 0)",
        f"color3f inputs:transmission = {vector(through)}",
        f"float inputs:ior = {number(float(rng.uniform(1.1, 1.7)))}",
    ]
    return Look(name, _reflection(name, lines))


def _shine(rng: np.random.Generator, lobe: str) -> list[str]:
    strength = colour(rng, 0.2, 1.0) if rng.uniform() < 0.3 else grey(rng, 0.2, 1.0)
    exponent = float(np.round(10.0 ** rng.uniform(0.5, 2.2), 2))
    lines = [f"color3f inputs:specularColor = {vector(strength)}", f"float inputs:exponent = {number(exponent)}"]
    lines.append(f'token inputs:lobe = "{lobe}"')
    return lines + (["bool inputs:cosineWeighted = 1"] if rng.uniform() < 0.15 else [])


def _path(name: str) -> str:
    return f"/Scene/Materials/{name}"


def _preview(name: str, albedo: str, opacity: float, *parts: str) -> str:
    lines = [
        'uniform token info:id = "UsdPreviewSurface"',
        albedo,
        "float inputs:metallic = 0",
        *([f"float inputs:opacity = {number(opacity)}"] if opacity < 1.0 else []),
        "color3f inputs:specularColor = (0, 0, 0)",
        "int inputs:useSpecularWorkflow = 1",
        "token outputs:surface",
    ]
    bound = f"token outputs:surface.connect = <{_path(name)}/Surface.outputs:surface>"
    return block(f'def Material "{name}"', bound, block('def Shader "Surface"', "\n".join(lines)), *parts)


def _reflection(name: str, lines: list[str], *parts: str) -> str:
    body = ['uniform token info:id = "notabug:Reflection"', *lines, "token outputs:surface"]
    bound = f"token outputs:notabug:surface.connect = <{_path(name)}/Reflection.outputs:surface>"
    return block(f'def Material "{name}"', bound, block('def Shader "Reflection"', "\n".join(body)), *parts)


def _texture(name: str, file: str, wrap: str, colours: str) -> str:
    reader = block(
        'def Shader "Coordinates"',
        'uniform token info:id = "UsdPrimvarReader_float2"\nstring inputs:varname = "st"\nfloat2 outputs:result',
    )
    shader = block(
        'def Shader "Texture"',
        'uniform token info:id = "UsdUVTexture"\n'
        f"asset inputs:file = @./{file}@\n"
        f'token inputs:sourceColorSpace = "{colours}"\n'
        f"float2 inputs:st.connect = <{_path(name)}/Coordinates.outputs:result>\n"
        f'token inputs:wrapS = "{wrap}"\n'
        f'token inputs:wrapT = "{wrap}"\n'
        "float3 outputs:rgb",
    )
    return f"{shader}\n\n{reader}"
