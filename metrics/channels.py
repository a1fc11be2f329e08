"""For the steps of docs/judge.md: from (h, w, 3) arrays to (h, w) and back, faster than numpy over so short an axis."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]


def largest(values: Floats) -> Floats:
    """The largest channel, (h, w)."""
    return np.maximum(np.maximum(values[..., 0], values[..., 1]), values[..., 2])


def total(values: Floats) -> Floats:
    """The sum of the channels, (h, w)."""
    return np.asarray(values[..., 0] + values[..., 1] + values[..., 2])


def pixels(picture: Floats, at: npt.NDArray[np.intp]) -> Floats:
    """The pixels (n, 3) of ``picture`` (h, w, 3) at the flat places ``at`` (n,)."""
    return picture.reshape(-1, 3)[at]


def put(picture: Floats, at: npt.NDArray[np.intp], values: Floats) -> Floats:
    """``picture`` (h, w, 3) with ``values`` (n, 3) at the flat places ``at`` (n,)."""
    result = picture.copy(order="C")
    result.reshape(-1, 3)[at] = values
    return result


def spread(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """``mask`` (h, w) for each channel, (h, w, 3)."""
    return np.repeat(mask[..., None], 3, axis=2)
