"""One picture alone: inconclusive where random samples of the scene could have made it, and only there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Declaration
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.references.predict import Near, predict
from notabug.references.tracer.envelope import Envelope, trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.scene import Camera, Card, Emitter, Light, Scene

Floats = npt.NDArray[np.floating]

SIZE = 48
BOX = Declaration("float64", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=True)
STATES = {"declared noisy": True, "unknown": None, "declared deterministic": False}


def _scene(lights: int = 1) -> Scene:
    """A scene without objects: no model of a limitation or a fault acts on it."""
    camera = Camera("/Camera", np.eye(4), 1.0, 1.0, 0.1, 10.0)
    sun = Light("/Sun", "distant", (1.0, 1.0, 1.0))
    return Scene("made/up", Path("up.usda"), {}, Card("calibration", ""), camera, SIZE, SIZE, (), (sun,) * lights, ())


def _envelope(width: float, value: float = 0.5) -> Envelope:
    """Pixels that each show values evenly spread over ``width`` times their mean to either side: a fine texture."""
    mean = np.full((SIZE, SIZE, 3), value)
    none = np.zeros((SIZE, SIZE))
    lo, hi, variance = mean * (1.0 - width), mean * (1.0 + width), (mean * width) ** 2 / 3.0
    return Envelope(mean, mean, variance, lo, hi, none.astype(np.int64), none > 0, none, none, none > 0, 0.0 * mean)


def _judge(picture: Floats, envelope: Envelope, declaration: Declaration, scene: Scene | None = None) -> Verdict:
    with (
        mock.patch("notabug.metrics.expected.predict", return_value=envelope),
        mock.patch("notabug.metrics.predictions.predict_near", return_value=Near(envelope, "")),
        mock.patch("notabug.metrics.predictions.preview", return_value=envelope.point),
        mock.patch("notabug.metrics.predictions.preview_at", lambda _, chosen, at: envelope.point.reshape(-1, 3)[at]),
    ):
        return judge([picture], scene or _scene(), declaration, perceive=False, naming=False).verdict


def _samples(envelope: Envelope, seed: int, count: int = 1) -> Floats:
    """The mean of ``count`` random samples in each pixel, all channels alike."""
    drawn = np.random.default_rng(seed).random((count, SIZE, SIZE, 1)).mean(axis=0)
    return envelope.lo + (envelope.hi - envelope.lo) * drawn


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("width", [0.3, 0.6, 0.95])
@pytest.mark.parametrize("state", STATES)
def test_noise_that_samples_make_is_inconclusive_unless_declared_away(state: str, width: float, seed: int) -> None:
    envelope = _envelope(width)
    verdict = _judge(_samples(envelope, seed), envelope, replace(BOX, noisy=STATES[state]))
    assert verdict.word == ("bug" if STATES[state] is False else "inconclusive")
    if STATES[state] is not False:
        assert "two" in verdict.message
        assert "seeds" in verdict.message
        assert not verdict.findings


IMPOSSIBLE = {
    "beyond what a sample can be": lambda e, rng: e.mean * rng.uniform(0.0, 2.0, (SIZE, SIZE, 1)),
    "a gain of a tenth, in noise": lambda e, rng: 1.1 * _samples(e, int(rng.integers(99))),
    "a dark quarter, in noise": lambda e, rng: np.where(
        (np.arange(SIZE) < SIZE // 2)[:, None, None] & (np.arange(SIZE) < SIZE // 2)[None, :, None],
        e.lo,
        _samples(e, int(rng.integers(99))),
    ),
    "one value or the other, where they are rarer": lambda e, rng: np.where(
        rng.random((SIZE, SIZE, 1)) < 0.5, e.lo, e.hi
    ),
    "black": lambda e, rng: np.zeros_like(e.mean),
}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_what_no_noise_could_make_is_a_bug(name: str, state: str) -> None:
    envelope = _envelope(0.3)
    picture = IMPOSSIBLE[name](envelope, np.random.default_rng(7))
    assert _judge(picture, envelope, replace(BOX, noisy=STATES[state])).word == "bug"


def test_more_samples_make_less_noise() -> None:
    """The noise of one sample a pixel is none of sixteen."""
    envelope = _envelope(0.5)
    one, many = _samples(envelope, 1), _samples(envelope, 1, 16)
    assert _judge(one, envelope, replace(BOX, samples=16)).word == "bug"
    assert _judge(one, envelope, replace(BOX, samples=1)).word == "inconclusive"
    assert _judge(many, envelope, replace(BOX, samples=16)).word in ("pass", "inconclusive")


def test_of_several_lights_one_may_be_drawn_at_random() -> None:
    """A sample may then be twice as bright, or show nothing; a whole black picture is still no noise."""
    envelope = _envelope(0.0)
    picture = 2.0 * envelope.mean * (np.random.default_rng(3).random((SIZE, SIZE, 1)) < 0.5)
    assert _judge(picture, envelope, BOX, _scene(lights=1)).word == "bug"
    assert _judge(picture, envelope, BOX, _scene(lights=2)).word == "inconclusive"
    assert _judge(np.zeros_like(picture), envelope, BOX, _scene(lights=2)).word == "bug"


# --- on real scenes --------------------------------------------------------------------------------------------------

TEXTURED = ("texture/uneven_quad", "texture/perspective_floor", "terminator/sphere")


def _small(studio: Any, name: str) -> Scene:
    return replace(studio.scene(name), width=64, height=64)


@pytest.mark.parametrize("name", TEXTURED)
def test_one_random_sample_a_pixel_is_inconclusive_or_passes(studio: Any, name: str) -> None:
    scene = _small(studio, name)
    rng_picture = trace_picture(scene.as_intended(), Options(), samples=2, seed=5)
    declaration = replace(BOX, noisy=True, samples=2, silhouette="keep")
    verdict = studio.verdict([rng_picture], scene, declaration)
    assert verdict.word in ("inconclusive", "pass", "limitation"), (verdict.word, verdict.message)


def _nearest(scene: Scene) -> Scene:
    """The scene with every texel repeated eight times: a bilinear texture is then all but a nearest one."""
    wide = [np.repeat(np.repeat(each.pixels, 8, axis=0), 8, axis=1) for each in scene.textures]
    return replace(scene, textures=tuple(replace(each, pixels=w) for each, w in zip(scene.textures, wide, strict=True)))


@pytest.mark.parametrize(("filter_name", "noisy"), [("point", False), ("point", None), ("unknown", False)])
@pytest.mark.parametrize("name", ["texture/uneven_quad", "texture/perspective_floor"])
def test_a_nearest_texture_is_no_noise(studio: Any, name: str, filter_name: Any, noisy: bool | None) -> None:
    """By a renderer that declares bilinear textures: many pixels, off by up to 200 tolerances."""
    scene = _small(studio, name)
    picture = predict(_nearest(scene)).point
    declaration = replace(BOX, filter=filter_name, radius=2.0 if filter_name == "unknown" else 0.0, noisy=noisy)
    declaration = replace(declaration, ngon_split="", texture_filter="bilinear")
    verdict = studio.verdict([picture], scene, declaration, naming=False)
    print(f"\n{name} {filter_name}: {verdict.word} {verdict.numbers['bug_pixels']:.0f} pixels")
    assert verdict.word == "bug"


# --- naming never changes the word -----------------------------------------------------------------------------------

PICTURES = {
    "right": lambda e, rng: e.point,
    "dark specks": lambda e, rng: e.point * (rng.random((*e.ids.shape, 1)) > 0.1),
    "noise of a fifth": lambda e, rng: e.point * rng.uniform(0.8, 1.2, (*e.ids.shape, 1)),
    "a gain of a tenth": lambda e, rng: 1.1 * e.point,
    "upside down": lambda e, rng: e.point[::-1],
    "black": lambda e, rng: np.zeros_like(e.point),
}


@pytest.mark.parametrize("noisy", STATES)
@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.sweep_except(
    "right-unknown",
    "dark specks-unknown",
    "noise of a fifth-declared deterministic",
    "a gain of a tenth-declared deterministic",
    "upside down-declared deterministic",
    "black-declared noisy",
)
def test_what_a_bug_is_called_has_no_say_in_the_word(studio: Any, name: str, noisy: str) -> None:
    scene = replace(studio.scene("acne/sphere"), width=48, height=48)
    picture = PICTURES[name](predict(scene), np.random.default_rng(2))
    for declaration in (replace(BOX, filter="unknown", radius=2.0), replace(BOX, filter="point", radius=0.0)):
        declaration = replace(declaration, noisy=STATES[noisy])
        words = {studio.verdict([picture], scene, declaration, naming=each).word for each in (True, False)}
        assert len(words) == 1


def _lamp() -> Scene:
    """A scene with a light that has a size: a renderer's directions to it may carry any part of its light."""
    scene = _scene()
    lamp = replace(scene.lights[0], kind="sphere", emitter=Emitter())
    return replace(scene, lights=(lamp,))


def _fireflies(envelope: Envelope, seed: int) -> Floats:
    drawn = np.random.default_rng(seed).gamma(0.02, 50.0, (SIZE, SIZE, 1))
    return envelope.mean * drawn


@pytest.mark.parametrize("seed", range(4))
def test_fireflies_of_a_light_with_a_size_are_inconclusive(seed: int) -> None:
    envelope = _envelope(0.0)
    verdict = _judge(_fireflies(envelope, seed), envelope, BOX, _lamp())
    assert verdict.word == "inconclusive", verdict.message


@pytest.mark.parametrize("factor", [0.0, 0.5, 0.8, 1.3])
@pytest.mark.parametrize("scatter", [0.0, 0.1])
def test_what_does_not_scatter_as_it_is_off_is_a_bug_under_a_light_with_a_size(factor: float, scatter: float) -> None:
    envelope = _envelope(0.0)
    noise = np.random.default_rng(1).normal(1.0, scatter, (SIZE, SIZE, 1))
    assert _judge(factor * envelope.mean * noise, envelope, BOX, _lamp()).word == "bug"
