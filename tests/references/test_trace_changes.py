"""An envelope that is traced only where it differs from a known one is the whole envelope, and costs less."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest

from notabug.references.models.model import models
from notabug.references.predict import configured
from notabug.references.tracer import envelope as traced
from notabug.references.tracer.envelope import trace_changes, trace_envelope
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

SIDE = 48
BESIDE = 0.1  # bounds look at the pixels beside: at the rim of what is traced they may be the old ones
CASES = (
    ("terminator/sphere", "facet_self_shadow"),
    ("terminator/sphere", "albedo"),
    ("mirror/corner", "highlight_uncut"),
    ("texture/perspective_floor", "texture_nearest"),
    ("visibility/standing", "no_shadow"),
)


def _scene(scene_id: str) -> Scene:
    return replace(read_scene(scene_id), width=SIDE, height=SIDE)


@pytest.mark.parametrize(("scene_id", "name"), CASES)
def test_what_a_model_changes_is_traced_as_in_the_whole_picture(scene_id: str, name: str) -> None:
    """Of these models, each changes the centre of a pixel near everything that it changes."""
    scene = _scene(scene_id)
    model = next(each for each in models(scene) if each.name == name)
    base = trace_envelope(*configured(scene, ()))
    found, whole = trace_changes(*configured(scene, (model,)), base), trace_envelope(*configured(scene, (model,)))
    assert (whole.point != base.point).any()
    for part, of_whole in whole.arrays().items():
        same = BESIDE if part == "bound" else traced.SAME
        np.testing.assert_allclose(getattr(found, part), of_whole, rtol=same, atol=1e-12, err_msg=part)


def test_what_changes_nothing_costs_one_sample_a_pixel() -> None:
    scene, options = configured(_scene("terminator/sphere"), ())
    base, rays = trace_envelope(scene, options), 0

    def counted(*args: Any, **how: Any) -> None:
        nonlocal rays
        rays += args[3].size * (how["grid"] ** 2 if how["grid"] > 0 else how["samples"])
        real(*args, **how)

    real = traced._pass
    with mock.patch.object(traced, "_pass", counted):
        found = trace_changes(scene, options, base)
    assert rays == SIDE * SIDE
    for part, of_base in base.arrays().items():
        np.testing.assert_array_equal(getattr(found, part), of_base, err_msg=part)


def test_what_no_centre_shows_is_seen_where_one_asks_for_it() -> None:
    """A light that changes too little for a centre to count, as a change between the centres would be."""
    scene, options = configured(_scene("terminator/sphere"), ())
    base = trace_envelope(scene, options)
    (light,) = scene.lights
    red, green, blue = (each * (1.0 + 1e-8) for each in light.intensity)
    barely = replace(scene, lights=(replace(light, intensity=(red, green, blue)),))
    at = np.zeros((SIDE, SIDE), np.bool_)
    at[: SIDE // 2] = True
    unseen, seen = trace_changes(barely, options, base), trace_changes(barely, options, base, at)
    whole = trace_envelope(barely, options)
    assert (whole.mean != base.mean).any()
    np.testing.assert_array_equal(unseen.mean, base.mean)
    np.testing.assert_array_equal(seen.mean, np.where(at[..., None], whole.mean, base.mean))
