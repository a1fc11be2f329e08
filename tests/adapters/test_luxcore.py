"""LuxCore, where ``notabug install luxcore`` put it: light, opacity, texture and mirrors against closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererMissingError, UnsupportedError
from notabug.adapters.luxcore import LuxCore
from notabug.adapters.luxcore_child import _brightest, _camera, _look, _settings
from notabug.references.predict import predict
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Texture

FINE = Quality(samples=64, seeds=(0,))
NORMAL = np.array([0.0, 0.0, 1.0])


def floor(stage: Any) -> Any:
    lights = [stage.point((0.5, 0.3, 2.0)), stage.distant((0.3, 0.2, 1.0), (2.0, 1.0, 0.5))]
    return stage.scene([stage.quad()], lights, stage.camera((0, -3, 4)), size=(32, 32))


@pytest.mark.slow
def test_a_floor_under_two_lights(stage: Any, luxcore: LuxCore) -> None:
    """Each light is drawn alone, and nothing is chosen at random; no seed is biased."""
    scene = floor(stage)
    finer = stage.replace(scene, width=512, height=512)
    expected = sum(
        0.8 / np.pi * E * cosine
        for E, cosine in (stage.lit(stage.on_plane(finer), NORMAL, light) for light in scene.lights)
    )
    boxes = expected.reshape(32, 16, 32, 16).mean(axis=(1, 3))
    ratio = stage.draw(luxcore, scene, FINE)[..., 0] / boxes - 1.0
    assert np.abs(ratio).max() < 4e-3
    assert abs(ratio.mean()) < 1e-4


@pytest.mark.slow
def test_nothing_is_moved_or_mirrored_in_a_picture_that_is_not_square(stage: Any, luxcore: LuxCore) -> None:
    """Of a small square off the axes the covered area is known; LuxCore's own picture is one row lower."""
    square = stage.quad(0.37, (0.55, 0.21, 0.0))
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    for tan_x, tan_y, size in ((0.75, 0.5, (48, 32)), (0.4, 0.6, (32, 48))):
        camera = stage.replace(stage.camera((0.1, 0.0, 4.0), (0.1, 0.0, 0.0)), tan_x=tan_x, tan_y=tan_y)
        scene = stage.scene([square], [light], camera, size=size)
        expected = raster_picture(scene, samples=64)
        picture, lower = (
            stage.draw(renderer, scene, FINE) for renderer in (luxcore, stage.replace(luxcore, raised=0.0))
        )
        assert np.abs(picture - expected).max() < 0.1
        assert np.abs(lower[1:] - expected[:-1]).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
