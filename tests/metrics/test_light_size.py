"""Faults of lights with a size in pictures of a team's own file: each is found, and named; right pictures pass."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.export.formats import export
from notabug.adapters.inhouse import InHouse
from notabug.adapters.registry import adapter, adapters, needs
from notabug.adapters.requirements import check_supported
from notabug.metrics.judge import judge
from notabug.references.models.model import models
from notabug.scenes_usd.emitters import resized
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.scene import Scene

CENTRES = Quality(samples=1)
SIZE = 28
STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
)
def Xform "World"
{
    def Material "Look"
    {
        token outputs:surface.connect = </World/Look/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.5, 0.4, 0.3)
            float inputs:roughness = 0.45
            token outputs:surface
        }
    }
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        double radius = 1
        rel material:binding = </World/Look>
        double3 xformOp:translate = (0, 0, 1)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Floor" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </World/Look>
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)]
        uniform token subdivisionScheme = "none"
    }
    LIGHTS
    def DistantLight "Fill"
    {
        float inputs:intensity = 0.5
        float inputs:angle = 0
        double3 xformOp:rotateXYZ = (50, 0, 40)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }
    def Camera "Camera"
    {
        float2 clippingRange = (0.1, 100)
        float focalLength = 40
        float horizontalAperture = 22
        float verticalAperture = 22
        double3 xformOp:translate = (0, -7, 4)
        double3 xformOp:rotateXYZ = (65, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
    }
}
"""
PLACE = """
    {
        float inputs:exposure = 2
        BODY
        double3 xformOp:translate = (-2.5, 2, 4)
        double3 xformOp:rotateXYZ = (-25, -30, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
    }
"""
SOFTBOX = "float inputs:intensity = 10\nfloat inputs:width = 2\nfloat inputs:height = 1.5\nbool inputs:normalize = 1"
LAMPS = {
    "rect": ("RectLight", SOFTBOX),
    "disk": ("DiskLight", "float inputs:intensity = 4\nfloat inputs:radius = 0.8"),
    "sphere": ("SphereLight", "float inputs:intensity = 4\nfloat inputs:radius = 0.6"),
    "cylinder": ("CylinderLight", "float inputs:intensity = 4\nfloat inputs:radius = 0.3\nfloat inputs:length = 2"),
    "sun": ("DistantLight", "float inputs:intensity = 1.5\nfloat inputs:angle = 20"),
    "dome": ("DomeLight", "float inputs:intensity = 0.2"),
    "spot": (
        'SphereLight "Key" (prepend apiSchemas = ["ShapingAPI"])',
        "float inputs:intensity = 4\nfloat inputs:radius = 0.5\nfloat inputs:shaping:cone:angle = 15\n"
        "float inputs:shaping:cone:softness = 0.5\nfloat inputs:specular = 0.25",
    ),
}


def read(folder: Path, kind: str) -> Scene:
    schema, body = LAMPS[kind]
    head = schema if '"' in schema else f'{schema} "Key"'
    path = folder / "scene.usda"
    path.write_text(STAGE.replace("LIGHTS", f"def {head}{PLACE.replace('BODY', body)}"), "utf-8")
    return replace(read_stage(path, "own", {}), width=SIZE, height=SIZE)


def judged(studio: Any, scene: Scene, *faults: str) -> Any:
    inhouse = InHouse(faults=faults)
    return studio.verdict(studio.draw(inhouse, scene, CENTRES), scene, inhouse.declaration(CENTRES))


@pytest.mark.parametrize("kind", ["rect", "cylinder", "dome", "spot"])
def test_what_is_right_passes(studio: Any, tmp_path: Path, kind: str) -> None:
    scene = read(tmp_path, kind)
    assert scene.lights[0].kind == ("sphere" if kind == "spot" else kind)
    assert judged(studio, scene).word == "pass"


