"""A team's own files: what reads as it is, what ``adapt`` makes judgeable, and that ``check`` tells all at once."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np
import pytest
from typer.testing import CliRunner

from notabug.cli import app, main
from notabug.scenes_usd import reader_stage
from notabug.scenes_usd.adapted import adapt
from notabug.scenes_usd.errors import ManyFaultsError, SceneError, SelectionError
from notabug.scenes_usd.own import as_usd, take_scene
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader_stage import read_stage, survey_stage
from notabug.scenes_usd.scene import Material, Mesh, Preview, Scene, Sphere
from notabug.scenes_usd.view import View
from notabug.scenes_usd.writer import write_scene

DOCS = Path(__file__).resolve().parents[2] / "docs"


def _load(name: str) -> ModuleType:
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


own = _load("own_features")
script = _load("own_scenes")  # which imports the other, as a script beside it
NAMES = [feature.name for feature in own.FEATURES]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made: dict[str, Path] = script.write(tmp_path_factory.mktemp("features"))
    return made


def read(files: dict[str, Path], name: str) -> Scene:
    return read_stage(files[name], "own", {})


def meshes(scene: Scene) -> list[Mesh]:
    return [each for each in scene.objects if isinstance(each, Mesh)]


@pytest.mark.parametrize("feature", own.FEATURES, ids=NAMES)
def test_feature(feature: Any, files: dict[str, Path]) -> None:
    assert script.state_of(files[feature.name]) == feature.state


def test_the_table_of_the_docs_is_this_list() -> None:
    text = (DOCS / "own-scenes.md").read_text("utf-8")
    for row in script.table():
        assert row in text
    states = [feature.state for feature in own.FEATURES]
    assert f"{states.count('read')} of the {len(states)}" in text
    assert f"{states.count('adapted')} more" in text


def test_a_primvar_reader_finds_what_each_prim_says(tmp_path: Path) -> None:
    colour = "\n    color3f[] primvars:displayColor = [(0.2, 0.4, 0.6)]"
    look = own.shader(
        f"color3f inputs:diffuseColor.connect = </World/Look/Colour.outputs:result>\n{own.LAMBERT}", own.READER
    )
    shapes = own.mesh(own.BOX + own.NONE + own.COLOUR) + own.mesh(own.SQUARE + own.NONE + colour, "Other")
    shapes += own.mesh(own.SQUARE + own.NONE, "Bare") + own.mesh(own.SQUARE + own.NONE + colour, "Last")
    path = tmp_path / "many.usda"
    path.write_text(own.Feature("material", "many", "read", shapes, look).text, "utf-8")
    scene = read_stage(path, "own", {})
    found = [scene.materials[each.material].diffuse for each in meshes(scene)]
    assert np.allclose(found, [(0.7, 0.3, 0.2), (0.2, 0.4, 0.6), (1, 0, 1), (0.2, 0.4, 0.6)], atol=1e-7)
    again = read_stage(write_scene(scene, tmp_path / "again.usda"), "own", {})
    assert [again.materials[each.material].diffuse for each in meshes(again)] == found


def test_a_primvar_reader_of_what_varies_is_told(tmp_path: Path) -> None:
    look = own.shader(
        f"color3f inputs:diffuseColor.connect = </World/Look/Colour.outputs:result>\n{own.LAMBERT}", own.READER
    )
    varying = f'\n    color3f[] primvars:displayColor = {own.VERTICES} (interpolation = "vertex")'
    path = tmp_path / "varying.usda"
    path.write_text(own.Feature("material", "varying", "adapted", own.mesh(own.BOX + own.NONE + varying), look).text)
    with pytest.raises(SceneError, match="varies over the surface"):
        read_stage(path, "own", {})
    assert script.state_of(path) == "adapted"


@pytest.mark.parametrize(
    ("said", "got"),
    [
        ("uniform asset info:mdl:sourceAsset = @OmniPBR.mdl@", "got OmniPBR.mdl"),
        ("uniform asset info:sourceAsset = @gold.osl@", "got gold.osl"),
        ('uniform token info:id = "ND_standard_surface_surfaceshader"', "got ND_standard_surface_surfaceshader"),
        ("", "got a shader without an id"),
    ],
)
def test_a_shader_that_is_not_drawn_is_named(said: str, got: str, tmp_path: Path) -> None:
    source = "" if "info:id" in said else 'uniform token info:implementationSource = "sourceAsset"\n'
    other = source + said
    text = own.Feature("material", "other", "adapted", own.mesh(own.BOX + own.NONE), own.shader(own.LAMBERT)).text
    assert 'uniform token info:id = "UsdPreviewSurface"' in text
    path = tmp_path / "other.usda"
    path.write_text(text.replace('uniform token info:id = "UsdPreviewSurface"', other), "utf-8")
    with pytest.raises(SceneError, match=got):
        read_stage(path, "own", {})


# --- what the features look like once they are read ---------------------------------------------------------------


def test_subsets_split_a_mesh_and_lose_no_face(files: dict[str, Path]) -> None:
    scene = read(files, "GeomSubset material bindings")
    parts = {each.path: (len(each.counts), scene.materials[each.material].path) for each in meshes(scene)}
    assert parts == {
        "/World/Shape": (1, "/World/Look"),
        "/World/Shape_Sides": (3, "/World/Look"),
        "/World/Shape_Rest": (2, "/World/Other"),
    }
    smooth = read(files, "GeomSubset on a subdivision surface")
    counts = {each.path: len(each.counts) for each in meshes(smooth)}
    assert counts["/World/Shape_Sides"] == 3 * counts["/World/Shape"]


def test_instances_are_placed_and_hidden_ones_are_not(files: dict[str, Path]) -> None:
    scene = read(files, "PointInstancer, one instance hidden")
    (box,) = meshes(scene)
    (ball,) = (each for each in scene.objects if isinstance(each, Sphere))
    assert box.points.mean(axis=0) == pytest.approx([1, 0, 0], abs=1e-6)
    assert np.ptp(box.points, axis=0) == pytest.approx([0.4, 0.8, 0.4], abs=1e-3), "turned by 90 degrees about y"
    assert ball.to_world[3, :3] == pytest.approx([0, 1, 0])
    paths = [each.path for each in read(files, "nested instances").objects]
    assert paths == ["/World/A/A/Shape"]


def test_solids_are_where_their_formulas_say(files: dict[str, Path]) -> None:
    """Round ones touch their surface with every corner, and no facet is off by a tenth of a pixel."""
    for name in ("Cylinder", "Cone", "Capsule"):
        scene = read(files, name)
        (mesh,) = meshes(scene)
        x, y, z = mesh.points.T
        away = np.hypot(x, y)
        outside = {
            "Cylinder": np.maximum(away - 1.0, np.abs(z) - 1.0),
            "Cone": np.maximum((away - (1.0 - z) / 2.0) * 2.0 / np.sqrt(5.0), np.abs(z) - 1.0),
            "Capsule": np.hypot(away, np.maximum(np.abs(z) - 0.5, 0.0)) - 0.5,
        }[name]
        assert outside.max() < 1e-12, name
        quads = mesh.points[mesh.corners][np.repeat(mesh.counts == 4, mesh.counts)].reshape(-1, 4, 3)
        normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
        assert len(quads) >= 16
        assert ((normal * quads.mean(axis=1)).sum(axis=1) > 0).all(), f"{name} faces outwards"
        pixel = 2.0 * scene.camera.tan_x * 7.0 / scene.width
        if name == "Cylinder":
            middles = (quads + np.roll(quads, -1, axis=1)) / 2.0
            assert (1.0 - np.hypot(middles[..., 0], middles[..., 1])).max() < 0.1 * pixel
    (box,) = meshes(read(files, "Cube"))
    assert np.ptp(box.points, axis=0).tolist() == [2, 2, 2]
    (plane,) = meshes(read(files, "Plane"))
    assert plane.points[:, 2].tolist() == [0] * 4


def test_display_colour_is_a_lambertian(files: dict[str, Path]) -> None:
    (material,) = read(files, "displayOpacity").materials
    assert material.diffuse == pytest.approx((0.7, 0.3, 0.2))
    assert material.opacity == 0.5
    (grey,) = read(files, "neither material nor displayColor").materials
    assert grey.diffuse == (0.18, 0.18, 0.18)


def test_a_colour_for_each_face_makes_parts(files: dict[str, Path]) -> None:
    scene = read(files, "displayColor per face")
    shown = {scene.materials[each.material].diffuse: len(each.counts) for each in meshes(scene)}
    assert shown == {(1.0, 0.0, 0.0): 3, (0.0, 1.0, 0.0): 2, (0.0, 0.0, 1.0): 1}


def test_an_instance_without_a_size_is_not_drawn(files: dict[str, Path], tmp_path: Path) -> None:
    text = files["PointInstancer, one instance hidden"].read_text("utf-8")
    path = tmp_path / "flat.usda"
    path.write_text(text.replace("(0.2, 0.4, 0.2)]", "(0.2, 0, 0.2)]"), "utf-8")
    survey = survey_stage(path, "own", {})
    assert survey.scene is not None
    assert [type(each) for each in survey.scene.objects] == [Sphere]
    assert [(each.kind, each.where) for each in survey.remarks] == [("not read", "/World/Many.scales")]


def test_left_handed_faces_are_turned_round(files: dict[str, Path]) -> None:
    plain = meshes(read(files, "UsdPreviewSurface, diffuse"))[0]
    turned = meshes(read(files, "leftHanded"))[0]
    assert turned.corners[:4].tolist() == plain.corners[:4][[0, 3, 2, 1]].tolist()


def wrapped(index: int, size: int, wrap: str) -> int | None:
    """The texel that an index stands for; None where it is black."""
    if wrap == "black":
        return index if 0 <= index < size else None
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    times, rest = divmod(index, size)
    return size - 1 - rest if wrap == "mirror" and times % 2 else rest


def lookup(scene: Scene, at: tuple[float, float]) -> Any:
    """The texture's colour at the square's own coordinates ``at``, bilinear, by the scene's arrays alone."""
    (mesh,) = meshes(scene)
    assert mesh.uv is not None
    origin, across, up = mesh.uv[0], mesh.uv[1] - mesh.uv[0], mesh.uv[3] - mesh.uv[0]
    u, v = origin + at[0] * across + at[1] * up
    texture = scene.textures[0]
    height, width = texture.pixels.shape[:2]
    x, y = u * width - 0.5, (1.0 - v) * height - 0.5
    i, j = int(np.floor(x)), int(np.floor(y))
    total = np.zeros(3)
    for row, share_y in ((j, 1 - (y - j)), (j + 1, y - j)):
        for column, share_x in ((i, 1 - (x - i)), (i + 1, x - i)):
            r, c = wrapped(row, height, texture.wrap_t), wrapped(column, width, texture.wrap_s)
            if r is not None and c is not None:
                total += share_x * share_y * texture.pixels[r, c]
    return total


