"""Step 9 of docs/judge.md, would an eye see it: FLIP over a picture, ICtCp's Delta E_ITP on pixels that differ."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.metrics.policy import POLICY

Floats = npt.NDArray[np.floating]


def _to_xyz(*chromaticities: tuple[float, float]) -> npt.NDArray[np.float64]:
    """The matrix to XYZ (3, 3) of a red, a green and a blue (x, y) that make the white D65 when they are alike."""
    columns = np.array([(x / y, 1.0, (1.0 - x - y) / y) for x, y in (*chromaticities, (0.3127, 0.3290))]).T
    return np.asarray(columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3]))


# Linear Rec. 709 to Rec. 2020, from the primaries of ITU-R BT.709 and BT.2020; BT.2087 rounds it to four digits.
_TO_2020 = np.linalg.solve(
    _to_xyz((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)), _to_xyz((0.640, 0.330), (0.300, 0.600), (0.150, 0.060))
)
# ITU-R BT.2100: Rec. 2020 to the cones' responses, and from those, quantised, to ICtCp.
_TO_LMS = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096.0
_TO_ICTCP = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096.0
# SMPTE ST 2084: the perceptual quantiser, up to 10,000 cd/m^2.
_PEAK, _M1, _M2 = 10000.0, 2610 / 16384, 2523 / 4096 * 128
_C1, _C2, _C3 = 3424 / 4096, 2413 / 4096 * 32, 2392 / 4096 * 32


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
        slice(max(0, places[0] - 2 * POLICY.perceive.reach), places[-1] + 2 * POLICY.perceive.reach + 1)
        for places in (np.flatnonzero(different.any(axis=axis)) for axis in (1, 0))
    )
    cut = [np.ascontiguousarray(each[part]) for each in pair]
    found, _, _ = flip_evaluator.evaluate(*cut, "LDR", False, False, False, {"ppd": POLICY.perceive.pixels_per_degree})
    error[part] = np.asarray(found, np.float64).reshape(cut[0].shape[:2])
    return error


def delta_itp(reference: Floats, test: Floats) -> Floats:
    """Delta E_ITP (n,) of linear Rec. 709 colours (n, 3), 1 = just noticeable; ITU-R BT.2124, white at 100 cd/m^2."""
    intensity, tritan, protan = np.moveaxis(ictcp(reference) - ictcp(test), -1, 0)
    return np.asarray(720.0 * np.sqrt(intensity**2 + (0.5 * tritan) ** 2 + protan**2))


def ictcp(colours: Floats) -> npt.NDArray[np.float64]:
    """ICtCp (n, 3) of linear Rec. 709 colours (n, 3), by the perceptual quantiser of SMPTE ST 2084; ITU-R BT.2100."""
    # of inf / inf nothing is known
    linear = np.clip(np.asarray(colours, np.float64) @ _TO_2020.T, 0.0, POLICY.image_checks.largest)
    wide = linear * POLICY.perceive.white
    power = (wide @ _TO_LMS.T / _PEAK) ** _M1
    return np.asarray(((_C1 + _C2 * power) / (1.0 + _C3 * power)) ** _M2 @ _TO_ICTCP.T)


def jnd(reference: Floats, test: Floats, mask: npt.NDArray[np.bool_]) -> float:
    """The 95th percentile of Delta E_ITP over the pixels in ``mask`` (h, w); 0 where there are none."""
    if not mask.any():
        return 0.0
    return float(np.percentile(delta_itp(reference[mask], test[mask]), 95))
