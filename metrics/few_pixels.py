"""Step 5 of docs/judge.md, the whole picture: the gain of one in which too few pixels are lit and smooth.

Such pictures show small objects, thin wires, or a highlight alone.

Two estimates are made. The ``peak`` is the median ratio of the smooth pixels, where there are some: exact, but a wider
pixel filter lowers it too. The ``flux`` is the ratio of the sums over all lit pixels: no filter changes a sum, but the
samples that fall beside an edge do. A gain that both show is one, and so is a flux that no edges could make.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import total
from notabug.metrics.formulas import DEVIATION
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.references.tracer.precision import RELATIVE

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class FewGain:
    """A gain, its standard error, and the part of that which is noise; ``many`` pixels leave no gain open."""

    gain: float = 1.0
    error: float = 0.0
    noise: float = 0.0
    many: bool = False

    @property
    def open(self) -> bool:
        """Whether there may be a gain that nobody can tell."""
        return (
            not self.many
            and abs(self.gain - 1.0) > POLICY.few_pixels.untold + POLICY.few_pixels.large_slack * self.noise
        )


def few_gain(measured: Measured, to: Admissible, excluded: Bools, channels: slice, least: float) -> FewGain:
    """The gain of ``channels`` of a picture with few pixels; ``least`` is the value from which on a pixel is lit."""
    every = to.value[..., channels].max(axis=2) > least
    lit = every & ~excluded
    if not lit.any() or lit.sum() < POLICY.few_pixels.mostly * every.sum():
        return FewGain()
    x, y = (np.asarray(each[lit][:, channels].sum(axis=1), np.float64) for each in (to.value, measured.mean))
    edge = to.edge[lit]
    light = float(x.sum())
    if light <= 0.0:
        return FewGain()
    variance = np.asarray(measured.variance[lit][:, channels].sum(axis=1), np.float64) * (
        channels.stop - channels.start
    )
    noise = float(np.sqrt(measured.kappa * variance.sum())) / light
    flux = float(y.sum()) / light
    slack = _slack(to)[lit][:, channels].sum(axis=1) / POLICY.few_pixels.large_slack
    error = float(np.hypot(_of_edges(y - flux * x, slack, _coverage(to, lit)) / light, noise))
    smooth = ~edge & (x > 0)
    if np.count_nonzero(smooth) >= POLICY.regression.enough:
        ratio = y[smooth] / x[smooth]
        peak = float(np.median(ratio))
        scatter = DEVIATION * float(np.median(np.abs(ratio - peak)))
        if (flux - 1.0) / (peak - 1.0 or np.inf) >= POLICY.few_pixels.support:
            rounding = float(to.tau.min()) * (channels.stop - channels.start) / float(np.median(x[smooth]))
            return FewGain(peak, scatter / np.sqrt(ratio.size) + noise + rounding / POLICY.few_pixels.rounded, noise)
    return FewGain(flux, error, noise)


def _slack(to: Admissible) -> Floats:
    """By how much samples may be off (h, w, 3): what lies beside an edge; elsewhere what fine texture hides from them.

    That is what a pixel's tolerance has beyond the least one and the share of its value that every pixel has.
    """
    hidden = np.maximum(to.tau - RELATIVE * to.value - to.tau.min(), 0.0)
    return np.where(to.edge[..., None], np.maximum(to.hi - to.value, to.value - to.lo), hidden)


def _of_edges(off: Floats, slack: Floats, coverage: npt.NDArray[np.integer]) -> float:
    """What samples beside edges do to the sum: one standard deviation. Pixels of one coverage are all off alike.

    ``slack`` (n,) is that of each pixel, ``off`` (n,) what is left of it under the gain.
    """
    at = slack > 0
    if not at.any():
        return 0.0
    steps, place = np.unique(coverage[at], return_inverse=True)
    alike = np.bincount(place.ravel(), weights=slack[at])
    scatter = 1.0
    if steps.size >= POLICY.few_pixels.few_steps:
        scatter = max(POLICY.few_pixels.least_scatter, min(1.0, float(np.sqrt(np.mean((off[at] / slack[at]) ** 2)))))
    return scatter * float(np.sqrt((alike**2).sum()))


def _coverage(to: Admissible, lit: Bools) -> npt.NDArray[np.integer]:
    """A number (n,) for what share of a lit pixel its brighter part has."""
    lo, hi = to.samples or (to.lo, to.hi)
    low, high, value = (total(each)[lit] for each in (lo, hi, to.value))
    share = (value - low) / np.maximum(high - low, 1e-30)
    return np.asarray(np.floor(np.clip(share, 0.0, 1.0) * POLICY.few_pixels.steps), np.int64)
