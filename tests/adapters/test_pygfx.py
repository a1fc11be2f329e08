"""pygfx in a float32 picture: shading, highlights, n-gons and textures against closed forms and our rasteriser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.adapters.pygfx import Pygfx
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.scene import Texture

NORMAL = np.array([0.0, 0.0, 1.0])


@pytest.mark.slow
def test_a_floor_under_two_lights_at_four_samples_a_pixel(stage: Any, pygfx: Pygfx) -> None:
    lights = [stage.point((0.5, 0.3, 2.0)), stage.distant((0.3, 0.2, 1.0), (2.0, 1.0, 0.5))]
    scene = stage.scene([stage.quad()], lights, stage.camera((0, -3, 4)))
    finer = stage.on_plane(stage.replace(scene, width=128, height=128))
    expected = sum(0.8 / np.pi * E * cosine for E, cosine in (stage.lit(finer, NORMAL, light) for light in lights))
    boxes = expected.reshape(64, 2, 64, 2).mean(axis=(1, 3))
    picture = stage.draw(pygfx, scene, Quality(samples=4))
    assert np.abs(picture[..., 0] / boxes - 1.0).max() < 5e-5  # facets' normals are differences between pixels


@pytest.mark.slow
def test_a_highlight_is_blinns_by_n_2_over_8_and_the_cosine(stage: Any, pygfx: Pygfx) -> None:
    light = stage.distant((0.2, 0.5, 1.0), (np.pi,) * 3)
    shiny = stage.replace(stage.grey(0.5), specular=(0.4,) * 3, exponent=24.0, lobe="blinn")
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [shiny])
    L = -np.array(light.direction)
    _, D = stage.rays(scene)
    H = L - D
    H /= np.linalg.norm(H, axis=-1, keepdims=True)
    expected = (0.5 + 0.4 * 26 / 8 * np.maximum(H @ NORMAL, 0) ** 24) * (L @ NORMAL)
    assert np.abs(stage.draw(pygfx, scene)[..., 0] / expected - 1.0).max() < 2e-4


@pytest.mark.slow
def test_bodies_are_the_rasterisers(stage: Any, pygfx: Pygfx) -> None:
    lights = [stage.distant((0.3, -0.6, 0.5), (1.5, 1.0, 0.5)), stage.point((1.0, -2.5, 2.0))]
    camera = stage.replace(stage.camera((1.0, -3.0, 2.0)), tan_x=0.6)
    scene = stage.scene([stage.ball()], lights, camera, [stage.grey(0.5)], size=(192, 160))
    picture, expected = stage.draw(pygfx, scene), raster_picture(scene)
    assert ((picture > 0).any(-1) != (expected > 0).any(-1)).sum() <= 2
    assert (np.abs(picture - expected).max(-1) > 2e-5 * expected.max()).sum() <= 4


@pytest.mark.slow
@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
def test_a_texture_repeats_and_clamps_on_each_axis(stage: Any, pygfx: Pygfx, wraps: Any) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((5, 8, 3)) * 3.0, *wraps)
    uv = np.array([[-0.7, -1.2], [1.9, -1.2], [1.9, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    assert np.abs(stage.draw(pygfx, scene) - raster_picture(scene)).max() < 3e-5


@pytest.mark.slow
def test_a_lamp_within_a_tenth_of_a_unit_and_a_narrow_view(stage: Any, pygfx: Pygfx) -> None:
    """pygfx's own light stops growing there, and its field of view ends at half a degree: both are gone round."""
    light = stage.point((0.0, 0.0, 0.05), (0.0025 * np.pi,) * 3)
    camera = stage.camera((0, 0, 1.0), tan=0.002)
    scene = stage.scene([stage.quad(0.5)], [light], camera, [stage.grey(1.0)], size=(8, 8))
    E, cosine = stage.lit(stage.on_plane(scene), NORMAL, light)
    assert np.abs(stage.draw(pygfx, scene)[..., 0] / (E * cosine / np.pi) - 1.0).max() < 5e-5
    assert stage.draw(stage.replace(pygfx, unit=1.0), scene) == pytest.approx(0.25, abs=0.001)


def test_it_declares_the_lobe_of_three_js() -> None:
    declared = Pygfx().declaration(Quality(samples=5))
    assert (declared.lobe, declared.normalised, declared.highlight) == ("blinn", "n2over8", "cosine")
    assert (declared.depth, declared.shadows, declared.samples, declared.filter) == ("float32", "none", 9, "box")


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    for look, why in (
        ({"specular": (0.1, 0.2, 0.1)}, "needs coloured_highlight"),
        ({"opacity": 0.5}, "needs opacity"),
        ({"specular": (2.0,) * 3}, "more than all light"),
    ):
        looks = [stage.replace(stage.grey(), **look)]
        scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), looks)
        with pytest.raises(UnsupportedError, match=why):
            Pygfx().render(scene, stage.out, Quality())


def test_a_machine_without_a_driver_says_how_to_get_one(tmp_path: Path) -> None:
    """The interpreter has pygfx of some version, and no device: what it prints last is told."""
    odd = tmp_path / "python"
    odd.write_text('#!/bin/sh\n[ "$1" = -c ] && echo 0.17.0 && exit 0\necho no device has it >&2\nexit 1\n')
    odd.chmod(0o755)
    with pytest.raises(RendererMissingError, match=r"float32.*got no device has it.*apt install mesa-vulkan-drivers"):
        Pygfx(python=str(odd)).find()


def test_an_interpreter_without_it_says_how_to_get_it(stage: Any) -> None:
    scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)))
    with pytest.raises(RendererMissingError, match="notabug install pygfx"):
        Pygfx(python="/bin/false").render(scene, stage.out, Quality())
