"""One component of every shading normal negated: one name in every scene that shows it, and never a turned picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.references.models.geometry import smooth_mesh
from notabug.references.models.model import Model, models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Mesh, Scene

POINT = InHouse().declaration(Quality(samples=1))
SIDE = 48  # pixels


def small(studio: Any, scene_id: str) -> Scene:
    return replace(studio.scene(scene_id), width=SIDE, height=SIDE)


def negated(scene: Scene, axis: int) -> Model:
    return [each for each in models(scene) if each.name == "normals_negated"][axis]


def verdict(scene: Scene, *applied: Model) -> Verdict:
    return judge([trace_picture(*configured(scene, applied))], scene, POINT, perceive=False).verdict


@pytest.mark.parametrize(
    ("scene_id", "axis"),
    [
        ("terminator/sphere", 1),
        ("terminator/sphere", 0),
        ("phong/interpolation", 1),
        ("phong/lobes", 1),
        ("phong/lobes", 2),
    ],
)
def test_a_negated_component_is_named(studio: Any, scene_id: str, axis: int) -> None:
    scene = small(studio, scene_id)
    found = verdict(scene, negated(scene, axis))
    assert [each.name for each in found.findings if each.kind == "bug"] == ["normals_negated"]
    assert found.message == f"the {'xyz'[axis]} of normals is negated, points are where they should be"


def test_a_ball_lit_from_below_is_no_picture_upside_down(studio: Any) -> None:
    """Without the fault that it is, what shows almost the ball upside down is not said to be that."""
    scene = small(studio, "phong/interpolation")
    skewed = negated(scene, 1)

    def edit(under: Scene) -> Scene:
        """The y of normals negated, and a tenth of their x lost: a fault that no model is."""
        objects = []
        for shape in skewed.edit(under).objects:
            assert isinstance(shape, Mesh)
            assert shape.normals is not None
            bent = shape.normals * [0.9, 1.0, 1.0]
            bent /= np.linalg.norm(bent, axis=1, keepdims=True)
            objects.append(replace(shape, normals=np.ascontiguousarray(bent)))
        return replace(under, objects=tuple(objects))

    found = verdict(scene, replace(skewed, edit=edit))
    assert (found.word, "upside down" in found.message) == ("bug", False)


@pytest.mark.parametrize("scene_id", ["phong/interpolation", "terminator/sphere"])
def test_a_picture_that_is_upside_down_still_is(studio: Any, scene_id: str) -> None:
    scene = small(studio, scene_id)
    found = judge([trace_picture(*configured(scene, ()))[::-1]], scene, POINT, perceive=False).verdict
    assert found.findings[0].name == "upside_down"


def test_the_mesh_that_stands_for_a_sphere_looks_like_it(studio: Any) -> None:
    """What it shows of right normals passes as the exact sphere, so what it shows of wrong ones is theirs alone."""
    scene = replace(studio.scene("phong/lobes"), width=128, height=128)
    as_mesh = tuple(smooth_mesh(sphere) for sphere in scene.spheres)
    picture = trace_picture(*configured(replace(scene, objects=as_mesh), ()))
    assert judge([picture], scene, POINT, perceive=False).verdict.word == "pass"


def test_the_mesh_of_a_sphere_has_its_points_and_normals(studio: Any) -> None:
    for sphere in small(studio, "phong/lobes").spheres:
        mesh = smooth_mesh(sphere)
        assert mesh.normals is not None
        middle = sphere.to_world[3, :3]
        away = mesh.points[mesh.corners] - middle
        assert np.allclose(away / np.linalg.norm(away, axis=1, keepdims=True), mesh.normals)
