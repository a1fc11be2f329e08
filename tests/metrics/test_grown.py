"""What a renderer does all at once: more limitations than are searched, segments shorter than a tolerance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Declaration
from notabug.bench.generality.draw import write_random_scene
from notabug.bench.generality.jobs import sized
from notabug.metrics.admissible import Admissible
from notabug.metrics.explain import fit
from notabug.metrics.judge import judge
from notabug.metrics.noise import measure
from notabug.metrics.sets import admitted, habits
from notabug.references.models.model import Model, models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 48
ALL = ("silhouette_flip", "quad_split_02", "facet_self_reflection", "facet_self_shadow")
USUAL = Declaration(
    "float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False, ngon_split="02", silhouette="flip"
)
UNKNOWN = replace(USUAL, ngon_split="unknown", silhouette="unknown")
SCENES = ((1, 5), (1, 49))  # smooth mirrors beside quads that bend: seed and number


@pytest.fixture(scope="module", params=SCENES, ids=str)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    seed, number = request.param
    return sized(read_scene(write_random_scene(seed, number, tmp_path_factory.mktemp("grown"))), SIDE)


def with_all(scene: Scene) -> Any:
    """``scene`` as a renderer draws it that has each of ``ALL``."""
    known = {each.name: each for each in reversed(list(models(scene)))}
    changed, options = configured(scene, [known[name] for name in ALL])
    return trace_picture(changed, options, threads=1)


@pytest.mark.parametrize("declaration", [USUAL, UNKNOWN], ids=["declared", "undeclared"])
@pytest.mark.sweep_except("(1, 5)-undeclared", "(1, 49)-undeclared")
def test_four_limitations_at_once_are_no_bug(scene: Scene, declaration: Declaration) -> None:
    verdict = judge([with_all(scene)], scene, declaration, perceive=False).verdict
    assert verdict.word == "limitation", verdict.message
    assert {each.name for each in verdict.findings} >= {"facet_self_reflection", "facet_self_shadow"}


def test_what_is_wrong_beside_four_limitations_is_a_bug(scene: Scene) -> None:
    picture = with_all(scene)
    y, x = np.argwhere(picture.max(axis=2) > 0.2)[40]
    picture[y - 2 : y + 2, x - 2 : x + 2] *= 0.7
    assert judge([picture], scene, USUAL, perceive=False, naming=False).verdict.word == "bug"


def test_declared_choices_are_habits_and_free_ones_are_not(scene: Scene) -> None:
    def named(declaration: Declaration) -> set[str]:
        return {each.name for each in habits(admitted(list(models(scene)), declaration))}

    assert {"silhouette_flip", "quad_split_02"} <= named(USUAL)
    assert named(UNKNOWN).isdisjoint({"quad_split_02", "quad_split_13", "facet_self_shadow"})


VALUE, TAU = 0.4, 0.002


def flat(value: Any) -> Admissible:
    shape = np.broadcast_to(np.asarray(value, float), (8, 8))
    picture = np.repeat(shape[..., None], 3, axis=2).copy()
    none = np.zeros((8, 8), np.bool_)
    return Admissible(picture, picture, picture, np.full((8, 8, 3), TAU), none, np.ones((8, 8)), share_is_point=True)


@pytest.mark.parametrize("step", [0.3, 0.9, 0.99, 1.5])
def test_a_partial_limitation_excuses_what_it_moves_by_less_than_the_tolerance(step: float) -> None:
    """A picture may be off by the limitation's own step and, beside it, by the tolerance; no further."""
    shadow = Model("shadow", "limitation", "", "", rule="partial")
    limited = np.full((8, 8), VALUE)
    limited[0, 0] -= 20 * TAU  # where it shows
    limited[4, 4] -= step * TAU
    known = {(): flat(VALUE), (shadow,): flat(limited)}

    def triggers(beyond: float) -> tuple[str, ...]:
        picture = limited.copy()
        picture[4, 4] -= beyond * TAU
        measured = measure([np.repeat(picture[..., None], 3, axis=2)], np.zeros((8, 8), np.bool_))
        return fit(measured, (shadow,), lambda models: known[models]).triggers

    assert triggers(0.2) == triggers(0.9) == ()
    assert triggers(1.1) == ("pixels",)
