"""Faults of UsdPreviewSurface in pictures drawn in-house of a team's own file: each is found, and named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.admissible import Admissible
from notabug.metrics.predictions import Predictions
from notabug.references.models.model import Model
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.scene import Scene

CENTRES = Quality(samples=1)
MATERIAL = """
    def Material "{name}"
    {{
        token outputs:surface.connect = </World/{name}/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            {inputs}
            token outputs:surface
        }}
        {more}
    }}
"""
STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
)
def Xform "World"
{{
    {materials}
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        double radius = 1
        rel material:binding = </World/Ball_look>
        double3 xformOp:translate = (0, 0, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def Mesh "Floor" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        rel material:binding = </World/Floor_look>
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]
        texCoord2f[] primvars:st = [(0, 0), (2, 0), (2, 2), (0, 2)] (interpolation = "vertex")
        uniform token subdivisionScheme = "none"
    }}
    def SphereLight "Key"
    {{
        float inputs:intensity = 120
        bool inputs:normalize = 1
        bool treatAsPoint = 1
        double3 xformOp:translate = (-3, 3, 6)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def DistantLight "Fill"
    {{
        float inputs:intensity = 1
        float inputs:angle = 0
        double3 xformOp:rotateXYZ = (50, 0, 40)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }}
    def Camera "Camera"
    {{
        float2 clippingRange = (0.1, 100)
        float focalLength = 40
        float horizontalAperture = 22
        float verticalAperture = 22
        double3 xformOp:translate = (0, -7, 4)
        double3 xformOp:rotateXYZ = (65, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
    }}
}}
"""
LOOKS = {
    "metallic": ("color3f diffuseColor = (0.8, 0.5, 0.2)", "float metallic = 0.8", "float roughness = 0.4"),
    "glossy": ("color3f diffuseColor = (0.1, 0.3, 0.6)", "float roughness = 0.35", "float ior = 2"),
    "specular": (
        *("color3f diffuseColor = (0.1, 0.2, 0.1)", "int useSpecularWorkflow = 1"),
        *("color3f specularColor = (0.4, 0.3, 0.2)", "float roughness = 0.5"),
    ),
    "coated": (
        *("color3f diffuseColor = (0.3, 0.05, 0.05)", "float roughness = 0.7"),
        *("float clearcoat = 1", "float clearcoatRoughness = 0.2"),
    ),
    "glowing": ("color3f diffuseColor = (0.3, 0.3, 0.3)", "color3f emissiveColor = (0.05, 0.02, 0)"),
    "grey": (
        *("color3f diffuseColor = (0.3, 0.3, 0.3)", "int useSpecularWorkflow = 1"),
        "color3f specularColor = (0, 0, 0)",
    ),
}


def material(name: str, inputs: tuple[str, ...], more: str = "") -> str:
    lines = [f"{kind} inputs:{rest}" for kind, rest in (each.split(" ", 1) for each in inputs)]
    return MATERIAL.format(name=name, inputs="\n            ".join(lines), more=more)


def write(folder: Path, ball: tuple[str, ...], floor: tuple[str, ...], more: str = "") -> Scene:
    """The scene with these inputs of its two materials, read as a team's own file is."""
    path = folder / "scene.usda"
    looks = material("Ball_look", ball) + material("Floor_look", floor, more)
    path.write_text(STAGE.format(materials=looks), "utf-8")
    return replace(read_stage(path, "own", {}), width=48, height=48)


def judged(studio: Any, scene: Scene, *faults: str) -> Any:
    adapter = InHouse(faults=faults)
    return studio.verdict(studio.draw(adapter, scene, CENTRES), scene, adapter.declaration(CENTRES))


@pytest.mark.parametrize(
    ("ball", "fault"),
    [
        ("metallic", "roughness_squared_twice"),
        ("glossy", "roughness_squared_twice"),
        ("coated", "roughness_not_squared"),
        ("specular", "roughness_not_squared"),
        ("glossy", "roughness"),
        ("metallic", "metallic_ignored"),
        ("metallic", "workflow_exchanged"),
        ("specular", "workflow_exchanged"),
        ("glossy", "ior_ignored"),
        ("coated", "clearcoat_missing"),
        ("glowing", "emission_missing"),
    ],
)
@pytest.mark.sweep_except(
    "glossy-roughness_squared_twice",
    "specular-roughness_not_squared",
    "glossy-roughness",
    "metallic-metallic_ignored",
    "specular-workflow_exchanged",
    "glossy-ior_ignored",
    "coated-clearcoat_missing",
    "glowing-emission_missing",
)
def test_a_fault_is_named(studio: Any, tmp_path: Path, ball: str, fault: str) -> None:
    verdict = judged(studio, write(tmp_path, LOOKS[ball], LOOKS["grey"]), fault)
    assert verdict.word == "bug"
    assert verdict.findings[0].name == fault


