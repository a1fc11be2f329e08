"""The rasteriser as an adapter: what it draws, what it refuses, and which scenes show no shadows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.registry import adapters
from notabug.adapters.requirements import shadows_fall
from notabug.adapters.zbuffer import ZBuffer, grid
from notabug.scenes_usd.scene import Sphere


def floor(stage: Any, **look: Any) -> Any:
    light = stage.point((0.5, 0.3, 2.0))
    return stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [stage.replace(stage.grey(), **look)])


def test_registered() -> None:
    assert adapters()["zbuffer"] == ZBuffer()
    assert ZBuffer().find().version


@pytest.mark.parametrize(("precision", "relative"), [("float32", 3e-5), ("float64", 1e-7)])  # files are float32
def test_floor_under_a_point_light(stage: Any, precision: Any, relative: float) -> None:
    scene = floor(stage)
    picture = stage.draw(ZBuffer(precision=precision), scene)[..., 0]
    E, cosine = stage.lit(stage.on_plane(scene), np.array([0.0, 0.0, 1.0]), scene.lights[0])
    assert np.abs(picture / (0.8 * E * cosine / np.pi) - 1.0).max() < relative


def test_samples_fill_a_square_grid(stage: Any) -> None:
    assert [grid(Quality(samples=n)) for n in (0, 1, 2, 4, 5, 9, 10)] == [1, 1, 2, 2, 3, 3, 4]
    (render,) = ZBuffer().render(floor(stage), stage.out, Quality(samples=5, seeds=(7, 8)))
    assert (render.samples, render.seed, render.image.name) == (9, 7, "zbuffer-seed7.exr")
    assert ZBuffer().declaration(Quality(samples=5)).filter == "box"
    declared = ZBuffer(depth="reversed32").declaration(Quality())
    assert (declared.filter, declared.depth, declared.ngon_split) == ("point", "reversed32", "02")


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    with pytest.raises(UnsupportedError, match="mirror"):
        ZBuffer().render(floor(stage, mirror=(0.5,) * 3), stage.out, Quality())
    ball = Sphere("/Scene/Ball", 1.0, 0, np.eye(4))
    with pytest.raises(UnsupportedError, match="sphere"):
        ZBuffer().render(stage.replace(floor(stage), objects=(ball,)), stage.out, Quality())


@pytest.mark.parametrize("card", [False, True])
def test_scenes_with_shadows_need_a_shadow_map(stage: Any, card: bool) -> None:
    """A shadow that can be seen, or one that the card asks for, is unsupported; with a map it is drawn."""
    blocker = () if card else (stage.quad(0.5, (0, 0, 1.0)),)
    scene = floor(stage)
    requires = stage.replace(scene.card, requires=frozenset({"shadows"})) if card else scene.card
    scene = stage.replace(scene, objects=(*scene.objects, *blocker), card=requires)
    with pytest.raises(UnsupportedError, match="shadows"):
        ZBuffer().render(scene, stage.out, Quality())
    picture = stage.draw(ZBuffer(shadow_map=512, shadow_bias=0.05), scene)
    assert (picture == 0).any() != card


def test_where_shadows_fall(stage: Any) -> None:
    """Not on one convex body, nor on coplanar sheets, under a light at the eye, or in gaps far below a pixel."""
    camera = stage.camera((1, -3, 4))
    eye = stage.point(tuple(camera.to_world[3, :3]))
    lamp, sun = stage.point((0.5, 0.3, 2.0)), stage.distant((0.6, 0.2, 0.5))
    ball, low = stage.ball(), stage.quad(9.0, (0, 0, -1))
    facets = stage.replace(ball, normals=None)
    sheet, raised, high = (stage.quad(1, (0, 0, gap)) for gap in (0.0, 1e-4, 0.1))
    for objects, lights, fall in [
        ([stage.quad()], [lamp, sun], False),
        ([stage.quad(), sheet], [sun], False),
        ([stage.quad(), raised], [sun], False),
        ([stage.quad(), high], [sun], True),
        ([ball], [lamp], False),
        ([stage.ball(8, 4)], [sun], False),
        ([facets], [sun], False),
        ([ball, low], [eye], False),
        ([ball, low], [eye, sun], True),
        ([ball, low], [], False),
    ]:
        assert shadows_fall(stage.scene(objects, lights, camera)) is fall
