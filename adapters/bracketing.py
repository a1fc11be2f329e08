"""Bracketing: pictures in a format that clips at 1, under lights of several gains, made into one that does not clip."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.process import failure
from notabug.scenes_usd.scene import Floats

_STEP = 0.25  # of the lights, from one picture to the next while values clip
_DIM = 1.0 / 16.0  # a picture below this is rendered again, brighter
LEAST_GAIN = 4.0**-12


def subsamples_along(quality: Quality) -> int:
    """Subsamples along a pixel's side, for a renderer that averages a regular grid of them."""
    return max(1, round(math.sqrt(quality.samples)))


def bracketed_in_16_bits(quality: Quality, hit_error: float) -> Declaration:
    """What such a renderer declares that computes in float64 and writes 16 bits: the mean over a pixel, or its centre.

    The rest is as Declaration's defaults have it, and the renderer's own matter.
    """
    along = subsamples_along(quality)
    return Declaration(
        precision="float64",
        hit_error=hit_error,
        filter="point" if along == 1 else "box",
        radius=0.0 if along == 1 else 0.5,
        quantum=1.0 / 65535.0,
        relative_quantum=False,
        noisy=False,
        samples=along**2,
    )


def bracketed(shoot: Callable[[float], Floats], log: Callable[[], str], where: str) -> Floats:
    """The picture as if the gain of the lights were 1 and the format had no end.

    ``shoot`` draws with a gain and gives values in 0..1, 1 where they clip. Raises RendererError, in the name of the
    adapter ``where`` and with its last ``log``, for a picture that clips even at the least gain.
    """
    gain = 1.0
    pixels = shoot(gain)
    peak = float(pixels.max())
    if 0.0 < peak < _DIM:
        gain = 2.0 ** math.floor(math.log2(0.9 / peak))
        pixels = shoot(gain) / gain
    clipped = pixels * gain >= 1.0
    while clipped.any():
        gain *= _STEP
        if gain < LEAST_GAIN:
            raise failure(
                f"pixels brighter than {1.0 / gain:.0f} everywhere the lights are dimmed",
                where=where,
                log=log(),
                do="is a light on a surface?",
            )
        dimmed = shoot(gain)
        pixels = np.where(clipped, dimmed / gain, pixels)
        clipped &= dimmed >= 1.0
    return pixels
