"""UsdShade materials to Material: UsdPreviewSurface as far as the contract goes, or a ``notabug:Reflection`` shader."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdShade

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.primvar import Places
from notabug.scenes_usd.reader_inputs import PREVIEW, Inputs
from notabug.scenes_usd.reader_preview import PREVIEW_INPUTS, preview_of
from notabug.scenes_usd.reader_primvar import Primvars, one_value
from notabug.scenes_usd.reader_texture import Coordinates, Textures
from notabug.scenes_usd.reader_values import (
    Colour,
    blamed,
    check_colour,
    check_number,
    checked,
    fault,
    integers,
    opinion,
    vectors_of,
    where,
)
from notabug.scenes_usd.reading import note, recovered, refuse
from notabug.scenes_usd.scene import Floats, Material

CONTEXT = "notabug"
REFLECTION = "notabug:Reflection"
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
GREY = (0.18, 0.18, 0.18)  # the diffuse colour that UsdPreviewSurface falls back to
_AS_GREY = "no material and no displayColor: grey 0.18 is drawn"
_AS_COLOUR = "no material: its displayColor is drawn as Lambertian"
_MOST_COLOURS = 64  # of the faces of one mesh: each becomes an object
_COLOUR_INPUTS = ("diffuseColor", "base_color", "baseColor", "diffuse_color", "basecolor", "diffuseReflectionColor")


class Materials:
    """The materials of a stage by first use: each bound material is read once and has an index."""

    def __init__(self, textures: Textures) -> None:
        self.found: list[Material] = []
        self.coordinates: list[Coordinates] = []  # where each one's texture is looked up
        self._index: dict[str, int] = {}
        self._textures = textures

    def bound_to(self, prim: Usd.Prim) -> int:
        """The index of the material bound to ``prim``; of none that of its display colour, or of the schema's grey."""
        with blamed(prim, "material:binding"):
            material, relationship = _bound(prim)
        if material:
            return self._once(material, prim)
        if relationship:
            refuse(_not_bound(prim, relationship))
        return self._plain(prim, told=bool(relationship))

    def _once(self, material: UsdShade.Material, prim: Usd.Prim) -> int:
        """The index of ``material``; one that looks at primvars is another one for each prim."""
        path = str(material.GetPath())
        own = f"{path}{str(prim.GetPath()).replace('/', '_')}"
        for known in (path, own):
            if known in self._index:
                return self._index[known]
        primvars = Primvars(prim)
        found = recovered(lambda: self._read(material, primvars), (Material(path, GREY), Coordinates()))
        return self._add(own, (replace(found[0], path=own), found[1])) if primvars.asked else self._add(path, found)

    def _add(self, path: str, found: tuple[Material, Coordinates]) -> int:
        self._index[path] = len(self.found)
        self.found.append(found[0])
        self.coordinates.append(found[1])
        return self._index[path]

    def _plain(self, prim: Usd.Prim, *, told: bool = False) -> int:
        """The material that a prim's displayColor and displayOpacity say, where they are constant.

        ``told``: that the prim has no material has been said already.
        """
        colour = recovered(lambda: one_value(prim, "primvars:displayColor", 3), None)
        clear = self.display_opacity(prim)
        if colour is None and clear == 1.0:
            if not told:
                note("approximated", where(prim, "material:binding"), _AS_GREY)
            return self.grey()
        name = "primvars:displayColor"
        said = recovered(lambda: check_colour(prim, name, GREY if colour is None else colour[0]), GREY)
        if colour is not None and not told:
            note("approximated", where(prim, "material:binding"), _AS_COLOUR)
        return self.coloured(str(prim.GetPath()), said, clear)

    def display_opacity(self, prim: Usd.Prim) -> float:
        """The one displayOpacity of ``prim``; 1 where it has none."""
        name = "primvars:displayOpacity"
        found = recovered(lambda: one_value(prim, name, 1), None)
        if found is None:
            return 1.0
        return recovered(lambda: check_number(prim, name, float(found[0, 0]), low=0.0, high=1.0), 1.0)

    def face_colours(self, prim: Usd.Prim) -> tuple[Floats, Places] | None:
        """The colours (k, 3) of a mesh without material, and which each face has; None unless each face says one."""
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("displayColor")
        if not primvar or str(primvar.GetInterpolation()) != "uniform" or not primvar.HasValue():
            return None
        material, relationship = _bound(prim)
        if material or relationship or primvar.IsIndexed():
            return None
        name = "primvars:displayColor"
        values = vectors_of(prim, name, primvar.GetAttr(), 3)
        if len(values) != len(integers(prim, "faceVertexCounts")):
            return None
        colours, which = np.unique(values, axis=0, return_inverse=True)
        if len(colours) < 2 or len(colours) > _MOST_COLOURS:
            return None
        for colour in colours.tolist():
            check_colour(prim, name, colour)
        note("approximated", where(prim, "material:binding"), _AS_COLOUR)
        return colours, which.reshape(-1)

    def grey(self) -> int:
        """The schema's fall-back material."""
        return self.coloured("", GREY, 1.0)

    def coloured(self, path: str, colour: Colour, opacity: float) -> int:
        """A Lambertian of the prim at ``path``'s own."""
        name = f"{path or '/Grey'}/displayColor"
        if name not in self._index:
            self._add(name, (Material(name, colour, opacity=opacity), Coordinates()))
        return self._index[name]

    def _read(self, material: UsdShade.Material, primvars: Primvars) -> tuple[Material, Coordinates]:
        own = material.GetSurfaceOutput(CONTEXT)
        if own and own.GetConnectedSources()[0]:
            return self._reflection(material, _surface(material, own, REFLECTION), primvars)
        displaced = material.GetDisplacementOutput()
        if displaced and displaced.GetConnectedSources()[0]:
            note("not read", where(material.GetPrim(), "outputs:displacement"), "displacement")
        return self._preview(material, _preview_surface(material), primvars)

    def _preview(
        self, material: UsdShade.Material, shader: UsdShade.Shader, primvars: Primvars
    ) -> tuple[Material, Coordinates]:
        inputs = Inputs(shader, PREVIEW_INPUTS, lenient=True, primvars=primvars)
        texture, diffuse, coordinates = self._diffuse(inputs)
        painted = coordinates if texture >= 0 else None
        preview, opacity, coordinates = preview_of(inputs, self._textures, painted)
        made = Material(
            str(material.GetPath()),
            diffuse,
            texture,
            opacity=opacity.value,
            preview=preview,
            placing=coordinates.placing,
            opacity_map=opacity.map,
            cutoff=opacity.cutoff,
        )
        return made, coordinates

    def _reflection(
        self, material: UsdShade.Material, shader: UsdShade.Shader, primvars: Primvars
    ) -> tuple[Material, Coordinates]:
        inputs = Inputs(shader, set(_REFLECTION_INPUTS), primvars=primvars)
        texture, diffuse, coordinates = self._diffuse(inputs)
        lobe = checked(inputs.prim, "inputs:lobe", inputs.constant("lobe", "phong"), "word")
        if lobe not in ("phong", "blinn"):
            refuse(fault(inputs.prim, "inputs:lobe", "unknown lobe", expected="phong or blinn", got=lobe))
        weighted = checked(inputs.prim, "inputs:cosineWeighted", inputs.constant("cosineWeighted", False), "flag")
        made = Material(
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
            placing=coordinates.placing,
        )
        return made, coordinates

    def _diffuse(self, inputs: Inputs) -> tuple[int, Colour, Coordinates]:
        """(texture index, or -1 and the constant colour), and where the texture is looked up."""
        return recovered(lambda: self._painted(inputs), (-1, GREY, Coordinates()))

    def _painted(self, inputs: Inputs) -> tuple[int, Colour, Coordinates]:
        name = "inputs:diffuseColor"
        source = inputs.shaded("diffuseColor")
        if source is not None:
            index, coordinates = self._textures.lookup(inputs.prim, name, source)
            return index, (1.0, 1.0, 1.0), coordinates
        return -1, check_colour(inputs.prim, name, inputs.constant("diffuseColor", GREY)), Coordinates()


