"""How exact the means over pixels are: more samples where they are needed, and a bound of what is left."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.references.predict import configured
from notabug.references.tracer.envelope import changes, lattice, trace_envelope, trace_samples
from notabug.references.tracer.precision import CORNER, MOST, SLANTED, around, asked, bends, steps
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Material, Texture

DEEP = 4096


def striped(make: Any, turned: float) -> Any:
    """A floor of stripes far finer than pixels in the distance, seen at a slant; ``turned`` about its normal."""
    c, s = np.cos(turned), np.sin(turned)
    corners = (
        40.0
        * np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
        @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)])
    )
    pixels = np.zeros((1, 16, 3))
    pixels[:, ::2] = 1.0
    uv = [(0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)]
    floor = make.mesh(corners, [(0, 1, 2, 3)], uv=uv)
    material = Material("/Stripes", (1.0, 1.0, 1.0), 0)
    sun = make.distant((0.2, 0.1, -1.0), 3.0)
    camera = make.camera((0, -12, 4), (0, 0, 0), 0.4, up=(0.0, 0.0, 1.0))
    texture = Texture(Path("stripes"), pixels)
    return make.scene([floor], [sun], camera, materials=[material], textures=[texture], size=40)


def scene_of(make: Any, name: str) -> Any:
    if name == "stripes":
        return striped(make, 0.0)
    if name == "turned stripes":
        return striped(make, 0.7)
    return replace(read_scene(name), width=40, height=40)


@pytest.mark.parametrize("name", ["stripes", "turned stripes", "texture/perspective_floor", "terminator/sphere"])
def test_a_mean_is_within_its_bound_of_that_of_very_many_samples(make: Any, name: str) -> None:
    """And few samples are not, where they are told to be enough for every pixel."""
    scene, options = configured(scene_of(make, name), ())
    few, found = trace_envelope(scene, options, refine=0), trace_envelope(scene, options, most=MOST)
    at = np.arange(7, scene.width * scene.height, 9)
    deep, error = trace_samples(scene, options, at, DEEP)
    none = np.zeros(found.ids.shape, np.bool_)
    least = asked(found.mean, found.mean, none, float(found.point.max())).reshape(-1, 3)[at]
    off = [np.abs(each.mean.reshape(-1, 3)[at] - deep) - error for each in (few, found)]
    allowed = np.maximum(found.bound.reshape(-1, 3)[at], least)
    assert (off[1] <= allowed).all()
    assert (off[0] > least).any()
    edge = (found.edge | changes(found.ids)).ravel()[at]
    if "sphere" not in name:
        assert np.abs(off[1])[~edge].mean() < 0.3 * np.abs(off[0])[~edge].mean()


def misjudged(samples: int) -> float:
    """The most that a lattice misjudges of the part of a pixel to one side of a straight edge.

    An edge is worst where it runs through samples, all but along a row of them: the directions of the short differences
    of two samples are tried, and many others.
    """
    s = np.arange(samples)
    points = (np.stack([s, lattice(samples) * s % samples], axis=1) + 0.5) / samples
    away = points - points[samples // 2]
    near = away[(np.hypot(*away.T) > 0) & (np.hypot(*away.T) < 6 / np.sqrt(samples))]
    angles = np.concatenate([np.arctan2(near[:, 1], near[:, 0]) + np.pi / 2 + off for off in (-1e-7, 0.0, 1e-7)])
    worst = 0.0
    for angle in (*angles, *np.linspace(0.01, 3.13, 200)):
        across, down = float(np.cos(angle)), float(np.sin(angle))
        turned = np.where([across < 0, down < 0], 1.0 - points, points)
        a, b = max(abs(across), 1e-9), max(abs(down), 1e-9)
        d = np.sort(turned @ (a, b))
        area = sum(k * np.maximum(d - e, 0.0) ** 2 for k, e in ((1, 0.0), (-1, a), (-1, b), (1, a + b))) / (2 * a * b)
        below = np.arange(samples) / samples
        worst = max(worst, float(np.abs(area - below).max()), float(np.abs(area - below - 1 / samples).max()))
    return worst


@pytest.mark.parametrize("samples", [64, 256, 1024])
def test_no_straight_edge_is_misjudged_by_more_than_the_bound_says(samples: int) -> None:
    """What holds of most edges does not hold of all: the glass balls' edges along a diagonal were off by 1.5 bounds."""
    found = misjudged(samples)
    assert CORNER / samples < 0.7 * found
    assert 0.7 * SLANTED / np.sqrt(samples) < found < SLANTED / np.sqrt(samples)


def test_more_samples_only_where_they_are_needed(make: Any) -> None:
    """An even floor needs none: its means are those of the regular samples, and their error is known to be small."""
    floor = make.scene([make.rectangle()], [make.point((0.5, 0.2, 9))], make.camera((1, -3, 4), (0, 0, 0)), size=32)
    few, found = trace_envelope(floor, refine=0), trace_envelope(floor, most=MOST)
    assert np.array_equal(few.mean, found.mean)
    none = np.zeros(found.ids.shape, np.bool_)
    assert (found.bound <= asked(found.mean, found.mean, none, float(found.point.max()))).all()


def test_a_step_that_no_sample_of_a_pixel_sees_shows_beside_it() -> None:
    known = np.ones((3, 4), np.bool_)
    slope = np.tile(np.arange(4.0)[None, :, None], (3, 1, 3))
    lo, hi = slope - 0.375, slope + 0.375  # of four samples of an even slope
    assert not steps(lo, hi, known, 4).any()
    lo[:, 2:], hi[:, 2:] = lo[:, 2:] + 5.0, hi[:, 2:] + 5.0
    found = steps(lo, hi, known, 4)
    assert found[:, 1:3].min() > 4.5
    assert not found[:, 0].any()
    assert not steps(lo, hi, known & (np.arange(4) < 2), 4).any()  # of what is not known nothing is told
    assert around(lo, hi)[1, 1].tolist() == [7.75] * 3


def test_a_bend_between_the_samples_of_two_pixels_shows_in_their_means() -> None:
    known = np.ones((3, 6), np.bool_)
    tent = np.tile(
        3.0 - np.abs(np.arange(6.0) - 2.5)[None, :, None], (3, 1, 3)
    )  # up to the border of 2 and 3, and down
    found = bends(tent, known, 4)
    assert found[:, 2:4].min() == 1.0 / 64  # exactly: the slope changes by 2 there, 2 / (8 * 16)
    assert not found[:, :2].any()
    assert not found[:, 4:].any()
