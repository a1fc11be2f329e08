"""A dome's picture in a team's own file: how it is read, its faults by name, Mitsuba, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.export.formats import export
from notabug.adapters.inhouse import InHouse
from notabug.adapters.registry import adapter, needs
from notabug.adapters.requirements import check_supported
from notabug.metrics.judge import judge
from notabug.references.models.dome import models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.errors import NotabugError, SceneError
from notabug.scenes_usd.picture import read_picture, write_exr, write_png
from notabug.scenes_usd.reader_stage import read_stage, survey_stage
from notabug.scenes_usd.scene import Emitter, Floats, Scene
from notabug.scenes_usd.srgb import encode_srgb
from notabug.scenes_usd.writer import write_scene

CENTRES = Quality(samples=1)
SIZE = 16
STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "UP"
)
def Xform "World"
{
    def Sphere "Ball"
    {
        double radius = 1
        color3f[] primvars:displayColor = [(0.8, 0.7, 0.6)]
    }
    def Sphere "Small"
    {
        double radius = 0.5
        color3f[] primvars:displayColor = [(0.3, 0.6, 0.4)]
        double3 xformOp:translate = (0.7, -0.5, 0.9)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DOME "Sky"
    {
        asset inputs:texture:file = @./FILE@
        BODY
    }
    def Camera "Camera"
    {
        float2 clippingRange = (0.1, 100)
        float focalLength = 40
        float horizontalAperture = 20
        float verticalAperture = 20
        double3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
"""


def sky() -> Floats:
    """A small map without a symmetry: brighter above, a warm lamp and a blue one."""
    pixels = np.repeat(np.linspace(0.5, 0.05, 8)[:, None, None], 16, axis=1).repeat(3, axis=2)
    pixels[2, 3] = (0.95, 0.8, 0.5)
    pixels[4, 6] = (0.2, 0.4, 0.95)
    return pixels


def read(folder: Path, body: str = "", kind: str = "DomeLight", up: str = "Y", file: str = "sky.exr") -> Scene:
    write_exr(folder / "sky.exr", sky())
    write_png(folder / "deep.png", sky())
    path = folder / "scene.usda"
    text = STAGE.replace("BODY", body).replace("DOME", kind).replace("UP", up).replace("FILE", file)
    path.write_text(text, "utf-8")
    return replace(read_stage(path, "own", {}), width=SIZE, height=SIZE)


def emitter(scene: Scene) -> Emitter:
    assert scene.lights[0].emitter is not None
    return scene.lights[0].emitter


# --- reading ------------------------------------------------------------------------------------------------------


def test_it_is_read_with_what_multiplies_it(tmp_path: Path) -> None:
    scene = read(tmp_path, "float inputs:intensity = 3\nfloat inputs:exposure = 1\ncolor3f inputs:color = (1, 0.5, 1)\n"
                           "bool inputs:normalize = 1\nfloat inputs:diffuse = 0.5")  # fmt: skip
    light, texture = scene.lights[0], emitter(scene).texture
    assert texture is not None
    assert texture.pixels == pytest.approx(sky(), rel=1e-6)
    assert (texture.colour_space, texture.wrap_s, texture.wrap_t) == ("raw", "repeat", "clamp")
    assert light.intensity == pytest.approx((6.0, 3.0, 6.0)), "normalize is none of a dome's"
    assert light.diffuse == 0.5
    assert {"dome_light", "dome_texture"} <= needs(scene)


@pytest.mark.parametrize(
    ("kind", "up", "body", "top"),
    [
        ("DomeLight", "Y", "", (0, 1, 0)),
        ("DomeLight", "Z", "", (0, 1, 0)),  # of the older schema the pole is +Y, whatever is up
        ("DomeLight_1", "Y", "", (0, 1, 0)),
        ("DomeLight_1", "Z", "", (0, 0, 1)),
        ("DomeLight_1", "Z", 'uniform token poleAxis = "Y"', (0, 1, 0)),
        ("DomeLight_1", "Y", 'uniform token poleAxis = "Z"', (0, 0, 1)),
        ("DomeLight", "Z", 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]', (0, 0, 1)),
        ("DomeLight", "Y", "float xformOp:scale = 2\nuniform token[] xformOpOrder = []", (0, 1, 0)),
    ],
)
def test_where_its_pole_points(tmp_path: Path, kind: str, up: str, body: str, top: tuple[float, ...]) -> None:
    axes = emitter(read(tmp_path, body, kind, up)).axes
    assert axes[1] == pytest.approx(top, abs=1e-12)
    assert axes[0] == pytest.approx((1, 0, 0), abs=1e-12), "it turns about x"
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)


