"""What no set of limitations reaches is told by quick pictures; what a set explains never is."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from notabug.bench.generality.draw import write_random_scene
from notabug.bench.generality.examine import unknown_making
from notabug.bench.generality.jobs import sized
from notabug.metrics.admissible import admissible
from notabug.metrics.explain import fit
from notabug.metrics.noise import measure
from notabug.metrics.predictions import Predictions
from notabug.metrics.reach import Reach, reach
from notabug.metrics.sets import admitted, habits
from notabug.references.models.model import Model, excluded_by, models
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 32  # pixels
SCENES = ((0, 303), (0, 416), (1, 5))  # textures; a highlight that corners spread; smooth mirrors
PAIRS = 5  # of the limitations of each scene, spread over all
MANY_PAIRS = 20


@pytest.fixture(scope="module", params=SCENES, ids=str)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    seed, number = request.param
    return sized(read_scene(write_random_scene(seed, number, tmp_path_factory.mktemp("reach"))), SIDE)


def beyond(scene: Scene, picture: np.ndarray, *, fully: bool = False) -> bool:
    """Whether all limitations together are said not to reach ``picture``, of unknown making."""
    told, _, _ = reached(scene, open_to(scene), picture, fully=fully)
    return told is not None and told.beyond_all()


def reached(
    scene: Scene, some: tuple[Model, ...], picture: np.ndarray, *, fully: bool
) -> tuple[Reach | None, Predictions, float]:
    """How far all limitations reach ``picture``, what they predict, and how far it is off."""
    declaration = unknown_making()
    bare = predict(scene)
    reference = admissible(bare, declaration)
    measured = measure([picture], reference.edge)
    predicted = Predictions(scene, bare, reference, declaration, 0.004, None)
    found = fit(measured, (), predicted).significance
    told = reach(measured, found, some, habits(some), predicted, predicted.preview, fully=fully)
    return told, predicted, found.excess


def open_to(scene: Scene) -> tuple[Model, ...]:
    return admitted(list(models(scene)), unknown_making())


def drawn(scene: Scene, chosen: tuple[Model, ...]) -> np.ndarray:
    return trace_picture(*configured(scene, chosen), threads=1)


@pytest.mark.parametrize("count", [PAIRS, pytest.param(MANY_PAIRS, marks=pytest.mark.sweep)])
def test_what_two_limitations_make_is_within_reach(scene: Scene, count: int) -> None:
    some = open_to(scene)
    pairs = [pair for pair in combinations(some, 2) if not excluded_by(pair[0], pair[1:])]
    for pair in pairs[:: max(1, len(pairs) // count)]:
        picture = drawn(scene, pair)
        for fully in (False, True):
            assert not beyond(scene, picture, fully=fully), [model.name for model in pair]
        told, predicted, excess = reached(scene, some, picture, fully=True)
        assert told is None or told.leaves(pair, predicted.preview) < 0.1 * excess, [model.name for model in pair]


def test_what_all_habits_make_is_within_reach(scene: Scene) -> None:
    assert not beyond(scene, drawn(scene, habits(open_to(scene))))


@pytest.mark.sweep_except("(0, 303)", "(1, 5)")
def test_noise_and_a_picture_that_is_far_too_bright_are_not(scene: Scene) -> None:
    right = drawn(scene, ())
    noise = np.random.default_rng(1).uniform(0.0, 2.0 * right.mean(), right.shape)
    for picture in (noise, 40.0 * right + 10.0):
        assert beyond(scene, picture)
        assert beyond(scene, picture, fully=True)


def test_few_bright_pixels_at_an_edge_are_out_of_reach_only_by_what_models_admit(scene: Scene) -> None:
    picture = drawn(scene, ())
    edge = np.argwhere(predict(scene).edge)[:6]
    picture[tuple(edge.T)] = 30.0 * picture.max()
    assert not beyond(scene, picture)
    assert beyond(scene, picture, fully=True)
