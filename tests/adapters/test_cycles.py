"""Cycles, where ``notabug install cycles`` put it: light, opacity and texture against closed forms, and its remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.adapters.cycles import Cycles
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Texture


@pytest.mark.slow
def test_a_floor_under_two_lights_at_pixel_centres(stage: Any, cycles: Cycles) -> None:
    """Light of two kinds: each is drawn alone, and nothing is chosen at random."""
    lights = [stage.point((0.5, 0.3, 2.0)), stage.distant((0.3, 0.2, 1.0), (2.0, 2.0, 2.0))]
    scene = stage.scene([stage.quad()], lights, stage.camera((0, -3, 4)), size=(32, 32))
    P, N = stage.on_plane(scene), np.array([0.0, 0.0, 1.0])
    expected = sum(0.8 / np.pi * E * cosine for E, cosine in (stage.lit(P, N, light) for light in lights))
    picture = stage.draw(cycles, scene)
    assert np.abs(picture / expected[..., None] - 1.0).max() < 1e-4  # 3.6e-5: a thousandth of a pixel


@pytest.mark.slow
def test_seeds_are_pictures_of_their_own(stage: Any, cycles: Cycles) -> None:
    scene = stage.scene([stage.ball()], [stage.distant((0, 0, 1))], stage.camera((0.1, 0, 4)), size=(24, 24))
    renders = cycles.render(scene, stage.out, Quality(samples=4, seeds=(3, 8)))
    assert [(each.seed, each.samples) for each in renders] == [(3, 4), (8, 4)]
    first, second = (read_picture(each.image).pixels for each in renders)
    assert not np.array_equal(first, second)


@pytest.mark.slow
def test_a_texture_on_a_sheet_of_some_opacity(stage: Any, cycles: Cycles) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((2, 2, 3)), "clamp", "clamp")
    uv = np.array([[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]])
    shown = stage.replace(stage.grey(), texture=0, opacity=0.25)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture], size=(16, 16))
    across = ((np.arange(16) + 0.5) / 16)[None, :, None]
    down = ((np.arange(16) + 0.5) / 16)[:, None, None]
    above, below = (row[0] * (1 - across) + row[1] * across for row in texture.pixels)
    picture = stage.draw(cycles, scene, Quality(samples=64, seeds=(0,)))
    assert np.abs(picture - 0.25 * (above * (1 - down) + below * down)).mean() < 0.02  # which of the two is random


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    shiny = stage.replace(stage.grey(), specular=(0.1,) * 3)
    scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), [shiny])
    with pytest.raises(UnsupportedError, match="needs phong"):
        Cycles().render(scene, stage.out, Quality())
    wide = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), size=(96, 64))
    with pytest.raises(UnsupportedError, match="square"):
        Cycles().render(wide, stage.out, Quality())
    square = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)))
    with pytest.raises(RendererMissingError, match="notabug install cycles"):
        Cycles(python="/bin/false").render(square, stage.out, Quality())


def test_a_picture_smaller_than_blenders_is_refused(stage: Any) -> None:
    for size in ((3, 9), (9, 2)):
        camera = stage.replace(stage.camera((0, 0, 5)), tan_x=0.5 * size[0] / size[1])
        scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], camera, size=size)
        with pytest.raises(UnsupportedError, match=r"too small.*expected 4 pixels"):
            Cycles(python="/bin/false").render(scene, stage.out, Quality())
