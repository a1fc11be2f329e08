"""Models of shadow maps: where each can act, against closed forms and each pixel that a rasteriser gets wrong."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.references.models.model import Model, models
from notabug.references.models.shadow_map import COARSEST, REACH, settings
from notabug.references.predict import configured
from notabug.references.raster.picture import RasterOptions, raster_picture
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene, ShadowMap

LIMITATIONS = ("shadow_map_acne", "shadow_map_steps", "shadow_map_detached")
SIZE = 56


def limitations(scene: Scene, texels: str = "nearest") -> dict[str, Model]:
    found = [each for each in models(scene) if each.name in LIMITATIONS and ("shadow_filter", texels) in each.also]
    return {each.name: each for each in found}


def small(name: str, **variants: str) -> Scene:
    return replace(read_scene(name, variants), width=SIZE, height=SIZE)


def drawn(scene: Scene, *applied: Model) -> Any:
    return trace_picture(*configured(scene, applied))


def mapped(scene: Scene) -> Any:
    """The picture by the z-buffer, with the maps that the light asks for."""
    said = scene.lights[0].shadow_map
    assert said is not None
    options = RasterOptions(shadow_map=said.resolution, shadow_bias=said.bias, shadow_normal_bias=said.normal_bias)
    return raster_picture(scene, options, dtype=np.float32)


def alike(a: Any, b: Any) -> Any:
    return (np.abs(a - b) <= 1e-3 * np.abs(b) + 1e-5 * np.abs(b).max()).all(axis=2)


@pytest.mark.parametrize("name", ["shadow_map/box", "shadow_map/slopes", "shadow_map/thin_wall"])
@pytest.mark.parametrize(
    "said",
    [
        ShadowMap(64, 0.0),
        ShadowMap(200, 0.03),
        ShadowMap(256, 0.3),
        ShadowMap(500, 0.01, 0.05),
        ShadowMap(32, 0.1, 0.1),
    ],
    ids=str,
)
def test_what_a_rasteriser_gets_wrong_is_one_of_the_values(name: str, said: ShadowMap) -> None:
    """At each pixel, at any resolution and bias: the reference or what one of the limitations has there."""
    scene = small(name)
    scene = replace(scene, lights=tuple(replace(each, shadow_map=said) for each in scene.lights))
    reference, picture = drawn(scene), mapped(scene)
    wrong = ~alike(picture, reference)
    values = [value for each in limitations(scene).values() for value in each.values()]
    explained = np.logical_or.reduce([alike(picture, drawn(scene, value)) for value in values])
    assert not (wrong & ~explained).any()
    if said.resolution <= 200:
        assert wrong.sum() > 5  # or nothing was tried


def test_a_light_that_asks_for_a_map_moves_no_pixel_of_the_reference() -> None:
    scene = small("shadow_map/box")
    plain = replace(scene, lights=tuple(replace(each, shadow_map=None) for each in scene.lights))
    assert np.array_equal(drawn(scene), drawn(plain))
    assert scene.digest() != plain.digest()  # but a renderer's picture


def tilted(make: Any, degrees: float, said: ShadowMap) -> Scene:
    """A floor seen and lit from above, the light ``degrees`` off its normal."""
    turn = math.radians(degrees)
    sun = replace(make.distant((math.sin(turn), 0.0, -math.cos(turn))), shadow_map=said)
    return make.scene([make.rectangle(0.0, 2.0)], [sun], make.camera((0, 0, 4), (0, 0, 0), 0.3), size=16)


@pytest.mark.parametrize("degrees", [20.0, 45.0, 70.0])
@pytest.mark.parametrize("texels", ["nearest", "linear"])
def test_acne_ends_where_the_bias_clears_the_slope(make: Any, degrees: float, texels: str) -> None:
    """A floor's depth changes by the tangent times half a texel's diagonal: below that there may be stripes."""
    texel = settings(tilted(make, degrees, ShadowMap(100))).texel
    clears = REACH[texels] * texel * math.tan(math.radians(degrees))
    for share, striped in ((0.9, True), (1.1, False)):
        scene = tilted(make, degrees, ShadowMap(100, bias=share * clears))
        dark = drawn(scene, limitations(scene, texels)["shadow_map_acne"]).max(axis=2) == 0
        assert dark.all() == striped
        assert dark.any() == striped


def test_a_normal_bias_clears_as_much_as_its_height_over_the_cosine(make: Any) -> None:
    degrees = 60.0
    turn = math.radians(degrees)
    texel = settings(tilted(make, degrees, ShadowMap(100))).texel
    clears = REACH["nearest"] * texel * math.tan(turn) * math.cos(turn)
    for share, striped in ((0.9, True), (1.1, False)):
        scene = tilted(make, degrees, ShadowMap(100, normal_bias=share * clears))
        assert (drawn(scene, limitations(scene)["shadow_map_acne"]).max() == 0) == striped


@pytest.mark.parametrize("kind", ["distant", "point"])
def test_a_shadow_comes_off_what_is_nearer_than_the_bias(make: Any, kind: str) -> None:
    """A card a tenth above the floor, lit from above: a larger bias may lose its shadow, and no smaller one."""
    for bias, lost in ((0.09, False), (0.115, True)):
        light = make.distant((0, 0, -1)) if kind == "distant" else make.point((0, 0, 30), 900.0)
        light = replace(light, shadow_map=ShadowMap(2048, bias))
        card = make.rectangle(0.1, 0.5)
        scene = make.scene([make.rectangle(0.0, 9.0), card], [light], make.camera((3, 0, 3), (0, 0, 0), 0.3), size=32)
        reference = drawn(scene).max(axis=2)
        lit = drawn(scene, limitations(scene)["shadow_map_detached"]).max(axis=2)
        dark = reference == 0
        assert dark.sum() > 10
        assert ((lit > 0) & dark).sum() == (dark.sum() if lost else 0)
        assert np.array_equal(lit[~dark], reference[~dark])


def test_steps_keep_to_a_texel_of_the_edge(make: Any) -> None:
    """Under a light from above: no farther from the card's shadow than half of a texel's diagonal, on either side."""
    light = replace(make.distant((0, 0, -1)), shadow_map=ShadowMap(64, 0.05))
    objects = [make.rectangle(0.0, 2.0), make.rectangle(0.5, 0.5)]
    below = make.scene(objects, [light], make.camera((0, 0, 0.4), (0, 0, 0), 2.0), size=64)  # from beneath the card
    x = 0.4 * 2.0 * ((np.arange(64) + 0.5) / 32.0 - 1.0)
    outside = np.maximum(np.abs(x)[None, :], np.abs(x)[:, None]) - 0.5
    reach = REACH["nearest"] * settings(below).texel
    reference = drawn(below).max(axis=2)
    dark, lit = (drawn(below, each).max(axis=2) for each in limitations(below)["shadow_map_steps"].values())
    assert np.array_equal(dark != reference, (outside > 0) & (dark == 0))
    assert ((dark == 0) | (outside > 0.65 * reach)).all()
    assert ((dark > 0) | (outside < 1.05 * reach)).all()
    assert ((lit > 0) | (outside < -0.65 * reach)).all()
    assert ((lit == 0) | (outside > -1.05 * reach)).all()


def test_what_is_said_of_maps() -> None:
    """The coarsest of the lights' maps, and a bias only where all have the same; a declaration wins over both."""
    from notabug.adapters.zbuffer import ZBuffer

    scene = small("shadow_map/box")
    (sun,) = scene.lights
    said = settings(scene)
    assert (said.cells, said.bias, said.normal_bias) == (256, pytest.approx(0.03), 0.0)
    other = replace(sun, shadow_map=ShadowMap(128, 0.1))
    assert settings(replace(scene, lights=(sun, other))).cells == 128
    assert settings(replace(scene, lights=(sun, other))).bias is None
    unsaid = settings(replace(scene, lights=(replace(sun, shadow_map=None),)))
    assert (unsaid.cells, unsaid.bias) == (COARSEST, None)
    declared = ZBuffer(shadow_map=77, shadow_bias=0.5, shadow_normal_bias=0.25)
    (acne, *_) = limitations(scene).values()
    from notabug.adapters.base import Quality

    under = acne.under(declared.declaration(Quality()))
    assert [under.options[each] for each in ("map_cells", "map_bias", "map_normal_bias")] == [77, 0.5, 0.25]
    assert acne.open_to(declared.declaration(Quality()))
    empty = replace(declared.declaration(Quality()), shadow_resolution=0)
    assert acne.under(empty).options["map_cells"] == 256  # no texels: as if nothing were said
    assert not acne.open_to(ZBuffer().declaration(Quality()))
