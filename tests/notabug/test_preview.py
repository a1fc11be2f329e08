"""``notabug run preview``: every feature's scene, which of them look alike, and the table."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.judge import judge
from notabug.references.models.model import models
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.results.conformance import cell, markdown, rows
from notabug.runs.selection import choose
from notabug.scenes_usd.catalogue import preview_scenes
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.reader import read_scene

DOCS = Path(__file__).resolve().parents[2] / "docs"

SAME = {  # what the specification says to look the very same, though the files differ
    "roughness_33_map": "roughness_33",
    "specular_metallic": "specular",
    "specular_ior": "specular",
    "metallic_specular": "default",
    "occlusion": "default",
    "opacity_above": "diffuse",
    "light_temperature_off": "diffuse",
    "light_radius": "diffuse",
    "texture_auto": "texture_srgb",
    "opacity_equal": "diffuse",
    "texture_alpha": "texture_srgb",
}
OTHER = (
    *(("roughness_1", "roughness_33"), ("specular", "default"), ("texture_raw", "texture_srgb")),
    *(("normal_bumps", "normal_flat"), ("opacity_threshold", "opacity_above"), ("light_temperature", "diffuse")),
    *(("opacity_map", "opacity"), ("opacity_alpha", "texture_alpha"), ("opacity_alpha", "diffuse")),
    *(("texture_set", "texture_origin"), ("texture_mirror", "texture_repeat"), ("roughness_green", "roughness_map")),
)


def picture(feature: str) -> np.ndarray:
    return predict(read_scene(f"preview/{feature}")).point


@pytest.mark.parametrize("scene", preview_scenes())
def test_every_scene_reads_and_shows_something(scene: str) -> None:
    read = read_scene(scene)
    assert read.card.claim.endswith(".")
    assert read.card.cites
    shown = predict(read).point
    assert shown.max() > 0.02
    assert np.ptp(shown) > 0.01


@pytest.mark.parametrize("feature", SAME)
def test_what_means_the_same_looks_the_same(feature: str) -> None:
    assert np.allclose(picture(feature), picture(SAME[feature]), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(("one", "another"), OTHER)
def test_what_means_something_else_looks_different(one: str, another: str) -> None:
    assert np.abs(picture(one) - picture(another)).max() > 0.02


def test_a_flat_normal_map_changes_nothing() -> None:
    scene = read_scene("preview/normal_flat")
    (ignored,) = [each for each in models(scene) if each.name == "normal_map_ignored"]
    without = trace_picture(*configured(scene, (ignored,)))
    assert np.allclose(without, predict(scene).point, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize(
    ("feature", "fault"),
    [
        ("roughness_map", "number_map_as_srgb"),  # usd-wg/assets 98
        ("specular", "workflow_exchanged"),  # arnold-usd 1183
        ("roughness_33", "roughness_not_squared"),
        ("metallic_half", "metallic_ignored"),
        ("normal_bumps", "normal_green_flipped"),
        ("ior_24", "ior_ignored"),
        ("clearcoat", "clearcoat_missing"),
        ("emission", "emission_missing"),
        ("opacity_map", "opacity_inverted"),
        ("opacity_map", "opacity_ignored"),
        ("opacity_map", "opacity_decoded"),
        ("opacity_map", "opacity_encoded"),
        ("opacity_alpha", "opacity_ignored"),
        ("opacity_alpha", "opacity_inverted"),
        ("opacity_alpha", "opacity_threshold_ignored"),
        ("opacity_alpha", "opacity_decoded"),
        ("opacity_alpha", "cutout_shadow_whole"),
        ("opacity_equal", "opacity_threshold_strict"),
    ],
)
def test_a_misreading_is_a_bug_of_its_name(feature: str, fault: str) -> None:
    scene = replace(read_scene(f"preview/{feature}"), width=64, height=64)
    (model,) = [each for each in models(scene) if each.name == fault]
    wrong = trace_picture(*configured(scene, (model,)))
    verdict = judge([wrong], scene, InHouse().declaration(Quality(samples=1)), perceive=False).verdict
    assert verdict.word == "bug"
    assert next(each.name for each in verdict.findings if each.kind == "bug") == fault


def test_the_word_selects_them_and_all_does_not() -> None:
    assert [choice.id for choice in choose(["preview"], {})] == list(preview_scenes())
    assert [choice.id for choice in choose(["preview/rough*"], {})] == [
        each for each in preview_scenes() if each.startswith("preview/rough")
    ]
    assert not [choice for choice in choose([], {}) if choice.id.startswith("preview/")]
    with pytest.raises(SelectionError, match="preview/diffuse"):
        choose(["preview/none"], {})


def result(feature: str, renderer: str, word: str, *findings: tuple[str, str]) -> dict[str, Any]:
    named = [{"kind": kind, "name": name} for kind, name in findings]
    return {
        "scene": f"preview/{feature}",
        "claim": "It is so.",
        "renderer": renderer,
        "verdict": word,
        "findings": named,
    }


def test_the_table() -> None:
    found = rows(
        [
            result("ior_24", "a", "pass"),
            result("ior_24", "b", "bug", ("convention", "masking_schlick"), ("bug", "ior_ignored")),
            result("specular", "a", "pass", ("convention", "masking_schlick")),
            result("specular", "b", "unsupported"),
            {**result("x", "a", "pass"), "scene": "acne/sphere"},
        ]
    )
    assert markdown(found) == [
        "| feature | what is specified | a | b |",
        "|---|---|---|---|",
        "| ior 24 | It is so. | right | bug: ior ignored |",
        "| specular | It is so. | convention: masking schlick | unsupported |",
    ]
    assert cell(result("x", "a", "limitation", ("limitation", "facet_self_shadow"))) == "limitation: facet self shadow"


def test_the_page_has_every_feature() -> None:
    text = (DOCS / "preview.md").read_text("utf-8")
    for scene in preview_scenes():
        assert f"| {scene.partition('/')[2].replace('_', ' ')} | {read_scene(scene).card.claim} |" in text
    spec = importlib.util.spec_from_file_location("preview_page", DOCS / "preview.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.page([]).startswith(text.splitlines()[0])
