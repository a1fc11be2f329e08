"""Cameras that are no plain pinhole: a known point lands on a known pixel, in every drawer that says it draws them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdRender

from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.adapters.registry import adapter, needs
from notabug.adapters.requirements import check_supported
from notabug.metrics.leeway import _surface
from notabug.references.models.camera import pixel_shift
from notabug.references.predict import configured
from notabug.references.raster.picture import RasterOptions, raster_depth, raster_picture
from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.references.tracer.probe import probe
from notabug.references.viewing import projected
from notabug.scenes_usd.card import OWN_CARD
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader_camera import read_camera
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.scene import Camera, Floats, Light, Material, Mesh, Scene
from notabug.scenes_usd.transform import transformed
from notabug.scenes_usd.writer import write_scene

WIDTH, HEIGHT = 36, 24
CASES = {
    "pinhole": {},
    "offset": {"horizontalApertureOffset": 4.0, "verticalApertureOffset": -3.0},
    "orthographic": {"projection": "orthographic", "horizontalAperture": 40.0, "verticalAperture": 26.0},
    "orthographic offset": {
        "projection": "orthographic",
        "horizontalAperture": 40.0,
        "verticalAperture": 40.0,
        "horizontalApertureOffset": -5.0,
        "verticalApertureOffset": 6.0,
    },
}
POLICIES = ("expandAperture", "cropAperture", "adjustApertureWidth", "adjustApertureHeight")


def stage_of(lens: dict[str, Any], policy: str, scale: float = 1.0) -> tuple[Usd.Stage, Usd.Prim, Usd.Prim]:
    stage = Usd.Stage.CreateInMemory()
    camera = UsdGeom.Camera.Define(stage, "/Camera")
    for name, value in lens.items():
        camera.GetPrim().GetAttribute(name).Set(value)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.5, 50.0))
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(0.3, 1.0, 0.2), 25.0))
    placed = Gf.Matrix4d().SetScale(scale) * turn * Gf.Matrix4d().SetTranslate(Gf.Vec3d(1.0, -2.0, 3.0))
    camera.AddTransformOp().Set(placed)
    settings = UsdRender.Settings.Define(stage, "/Settings")
    settings.CreateAspectRatioConformPolicyAttr(policy)
    settings.CreateResolutionAttr(Gf.Vec2i(WIDTH, HEIGHT))
    return stage, camera.GetPrim(), settings.GetPrim()


@pytest.mark.parametrize("scale", [1.0, 2.5])
@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("name", CASES)
def test_openusd_puts_points_on_the_same_pixels(name: str, policy: str, scale: float) -> None:
    """The frustum that OpenUSD makes of the same attributes, conformed as UsdRenderSettings words the policy."""
    stage, prim, settings = stage_of(CASES[name], policy, scale)
    camera = read_camera(prim, settings, WIDTH, HEIGHT)
    frustum = UsdGeom.Camera(prim).GetCamera(Usd.TimeCode.Default()).frustum
    window = frustum.GetWindow()
    middle, size = np.array(window.GetMidpoint()), np.array(window.GetSize())
    widest = size[0] / size[1] > WIDTH / HEIGHT
    keeps_height = {
        "expandAperture": not widest,  # the side that is too short grows
        "cropAperture": widest,  # the side that is too long shrinks
        "adjustApertureWidth": True,
        "adjustApertureHeight": False,
    }[policy]
    size = np.array([size[1] * WIDTH / HEIGHT, size[1]] if keeps_height else [size[0], size[0] * HEIGHT / WIDTH])
    frustum.SetWindow(Gf.Range2d(Gf.Vec2d(*(middle - size / 2.0)), Gf.Vec2d(*(middle + size / 2.0))))
    seen = np.array(frustum.ComputeProjectionMatrix(), np.float64)
    view = np.linalg.inv(np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())))
    local = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 3)) * (2.0, 2.0, 3.0) + (0.0, 0.0, -8.0)
    points = local @ camera.to_world[:3, :3] + camera.to_world[3, :3]
    clip = np.c_[points, np.ones(20)] @ view @ seen
    ndc = clip[:, :2] / clip[:, 3:]
    expected = np.stack([(ndc[:, 0] + 1.0) / 2.0 * WIDTH, (1.0 - ndc[:, 1]) / 2.0 * HEIGHT], axis=1)
    found, depth = projected(scene_of(camera), points)
    assert found == pytest.approx(expected, abs=1e-4), "pixels; apertures are float32"
    assert depth == pytest.approx(-local[:, 2])
    assert stage


def scene_of(camera: Camera, objects: tuple[Mesh, ...] = ()) -> Scene:
    light = Light("/Light", "distant", (np.pi,) * 3, direction=tuple((-camera.to_world[2, :3]).tolist()))
    white = Material("/White", (0.8, 0.8, 0.8))
    return Scene("own", Path("own.usda"), {}, OWN_CARD, camera, WIDTH, HEIGHT, objects, (light,), (white,))


def camera_of(name: str) -> Camera:
    _, prim, settings = stage_of(CASES[name], "expandAperture")
    return read_camera(prim, settings, WIDTH, HEIGHT)


def facing(camera: Camera, at: Floats, half: float) -> Mesh:
    """A square that faces the camera, its middle at ``at`` in the camera's own frame."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half + at
    points = np.ascontiguousarray(corners @ camera.to_world[:3, :3] + camera.to_world[3, :3])
    return Mesh("/Square", points, np.array([4], np.int32), np.arange(4, dtype=np.int32), 0)


