"""Filament in half floats: shading, lamps near and far, n-gons and textures against closed forms and our rasteriser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.filament import FARTHEST, HALF, Filament
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.scene import Texture

NORMAL = np.array([0.0, 0.0, 1.0])
ROUNDED = (
    2.0 * HALF
)  # of a value: a half float whose last place is cut off, and what 8 bits under many lights leave open


@pytest.mark.slow
def test_a_floor_under_several_lights(stage: Any, filament: Filament) -> None:
    """Of distant lights a scene of Filament has one: with two there are two pictures, which are added."""
    lamps = [stage.point((0.5, 0.3, 2.0)), stage.point((-1.0, 0.5, 3.0))]
    suns = [stage.distant((0.3, 0.2, 1.0), (2.0, 1.0, 0.5)), stage.distant((-0.5, 0.2, 1.0), (0.5, 1.0, 2.0))]
    scene = stage.scene([stage.quad()], [*suns, *lamps], stage.camera((0, -3, 4)))
    lit = (stage.lit(stage.on_plane(scene), NORMAL, light) for light in scene.lights)
    expected = sum(0.8 / np.pi * E * cosine for E, cosine in lit)
    assert np.abs(stage.draw(filament, scene)[..., 0] / expected - 1.0).max() < ROUNDED


@pytest.mark.slow
@pytest.mark.parametrize("power", [1e-9, 1e-3, 1e6])
def test_any_brightness_is_read(stage: Any, filament: Filament, power: float) -> None:
    light = stage.point((0.5, 0.3, 2.0), (power,) * 3)
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)))
    E, cosine = stage.lit(stage.on_plane(scene), NORMAL, light)
    assert np.abs(stage.draw(filament, scene)[..., 0] / (0.8 / np.pi * E * cosine) - 1.0).max() < ROUNDED


@pytest.mark.slow
def test_what_is_dark_beside_what_is_bright(stage: Any, filament: Filament) -> None:
    """Red is a thousandth of blue; a step of 8 bits would be four times as large."""
    light = stage.distant((0.0, 0.0, 1.0), (0.001 * np.pi, 0.1 * np.pi, np.pi))
    scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [stage.grey(0.7)], size=(8, 8))
    assert stage.draw(filament, scene)[4, 4] == pytest.approx([0.0007, 0.07, 0.7], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.01, 1.0, 300.0])
def test_bodies_are_the_rasterisers_near_and_far(stage: Any, filament: Filament, scale: float) -> None:
    """Lamps of Filament light nothing beyond 100 of the eye, nor more strongly within .01: both are gone round."""
    lights = [stage.distant((0.3, -0.6, 0.5), (1.5, 1.0, 0.5))]
    lights += [stage.point(np.array([1.0, -2.5, 2.0]) * scale, np.full(3, 6.0) * scale**2)]
    camera = stage.replace(stage.camera(np.array([1.0, -3.0, 2.0]) * scale), tan_x=0.6)
    ball = stage.ball()
    ball = stage.replace(ball, points=ball.points * scale)
    scene = stage.scene([ball], lights, camera, [stage.grey(0.5)], size=(192, 160))
    picture, expected = stage.draw(filament, scene), raster_picture(scene)
    seen = (picture > 0).any(-1) & (expected > 0).any(-1)
    assert ((picture > 0).any(-1) != (expected > 0).any(-1)).sum() <= 2
    off = np.abs(picture - expected) - ROUNDED * expected > 2e-4 * expected.max()
    assert off[seen].sum() <= 4


@pytest.mark.slow
def test_its_own_units_lose_lamps(stage: Any, filament: Filament) -> None:
    """What docs/defects/filament-far-lamps shows, through the adapter."""
    light = stage.point((0.0, 0.0, 2.0))
    scene = stage.scene([stage.quad()], [light], stage.camera((0, 0, 5)), size=(8, 8))
    assert stage.draw(filament, scene).min() > 0.0
    assert stage.draw(stage.replace(filament, unit=64.0), scene).max() == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
def test_a_texture_repeats_and_clamps_on_each_axis(stage: Any, filament: Filament, wraps: Any) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((5, 8, 3)) * 3.0, *wraps)
    uv = np.array([[-0.7, -1.2], [1.9, -1.2], [1.9, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    expected = raster_picture(scene)
    assert np.abs(stage.draw(filament, scene) - expected).max() < 2.0 * ROUNDED * expected.max()


@pytest.mark.slow
def test_one_process_does_all_jobs_and_outlives_a_bad_one(stage: Any, filament: Filament) -> None:
    light = stage.distant((0.0, 0.0, 1.0), (np.pi,) * 3)
    scene = stage.scene([stage.quad()], [light], stage.camera((0, 0, 5)), [stage.grey(0.5)], size=(8, 8))
    with pytest.raises(RendererError, match="16384"):
        filament.render(stage.replace(scene, width=9000), stage.out, Quality(samples=4))
    assert stage.draw(filament, scene) == pytest.approx(0.5, rel=ROUNDED)
    black = stage.replace(scene, lights=(stage.distant((0.0, 0.0, 1.0), (0.0,) * 3),))
    assert stage.draw(filament, black).max() == 0.0
    assert stage.draw(filament, scene, Quality(samples=4)) == pytest.approx(0.5, rel=ROUNDED)


def test_the_unit_keeps_a_scene_within_reach_of_its_lamps(stage: Any) -> None:
    from notabug.adapters.filament import _unit

    for scale in (1e-3, 1.0, 77.0, 1e5):
        camera = stage.camera((0.0, 0.0, 5.0 * scale))
        scene = stage.scene([stage.quad(scale)], [stage.point((0, 0, 1))], camera)
        assert FARTHEST / 2 < _unit(scene) * np.sqrt(27.0) * scale <= FARTHEST
    assert _unit(stage.scene([stage.quad(1e5)], [stage.distant((0, 0, 1))], camera)) == 1.0


def test_it_declares_half_floats_and_a_depth_buffer() -> None:
    declared = Filament().declaration(Quality(samples=5))
    assert (declared.quantum, declared.relative_quantum) == (2.0**-10, True)
    assert (declared.depth, declared.shadows, declared.samples, declared.filter) == ("fixed24", "none", 9, "box")


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    for look, why in (({"specular": (0.1,) * 3}, "needs phong"), ({"opacity": 0.5}, "needs opacity")):
        looks = [stage.replace(stage.grey(), **look)]
        scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), looks)
        with pytest.raises(UnsupportedError, match=why):
            Filament().render(scene, stage.out, Quality())


def test_a_machine_without_opengl_says_how_to_get_it(tmp_path: Path) -> None:
    odd = tmp_path / "python"
    odd.write_text('#!/bin/sh\n[ "$1" = -c ] && echo 0.2.1 && exit 0\necho no EGL >&2\nexit 1\n')
    odd.chmod(0o755)
    with pytest.raises(RendererMissingError, match=r"OpenGL 4\.1.*got no EGL.*apt install libegl1"):
        Filament(python=str(odd)).find()


def test_an_interpreter_without_it_says_how_to_get_it(stage: Any) -> None:
    scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)))
    with pytest.raises(RendererMissingError, match="notabug install filament"):
        Filament(python="/bin/false").render(scene, stage.out, Quality())
