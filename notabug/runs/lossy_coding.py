"""What a lossy coding may have done to a picture: found by coding the picture that should have been there.

JPEG, DWA and their like lose more than a step of their numbers, and how much depends on what they show. A picture that
is off by no more than they lose is neither right nor wrong. So a bug in such a file counts only where it is left after
the picture has been moved towards the nearest admissible one by what the same coding loses of that one.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.metrics.image_filters import extreme
from notabug.scenes_usd.picture import Pixels, read_picture, write_coded
from notabug.scenes_usd.picture_numbers import Lossy
from notabug.scenes_usd.srgb import decode_srgb, encode_srgb
from notabug.scenes_usd.temporary import temporary_folder

# An edge that crosses a block elsewhere by a part of a pixel is lost otherwise, at most as much again.
SPARE = 2.0

Floats = npt.NDArray[np.floating]


def spared(picture: Floats, nearest: Floats, lossy: Lossy, *, srgb: bool) -> Floats:
    """``picture`` (h, w, 3) moved towards ``nearest`` by what ``lossy`` may have lost; ``srgb``: it was encoded."""
    off = picture - nearest
    left = np.maximum(np.abs(off) - _loss(nearest, lossy, srgb=srgb), 0.0)
    return np.asarray(nearest + np.sign(off) * left, np.float32)


def lifted(picture: Floats, nearest: Floats, lossy: Lossy, *, srgb: bool) -> Floats:
    """``picture`` (h, w, 3) with 0 where it is negative by no more than ``lossy`` may have made it."""
    made = (picture < 0.0) & (picture >= -_loss(nearest, lossy, srgb=srgb))
    return np.where(made, np.float32(0.0), picture)


def _loss(picture: Floats, lossy: Lossy, *, srgb: bool) -> Floats:
    """What the coding may lose around each pixel (h, w, 1) of ``picture``: of any channel, since it mixes them."""
    lost = np.abs(_coded(picture, lossy, srgb=srgb) - picture).max(axis=2, keepdims=True)
    return SPARE * extreme(_around(lost, lossy.block), np.maximum)  # colours are smoothed over a block's border


def _coded(picture: Floats, lossy: Lossy, *, srgb: bool) -> Pixels:
    values = np.asarray(picture, np.float32)
    with temporary_folder() as folder:
        path = folder / f"coded{lossy.suffix}"
        write_coded(path, encode_srgb(values) if srgb else values, lossy.stored, lossy.attributes)
        read = read_picture(path).pixels
    return decode_srgb(read) if srgb else read


def _around(loss: Floats, block: int) -> Floats:
    """The largest loss in the block of each pixel, blocks laid as the codings lay them."""
    height, width = loss.shape[:2]
    rows, columns = (np.arange(0, size, block) for size in (height, width))
    most = np.maximum.reduceat(np.maximum.reduceat(loss, rows, axis=0), columns, axis=1)
    return np.repeat(np.repeat(most, block, axis=0), block, axis=1)[:height, :width]
