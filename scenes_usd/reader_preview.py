"""UsdPreviewSurface beyond a diffuse colour: its workflow, lobes, emission and maps, as its specification has them.

One reading is the contract's own: in the specular workflow a black ``specularColor``, and nothing that shines beside
it, is Lambert's surface. The specification would add a reflection that is white at grazing angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.opinion import Value
from notabug.scenes_usd.reader_inputs import Inputs
from notabug.scenes_usd.reader_texture import Coordinates, Textures, Use
from notabug.scenes_usd.reader_values import (
    Colour,
    check_colour,
    check_number,
    check_plain,
    checked,
    fault,
    opinion,
    same,
    where,
)
from notabug.scenes_usd.reading import DIRECT_ONLY, going_on, note, recovered, refuse
from notabug.scenes_usd.scene import Preview

_NUMBERS = {  # input, its schema's fallback, the most it may be
    "metallic": (0.0, 1.0),
    "roughness": (0.5, 1.0),
    "ior": (1.5, math.inf),
    "clearcoat": (0.0, 1.0),
    "clearcoatRoughness": (0.01, 1.0),
}
PREVIEW_INPUTS = {
    *_NUMBERS,
    *("diffuseColor", "emissiveColor", "useSpecularWorkflow", "specularColor", "normal", "displacement"),
    *("opacity", "opacityThreshold", "opacityMode", "occlusion"),
}
NARROW = 0.05
"""A roughness below which a highlight is narrower than a pixel of a usual picture: 0.05 is an angle of 0.14 degrees."""
_BLACK = (0.0, 0.0, 0.0)
_UP = (0.0, 0.0, 1.0)
_DIRECT = f"{DIRECT_ONLY}: other surfaces are not seen in it, and what it emits lights nothing"


@dataclass(slots=True)
class _Reader:
    """The inputs of one shader; ``coordinates`` are those of its maps, once one is found."""

    inputs: Inputs
    textures: Textures
    coordinates: Coordinates
    mapped: bool

    def number(self, name: str) -> float:
        """A number that is constant."""
        fallback, high = _NUMBERS[name]
        prim, attribute = self.inputs.prim, f"inputs:{name}"
        mends = opinion(prim, attribute, "float", fallback)
        found = recovered(
            lambda: check_number(prim, attribute, self.inputs.constant(name, fallback, mends), low=0.0, high=high),
            fallback,
        )
        return 0.0 if same(found, 0.0) else found

    def colour(self, name: str, high: float) -> Colour:
        attribute = f"inputs:{name}"
        mends = opinion(self.inputs.prim, attribute, "color3f", _BLACK)
        found = recovered(
            lambda: check_colour(self.inputs.prim, attribute, self.inputs.constant(name, _BLACK, mends), high=high),
            _BLACK,
        )
        return _BLACK if all(same(part, 0.0) for part in found) else found

    def map(self, name: str, use: Use, kind: str, plain: Value) -> int:
        """The texture that the input shows, or -1; where it cannot be shown, ``plain`` of the type ``kind`` would."""
        source = self.inputs.shaded(name)
        if source is None:
            return -1
        attribute = f"inputs:{name}"
        try:
            index, coordinates = self.textures.lookup(self.inputs.prim, attribute, source, use)
            if self.mapped and not coordinates.same(self.coordinates):
                raise fault(
                    self.inputs.prim,
                    attribute,
                    "looked up elsewhere than the material's other maps",
                    expected=f"the coordinates {self.coordinates.name!r}, moved alike",
                    got=f"{coordinates.name!r}, moved otherwise"
                    if coordinates.name == self.coordinates.name
                    else repr(coordinates.name),
                    do="use one primvar and one UsdTransform2d for all maps of a material",
                )
        except SceneError as error:
            error.mends = opinion(self.inputs.prim, attribute, kind, plain, "its map is not read")
            refuse(error)
            return -1
        self.coordinates, self.mapped = coordinates, True
        return index


@dataclass(frozen=True, slots=True)
class Opacity:
    """A shader's opacity: a constant, or a map, an index of a texture, and the cutoff that cuts it, or 0."""

    value: float = 1.0
    map: int = -1
    cutoff: float = 0.0

    @property
    def fades(self) -> bool:
        """Whether the surface may be neither whole nor gone."""
        return 0.0 < self.value < 1.0 or (self.map >= 0 and not self.cutoff)


def preview_of(
    inputs: Inputs, textures: Textures, painted: Coordinates | None
) -> tuple[Preview | None, Opacity, Coordinates]:
    """What the shader adds to its diffuse colour, None for Lambert's surface, and where its maps are looked up.

    ``painted``: where its diffuse colour is looked up, None where that is constant.
    """
    reader = _Reader(inputs, textures, painted or Coordinates(), mapped=painted is not None)
    opacity = _opacity(reader)
    found = _beside_diffuse(reader, opacity)
    return found, opacity, reader.coordinates


