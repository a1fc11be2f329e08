"""Pictures of domes for the native code, and how many directions go to each of their texels: references/native/sky.h.

A share of the directions to a dome follows what its picture has above its own mean, texel by texel; the others follow
the cosine, which is all that an even picture asks for (Karlik et al. 2019, "MIS Compensation").
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from notabug.references.tracer.emitters import textured
from notabug.scenes_usd.once import once
from notabug.scenes_usd.scene import Floats, Light, Texture

Array = npt.NDArray[Any]
_EVEN = 1.0 + 1e-9  # times the mean: what rounding leaves of an even picture
MOST = 0.75  # of the directions: the others find what is lit while all that is bright is hidden


class Skies(NamedTuple):
    """All pictures end to end: texel k of a picture is ``texels[first + k]``, row 0 at the upper pole."""

    texels: Array  # (n, 3)
    info: Array  # (pictures, 5) int64: first, width, height, wrap_s, wrap_t
    starts: Array  # (pictures, 2) int64: the first of the picture's ``rows`` and ``cells``
    share: Array  # (pictures,) of the directions those that follow the picture
    weight: Array  # (n,) of each texel: its share of those
    rows: Array  # cumulative shares of the rows
    cells: Array  # (n,) cumulative shares of each row's texels


def skies(lights: Sequence[Light], real: Callable[[npt.ArrayLike], Array]) -> Skies | None:
    """The pictures of the domes among ``lights`` in their order; None where there are none."""
    parts = []
    for light in textured(lights):
        assert light.emitter is not None
        assert light.emitter.texture is not None
        parts.append((light.emitter.texture.pixels, *_followed(light.emitter.texture)))
    if not parts:
        return None
    texels, rows = 0, 0
    info, starts = [], []
    for pixels, *_ in parts:
        height, width = pixels.shape[:2]
        info.append((texels, width, height, 0, 1))
        starts.append((rows, texels))
        texels, rows = texels + width * height, rows + height
    return Skies(
        texels=real(np.concatenate([pixels.reshape(-1, 3) for pixels, *_ in parts])),
        info=np.array(info, np.int64),
        starts=np.array(starts, np.int64),
        share=real([share for _, share, *_ in parts]),
        weight=real(np.concatenate([weight.ravel() for _, _, weight, *_ in parts])),
        rows=real(np.concatenate([row for *_, row, _ in parts])),
        cells=real(np.concatenate([cells.ravel() for *_, cells in parts])),
    )


@once
def _followed(picture: Texture) -> tuple[float, Floats, Floats, Floats]:
    """Share of the directions, of each texel the share of these (h, w), and cumulative shares (h,) and (h, w)."""
    bright = picture.pixels.mean(axis=2)
    height, width = bright.shape
    solid = np.sin(np.pi * (np.arange(height) + 0.5) / height)[:, None] * np.ones(width)  # of each texel, in no unit
    whole = float((bright * solid).sum())
    above = np.maximum(bright - whole / float(solid.sum()), 0.0) * solid
    above[bright <= _EVEN * whole / float(solid.sum())] = 0.0
    power = float(above.sum())
    if not power > 0.0:  # even, or black
        above = solid
    weight = above / above.sum()
    cells = np.cumsum(weight, axis=1)
    lines = cells[:, -1:]
    even = np.broadcast_to(np.arange(1, width + 1) / width, cells.shape)
    return (
        min(power / whole, MOST) if power > 0.0 else 0.0,
        weight,
        np.cumsum(lines[:, 0]),
        np.where(lines > 0.0, cells / np.where(lines > 0.0, lines, 1.0), even),
    )
