"""Step 7: what an eye makes of a difference: FLIP over a picture, ICtCp's Delta E_ITP on the pixels that differ."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]

WHITE = 100.0  # cd/m^2 shown for the value 1.0
PIXELS_PER_DEGREE = 67.0  # FLIP's default: 0.7 m from a 0.7 m wide display of 3840 pixels
REACH = 10  # pixels that FLIP's filters reach at this density: three standard deviations of the widest


def flip(reference: Floats, test: Floats) -> Floats:
    """LDR-FLIP (h, w) of two linear pictures (h, w, 3) at one fixed exposure: 0 no difference, 1 the largest.

    Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images", HPG; values are clipped to [0, 1].
    Computed only around what differs, since it is zero elsewhere: as far as the filters reach, and what they reach from
    there.
    """
    import flip_evaluator

    pair = [np.clip(each, 0.0, 1.0).astype(np.float32) for each in (reference, test)]
    error = np.zeros(reference.shape[:2])
    different = (pair[0] != pair[1]).any(axis=2)
    if not different.any():
        return error
    part = tuple(
        slice(max(0, places[0] - 2 * REACH), places[-1] + 2 * REACH + 1)
        for places in (np.flatnonzero(different.any(axis=axis)) for axis in (1, 0))
    )
    cut = [np.ascontiguousarray(each[part]) for each in pair]
    found, _, _ = flip_evaluator.evaluate(*cut, "LDR", False, False, False, {"ppd": PIXELS_PER_DEGREE})
    error[part] = np.asarray(found, np.float64).reshape(cut[0].shape[:2])
    return error


def delta_itp(reference: Floats, test: Floats) -> Floats:
    """Delta E_ITP (n,) of linear Rec. 709 colours (n, 3), 1 = just noticeable; ITU-R BT.2124, white at 100 cd/m^2."""
    import colour

    wide = colour.matrix_RGB_to_RGB(colour.RGB_COLOURSPACES["ITU-R BT.709"], colour.RGB_COLOURSPACES["ITU-R BT.2020"])
    coded = [
        colour.RGB_to_ICtCp(np.maximum(np.asarray(each, np.float64) @ wide.T, 0.0) * WHITE)
        for each in (reference, test)
    ]
    return np.asarray(colour.difference.delta_E_ITP(*coded))


def jnd(reference: Floats, test: Floats, mask: npt.NDArray[np.bool_]) -> float:
    """The 95th percentile of Delta E_ITP over the pixels in ``mask`` (h, w); 0 where there are none."""
    if not mask.any():
        return 0.0
    return float(np.percentile(delta_itp(reference[mask], test[mask]), 95))