def _preview_surface(material: UsdShade.Material) -> UsdShade.Shader:
    """The preview surface of ``material``, on the universal output or on another one's."""
    outputs = [each for each in material.GetSurfaceOutputs() if each.GetConnectedSources()[0]]
    universal = str(UsdShade.Tokens.surface)
    outputs.sort(key=lambda each: each.GetBaseName() != universal or ":" in str(each.GetBaseName()))
    if not outputs:
        raise fault(
            material.GetPrim(),
            "outputs:surface",
            "not connected",
            expected=f"a {PREVIEW} or {REFLECTION} shader",
            mends=_painted(material, None),
        )
    found = {str(each.GetFullName()): _shader(each) for each in outputs}
    ids = {name: _identity(shader) for name, shader in found.items()}
    for name, shader in found.items():
        if shader and ids[name] == PREVIEW:
            others = [f"{ids[other]} on {other}" for other in found if other != name]
            if others:
                what = f"its {PREVIEW} on {name} is drawn, not {', '.join(others)}"
                note("approximated", where(material.GetPrim()), what)
            return shader
    name = next(iter(found))
    raise fault(
        material.GetPrim(),
        name,
        "unsupported shader",
        expected=PREVIEW,
        got=", ".join(ids.values()),
        mends=_painted(material, found[name]),
    )


