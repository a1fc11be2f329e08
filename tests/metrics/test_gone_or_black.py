"""A surface that is drawn black before black looks as if it were missing: the name says that it may be either."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.scenes_usd.scene import Mesh, Scene

EITHER = "or drawn black"


def turned_inside_out(scene: Scene, path: str) -> Scene:
    """``scene`` with normals of one mesh that point away from its faces, so that no light reaches it."""

    def one(thing: Any) -> Any:
        if not isinstance(thing, Mesh) or thing.path != path:
            return thing
        p = thing.points[thing.corners]
        first = np.cumsum(thing.counts) - thing.counts
        out = np.cross(p[first + 1] - p[first], p[first + 2] - p[first])
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        return replace(thing, normals=np.ascontiguousarray(np.repeat(-out, thing.counts, axis=0)))

    return replace(scene, objects=tuple(one(each) for each in scene.objects))


def without(scene: Scene, path: str) -> Scene:
    return replace(scene, objects=tuple(each for each in scene.objects if each.path != path))


@pytest.mark.parametrize(
    ("name", "change", "path", "either"),
    [
        ("terminator/sphere", turned_inside_out, "/Scene/Floor", True),
        ("acne/sphere", turned_inside_out, "/Scene/Wall", True),
        ("calibration/plain_card", turned_inside_out, "/Scene/SquaresC", True),
        ("calibration/plain_card", without, "/Scene/SquaresC", True),  # which is the same picture
        ("terminator/sphere", without, "/Scene/Ball", False),  # behind it is the floor
    ],
)
@pytest.mark.sweep_except(
    "terminator/sphere-turned_inside_out-/Scene/Floor-True",
    "acne/sphere-turned_inside_out-/Scene/Wall-True",
    "calibration/plain_card-without-/Scene/SquaresC-True",
    "terminator/sphere-without-/Scene/Ball-False",
)
def test_what_is_missing_before_black_may_be_black(
    studio: Any, name: str, change: Any, path: str, either: bool
) -> None:
    scene = replace(studio.scene(name), width=96, height=96)
    assert path in [each.path for each in scene.objects]
    adapter, quality = InHouse(), Quality(samples=1)
    pictures = studio.draw(adapter, change(scene, path), quality)
    verdict = studio.verdict(pictures, scene, adapter.declaration(quality))
    print(f"\n{name} {path}: {[(each.name, each.message) for each in verdict.findings]}")
    assert verdict.word == "bug"
    assert "missing" in verdict.findings[0].message
    assert (EITHER in verdict.findings[0].message) is either
