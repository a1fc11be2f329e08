"""Light linking: what a light leaves out is as if the light, or its shadow there, were not in the scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from notabug.adapters.export.description import describe
from notabug.adapters.registry import adapters, needs
from notabug.references.models.model import models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import Options, trace_envelope, trace_picture
from notabug.references.tracer.flatten import flatten
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.scene import Camera, Card, Emitter, Light, Material, Mesh, Scene, Sphere
from notabug.scenes_usd.writer import write_scene

BALL, FLOOR = "/World/Ball", "/World/Floor"


def key(kind: str = "point") -> Light:
    place = (1.5, 0.5, 4.0)
    if kind == "sphere":
        return Light("/World/Key", "sphere", (9.0,) * 3, position=place, emitter=Emitter(0.3 * np.eye(3)))
    return Light("/World/Key", "point", (20.0,) * 3, position=place)


FILL = Light("/World/Fill", "distant", (0.5, 0.4, 0.3), direction=(0.0, 0.6, -0.8))


def scene_of(*lights: Light, ball: bool = True) -> Scene:
    frame = np.eye(4)
    frame[3, 2] = 6.0
    camera = Camera("/World/Camera", frame, 0.4, 0.4, 0.1, 100.0)
    points = np.array([(-3.0, -3.0, -1.0), (3.0, -3.0, -1.0), (3.0, 3.0, -1.0), (-3.0, 3.0, -1.0)])
    floor = Mesh(FLOOR, points, np.array([4], np.int32), np.arange(4, dtype=np.int32), 0)
    objects = (floor, Sphere(BALL, 0.8, 1, np.eye(4))) if ball else (floor,)
    looks = (Material("/World/White", (0.8, 0.8, 0.8)), Material("/World/Red", (0.7, 0.2, 0.1)))
    return Scene("x", Path(), {}, Card("own", ""), camera, 16, 16, objects, lights, looks)


@pytest.mark.parametrize("kind", ["point", "sphere"])
def test_an_object_that_a_light_leaves_out_sees_the_other_lights_alone(kind: str) -> None:
    """On the ball the picture is that of the fill alone, on the floor that of both, shadows of the ball included."""
    lamp = key(kind)
    both, fill = trace_picture(scene_of(lamp, FILL)), trace_picture(scene_of(FILL))
    found = trace_picture(scene_of(replace(lamp, unlit=(BALL,)), FILL))
    on_ball = trace_envelope(scene_of(FILL)).ids & 0xFFFF == trace_envelope(scene_of(FILL)).ids[8, 8] & 0xFFFF
    assert 10 < on_ball.sum() < 200
    assert found[on_ball] == pytest.approx(fill[on_ball], rel=1e-9)
    assert found[~on_ball] == pytest.approx(both[~on_ball], rel=0.02, abs=1e-3)


@pytest.mark.parametrize("kind", ["point", "sphere"])
def test_an_object_that_casts_no_shadow_of_a_light(kind: str) -> None:
    """Of the key: beside the ball the floor is as if the ball were gone."""
    lamp = replace(key(kind), unshadowing=(BALL,))
    found, without = trace_picture(scene_of(lamp)), trace_picture(scene_of(key(kind), ball=False))
    ids = trace_envelope(scene_of(FILL)).ids & 0xFFFF
    beside = ids != ids[8, 8]
    assert found[beside] == pytest.approx(without[beside], rel=1e-9)
    shadowed = trace_picture(scene_of(key(kind)))
    assert (shadowed[beside] < 0.5 * found[beside]).any(), "there was a shadow"


def test_a_scene_without_links_has_no_mask() -> None:
    assert flatten(scene_of(key(), FILL)).links is None
    assert flatten(scene_of(key(), FILL)).emitters is None, "and pays for nothing"
    linked = flatten(scene_of(replace(key(), unlit=(BALL,)), replace(FILL, unshadowing=(FLOOR, BALL))))
    assert linked.links.tolist() == [[0, 1], [2, 2]]
    assert scene_of(key()).digest() != scene_of(replace(key(), unlit=(BALL,))).digest()


def test_the_faults_are_there_where_there_are_links_alone() -> None:
    plain = {model.name for model in models(scene_of(key(), FILL))}
    assert not {"light_link_ignored", "shadow_link_ignored"} & plain
    scene = scene_of(replace(key(), unlit=(BALL,), unshadowing=(BALL,)), FILL)
    by_name = {model.name: model for model in models(scene)}
    lit = configured(scene, (by_name["light_link_ignored"],))[0].lights[0]
    assert (lit.unlit, lit.unshadowing) == ((), (BALL,))
    dark = configured(scene, (by_name["shadow_link_ignored"],))[0].lights[0]
    assert (dark.unlit, dark.unshadowing) == ((BALL,), ())
    assert np.isfinite(trace_envelope(scene, Options()).mean).all()


STAGE = """#usda 1.0
(
    defaultPrim = "World"
)
def Xform "World"
{
    def Xform "Group"
    {
        def Sphere "Ball"
        {
        }
        def Cube "Box"
        {
            double3 xformOp:translate = (2, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1)]
        uniform token subdivisionScheme = "none"
    }
    def PointInstancer "Many"
    {
        rel prototypes = [</World/Many/Dot>]
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 2, 0), (1, 2, 0)]
        def Sphere "Dot"
        {
            double radius = 0.2
        }
    }
    def SphereLight "Key"
    {
        float inputs:intensity = 100
        bool treatAsPoint = 1
        LINK
        double3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
"""
DOTS = ("/World/Many_Dot_0", "/World/Many_Dot_1")
WHOLE = ("/World/Group/Ball", "/World/Group/Box", "/World/Floor", *DOTS)
ONLY = "uniform bool collection:lightLink:includeRoot = 0\n"


def read(folder: Path, link: str) -> Scene:
    path = folder / "scene.usda"
    path.write_text(STAGE.replace("LINK", link), "utf-8")
    return read_stage(path, "own", {})


@pytest.mark.parametrize(
    ("link", "unlit"),
    [
        ("", ()),
        ("rel collection:lightLink:excludes = </World/Floor>", ("/World/Floor",)),
        ("rel collection:lightLink:excludes = </World/Group>", ("/World/Group/Ball", "/World/Group/Box")),
        (f"{ONLY}rel collection:lightLink:includes = </World/Group/Ball>", WHOLE[1:]),
        (f"{ONLY}rel collection:lightLink:includes = </World/Many>", WHOLE[:3]),
        (
            f"{ONLY}rel collection:lightLink:includes = </World/Group>\n"
            "rel collection:lightLink:excludes = </World/Group/Box>",
            WHOLE[1:],
        ),
        (
            f'{ONLY}uniform token collection:lightLink:expansionRule = "explicitOnly"\n'
            "rel collection:lightLink:includes = [</World/Group>, </World/Floor>]",
            ("/World/Group/Ball", "/World/Group/Box", *DOTS),
        ),
        (ONLY, WHOLE),
    ],
)
def test_collections_are_read_as_their_schema_says(tmp_path: Path, link: str, unlit: tuple[str, ...]) -> None:
    scene = read(tmp_path, link)
    assert [each.path for each in scene.objects] == list(WHOLE)
    assert scene.lights[0].unlit == unlit
    assert scene.lights[0].unshadowing == ()
    assert ("light_link" in needs(scene)) == bool(unlit)
    shadows = read(tmp_path, link.replace("lightLink", "shadowLink"))
    assert (shadows.lights[0].unlit, shadows.lights[0].unshadowing) == ((), unlit)


def test_links_are_written_as_they_were_read(tmp_path: Path) -> None:
    link = "rel collection:lightLink:excludes = </World/Many>\nrel collection:shadowLink:excludes = </World/Group>"
    scene = read(tmp_path, link)
    again = read_stage(write_scene(scene, tmp_path / "again.usda"), "own", {}).lights[0]
    assert (again.unlit, again.unshadowing) == (scene.lights[0].unlit, scene.lights[0].unshadowing) == (DOTS, WHOLE[:2])
    said = describe(scene)["lights"][0]  # type: ignore[index]
    assert (said["unlit"], said["unshadowing"]) == ([3, 4], [0, 1])


def test_light_filters_are_still_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="light filters are not supported"):
        read(tmp_path, "rel light:filters = </World/Floor>")


def test_who_has_them(tmp_path: Path) -> None:
    scene = read(tmp_path, "rel collection:lightLink:excludes = </World/Floor>")
    able = {name for name, who in adapters().items() if "light_link" in who.capabilities}
    assert {"inhouse", "cycles"} <= able
    assert not {"mitsuba", "povray", "threejs", "opengl"} & able
    assert needs(scene) >= {"light_link"}
