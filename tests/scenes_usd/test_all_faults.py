"""All faults of one shader at once, and nothing told twice: neither by OpenUSD nor in Python's own notation."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from pxr import Gf

from notabug.commands.check import by_path
from notabug.scenes_usd.adapted import adapt
from notabug.scenes_usd.errors import ManyFaultsError, SceneError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.reader import survey_scene
from notabug.scenes_usd.reader_stage import Survey
from notabug.scenes_usd.reader_values import shown
from notabug.scenes_usd.reading import Remark, each_tried, reading
from notabug.scenes_usd.view import AS_IT_IS

SCENE = """#usda 1.0
(
    defaultPrim = "World"
)
def Xform "World"
{
    def Camera "Cam"
    {
        float3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DistantLight "Sun"
    {
        float inputs:angle = 0
    }
    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
            interpolation = "vertex"
        )
        rel material:binding = </World/Looks/BOUND>
    }
    def Scope "Looks"
    {
        def Material "Wood"
        {
            token outputs:surface.connect = </World/Looks/Wood/Shader.outputs:surface>
            def Shader "Shader"
            {
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor.connect = </World/Looks/Wood/Tex.outputs:rgb>
                float inputs:displacement = 0.3
                token outputs:surface
            }
            def Shader "Tex"
            {
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @missing.png@
                token inputs:wrapS = "tiled"
                token inputs:sourceColorSpace = "ACEScg"
                float4 inputs:scale = (inf, 1, 1, 1)
                float3 outputs:rgb
            }
        }
    }
}
"""


def told(folder: Path, bound: str = "Wood") -> dict[str, str]:
    """What is out of the contract, by its place."""
    path = folder / "scene.usda"
    path.write_text(SCENE.replace("BOUND", bound))
    return {remark.where: str(remark.error) for remark in survey_scene(str(path), {}).remarks if remark.error}


def test_all_faults_of_a_texture_are_told_in_one_run(tmp_path: Path) -> None:
    texture = "/World/Looks/Wood/Tex.inputs:"
    found = {place.removeprefix(texture) for place in told(tmp_path) if place.startswith(texture)}
    assert found == {"st", "wrapS", "sourceColorSpace", "scale", "file"}


def test_where_nothing_is_left_to_draw_the_reasons_are_told(tmp_path: Path) -> None:
    """The broken meshes are left out by adapting, and then there is nothing to draw: what broke them is the news."""
    path = tmp_path / "scene.usda"
    broken = SCENE.replace("BOUND", "Wood").replace("[0, 1, 2, 3]", "[0, 1, 2, 7]")
    path.write_text(broken)
    with pytest.raises(ManyFaultsError) as caught:
        take_scene(path)
    told = {error.where: error.what for error in caught.value.errors}
    assert told["/World/Floor.faceVertexIndices"] == "element 3 is out of range"
    assert "nothing to draw" in told["/World"]
    assert "/World/Looks/Wood/Shader.inputs:displacement" not in told, "this one is mended"
    path.write_text(broken.replace("[0, 1, 2, 7]", "[0, 1, 2, 3]"))
    assert take_scene(path).scene.adapted == "scene"


def test_a_number_is_told_as_it_was_authored(tmp_path: Path) -> None:
    assert "got 0.3;" in told(tmp_path)["/World/Looks/Wood/Shader.inputs:displacement"]
    values = (0.1, 1.0, 0.30000001192092896, 1e300, -math.inf, math.nan, 7, "x")
    assert [shown(value) for value in values] == ["0.1", "1.0", "0.3", "1e+300", "-inf", "nan", "7", "'x'"]


@pytest.mark.parametrize(
    ("value", "told_as"),
    [
        (Gf.Vec3f(0.0, 0.3, 0.0), "(0.0, 0.3, 0.0)"),
        (Gf.Vec2i(1, 2), "(1.0, 2.0)"),
        (Gf.Vec4d(1.0, 2.0, 3.0, 1e300), "(1.0, 2.0, 3.0, 1e+300)"),
    ],
)
def test_a_vector_is_told_as_usd_writes_it(value: object, told_as: str) -> None:
    assert shown(value) == told_as


def test_a_material_that_becomes_grey_for_several_reasons_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "scene.usda").write_text(SCENE.replace("BOUND", "Wood"))
    made = adapt(tmp_path / "scene.usda", tmp_path / "own.usda", {}, AS_IT_IS)
    (grey,) = [line for line in made.says if line.startswith("/World/Looks/Wood.outputs:surface")]
    assert grey.count("grey: ") == 1
    for name in ("inputs:st: ", "inputs:wrapS: ", "inputs:file: "):
        assert name in grey
    assert made.survey.scene is not None


def test_what_is_refused_is_not_told_as_approximated_too() -> None:
    place = "/World/Cam.xformOpOrder"
    refused = Remark("out of the contract", place, "OpenUSD refuses it", SceneError("OpenUSD refuses it", where=place))
    kept = Remark("approximated", "/World/Cam.fStop", "everything is in focus")
    survey = Survey(None, (Remark("approximated", place, "placed without it"), kept, refused))
    assert by_path(survey) == [refused, kept]


def test_a_binding_to_nothing_names_its_target(tmp_path: Path) -> None:
    says = told(tmp_path, "Gone")["/World/Floor.material:binding"]
    assert "expected a Material prim, got /World/Looks/Gone;" in says
    assert "Sdf" not in says


def test_opens_usd_says_nothing_of_bindings_that_it_honours(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert "/World/Looks/Wood/Tex.inputs:file" in told(tmp_path), "the binding is honoured"
    assert "MaterialBindingAPI" not in capfd.readouterr().err


def test_of_several_faults_the_last_is_raised_and_the_others_are_noted() -> None:
    def fails(word: str) -> object:
        raise SceneError(word, where=f"/{word}")

    done: list[int] = []
    with reading() as now, pytest.raises(SceneError, match="c"):
        each_tried(lambda: fails("a"), lambda: done.append(1), lambda: fails("b"), lambda: fails("c"))
    assert done == [1]
    assert [str(error) for error in now.errors] == ["/a: a", "/b: b"]
    each_tried(lambda: done.append(2))
    assert done == [1, 2]
