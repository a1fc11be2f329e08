"""Seeds of one sample a pixel: each must show one of the values that a limitation lists, whatever their mean is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Declaration
from notabug.references.predict import predict
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]

BOX = Declaration("float32", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=True, samples=1)
ONE = replace(BOX, coincident="unknown", silhouette="keep")
COINCIDENT = ("visibility/coincident_planes", "visibility/coincident_spheres")


def _small(studio: Any, name: str, **variants: str) -> Scene:
    return replace(studio.scene(name, **variants), width=48, height=48)


def _mixed(values: list[Floats], shares: list[float], seeds: int) -> list[Floats]:
    """One picture a seed, each pixel of which shows one of ``values`` by chance."""
    rng = np.random.default_rng(seeds)
    taken = [rng.choice(len(values), size=values[0].shape[:2], p=shares) for _ in range(seeds)]
    return [np.choose(each[..., None], values) for each in taken]


def _shown(studio: Any, scene: Scene, *names: str) -> Floats:
    return np.asarray(predict(scene, [studio.model(scene, each) for each in names]).point)


@pytest.mark.parametrize("seeds", [4, 8])
@pytest.mark.parametrize("name", COINCIDENT)
def test_a_fight_of_the_surfaces_is_the_limitation(studio: Any, name: str, seeds: int) -> None:
    scene = _small(studio, name)
    both = [_shown(studio, scene), _shown(studio, scene, "another_wins")]
    verdict = studio.verdict(_mixed(both, [0.5, 0.5], seeds), scene, ONE, naming=False)
    assert (verdict.word, [each.name for each in verdict.findings]) == ("limitation", ["coincident_surfaces"])


@pytest.mark.parametrize("seeds", [4, 8])
@pytest.mark.parametrize("name", COINCIDENT)
def test_a_blend_among_them_is_a_bug(studio: Any, name: str, seeds: int) -> None:
    """In the mean it lies between what the limitation admits."""
    scene = _small(studio, name)
    three = [_shown(studio, scene, *each) for each in ((), ("another_wins",), ("colour_of_neither",))]
    assert studio.verdict(_mixed(three, [0.3, 0.3, 0.4], seeds), scene, ONE, naming=False).word == "bug"


@pytest.mark.parametrize("name", COINCIDENT)
def test_nothing_but_blends_is_a_bug(studio: Any, name: str) -> None:
    scene = _small(studio, name)
    shown = _shown(studio, scene, "colour_of_neither")
    seeds = _mixed([shown, shown * (1.0 + 1e-5)], [0.5, 0.5], 4)
    assert studio.verdict(seeds, scene, ONE, naming=False).word == "bug"


def test_dots_are_acne(studio: Any) -> None:
    """Each seed shows a pixel lit or unlit."""
    scene = _small(studio, "acne/sphere", camera_distance="1e3")
    bright = _shown(studio, scene)
    band = (predict(scene, [studio.model(scene, "acne").under(ONE)]).point != bright).any(axis=2)
    assert 10 < band.sum() < 0.25 * (bright > 0).any(axis=2).sum()
    dark = np.where(band[..., None], 0.0, bright)
    dots = studio.verdict(_mixed([bright, dark], [0.5, 0.5], 4), scene, ONE, naming=False)
    assert (dots.word, [each.name for each in dots.findings]) == ("limitation", ["acne"])
