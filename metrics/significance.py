"""Step 4 of docs/judge.md, what deviates: the pixels and tiles that are off by more than tolerance and noise allow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import largest, spread
from notabug.metrics.excused import crowded, excused
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured, tiles
from notabug.metrics.policy import POLICY

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Significance:
    """Significant pixels (h, w), tiles (th, tw), and ``z`` (h, w): |residual| beyond tolerance in standard errors, or
    in tolerances when there is no noise."""

    pixels: Bools
    tiles: Bools
    z: Floats
    excess: float  # sum over significant pixels and tiles of the residual beyond tolerance: the length of a bug leg
    wrong: int  # significant pixels that neither last bits at edges nor false discoveries make

    @property
    def severity(self) -> float:
        """From 1 on it is a bug."""
        excused = np.count_nonzero(self.pixels) - self.wrong
        return max(float(self.wrong), float(self.tiles.sum()), excused / (excused + 1.0))

    @property
    def triggers(self) -> tuple[str, ...]:
        found = []
        if self.wrong:
            found.append("pixels")
        if self.tiles.any():
            found.append("tile")
        return tuple(found)


def discoveries(p: Floats, rate: float = POLICY.significance.rate) -> Bools:
    """Which of the p-values are discoveries at the false discovery rate ``rate``; the shape of ``p``."""
    low = np.sort(p[p <= rate])
    under = np.flatnonzero(low <= rate * np.arange(1, low.size + 1) / p.size)
    if not under.size:
        return np.zeros(p.shape, np.bool_)
    return np.asarray(p <= low[under[-1]])


def significance(residual: Floats, measured: Measured, to: Admissible) -> Significance:
    """Test the residual (h, w, 3) pixel by pixel and tile by tile."""
    size = np.abs(residual)
    beyond = size - to.tau
    excess = np.maximum(largest(beyond), 0.0)
    if not measured.noisy:
        z = largest(np.divide(size, to.tau, out=size))
        pixels = excess > 0
        right = np.zeros_like(pixels)
        tile, faint = np.zeros(1, np.bool_), 0.0
    else:
        error = np.maximum(np.sqrt(measured.variance), POLICY.significance.floor * to.tau)
        z = np.maximum(largest(beyond / error), 0.0)
        chance = _chance(z, measured.freedom)
        pixels = discoveries(chance)
        right = _false(pixels, chance)
        if to.never is not None:
            pixels = pixels | to.never
            excess = np.where(to.never, np.maximum(excess, largest(to.tau)), excess)
        tile, faint = _tiles(residual, measured, to, pixels)
    wrong = pixels & ~right
    wrong &= ~excused(wrong, measured.mean, to)
    return Significance(pixels, tile, z, float(excess[pixels].sum()) + faint, int(np.count_nonzero(wrong)))


def _false(pixels: Bools, chance: Floats) -> Bools:
    """Those of the significant ``pixels`` (h, w) that may be false discoveries: few, apart, and none is certain."""
    found = pixels & (chance * chance.size > POLICY.significance.certain) & ~crowded(pixels)
    return found if np.count_nonzero(found) <= POLICY.significance.false else np.zeros_like(found)


def _tiles(residual: Floats, measured: Measured, to: Admissible, pixels: Bools) -> tuple[Bools, float]:
    """Tiles whose mean residual is faint in every pixel and yet beyond tolerance and noise, and their excess.

    The smooth pixels of a tile and those of its edges are tested apart, and so are the small tiles in it, since what a
    fault does to the facets of a mesh may cancel over a large one. At an edge a right value may lie at the end of what
    is admitted, and noise alone drives it out, by `significance.outward` standard errors on average. Significant
    ``pixels`` (h, w) are left out there, a few of which are excused.
    """
    found, faint = np.zeros(1, np.bool_), 0.0
    outward = POLICY.significance.outward * np.sqrt(measured.variance)
    for part, allowed in ((~to.edge, to.tau), (to.edge & ~pixels, to.tau + outward)):
        of = spread(part)
        summed = (part.astype(float), of * residual, of * allowed, of * measured.variance)
        side_small, side_large = POLICY.significance.small, POLICY.noise.tile
        small = [tiles(each, side_small) for each in summed]
        large = [tiles(each, side_large // side_small) for each in small]
        for side, sums in ((side_small, small), (side_large, large)):
            wrong, excess = _faint(sums, measured, side)
            if side == POLICY.significance.small:
                wrong = tiles(wrong.astype(int), POLICY.noise.tile // POLICY.significance.small) > 0
            found, faint = found | wrong, faint + excess
    return found, faint


def _faint(sums: Sequence[Floats], measured: Measured, side: int) -> tuple[Bools, float]:
    """Tiles of ``side`` pixels whose mean residual exceeds the mean that is allowed, and their excess.

    ``sums`` over each tile are its number of pixels (th, tw), and the residual, what is allowed and the variance, (th,
    tw, 3).
    """
    pixels, residual, allowed, variance = sums
    count = np.maximum(pixels, 1.0)[..., None]
    mean, tau = np.abs(residual) / count, allowed / count
    error = np.sqrt(measured.kappa * variance) / count
    beyond = np.maximum(mean - tau, 0.0)
    z = largest(beyond / np.maximum(error, POLICY.significance.floor * np.maximum(tau, 1e-30)))
    # large tiles give kappa, were the channels' noise the same; a small one has no more than its pixels have
    freedom = pixels.size * (measured.seeds - 1) if side == POLICY.noise.tile else measured.freedom
    fewest = POLICY.significance.fewest if side == POLICY.noise.tile else side * side // 2  # or a tile tells nothing
    wrong = discoveries(np.where(pixels >= fewest, _chance(z, freedom), 1.0))
    return wrong, float(largest(beyond * count)[wrong].sum())


def _chance(z: Floats, freedom: float) -> Floats:
    """The chance of ``z``, the largest of three channels two-sided, under no more than noise; where it is zero, 1."""
    from scipy import special

    chance = np.ones(z.shape)
    beyond = z > 0
    chance[beyond] = np.minimum(1.0, 2 * 3 * special.stdtr(freedom, -z[beyond]))
    return chance
