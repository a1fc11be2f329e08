"""Repeating a grown texture equals clamping the original."""

from __future__ import annotations

import doctest
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters import textures
from notabug.adapters.base import UnsupportedError
from notabug.references.raster.picture import raster_picture
from notabug.scenes_usd.scene import Texture


def test_examples() -> None:
    assert doctest.testmod(textures).failed == 0


def test_repeated_texture_is_left_alone() -> None:
    pixels = np.random.default_rng(0).random((3, 5, 3))
    grown = textures.grow(Texture(Path("t.png"), pixels), np.array([[-4.0, 9.0]]))
    assert np.array_equal(grown.pixels, pixels)
    assert (grown.a == 1).all()
    assert (grown.b == 0).all()


@pytest.mark.parametrize("wraps", product(("repeat", "clamp", "mirror", "black"), repeat=2))
def test_a_scene_whose_textures_are_all_repeated_looks_the_same(stage: Any, wraps: Any) -> None:
    texture = Texture(Path("t.png"), np.random.default_rng(1).random((3, 4, 3)), *wraps)
    uv = np.array([[-0.7, -0.2], [1.4, -0.2], [1.4, 1.6], [-0.7, 1.6]])
    shown = stage.replace(stage.grey(), texture=0)
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene([stage.quad(2.5, uv=uv)], [light], stage.camera((0, 0, 5)), [shown], [texture], size=(32, 32))
    alike = textures.repeated(scene)
    assert {alike.textures[0].wrap_s, alike.textures[0].wrap_t} == {"repeat"}
    assert np.abs(raster_picture(alike) - raster_picture(scene)).max() < 1e-5


def test_far_uv_are_refused() -> None:
    texture = Texture(Path("t.png"), np.zeros((4, 4, 3)), wrap_t="clamp")
    with pytest.raises(UnsupportedError, match=r"clamped"):
        textures.grow(texture, np.array([[0.0, 0.0], [0.0, 1e5]]))
