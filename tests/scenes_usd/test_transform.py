"""A scene that is moved, turned or scaled shows the same picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from notabug.references.tracer.envelope import trace_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Floats, Scene
from notabug.scenes_usd.transform import rotation, transformed, translation


@pytest.fixture(scope="module")
def scene() -> Scene:
    return replace(read_scene("terminator/sphere"), width=24, height=24)


@pytest.mark.parametrize(
    "matrix",
    [
        translation(3.0, -2.0, 5.0),
        rotation((1.0, 1.0, 0.2), 130.0),
        np.diag([4.0, 4.0, 4.0, 1.0]),
        np.diag([0.5, 0.5, 0.5, 1.0]) @ rotation((0.0, 1.0, 0.0), 40.0) @ translation(1.0, 2.0, 3.0),
    ],
)
def test_the_picture_stays(scene: Scene, matrix: Floats) -> None:
    before, after = trace_picture(scene), trace_picture(transformed(scene, matrix))
    assert before.max() > 0.1
    np.testing.assert_allclose(after, before, rtol=0, atol=1e-12 * before.max())


def test_a_light_that_stays_behind_is_seen(scene: Scene) -> None:
    moved = replace(transformed(scene, translation(3.0, 0.0, 0.0)), lights=scene.lights)
    assert np.abs(trace_picture(moved) - trace_picture(scene)).max() > 0.01


@pytest.mark.parametrize("matrix", [np.diag([1.0, 2.0, 1.0, 1.0]), np.diag([-1.0, 1.0, 1.0, 1.0])])
def test_what_would_change_the_picture_is_refused(scene: Scene, matrix: Floats) -> None:
    with pytest.raises(ValueError, match="similarity"):
        transformed(scene, matrix)