@pytest.mark.parametrize(
    ("kind", "fault"),
    [
        ("rect", "light_size_ignored"),
        ("rect", "normalize_ignored"),
        ("rect", "exposure_ignored"),
        ("sun", "light_size_ignored"),
        ("spot", "cone_ignored"),
        ("spot", "light_multiplier_ignored"),
    ],
)
@pytest.mark.sweep_except(
    "rect-light_size_ignored",
    "rect-normalize_ignored",
    "rect-exposure_ignored",
    "spot-cone_ignored",
    "spot-light_multiplier_ignored",
)
def test_a_fault_is_named(studio: Any, tmp_path: Path, kind: str, fault: str) -> None:
    verdict = judged(studio, read(tmp_path, kind), fault)
    assert verdict.word == "bug"
    assert verdict.findings[0].name == fault


@pytest.mark.parametrize(("factor", "keep"), [(0.5, False), (2.0, True)])
@pytest.mark.sweep_except("0.5-False")
def test_a_light_twice_or_half_as_large_is_a_bug(studio: Any, tmp_path: Path, factor: float, keep: bool) -> None:
    scene = read(tmp_path, "disk")
    key, *rest = scene.lights
    drawn = replace(scene, lights=(resized(key, factor, keep_power=keep), *rest))
    inhouse = InHouse()
    verdict = studio.verdict(studio.draw(inhouse, drawn, CENTRES), scene, inhouse.declaration(CENTRES))
    assert verdict.word == "bug"
    assert verdict.findings[0].name == "light_size"


def test_every_model_of_such_a_scene_can_be_predicted(studio: Any, tmp_path: Path) -> None:
    """Those that make no sense of it are not among them, and none crashes."""
    from notabug.references.predict import preview

    for kind in ("dome", "spot"):
        scene = replace(read(tmp_path, kind), width=6, height=6)
        names = {model.name for model in models(scene)}
        assert "falloff_none" not in names, "the falloff is the shape's"
        for model in models(scene):
            assert np.isfinite(preview(scene, (model,))).all(), model.name


def mitsuba(folder: Path, drawn: Scene, meant: Scene, seed: int = 0) -> Any:
    who = adapter("mitsuba")
    quality = Quality(samples=64, seeds=tuple(range(seed, seed + 4)))
    try:
        who.find()
    except NotabugError as error:
        pytest.skip(str(error))
    pictures = [read_picture(each.image).pixels for each in who.render(drawn, folder, quality)]
    return judge(pictures, meant, who.declaration(quality), perceive=False).verdict


@pytest.mark.parametrize("kind", ["disk", "cylinder", "sun"])
def test_mitsuba_draws_it_rightly(tmp_path: Path, kind: str) -> None:
    scene = read(tmp_path, kind)
    assert mitsuba(tmp_path, scene, scene).word in ("pass", "limitation")


@pytest.mark.parametrize(("factor", "name"), [(1 / 32, "light_size_ignored"), (2.0, "light_size")])
@pytest.mark.sweep_except("2.0-light_size")
def test_mitsuba_under_a_light_of_the_wrong_size_is_a_bug(tmp_path: Path, factor: float, name: str) -> None:
    scene = read(tmp_path, "rect")
    drawn = replace(scene, lights=(resized(scene.lights[0], factor, keep_power=True), *scene.lights[1:]))
    verdict = mitsuba(tmp_path, drawn, scene)
    assert (verdict.word, verdict.findings[0].name) == ("bug", name)


def test_who_lacks_them_says_so(tmp_path: Path) -> None:
    scene = read(tmp_path, "spot")
    assert {"sphere_light", "light_beam", "light_multipliers"} <= needs(scene)
    able = {name for name, each in adapters().items() if not needs(scene) - each.capabilities}
    assert "inhouse" in able
    for name in ("povray", "opengl", "threejs", "vtk", "mitsuba"):
        with pytest.raises(NotabugError, match="light_beam"):
            check_supported(adapter(name), scene)


def test_exports_say_them_or_refuse(tmp_path: Path) -> None:
    scene = read(tmp_path, "spot")
    export(scene, "json", tmp_path)
    said = json.loads((tmp_path / "scene.json").read_text("utf-8"))["lights"][0]
    assert (said["kind"], said["specular"], said["beam"]["cone"]) == ("sphere", 0.25, 15.0)
    assert said["radiance"] == pytest.approx([16.0] * 3)
    for kind in ("gltf", "pbrt", "povray"):
        with pytest.raises(NotabugError, match="/World/Key"):
            export(scene, kind, tmp_path)