def test_the_colour_space_is_the_metadata_or_the_files_kind(tmp_path: Path) -> None:
    from notabug.scenes_usd.picture import write_coded

    coded = np.round(255 * encode_srgb(sky())).astype(np.uint8)
    scene = read(tmp_path)
    write_coded(tmp_path / "eight.png", coded, "uint8", {})
    scene = read(tmp_path, file="eight.png")
    assert emitter(scene).texture.colour_space == "sRGB"  # type: ignore[union-attr]
    assert emitter(scene).texture.pixels == pytest.approx(sky(), abs=0.005)  # type: ignore[union-attr]
    path = tmp_path / "scene.usda"
    said = path.read_text("utf-8").replace("@./eight.png@", '@./eight.png@ (colorSpace = "raw")')
    path.write_text(said, "utf-8")
    raw = emitter(read_stage(path, "own", {})).texture
    assert raw is not None
    assert raw.colour_space == "raw"
    assert raw.pixels == pytest.approx(coded / 255.0, abs=1e-9)


@pytest.mark.parametrize(
    ("body", "kind", "where", "what"),
    [
        ('token inputs:texture:format = "mirroredBall"', "DomeLight", "inputs:texture:format", "not supported"),
        ('token inputs:texture:format = "angular"', "DomeLight", "inputs:texture:format", "latlong"),
        ('token inputs:texture:format = "cubeMapVerticalCross"', "DomeLight", "inputs:texture:format", "latlong"),
        ('uniform token poleAxis = "X"', "DomeLight_1", "poleAxis", "no such axis"),
        (
            'float3 xformOp:scale = (1, 2, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]',
            "DomeLight",
            "xformOpOrder",
            "scaled unevenly",
        ),
    ],
)
def test_what_is_refused_is_told_in_one_line(tmp_path: Path, body: str, kind: str, where: str, what: str) -> None:
    with pytest.raises(SceneError, match=what) as told:
        read(tmp_path, body, kind)
    assert told.value.where == f"/World/Sky.{where}"
    assert "\n" not in str(told.value)


def test_a_picture_with_what_no_light_has_is_refused(tmp_path: Path) -> None:
    read(tmp_path)
    write_exr(tmp_path / "sky.exr", np.full((4, 8, 3), -1.0))
    with pytest.raises(SceneError, match="out of range"):
        read_stage(tmp_path / "scene.usda", "own", {})
    with pytest.raises(SceneError, match="no such texture file"):
        read(tmp_path, file="gone.exr")


def test_it_is_written_as_it_was_read(tmp_path: Path) -> None:
    scene = read(tmp_path, "float inputs:intensity = 2", "DomeLight_1", "Z")
    again = read_stage(write_scene(scene, tmp_path / "again" / "again.usda"), "own", {})
    assert emitter(again).axes == pytest.approx(emitter(scene).axes, abs=1e-12)
    assert np.array_equal(emitter(again).texture.pixels, emitter(scene).texture.pixels)  # type: ignore[union-attr]
    assert again.lights[0].intensity == scene.lights[0].intensity
    assert scene.digest() != replace(scene, lights=(replace(scene.lights[0], emitter=Emitter()),)).digest()


def test_a_portal_changes_nothing_and_is_told_once(tmp_path: Path) -> None:
    plain = read(tmp_path)
    path = tmp_path / "scene.usda"
    path.write_text(
        path.read_text("utf-8").replace("    def Camera", '    def PortalLight "Door"\n    {\n    }\n    def Camera')
    )
    survey = survey_stage(path, "own", {})
    assert survey.scene is not None
    assert [light.path for light in survey.scene.lights] == [light.path for light in plain.lights]
    assert [remark.kind for remark in survey.remarks if "Door" in remark.where] == ["not read"]


