"""Step 2 of docs/judge.md, what the seeds agree on: the mean of the pictures and the pooled variance of that mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.metrics.channels import spread
from notabug.metrics.image_filters import weighed
from notabug.metrics.policy import POLICY

Floats = npt.NDArray[np.floating]
SIDE = 2 * POLICY.noise.reach + 1  # pixels, of the square over which variances are pooled


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """The mean of K pictures (h, w, 3), the variance of that mean (h, w, 3), its degrees of freedom, and ``kappa``, by
    which the variance of a tile's mean exceeds that of independent pixels (1 where filters do not spread samples)."""

    mean: Floats
    variance: Floats
    freedom: float
    kappa: float
    seeds: int
    own: Floats | None = None  # (h, w, 3) the variance of the mean that each pixel's own seeds tell
    pictures: tuple[Floats, ...] = ()  # (h, w, 3) every seed's, where they differ
    single: bool = False  # each of the ``pictures`` has one sample a pixel

    @property
    def noisy(self) -> bool:
        return self.seeds > 1


def tiles(values: Floats, side: int = POLICY.noise.tile) -> Floats:
    """Sums of ``values`` (h, w[, c]) over tiles of ``side`` x ``side``, ragged at the right and lower border."""
    for axis in (0, 1):
        strided = [values[(slice(None),) * axis + (slice(start, None, side),)] for start in range(side)]
        values = strided[0].copy()
        for each in strided[1:]:
            values[(slice(None),) * axis + (slice(each.shape[axis]),)] += each
    return values


def in_tiles(which: npt.NDArray[np.bool_], height: int, width: int) -> npt.NDArray[np.bool_]:
    """The pixels (height, width) in the tiles ``which`` (th, tw)."""
    return np.kron(which, np.ones((POLICY.noise.tile, POLICY.noise.tile), np.bool_))[:height, :width]


def pooled(values: Floats) -> Floats:
    """The means of ``values`` (h, w, 3) over the square around each pixel."""
    even = (1.0 / SIDE,) * (POLICY.noise.reach + 1)  # the weights of the middle and of those on either side
    return weighed(weighed(values, even, 0), even, 1)  # a running sum would carry a firefly's rounding along its row


def measure(pictures: Sequence[Floats], edge: npt.NDArray[np.bool_], samples: int = 0) -> Measured:
    """The mean and pooled variance of ``pictures``; at ``edge`` pixels the larger of pooled and own variance.

    ``samples`` are those of a pixel in each picture, 0 where that is unknown.

    Variances are pooled over 5 x 5 pixels, which gives 12.5 (K - 1) degrees of freedom: few seeds often agree exactly
    by chance, and an unpooled variance would then make any residual significant. Filters that spread a sample over
    kappa pixels leave fewer: squares of Gaussians with correlation rho are correlated by rho^2, whose sum over the
    plane is half that of rho, kappa, for a Gaussian filter. All-equal pictures count as one.
    """
    stack = np.stack([np.asarray(picture, np.float32) for picture in pictures])
    mean = stack.mean(axis=0, dtype=np.float64).astype(np.float32)
    seeds = len(stack)
    if all(np.array_equal(each, stack[0]) for each in stack[1:]):
        return Measured(mean, np.zeros_like(mean), np.inf, 1.0, 1)
    off = stack - mean
    own = np.square(off, out=off).sum(axis=0) / (seeds * (seeds - 1))
    around = pooled(own)
    # a value that is far noisier than its 24 neighbours, a firefly, is as noisy as it is: F(K - 1, 24 (K - 1)) beyond
    # ``outlier`` has a chance of 1e-5 at four seeds
    others = (SIDE**2 * around - own) / (SIDE**2 - 1)
    variance = np.where(spread(edge) | (own > POLICY.noise.outlier * others), np.maximum(around, own), around)
    count = tiles(np.ones(mean.shape[:2]))[..., None]
    between = np.stack([tiles(each) for each in stack]).var(axis=0, ddof=1) / seeds / count**2
    within = tiles(own) / count**2
    kappa = max(1.0, float(between.sum() / within.sum())) if within.sum() > 0 else 1.0
    freedom = 0.5 * SIDE**2 * (seeds - 1) / max(1.0, kappa / 2.0)
    return Measured(mean, np.maximum(variance, 0.0), freedom, kappa, seeds, own, tuple(pictures), samples == 1)
