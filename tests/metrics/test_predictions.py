"""What a judge keeps of what it has predicted is bounded, and its quick pictures agree with each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import admissible
from notabug.metrics.predictions import Predictions, _Recent
from notabug.references.models.model import Model, models
from notabug.references.predict import predict, preview
from notabug.references.tracer.precision import RELATIVE
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 48
BOX = Declaration(
    precision="float64", filter="box", radius=0.5, quantum=2.0**-24, relative_quantum=True, noisy=False, samples=64
)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return replace(read_scene("terminator/sphere"), width=SIDE, height=SIDE)


@pytest.fixture(scope="module")
def predictions(scene: Scene) -> Predictions:
    bare = predict(scene)
    return Predictions(scene, bare, admissible(bare, BOX), BOX, RELATIVE, None)


def _model(scene: Scene, name: str) -> Model:
    return next(each for each in models(scene) if each.name == name)


@pytest.mark.parametrize("names", [("facet_self_shadow",), ("albedo",), ("albedo", "facet_self_shadow")])
def test_a_set_admits_what_its_whole_envelope_admits(
    scene: Scene, predictions: Predictions, names: tuple[str, ...]
) -> None:
    chosen = tuple(_model(scene, name) for name in names)
    peak = float(predictions(()).value.max())
    whole = admissible(predict(scene, chosen), BOX, peak=peak)
    for found in (predictions(chosen), predictions.closely(np.ones((SIDE, SIDE), np.bool_))(chosen)):
        for part in ("value", "lo", "hi", "tau", "edge"):
            np.testing.assert_array_equal(getattr(found, part), getattr(whole, part), err_msg=part)


def test_some_pixels_of_a_quick_picture_are_those_of_all(scene: Scene, predictions: Predictions) -> None:
    chosen = (_model(scene, "flat_normals"),)
    at = np.arange(7, SIDE * SIDE, 11)
    some = predictions.preview(chosen, at)
    assert (preview(scene, chosen) != preview(scene)).any()
    np.testing.assert_array_equal(some, preview(scene, chosen).reshape(-1, 3)[at])
    np.testing.assert_array_equal(predictions.preview(chosen).reshape(-1, 3)[at], some)


def test_what_is_kept_is_bounded_and_the_oldest_goes() -> None:
    kept: _Recent[np.ndarray] = _Recent(3000)
    made = []

    def get(number: int) -> None:
        def make() -> np.ndarray:
            made.append(number)
            return np.zeros(125)

        kept.get(((str(number),),), make)

    for number in (1, 2, 3, 1, 4, 1, 2):
        get(number)
    assert made == [1, 2, 3, 4, 2]
    assert sum(each.nbytes for _, each in kept.newest()) <= 3000
