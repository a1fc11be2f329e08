"""Capabilities that do not go together, and spheres as meshes: of configured renderers and of known ones."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.babylon import Babylon
from notabug.adapters.base import Apart, Quality, UnsupportedError
from notabug.adapters.command import Command
from notabug.adapters.config import ConfigError, Table
from notabug.adapters.configured import configured
from notabug.adapters.export.formats import export
from notabug.adapters.requirements import check_supported, not_together
from notabug.adapters.spheres import AROUND, as_given, with_meshes
from notabug.adapters.tachyon import Tachyon
from notabug.adapters.zbuffer import ZBuffer
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.results.alike import alike
from notabug.results.record import Result
from notabug.runs.judge_files import judge_pictures
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Sphere

DRAWS = ["mesh", "normals", "point_light", "distant_light", "phong", "blinn", "shadows"]
CENTRES = Quality(samples=1)


def mine(**values: Any) -> Command:
    table = {"command": ["true", "{scene}", "{image}"], "capabilities": DRAWS} | values
    made = configured("mine", Table(table, "notabug.toml.renderers.mine", Path()), {})
    assert isinstance(made, Command)
    return made


def floor(stage: Any, lights: tuple[Any, ...], **look: Any) -> Any:
    return stage.scene((stage.quad(),), lights, stage.camera((0, 0, 5)), (stage.replace(stage.grey(), **look),))


SHINY = {"specular": (0.1,) * 3, "exponent": 8.0}


@pytest.mark.parametrize(
    ("apart", "lights", "look", "says"),
    [
        ([["phong", "point_light"]], "point", SHINY, "needs phong with point_light;"),
        ([["phong", "point_light"]], "distant", SHINY, ""),
        ([["phong", "point_light"]], "point", {}, ""),
        ([["phong", "point_light"]], "point", SHINY | {"lobe": "blinn"}, ""),
        ([["point_light", "distant_light"]], "both", {}, "needs distant_light with point_light;"),
        ([["point_light", "distant_light"]], "point", {}, ""),
        ([["mesh", "phong", "distant_light"]], "distant", SHINY, "needs distant_light with mesh with phong;"),
        (
            [["phong", "point_light"], ["phong", "mesh"]],
            "point",
            SHINY,
            "needs phong with point_light, mesh with phong;",
        ),
        ([], "both", SHINY, ""),
    ],
)
def test_what_does_not_go_together_is_unsupported_and_named(
    stage: Any, apart: list[list[str]], lights: str, look: dict[str, Any], says: str
) -> None:
    shining = {"point": (stage.point((0, 0, 3)),), "distant": (stage.distant((0, 0, 1)),)}
    shining["both"] = (*shining["point"], *shining["distant"])
    scene = floor(stage, shining[lights], **look)
    if not says:
        check_supported(mine(not_together=apart), scene)
        return
    with pytest.raises(UnsupportedError, match=says):
        check_supported(mine(not_together=apart), scene)


def test_shadows_count_where_they_fall(stage: Any) -> None:
    adapter = mine(not_together=[["distant_light", "shadows"]])
    lit = (stage.distant((0.5, 0, 1)),)
    check_supported(adapter, floor(stage, lit))
    above = stage.replace(stage.quad(0.5, (0, 0, 1)), path="/Scene/Above")
    shadowed = stage.scene((stage.quad(), above), lit, stage.camera((0, 0, 5)), (stage.grey(),), size=(32, 32))
    with pytest.raises(UnsupportedError, match="needs distant_light with shadows;"):
        check_supported(adapter, shadowed)


def test_what_is_missing_comes_before_what_does_not_go_together(stage: Any) -> None:
    adapter = mine(not_together=[["phong", "point_light"]])
    scene = floor(stage, (stage.point((0, 0, 3)),), opacity=0.5, **SHINY)
    with pytest.raises(UnsupportedError, match="needs opacity;"):
        check_supported(adapter, scene)


@pytest.mark.parametrize("adapter", [Tachyon(), Babylon()], ids=["tachyon", "babylon"])
@pytest.mark.parametrize("lobe", ["phong", "blinn"])
def test_known_renderers_say_it_the_same_way_and_why(stage: Any, adapter: Any, lobe: str) -> None:
    scene = floor(stage, (stage.point((0, 0, 3)),), lobe=lobe, **SHINY)
    with pytest.raises(UnsupportedError, match=rf"needs {lobe} with point_light; .*the distance"):
        check_supported(adapter, scene)
    check_supported(adapter, floor(stage, (stage.distant((0, 0, 1)),), lobe=lobe, **SHINY))


def test_the_summary_counts_them_as_it_counts_features(stage: Any) -> None:
    messages = []
    for look in (SHINY, SHINY, {"opacity": 0.5}):
        with pytest.raises(UnsupportedError) as caught:
            check_supported(
                mine(not_together=[["phong", "point_light"]]), floor(stage, (stage.point((0, 0, 3)),), **look)
            )
        messages.append(str(caught.value))
    results = [Result(f"a/{at}", "", "mine", "1", Verdict("unsupported", message=x)) for at, x in enumerate(messages)]
    assert [same.told for same in alike(results)] == ["it lacks phong with point_light (2), opacity (1)"]


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"not_together": ["phong", "point_light"]}, "not a list of lists"),
        ({"not_together": [["phong"]]}, "not two capabilities or more"),
        ({"not_together": [["phong", "phong"]]}, "not two capabilities or more"),
        ({"not_together": [["phong", 3]]}, "not two capabilities or more"),
        ({"not_together": [["phong", "pointlight"]]}, "unknown capability 'pointlight'.*point_light"),
        ({"not_together": "phong"}, "not a list of lists"),
        ({"spheres": "meshes"}, "expected one of exact, mesh"),
    ],
)
@pytest.mark.parametrize("kind", ["command", "files", "adapter"])
def test_a_wrong_value_is_told(values: dict[str, Any], says: str, kind: str) -> None:
    of_kind: dict[str, Any] = {
        "command": {"command": ["x", "{scene}", "{image}"]},
        "files": {"files": "pictures"},
        "adapter": {"adapter": "zbuffer"},
    }
    table = Table(of_kind[kind] | values, "notabug.toml.renderers.mine", Path())
    with pytest.raises(ConfigError, match=says):
        configured("mine", table, {"zbuffer": ZBuffer()})


TURNED = np.array([[0.0, 2.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.5, 0.0], [3.0, 4.0, 5.0, 1.0]])


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_mesh_lies_on_the_ellipsoid_with_its_normals_outwards(stage: Any, mirrored: bool) -> None:
    matrix = np.diag([-1.0, 1.0, 1.0, 1.0]) @ TURNED if mirrored else TURNED
    sphere = Sphere("/Scene/Egg", 1.5, 0, matrix)
    (mesh,) = with_meshes(stage.scene((sphere,), (), stage.camera((0, 0, 9)))).meshes
    local = (mesh.points - matrix[3, :3]) @ np.linalg.inv(matrix[:3, :3])
    assert np.linalg.norm(local, axis=1) == pytest.approx(np.full(len(local), 1.5), rel=1e-12)
    corners = mesh.points[mesh.corners].reshape(-1, 3, 3)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = corners.mean(axis=1) - matrix[3, :3]
    assert (np.einsum("ti,ti->t", facing, outwards) > 0).all()
    gradient = local @ np.linalg.inv(matrix[:3, :3]).T  # of |x A^-1|^2 at each point, up to a factor
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert mesh.normals == pytest.approx(gradient[mesh.corners], abs=1e-12)


@pytest.fixture
def ball(stage: Any) -> Any:
    sphere = Sphere("/Scene/Ball", 1.0, 0, np.eye(4))
    scene = stage.scene((sphere,), (stage.distant((1, 0, 1)),), stage.camera((0, 0, 4)), size=(48, 48))
    return replace(scene, card=replace(scene.card, requires=frozenset({"sphere", "distant_light"})))


def test_a_known_renderer_without_spheres_draws_them_as_meshes_and_is_judged_by_these(
    stage: Any, ball: Any, tmp_path: Path
) -> None:
    known = {"zbuffer": ZBuffer()}
    with pytest.raises(UnsupportedError, match="needs sphere"):
        ZBuffer().render(ball, tmp_path, CENTRES)
    table = {"adapter": "zbuffer", "spheres": "mesh", "not_together": [["phong", "point_light"]], "depth": "float32"}
    adapter = configured("zb", Table(table, "notabug.toml.renderers.zb", Path()), known)
    assert adapter.name == "zb"
    assert adapter.declaration(CENTRES).depth == "float32"
    assert not_together(adapter) == (Apart(frozenset({"phong", "point_light"})),)
    assert adapter.find().key != configured("zb", Table({"adapter": "zbuffer"}, "zb", Path()), known).find().key
    renders = adapter.render(ball, tmp_path, CENTRES)
    outcome = judge_pictures([renders[0].image], ball, adapter.declaration(CENTRES), None)
    assert outcome.verdict.word in ("pass", "limitation")
    assert outcome.notes == (f"of exact spheres, 1 here, meshes of {AROUND} x 32 facets are drawn",)
    pixels = [read_picture(renders[0].image).pixels]
    declared = adapter.declaration(CENTRES)
    exactly = judge(pixels, with_meshes(ball), replace(declared, spheres="exact"))
    assert np.array_equal(judge(pixels, ball, declared).reference, exactly.reference)
    assert not np.array_equal(exactly.reference, judge(pixels, ball, replace(declared, spheres="exact")).reference)
    assert exactly.reference.max() > 0.1


def test_a_program_gets_the_mesh_in_its_scene(ball: Any, tmp_path: Path) -> None:
    adapter = mine(spheres="mesh")
    given = as_given(ball, adapter.declaration(CENTRES))
    check_supported(adapter, given)
    said = json.loads(export(given, "json", tmp_path).read_text())
    assert [shape["kind"] for shape in said["objects"]] == ["mesh"]
    with pytest.raises(UnsupportedError, match="needs sphere"):
        check_supported(mine(), as_given(ball, mine().declaration(CENTRES)))


def test_a_scene_without_spheres_stays_as_it_is(stage: Any) -> None:
    scene = floor(stage, (stage.point((0, 0, 3)),))
    assert with_meshes(scene) is scene
