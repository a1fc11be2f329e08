"""Where rays start: every rule of epsilon on a plane and under a sheet, whose light and shadow are closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Mesh

HEIGHT = 0.05  # of the sheet above the plane
TURN = 0.6  # radians, so that no coordinate of the plane is constant and none is exact by luck
GRAZING = math.radians(8.0)  # of the light over the plane


def turned(points: Any) -> Any:
    c, s = math.cos(TURN), math.sin(TURN)
    return np.asarray(points, float) @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ [[c, s, 0], [-s, c, 0], [0, 0, 1]]


@pytest.fixture(scope="module")
def plane(make: Any) -> Any:
    """``plane(distance, sheet)``: a plane in grazing light, seen from ``distance``; a sheet floats over its middle."""

    def build(distance: float, sheet: bool = False) -> Any:
        corners = [(-9.0, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
        meshes = [make.mesh(turned(corners), [(0, 1, 2, 3)])]
        if sheet:
            raised = np.array([(-3.0, -0.3, HEIGHT), (3, -0.3, HEIGHT), (3, 0.3, HEIGHT), (-3, 0.3, HEIGHT)])
            meshes.append(make.mesh(turned(raised), [(0, 1, 2, 3)]))
        eye = turned([(0.0, -0.8 * distance, 0.6 * distance)])[0]
        light = make.distant(turned([(0.0, math.cos(GRAZING), -math.sin(GRAZING))])[0])
        camera = replace(make.camera(eye, (0, 0, 0), tangent=1.0 / distance), near=1e-3 * distance, far=1e3 * distance)
        return make.scene(meshes, [light], camera, size=48)

    return build


def lost(scene: Any, dtype: str, **options: Any) -> float:
    """The share of pixels without light; all others have exactly sin(8 degrees)/pi of it."""
    picture = trace_picture(scene, Options(ties="nearest", **options), dtype=dtype)[..., 0]
    dark = picture == 0
    assert np.allclose(picture[~dark], math.sin(GRAZING) / math.pi, rtol=1e-5)
    return float(dark.mean())


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("distance", [10.0, 1e5])
def test_without_an_epsilon_there_is_acne_and_a_bound_on_the_error_prevents_it(
    plane: Any, dtype: str, distance: float
) -> None:
    scene = plane(distance)
    none = lost(scene, dtype, start="none")
    print(f"\n{dtype} at {distance:g}: {none:.2f} of the plane dark without an epsilon")
    assert 0.1 < none < 0.95
    assert lost(scene, dtype) == 0.0
    assert lost(scene, dtype, start="error_bound") == 0.0
    assert lost(scene, dtype, start="relative", epsilon=1e-13 if dtype == "float64" else 1e-5) == 0.0


def test_an_absolute_epsilon_holds_at_one_distance_only(plane: Any) -> None:
    """The hit's error at 1e5 is about 1e5 * 2^-24 = .006, whose grazing shadow ray needs .006 / sin 8 degrees = .04."""
    assert lost(plane(10.0), "float32", start="absolute", epsilon=1e-3) == 0.0
    assert lost(plane(1e5), "float32", start="absolute", epsilon=1e-3) > 0.1
    assert lost(plane(1e5), "float32", start="absolute", epsilon=0.2) == 0.0


def test_a_ray_shot_back_at_the_plane_corrects_the_hit(plane: Any) -> None:
    """Woo, Pearce and Ouellette 1996: what an epsilon of 1e-4 does not prevent from afar, the refined hit does."""
    scene = plane(1e5)
    before = lost(scene, "float32", start="absolute", epsilon=1e-4)
    after = lost(scene, "float32", start="absolute", epsilon=1e-4, refine=True)
    print(f"\n{before:.3f} dark before, {after:.3f} after")
    assert before > 0.1
    assert after == 0.0


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_an_epsilon_too_large_loses_the_shadow(plane: Any, dtype: str) -> None:
    """The sheet is met after HEIGHT / sin 8 degrees = .36: an epsilon of .35 keeps its shadow, one of .37 does not."""
    scene, met = plane(10.0, sheet=True), HEIGHT / math.sin(GRAZING)
    kept = lost(scene, dtype, start="absolute", epsilon=0.97 * met)
    assert kept > 0.05
    assert kept == pytest.approx(lost(scene, dtype), abs=1e-3)
    assert lost(scene, dtype, start="absolute", epsilon=1.03 * met) == 0.0


def test_snyder_and_barrs_offset_too_small_right_and_too_large() -> None:
    """Outwards by about the sagitta the facets' shadow is gone; by a little it persists; by more than the height of a
    plate that hovers over the ball, the plate's real shadow is gone as well."""
    ball = replace(read_scene("terminator/sphere", {"tessellation": "16x8"}), width=128, height=128, intent=None)
    (body,) = (each for each in ball.meshes if each.normals is not None)
    floor = next(each for each in ball.meshes if each.normals is None)
    low, high = body.points.min(axis=0), body.points.max(axis=0)
    centre, radius = (low + high) / 2, float((high - low).max()) / 2
    up = np.asarray(ball.lights[0].position) - centre
    up /= np.linalg.norm(up)
    across = np.cross(up, ball.camera.to_world[2, :3])
    across /= np.linalg.norm(across)
    along = np.cross(up, across)
    place = centre + 1.05 * radius * up
    corners = [place + 0.45 * radius * (a * across + b * along) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    plate = Mesh("/Plate", np.array(corners), np.array([4], np.int32), np.arange(4, dtype=np.int32), floor.material)
    scene = replace(ball, objects=(*ball.objects, plate))
    right, wrong = trace_picture(scene), {}
    for offset in (0.0, 0.02, 1.0, 6.0):
        picture = trace_picture(scene, Options(shadows="facets", offset=offset))
        wrong[offset] = (int((picture < 0.99 * right).any(-1).sum()), int((picture > 1.01 * right).any(-1).sum()))
    print(f"\noffset: (too dark, too bright) {wrong}")
    dark, bright = ({key: each[k] for key, each in wrong.items()} for k in (0, 1))
    assert dark[0.0] > 40
    assert dark[0.02] > 0.5 * dark[0.0]
    assert dark[1.0] < 0.1 * dark[0.0]
    assert bright[6.0] > 15
    assert bright[1.0] < 0.2 * bright[6.0]
