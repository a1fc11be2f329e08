"""Materials as Cycles' shaders, for the process that Cycles runs in; see docs/renderers/cycles.md for the terms.

A UsdPreviewSurface has Schlick's Fresnel of the half vector in front of its highlight, and one less it in front of its
diffuse part. Cycles' own GGX has it where it is one for white at grazing angles (the node Metallic BSDF, F82 without a
tint). Elsewhere light that is weighted by Schlick's transition lights the surface once more: ``Lit.BY_FRESNEL``.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, cast

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    import numpy.typing as npt
    from bpy.types import Image, Material, NodeSocket

    from notabug.adapters.cycles_nodes import Constant, Graph, Value
    from notabug.adapters.job_types import Arrays, Job, LightSaid, MaterialSaid, MitsubaPreview

_TANGENTS = ("along", "up")  # the names of the mesh's attributes dP/du and dP/dv, in the order of their arrays


class Part(enum.Enum):
    """What of a surface a picture shows."""

    WHOLE = "diffuse part and highlight"
    DIFFUSE = "diffuse part"
    GLOSS = "highlight"
    TAKEN = "diffuse light that Fresnel's reflection takes away, of light weighted by Schlick's transition"
    TINTED = "highlight that Schlick's transition adds where it is coloured, of light weighted by it"
    GLOW = "emission"


class Surfaces:
    """The materials of a job, each made when it is first asked for."""

    def __init__(self, bpy: ModuleType, nodes: ModuleType, job: Job, arrays: Arrays) -> None:
        self.bpy, self.nodes, self.job, self.arrays = bpy, nodes, job, arrays
        self.images: dict[int, Image] = {}

    def takes(self) -> bool:
        """Whether Fresnel's reflection takes diffuse light away from any surface."""
        return any(_diffuse(said) and bool(_preview(said)) for said in self.job["materials"])

    def tints(self) -> bool:
        """Whether the highlight of any surface is between that of a metal and that of a dielectric."""
        return any(_is_between(preview) for preview in map(_preview, self.job["materials"]) if preview)

    def glows(self) -> bool:
        return any(_glow(preview) for preview in map(_preview, self.job["materials"]) if preview)

    def of(self, part: Part, light: LightSaid | None) -> list[Material]:
        """Every material of the job, showing ``part``. Schlick's transition is that of ``light``, if one is given."""
        return [self._material(index, part, light) for index in range(len(self.job["materials"]))]

    def _material(self, index: int, part: Part, light: LightSaid | None) -> Material:
        said = self.job["materials"][index]
        look = self.bpy.data.materials.new(f"material{index} {part.name}")
        graph: Graph = self.nodes.Graph(look)
        look.cycles.use_bump_map_correction = self.job["bump_correction"]
        look.cycles.emission_sampling = "NONE"
        shown = self._surface(graph, said, part, light)
        opacity = self._opacity(graph, said)
        if opacity != self.nodes.ONE:
            mixture = graph.node("MixShader")
            graph.put(opacity, mixture.inputs[0])
            graph.put(graph.node("BsdfTransparent").outputs[0], mixture.inputs[1])
            graph.put(shown, mixture.inputs[2])
            shown = mixture.outputs[0]
        graph.put(shown, graph.node("OutputMaterial").inputs["Surface"])
        return look

    def _opacity(self, graph: Graph, said: MaterialSaid) -> Value:
        """How much of the surface is there: the red of its map, of which all channels are alike, or a constant."""
        opacity = said["opacity"]
        index = said.get("opacity_map", -1)
        if index < 0:
            return opacity, opacity, opacity
        parts = graph.node("SeparateColor")
        graph.put(self._looked_up(graph, index, self.nodes.ONE), parts.inputs[0])
        least = said.get("least_opacity", 0.0)
        if not least:
            return cast("NodeSocket", parts.outputs[0])
        below = graph.number("LESS_THAN", parts.outputs[0], (least,) * 3)
        return graph.number("SUBTRACT", self.nodes.ONE, below)

    def _surface(self, graph: Graph, said: MaterialSaid, part: Part, light: LightSaid | None) -> NodeSocket:
        preview = _preview(said)
        colour = self._looked_up(graph, said["texture"], said["diffuse"])
        if not preview:
            return self._lambert(graph, colour if part in (Part.WHOLE, Part.DIFFUSE) else self.nodes.ZERO, None)
        if part is Part.GLOW:
            glow = graph.node("Emission")
            graph.put(self._looked_up(graph, preview["emission_map"], preview["emission"]), glow.inputs["Color"])
            return glow.outputs[0]
        base = _Base(self, graph, preview, colour)
        turned = (
            None if light is None else graph.schlick(graph.of_node("NewGeometry", "Incoming"), _towards(graph, light))
        )
        if part is Part.TAKEN:
            taken = graph.times(base.diffuse, graph.less(base.high, base.low))
            return self._lambert(graph, taken if turned is None else graph.times(taken, turned), base.normal)
        if part is Part.TINTED:
            if not _is_between(preview):
                return self._lambert(graph, self.nodes.ZERO, None)
            tint = graph.less(base.high, base.low)
            return base.glossy(tint if turned is None else graph.times(tint, turned))
        found = []
        if part is not Part.GLOSS:
            kept = graph.times(base.diffuse, graph.less(self.nodes.ONE, base.low))
            found.append(self._lambert(graph, kept, base.normal))
        if part is not Part.DIFFUSE:
            found += base.highlights()
        return _sum(graph, found)

    def _lambert(self, graph: Graph, colour: Value, normal: Value | None) -> NodeSocket:
        surface = graph.node("BsdfDiffuse")
        surface.inputs["Roughness"].default_value = 0.0
        graph.put(colour, surface.inputs["Color"])
        if normal is not None:
            graph.put(normal, surface.inputs["Normal"])
        return surface.outputs[0]

    def _looked_up(self, graph: Graph, index: int, constant: Sequence[float]) -> Value:
        """What the texture ``index`` says, or the ``constant`` where it is -1."""
        if index < 0:
            return _three(constant)
        texture = self.job["textures"][index]
        node, uv = graph.node("TexImage"), graph.node("UVMap")
        if index not in self.images:
            self.images[index] = image(self.bpy, f"texture{index}", self.arrays[texture["pixels"]])
        node.image = self.images[index]
        node.interpolation = "Linear"
        node.extension = "EXTEND" if texture["wrap"][0] == "clamp" else "REPEAT"
        uv.uv_map = "uv"
        graph.put(uv.outputs[0], node.inputs[0])
        return node.outputs[0]


