"""Step 1 of docs/judge.md, is it a picture: wrong size, non-finite (which other comparisons hide), negative."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from notabug.metrics.policy import POLICY
from notabug.metrics.verdict import Finding


def finite(values: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
    """Which ``values`` can be reckoned with: no NaN, no infinity, none larger than `image_checks.largest`."""
    return np.asarray(np.abs(values) <= POLICY.image_checks.largest, np.bool_)  # a NaN is not


def invalid(pictures: Sequence[npt.NDArray[np.floating]], height: int, width: int) -> Finding | None:
    """What makes ``pictures`` (each (h, w, 3)) unfit to be compared with a reference of that size, or None."""
    for picture in pictures:
        if picture.ndim != 3 or picture.shape[2] != 3:
            return Finding(
                "bug", "wrong_channels", 0.0, (0, 0, 0, 0), message=f"expected (h, w, 3), got {picture.shape}"
            )
        h, w = picture.shape[:2]
        if (h, w) != (height, width):
            return Finding(
                "bug",
                "wrong_size",
                float(h * w),
                (0, 0, w, h),
                message=f"the picture is {w} x {h}, expected {width} x {height}{_scale(w / width, h / height)}",
            )
        sound = np.asarray(finite(picture).all(axis=2))
        if not sound.all():
            count = int((~sound).sum())
            y, x = (int(v) for v in np.argwhere(~sound)[0])
            return Finding(
                "bug",
                "non_finite",
                float(count),
                box(~sound),
                z=float("inf"),
                message=f"{count} of {h * w} pixels are NaN or infinite{_huge(picture[y, x])}, the first at ({x}, {y})",
            )
        if picture.min() < POLICY.image_checks.negative:
            negative = picture.min(axis=2) < POLICY.image_checks.negative
            return Finding(
                "bug",
                "negative",
                float(negative.sum()),
                box(negative),
                message=f"{int(negative.sum())} pixels are negative, down to {float(picture.min()):.3g}",
            )
    return None


def _huge(pixel: npt.NDArray[np.floating]) -> str:
    return f", or as good as that: {float(np.abs(pixel).max()):.3g}" if np.isfinite(pixel).all() else ""


def _scale(x: float, y: float) -> str:
    return f": scaled by {x:g}" if abs(x - y) < 1e-9 else ""


def box(mask: npt.NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """The bounding box [x0, y0, x1, y1) of ``mask`` (h, w)."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return (0, 0, 0, 0)
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
