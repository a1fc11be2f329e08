"""Step 4 of docs/judge.md, what deviates: which wrong pixels mean nothing.

They are few single ones beside edges, where last bits decide what a ray meets.

Where a subsample saw both sides of an edge the pixel's own interval admits either. What is left are edges that no id
tells, of facets and in mirrors, and shadow rays that leave a silhouette: a ray slips out between two facets, or meets
the next one, so that a pixel is dark where it should be lit, or lit by a light that is blocked there. Such a pixel is
no brighter than what lies around it, of many samples one or two are astray, it lies alone, and it is rare.

Chance makes no groups. Let N pixels lie along edges, each wrong by itself with a chance r (`excused.rate` in the
policy). A group of three that touch has 20 shapes, so there are about 20 N r^3 of them: for N = 400 one picture in
1,000. So three or more that touch, a contact shadow or a triangle of four pixels, are a bug. There are 4 N r^2 pairs,
one in 25 pictures.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import spread
from notabug.metrics.image_filters import Bools, extreme, widened
from notabug.metrics.policy import POLICY

Floats = npt.NDArray[np.floating]

TOUCHING = np.ones((3, 3))  # pixels touch along sides and at corners


def most(edges: int) -> int:
    """How many of ``edges`` pixels along edges may be wrong by chance: Poisson's quantile, and ``budget`` at most."""
    from scipy import special

    numbers = POLICY.excused
    chance_of_more = (special.gammainc(n + 1, numbers.rate * edges) for n in range(numbers.budget))
    return next((n for n, chance in enumerate(chance_of_more) if chance < numbers.sure), numbers.budget)


def excused(wrong: Bools, mean: Floats, to: Admissible) -> Bools:
    """Those of the ``wrong`` pixels (h, w) of the picture ``mean`` that last bits may have made; none if too many."""
    found = wrong & widened(to.edge, POLICY.excused.near)
    if to.exact is not None:
        found &= ~to.exact
    if found.any():
        found &= ~crowded(wrong)
    if not 0 < np.count_nonzero(found) <= most(int(np.count_nonzero(to.edge))):
        return np.zeros_like(found)
    return found & _usual(wrong, mean, to)


def crowded(wrong: Bools) -> Bools:
    """Those of the ``wrong`` pixels (h, w) that touch more others than last bits decide on."""
    from scipy import ndimage

    labels, _ = ndimage.label(wrong, TOUCHING)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(sizes[labels] > POLICY.excused.pair)


def _usual(wrong: Bools, mean: Floats, to: Admissible) -> Bools:
    """Where (h, w) ``mean`` is off by no more than stray samples weigh, and no brighter than pixels around may be."""
    high = np.where(spread(wrong), to.hi, np.maximum(to.hi, mean))
    for _ in range(POLICY.excused.around):
        high = extreme(high, np.maximum)
    off = np.abs(residual(mean, to))
    return np.asarray(((mean <= high + to.tau) & (off <= to.stray * high + to.tau)).all(axis=2))
