"""Faults of opacity from a map: which apply, and what each makes of the texels that the scene has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.judge import judge
from notabug.references.models.model import Model, models
from notabug.references.models.opacity_map import edit_masks, multiplied
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Floats, Material, Scene, Texture
from notabug.scenes_usd.srgb import decode_srgb, encode_srgb

OPACITY = {"opacity_ignored", "opacity_inverted"}
GREY = {"opacity_decoded", "opacity_encoded"}
CUT = {"opacity_threshold_ignored", "cutout_shadow_whole"}
PAINTED = {"opacity_of_red", "colour_times_alpha", "filtered_with_alpha"}
ALL = OPACITY | GREY | CUT | PAINTED | {"opacity_threshold_strict"}


def found(scene: Scene) -> dict[str, list[Model]]:
    named: dict[str, list[Model]] = {}
    for model in models(scene):
        if model.name in ALL:
            named.setdefault(model.name, []).append(model)
    return named


def mask_of(scene: Scene, model: Model) -> Floats:
    edited, _ = configured(scene, (model,))
    (material,) = (each for each in edited.materials if each.opacity_map >= 0)
    return edited.textures[material.opacity_map].pixels


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("preview/opacity_map", OPACITY | GREY),
        ("preview/opacity_alpha", OPACITY | GREY | CUT | PAINTED),
        ("preview/opacity_equal", OPACITY | GREY | CUT | {"opacity_threshold_strict"}),
        ("preview/texture_alpha", set()),
        ("preview/diffuse", set()),
    ],
)
def test_they_follow_from_what_a_scene_holds(name: str, expected: set[str]) -> None:
    assert set(found(read_scene(name))) == expected


def test_each_takes_another_number_for_the_opacity() -> None:
    scene = read_scene("preview/opacity_alpha")
    (material,) = (each for each in scene.materials if each.opacity_map >= 0)
    mask, colours = scene.textures[material.opacity_map].pixels, scene.textures[material.texture].pixels
    named = found(scene)
    assert mask_of(scene, named["opacity_inverted"][0]) == pytest.approx(1.0 - mask)
    assert mask_of(scene, named["opacity_decoded"][0]) == pytest.approx(decode_srgb(mask))
    assert mask_of(scene, named["opacity_encoded"][0]) == pytest.approx(encode_srgb(mask))
    linear, stored = named["opacity_of_red"]
    assert mask_of(scene, linear) == pytest.approx(np.repeat(colours[..., :1], 3, axis=2))
    assert mask_of(scene, stored) == pytest.approx(np.repeat(encode_srgb(colours)[..., :1], 3, axis=2))


def test_colours_are_multiplied_linear_or_as_stored() -> None:
    scene = read_scene("preview/opacity_alpha")
    (material,) = (each for each in scene.materials if each.opacity_map >= 0)
    mask, colours = scene.textures[material.opacity_map].pixels, scene.textures[material.texture].pixels
    meant = (colours * mask, decode_srgb(encode_srgb(colours) * mask))
    for model, pixels in zip(found(scene)["colour_times_alpha"], meant, strict=True):
        edited, _ = configured(scene, (model,))
        (painted,) = (each for each in edited.materials if each.opacity_map >= 0)
        np.testing.assert_allclose(edited.textures[painted.texture].pixels, pixels)
        np.testing.assert_array_equal(edited.textures[painted.opacity_map].pixels, mask)


def test_who_filters_colour_and_alpha_together_has_a_convention_of_its_own() -> None:
    scene = read_scene("preview/opacity_alpha")
    (model,) = (each for each in models(scene) if each.name == "associated_filter")
    assert not [each for each in models(read_scene("preview/opacity_map")) if each.name == "associated_filter"]
    picture = trace_picture(*configured(scene, (model,)))
    assert np.abs(picture - predict(scene).point).max() > 0.02
    declaration = replace(InHouse().declaration(Quality(samples=1)), opacity_filter="unknown")
    verdict = judge([picture], scene, declaration, perceive=False).verdict
    assert verdict.word == "pass"
    assert [(each.kind, each.name) for each in verdict.findings] == [("convention", "associated_filter")]


def test_a_dark_fringe_is_a_bug() -> None:
    scene = read_scene("preview/opacity_alpha")
    (dark,) = (each for each in found(scene)["colour_times_alpha"] if "encoded" not in each.claim)
    wrong = trace_picture(*configured(scene, (dark,)))
    verdict = judge([wrong], scene, InHouse().declaration(Quality(samples=1)), perceive=False).verdict
    assert verdict.word == "bug"
    assert "colour_times_alpha" in [each.name for each in verdict.findings]


def test_other_maps_that_are_the_same_texture_keep_theirs(make: Any) -> None:
    """A colour and an opacity from one channel of one file are one texture."""
    both = Texture(Path("both"), np.full((2, 2, 3), 0.3), "clamp", "clamp")
    looks = [Material("/Look", (1.0,) * 3, 0, opacity_map=0)]
    uv = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    camera = make.camera((0, 0, 5), (0, 0, 0))
    scene = make.scene([make.rectangle(uv=uv)], [], camera, materials=looks, textures=[both])
    edited = edit_masks(lambda _, mask: 1.0 - mask.pixels)(scene)
    (material,) = edited.materials
    np.testing.assert_allclose(edited.textures[material.texture].pixels, 0.3)
    np.testing.assert_allclose(edited.textures[material.opacity_map].pixels, 0.7)
    dark = multiplied(lambda colour, alpha: colour * alpha)(scene)
    np.testing.assert_allclose(dark.textures[dark.materials[0].texture].pixels, 0.09)
    other = replace(scene, textures=(both, replace(both, pixels=np.ones((3, 2, 3)))))
    apart = replace(other, materials=(replace(looks[0], opacity_map=1),))
    assert multiplied(lambda colour, alpha: colour * alpha)(apart).materials == apart.materials
