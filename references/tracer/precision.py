"""How exact the mean over a pixel has to be, and which pixels need more samples for it.

A verdict admits RELATIVE of a value and ABSOLUTE of the picture's brightest one, and more at edges. What is predicted
may be off by a QUARTER of that. Estimates of the error come with the samples (references/native/error.h); of what lies
between the outermost samples and the border of a pixel those beside it tell (``steps``).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]

RELATIVE = 0.004  # the default tolerance of a verdict
ABSOLUTE = 5e-4  # of the brightest value of the picture
# Of an edge's step: the least that a verdict admits there, of the mean of random samples, as their noise allows for the
# rest. In 3,780 clean pictures of the tuning split 0.05 gave 47 false alarms, all at 64 samples or more.
RANDOM_EDGE = 0.1
QUARTER = 0.25  # of the tolerance: what a prediction may be off by
BENT = 1.25  # of an even slope: how much more a pixel's neighbour may change before it is a step
# Of a step, over the number of samples: what a lattice misjudges of a part of the pixel, a corner that no sample sees
# or an edge that several lie along. Measured: 1.9, where the horizon crosses stripes as fine as a pixel.
CORNER = 2.0
# Of an edge's step, over the square root of the number of samples: the most that a lattice misjudges of the part of a
# pixel to one side of a straight edge. The worst of all directions and places is .63, .71 and .82 for 64, 256 and 1,024
# samples, along rows of points that lie far from the next ones: there CORNER, which most edges keep to, is no bound.
SLANTED = 0.83
MOST = 1024  # samples of a pixel of a reference; what they leave open is in its bound


def asked(mean: Floats, span: Floats, edge: Bools, peak: float) -> Floats:
    """The error (h, w, 3) that is admitted of ``mean``; ``peak`` is the picture's brightest value.

    ``edge`` (h, w) are the pixels at edges, where ``span`` is the step (see ``around``).
    """
    tolerance = RELATIVE * np.abs(mean) + ABSOLUTE * peak
    return np.asarray(QUARTER * (tolerance + RANDOM_EDGE * span * edge[..., None]))


def around(lo: Floats, hi: Floats) -> Floats:
    """The range (h, w, 3) of the values in each pixel and those beside it, whose own lie from ``lo`` to ``hi``."""
    for axis in (0, 1):
        low, high = lo.copy(), hi.copy()
        for here, there in _neighbours(axis):
            np.minimum(low[here], lo[there], out=low[here])
            np.maximum(high[here], hi[there], out=high[here])
        lo, hi = low, high
    return np.asarray(hi - lo)


def steps(lo: Floats, hi: Floats, known: Bools, grid: int) -> Floats:
    """By how much (h, w, 3) what lies beside a pixel reaches beyond the values of its own ``grid`` x ``grid`` samples.

    ``lo`` and ``hi`` are the least and largest of those, of the pixels ``known`` (h, w). Along an even slope the next
    pixel reaches beyond by what the slope changes over a pixel: BENT times that is left out. What is left may lie
    between the pixel's border and its outermost samples, where none of them sees it.
    """
    found = np.zeros_like(lo)
    for axis in (0, 1):
        for here, there in _neighbours(axis):
            beyond = np.maximum(hi[there] - hi[here], lo[here] - lo[there])
            beyond *= (known[here] & known[there])[..., None]
            np.maximum(found[here], beyond, out=found[here])
    return np.maximum(found - BENT * grid / (grid - 1) * (hi - lo), 0.0)


def bends(mean: Floats, known: Bools, grid: int) -> Floats:
    """The error (h, w, 3) of means of ``grid`` x ``grid`` samples by bends that no sample sees.

    A slope that changes by c between the outermost samples and the border moves the mean by at most c / 8 grid^2; it
    shows in the second difference of the means of ``known`` pixels (h, w), by c / 2.
    """
    found = np.zeros_like(mean)
    for axis in (0, 1):
        lead = (slice(None),) * axis
        before, here, after = ((*lead, each) for each in (slice(None, -2), slice(1, -1), slice(2, None)))
        bend = np.abs(mean[before] - 2.0 * mean[here] + mean[after])
        bend *= (known[before] & known[here] & known[after])[..., None] / (4.0 * grid * grid)
        np.maximum(found[here], bend, out=found[here])
    return found


def _neighbours(axis: int) -> list[tuple[tuple[slice, ...], tuple[slice, ...]]]:
    """The pixels of a picture that have a neighbour along ``axis``, and those neighbours: behind, and before."""
    lead = (slice(None),) * axis
    first, second = (*lead, slice(None, -1)), (*lead, slice(1, None))
    return [(first, second), (second, first)]
