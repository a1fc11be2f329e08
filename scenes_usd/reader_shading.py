"""UsdShade materials to Material: UsdPreviewSurface as far as the contract goes, or a ``notabug:Reflection`` shader."""

from __future__ import annotations

import math
from typing import Any

from pxr import Usd, UsdShade

from notabug.scenes_usd.reader_texture import Textures
from notabug.scenes_usd.reader_values import TIME, Colour, check_colour, check_number, fault
from notabug.scenes_usd.scene import Material

CONTEXT = "notabug"
REFLECTION = "notabug:Reflection"
PREVIEW = "UsdPreviewSurface"

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
        prim = shader.GetPrim()
        known = {"diffuseColor", "opacity", *_PREVIEW_IDLE, *(name for name, _, _ in _PREVIEW_ONLY)}
        _refuse_unknown(shader, known)
        for name, fallback, only in _PREVIEW_ONLY:
            found = _constant(shader, name, fallback)
            same = tuple(found) == only if isinstance(only, tuple) else found == only
            if not same:
                raise fault(
                    prim,
                    f"inputs:{name}",
                    "the contract cannot say this",
                    expected=str(only),
                    got=str(found),
                    do=f"bind a {REFLECTION} shader on outputs:{CONTEXT}:surface for highlights, mirrors and glass",
                )
        texture, diffuse = self._diffuse(shader)
        opacity = check_number(prim, "inputs:opacity", _constant(shader, "opacity", 1.0), low=0.0, high=1.0)
        return Material(str(material.GetPath()), diffuse, texture, opacity=opacity)

    def _reflection(self, material: UsdShade.Material, shader: UsdShade.Shader) -> Material:
        prim = shader.GetPrim()
        _refuse_unknown(shader, set(_REFLECTION_INPUTS))
        texture, diffuse = self._diffuse(shader)
        lobe = str(_constant(shader, "lobe", "phong"))
        if lobe not in ("phong", "blinn"):
            raise fault(prim, "inputs:lobe", "unknown lobe", expected="phong or blinn", got=lobe)
        weighted = _constant(shader, "cosineWeighted", False)
        if not isinstance(weighted, bool):
            raise fault(prim, "inputs:cosineWeighted", "not a bool", got=repr(weighted))
        return Material(
            str(material.GetPath()),
            diffuse,
            texture,
            specular=_colour(shader, "specularColor", high=math.inf),
            exponent=_number(shader, "exponent", low=0.0),
            lobe="phong" if lobe == "phong" else "blinn",
            cosine_weighted=weighted,
            mirror=_colour(shader, "mirror"),
            transmission=_colour(shader, "transmission"),
            ior=_number(shader, "ior", low=1e-3),
        )

    def _diffuse(self, shader: UsdShade.Shader) -> tuple[int, Colour]:
        """(texture index, or -1 and the constant colour)."""
        fallback = (0.18, 0.18, 0.18)
        source = _source(shader, "diffuseColor")
        if source is not None and UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Output:
            return self._textures.index(shader.GetPrim(), "inputs:diffuseColor", source), (1.0, 1.0, 1.0)
        found = _constant(shader, "diffuseColor", fallback)
        return -1, check_colour(shader.GetPrim(), "inputs:diffuseColor", found)


def _surface(material: UsdShade.Material, output: UsdShade.Output, expected: str) -> UsdShade.Shader:
    """The shader behind a surface output, checked to be an ``expected`` one."""
    sources = UsdShade.Utils.GetValueProducingAttributes(output)
    shader = UsdShade.Shader(sources[0].GetPrim()) if sources else UsdShade.Shader()
    if not shader or str(shader.GetShaderId()) != expected:
        got = str(shader.GetShaderId()) if shader else "no shader"
        raise fault(material.GetPrim(), str(output.GetFullName()), "unsupported shader", expected=expected, got=got)
    return shader


def _refuse_unknown(shader: UsdShade.Shader, known: set[str]) -> None:
    for each in shader.GetInputs():
        name = str(each.GetBaseName())
        if name not in known:
            expected = f"one of {', '.join(sorted(known))}"
            raise fault(shader.GetPrim(), f"inputs:{name}", "unknown input", expected=expected)


def _source(shader: UsdShade.Shader, name: str) -> Any:
    """The attribute that gives the input its value, through connections and interfaces; None where nothing does."""
    given = shader.GetInput(name)
    sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
    if len(sources) > 1:
        raise fault(shader.GetPrim(), f"inputs:{name}", f"{len(sources)} connections", expected="one")
    return sources[0] if sources else None


def _constant(shader: UsdShade.Shader, name: str, fallback: Any) -> Any:
    """The value of an input that must not be connected to a shader."""
    source = _source(shader, name)
    if source is None:
        given = shader.GetInput(name)
        if given and given.HasConnectedSource():
            raise fault(shader.GetPrim(), f"inputs:{name}", "connected to something that has no value")
        return fallback
    if UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Output:
        raise fault(
            shader.GetPrim(),
            f"inputs:{name}",
            "only diffuseColor may be textured",
            got=str(source.GetPath()),
            do="use a constant",
        )
    if source.ValueMightBeTimeVarying():
        raise fault(shader.GetPrim(), f"inputs:{name}", "the value is animated", expected="one value")
    found = source.Get(TIME)
    return fallback if found is None else found


def _number(shader: UsdShade.Shader, name: str, *, low: float) -> float:
    return check_number(shader.GetPrim(), f"inputs:{name}", _constant(shader, name, 1.0), low=low)


def _colour(shader: UsdShade.Shader, name: str, *, high: float = 1.0) -> Colour:
    return check_colour(shader.GetPrim(), f"inputs:{name}", _constant(shader, name, (0.0, 0.0, 0.0)), high=high)
