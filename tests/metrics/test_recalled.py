"""why after a verdict: its worst pixel is a wrong one, and what it names fits there, at the strength that it fitted."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Quality
from notabug.adapters.inhouse import InHouse
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Finding, Verdict
from notabug.metrics.why import PixelExplanation, explain_pixel
from notabug.references.models.camera import pixel_shift
from notabug.references.models.light import brighter
from notabug.references.models.model import Model, models
from notabug.references.predict import configured
from notabug.references.tracer.envelope import trace_picture
from notabug.results.record import Result
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]
POINT = InHouse().declaration(Quality(samples=1))
SIDE = 48  # pixels


def small(studio: Any, scene_id: str, **variants: str) -> Scene:
    return replace(studio.scene(scene_id, **variants), width=SIDE, height=SIDE)


def fault(scene: Scene, name: str, strength: float) -> Model:
    found = next(each for each in models(scene) if each.name == name)
    assert found.at is not None
    return found.at(strength)


def asked(picture: Floats, scene: Scene) -> tuple[Verdict, PixelExplanation]:
    """The verdict on ``picture``, as a run's record keeps it, and what ``why`` says of its worst pixel."""
    found = judge([picture], scene, POINT, perceive=False).verdict
    plain = json.loads(json.dumps(Result("a", "", "b", "1", found).as_dict()))
    kept = Result.from_dict(plain)
    assert kept.verdict.findings == found.findings
    assert kept.worst is not None
    return kept.verdict, explain_pixel(picture, scene, POINT, *kept.worst, closest=24, verdict=kept.verdict)


def check(verdict: Verdict, why: PixelExplanation, name: str) -> None:
    assert (verdict.word, verdict.findings[0].name) == ("bug", name)
    first = why.ranked()[0]
    assert (first.name, first.told) == (name, True)
    off = np.abs(np.array(why.found) - first.value).max()
    assert first.fits or off < 0.1 * np.abs(np.array(why.found) - why.predictions[0].value).max()
    assert not why.predictions[0].fits
    text = why.as_text(5)
    assert f"\n1. {name}" in text
    assert "so says the verdict on the whole picture" in text.split("\n2. ")[0]
    assert "nothing is wrong" not in text


STRENGTHS = [
    ("terminator/sphere", "light_gain", 1.0 / np.pi),
    ("terminator/sphere", "albedo", 0.7),
    ("terminator/sphere", "light_moved", 0.2),
    ("terminator/sphere", "field_of_view", 1.1),
    ("phong/lobes", "exponent", 1.5),
    ("preview/roughness_33", "roughness", 1.2),
]


@pytest.mark.parametrize(("scene_id", "name", "strength"), STRENGTHS)
def test_a_fault_is_looked_at_at_its_own_strength(studio: Any, scene_id: str, name: str, strength: float) -> None:
    scene = small(studio, scene_id)
    picture = trace_picture(*configured(scene, (fault(scene, name, strength),)))
    verdict, why = asked(picture, scene)
    check(verdict, why, name)


def test_one_bright_light_is_no_gain_at_another_strength(studio: Any) -> None:
    """Of point lights alone: what the verdict fitted is shown, and not the same fault at the strength of an example."""
    scene = small(studio, "visibility/standing")
    dim = replace(scene, lights=tuple(brighter(light, 1.0 / np.pi) for light in scene.lights))
    verdict, why = asked(trace_picture(*configured(dim, ())), scene)
    check(verdict, why, "light_gain")
    assert "0.3183" in why.ranked()[0].claim
    assert sum(each.name == "light_gain" for each in why.predictions) == 1


WHOLE: dict[str, Callable[[Floats], Floats]] = {
    "upside_down": lambda picture: picture[::-1],
    "mirrored": lambda picture: picture[:, ::-1],
    "gamma": lambda picture: picture**0.6,
    "clamped": lambda picture: np.minimum(picture, 0.4 * picture.max()),
}


@pytest.mark.parametrize("name", WHOLE)
def test_a_cause_in_the_whole_picture_is_looked_at_too(studio: Any, name: str) -> None:
    scene = small(studio, "terminator/sphere")
    right = trace_picture(*configured(scene, ()))
    verdict, why = asked(WHOLE[name](right), scene)
    check(verdict, why, name)


