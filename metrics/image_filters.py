"""For the steps of docs/judge.md: filters over a pixel's neighbours by shifts of the picture, faster than ndimage's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]
Values = TypeVar("Values", Floats, Bools)

_TRUNCATED = 4.0  # standard deviations after which a Gaussian is taken to be nothing


def extreme(values: Values, which: np.ufunc) -> Values:
    """The extreme of each 3 x 3 neighbourhood of (h, w) or (h, w, c): ``which`` is np.minimum, maximum, logical_or."""
    for axis in (0, 1):
        first, last = (slice(None),) * axis + (slice(1, None),), (slice(None),) * axis + (slice(None, -1),)
        result = values.copy()
        which(result[first], values[last], out=result[first])
        which(result[last], values[first], out=result[last])
        values = result
    return values


def widened(mask: Bools, reach: int) -> Bools:
    """``mask`` (h, w) and what is within ``reach`` pixels of it, along and across."""
    for _ in range(reach):
        mask = extreme(mask, np.logical_or)
    return mask


def weighed(values: Floats, weights: Sequence[float], axis: int) -> Floats:
    """``values`` under a filter along ``axis``, what is outside as the nearest inside.

    ``weights`` are that of the middle and those of the neighbours on either side, outwards.
    """
    reach, count = len(weights) - 1, values.shape[axis]
    widths = [(reach, reach) if each == axis else (0, 0) for each in range(values.ndim)]
    wide = np.pad(values, widths, mode="edge")
    result, part = weights[0] * values, np.empty_like(values)
    for away, weight in enumerate(weights[1:], 1):
        before, after = (
            wide[(slice(None),) * axis + (slice(start, start + count),)] for start in (reach - away, reach + away)
        )
        np.add(before, after, out=part)
        part *= weight
        result += part
    return result


def laplacian(value: Floats) -> Floats:
    """The five-point Laplacian of (h, w) or of each channel of (h, w, 3)."""
    return weighed(value, (-2.0, 1.0), 1) + weighed(value, (-2.0, 1.0), 0)


def blurred(value: Floats, deviation: float) -> Floats:
    """``value`` (h, w) under a Gaussian of that standard deviation in pixels; none: as it is."""
    if not deviation:
        return value
    weights = np.exp(-0.5 * (np.arange(int(_TRUNCATED * deviation + 0.5) + 1) / deviation) ** 2)
    weights /= 2.0 * weights.sum() - weights[0]
    return weighed(weighed(value, weights.tolist(), 0), weights.tolist(), 1)
