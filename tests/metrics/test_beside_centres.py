"""An edge that meets the very centre of a pixel: last bits decide on which side of it the only sample falls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.metrics.admissible import admissible
from notabug.metrics.judge import judge
from notabug.metrics.predictions import Predictions
from notabug.references.predict import predict
from notabug.references.tracer.precision import RELATIVE
from notabug.scenes_usd.scene import Camera, Card, Light, Material, Mesh, Scene

SIDE, COLUMN = 64, 31
TANGENT, HEIGHT = 0.4, 10.0
SHADES = (0.6, 0.5, 0.375, 0.2)  # of the strips, and of what is behind them
ROWS = (30.3, 34.6)  # the strips' upper and lower edge, in pixels
CENTRE, RIGHT = -0.002, 0.1  # pixels from the centre of the column COLUMN: the edges of the middle strip


def _strip(columns: tuple[float, float], rows: tuple[float, float], material: int) -> Mesh:
    """A rectangle that faces the camera, from edge to edge in pixels."""
    x0, x1 = (TANGENT * HEIGHT * (2.0 * each / SIDE - 1.0) for each in columns)
    y1, y0 = (TANGENT * HEIGHT * (1.0 - 2.0 * each / SIDE) for each in rows)
    points = np.array([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])
    return Mesh(f"/Strip{material}", points, np.array([4], np.int32), np.arange(4, dtype=np.int32), material)


def _scene(first: float, second: float) -> Scene:
    """Three strips whose inner edges are ``first`` and ``second`` pixels from the centre of the column."""
    centre = COLUMN + 0.5
    borders = (8.2, centre + first, centre + second, 55.7)
    strips = [_strip((borders[k], borders[k + 1]), ROWS, k) for k in range(3)]
    strips += [_strip((10.4, 20.1), (40.3, 55.2), 3), _strip((-SIDE, 2 * SIDE), (-SIDE, ROWS[0] - 2.0), 3)]
    place = np.eye(4)
    place[3, 2] = HEIGHT
    materials = tuple(Material(f"/Shade{k}", (shade,) * 3) for k, shade in enumerate(SHADES))
    return Scene(
        "test/strips",
        Path("scene.usda"),
        {},
        Card("own", "Three strips."),
        Camera("/Camera", place, TANGENT, TANGENT, 1e-3, 1e6),
        SIDE,
        SIDE,
        tuple(strips),
        (Light("/Sun", "distant", (np.pi,) * 3, direction=(0.0, 0.0, -1.0)),),
        materials,
        (),
        None,
    )


def _pixel(scene: Scene, column: int) -> Any:
    return predict(scene).point[SIDE // 2, column, 0]


@pytest.mark.parametrize("moved", [0.004, 0.02])
def test_what_shows_just_beside_the_centre_is_admitted(studio: Any, moved: float) -> None:
    scene = _scene(CENTRE, RIGHT)
    envelope = predict(scene)
    at = (SIDE // 2, COLUMN, 0)
    assert abs(envelope.mean[at] - envelope.point[at]) < 0.02  # the mean does not tell of the edge
    other = _scene(CENTRE + moved, RIGHT)
    assert _pixel(scene, COLUMN) == pytest.approx(SHADES[1])
    assert _pixel(other, COLUMN) == pytest.approx(SHADES[0])
    assert judge([predict(other).point], scene, studio.point, perceive=False).verdict.word == "pass"


def test_what_shows_a_tenth_of_a_pixel_beside_it_is_not(studio: Any) -> None:
    scene = _scene(CENTRE, RIGHT)
    other = _scene(CENTRE - RIGHT, CENTRE)  # where the last strip begins at the centre
    assert _pixel(other, COLUMN) == pytest.approx(SHADES[2])
    assert judge([predict(other).point], scene, studio.point, perceive=False).verdict.word == "bug"


def test_what_was_looked_at_closely_stays_so(studio: Any) -> None:
    scene = _scene(CENTRE, RIGHT)
    bare = predict(scene)
    predicted = Predictions(scene, bare, admissible(bare, studio.point), studio.point, RELATIVE, None)
    first, second = (np.zeros((SIDE, SIDE), np.bool_) for _ in range(2))
    first[SIDE // 2, COLUMN] = second[0, 0] = True
    seen = predicted.closely(first)(())
    again = predicted.closely(second)(())
    assert seen.hi[SIDE // 2, COLUMN, 0] == pytest.approx(SHADES[0])
    np.testing.assert_array_equal(again.hi[SIDE // 2], seen.hi[SIDE // 2])
    assert predicted(()).hi[SIDE // 2, COLUMN, 0] < 0.95 * SHADES[0]  # those without a close look are as they were
