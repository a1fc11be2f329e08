"""The transfer function of sRGB, IEC 61966-2-1; below 0 mirrored, above 1 by the same curve."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[Any]
"""Floating-point values of any precision; what is returned has the same."""


def decode_srgb(encoded: Floats) -> Floats:
    """Encoded values to linear ones, in the precision they have.

    >>> float(decode_srgb(np.array([0.5])).round(4)[0])
    0.214
    """
    size = np.abs(encoded)
    linear = np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    return np.copysign(linear, encoded)


def encode_srgb(linear: Floats) -> Floats:
    """The inverse of ``decode_srgb``."""
    size = np.abs(linear)
    encoded = np.where(size <= 0.0031308, 12.92 * size, 1.055 * np.maximum(size, 0.0031308) ** (1 / 2.4) - 0.055)
    return np.copysign(encoded, linear)