def _painted(material: UsdShade.Material, shader: UsdShade.Shader | None) -> tuple[Opinion, ...]:
    """The opinion that ``material`` is a Lambertian of the base colour that ``shader`` has as a constant, or grey."""
    colour = GREY
    for name in _COLOUR_INPUTS if shader else ():
        given = shader.GetInput(name) if shader else None
        found = given.Get() if given else None
        if isinstance(found, Gf.Vec3f):
            r, g, b = (min(max(float(part), 0.0), 1.0) for part in found)
            colour = r, g, b
            break
    return opinion(material.GetPrim(), "outputs:surface", "preview", colour, "a Lambertian in its place")


def _shader(output: UsdShade.Output) -> UsdShade.Shader:
    sources = UsdShade.Utils.GetValueProducingAttributes(output)
    return UsdShade.Shader(sources[0].GetPrim()) if sources else UsdShade.Shader()


def _surface(material: UsdShade.Material, output: UsdShade.Output, expected: str) -> UsdShade.Shader:
    """The shader behind a surface output, checked to be an ``expected`` one."""
    shader = _shader(output)
    if _identity(shader) != expected:
        name = str(output.GetFullName())
        raise fault(material.GetPrim(), name, "unsupported shader", expected=expected, got=_identity(shader))
    return shader


def _identity(shader: UsdShade.Shader) -> str:
    """What ``shader`` is: its id, or the file or source that it is written in, such as OmniPBR.mdl."""
    if not shader:
        return "no shader"
    if shader.GetShaderId():
        return str(shader.GetShaderId())
    for attribute in shader.GetPrim().GetAttributes():
        name = str(attribute.GetName())
        if name.startswith("info:") and name.endswith("sourceAsset") and attribute.Get():
            return str(attribute.Get().path)
    return f"a shader without an id, of {shader.GetImplementationSource()}"


def _not_bound(prim: Usd.Prim, relationship: Usd.Relationship) -> SceneError:
    """What is wrong with a binding of ``prim`` to no material: its target is not there, or is something else."""
    targets = relationship.GetTargets()
    found = prim.GetStage().GetPrimAtPath(targets[0].GetPrimPath()) if targets else None
    what = "bound to what is no material" if found or not targets else "bound to a material that does not exist"
    kind = f" (a {found.GetTypeName() or 'prim without a type'})" if found else ""
    return fault(
        prim,
        str(relationship.GetName()),
        what,
        expected="a Material prim",
        got=(", ".join(str(path) for path in targets) or "no path") + kind,
        do="name a Material there, or take the binding away",
        mends=opinion(prim, str(relationship.GetName()), "rel", []),
    )


def _bound(prim: Usd.Prim) -> tuple[UsdShade.Material, Usd.Relationship]:
    """The material that is bound to ``prim``, and by which relationship.

    Older exporters bind without applying MaterialBindingAPI: OpenUSD honours that.
    """
    found: tuple[UsdShade.Material, Usd.Relationship]
    found = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
    return found