def test_textures_are_looked_up_as_the_specification_says(files: dict[str, Path], tmp_path: Path) -> None:
    plain = read(files, "coordinates called UVMap")
    here = lookup(plain, (0.3, 0.4))
    assert lookup(read(files, "scale and bias"), (0.3, 0.4)) == pytest.approx(0.5 * here + 0.2)
    assert lookup(read(files, "wrap mirror"), (0.3, 0.4)) == pytest.approx(here)
    assert lookup(read(files, "wrap mirror"), (1.3, 0.4)) == pytest.approx(lookup(plain, (0.7, 0.4)))
    assert lookup(read(files, "wrap mirror"), (0.3, -0.4)) == pytest.approx(here)
    assert lookup(read(files, "wrap black"), (0.3, 0.4)) == pytest.approx(here)
    assert lookup(read(files, "wrap black"), (1.3, 0.4)) == pytest.approx([0, 0, 0])
    assert lookup(read(files, "wrap black"), (1.0, 0.4)) == pytest.approx(
        lookup(read(files, "wrap not said (useMetadata)"), (1.0, 0.4))
    ), "half of it is black"
    assert lookup(read(files, "missing file with a fallback"), (0.3, 0.4)) == pytest.approx([0.5, 0.2, 0.1])
    turn = np.radians(30)
    u, v = 0.3 * 2, 0.4 * 3
    moved = u * np.cos(turn) - v * np.sin(turn) + 0.1, u * np.sin(turn) + v * np.cos(turn) + 0.2
    assert lookup(read(files, "UsdTransform2d"), (0.3, 0.4)) == pytest.approx(lookup(plain, moved))


