"""Babylon.js in a browser: shading, highlights and textures against closed forms and our rasteriser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.babylon import Babylon
from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.scene import Texture

NORMAL = np.array([0.0, 0.0, 1.0])


@pytest.mark.slow
def test_a_floor_under_two_lights_at_four_samples_a_pixel(stage: Any, babylon: Babylon) -> None:
    lights = [stage.point((0.5, 0.3, 2.0)), stage.distant((0.3, 0.2, 1.0), (2.0, 1.0, 0.5))]
    scene = stage.scene([stage.quad()], lights, stage.camera((0, -3, 4)))
    finer = stage.on_plane(stage.replace(scene, width=128, height=128))
    expected = sum(0.8 / np.pi * E * cosine for E, cosine in (stage.lit(finer, NORMAL, light) for light in lights))
    boxes = expected.reshape(64, 2, 64, 2).mean(axis=(1, 3))
    picture = stage.draw(babylon, scene, Quality(samples=4))
    assert np.abs(picture[..., 0] / boxes - 1.0).max() < 5e-3  # a corner of the floor may lie 1/64 sample off


@pytest.mark.slow
def test_a_highlight_is_blinns_in_any_colour_and_light_above_1_is_not_cut_off(stage: Any, babylon: Babylon) -> None:
    light = stage.distant((0.2, 0.5, 1.0), (4.0 * np.pi,) * 3)
    strengths = np.array([0.4, 0.1, 3.0])
    shiny = stage.replace(stage.grey(0.5), specular=tuple(strengths), exponent=24.0, lobe="blinn")
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [shiny])
    L = -np.array(light.direction)
    _, D = stage.rays(scene)
    H = L - D
    H /= np.linalg.norm(H, axis=-1, keepdims=True)
    lobe = np.maximum(H @ NORMAL, 0)[..., None] ** 24
    expected = 4.0 * (0.5 * (L @ NORMAL) + strengths * lobe)
    assert np.abs(stage.draw(babylon, scene) / expected - 1.0).max() < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
@pytest.mark.parametrize("specular", [0.0, 0.25])
def test_a_texture_repeats_and_clamps_on_each_axis(stage: Any, babylon: Babylon, wraps: Any, specular: float) -> None:
    """On both of Babylon's materials that are used; the highlight of the shiny one is far aside."""
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((5, 8, 3)) * 3.0, *wraps)
    uv = np.array([[-0.7, -1.2], [1.9, -1.2], [1.9, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0, specular=(specular,) * 3, exponent=4096.0, lobe="blinn")
    light = stage.distant((2, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    assert np.abs(stage.draw(babylon, scene) - raster_picture(scene)).max() < 3e-3


@pytest.mark.slow
def test_bodies_under_a_rolled_camera_are_the_rasterisers(stage: Any, babylon: Babylon) -> None:
    lights = [stage.distant((0.3, -0.6, 0.5), (1.5, 1.0, 0.5)), stage.point((1.0, -2.5, 2.0))]
    camera = stage.replace(stage.camera((1.0, -3.0, 2.0)), tan_x=0.6)
    turn, place = np.eye(4), camera.to_world.copy()
    turn[:2, :2] = [[0.8, 0.6], [-0.6, 0.8]]
    scene = stage.scene(
        [stage.ball()], lights, stage.replace(camera, to_world=turn @ place), [stage.grey(0.5)], size=(192, 160)
    )
    picture, expected = stage.draw(babylon, scene), raster_picture(scene)
    assert ((picture > 0).any(-1) != (expected > 0).any(-1)).sum() <= 40  # of corners on the grid of SwiftShader
    inside = (picture > 0).any(-1) & (expected > 0).any(-1)
    assert np.median(np.abs(picture - expected).max(-1)[inside]) < 1e-3 * expected.max()


def test_it_declares_highlights_that_are_not_cut_off() -> None:
    declared = Babylon().declaration(Quality(samples=5))
    assert (declared.lobe, declared.normalised, declared.highlight) == ("blinn", "no", "uncut")
    assert (declared.depth, declared.shadows, declared.samples, declared.subpixel_bits) == ("unknown", "none", 9, 4)


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    shiny = {"specular": (0.1,) * 3}
    distant, point = stage.distant((0, 0, 1)), stage.point((0, 0, 1))
    for look, light, why in (
        (shiny, point, "needs phong with point_light"),
        (shiny | {"cosine_weighted": True}, distant, "needs cosine_weighted"),
        ({"opacity": 0.5}, point, "needs opacity"),
    ):
        looks = [stage.replace(stage.grey(), **look)]
        scene = stage.scene([stage.quad()], [light], stage.camera((0, 0, 5)), looks)
        with pytest.raises(UnsupportedError, match=why):
            Babylon().render(scene, stage.out, Quality())


def test_a_machine_without_it_says_how_to_get_it(stage: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path))
    scene = stage.scene([stage.quad()], [stage.point((0, 0, 1))], stage.camera((0, 0, 5)))
    with pytest.raises(RendererMissingError, match="notabug install babylon"):
        Babylon().render(scene, stage.out, Quality())