@pytest.mark.parametrize(
    "pixels", [np.full((1, 1, 3), 0.5), np.full((1, 3, 3), 0.5), np.zeros((2, 4, 3)), np.eye(3)[:, :, None]]
)
def test_pictures_of_any_shape_are_drawn(tmp_path: Path, pixels: Floats) -> None:
    scene = read(tmp_path)
    write_exr(tmp_path / "sky.exr", np.broadcast_to(pixels, (*pixels.shape[:2], 3)).copy())
    scene = replace(read_stage(tmp_path / "scene.usda", "own", {}), width=6, height=6)
    for dtype in (np.float64, np.float32):
        shown = trace_picture(scene, dtype=dtype)
        assert np.isfinite(shown).all()
        assert (shown.max() > 0) == bool(pixels.any())
    for model in models(scene):
        assert np.isfinite(trace_picture(*configured(scene, (model,)))).all()


# --- judging ------------------------------------------------------------------------------------------------------


def test_what_is_right_passes(studio: Any, tmp_path: Path) -> None:
    scene, inhouse = read(tmp_path), InHouse()
    assert studio.verdict(studio.draw(inhouse, scene, CENTRES), scene, inhouse.declaration(CENTRES)).word == "pass"


@pytest.mark.parametrize(
    "fault",
    ["dome_turned", "dome_mirrored", "dome_upside_down", "dome_pole", "dome_texture_ignored", "dome_map_as_srgb"],
)
def test_a_fault_is_named(studio: Any, tmp_path: Path, fault: str) -> None:
    scene, inhouse = read(tmp_path), InHouse(faults=(fault,))
    verdict = studio.verdict(studio.draw(inhouse, scene, CENTRES), scene, inhouse.declaration(CENTRES))
    assert verdict.word == "bug"
    assert verdict.findings[0].name == fault


def test_poles_at_the_centres_of_rows_are_a_convention(studio: Any, tmp_path: Path) -> None:
    scene, inhouse = read(tmp_path), InHouse(faults=("dome_rows_at_poles",))
    verdict = studio.verdict(studio.draw(inhouse, scene, CENTRES), scene, inhouse.declaration(CENTRES))
    assert (verdict.word, [each.name for each in verdict.findings]) == ("pass", ["dome_rows_at_poles"])


def test_a_dome_that_is_turned_by_180_degrees_is_a_bug(studio: Any, tmp_path: Path) -> None:
    scene, inhouse = read(tmp_path), InHouse()
    turned = [model for model in models(scene) if model.name == "dome_turned"]
    drawn, _ = configured(scene, (turned[1],))
    verdict = studio.verdict(studio.draw(inhouse, drawn, CENTRES), scene, inhouse.declaration(CENTRES))
    assert (verdict.word, verdict.findings[0].name) == ("bug", "dome_turned")


def mitsuba(folder: Path, drawn: Scene, meant: Scene) -> Any:
    who, quality = adapter("mitsuba"), Quality(samples=64, seeds=(0, 1, 2, 3))
    try:
        who.find()
    except NotabugError as error:
        pytest.skip(str(error))
    pictures = [read_picture(each.image).pixels for each in who.render(drawn, folder, quality)]
    return judge(pictures, meant, who.declaration(quality), perceive=False).verdict


@pytest.mark.parametrize(("kind", "up"), [("DomeLight", "Y"), ("DomeLight_1", "Z")])
def test_mitsuba_draws_it_rightly(tmp_path: Path, kind: str, up: str) -> None:
    turn = 'float xformOp:rotateY = 50\nuniform token[] xformOpOrder = ["xformOp:rotateY"]'
    scene = read(tmp_path, turn, kind, up)
    assert mitsuba(tmp_path, scene, scene).word == "pass"


def test_mitsuba_with_its_dome_turned_is_a_bug(tmp_path: Path) -> None:
    scene = read(tmp_path)
    turned = next(model for model in models(scene) if model.name == "dome_turned")
    verdict = mitsuba(tmp_path, configured(scene, (turned,))[0], scene)
    assert (verdict.word, verdict.findings[0].name) == ("bug", "dome_turned")


def test_who_lacks_it_says_so(tmp_path: Path) -> None:
    scene = read(tmp_path)
    for name in ("povray", "vtk", "threejs"):
        with pytest.raises(NotabugError, match="dome_texture"):
            check_supported(adapter(name), scene)
    folder = tmp_path / "out"
    folder.mkdir()
    export(scene, "json", folder)
    said = (folder / "scene.json").read_text("utf-8")
    assert '"picture": "sky0.pfm"' in said
    assert read_picture(folder / "sky0.pfm").pixels == pytest.approx(sky(), rel=1e-6)
    with pytest.raises(NotabugError, match="/World/Sky"):
        export(scene, "gltf", tmp_path)