def test_a_small_light_is_a_point_and_says_so(files: dict[str, Path]) -> None:
    path = files["sphere light too small to tell from a point"]
    remarks = survey_stage(path, "own", {}).remarks
    assert [(each.kind, each.where) for each in remarks] == [("approximated", "/World/Light.treatAsPoint")]
    warm = read(files, "point light with exposure and colour temperature").lights[0]
    assert warm.intensity[0] > warm.intensity[2]
    luminance = np.dot(warm.intensity, (0.2126, 0.7152, 0.0722))
    assert luminance == pytest.approx(60 / 4 * 2, rel=1e-3), "its exposure doubles it, its colour changes no luminance"


def test_lights_with_a_size_have_usdluxs_radiance(files: dict[str, Path], tmp_path: Path) -> None:
    """LightAPI: intensity * 2^exposure * color in nits, with normalize over the area in world space."""
    sun = read(files, "distant light with the sun's angle").lights[0]
    assert sun.emitter is not None
    assert sun.emitter.half_angle == pytest.approx(np.radians(0.53 / 2))
    assert sun.intensity[0] == pytest.approx(2 / (np.pi * np.sin(np.radians(0.53 / 2)) ** 2)), "normalised: in lux"
    bulb = read(files, "sphere light with a radius").lights[0]
    assert bulb.emitter is not None
    assert (bulb.kind, bulb.emitter.normalized) == ("sphere", True)
    assert bulb.intensity[0] == pytest.approx(60 / (4 * np.pi * 0.2**2), rel=1e-6)
    scaled = read(files, "rectangle, scaled and normalised, with its multipliers").lights[0]
    assert scaled.emitter is not None
    assert scaled.intensity[0] == pytest.approx(40 / (2 * 3))
    assert (scaled.diffuse, scaled.specular) == pytest.approx((0.8, 0.5))
    assert scaled.emitter.axes.diagonal() == pytest.approx([1, 1.5, 1])
    dome = read(files, "DomeLight").lights[1]
    assert (dome.kind, dome.intensity) == ("dome", (1.0, 1.0, 1.0))
    for plain, factor in (("", 1.0), ("float inputs:exposure = 3", 8.0), ("bool inputs:normalize = 1", 1 / np.pi)):
        said = f'def DiskLight "More"\n{{\nfloat inputs:radius = 1\n{plain}\n'
        path = tmp_path / "disk.usda"
        path.write_text(files["DiskLight"].read_text("utf-8").replace('def DiskLight "More"\n{\n', said), "utf-8")
        assert read_stage(path, "own", {}).lights[1].intensity[0] == pytest.approx(factor)