PIXELS = ((4, 3), (30, 5), (17, 20))
DEPTH = 7.0


def square_at(camera: Camera, pixel: tuple[int, int], depth: float = DEPTH) -> Scene:
    """A scene whose one square, three pixels wide, has its middle at the middle of ``pixel``: by the closed form."""
    x = 2.0 * (pixel[0] + 0.5) / WIDTH - 1.0 + camera.shift_x
    y = 1.0 - 2.0 * (pixel[1] + 0.5) / HEIGHT + camera.shift_y
    span = 1.0 if camera.orthographic else depth
    at = np.array([x * camera.tan_x * span, y * camera.tan_y * span, -depth])
    return scene_of(camera, (facing(camera, at, 3.0 * camera.tan_x * span / WIDTH),))


def lit(pixels: Any) -> set[tuple[int, int]]:
    return {(int(x), int(y)) for y, x in np.argwhere(np.asarray(pixels)[..., 0] > 0.1)}


def block(pixel: tuple[int, int]) -> set[tuple[int, int]]:
    return {(pixel[0] + i, pixel[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)}


@pytest.mark.parametrize("pixel", PIXELS, ids=str)
@pytest.mark.parametrize("name", CASES)
def test_a_known_point_lands_on_a_known_pixel(name: str, pixel: tuple[int, int]) -> None:
    camera = camera_of(name)
    scene = square_at(camera, pixel)
    for dtype in (np.float32, np.float64):
        assert lit(trace_picture(*configured(scene, ()), dtype=dtype)) == block(pixel)
        assert lit(raster_picture(scene, RasterOptions(), dtype=dtype)) == block(pixel)
    told = probe(scene, Options(), pixel[0] + 0.5, pixel[1] + 0.5)
    assert told.depth == pytest.approx(DEPTH)
    stored = raster_depth(scene, RasterOptions(depth="exact")).depth[pixel[1], pixel[0]]
    near, far = camera.near, camera.far
    expected = (DEPTH - near) / (far - near) * (1.0 if camera.orthographic else far / DEPTH)
    assert stored == pytest.approx(expected)


@pytest.mark.parametrize("name", CASES)
def test_near_and_far_cut_along_the_axis(name: str) -> None:
    camera = camera_of(name)
    for depth, seen in ((camera.near * 0.99, False), (camera.near * 1.01, True), (camera.far * 1.01, False)):
        scene = square_at(camera, PIXELS[1], depth)
        assert bool(lit(trace_picture(*configured(scene, ())))) is seen
        assert bool(lit(raster_picture(scene))) is seen


@pytest.mark.parametrize("name", CASES)
def test_places_and_normals_of_the_margins_are_where_they_are(name: str) -> None:
    scene = square_at(camera_of(name), PIXELS[0])
    place, _, depth = _surface(scene)
    x, y = PIXELS[0]
    assert depth[y, x] == pytest.approx(DEPTH, rel=1e-5)
    assert projected(scene, place)[0][y, x] == pytest.approx((x + 0.5, y + 0.5), abs=1e-3)


@pytest.mark.parametrize("name", CASES)
def test_a_shifted_picture_and_a_larger_world(name: str, tmp_path: Path) -> None:
    scene = square_at(camera_of(name), (17, 10))
    moved = pixel_shift(WIDTH, HEIGHT, 4.0, 2.0).edit(scene)
    assert lit(trace_picture(*configured(moved, ()))) == block((21, 12))
    matrix = np.diag([3.0, 3.0, 3.0, 1.0])
    matrix[3, :3] = 1.0, 2.0, 3.0
    assert lit(trace_picture(*configured(transformed(scene, matrix), ()))) == block((17, 10))
    again = read_stage(write_scene(scene, tmp_path / "scene.usda"), "scene", {})
    for field in ("tan_x", "tan_y", "shift_x", "shift_y", "near", "far"):
        assert getattr(again.camera, field) == pytest.approx(getattr(scene.camera, field), rel=1e-6)
    assert again.camera.orthographic is scene.camera.orthographic


def test_highlights_of_parallel_rays_have_one_view_vector() -> None:
    """A flat glossy square under a distant light is of one colour where rays are parallel."""
    camera = camera_of("orthographic")
    square = facing(camera, np.array([0.0, 0.0, -DEPTH]), 5.0)
    glossy = Material("/Glossy", (0.1,) * 3, specular=(0.9,) * 3, exponent=40.0)
    scene = replace(scene_of(camera, (square,)), materials=(glossy,))
    for picture in (trace_picture(*configured(scene, ())), raster_picture(scene)):
        assert np.ptp(picture[..., 0]) == pytest.approx(0.0, abs=1e-12)
        assert picture[0, 0, 0] == pytest.approx(1.0, rel=1e-9)
    pinhole = replace(scene, camera=camera_of("pinhole"))
    assert np.ptp(trace_picture(*configured(pinhole, ()))[..., 0]) > 0.01


def test_who_does_not_draw_such_a_camera_says_so() -> None:
    for name, word in (("orthographic", "orthographic"), ("offset", "aperture_offset")):
        scene = square_at(camera_of(name), PIXELS[0])
        assert word in needs(scene)
        for renderer in ("pygfx", "vtk", "panda3d", "tachyon"):
            with pytest.raises(UnsupportedError, match=word):
                check_supported(adapter(renderer), scene)
    assert not needs(square_at(camera_of("pinhole"), PIXELS[0])) & {"orthographic", "aperture_offset"}


@pytest.mark.parametrize("renderer", ["inhouse", "zbuffer", "povray", "mitsuba", "opengl"])
def test_renderers_draw_them_where_the_closed_form_says(renderer: str, tmp_path: Path) -> None:
    who = adapter(renderer)
    try:
        who.find()
    except RendererMissingError as error:
        pytest.skip(str(error))
    drawn = 0
    for name in CASES:
        camera = replace(camera_of(name), tan_y=camera_of(name).tan_x * HEIGHT / WIDTH)
        scene = square_at(camera, PIXELS[1])
        if needs(scene) - who.capabilities:
            continue
        folder = tmp_path / name.replace(" ", "_")
        folder.mkdir()
        made = who.render(scene, folder, Quality(samples=4, seeds=(0,), threads=1))
        assert lit(read_picture(made[0].image).pixels) == block(PIXELS[1]), name
        drawn += 1
    assert drawn >= 2
