"""Reading the card: each fault by its name and number, two at once, and a renderer's own bug by none."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy import ndimage

from notabug.adapters.base import Declaration
from notabug.metrics.calibration import read_card
from notabug.metrics.causes import encoded, zoomed
from notabug.metrics.judge import judge
from notabug.references.predict import predict
from notabug.references.tracer.envelope import Envelope
from notabug.scenes_usd.reader import read_scene

Floats = npt.NDArray[np.float64]
BOX = Declaration("float32", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=False)


CARD, PLAIN = "calibration/card", "calibration/plain_card"


@pytest.fixture(scope="module")
def cards() -> dict[str, Envelope]:
    return {name: predict(read_scene(name)) for name in (CARD, PLAIN)}


@pytest.fixture
def card(cards: dict[str, Envelope], request: Any) -> Envelope:
    return cards[getattr(request, "param", CARD)]


def shifted(a: Floats) -> Floats:
    return np.asarray(ndimage.shift(a, (0.5, 0.5, 0), order=1, mode="nearest"))


FAULTS: dict[str, tuple[Callable[[Floats], Floats], tuple[str, ...], str]] = {
    "right": (lambda a: a, (), ""),
    "flipped": (lambda a: a[::-1], ("upside_down",), "top row first"),
    "mirrored": (lambda a: a[:, ::-1], ("mirrored",), "x axis"),
    "rotated": (lambda a: a[::-1, ::-1], ("rotated",), "180 degrees"),
    "bgr": (lambda a: a[..., ::-1], ("channels_swapped",), "bgr"),
    "no 1/pi": (lambda a: a * math.pi, ("light_gain",), "3.1416 .* a 1/pi is missing"),
    "half": (lambda a: a * 0.5, ("light_gain",), "0.5000 times as bright"),
    "clipped": (lambda a: np.clip(2 * a, 0, 1), ("light_gain",), "2.0000 times"),
    "srgb": (encoded, ("srgb_encoded",), 'encoding = "srgb"'),
    "gamma": (lambda a: np.clip(a, 0, 1) ** (1 / 2.2), ("gamma",), "power 0.455, 1/2.2: encoded"),
    "gamma twice": (lambda a: np.clip(a, 0, 1) ** (1 / 4.84), ("gamma",), "power 0.207, that of 1/2.2 twice"),
    "decoded": (lambda a: np.clip(a, 0, 1) ** 2.2, ("gamma",), "power 2.200, 2.2: decoded once too often"),
    "odd power": (lambda a: np.clip(a, 0, 1) ** 1.3, ("gamma",), "power 1.300: write linear"),
    "shift": (shifted, ("pixel_shift",), r"\(\+0.50, \+0.50\)"),
    "wide": (lambda a: zoomed(a, 0.95), ("field_of_view",), "0.9498|0.95"),
    "narrow": (lambda a: zoomed(a, 1.2), ("field_of_view",), "1.20|1.1999"),
    "blurred": (lambda a: np.asarray(ndimage.gaussian_filter(a, (1, 1, 0))), ("filter_undeclared",), "1.04 pixels"),
    "flipped, sRGB": (lambda a: encoded(a)[::-1], ("upside_down", "srgb_encoded"), "top row first.*sRGB"),
    "narrow, no 1/pi": (lambda a: zoomed(a, 1.2) * math.pi, ("field_of_view", "light_gain"), "1/pi"),
    "black": (lambda a: 0 * a, ("black",), "black"),
}


@pytest.mark.parametrize(
    ("fault", "card"),
    [*((each, CARD) for each in FAULTS), *((each, PLAIN) for each in ("right", "flipped", "clipped", "srgb"))],
    indirect=["card"],
)
@pytest.mark.sweep_except(
    "mirrored-calibration/card",
    "rotated-calibration/card",
    "bgr-calibration/card",
    "no 1/pi-calibration/card",
    "half-calibration/card",
    "gamma-calibration/card",
    "shift-calibration/card",
    "wide-calibration/card",
    "narrow-calibration/card",
    "blurred-calibration/card",
    "flipped, sRGB-calibration/card",
    "narrow, no 1/pi-calibration/card",
    "black-calibration/card",
    "right-calibration/plain_card",
    "flipped-calibration/plain_card",
    "clipped-calibration/plain_card",
    "srgb-calibration/plain_card",
)
def test_each_fault_is_read_by_its_name(fault: str, card: Envelope) -> None:
    change, causes, says = FAULTS[fault]
    reading = read_card([change(np.asarray(card.mean, np.float64))], card, BOX)
    assert reading.causes == causes
    assert re.search(says, reading.sentence)


@pytest.mark.parametrize("card", [CARD, PLAIN], indirect=True)
@pytest.mark.parametrize(
    "bug",
    [
        lambda a: np.where(a > 0.5, 0.8 * a, a),
        lambda a: np.where(np.arange(256)[:, None, None] < 128, 0.7 * a, a),
        lambda a: a + 0.3 * np.indices(a.shape)[0] / 256,
        lambda a: a * (np.random.default_rng(0).random(a.shape[:2]) > 0.3)[..., None],
        lambda a: a * (np.random.default_rng(0).random(a.shape[:2]) > 0.7)[..., None],
    ],
    ids=["albedo", "half lit", "gradient", "some dots", "many dots"],
)
@pytest.mark.sweep_except(
    "albedo-calibration/plain_card",
    "half lit-calibration/plain_card",
    "gradient-calibration/plain_card",
    "some dots-calibration/plain_card",
    "many dots-calibration/card",
)
def test_a_renderers_own_bug_is_no_fault_of_the_adapter(bug: Callable[[Floats], Floats], card: Envelope) -> None:
    assert read_card([bug(np.asarray(card.mean, np.float64))], card, BOX).causes == ()


def test_noise_and_the_lack_of_it_are_read(card: Envelope) -> None:
    random = np.random.default_rng(0)
    value = np.asarray(card.mean, np.float64)
    seeds = [value * (1 + 0.05 * random.normal(size=value.shape)).clip(0) for _ in range(4)]
    assert read_card(seeds, card, BOX).noise == pytest.approx(0.05, rel=0.2)
    assert read_card([value], card, BOX, repeats=True).causes == ()
    assert read_card([value], card, BOX, repeats=False).causes == ("noise_undeclared",)


@pytest.mark.parametrize("card", [CARD, PLAIN], indirect=True)
@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda a: a.swapaxes(0, 1), "axes_exchanged"),
        (lambda a: np.rot90(a), "axes_exchanged"),
        (lambda a: np.random.default_rng(0).random(a.shape), "not_the_card"),
        (lambda a: np.full_like(a, 0.25), "one_colour"),
    ],
    ids=["transposed", "turned", "noise", "one colour"],
)
def test_what_is_not_the_card_has_a_cause(change: Callable[[Floats], Floats], cause: str, card: Envelope) -> None:
    reading = read_card([change(np.asarray(card.mean, np.float64))], card, BOX)
    assert reading.causes == (cause,)
    assert reading.sentence


@pytest.mark.parametrize("card", [CARD, PLAIN], indirect=True)
@pytest.mark.parametrize("width", [0.5, 0.8, 1.5])
@pytest.mark.sweep_except("0.5-calibration/card", "0.8-calibration/card", "1.5-calibration/plain_card")
def test_a_blur_is_read_by_its_width(width: float, card: Envelope) -> None:
    reading = read_card([ndimage.gaussian_filter(np.asarray(card.mean, np.float64), (width, width, 0))], card, BOX)
    assert reading.causes == ("filter_undeclared",)
    assert reading.width == pytest.approx(math.hypot(12**-0.5, width), abs=0.1)


def test_a_picture_of_another_size_is_named(card: Envelope) -> None:
    assert read_card([np.zeros((4, 4, 3))], card, BOX).causes == ("wrong_size",)


@pytest.mark.parametrize("card", [CARD, PLAIN], indirect=True)
@pytest.mark.parametrize("said", ["box", "tent", "gaussian"])
@pytest.mark.sweep_except("box-calibration/card", "tent-calibration/plain_card")
def test_points_under_another_filter_are_told_as_such(said: Any, card: Envelope) -> None:
    """Who draws one ray through each pixel's centre and declares a filter is told so, and not of a missing shadow."""
    points = [np.asarray(card.point, np.float64)]
    reading = read_card(points, card, replace(BOX, filter=said, radius=1.0))
    assert reading.causes == ("filter_undeclared",)
    assert f'filter = "{said}" is declared' in reading.sentence
    assert 'declare filter = "point"' in reading.sentence
    assert read_card(points, card, replace(BOX, filter="point", radius=0.0)).causes == ()
    assert read_card([np.asarray(card.mean, np.float64)], card, BOX).causes == ()


@pytest.mark.parametrize("said", ["point", "box", "tent"])
def test_a_blur_names_the_declaration_and_what_is_wider(said: Any, card: Envelope) -> None:
    mean = np.asarray(card.point if said == "point" else card.mean, np.float64)
    reading = read_card([ndimage.gaussian_filter(mean, (1, 1, 0))], card, replace(BOX, filter=said))
    assert reading.causes == ("filter_undeclared",)
    assert f'filter = "{said}" is declared' in reading.sentence
    assert '"gaussian"' in reading.sentence.split("declare the filter that the renderer has")[1]


def test_edges_alone_that_are_wrong_have_a_verdict() -> None:
    """All that is wrong lies on edges, which misfits leave out: the least misfit is 0, and has no logarithm."""
    scene = read_scene(PLAIN)
    picture = np.asarray(predict(scene).point, np.float64)
    found = judge([picture], scene, replace(BOX, filter="tent", radius=1.0), perceive=False)
    assert found.verdict.word == "bug"