@pytest.mark.parametrize(
    "name",
    [
        "sphere light with a radius",
        "distant light with the sun's angle",
        "rectangle, scaled and normalised, with its multipliers",
        "CylinderLight",
        "DomeLight",
        "DomeLight with a texture",
        "spot light",
    ],
)
def test_lights_with_a_size_are_written_as_they_were_read(name: str, files: dict[str, Path], tmp_path: Path) -> None:
    lights = read(files, name).lights
    again = read_stage(write_scene(read(files, name), tmp_path / "again.usda"), "own", {}).lights
    for one, other in zip(lights, again, strict=True):
        assert (one.path, one.kind) == (other.path, other.kind)
        assert other.intensity == pytest.approx(one.intensity, rel=1e-6)
        assert other.position == pytest.approx(one.position)
        assert other.direction == pytest.approx(one.direction, abs=1e-7)
        assert (other.diffuse, other.specular) == pytest.approx((one.diffuse, one.specular))
        assert other.shaping == one.shaping
        assert (one.emitter is None) == (other.emitter is None)
        if one.emitter is not None and other.emitter is not None:
            assert other.emitter.half_angle == pytest.approx(one.emitter.half_angle)
            if one.kind not in ("sun", "dome"):
                assert other.emitter.axes == pytest.approx(one.emitter.axes, abs=1e-7)


# --- check --------------------------------------------------------------------------------------------------------

TEN = {
    "BODY": "float4[] clippingPlanes = [(1, 0, 0, 0)]",
    "two": own.PLAIN_LIGHT
    + own.textured("RectLight").replace('"More"', '"Area"')
    + own.textured("DomeLight").replace('"More"', '"Sky"'),
    "bulb": own.PLAIN_LIGHT.replace('"Light"', '"Bulb"').replace(
        "bool treatAsPoint = 1", "bool treatAsPoint = 1\nbool inputs:shadow:enable = 0"
    ),
    "look": "float inputs:metallic = 2\nfloat inputs:clearcoat = -1\ncolor3f inputs:emissiveColor = (-1, 0, 0)\n"
    "float inputs:displacement = 1",
    "broken": own.mesh(own.SQUARE.replace("[4]", "[3]"), "Broken")
    + own.mesh(own.SQUARE.replace("(1,1,0)", "(1,nan,0)"), "Nan"),
}
FAULTS = [
    "/World/Area.inputs:texture:file",
    "/World/Broken.faceVertexIndices",
    "/World/Bulb.inputs:shadow:enable",
    "/World/Camera.clippingPlanes",
    "/World/Look/Surface.inputs:clearcoat",
    "/World/Look/Surface.inputs:displacement",
    "/World/Look/Surface.inputs:emissiveColor",
    "/World/Look/Surface.inputs:metallic",
    "/World/Nan.points",
    "/World/Sky.inputs:texture:file",
]


@pytest.fixture
def ten(tmp_path: Path) -> Path:
    feature = own.Feature(
        "all",
        "ten",
        "refused",
        shape=own.mesh(own.BOX) + TEN["broken"],
        look=own.shader(TEN["look"]),
        light=TEN["two"] + TEN["bulb"],
        camera=own.CAMERA.replace("BODY", TEN["BODY"]),
    )
    path = tmp_path / "ten.usda"
    path.write_text(feature.text, "utf-8")
    return path


def test_ten_faults_are_told_at_once(ten: Path) -> None:
    with pytest.raises(ManyFaultsError) as caught:
        read_stage(ten, "ten", {})
    assert sorted(each.where for each in caught.value.errors) == FAULTS
    assert "and 9 more" in str(caught.value)


def test_check_prints_them_by_path_and_as_json(ten: Path) -> None:
    result = CliRunner().invoke(app, ["check", str(ten), "--json"])
    assert result.exit_code == 2
    document = json.loads(result.stdout)
    refused = [each for each in document["remarks"] if each["kind"] == "out of the contract"]
    assert [each["where"] for each in refused] == FAULTS
    assert not document["judged"]
    shown = CliRunner().invoke(app, ["check", str(ten)])
    assert [where for where in FAULTS if f"out of the contract: {where}" in shown.stdout] == FAULTS
    assert "notabug adapt" in shown.stdout


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    with mock.patch.object(sys, "argv", ["notabug", *words]), pytest.raises(SystemExit) as ended:
        main()
    return int(ended.value.code or 0), capsys.readouterr().err


