"""An object that is seen as it should be is not missing, whatever its shadow does: the fault is of its shadow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Scene

POINT = InHouse().declaration(Quality(samples=1))
SIDE = 64  # pixels


def small(studio: Any, scene_id: str) -> Scene:
    return replace(studio.scene(scene_id), width=SIDE, height=SIDE)


def verdict(drawn: Scene, scene: Scene) -> Verdict:
    return judge([trace_picture(*configured(drawn, ()))], scene, POINT, perceive=False).verdict


def casting_none(scene: Scene, path: str) -> Scene:
    return replace(scene, lights=tuple(replace(light, unshadowing=(path,)) for light in scene.lights))


CASTERS = [
    ("shadow_map/thin_wall", "/Scene/Roof"),
    ("shadow_map/thin_wall", "/Scene/Wall"),
    ("visibility/standing", "/Scene/Standing/Cylinder/Mesh"),
]


@pytest.mark.parametrize(("scene_id", "path"), CASTERS)
def test_an_object_that_casts_no_shadow_is_named(studio: Any, scene_id: str, path: str) -> None:
    scene = small(studio, scene_id)
    found = verdict(casting_none(scene, path), scene)
    assert (found.word, found.findings[0].name) == ("bug", "shadow_of_one_missing")
    assert path in found.message


def test_where_one_object_alone_casts_shadows_none_does(studio: Any) -> None:
    """Both are the same picture, and that nothing casts a shadow supposes less."""
    scene = small(studio, "terminator/sphere")
    assert verdict(casting_none(scene, "/Scene/Ball"), scene).findings[0].name == "no_shadow"


def test_shadows_of_all_objects_are_not_those_of_one(studio: Any) -> None:
    scene = small(studio, "visibility/standing")
    none = tuple(shape.path for shape in scene.objects)
    dark = replace(scene, lights=tuple(replace(light, unshadowing=none) for light in scene.lights))
    assert verdict(dark, scene).findings[0].name == "no_shadow"


@pytest.mark.parametrize(("scene_id", "path"), [*CASTERS, ("terminator/sphere", "/Scene/Ball")])
def test_an_object_that_is_missing_is_still_said_to_be(studio: Any, scene_id: str, path: str) -> None:
    scene = small(studio, scene_id)
    without = replace(scene, objects=tuple(shape for shape in scene.objects if shape.path != path))
    found = verdict(without, scene)
    assert (found.word, found.findings[0].name) == ("bug", "object_missing")
    assert path in found.message