class _Base:
    """The terms of a UsdPreviewSurface, by the names of ``Preview`` in scenes_usd/scene.py, as nodes of ``graph``."""

    def __init__(self, surfaces: Surfaces, graph: Graph, preview: MitsubaPreview, colour: Value) -> None:
        one = surfaces.nodes.ONE
        self.graph, self.preview = graph, preview

        def number(index: int, constant: float) -> Value:
            return surfaces._looked_up(graph, index, (constant,) * 3)

        ratio = ((1.0 - preview["ior"]) / (1.0 + preview["ior"])) ** 2
        self.at_normal = (ratio,) * 3
        self.roughness = number(preview["roughness_map"], preview["roughness"])
        self.low, self.high, self.diffuse = _three(preview["specular"]), one, colour
        if not preview["specular_workflow"]:
            metallic = number(preview["metallic_map"], preview["metallic"])
            self.high = graph.mixed(one, colour, metallic)
            self.low = graph.times(graph.mixed(self.at_normal, one, metallic), self.high)
            self.diffuse = graph.times(colour, graph.less(one, metallic))
        self.normal = self._normal(surfaces)

    def _normal(self, surfaces: Surfaces) -> Value | None:
        """The map's normal in the frame of dP/du, made square to the surface's normal, and of dP/dv's side.

        From behind the whole of it is turned round.
        """
        graph = self.graph
        if self.preview["normal_map"] < 0:
            return None
        said = surfaces._looked_up(graph, self.preview["normal_map"], (0.0, 0.0, 1.0))
        N = graph.of_node("NewGeometry", "Normal")
        along, up = (graph.attribute(name) for name in _TANGENTS)
        tangent = graph.unit(graph.less(along, graph.times(N, graph.vector("DOT_PRODUCT", along, N))))
        across = graph.vector("CROSS_PRODUCT", N, tangent)
        across = graph.times(across, graph.number("SIGN", graph.vector("DOT_PRODUCT", across, up)))
        parts = graph.node("SeparateXYZ")
        graph.put(said, parts.inputs[0])
        x, y, z = (graph.times(axis, parts.outputs[k]) for k, axis in enumerate((tangent, across, N)))
        # Cycles has turned N alone to a viewer behind the surface; a bump is a dent from there
        side = graph.number("MULTIPLY_ADD", graph.of_node("NewGeometry", "Backfacing"), (-2.0,) * 3, (1.0,) * 3)
        return graph.unit(graph.add(graph.times(graph.add(x, y), side), z))

    def highlights(self) -> list[NodeSocket]:
        """The base's highlight, by Cycles' own Fresnel where it can say it, and the clearcoat's."""
        graph, preview = self.graph, self.preview
        metal = not preview["specular_workflow"] and preview["metallic_map"] < 0 and preview["metallic"] == 1.0
        own = not metal and not _is_between(preview)
        found = [self._metallic(self.low, self.roughness) if own else self.glossy(self.low)]
        if preview["clearcoat"]:
            share = graph.node("MixShader")
            share.inputs[0].default_value = preview["clearcoat"]
            rough = (preview["clearcoat_roughness"],) * 3
            graph.put(self._metallic(self.at_normal, rough), share.inputs[2])
            found.append(share.outputs[0])
        return found

    def glossy(self, colour: Value) -> NodeSocket:
        return self._lobe("BsdfGlossy", "Color", colour, self.roughness)

    def _metallic(self, reflectance: Value, roughness: Value) -> NodeSocket:
        """GGX under Schlick's Fresnel from ``reflectance`` to white."""
        return self._lobe("BsdfMetallic", "Base Color", reflectance, roughness)

    def _lobe(self, kind: str, name: str, colour: Value, roughness: Value) -> NodeSocket:
        node = self.graph.node(kind)
        node.distribution = "GGX"  # not the one that compensates what masking takes
        if kind == "BsdfMetallic":
            node.fresnel_type = "F82"
            node.inputs["Edge Tint"].default_value = (1.0, 1.0, 1.0, 1.0)
        self.graph.put(colour, node.inputs[name])
        self.graph.put(roughness, node.inputs["Roughness"])
        if self.normal is not None:
            self.graph.put(self.normal, node.inputs["Normal"])
        return node.outputs[0]


