"""How exact the mean over a pixel has to be, and which pixels need more samples for it.

A verdict admits RELATIVE of a value and ABSOLUTE of the picture's brightest one, and more at edges. What is predicted
may be off by a QUARTER of that. Estimates of the error come with the samples (references/native/error.h); what lies
between the outermost samples of two neighbours, ``seams`` estimates.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]

RELATIVE = 0.004  # the default tolerance of a verdict
ABSOLUTE = 5e-4  # of the brightest value of the picture
RANDOM_EDGE = 0.1  # of an edge's step: the least that a verdict admits there, see metrics/admissible.py
QUARTER = 0.25  # of the tolerance: what a prediction may be off by
MOST = 1024  # samples of a pixel of a reference; what they leave open is in its bound


def asked(mean: Floats, lo: Floats, hi: Floats, mixed: Bools, peak: float) -> Floats:
    """The error (h, w, 3) that is admitted of ``mean``, whose samples lie from ``lo`` to ``hi``.

    ``mixed`` (h, w) are the pixels that show an edge; ``peak`` is the picture's brightest value.
    """
    tolerance = RELATIVE * np.abs(mean) + ABSOLUTE * peak
    return np.asarray(QUARTER * (tolerance + RANDOM_EDGE * (hi - lo) * mixed[..., None]))


def seams(lo: Floats, hi: Floats, known: Bools, grid: int) -> Floats:
    """The error (h, w, 3) of means of ``grid`` x ``grid`` regular samples by what lies between neighbouring pixels.

    ``lo`` and ``hi`` are the samples' least and largest values, of the pixels ``known`` (h, w). Where neighbours' ranges
    lie farther apart than twice what an even slope over them leaves between, there may be a step of that height, and
    half a sample's row of a pixel may lie beyond it.
    """
    found = np.zeros_like(lo)
    slope = (hi - lo) / (grid - 1)
    for axis in (0, 1):
        first = tuple(slice(None, -1) if each == axis else slice(None) for each in (0, 1))
        second = tuple(slice(1, None) if each == axis else slice(None) for each in (0, 1))
        apart = np.maximum(lo[second] - hi[first], lo[first] - hi[second])
        apart -= slope[first]
        apart -= slope[second]
        np.maximum(apart, 0.0, out=apart)
        apart *= (known[first] & known[second])[..., None] / (2.0 * grid)
        found[first] += apart
        found[second] += apart
    return found
