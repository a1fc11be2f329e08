"""Small objects in the mean of random samples: what the prediction misses of them is not the picture's to have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.metrics.admissible import admissible
from notabug.metrics.judge import judge
from notabug.metrics.noise import measure
from notabug.metrics.predictions import Predictions
from notabug.metrics.second_look import shared_out
from notabug.references.models.model import models
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_envelope, trace_picture
from notabug.references.tracer.precision import RELATIVE, asked
from notabug.scenes_usd.scene import Camera, Card, Light, Material, Mesh, Scene, Texture

WIDTH, HEIGHT = 32, 24
TEXELS = np.array([[0.9, 0.2, 0.7], [0.1, 0.8, 0.3], [0.6, 0.15, 0.95]])
SAMPLES, SEEDS = 16, 4


def _sign(wide: float, high: float) -> Scene:
    """A textured rectangle, ``wide`` x ``high`` pixels, in the middle of a black picture."""
    x, y = wide / WIDTH, high / HEIGHT
    points = np.array([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)])
    uv = np.array([(0.03, 0.0), (0.97, 0.0), (0.97, 1.0), (0.03, 1.0)])
    sign = Mesh("/Sign", points, np.array([4], np.int32), np.arange(4, dtype=np.int32), 0, uv=uv)
    place = np.eye(4)
    place[3, 2] = 1.0
    pixels = np.stack([TEXELS, TEXELS.T, 1.0 - TEXELS], axis=2)
    return Scene(
        "test/sign",
        Path("scene.usda"),
        {},
        Card("own", "A small sign."),
        Camera("/Camera", place, 1.0, 1.0, 1e-3, 1e6),
        WIDTH,
        HEIGHT,
        (sign,),
        (Light("/Sun", "distant", (np.pi,) * 3, direction=(0.0, 0.0, -1.0)),),
        (Material("/Paint", (1.0, 1.0, 1.0), texture=0),),
        (Texture(Path("sign.png"), pixels, "clamp", "clamp"),),
        None,
    )


def _drawn(scene: Scene, fault: str = "", first: int = 0) -> list[Any]:
    chosen = [model for model in models(scene) if model.name == fault]
    assert bool(chosen) == bool(fault)
    return [trace_picture(*configured(scene, chosen), samples=SAMPLES, seed=first + seed) for seed in range(SEEDS)]


@pytest.fixture
def random(studio: Any) -> Any:
    return replace(studio.box, noisy=True, samples=SAMPLES, texture_filter="bilinear")


@pytest.mark.parametrize(("wide", "high"), [(5.3, 4.4), (6.6, 4.2), (4.7, 7.5)])
def test_a_fault_of_a_few_pixels_is_found_in_random_samples(random: Any, wide: float, high: float) -> None:
    scene = _sign(wide, high)
    found = judge(_drawn(scene, "texture_nearest"), scene, random, perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", "texture_nearest")


@pytest.mark.parametrize("first", range(0, 40, SEEDS))
def test_right_pictures_of_a_few_pixels_pass(random: Any, first: int) -> None:
    scene = _sign(5.3, 4.4)
    assert judge(_drawn(scene, first=first), scene, random, perceive=False).verdict.word == "pass"


def test_samples_that_nobody_declares_random_may_miss_as_much_as_the_prediction(random: Any) -> None:
    scene = _sign(5.3, 4.4)
    unknown = replace(random, noisy=None)
    assert judge(_drawn(scene, "texture_nearest"), scene, unknown, perceive=False).verdict.word != "bug"


def test_a_second_look_is_as_exact_as_a_reference(random: Any) -> None:
    scene = _sign(5.3, 4.4)
    bare = predict(scene)
    inner = admissible(bare, random).inner
    assert inner is not None
    at = inner & (bare.mean.max(axis=2) > 0)
    predicted = Predictions(scene, bare, admissible(bare, random), random, RELATIVE, None).finely(at)
    truth = trace_envelope(scene.as_intended(), grid=64, refine=0).mean
    exact = predicted(()).exact
    assert exact is not None
    assert exact.sum() >= 8
    peak = float(truth.max())
    allowed = asked(truth, np.zeros_like(truth), np.zeros_like(exact), peak)
    assert (np.abs(predicted(()).value - truth) <= 2.0 * allowed)[exact].all()
    assert (np.abs(bare.mean - truth) > 2.0 * allowed)[exact].any()  # which the first look was not
    assert not (predicted(()).edge & exact).any()


def test_a_pixel_beside_an_edge_has_its_own_noise(random: Any) -> None:
    scene = _sign(5.3, 4.4)
    bare = predict(scene)
    target = admissible(bare, random)
    assert target.inner is not None
    measured = measure(_drawn(scene), target.edge, SAMPLES)
    at = target.inner & (bare.variance.max(axis=2) > 0)
    told = shared_out(measured, target, at)
    many = np.stack([_drawn(scene, first=SEEDS * k) for k in range(1, 33)])  # (32, 4, h, w, 3)
    true = many.mean(axis=1).var(axis=0, ddof=1)
    ratio = np.median((told.variance / np.maximum(true, 1e-12))[at])
    pooled = np.median((measured.variance / np.maximum(true, 1e-12))[at])
    assert 0.5 < ratio < 3.0
    assert pooled > 2.0 * ratio  # what is pooled there is the noise of the edges
    np.testing.assert_array_equal(told.variance[~at], measured.variance[~at])


def test_an_edge_that_a_second_look_finds_has_its_interval_alone(random: Any) -> None:
    scene = _sign(5.3, 4.4)
    bare = predict(scene)
    everywhere = np.ones(bare.edge.shape, np.bool_)
    target = Predictions(scene, bare, admissible(bare, random), random, RELATIVE, None).finely(everywhere)(())
    assert target.exact is not None
    assert target.missed is not None
    crossed = bare.edge
    assert not (target.exact & crossed).any()
    assert (target.missed[crossed] == 0.0).all()
    assert (target.hi > target.lo)[crossed].any()
    assert (target.missed[target.exact] > 0.0).any()


def test_accused_pixels_are_predicted_more_closely_before_they_are_a_bug(
    studio: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reference is 30 % off in nine pixels, as in a penumbra in 16 subsamples: what is right there is no bug."""
    scene = replace(studio.scene("terminator/sphere"), width=48, height=48)
    right = predict(scene, ())
    at = np.s_[32:35, 41:44]
    assert right.mean[at].min() > 0.3
    assert not admissible(right, studio.box).edge[at].any()
    off = np.array(right.mean)
    off[at] *= 1.3
    monkeypatch.setattr("notabug.metrics.expected.predict", lambda scene, models: replace(right, mean=off))
    picture = np.array(right.mean)
    for factor, word in ((1.0, "pass"), (0.5, "bug")):
        picture[at] = factor * right.mean[at]
        assert judge([picture], scene, studio.box, perceive=False, naming=False).verdict.word == word