def _opacity(reader: _Reader) -> Opacity:
    inputs = reader.inputs
    prim, name = inputs.prim, "inputs:opacityThreshold"
    cutoff = recovered(lambda: check_number(prim, name, inputs.constant("opacityThreshold", 0.0)), 0.0)
    if inputs.shaded("opacity") is not None:
        index = reader.map("opacity", "number", "float", 1.0)
        return Opacity(map=index, cutoff=max(cutoff, 0.0)) if index >= 0 else Opacity()
    solid = opinion(prim, "inputs:opacity", "float", 1.0)
    value = recovered(
        lambda: check_number(prim, "inputs:opacity", inputs.constant("opacity", 1.0, solid), low=0.0, high=1.0), 1.0
    )
    if cutoff > 0.0:  # a mask: what is below it is cut, the rest is opaque
        value = 1.0 if value >= cutoff else 0.0
    return Opacity(value)


def _beside_diffuse(reader: _Reader, opacity: Opacity) -> Preview | None:
    """What the shader adds to its diffuse colour, None for Lambert's surface."""
    inputs = reader.inputs
    for name, kind, plain in (("displacement", "float", 0.0), ("normal", "normal3f", _UP)):
        if name == "normal" and inputs.shaded(name) is not None:
            continue
        mends = opinion(inputs.prim, f"inputs:{name}", kind, plain)
        with going_on():
            check_plain(
                inputs.prim,
                f"inputs:{name}",
                inputs.constant(name, plain, mends),
                plain,
                "not read: displacement" if name == "displacement" else "only a map says normals",
                do="notabug adapt leaves it out",
                mends=mends,
            )
    emits = reader.map("emissiveColor", "light", "color3f", _BLACK)
    emission = _BLACK if emits >= 0 or inputs.shaded("emissiveColor") else reader.colour("emissiveColor", math.inf)
    normals = reader.map("normal", "normal", "normal3f", _UP)
    found = _lobes(reader, more=emits >= 0 or normals >= 0 or any(emission))
    found = replace(found, emission=emission, emission_map=emits, normal_map=normals)
    if _is_lambertian(found):
        if inputs.authored("roughness"):
            note(
                "approximated",
                where(inputs.prim, "inputs:specularColor"),
                "black: drawn as Lambert's surface, without the reflection at grazing angles and its roughness",
            )
        return None
    _check_opacity(inputs, opacity)
    _tell(inputs, found)
    return found


def _lobes(reader: _Reader, *, more: bool) -> Preview:
    """The lobes of the workflow that is chosen; inputs of the other one are not looked at.

    ``more``: the surface is no Lambertian, whatever its lobes.
    """
    inputs = reader.inputs
    chosen = "inputs:useSpecularWorkflow"
    workflow = recovered(
        lambda: check_number(inputs.prim, chosen, inputs.constant("useSpecularWorkflow", 0), low=0, high=1), 0.0
    )
    metallic_map, metallic, specular = -1, 0.0, _BLACK
    if workflow:
        specular = reader.colour("specularColor", 1.0)
    else:
        metallic_map, metallic = _mapped(reader, "metallic")
    clearcoat = reader.number("clearcoat")
    plain = bool(workflow) and not any(specular) and not clearcoat
    coat = reader.number("clearcoatRoughness") if clearcoat else _NUMBERS["clearcoatRoughness"][0]
    found = Preview(bool(workflow), metallic, clearcoat=clearcoat, clearcoat_roughness=coat, specular=specular)
    if plain and not more:
        return found  # Lambert's: what is idle there is not looked at
    roughness_map, roughness = _mapped(reader, "roughness")
    ior = reader.number("ior") if not workflow or clearcoat else _NUMBERS["ior"][0]
    return replace(found, roughness=roughness, ior=ior, roughness_map=roughness_map, metallic_map=metallic_map)


def _mapped(reader: _Reader, name: str) -> tuple[int, float]:
    """The map of a number, or -1 and the constant."""
    fallback = _NUMBERS[name][0]
    index = reader.map(name, "number", "float", fallback)
    if index >= 0 or reader.inputs.shaded(name) is not None:
        return index, fallback
    return -1, reader.number(name)


def _is_lambertian(found: Preview) -> bool:
    plain = not any(found.specular) and not found.clearcoat and not any(found.emission)
    return found.specular_workflow and plain and found.emission_map < 0 and found.normal_map < 0


def _check_opacity(inputs: Inputs, opacity: Opacity) -> None:
    """Refuse a surface that lets light through its diffuse part alone: all of it fades here, or nothing."""
    said = recovered(
        lambda: checked(inputs.prim, "inputs:opacityMode", inputs.constant("opacityMode", "transparent"), "word"),
        "transparent",
    )
    if opacity.fades and said != "presence":
        refuse(
            fault(
                inputs.prim,
                "inputs:opacity",
                "a clear surface whose highlights do not fade",
                expected='opacity 1, or opacityMode "presence"',
                got=f"{opacity.value:g}" if opacity.map < 0 else "a map without opacityThreshold",
                do="notabug adapt makes it opaque",
                mends=opinion(inputs.prim, "inputs:opacity", "float", 1.0),
            )
        )


def _tell(inputs: Inputs, found: Preview) -> None:
    """Note what of the surface a picture under direct light cannot show, or shows by chance alone."""
    note("approximated", where(inputs.prim), _DIRECT)
    coat = found.clearcoat_roughness if found.clearcoat else 1.0
    for name, roughness in (("roughness", found.roughness), ("clearcoatRoughness", coat)):
        if roughness < NARROW:
            what = f"{roughness:g}: whether a sample of a pixel meets so narrow a highlight is chance"
            note("approximated", where(inputs.prim, f"inputs:{name}"), what)