@pytest.mark.parametrize("ball", LOOKS)
def test_what_is_right_passes(studio: Any, tmp_path: Path, ball: str) -> None:
    scene = write(tmp_path, LOOKS[ball], LOOKS["glossy" if ball == "grey" else "grey"])
    assert judged(studio, scene).word == "pass"


def correlated(scene: Scene) -> Scene:
    surfaces = [
        each if each.preview is None else replace(each.preview, masking="correlated") for each in scene.materials
    ]
    kept = zip(scene.materials, surfaces, strict=True)
    return replace(
        scene, materials=tuple(replace(each, preview=found) if each.preview else each for each, found in kept)
    )


def test_a_convention_that_is_declared_is_tried_before_all_else(
    studio: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No other set is predicted; a fault beside it stays a bug, and another masking than the declared one."""
    metal = ("color3f diffuseColor = (0.8, 0.5, 0.2)", "float metallic = 1", "float roughness = 0.9")
    scene = write(tmp_path, metal, metal)
    adapter = InHouse()
    declaration = adapter.declaration(CENTRES)
    asked: list[tuple[str, ...]] = []
    admitted = Predictions._admitted

    def noted(self: Predictions, chosen: tuple[Model, ...]) -> Admissible:
        asked.append(tuple(model.name for model in chosen))
        return admitted(self, chosen)

    monkeypatch.setattr(Predictions, "_admitted", noted)
    picture = studio.draw(adapter, correlated(scene), CENTRES)
    verdict = studio.verdict(picture, scene, replace(declaration, masking="correlated"))
    assert (verdict.word, [each.name for each in verdict.findings]) == ("pass", ["masking_correlated"])
    assert asked == [("masking_correlated",)]
    assert studio.verdict(picture, scene, replace(declaration, masking="separable"), naming=False).word == "bug"
    faulty = studio.draw(InHouse(faults=("metallic_ignored",)), correlated(scene), CENTRES)
    assert studio.verdict(faulty, scene, replace(declaration, masking="correlated"), naming=False).word == "bug"


# --- maps -----------------------------------------------------------------------------------------------------------

MAP = """
        def Shader "{name}"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./{name}.exr@
            float2 inputs:st.connect = </World/Floor_look/Reader.outputs:result>
            token inputs:wrapS = "repeat"
            token inputs:wrapT = "repeat"
            token inputs:sourceColorSpace = "raw"
            {more}
            float outputs:r
            float3 outputs:rgb
        }}
"""
READER = """
        def Shader "Reader"
        {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }
"""
SIGNED = "float4 inputs:scale = (2, 2, 2, 1)\n            float4 inputs:bias = (-1, -1, -1, 0)"


def bumps(size: int = 16) -> Any:
    """The normals of a height field of two waves, from 0 to 1."""
    v, u = (np.mgrid[:size, :size] + 0.5) * 2.0 * np.pi / size
    normals = np.stack([0.4 * np.cos(u), 0.3 * np.sin(v), np.ones_like(u)], axis=2)
    return (normals / np.linalg.norm(normals, axis=2, keepdims=True) + 1.0) / 2.0


def mapped(folder: Path) -> Scene:
    """A floor with a roughness map and a normal map."""
    ramp = np.linspace(0.25, 0.75, 16)[None, :, None] * np.ones((16, 1, 3))
    write_exr(folder / "Rough.exr", ramp)
    write_exr(folder / "Bumps.exr", bumps())
    floor = (
        *("color3f diffuseColor = (0.4, 0.4, 0.3)", "float ior = 1.8"),
        "float roughness.connect = </World/Floor_look/Rough.outputs:r>",
        "normal3f normal.connect = </World/Floor_look/Bumps.outputs:rgb>",
    )
    more = MAP.format(name="Rough", more="") + MAP.format(name="Bumps", more=SIGNED) + READER
    return write(folder, LOOKS["grey"], floor, more)


@pytest.mark.parametrize(
    "fault",
    [
        "normal_green_flipped",
        "normal_map_ignored",
        "normal_unscaled",
        "number_map_as_srgb",
        "roughness_squared_twice",
    ],
)
def test_a_fault_of_a_map_is_named(studio: Any, tmp_path: Path, fault: str) -> None:
    verdict = judged(studio, mapped(tmp_path), fault)
    assert verdict.word == "bug"
    assert verdict.findings[0].name == fault


def test_right_maps_pass(studio: Any, tmp_path: Path) -> None:
    assert judged(studio, mapped(tmp_path)).word == "pass"
