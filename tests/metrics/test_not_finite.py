"""NaN, infinity, and what is as good as that: none of them wins or hides a comparison of the judge."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import admissible, reckonable
from notabug.metrics.image_checks import finite, invalid
from notabug.metrics.judge import judge
from notabug.metrics.noise import measure
from notabug.metrics.policy import POLICY
from notabug.metrics.verdict import Verdict
from notabug.references.models.model import Model
from notabug.references.predict import Near
from notabug.references.tracer.envelope import Envelope
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Camera, Card, Scene

LARGEST = POLICY.image_checks.largest

Floats = npt.NDArray[np.floating]

SIZE = 32
POINT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False)
BOX = replace(POINT, filter="box", radius=0.5, samples=16)
CAMERA = Camera("/Camera", np.eye(4), 1.0, 1.0, 0.1, 10.0)
SCENE = Scene("made/up", Path("up.usda"), {}, Card("calibration", ""), CAMERA, SIZE, SIZE, (), (), ())
BAD = {"NaN": np.nan, "inf": np.inf, "-inf": -np.inf, "1e30": 1e30, "2e15": 2e15}


def _envelope(picture: Floats) -> Envelope:
    none = np.zeros((SIZE, SIZE))
    return Envelope(
        picture,
        picture,
        np.zeros_like(picture),
        picture,
        picture,
        none.astype(np.int64),
        none > 0,
        none,
        none,
        none > 0,
        np.zeros_like(picture),
    )


def _flat(value: float = 0.5) -> Floats:
    return np.full((SIZE, SIZE, 3), value)


def _with(value: float, at: Any = (7, 9)) -> Floats:
    picture = _flat()
    picture[at] = value
    return picture


def _judge(pictures: list[Floats], predictions: dict[str, Floats], kind: Any, rule: Any, declaration: Any) -> Verdict:
    """The verdict where the one model predicts ``predictions["model"]`` and nothing else but the reference is known."""
    model = Model("the_model", kind, "a claim", "nowhere", rule=rule, options={"epsilon": 1.0})

    def predicted(_: Scene, chosen: tuple[Model, ...] = ()) -> Envelope:
        return _envelope(predictions["model" if chosen else "reference"])

    with (
        mock.patch("notabug.metrics.judge.models", return_value=[model]),
        mock.patch("notabug.metrics.expected.predict", side_effect=predicted),
        mock.patch("notabug.metrics.predictions.predict_near", lambda _, chosen, *__: Near(predicted(_, chosen), "")),
        mock.patch("notabug.metrics.predictions.preview", lambda _, chosen=(): predicted(_, chosen).point),
        mock.patch(
            "notabug.metrics.predictions.preview_at",
            lambda _, chosen, at: predicted(_, chosen).point.reshape(-1, 3)[at],
        ),
    ):
        return judge(pictures, SCENE, declaration, perceive=False).verdict


@pytest.mark.parametrize("declaration", [POINT, BOX], ids=["point", "box"])
@pytest.mark.parametrize("bad", BAD)
def test_a_reference_that_is_not_finite_is_an_error_and_no_verdict(bad: str, declaration: Declaration) -> None:
    for picture in (_flat(), _flat(0.0), np.random.default_rng(1).random((SIZE, SIZE, 3))):
        with pytest.raises(NotabugError, match=r"pixel \(9, 7\): the reference is not finite in 1 pixels") as error:
            _judge([picture], {"reference": _with(BAD[bad]), "model": _flat()}, "fault", "choice", declaration)
        assert error.value.do


@pytest.mark.parametrize("rule", ["choice", "partial", "set", "any"])
@pytest.mark.parametrize("kind", ["fault", "limitation"])
@pytest.mark.parametrize("bad", BAD)
def test_a_prediction_that_is_not_finite_explains_nothing(bad: str, kind: str, rule: str) -> None:
    """One value of it once made every tolerance infinite, and any picture fit."""
    wrong = _flat()
    wrong[10:20, 10:20] = 0.1
    for declaration in (POINT, BOX):
        predictions = {"reference": _flat(), "model": _with(BAD[bad])}
        verdict = _judge([wrong], predictions, kind, rule, declaration)
        assert (verdict.word, verdict.findings[0].name) == ("bug", "unexplained")
        assert _judge([_flat()], predictions, kind, rule, declaration).word == "pass"


@pytest.mark.parametrize("peak", [10.0, 1e4, 1e12])
def test_a_bright_pixel_of_a_hypothesis_does_not_widen_its_tolerance(peak: float) -> None:
    """The part of the tolerance that is relative to the brightest value is relative to the reference's."""
    model = _with(peak)
    wrong = np.where(np.arange(SIZE)[:, None, None] < 9, 0.45, _flat())
    verdict = _judge([wrong], {"reference": _flat(), "model": model}, "limitation", "choice", POINT)
    assert verdict.word == "bug"
    assert admissible(_envelope(model), POINT, peak=0.5).tau[0, 0, 0] == pytest.approx(
        0.004 * 0.5 + 5e-4 * 0.5, rel=1e-4
    )


@pytest.mark.parametrize("bad", BAD)
def test_such_a_picture_is_a_bug_by_itself(bad: str) -> None:
    predictions = {"reference": _flat(), "model": _flat()}
    for pictures in ([_with(BAD[bad])], [_flat(), _with(BAD[bad]), _flat()]):
        verdict = _judge(pictures, predictions, "fault", "choice", POINT)
        assert (verdict.word, verdict.findings[0].name) == ("bug", "non_finite")
        assert "(9, 7)" in verdict.message


def test_what_can_be_reckoned_with() -> None:
    assert finite(np.array([0.0, -1.0, LARGEST])).all()
    assert not finite(np.array([np.nan, np.inf, -np.inf, 1.1 * LARGEST, -1.1 * LARGEST])).any()
    assert reckonable(_envelope(_flat()))
    assert invalid([_with(LARGEST)], SIZE, SIZE) is None
    with np.errstate(all="raise"):  # the largest values allowed can be squared, summed and compared
        found = measure([_with(LARGEST), _flat(), _flat()], np.zeros((SIZE, SIZE), np.bool_))
    assert all(np.isfinite(each).all() for each in (found.mean, found.variance, found.kappa, found.freedom))


@pytest.mark.parametrize("brightness", [1e3, 1e6, 1e12])
def test_a_firefly_hides_nothing_elsewhere_in_its_row(brightness: float) -> None:
    """Sums that run along a row once carried its rounding, and with it a variance, to the row's end."""
    rng = np.random.default_rng(4)
    pictures = [np.abs(_flat() + 0.01 * rng.standard_normal((SIZE, SIZE, 3))) for _ in range(4)]
    plain = measure(pictures, np.zeros((SIZE, SIZE), np.bool_))
    pictures[1][16, 4] = brightness
    found = measure(pictures, np.zeros((SIZE, SIZE), np.bool_))
    assert found.variance[:, 8:] == pytest.approx(plain.variance[:, 8:], rel=1e-4)
    assert found.variance[16, 4].min() > brightness
