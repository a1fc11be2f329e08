"""For the steps of docs/judge.md: what follows from mathematics alone, which nobody chooses and nobody tunes."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

DEVIATION = 1.4826
"""Times the median of |x - median| is the standard deviation of normal noise: 1 / the normal quantile of 3/4."""
BOX_VARIANCE = 1.0 / 12.0
"""Of a box one pixel wide, in squared pixels."""
BOX_DEVIATION = 12.0**-0.5
"""Its standard deviation, in pixels."""

Number = TypeVar("Number", float, npt.NDArray[np.floating])


def most_variance(width: Number) -> Number:
    """The largest variance of a value in a range of that ``width``: Popoviciu 1935."""
    return width**2 / 4.0


def tent_variance(radius: float) -> float:
    """Of a tent that is nothing from ``radius`` on, in squared pixels."""
    return radius**2 / 6.0


def gaussian_variance(radius: float) -> float:
    """Of a Gaussian of a standard deviation of half a pixel, less its value at the ``radius``, in squared pixels."""
    x = (np.arange(512) + 0.5) / 512 * radius
    weight = np.exp(-2.0 * x * x) - math.exp(-2.0 * radius**2)
    return float((weight * x * x).sum() / weight.sum())


def joined(deviation: float) -> float:
    """How many pixels a Gaussian blur of that ``deviation`` makes alike: one over the sum of its squared weights."""
    return 4.0 * np.pi * deviation**2
