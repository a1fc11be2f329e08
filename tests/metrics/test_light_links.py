"""Light linking that is ignored is a bug of its name; what is right passes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.scene import Scene

CENTRES = Quality(samples=1)
STAGE = """#usda 1.0
(
    defaultPrim = "World"
)
def Xform "World"
{
    def Sphere "Ball"
    {
        double radius = 0.8
        color3f[] primvars:displayColor = [(0.7, 0.3, 0.2)]
    }
    def Mesh "Wall"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1)]
        uniform token subdivisionScheme = "none"
        color3f[] primvars:displayColor = [(0.6, 0.6, 0.6)]
    }
    def SphereLight "Key"
    {
        float inputs:intensity = 60
        bool inputs:normalize = 1
        bool treatAsPoint = 1
        rel LINK = </World/Ball>
        double3 xformOp:translate = (2, 1.5, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DistantLight "Fill"
    {
        float inputs:angle = 0
        float inputs:intensity = 0.4
    }
    def Camera "Camera"
    {
        float2 clippingRange = (0.1, 100)
        float focalLength = 40
        float horizontalAperture = 20
        float verticalAperture = 20
        double3 xformOp:translate = (0, 0, 7)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
"""


def read(folder: Path, link: str) -> Scene:
    path = folder / "scene.usda"
    path.write_text(STAGE.replace("LINK", f"collection:{link}:excludes"), "utf-8")
    return replace(read_stage(path, "own", {}), width=32, height=32)


@pytest.mark.parametrize("link", ["lightLink", "shadowLink"])
def test_what_is_right_passes_and_what_ignores_it_is_named(studio: Any, tmp_path: Path, link: str) -> None:
    scene = read(tmp_path, link)
    name = {"lightLink": "light_link_ignored", "shadowLink": "shadow_link_ignored"}[link]
    for faults, word in (((), "pass"), ((name,), "bug")):
        inhouse = InHouse(faults=faults)
        verdict = studio.verdict(studio.draw(inhouse, scene, CENTRES), scene, inhouse.declaration(CENTRES))
        assert verdict.word == word
        assert [each.name for each in verdict.findings if each.kind == "bug"][:1] == list(faults)
