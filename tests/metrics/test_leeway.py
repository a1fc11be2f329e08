"""Edges of shadows: a reasonable epsilon may light them, a larger one may not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import admissible, edges
from notabug.metrics.leeway import _moved, _surface, leeway
from notabug.references.models.acne import width_of_view
from notabug.references.models.model import Model
from notabug.references.predict import predict
from notabug.references.tracer.envelope import Envelope
from notabug.references.viewing import projected
from notabug.scenes_usd.scene import Scene

BOX = Declaration("float64", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=False, samples=25, silhouette="keep")
SIZE = 128


def _small(studio: Any, name: str, size: int = SIZE, **variants: str) -> Scene:
    return replace(studio.scene(name, **variants), width=size, height=size)


def _with_epsilon(scene: Scene, pixels: float) -> Envelope:
    length = pixels * width_of_view(scene) / scene.width
    options = {"start": "absolute", "epsilon": length}
    return predict(scene, (Model("epsilon", "fault", "it is that long", "nowhere", options=options),))


@pytest.mark.parametrize(
    ("pixels", "word"),
    [*((each, "pass") for each in (0.0, 0.1, 0.25, 0.5)), *((each, "bug") for each in (2.0, 4.0, 6.0))],
)
def test_an_epsilon_passes_up_to_half_a_pixel(studio: Any, pixels: float, word: str) -> None:
    """One of two pixels lights the corners where the blocks meet the floor: all of it once lay at shadows' edges."""
    scene = _small(studio, "acne/grazing_plane")
    picture = _with_epsilon(scene, pixels).mean if pixels else predict(scene).mean
    assert studio.verdict([picture], scene, BOX, naming=False).word == word


def test_an_epsilon_of_two_hundredths_is_a_bug(studio: Any) -> None:
    """1.7 pixels at 256 x 256."""
    scene = _small(studio, "acne/grazing_plane", 256)
    picture = predict(scene, (Model("e", "fault", "", "", options={"start": "absolute", "epsilon": 0.02}),)).mean
    assert studio.verdict([picture], scene, BOX, naming=False).word == "bug"


def test_only_light_is_admitted_and_only_at_the_edges_of_shadows(studio: Any) -> None:
    scene = _small(studio, "acne/grazing_plane")
    exact = predict(scene)
    more = leeway(scene, exact)
    assert more.min() >= 0.0
    strict, open_to = admissible(exact, BOX), admissible(exact, BOX, leeway=more)
    assert np.array_equal(strict.lo, open_to.lo)
    lit = (open_to.hi > strict.hi).any(axis=2)
    assert lit.any()
    assert not (lit & ~edges(exact, 1, cast=True)).any()


def test_places_and_normals_are_those_of_the_scene(studio: Any) -> None:
    """Every place is seen at its own pixel's centre, and the floor's normal is the plane's through its places."""
    scene = _small(studio, "acne/grazing_plane", 32)
    place, normal, depth = _surface(scene)
    seen = depth > 0
    assert seen.mean() > 0.5
    y, x = np.nonzero(seen)
    assert projected(scene, place)[0][seen] == pytest.approx(np.stack([x + 0.5, y + 0.5], axis=1), abs=1e-3)
    assert np.linalg.norm(normal[seen], axis=1) == pytest.approx(1.0, abs=1e-4)
    floor = seen & (np.abs(normal - np.median(normal[seen], axis=0)).max(axis=2) < 1e-4)
    height = (place * normal).sum(axis=2)[floor]
    assert np.median(np.abs(height - np.median(height))) < 1e-5  # but for the tops of the blocks


@pytest.mark.parametrize("elevation", ["5", "1"])
def test_the_tip_of_a_shadow_retreats_by_the_cotangent(studio: Any, elevation: str) -> None:
    """Half a footprint over the tangent of the light's elevation, foreshortened at most."""
    scene = _small(studio, "acne/grazing_plane", 32, light_elevation=elevation)
    place, normal, depth = _surface(scene)
    (light,) = scene.lights
    floor = (depth > 0) & (np.abs(normal - np.median(normal[depth > 0], axis=0)).max(axis=2) < 1e-4)
    sine = -float(np.median(normal[floor], axis=0) @ np.asarray(light.direction))
    moved = np.hypot(*np.moveaxis(_moved(scene, light, place, normal, depth), 2, 0))[floor]
    longest = 0.5 * np.sqrt(1.0 - sine**2) / sine
    assert moved.max() < 1.1 * longest
    assert moved.max() > 0.2 * longest
