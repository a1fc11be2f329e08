"""Repeating a grown texture equals clamping the original."""

from __future__ import annotations

import doctest
from pathlib import Path

import numpy as np
import pytest

from notabug.adapters import textures
from notabug.adapters.base import UnsupportedError
from notabug.scenes_usd.scene import Texture


def test_examples() -> None:
    assert doctest.testmod(textures).failed == 0


def test_repeated_texture_is_left_alone() -> None:
    pixels = np.random.default_rng(0).random((3, 5, 3))
    grown = textures.grow(Texture(Path("t.png"), pixels), np.array([[-4.0, 9.0]]))
    assert np.array_equal(grown.pixels, pixels)
    assert (grown.a == 1).all()
    assert (grown.b == 0).all()


def test_far_uv_are_refused() -> None:
    texture = Texture(Path("t.png"), np.zeros((4, 4, 3)), wrap_t="clamp")
    with pytest.raises(UnsupportedError, match=r"clamped"):
        textures.grow(texture, np.array([[0.0, 0.0], [0.0, 1e5]]))
