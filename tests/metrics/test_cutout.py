"""Verdicts on texture_space/cutout: each wrong number for the opacity, wrong border and wrong shadow is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.references.models import opacity_map
from notabug.references.models.model import Model
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.authoring.texture_space_cutout import THRESHOLD, picture
from notabug.scenes_usd.scene import Scene

CUTOUT = "texture_space/cutout"
POINT = InHouse().declaration(Quality(samples=1))
UNSAID = replace(POINT, opacity_filter="unknown")
SIZE = 48
BOTH = {"opacity_ignored", "opacity_inverted", "opacity_decoded", "opacity_encoded", "opacity_of_red",
        "colour_times_alpha", "filtered_with_alpha"}  # fmt: skip
FAULTS = {"cut": BOTH | {"opacity_threshold_ignored", "cutout_shadow_whole"}, "fade": BOTH}


def scene_of(studio: Any, alpha: str) -> Scene:
    return replace(studio.scene(CUTOUT, alpha=alpha), width=SIZE, height=SIZE)


def named(scene: Scene, name: str) -> list[Model]:
    return [each for each in opacity_map.models(scene) if each.name == name]


def found(studio: Any, drawn: Any, scene: Scene, declared: Any = UNSAID) -> tuple[str, list[tuple[str, str]]]:
    verdict = studio.verdict([drawn], scene, declared)
    return verdict.word, [(each.kind, each.name) for each in verdict.findings]


@pytest.mark.parametrize("alpha", FAULTS)
def test_the_scene_shows_every_fault_that_it_can(studio: Any, alpha: str) -> None:
    models = list(opacity_map.models(scene_of(studio, alpha)))
    assert {each.name for each in models if each.kind == "fault"} == FAULTS[alpha]
    assert [each.name for each in models if each.kind != "fault"] == ["associated_filter"]


@pytest.mark.sweep_except(
    "cut-opacity_decoded",
    "cut-opacity_of_red",
    "cut-opacity_threshold_ignored",
    "cut-cutout_shadow_whole",
    "cut-filtered_with_alpha",
    "fade-colour_times_alpha",
    "fade-opacity_encoded",
    "fade-opacity_ignored",
    "fade-opacity_inverted",
)
@pytest.mark.parametrize(
    ("alpha", "name"),
    [(alpha, name) for alpha in FAULTS for name in sorted(FAULTS[alpha])],
)
def test_each_fault_is_a_bug_and_named(studio: Any, alpha: str, name: str) -> None:
    scene = scene_of(studio, alpha)
    for model in named(scene, name):
        wrong = trace_picture(*configured(scene, (model,)))
        declared = POINT if name == "filtered_with_alpha" else UNSAID
        assert found(studio, wrong, scene, declared) == ("bug", [("bug", name)]), model.claim


@pytest.mark.parametrize("alpha", FAULTS)
def test_colour_and_alpha_filtered_together_are_a_convention(studio: Any, alpha: str) -> None:
    scene = scene_of(studio, alpha)
    (model,) = named(scene, "associated_filter")
    drawn = trace_picture(*configured(scene, (model,)))
    assert np.abs(drawn - predict(scene).point).max() > 0.05, "no fringe"
    together = replace(POINT, opacity_filter="together")
    for declared in (UNSAID, together):
        assert found(studio, drawn, scene, declared) == ("pass", [("convention", "associated_filter")])
    for declared in (UNSAID, together, POINT):
        assert found(studio, trace_picture(scene), scene, declared) == ("pass", [])


@pytest.mark.sweep_except("repeated")
@pytest.mark.parametrize("change", ["finer", "repeated", "higher"])
def test_other_cutouts_are_told_as_well(studio: Any, change: str) -> None:
    """A picture of more texels, one that is shown again and again, and another threshold."""
    scene = scene_of(studio, "cut")
    if change == "finer":
        edges = [np.repeat(np.repeat(each.pixels, 2, axis=0), 2, axis=1) for each in scene.textures]
        pictures = [replace(each, pixels=pixels) for each, pixels in zip(scene.textures, edges, strict=True)]
        scene = replace(scene, textures=tuple(pictures))
    elif change == "repeated":
        pictures = [replace(each, wrap_s="repeat", wrap_t="repeat") for each in scene.textures]
        sheets = [each if each.uv is None else replace(each, uv=each.uv * 2.0 - 0.5) for each in scene.meshes]
        scene = replace(scene, textures=tuple(pictures), objects=tuple(sheets))
    else:
        looks = [replace(each, cutoff=0.6) if each.opacity_map >= 0 else each for each in scene.materials]
        scene = replace(scene, materials=tuple(looks))
    scene = replace(scene, id=str(Path(CUTOUT) / change))
    assert found(studio, trace_picture(scene), scene) == ("pass", [])
    (together,) = named(scene, "associated_filter")
    drawn = trace_picture(*configured(scene, (together,)))
    assert found(studio, drawn, scene) == ("pass", [("convention", "associated_filter")])
    dark = named(scene, "colour_times_alpha")[-1]
    assert found(studio, trace_picture(*configured(scene, (dark,))), scene) == ("bug", [("bug", "colour_times_alpha")])


def test_what_the_scene_says_of_itself(studio: Any) -> None:
    """Clear texels have another colour than the leaf's, none is at the threshold, and light falls through the hole."""
    texels = picture().reshape(-1, 4)
    clear, leaf = texels[texels[:, 3] == 0], texels[texels[:, 3] == 255]
    assert len(clear) > 20
    assert len(leaf) > 20
    assert clear[:, 1].max() < leaf[:, 1].min()
    alphas = texels[:, 3] / 255
    assert ((alphas > 0.0) & (alphas < float(THRESHOLD))).any()
    assert ((alphas > float(THRESHOLD)) & (alphas < 1.0)).any()
    assert np.abs(alphas - float(THRESHOLD)).min() > 0.01
    scene = scene_of(studio, "cut")
    right = predict(scene).point
    (whole,) = named(scene, "cutout_shadow_whole")
    lit = right.sum(axis=2) - trace_picture(*configured(scene, (whole,))).sum(axis=2)
    assert lit.min() > -1e-5, "a whole sheet lights nothing"
    assert (lit > 0.1).mean() > 0.05