def test_judge_prints_the_same_list_once(ten: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What drew the picture saw the file as it is: nothing that the file has is overruled."""
    write_exr(tmp_path / "picture.exr", np.zeros((32, 32, 3)))
    code, printed = said(capsys, "judge", str(tmp_path / "picture.exr"), "--scene", str(ten))
    assert code == 2
    assert [where for where in FAULTS if printed.count(f"{where}: ") == 1] == FAULTS
    assert "Traceback" not in printed


def test_run_prints_once_what_no_adaptation_mends(
    ten: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = ten.read_text("utf-8").replace('defaultPrim = "World"', 'defaultPrim = "World"\nsubLayers = [@./gone.usda@]')
    ten.write_text(text, "utf-8")
    code, printed = said(capsys, "run", str(ten), "-r", "inhouse", "--out", str(tmp_path / "out"))
    assert code == 2
    assert "gone.usda" in printed
    assert "metallic" not in printed, "what is mended is no fault"
    assert printed.count("notabug: ") == 1


# --- adapted in memory --------------------------------------------------------------------------------------------


def test_what_is_adapted_in_memory_is_what_adapt_writes(ten: Path, tmp_path: Path) -> None:
    with pytest.raises(ManyFaultsError):
        take_scene(ten, mends="picture")
    taken = take_scene(ten)
    made = adapt(ten, tmp_path / "own.usda", {}, View())
    assert made.survey.scene is not None
    assert taken.scene.digest() == made.survey.scene.digest()
    assert taken.says == made.says
    assert (taken.scene.adapted, taken.scene.path, taken.scene.id) == ("scene", ten, "ten")
    assert any("adapted in memory" in note for note in taken.scene.notes)
    assert {path.name for path in tmp_path.iterdir()} == {"ten.usda", "own.usda"}, "nothing else is written"


ADAPTED = [feature.name for feature in own.FEATURES if feature.state == "adapted"]
CHOSEN = {"animated points", "animated transform", "two cameras, none named", "variants without a selection"}


@pytest.mark.parametrize("name", ADAPTED)
def test_a_picture_drawn_elsewhere_is_of_the_file_as_it_is(name: str, files: dict[str, Path]) -> None:
    """For it which picture is meant may be chosen, and nothing else; what an adapter draws may be adapted whole."""
    assert take_scene(files[name]).scene.adapted == "scene"
    if name in CHOSEN:
        assert take_scene(files[name], mends="picture").scene.adapted == "picture"
    else:
        with pytest.raises(SceneError):
            take_scene(files[name], mends="picture")


def test_the_picture_at_hand_says_its_size(files: dict[str, Path]) -> None:
    scene = take_scene(files["no render settings"], view=View(size=(40, 24)), mends="picture").scene
    assert (scene.width, scene.height) == (40, 24)
    sized = take_scene(files["fStop (not modelled)"], view=View(size=(40, 24)), mends="picture").scene
    assert (sized.width, sized.height) == (32, 32), "the settings say it"


@pytest.mark.parametrize(
    ("name", "variants", "view"),
    [
        ("two cameras, none named", {}, View(camera="/World/Side")),
        ("animated transform", {}, View(time=12.5)),
        ("animated points", {}, View()),
        ("variants without a selection", {"kind": "b"}, View()),
        ("render and proxy purposes", {}, View(purposes=frozenset({"default", "proxy"}))),
        ("no render settings", {}, View()),
        ("no camera", {}, View()),
        ("metal", {}, View()),
    ],
)
def test_a_renderer_of_usd_gets_what_is_judged(
    name: str, variants: dict[str, str], view: View, files: dict[str, Path], tmp_path: Path
) -> None:
    scene = take_scene(files[name], variants, view).scene
    path = tmp_path / "scene.usda"
    path.write_text(as_usd(scene), "utf-8")
    (tmp_path / "picture.png").write_bytes(files[name].with_name("picture.png").read_bytes())
    again = read_stage(path, "scene", {})
    assert again.camera.to_world == pytest.approx(scene.camera.to_world, abs=1e-6)
    assert (again.width, again.height) == (scene.width, scene.height)
    assert [each.path for each in again.objects] == [each.path for each in scene.objects]
    for one, other in zip(meshes(again), meshes(scene), strict=True):
        assert one.points == pytest.approx(other.points, abs=1e-6)


def test_a_run_reads_a_scene_of_ones_own_once(
    files: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reads: list[str] = []

    def counted(path: Path, *words: Any) -> Scene:
        reads.append(path.name)
        return real(path, *words)

    real = reader_stage.read_stage
    with mock.patch.object(reader_stage, "read_stage", counted):
        path = files["two cameras, none named"]
        words = (
            "run",
            str(path),
            "-r",
            "inhouse",
            "--camera",
            "/World/Side",
            "-j",
            "1",
            "--out",
            str(tmp_path / "out"),
        )
        code, _ = said(capsys, *words)
        assert code == 0
    assert reads.count(path.name) == 1


def test_run_and_judge_tell_what_was_chosen(
    files: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = files["two cameras, none named"], tmp_path / "out"
    code, printed = said(capsys, "run", str(path), "-r", "inhouse", "-j", "1", "--out", str(out))
    assert code == 0
    assert "adapted in memory" in printed
    assert "the first of 2" in printed
    (result,) = json.loads((out / "run.json").read_text("utf-8"))["results"]
    assert any("adapted in memory" in note for note in result["notes"])
    picture = str(out / result["image"])
    code, printed = said(capsys, "judge", picture, "--scene", str(path), "--filter", "point")
    assert code == 0
    assert "the first of 2" in printed
    assert said(capsys, "why", picture, "--pixel", "16,16")[0] == 0


@pytest.mark.parametrize("text", ["", "#usda 1.0\ndef Xform {", "not USD"])
def test_check_of_what_is_no_stage_is_one_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.usda"
    path.write_text(text, "utf-8")
    result = CliRunner().invoke(app, ["check", str(path)])
    assert result.exit_code == 2
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert "bad.usda" in result.stdout


# --- adapt --------------------------------------------------------------------------------------------------------


def test_adapt_edits_nothing_and_what_it_writes_is_judged(ten: Path, tmp_path: Path) -> None:
    before = ten.read_bytes()
    out = tmp_path / "own.usda"
    result = CliRunner().invoke(app, ["adapt", str(ten), "--out", str(out)])
    assert result.exit_code == 0, result.stdout
    assert ten.read_bytes() == before
    scene = read_stage(out, "own", {})
    assert [each.path for each in scene.objects] == ["/World/Shape"], "what is broken is left out"
    assert scene.card.artifact_class == "own"
    assert {each.path for each in scene.lights} == {"/World/Light", "/World/Bulb", "/World/Area", "/World/Sky"}
    again = CliRunner().invoke(app, ["check", str(out)])
    assert again.exit_code == 0, again.stdout


def test_the_picture_can_be_chosen(files: dict[str, Path], tmp_path: Path) -> None:
    path = files["two cameras, none named"]
    made = adapt(path, path.with_name("side.usda"), {}, View(camera="/World/Side"), (64, 48))
    assert made.survey.scene is not None
    scene = made.survey.scene
    assert (scene.camera.path, scene.width, scene.height) == ("/World/Side", 64, 48)
    with pytest.raises(SelectionError, match="/World/Side"):
        adapt(path, path.with_name("none.usda"), {}, View(camera="/World/None"))
    path = files["variants without a selection"]
    made = adapt(path, path.with_name("b.usda"), {"kind": "b"}, View())
    assert made.survey.scene is not None
    assert made.survey.scene.variants == {"kind": "b"}
    path = files["render and proxy purposes"]
    for purposes, expected in (({"render"}, "Shape"), ({"proxy"}, "Proxy")):
        view = View(purposes=frozenset({"default", *purposes}))
        made = adapt(path, path.with_name(f"{expected}.usda"), {}, view)
        assert made.survey.scene is not None
        assert [each.path for each in made.survey.scene.objects] == [f"/World/{expected}"]
        assert [each.path for each in read_stage(path, "own", {}, view).objects] == [f"/World/{expected}"]


def test_a_frame_is_frozen(files: dict[str, Path]) -> None:
    path = files["animated transform"]
    for time, expected in ((1.0, 0.0), (24.0, 1.0), (12.5, np.sqrt(0.5))):
        made = adapt(path, path.with_name("frame.usda"), {}, View(time=time))
        assert made.survey.scene is not None
        assert made.survey.scene.objects[0].to_world[2, 0] == pytest.approx(expected, abs=1e-6)
        seen = read_stage(path, "own", {}, View(time=time)).objects[0]
        assert seen.to_world[2, 0] == pytest.approx(expected, abs=1e-6)


def test_a_scene_without_camera_and_light_gets_both(files: dict[str, Path], tmp_path: Path) -> None:
    text = files["no camera"].read_text("utf-8").replace(own.PLAIN_LIGHT, "")
    path = tmp_path / "bare.usda"
    path.write_text(text, "utf-8")
    made = adapt(path, tmp_path / "own.usda", {}, View())
    scene = made.survey.scene
    assert scene is not None
    assert (scene.camera.path, scene.lights[0].path) == ("/notabug_camera", "/notabug_light")
    (mesh,) = meshes(scene)
    local = (mesh.points - scene.camera.to_world[3, :3]) @ scene.camera.to_world[:3, :3].T
    assert (local[:, 2] < -scene.camera.near).all()
    assert (np.abs(local[:, :2] / local[:, 2:]) < (scene.camera.tan_x, scene.camera.tan_y)).all(), "all of it is seen"
    assert not [each for each in made.survey.remarks if each.kind == "out of the contract"]


@pytest.mark.parametrize("nested", [False, True])
def test_what_is_inside_an_instance_is_overruled(nested: bool, tmp_path: Path) -> None:
    """The instance becomes a prim of its own: an opinion on what several share would have no place."""
    look = own.shader(f"float inputs:displacement = 1\n{own.LAMBERT}").replace("/World/", "/Part/")
    inner = own.mesh(own.BOX + own.NONE, bind="\n    rel material:binding = </Part/Look>")
    (tmp_path / "part.usda").write_text(
        f'#usda 1.0\n(defaultPrim = "Part")\ndef Xform "Part"\n{{\n{look}{inner}}}\n', "utf-8"
    )
    (tmp_path / "nested.usda").write_text(own.NESTED, "utf-8")
    meta = own.INSTANCE.replace("part", "nested") if nested else own.INSTANCE
    shape = own.moved("A", -1, "", meta) + own.moved("B", 1, "", meta)
    path = tmp_path / "scene.usda"
    path.write_text(own.Feature("", "", "adapted", shape=shape, look="").text, "utf-8")
    before = survey_stage(path, "own", {})
    assert [each.where.endswith("inputs:displacement") for each in before.remarks] == [True] * len(before.remarks)
    made = adapt(path, tmp_path / "own.usda", {}, View())
    assert made.survey.scene is not None
    assert len(made.survey.scene.objects) == 2
    assert any("not instanceable" in line for line in made.says)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('defaultPrim = "World"', 'defaultPrim = "World"\nupAxis = 5'),
        ("rel camera = </World/Camera>", "custom int camera = 5"),
        ("uniform int2 resolution = (32, 32)", 'uniform string resolution = "wide"'),
    ],
)
def test_a_value_of_another_type_is_told_by_name(old: str, new: str, files: dict[str, Path], tmp_path: Path) -> None:
    """Neither command ends in a trace, whatever the layer holds."""
    text = files["metal"].read_text("utf-8")
    assert old in text
    path = tmp_path / "typed.usda"
    path.write_text(text.replace(old, new), "utf-8")
    survey_stage(path, "typed", {})
    with contextlib.suppress(SceneError):
        adapt(path, tmp_path / "own.usda", {}, View())


def test_what_the_layer_may_be_is_checked(ten: Path, tmp_path: Path) -> None:
    (tmp_path / "deeper").mkdir()
    for out, says in ((ten, "the scene itself"), (tmp_path / "deeper" / "own.usda", "below its own folder")):
        result = CliRunner().invoke(app, ["adapt", str(ten), "--out", str(out)])
        assert isinstance(result.exception, SelectionError)
        assert says in str(result.exception)
    (tmp_path / "bad.usda").write_text("no USD", "utf-8")
    with pytest.raises(SceneError, match="cannot be opened"):
        adapt(tmp_path / "bad.usda", tmp_path / "own.usda", {}, View())


# --- preview surfaces -----------------------------------------------------------------------------------------------


def surface(files: dict[str, Path], name: str) -> Any:
    (found,) = (each for each in read(files, name).materials if each.path == "/World/Look")
    return found.preview


def test_preview_surfaces_are_read_as_they_are_written(files: dict[str, Path]) -> None:
    default = surface(files, "metallic workflow with roughness (Blender's default)")
    assert (default.specular_workflow, default.metallic, default.roughness, default.ior) == (False, 0.0, 0.5, 1.5)
    assert surface(files, "metal").metallic == 1.0
    glossy = surface(files, "specular workflow, glossy")
    assert glossy.specular_workflow
    assert glossy.specular == pytest.approx((0.2, 0.1, 0.3))
    assert (glossy.roughness, glossy.metallic) == (pytest.approx(0.2), 0.0), "metallic is of the other workflow"
    coat = surface(files, "clearcoat")
    assert (coat.clearcoat, coat.clearcoat_roughness) == (1.0, 0.01)
    assert surface(files, "emission").emission == (1.0, 0.0, 0.0)
    for name in (
        "UsdPreviewSurface, diffuse",
        "opacity",
        "roughness and occlusion maps (without effect on a Lambertian)",
    ):
        assert surface(files, name) is None, "Lambert's, as before"


def test_maps_are_the_channels_that_are_connected(files: dict[str, Path]) -> None:
    scene = read(files, "roughness and metallic maps, packed")
    (found,) = (each.preview for each in scene.materials)
    assert found is not None
    stored = np.arange(40, 88).reshape(4, 4, 3) / 255
    for index, channel in ((found.roughness_map, 1), (found.metallic_map, 2)):
        assert scene.textures[index].pixels == pytest.approx(np.repeat(stored[..., channel, None], 3, axis=2))
    assert meshes(scene)[0].uv is not None
    scene = read(files, "normal map with scale and bias")
    (found,) = (each.preview for each in scene.materials)
    assert found is not None
    assert scene.textures[found.normal_map].pixels == pytest.approx(2 * stored - 1)
    scene = read(files, "emission map")
    (found,) = (each.preview for each in scene.materials)
    assert found is not None
    assert scene.textures[found.emission_map].colour_space == "sRGB"


@pytest.mark.parametrize(
    ("name", "where", "what"),
    [
        ("metal", "/World/Look/Surface", "direct light only"),
        ("clearcoat", "/World/Look/Surface.inputs:clearcoatRoughness", "0.01: whether a sample"),
        ("normal map", "/World/Look/Texture.inputs:sourceColorSpace", "decoded as sRGB"),
        ("roughness and occlusion maps (without effect on a Lambertian)", ".inputs:specularColor", "Lambert's surface"),
    ],
)
def test_what_a_picture_cannot_show_of_it_is_told(name: str, where: str, what: str, files: dict[str, Path]) -> None:
    remarks = survey_stage(files[name], "own", {}).remarks
    assert any(each.kind == "approximated" and each.where.endswith(where) and what in each.what for each in remarks)


def test_a_map_that_cannot_be_read_is_refused_in_one_line(files: dict[str, Path]) -> None:
    with pytest.raises(SceneError, match=r"/World/Look/Surface\.inputs:roughness: looked up elsewhere") as caught:
        read(files, "maps with coordinates of their own")
    assert "use one primvar" in str(caught.value)
    taken = take_scene(files["maps with coordinates of their own"])
    (preview,) = (each.preview for each in taken.scene.materials)
    assert preview is not None
    assert (preview.roughness_map, preview.roughness) == (-1, 0.5), "the schema's own, once the map is gone"


def test_maps_on_a_sphere_are_refused(files: dict[str, Path]) -> None:
    feature = next(each for each in own.FEATURES if each.name == "roughness and metallic maps, packed")
    path = files["metal"].with_name("ball.usda")
    path.write_text(replace(feature, shape=own.solid("Sphere")).text, "utf-8")
    with pytest.raises(SceneError, match=r"/World/Shape\.material:binding: /World/Look has maps"):
        read_stage(path, "own", {})
    assert [type(each) for each in take_scene(path).scene.objects] == [Sphere]


@pytest.mark.parametrize(
    "name",
    [
        *("metal", "clearcoat", "emission", "specular workflow, glossy", "roughness and metallic maps, packed"),
        *("normal map with scale and bias", "emission map"),
    ],
)
def test_written_it_reads_back(name: str, files: dict[str, Path], tmp_path: Path) -> None:
    scene = read(files, name)
    back = read_stage(write_scene(scene, tmp_path / "scene.usda"), "own", {})
    for found, said in zip(back.materials, scene.materials, strict=True):
        assert found.preview is not None
        assert said.preview is not None
        told, meant = asdict(found.preview), asdict(said.preview)
        assert told == {
            key: pytest.approx(value) if isinstance(value, float) else value for key, value in meant.items()
        }
    for index, texture in enumerate(scene.textures):
        assert back.textures[index].pixels == pytest.approx(texture.pixels, abs=1e-7)


def test_textures_are_renumbered_when_others_go() -> None:
    material = Material("/Look", (1.0, 1.0, 1.0), 2, preview=Preview(roughness_map=4, normal_map=1))
    assert material.textures == {1, 2, 4}
    kept = material.renumbered([1, 2, 4])
    assert (kept.texture, kept.preview) == (1, Preview(roughness_map=2, normal_map=0))
    bare = material.renumbered([4])
    assert (bare.texture, bare.preview) == (-1, Preview(roughness_map=0))


CAMERAS = {
    "mirrored": ("float3 xformOp:scale = (-1, 1, 1)", "axes of a left hand"),
    "scaled unevenly": ("float3 xformOp:scale = (1, 2, 1)", "axes 1, 2, 1 long"),
    "sheared by its parent's scale": ("float3 xformOp:scale = (1, 1, 1)", "degrees between"),
    "written with four digits": (
        "matrix4d xformOp:scale = ((0.6859, 0.7277, 0, 0), (-0.324, 0.3054, 0.8953, 0), "
        "(0.6516, -0.6142, 0.4453, 0), (0, 0, 0, 1))",
        "degrees between",
    ),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_a_camera_that_is_no_rotation_is_told_how_and_righted(name: str, tmp_path: Path) -> None:
    """Its eye and where it looks stay, whatever its parents do; nothing of the scene is left out for it."""
    op, told = CAMERAS[name]
    op = op.replace("matrix4d xformOp:scale", "matrix4d xformOp:transform")
    last = "xformOp:transform" if "matrix4d" in op else "xformOp:scale"
    parent = "(1, 3, 1)" if "parent" in name else "(1, 1, 1)"
    path = tmp_path / "scene.usda"
    path.write_text(
        f"""#usda 1.0
def Xform "Rig"
{{
    float3 xformOp:scale = {parent}
    uniform token[] xformOpOrder = ["xformOp:scale"]
    def Camera "Shot"
    {{
        double3 xformOp:translate = (3, 1, 4)
        float3 xformOp:rotateXYZ = (-20, 30, 10)
        {op}
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "{last}"]
    }}
}}
def Sphere "Ball"
{{
}}
def DistantLight "Sun"
{{
    float inputs:angle = 0
}}
"""
    )
    survey = survey_stage(path, "own", {})
    (refused,) = (remark.error for remark in survey.remarks if remark.error is not None)
    assert refused.where == "/Rig/Shot.xformOpOrder"
    assert told in refused.got
    made = adapt(path, tmp_path / "own.usda", {}, View())
    assert not [remark for remark in made.survey.remarks if remark.error is not None], made.says
    scene = read_stage(tmp_path / "own.usda", "own", {})
    turn = scene.camera.to_world[:3, :3]
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(scene.camera.to_world[3, :3], np.array([3, 3 if "parent" in name else 1, 4]), atol=1e-9)
    assert len(scene.objects) == len(scene.lights) == 1