@pytest.mark.parametrize("vector", [(0.5, 0.5), (-0.5, 0.0), (2.0, -1.0)])
def test_a_shifted_picture_is_asked_where_it_is_wrong(studio: Any, vector: tuple[float, float]) -> None:
    scene = small(studio, "terminator/sphere")
    picture = trace_picture(*configured(scene, (pixel_shift(SIDE, SIDE, *vector),)))
    verdict, why = asked(picture, scene)
    check(verdict, why, "pixel_shift")


def test_faces_that_are_missing_are_found_again(studio: Any) -> None:
    scene = small(studio, "terminator/sphere")
    gone = next(each for each in models(scene) if each.name == "face_missing")
    verdict, why = asked(trace_picture(*configured(scene, (gone,))), scene)
    check(verdict, why, "face_missing")


def test_limitations_that_the_verdict_finds_beside_its_bug_are_in_what_it_predicts(studio: Any) -> None:
    scene = small(studio, "terminator/sphere")
    facets = next(each for each in models(scene) if each.name == "facet_self_shadow" and each.kind == "limitation")
    picture = trace_picture(*configured(scene, (fault(scene, "light_gain", 2.0), facets)))
    verdict, why = asked(picture, scene)
    assert [each.name for each in verdict.findings] == ["light_gain", "facet_self_shadow"]
    check(verdict, why, "light_gain")
    assert why.ranked()[0].beside == ("facet_self_shadow",)
    assert "verdict on the whole picture, beside facet_self_shadow" in why.as_text(5)
    x, y = verdict.findings[1].worst
    beside = explain_pixel(picture, scene, POINT, x, y, closest=24, verdict=verdict)
    assert (beside.ranked()[0].name, beside.ranked()[0].fits) == ("light_gain", True)


def test_a_right_pixel_of_a_wrong_picture_names_the_bug_and_the_pixel_to_look_at(studio: Any) -> None:
    scene = small(studio, "terminator/sphere")
    picture = trace_picture(*configured(scene, (pixel_shift(SIDE, SIDE, 0.5, 0.5),)))
    verdict, _ = asked(picture, scene)
    off = np.abs(picture - trace_picture(*configured(scene, ()))).max(axis=2)
    right_y, right_x = np.unravel_index(int(off.argmin()), off.shape)
    text = explain_pixel(picture, scene, POINT, int(right_x), int(right_y), closest=24, verdict=verdict).as_text(5)
    assert "nothing is wrong with this pixel" in text
    assert f"the verdict on the whole picture is a bug: {verdict.findings[0].message}" in text
    x, y = verdict.findings[0].worst
    assert f"--pixel {x},{y}" in text


def test_a_right_pixel_of_a_right_picture_says_no_more(studio: Any) -> None:
    scene = small(studio, "terminator/sphere")
    picture = trace_picture(*configured(scene, ()))
    verdict = judge([picture], scene, POINT, perceive=False).verdict
    text = explain_pixel(picture, scene, POINT, 0, 0, closest=24, verdict=verdict).as_text(5)
    assert "nothing is wrong with this pixel" in text
    assert "verdict" not in text


def test_a_record_without_strengths_is_still_explained(studio: Any) -> None:
    """As an older run left it."""
    scene = small(studio, "terminator/sphere")
    picture = trace_picture(*configured(scene, (fault(scene, "light_gain", 2.0),)))
    old = Verdict("bug", (Finding("bug", "light_gain", 9.0, (0, 0, 9, 9), message="every light is twice as bright"),))
    plain = Result("a", "", "b", "1", old).as_dict()
    for finding in plain["findings"]:
        del finding["worst"], finding["strengths"]
    kept = Result.from_dict(json.loads(json.dumps(plain)))
    assert kept.worst is None
    y, x = np.unravel_index(int(picture.max(axis=2).argmax()), picture.shape[:2])
    why = explain_pixel(picture, scene, POINT, int(x), int(y), closest=24, verdict=kept.verdict)
    assert why.ranked()
    assert not any(each.told for each in why.predictions)
