"""Tachyon: its text, its pictures against closed forms, and the defects that its adapter goes round."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.tachyon import Tachyon
from notabug.adapters.tachyon_scene import scene_text
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Sphere

HALF_STEP = 0.51 / 65535


def floor(stage: Any, **look: Any) -> Any:
    material = stage.replace(stage.grey(0.5), **look)
    return stage.scene([stage.quad()], [stage.point((0.5, 0.3, 2.0))], stage.camera((0, -3, 4)), [material])


def shaded(stage: Any, scene: Any) -> Any:
    """What the floor's diffuse light must be."""
    E, cosine = stage.lit(stage.on_plane(scene), np.array([0.0, 0.0, 1.0]), scene.lights[0])
    return scene.materials[0].diffuse[0] * E * cosine / np.pi


@pytest.mark.parametrize("samples", [1, 4])
def test_a_floor_under_a_point_light(stage: Any, tachyon: Tachyon, samples: int) -> None:
    scene, side = floor(stage), 64 * round(samples**0.5)
    picture = stage.draw(tachyon, scene, Quality(samples=samples))
    finer = shaded(stage, stage.replace(scene, width=side, height=side))
    expected = finer.reshape(64, side // 64, 64, side // 64).mean(axis=(1, 3))
    assert np.abs(picture - expected[..., None]).max() < HALF_STEP + 1e-6


def test_nothing_is_mirrored_or_moved(stage: Any, tachyon: Tachyon) -> None:
    """A ball off the axes covers the pixels whose centres' rays meet it, and no others."""
    ball = Sphere("/Scene/Ball", 0.7, 0, np.eye(4))
    ball.to_world[3, :3] = 0.6, 0.35, 0.2
    light = stage.distant((0.1, 0.3, 1))
    scene = stage.scene([ball], [light], stage.camera((1.0, -0.5, 4.0), (0.2, 0.1, 0.0)), size=(96, 64))
    scene = stage.replace(scene, camera=stage.replace(scene.camera, tan_x=0.75))
    hit, P, N = stage.on_sphere(scene, ball)
    E, cosine = stage.lit(P, N, light)
    expected = np.where(hit, 0.8 / np.pi * E * cosine, 0.0)
    picture = stage.draw(tachyon, scene)[..., 0]
    assert ((picture > 0) != (expected > HALF_STEP)).sum() <= 2
    both = (picture > 0) & (expected > 0)
    assert np.abs(picture - expected)[both].max() < HALF_STEP + 1e-6


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
def test_a_highlight_under_a_distant_light(stage: Any, tachyon: Tachyon, lobe: str) -> None:
    light = stage.distant((0.2, 0.5, 1.0), (np.pi,) * 3)
    scene = stage.replace(floor(stage, specular=(0.4,) * 3, exponent=24.0, lobe=lobe), lights=(light,))
    L, N = -np.array(light.direction), np.array([0.0, 0.0, 1.0])
    _, D = stage.rays(scene)
    H = L - D
    H /= np.linalg.norm(H, axis=-1, keepdims=True)
    R = 2 * (L @ N) * N - L
    cosine = np.maximum(-(D @ R), 0) if lobe == "phong" else np.maximum(H @ N, 0)
    expected = 0.5 * (L @ N) + 0.4 * cosine**24
    assert np.abs(stage.draw(tachyon, scene)[..., 0] - expected).max() < HALF_STEP + 2e-6


def test_bright_and_dim_pictures_keep_their_values(stage: Any, tachyon: Tachyon) -> None:
    for factor in (100.0, 1e-3):
        light = stage.point((0.5, 0.3, 2.0), (6.0 * factor,) * 3)
        scene = stage.replace(floor(stage), lights=(light,))
        picture = stage.draw(tachyon, scene)[..., 0]
        assert np.abs(picture / shaded(stage, scene) - 1.0).max() < 1e-3


def test_the_floor_goes_black_far_away_unless_attenuation_is_made_small(stage: Any, tachyon: Tachyon) -> None:
    """Tachyon leaves a light out where N.L / (q d^2) is small, before it looks at how bright the light is."""
    light = stage.point((0.0, 0.0, 300.0), (6e5,) * 3)
    scene = stage.replace(floor(stage), lights=(light,))
    expected = shaded(stage, scene)
    assert np.abs(stage.draw(tachyon, scene)[..., 0] / expected - 1.0).max() < 1e-4
    assert (expected > 0.9).all()
    assert (stage.draw(Tachyon(attenuation=1.0), scene) == 0.0).all()


def test_a_grid_of_triangles_in_one_plane_ends_without_a_crash(stage: Any, tachyon: Tachyon) -> None:
    """More than 16 triangles in a plane across an axis make Tachyon's grid fail; the picture comes without it."""
    tiles = [stage.quad(0.5, (x, y, 0)) for x in range(-3, 4) for y in range(-3, 4)]
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene(tiles, [light], stage.camera((0, 0, 5)), size=(16, 16))
    assert stage.draw(tachyon, scene) == pytest.approx(0.8, abs=HALF_STEP)


def test_a_picture_that_is_not_there_is_an_error_although_tachyon_exits_with_0(stage: Any, tachyon: Tachyon) -> None:
    with pytest.raises(RendererError, match="left no picture"):
        stage.draw(Tachyon(edit=lambda text: "nonsense"), floor(stage))


def test_what_it_cannot_draw_is_named(stage: Any, tachyon: Tachyon) -> None:
    shiny = {"specular": (0.1,) * 3, "exponent": 8.0}
    with pytest.raises(UnsupportedError, match="phong with point_light"):
        stage.draw(tachyon, floor(stage, **shiny))
    two = stage.replace(
        floor(stage),
        lights=(stage.distant((0, 0, 1)),),
        objects=(stage.quad(), stage.quad(1.0, (0, 0, 1), 1)),
        materials=(stage.replace(stage.grey(), **shiny), stage.replace(stage.grey(), lobe="blinn", **shiny)),
    )
    with pytest.raises(UnsupportedError, match="one lobe"):
        stage.draw(tachyon, two)
    wide = stage.replace(floor(stage), width=96)
    with pytest.raises(UnsupportedError, match="square"):
        stage.draw(tachyon, wide)


def test_names_and_numbers_that_are_not_finite_never_reach_the_text(stage: Any) -> None:
    evil = '/Scene/x" end_scene\nplane'
    scene = stage.replace(floor(stage), id=evil, objects=(stage.replace(stage.quad(), path=evil),))
    text = scene_text(scene, 64, 64, gain=1.0, attenuation=1.0)
    assert text.isascii()
    assert "np." not in text
    assert "plane" not in text.replace("plastic", "")
    scene.objects[0].points[2, 0] = np.nan
    with pytest.raises(SceneError, match="not finite"):
        scene_text(scene, 64, 64, gain=1.0, attenuation=1.0)


def test_a_program_that_is_not_tachyon(stage: Any) -> None:
    with pytest.raises(RendererMissingError, match="does not answer as Tachyon"):
        Tachyon(command="true").find()
    with pytest.raises(RendererMissingError, match="apt install tachyon-bin-nox"):
        Tachyon(command="tachyon-not-here").find()
