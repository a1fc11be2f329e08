"""VTK in a float32 framebuffer: shading, n-gons and textures against closed forms and our rasteriser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.adapters.vtk import Vtk
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.scene import Mesh, Texture
from notabug.scenes_usd.triangulate import split_ngons


def test_a_floor_under_a_point_light_at_four_samples_a_pixel(stage: Any, vtk: Vtk) -> None:
    light = stage.point((0.5, 0.3, 2.0))
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)))
    picture = stage.draw(vtk, scene, Quality(samples=4))
    E, cosine = stage.lit(stage.on_plane(stage.replace(scene, width=128, height=128)), np.array([0.0, 0.0, 1.0]), light)
    expected = (0.8 * E * cosine / np.pi).reshape(64, 2, 64, 2).mean(axis=(1, 3))
    assert np.abs(picture / expected[..., None] - 1.0).max() < 5e-5  # facets' normals are differences between pixels


def test_bodies_with_coloured_highlights_are_the_rasterisers(stage: Any, vtk: Vtk) -> None:
    shiny = stage.replace(stage.grey(0.5), specular=(0.7, 0.5, 0.3), exponent=20.0)
    lights = [stage.distant((0.3, -0.6, 0.5), (1.5, 1.0, 0.5)), stage.point((1.0, -2.5, 2.0))]
    scene = stage.scene([stage.ball()], lights, stage.camera((1.0, -3.0, 2.0)), [shiny], size=(192, 192))
    picture, expected = stage.draw(vtk, scene), raster_picture(scene)
    assert ((picture > 0).any(-1) != (expected > 0).any(-1)).sum() <= 2
    assert (np.abs(picture - expected).max(-1) > 2e-5 * expected.max()).sum() <= 4


def test_a_concave_face_is_a_fan_from_its_first_corner_whatever_its_shape(stage: Any, vtk: Vtk) -> None:
    arrow = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (0.6, -0.5, 0)], float)
    face = Mesh("/Arrow", arrow, np.array([4], np.int32), np.arange(4, dtype=np.int32), 0)
    scene = stage.scene([face], [stage.distant((0, 0, 1))], stage.camera((0, 0, 4.0)))
    fan, sound = (raster_picture(stage.replace(scene, objects=(split_ngons(face, cut),))) > 0 for cut in ("fan", "02"))
    assert (fan != sound).any(-1).sum() > 200
    assert ((stage.draw(vtk, scene) > 0) != fan).any(-1).sum() == 0


@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
def test_a_texture_repeats_and_clamps_on_each_axis(stage: Any, vtk: Vtk, wraps: Any) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((5, 8, 3)) * 3.0, *wraps)
    uv = np.array([[-0.7, -1.2], [1.9, -1.2], [1.9, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    assert np.abs(stage.draw(vtk, scene) - raster_picture(scene)).max() < 3e-5


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    for look in ({"specular": (0.1,) * 3, "lobe": "blinn"}, {"opacity": 0.5}):
        looks = [stage.replace(stage.grey(), **look)]
        scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), looks)
        with pytest.raises(UnsupportedError, match=r"needs (blinn|opacity)"):
            Vtk().render(scene, stage.out, Quality())


def test_an_interpreter_without_it_says_how_to_get_it(stage: Any) -> None:
    scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)))
    with pytest.raises(RendererMissingError, match="notabug install vtk"):
        Vtk(python="/bin/false").render(scene, stage.out, Quality())
