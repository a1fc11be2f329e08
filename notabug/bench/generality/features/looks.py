"""Materials of exports as text: a UsdPreviewSurface with its maps, wired as Blender, Houdini or Maya wire them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.bench.generality.features.decks import Features
from notabug.bench.generality.looks import LARGEST, colour, picture
from notabug.scenes_usd.authoring.png import png
from notabug.scenes_usd.authoring.usda import block, number, vector

LEAST_ROUGH = 0.12  # below 0.05 the reader says that a picture cannot show the highlight
TILT = 0.35  # of a normal map: largest x and y of its normals


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A material: its text, and its pictures by their files' names."""

    text: str
    files: dict[str, bytes]


def surface(
    rng: np.random.Generator, what: Features, name: str, kind: str, *, maps: str, bumps: str, opacity: str = "none"
) -> Surface:
    """The material ``name`` with cards of the decks of surfaces (``kind``), maps, normal maps (``bumps``) and opacity.

    A ``cutout`` is by the alpha of a picture, or by the red ``channel`` of one.
    """
    inputs, nodes, files = _Inputs(), _Nodes(what, name), dict[str, bytes]()
    inputs.put("color3f", "diffuseColor", vector(colour(rng, 0.2, 0.9)))
    inputs.put("float", "roughness", _share(rng, LEAST_ROUGH, 1.0))
    inputs.put("float", "metallic", {"metal": "1", "part_metal": _share(rng, 0.1, 0.9)}.get(kind, "0"))
    if rng.uniform() < 0.5:
        inputs.put("float", "ior", _share(rng, 1.2, 2.2))
    if kind == "specular":
        inputs.put("int", "useSpecularWorkflow", "1")
        inputs.put("color3f", "specularColor", vector(colour(rng, 0.05, 0.9)))
    if kind == "clearcoat":
        inputs.put("float", "clearcoat", _share(rng, 0.2, 1.0))
        inputs.put("float", "clearcoatRoughness", _share(rng, LEAST_ROUGH, 0.6))
    if kind == "emission":
        inputs.put("color3f", "emissiveColor", vector(colour(rng, 0.02, 0.5)))

    def show(file: str, pixels: npt.NDArray[np.uint8], space: str, **reads: str) -> str:
        files[f"{name}_{file}.png"] = png(pixels)
        return nodes.texture(file, f"{name}_{file}.png", space, **reads)

    if maps in ("diffuse", "all"):
        space = str(rng.choice(["sRGB", "raw", "auto", ""]))
        inputs.connect("color3f", "diffuseColor", f"{show('color', picture(rng), space)}.outputs:rgb")
    if maps in ("roughness", "packed", "all"):
        pixels = np.maximum(picture(rng), round(255 * LEAST_ROUGH)).astype(np.uint8)
        reads = {}
        if rng.uniform() < 0.3:  # half as much, from half on
            reads = {"scale": "(0.5, 0.5, 0.5, 1)", "bias": "(0.5, 0.5, 0.5, 0)"}
        node = show("numbers", pixels, "raw", **reads)
        inputs.connect("float", "roughness", f"{node}.outputs:g")
        if maps != "roughness" and kind != "specular":
            inputs.connect("float", "metallic", f"{node}.outputs:b")
        if rng.uniform() < 0.3:
            inputs.connect("float", "occlusion", f"{node}.outputs:r")
    if maps == "emission":
        dim = {"scale": "(0.4, 0.4, 0.4, 1)"}
        inputs.connect("color3f", "emissiveColor", f"{show('glow', picture(rng), 'sRGB', **dim)}.outputs:rgb")
    if opacity != "none":
        pixels = picture(rng)
        alpha = rng.integers(0, 256, (*pixels.shape[:2], 1), dtype=np.uint8)
        whole = np.concatenate([pixels, alpha], axis=2)
        node = show("leaf", whole, "sRGB") if opacity == "cutout" else show("leaf", np.repeat(alpha, 3, axis=2), "raw")
        inputs.connect("float", "opacity", f"{node}.outputs:{'a' if opacity == 'cutout' else 'r'}")
        inputs.put("float", "opacityThreshold", _share(rng, 0.2, 0.6))
    if bumps != "none" and what.wrap != "black":  # what is black there is no normal
        strong = {"plain": ("(2, 2, 2, 1)", "(-1, -1, -1, 0)"), "weak": ("(1, 1, 2, 1)", "(-0.5, -0.5, -1, 0)")}[bumps]
        node = show("normals", _normals(rng), "raw", scale=strong[0], bias=strong[1])
        inputs.connect("normal3f", "normal", f"{node}.outputs:rgb")
    return Surface(_material(what, name, inputs, nodes), files)


