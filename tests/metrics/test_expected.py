"""What a picture is held against is the same for the judge and for `notabug why`: a pixel that one admits, so does the
other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, admissible
from notabug.metrics.expected import expected
from notabug.metrics.leeway import leeway
from notabug.metrics.why import explain_pixel
from notabug.references.predict import predict
from notabug.scenes_usd.scene import Scene

POINT = Declaration("float64", "point", 0.0, 2.0**-24, relative_quantum=True, noisy=False, samples=1)
BOX = replace(POINT, filter="box", radius=0.5, samples=25, silhouette="keep")


def small(studio: Any, name: str, side: int) -> Scene:
    return replace(studio.scene(name), width=side, height=side)


def beyond(picture: npt.NDArray[np.floating], to: Admissible) -> npt.NDArray[np.float64]:
    """By how much (h, w) of ``picture`` is beyond what ``to`` admits."""
    off = np.abs(picture - np.clip(picture, to.lo, to.hi)) - to.tau
    return np.asarray(off.max(axis=2), np.float64)


def largest_of(values: npt.NDArray[np.floating]) -> tuple[int, int]:
    """The row and column at which ``values`` (h, w) are the largest."""
    y, x = np.unravel_index(int(values.argmax()), values.shape)
    return int(y), int(x)


@pytest.mark.parametrize(("name", "sign"), [("penumbra", 1.0), ("near_light", -1.0), ("thin_wall", 1.0)])
def test_what_centres_leave_open_under_a_light_with_a_size_is_no_fault_to_why(
    studio: Any, name: str, sign: float
) -> None:
    scene = small(studio, f"area_shadows/{name}", 24)
    reference = expected(scene, POINT).admitted
    strict = admissible(predict(scene), POINT)
    y, x = largest_of((reference.tau - strict.tau).max(axis=2))
    picture = np.array(reference.value)
    end = reference.lo if sign < 0 else reference.hi
    picture[y, x] = end[y, x] + sign * 0.9 * reference.tau[y, x]
    assert beyond(picture, strict)[y, x] > 0, "the test needs a pixel that is off but for what centres leave open"
    assert studio.verdict([picture], scene, POINT, naming=False).word == "pass"
    assert explain_pixel(picture, scene, POINT, x, y, closest=4).predictions[0].fits


def test_an_edge_that_a_reasonable_epsilon_lights_is_no_fault_to_why(studio: Any) -> None:
    scene = small(studio, "acne/grazing_plane", 64)
    exact = predict(scene)
    strict, lit = admissible(exact, BOX), admissible(exact, BOX, leeway=leeway(scene, exact))
    y, x = largest_of((lit.hi - strict.hi).min(axis=2))
    picture = np.array(strict.value)
    picture[y, x] = lit.hi[y, x]
    assert beyond(picture, strict)[y, x] > 0, "the test needs a pixel that is off without an epsilon"
    assert studio.verdict([picture], scene, BOX, naming=False).word == "pass"
    assert explain_pixel(picture, scene, BOX, x, y, closest=4).predictions[0].fits


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_pixel_that_is_no_number_is_off_and_others_are_not(studio: Any, value: float) -> None:
    scene = small(studio, "area_shadows/penumbra", 24)
    picture = np.array(expected(scene, POINT).admitted.value)
    picture[3, 5] = value
    assert not explain_pixel(picture, scene, POINT, 5, 3, closest=1).predictions[0].fits
    assert explain_pixel(picture, scene, POINT, 6, 3, closest=1).predictions[0].fits
