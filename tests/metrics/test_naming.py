"""Names of faults: at strengths of their own, local ones, and limitations beside them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.admissible import Admissible, admissible
from notabug.metrics.explain import fit
from notabug.metrics.judge import judge
from notabug.metrics.naming import coarse
from notabug.metrics.noise import measure
from notabug.metrics.verdict import Verdict
from notabug.references.models.model import Model, models
from notabug.references.predict import configured, predict
from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.scene import Scene

DECLARATION = InHouse().declaration(Quality(samples=1))
BOX = replace(InHouse().declaration(Quality(samples=64)), noisy=False)


@pytest.fixture(scope="module")
def ball(studio: Any) -> Scene:
    return replace(studio.scene("terminator/sphere"), width=64, height=64)


def model(scene: Scene, name: str, strength: float | None = None, kind: str = "fault") -> Model:
    found = next(each for each in models(scene) if each.name == name and each.kind == kind)
    if strength is None:
        return found
    assert found.at is not None
    return found.at(strength)


def verdict(scene: Scene, *applied: Model) -> Verdict:
    return judge([trace_picture(*configured(scene, applied))], scene, DECLARATION, perceive=False).verdict


@pytest.mark.parametrize("strength", [0.7, 1.02, 1.5])
def test_an_albedo_is_named_with_its_strength(ball: Scene, strength: float) -> None:
    found = verdict(ball, model(ball, "albedo", strength))
    assert (found.word, found.findings[0].name) == ("bug", "albedo")
    assert f"{strength:.3g} times" in found.findings[0].message


@pytest.mark.parametrize("strength", [0.02, 0.2])
def test_a_moved_light_is_named(ball: Scene, strength: float) -> None:
    assert verdict(ball, model(ball, "light_moved", strength)).findings[0].name == "light_moved"


def test_without_naming_a_bug_stays_unexplained(ball: Scene) -> None:
    picture = trace_picture(*configured(ball, (model(ball, "albedo", 1.5),)))
    found = judge([picture], ball, DECLARATION, perceive=False, naming=False).verdict
    assert [each.name for each in found.findings if each.kind == "bug"] == ["unexplained"]


def test_a_limitation_beside_a_large_gain_is_not_lost(ball: Scene) -> None:
    found = verdict(ball, model(ball, "light_gain", 2.0), model(ball, "facet_self_shadow", kind="limitation"))
    assert [each.name for each in found.findings] == ["light_gain", "facet_self_shadow"]


def test_a_limitation_beside_a_fault_that_may_show_anything_has_its_share(studio: Any) -> None:
    """Its share is what a finding states: a picture with the wrong aspect was an internal error for want of it."""
    scene = replace(studio.scene("terminator/mirror_sphere"), width=64, height=64)
    facets, dots = model(scene, "facet_self_reflection", kind="limitation"), model(scene, "no_epsilon")

    def predicted(chosen: tuple[Model, ...]) -> Admissible:
        return admissible(predict(scene, chosen), DECLARATION)

    measured = measure([trace_picture(*configured(scene, (facets,)))], predicted(()).edge)
    assert dots.rule == "any"
    assert fit(measured, (facets,), predicted, (dots,)).alphas[facets.name].any()


def test_a_fault_of_some_faces_is_named(ball: Scene) -> None:
    """Normals that point inwards on every third face only."""
    flipped = model(ball, "normals_flipped")

    def some(scene: Scene) -> Scene:
        wrong = flipped.edit(scene)
        objects = []
        for right, other in zip(scene.objects, wrong.objects, strict=True):
            normals = getattr(right, "normals", None)
            if normals is None:
                objects.append(right)
                continue
            face = np.repeat(np.arange(len(right.counts)), right.counts)  # type: ignore[union-attr]
            mixed = np.where((face % 3 == 0)[:, None], other.normals, normals)  # type: ignore[union-attr]
            objects.append(replace(right, normals=np.ascontiguousarray(mixed)))
        return replace(scene, objects=tuple(objects))

    assert verdict(ball, replace(flipped, edit=some)).findings[0].name == "normals_flipped"


@pytest.mark.parametrize("declaration", [DECLARATION, BOX], ids=["point", "box"])
def test_scattered_wrong_pixels_have_no_name(studio: Any, ball: Scene, declaration: Declaration) -> None:
    """Half dark pixels are no dots of rays without an epsilon: those would be all over what is lit."""
    clean = studio.predicted(ball)
    picture = np.array(clean.point if declaration.filter == "point" else clean.mean)
    picture.reshape(-1, 3)[::97] *= 0.5
    found = judge([picture], ball, declaration, perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", "unexplained")


@pytest.mark.parametrize("strength", [0.75, 1.333])
def test_another_shape_of_picture_is_named(studio: Any, strength: float) -> None:
    scene = replace(studio.scene("terminator/mirror_sphere"), width=64, height=64)
    aspect = model(scene, "aspect", strength)
    found = judge([predict(scene, [aspect]).mean], scene, BOX, perceive=False).verdict
    assert found.findings[0].name == "aspect"


def test_another_light_is_no_dots(studio: Any) -> None:
    scene = replace(studio.scene("acne/sphere"), width=64, height=64)
    moved = model(scene, "light_moved", 0.3)
    found = judge([predict(scene, [moved]).mean], scene, BOX, perceive=False).verdict
    assert found.findings[0].name == "light_moved"


def test_a_clamped_highlight_is_no_fight_of_surfaces(studio: Any) -> None:
    """Between two colours and their shadows lies every darker one, but a fight takes more than a little of them."""
    scene = replace(studio.scene("visibility/coincident_spheres"), width=64, height=64)
    right = studio.predicted(scene).mean
    found = judge([np.minimum(right, 0.9 * np.percentile(right, 99))], scene, BOX, perceive=False).verdict
    assert (found.word, found.findings[0].name) == ("bug", "clamped")


def test_means_over_blocks() -> None:
    values = np.arange(32.0).reshape(4, 8, 1)
    assert coarse(values, 1) is values
    assert coarse(values, 4).ravel().tolist() == [values[:, :4].mean(), values[:, 4:].mean()]
    assert coarse(np.ones((7, 9, 3)), 4).shape == (1, 2, 3)