def test_a_texture_on_a_sheet_of_some_opacity(stage: Any, luxcore: LuxCore, wraps: Any) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((3, 4, 3)) * 3.0, *wraps)
    uv = np.array([[-0.7, -0.2], [1.4, -0.2], [1.4, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture], size=(32, 32))
    expected = raster_picture(scene, samples=64)
    errors = np.abs(stage.draw(luxcore, scene, FINE) - expected)
    assert errors.mean() < 0.003  # of values up to 3
    assert errors.max() < 0.06
    thin = stage.replace(scene, materials=(stage.replace(shown, opacity=0.25),))
    assert np.abs(stage.draw(luxcore, thin, FINE).mean() / expected.mean() - 0.25) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("diffuse", [0.0, 0.3])
def test_a_mirror_shows_what_is_lit_and_passes_no_light_on(stage: Any, luxcore: LuxCore, diffuse: float) -> None:
    """A lit sheet behind the eye is seen in the mirror; neither lights the other."""
    coloured = stage.replace(stage.grey(diffuse), mirror=(0.8, 0.5, 0.4))
    sheets = [stage.quad(9.0), stage.quad(9.0, (0, 0, 9.0), 1)]
    light, camera = stage.point((0, 0, 6.0), (90.0,) * 3), stage.camera((0, 0, 5))
    scene = stage.scene(sheets, [light], camera, [coloured, stage.grey(0.6)], size=(8, 8))
    expected = predict(scene).mean
    picture = stage.draw(luxcore, scene, Quality(samples=256, seeds=(0, 1)))
    assert np.abs(picture.mean(axis=(0, 1)) / expected.mean(axis=(0, 1)) - 1.0).max() < 0.01


@pytest.mark.slow
def test_seeds_are_pictures_of_their_own(stage: Any, luxcore: LuxCore) -> None:
    scene = stage.scene([stage.ball()], [stage.distant((0, 0, 1))], stage.camera((0.1, 0, 4)), size=(24, 24))
    renders = luxcore.render(scene, stage.out, Quality(samples=4, seeds=(3, 8)))
    assert [(render.seed, render.samples) for render in renders] == [(3, 4), (8, 4)]
    first, second = (read_picture(render.image).pixels for render in renders)
    assert not np.array_equal(first, second)


# ---- what is told to LuxCore, without LuxCore


def material(**changes: Any) -> dict[str, Any]:
    given = {"diffuse": [0.0] * 3, "texture": -1, "mirror": [0.0] * 3, "opacity": 1.0}
    return given | changes


def test_a_mixture_has_the_colours_of_its_parts_and_none_above_1() -> None:
    """What a mixture's parts reflect, times their weights and the light's gain, is what the scene says."""
    said = material(diffuse=[0.3, 0.2, 0.1], mirror=[0.8, 0.5, 0.4])
    never = material(diffuse=[0.5] * 3, mirror=[1.0] * 3)  # of no object: it must not be asked for
    job = {"materials": [said, material(diffuse=[0.5] * 3), never], "objects": [{"material": 0}, {"material": 1}]}
    brightest = _brightest(job, {})
    look = _look(0, said, brightest)
    weight, matte, mirror = (look[f"materials.{name}"] for name in ("m0.amount", "matte0.kd", "mirror0.kr"))
    assert np.multiply(mirror, weight) == pytest.approx(said["mirror"])
    assert np.multiply(matte, (1.0 - weight) * brightest) == pytest.approx(said["diffuse"])
    assert max(*matte, *mirror) <= 1.0 + 1e-12
    plain = _look(1, job["materials"][1], brightest)
    assert np.multiply(plain["materials.m1.kd"], brightest) == pytest.approx([0.5] * 3)


def test_a_bright_texture_is_dimmed_and_a_black_mirror_is_no_mixture() -> None:
    shown = material(texture=0)
    job = {"materials": [shown], "textures": [{"pixels": "texture0"}], "objects": [{"material": 0}]}
    brightest = _brightest(job, {"texture0": np.array([[[0.5, 4.0, 0.0]]])})
    assert (brightest, _look(0, shown, brightest)["textures.t0.gain"]) == (4.0, 0.25)
    alone = _look(0, material(mirror=[1.0, 0.5, 0.0], opacity=0.5), 1.0)
    assert (alone["materials.m0.type"], alone["materials.m0.kr"]) == ("mirror", [1.0, 0.5, 0.0])
    assert alone["materials.m0.transparency"] == 0.5


def test_paths_are_as_long_as_mirrors_ask_for() -> None:
    numbers = {"bounces": 8, "samples": 16, "width": 8, "height": 8, "threads": 0}
    job = {"materials": [material(diffuse=[0.5] * 3)], "objects": [{"material": 0}], **numbers}
    direct = _settings(job, 1)
    assert (direct["path.pathdepth.total"], direct["path.pathdepth.diffuse"], direct["sampler.type"]) == (1, 1, "SOBOL")
    assert "native.threads.count" not in direct
    mixed = _settings(job | {"materials": [material(diffuse=[0.1] * 3, mirror=[0.5] * 3)], "threads": 2}, 1)
    assert (mixed["path.pathdepth.total"], mixed["path.pathdepth.diffuse"], mixed["sampler.type"]) == (10, 2, "RANDOM")
    assert mixed["native.threads.count"] == 2


def test_the_window_is_moved_by_one_row(stage: Any) -> None:
    camera = stage.camera((0, 0, 5e4))
    said = {"to_world": camera.to_world.tolist(), "tan_x": 0.4, "tan_y": 0.6, "near": 0.1, "far": 9.0}
    window = _camera({"camera": said, "height": 48, "raised": 1.0})["screenwindow"]
    assert window == pytest.approx([-1.0, 1.0, -1.5 - 3.0 / 48, 1.5 - 3.0 / 48])
    own = _camera({"camera": said, "height": 48, "raised": 0.0})
    assert own["screenwindow"] == pytest.approx([-1.0, 1.0, -1.5, 1.5])
    eye, target = (np.array(own[f"lookat.{name}"]) for name in ("orig", "target"))
    assert np.linalg.norm(eye - target) == pytest.approx(5e4)  # as far off as rounding to float32 asks for


def test_it_declares_what_it_does() -> None:
    declared = LuxCore().declaration(Quality())
    assert (declared.noisy, declared.samples, declared.filter) == (True, 16, "box")
    assert LuxCore().declaration(Quality(samples=1)).filter == "box"  # a sample is anywhere in its pixel


def test_a_mirror_of_more_light_than_there_is_is_refused(stage: Any) -> None:
    for look in ({"mirror": (1.2,) * 3}, {"mirror": (1.0,) * 3, "diffuse": (0.1,) * 3}):
        looks = [stage.replace(stage.grey(0.0), **look)]
        scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), looks)
        with pytest.raises(UnsupportedError, match="more light than there is"):
            LuxCore().render(scene, stage.out, Quality())


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    shiny = stage.replace(stage.grey(), specular=(0.1,) * 3)
    scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), [shiny])
    with pytest.raises(UnsupportedError, match="needs phong"):
        LuxCore().render(scene, stage.out, Quality())


def test_an_interpreter_without_it_says_how_to_get_it(stage: Any) -> None:
    with pytest.raises(RendererMissingError, match="notabug install luxcore"):
        LuxCore(python="/bin/false").render(floor(stage), stage.out, Quality())
