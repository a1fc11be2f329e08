"""UsdShade materials to Material: UsdPreviewSurface as far as the contract goes, or a ``notabug:Reflection`` shader."""

from __future__ import annotations

import math
from typing import Any

from pxr import Usd, UsdShade

from notabug.scenes_usd.reader_texture import Textures
from notabug.scenes_usd.reader_values import (
    Colour,
    blamed,
    check_colour,
    check_number,
    check_plain,
    checked,
    fault,
    read,
)
from notabug.scenes_usd.scene import Material

CONTEXT = "notabug"
REFLECTION = "notabug:Reflection"
PREVIEW = "UsdPreviewSurface"
# Of an exponent: the cosine of double arithmetic is off by some 4e-16, which by then moves the highlight by 0.04 %.
SHARPEST = 1e12

_REFLECTION_INPUTS = (
    "diffuseColor",
    "specularColor",
    "exponent",
    "lobe",
    "cosineWeighted",
    "mirror",
    "transmission",
    "ior",
)
_PREVIEW_ONLY = (  # input, its schema's fallback, the only value the contract can say
    ("emissiveColor", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("useSpecularWorkflow", 0, 1),
    ("specularColor", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ("metallic", 0.0, 0.0),
    ("clearcoat", 0.0, 0.0),
    ("opacityThreshold", 0.0, 0.0),
    ("normal", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    ("displacement", 0.0, 0.0),
)
_PREVIEW_IDLE = ("roughness", "clearcoatRoughness", "ior", "occlusion", "opacityMode")  # without effect on a Lambertian


class Materials:
    """The materials of a stage by first use: each bound material is read once and has an index."""

    def __init__(self, textures: Textures) -> None:
        self.found: list[Material] = []
        self._index: dict[str, int] = {}
        self._textures = textures

    def bound_to(self, prim: Usd.Prim) -> int:
        """The index of the material bound to ``prim``; raises SceneError where there is none."""
        with blamed(prim, "material:binding"):
            material, relationship = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
        if not material:
            raise fault(
                prim,
                "material:binding",
                f"bound to {relationship.GetTargets()}" if relationship else "no material is bound",
                expected="a Material prim",
                do="apply MaterialBindingAPI and author rel material:binding",
            )
        path = str(material.GetPath())
        if path not in self._index:
            self._index[path] = len(self.found)
            self.found.append(self._read(material))
        return self._index[path]

    def _read(self, material: UsdShade.Material) -> Material:
        own = material.GetSurfaceOutput(CONTEXT)
        if own and own.GetConnectedSources()[0]:
            return self._reflection(material, _surface(material, own, REFLECTION))
        universal = material.GetSurfaceOutput()
        if not universal or not universal.GetConnectedSources()[0]:
            raise fault(
                material.GetPrim(), "outputs:surface", "not connected", expected=f"a {PREVIEW} or {REFLECTION} shader"
            )
        return self._preview(material, _surface(material, universal, PREVIEW))

    def _preview(self, material: UsdShade.Material, shader: UsdShade.Shader) -> Material:
        known = {"diffuseColor", "opacity", *_PREVIEW_IDLE, *(name for name, _, _ in _PREVIEW_ONLY)}
        inputs = Inputs(shader, known)
        for name, fallback, only in _PREVIEW_ONLY:
            check_plain(
                inputs.prim,
                f"inputs:{name}",
                inputs.constant(name, fallback),
                only,
                "the contract cannot say this",
                do=f"bind a {REFLECTION} shader on outputs:{CONTEXT}:surface for highlights, mirrors and glass",
            )
        texture, diffuse = self._diffuse(inputs)
        opacity = check_number(inputs.prim, "inputs:opacity", inputs.constant("opacity", 1.0), low=0.0, high=1.0)
        return Material(str(material.GetPath()), diffuse, texture, opacity=opacity)

    def _reflection(self, material: UsdShade.Material, shader: UsdShade.Shader) -> Material:
        inputs = Inputs(shader, set(_REFLECTION_INPUTS))
        texture, diffuse = self._diffuse(inputs)
        lobe = checked(inputs.prim, "inputs:lobe", inputs.constant("lobe", "phong"), "word")
        if lobe not in ("phong", "blinn"):
            raise fault(inputs.prim, "inputs:lobe", "unknown lobe", expected="phong or blinn", got=lobe)
        weighted = checked(inputs.prim, "inputs:cosineWeighted", inputs.constant("cosineWeighted", False), "flag")
        return Material(
            str(material.GetPath()),
            diffuse,
            texture,
            specular=inputs.colour("specularColor", high=math.inf),
            exponent=inputs.number("exponent", low=0.0, high=SHARPEST),
            lobe="phong" if lobe == "phong" else "blinn",
            cosine_weighted=weighted,
            mirror=inputs.colour("mirror"),
            transmission=inputs.colour("transmission"),
            ior=inputs.number("ior", low=1e-3),
        )

    def _diffuse(self, inputs: Inputs) -> tuple[int, Colour]:
        """(texture index, or -1 and the constant colour)."""
        fallback = (0.18, 0.18, 0.18)
        source = inputs.source("diffuseColor")
        if source is not None and UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Output:
            return self._textures.index(inputs.prim, "inputs:diffuseColor", source), (1.0, 1.0, 1.0)
        found = inputs.constant("diffuseColor", fallback)
        return -1, check_colour(inputs.prim, "inputs:diffuseColor", found)


def _surface(material: UsdShade.Material, output: UsdShade.Output, expected: str) -> UsdShade.Shader:
    """The shader behind a surface output, checked to be an ``expected`` one."""
    sources = UsdShade.Utils.GetValueProducingAttributes(output)
    shader = UsdShade.Shader(sources[0].GetPrim()) if sources else UsdShade.Shader()
    if not shader or str(shader.GetShaderId()) != expected:
        got = str(shader.GetShaderId()) if shader else "no shader"
        raise fault(material.GetPrim(), str(output.GetFullName()), "unsupported shader", expected=expected, got=got)
    return shader


class Inputs:
    """The inputs of a shader that are authored, by name; raises SceneError for one that is not ``known``."""

    def __init__(self, shader: UsdShade.Shader, known: set[str]) -> None:
        self.prim = shader.GetPrim()
        self._authored = {str(each.GetBaseName()): each for each in shader.GetInputs()}
        for name in self._authored:
            if name not in known:
                expected = f"one of {', '.join(sorted(known))}"
                raise fault(self.prim, f"inputs:{name}", "unknown input", expected=expected)

    def source(self, name: str) -> Any:
        """The attribute that gives the input its value, through connections and interfaces; None where nothing does."""
        given = self._authored.get(name)
        sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
        if len(sources) > 1:
            raise fault(self.prim, f"inputs:{name}", f"{len(sources)} connections", expected="one")
        return sources[0] if sources else None

    def constant(self, name: str, fallback: Any) -> Any:
        """The value of an input that must not be connected to a shader."""
        source = self.source(name)
        if source is None:
            if name in self._authored and self._authored[name].HasConnectedSource():
                raise fault(self.prim, f"inputs:{name}", "connected to something that has no value")
            return fallback
        if UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Output:
            raise fault(
                self.prim,
                f"inputs:{name}",
                "only diffuseColor may be textured",
                got=str(source.GetPath()),
                do="use a constant",
            )
        found = read(self.prim, f"inputs:{name}", source)
        return fallback if found is None else found

    def number(self, name: str, *, low: float, high: float = math.inf) -> float:
        return check_number(self.prim, f"inputs:{name}", self.constant(name, 1.0), low=low, high=high)

    def colour(self, name: str, *, high: float = 1.0) -> Colour:
        return check_colour(self.prim, f"inputs:{name}", self.constant(name, (0.0, 0.0, 0.0)), high=high)