class _Inputs:
    """The inputs of a preview surface in the order they are put; the last value of one counts."""

    def __init__(self) -> None:
        self.lines: dict[str, tuple[str, str, str]] = {}

    def put(self, kind: str, name: str, value: str) -> None:
        self.lines[name] = kind, "", value

    def connect(self, kind: str, name: str, source: str) -> None:
        self.lines[name] = kind, ".connect", f"<{source}>"


class _Nodes:
    """The texture nodes of a material, each with the reader of coordinates that it needs, once."""

    def __init__(self, what: Features, material: str) -> None:
        self.what, self.material = what, material
        inner = "/Maps" if what.network == "node_graph" else ""
        self.place = f"/Export/Looks/{material}{inner}"
        self.texts: list[str] = []

    def texture(self, name: str, file: str, space: str, **reads: str) -> str:
        """Add a texture node; its path."""
        what = self.what
        if not self.texts:
            self.texts += self._coordinates()
        source = "Place.outputs:result" if what.transform2d == "yes" else "Reader.outputs:result"
        lines = [
            'uniform token info:id = "UsdUVTexture"',
            f"asset inputs:file = @./{file}@",
            *([f'token inputs:sourceColorSpace = "{space}"'] if space else []),
            f"float2 inputs:st.connect = <{self.place}/{source}>",
            f'token inputs:wrapS = "{what.wrap}"',
            f'token inputs:wrapT = "{what.wrap}"',
            *(f"float4 inputs:{key} = {value}" for key, value in reads.items()),
            *(f"float outputs:{channel}" for channel in "rgba"),
            "float3 outputs:rgb",
        ]
        self.texts.append(block(f'def Shader "Map_{name}"', "\n".join(lines)))
        return f"{self.place}/Map_{name}"

    def _coordinates(self) -> list[str]:
        what = self.what
        varname = f'string inputs:varname = "{what.coordinates}"'
        if what.network == "interface":
            varname = f"string inputs:varname.connect = </Export/Looks/{self.material}.inputs:frame:stPrimvarName>"
        reader = 'uniform token info:id = "UsdPrimvarReader_float2"\n' + varname + "\nfloat2 outputs:result"
        texts = [block('def Shader "Reader"', reader)]
        if what.transform2d == "yes":
            place = (
                'uniform token info:id = "UsdTransform2d"\n'
                f"float2 inputs:in.connect = <{self.place}/Reader.outputs:result>\n"
                "float inputs:rotation = 30\nfloat2 inputs:scale = (1.5, 0.75)\n"
                "float2 inputs:translation = (0.2, -0.4)\nfloat2 outputs:result"
            )
            texts.append(block('def Shader "Place"', place))
        return texts


def _material(what: Features, name: str, inputs: _Inputs, nodes: _Nodes) -> str:
    path = f"/Export/Looks/{name}"
    own, lines = [f"token outputs:surface.connect = <{path}/Surface.outputs:surface>"], []
    if what.network == "interface":
        own.append(f'string inputs:frame:stPrimvarName = "{what.coordinates}"')
    graph = []
    for key, (kind, how, value) in inputs.lines.items():
        if what.network == "node_graph" and how:  # through an output of the graph
            graph.append(f"{kind} outputs:{key}{how} = {value}")
            value = f"<{nodes.place}.outputs:{key}>"
        elif what.network == "interface" and not how and kind != "int":
            own.append(f"{kind} inputs:{key} = {value}")
            how, value = ".connect", f"<{path}.inputs:{key}>"
        lines.append(f"{kind} inputs:{key}{how} = {value}")
    shader = 'uniform token info:id = "UsdPreviewSurface"\n' + "\n".join([*lines, "token outputs:surface"])
    inner = nodes.texts
    if what.network == "node_graph" and inner:
        inner = [block('def NodeGraph "Maps"', "\n".join(graph), *inner)]
    return block(f'def Material "{name}"', "\n".join(own), block('def Shader "Surface"', shader), *inner)


def _share(rng: np.random.Generator, low: float, high: float) -> str:
    return number(round(float(rng.uniform(low, high)), 3))


def _normals(rng: np.random.Generator) -> npt.NDArray[np.uint8]:
    """A map of unit normals that lean by chance, in eight bits."""
    height, width = (int(side) for side in rng.integers(4, LARGEST + 1, 2))
    across = rng.uniform(-TILT, TILT, (height, width, 2))
    up = np.sqrt(1.0 - (across**2).sum(axis=2, keepdims=True))
    normals = np.concatenate([across, up], axis=2)
    return np.rint((normals + 1.0) / 2.0 * 255.0).astype(np.uint8)
