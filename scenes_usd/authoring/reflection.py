"""Materials with a highlight, a mirror or glass: a ``notabug:Reflection`` shader and what viewers show instead."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.scenes_usd.authoring.stage import Row
from notabug.scenes_usd.authoring.usda import block, number, vector


@dataclass(frozen=True, slots=True)
class Reflection:
    """The inputs of the shader; None: not authored here, a variant says it."""

    diffuse: Row | None = (0.0, 0.0, 0.0)
    specular: Row | None = (0.0, 0.0, 0.0)
    exponent: float | None = 1.0
    lobe: str | None = "phong"
    mirror: float = 0.0
    transmission: float = 0.0
    ior: float = 1.0


def reflection(name: str, said: Reflection) -> str:
    """A material that says ``said`` on outputs:notabug:surface, and something like it on outputs:surface."""
    path = f"/Scene/Materials/{name}"
    outputs = (
        f"token outputs:notabug:surface.connect = <{path}/Reflection.outputs:surface>\n"
        f"token outputs:surface.connect = <{path}/Surface.outputs:surface>"
    )
    return block(f'def Material "{name}"', outputs, _shader(said), _fallback(said))


def _shader(said: Reflection) -> str:
    lines = ['uniform token info:id = "notabug:Reflection"']
    if said.diffuse is not None:
        lines.append(f"color3f inputs:diffuseColor = {vector(said.diffuse)}")
    if said.specular is None or any(said.specular):
        if said.exponent is not None:
            lines.append(f"float inputs:exponent = {number(said.exponent)}")
        if said.lobe is not None:
            lines.append(f'token inputs:lobe = "{said.lobe}"')
        if said.specular is not None:
            lines.append(f"color3f inputs:specularColor = {vector(said.specular)}")
    if said.mirror:
        lines.append(f"color3f inputs:mirror = {vector((said.mirror,) * 3)}")
    if said.transmission:
        lines.append(f"float inputs:ior = {number(said.ior)}")
        lines.append(f"color3f inputs:transmission = {vector((said.transmission,) * 3)}")
    lines.append("token outputs:surface")
    return _as_shader("Reflection", lines)


def _fallback(said: Reflection) -> str:
    """What comes nearest in a UsdPreviewSurface; roughness as Walter et al. 2007 relate it to a Phong exponent."""
    lines = ['uniform token info:id = "UsdPreviewSurface"']
    if said.diffuse is not None:
        lines.append(f"color3f inputs:diffuseColor = {vector(said.diffuse)}")
    roughness = 0.0 if said.mirror or said.transmission else (2.0 / ((said.exponent or 32.0) + 2.0)) ** 0.25
    if said.transmission:
        lines += [f"float inputs:ior = {number(said.ior)}", f"float inputs:opacity = {number(1 - said.transmission)}"]
    shine = said.specular if said.specular is not None and any(said.specular) else (said.mirror,) * 3
    lines += [
        f"float inputs:roughness = {number(round(roughness, 3))}",
        f"color3f inputs:specularColor = {vector(min(each, 1.0) for each in shine)}",
        "int inputs:useSpecularWorkflow = 1",
        "token outputs:surface",
    ]
    return _as_shader("Surface", lines)


def _as_shader(name: str, lines: list[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f'def Shader "{name}"\n{{\n{body}\n}}'
