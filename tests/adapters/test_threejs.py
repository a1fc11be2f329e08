"""three.js in a browser: shading, highlights and textures against closed forms and our rasteriser."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.threejs import ThreeJs
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.scene import Texture

NORMAL = np.array([0.0, 0.0, 1.0])


@pytest.mark.slow
def test_a_floor_under_two_lights_at_four_samples_a_pixel(stage: Any, threejs: ThreeJs) -> None:
    lights = [stage.point((0.5, 0.3, 2.0)), stage.distant((0.3, 0.2, 1.0), (2.0, 1.0, 0.5))]
    scene = stage.scene([stage.quad()], lights, stage.camera((0, -3, 4)))
    finer = stage.on_plane(stage.replace(scene, width=128, height=128))
    expected = sum(0.8 / np.pi * E * cosine for E, cosine in (stage.lit(finer, NORMAL, light) for light in lights))
    boxes = expected.reshape(64, 2, 64, 2).mean(axis=(1, 3))
    picture = stage.draw(threejs, scene, Quality(samples=4))
    assert np.abs(picture[..., 0] / boxes - 1.0).max() < 5e-3  # a corner of the floor may lie 1/64 sample off


@pytest.mark.slow
def test_a_highlight_is_blinns_by_n_2_over_8_and_the_cosine(stage: Any, threejs: ThreeJs) -> None:
    """Also of one that is stronger than all light: three.js does not cut it off."""
    light = stage.distant((0.2, 0.5, 1.0), (np.pi,) * 3)
    for strength in (0.4, 3.0):
        shiny = stage.replace(stage.grey(0.5), specular=(strength,) * 3, exponent=24.0, lobe="blinn")
        scene = stage.scene([stage.quad()], [light], stage.camera((0, -3, 4)), [shiny])
        L = -np.array(light.direction)
        _, D = stage.rays(scene)
        H = L - D
        H /= np.linalg.norm(H, axis=-1, keepdims=True)
        expected = (0.5 + strength * 26 / 8 * np.maximum(H @ NORMAL, 0) ** 24) * (L @ NORMAL)
        assert np.abs(stage.draw(threejs, scene)[..., 0] / expected - 1.0).max() < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("clamp", "clamp"), ("clamp", "repeat")])
def test_a_texture_repeats_and_clamps_on_each_axis(stage: Any, threejs: ThreeJs, wraps: Any) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((5, 8, 3)) * 3.0, *wraps)
    uv = np.array([[-0.7, -1.2], [1.9, -1.2], [1.9, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture])
    assert np.abs(stage.draw(threejs, scene) - raster_picture(scene)).max() < 3e-3


@pytest.mark.slow
def test_a_lamp_within_a_tenth_of_a_unit_and_a_browser_that_stays(stage: Any, threejs: ThreeJs) -> None:
    """three.js' own light stops growing there, which is gone round; the second picture starts no browser."""
    light = stage.point((0.0, 0.0, 0.05), (0.0025 * np.pi,) * 3)
    camera = stage.camera((0, 0, 1.0), tan=0.002)
    scene = stage.scene([stage.quad(0.5)], [light], camera, [stage.grey(1.0)], size=(8, 8))
    E, cosine = stage.lit(stage.on_plane(scene), NORMAL, light)
    assert np.abs(stage.draw(threejs, scene)[..., 0] / (E * cosine / np.pi) - 1.0).max() < 5e-4
    own = stage.replace(threejs, unit=1.0)
    first = own._route()._script().child()
    assert stage.draw(own, scene) == pytest.approx(0.25, abs=0.001)
    assert first.hello.startswith("Chrome ")
    assert own._route()._script().child() is first


@pytest.mark.slow
def test_what_the_device_cannot_draw_is_an_error_and_the_next_picture_is_drawn(stage: Any, threejs: ThreeJs) -> None:
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad()], [light], stage.camera((0, 0, 5)), [stage.grey(0.5)], size=(8, 8))
    with pytest.raises(RendererError, match="larger than"):
        threejs.render(scene, stage.out, Quality(samples=1 << 24))
    assert stage.draw(threejs, scene) == pytest.approx(0.5)


def test_it_declares_the_lobe_and_the_grid_of_its_device() -> None:
    declared = ThreeJs().declaration(Quality(samples=5))
    assert (declared.lobe, declared.normalised, declared.highlight) == ("blinn", "n2over8", "cosine")
    assert (declared.depth, declared.shadows, declared.samples, declared.filter) == ("unknown", "none", 9, "box")
    assert ThreeJs(angle="gl-egl").declaration(Quality()).depth == "float32"
    assert (declared.subpixel_bits, ThreeJs(angle="gl-egl").declaration(Quality()).subpixel_bits) == (4, 8)


def test_shadow_maps_are_drawn_where_they_are_asked_for(stage: Any) -> None:
    mapped = ThreeJs(shadow_maps=True)
    declared = mapped.declaration(Quality())
    assert (declared.shadows, declared.shadow_algorithm, declared.shadow_filter) == ("cast", "map", "nearest")
    for light, why in ((stage.distant((0, 0, 1)), "shadow_map"), (stage.point((0.0, 0.0, 2.0)), "point_light")):
        scene = stage.scene([stage.quad()], [light], stage.camera((0, 0, 5)))
        scene = stage.replace(scene, card=stage.replace(scene.card, artifact_class="shadow_map"))
        with pytest.raises(UnsupportedError, match=f"needs {why}"):
            mapped.render(scene, stage.out, Quality())


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    for look, why in (({"specular": (0.1, 0.2, 0.1)}, "coloured_highlight"), ({"opacity": 0.5}, "opacity")):
        looks = [stage.replace(stage.grey(), **look)]
        scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)), looks)
        with pytest.raises(UnsupportedError, match=f"needs {why}"):
            ThreeJs().render(scene, stage.out, Quality())


def test_a_machine_without_it_says_how_to_get_it(stage: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path))
    scene = stage.scene([stage.quad()], [stage.distant((0, 0, 1))], stage.camera((0, 0, 5)))
    with pytest.raises(RendererMissingError, match="notabug install threejs"):
        ThreeJs().render(scene, stage.out, Quality())


def installed_nothing(cache: Path) -> None:
    """An environment that looks as npm leaves it, with an empty library."""
    package = cache / "renderers" / "threejs" / "node_modules" / "three"
    (package / "build").mkdir(parents=True)
    (package / "build" / "three.module.js").touch()
    (package / "package.json").write_text('{"version": "0.187.0"}')
    (cache / "renderers" / "threejs" / "notabug-environment.json").write_text('{"requirements": ["three@0.187.0"]}')


def test_a_browser_that_is_missing_or_does_not_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path))
    installed_nothing(tmp_path)
    with pytest.raises(RendererMissingError, match=r"no browser on PATH.*netscape.*apt install chromium"):
        ThreeJs(browser="netscape").find()
    with pytest.raises(RendererMissingError, match=r"cannot draw in float32.*the browser has ended"):
        ThreeJs(browser="/bin/false").find()