def _three(values: Sequence[float]) -> Constant:
    r, g, b = values
    return float(r), float(g), float(b)


def _sum(graph: Graph, shaders: list[NodeSocket]) -> NodeSocket:
    total = shaders[0]
    for shader in shaders[1:]:
        node = graph.node("AddShader")
        graph.put(total, node.inputs[0])
        graph.put(shader, node.inputs[1])
        total = node.outputs[0]
    return total


def _towards(graph: Graph, light: LightSaid) -> Value:
    """The unit vector from the point that is shaded to a light without a size."""
    x, y, z = light["place"]
    if light["kind"] == "distant":
        return -x, -y, -z
    return graph.unit(graph.less((x, y, z), graph.of_node("NewGeometry", "Position")))


def _preview(said: MaterialSaid) -> MitsubaPreview | None:
    """The preview surface's own fields, if it is one."""
    return cast("MitsubaPreview | None", said.get("preview"))


def _diffuse(said: MaterialSaid) -> bool:
    """Whether the surface has a diffuse part."""
    preview = _preview(said)
    metal = preview and not preview["specular_workflow"] and preview["metallic_map"] < 0 and preview["metallic"] == 1.0
    return not metal and (said["texture"] >= 0 or any(said["diffuse"]))


def _is_between(preview: MitsubaPreview) -> bool:
    metallic = preview["metallic_map"] >= 0 or 0.0 < preview["metallic"] < 1.0
    return metallic and not preview["specular_workflow"]


def _glow(preview: MitsubaPreview) -> bool:
    return preview["emission_map"] >= 0 or any(preview["emission"])


def image(bpy: ModuleType, name: str, pixels: npt.NDArray[np.float32]) -> Image:
    """``pixels`` (h, w, 3), top row first, as numbers that Blender does not convert."""
    height, width = pixels.shape[:2]
    made = bpy.data.images.new(name, width, height, float_buffer=True, is_data=True)
    whole = np.ones((height, width, 4), np.float32)
    whole[..., :3] = pixels[::-1]
    made.pixels.foreach_set(whole.ravel())
    made.update()
    return made
