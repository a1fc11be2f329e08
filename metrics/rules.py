"""Step 6 of docs/judge.md, what explains it: what the rule of a model admits.

``partial`` admits a segment, ``set`` a mixture, ``hull`` anything between, ``any`` anything at all.

Each rule fits its admissible set to the picture, and says nothing where its structural test fails: a mixture has chance
in it, dots differ from those around them, what surfaces fight over shows on enough of what they share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import MISSED, Admissible, residual
from notabug.metrics.channels import largest, pixels, put, total
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]
Explained = tuple[Admissible, Floats, Bools, float]
"""An admissible set, the share alpha (h, w) of a model in it, its support (h, w), and its freedom."""

MEAN_ALPHA = 0.25  # a partial limitation that fits its pixels by less than this on average is not that limitation
# The same of surfaces that coincide, where that share of what is off lies on the straight way to the other surface: by
# the order of its triangles Mitsuba shows another one than the nearest in a tenth of a pixel's samples.
MEAN_FOUGHT, MOST_BETWEEN = 0.05, 0.9
LEAST_MIXED, MOST_MIXED = 0.0003, 0.97  # mean share of the other values in a mixture
# Beside a point's texel a surface is nearer to the light as often as it is farther, so a shadow map that holds it
# against itself darkens no more than half. Stripes are some pixels wide and long: means over n pixels scatter as if
# there were n / 64.
MOST_STRIPED = 0.5
STRIPED_SCATTER = 8.0  # over the root of the number of pixels: two standard deviations of such a mean
LEAST_TOUCHED = 0.1  # a fault that may do anything, or anywhere, is none that touches less than this of its support
# Nor is one that scatters dots: without an epsilon chance decides at each hit, so half of all samples are wrong.
LEAST_DOTTED = 0.3
# Of what surfaces share to the last bits: renderers show another one at a sixth of it or more. Where depths are so
# coarse that nearly all are equal, one surface is seen but for dots, each by itself: random dots of less than
# LEAST_FOUGHT have none within the 5 x 5 pixels around them in (1 - .02)^24 = .62 of all cases.
LEAST_FOUGHT, LEAST_ALONE = 0.02, 0.5
NOISE = 3.0  # standard errors beyond which a pixel is off
LEAST_GRAIN = 0.01  # root mean square by which shares differ from those around them, where there are dots
ALONE = 0.06  # of the 5 x 5 pixels around a dot: less than two of them
MOST_ALIKE, WIDENED = 0.3, 0.15  # correlation of neighbours' differences; a blot's is above .5, a Gaussian filter's .37


def support(bare: Admissible, other: Admissible) -> Bools:
    """Where (h, w) two admissible sets differ by more than the tolerance."""
    off = np.abs(other.value - bare.value)
    off -= np.maximum(bare.tau, other.tau)
    return np.asarray(largest(off) > 0)


def _segment(measured: Measured, base: Admissible, limited: Admissible) -> Explained:
    """The admissible set between ``base`` and ``limited``: (set, alpha (h, w), support (h, w), freedom)."""
    within = support(base, limited)
    # a picture that is off by as much as the limited one, or a little more, is beyond the tolerance before the support
    # begins: it lies on the segment wherever there is one
    at = np.flatnonzero((limited.value != base.value).any(axis=2))
    start, v, off = (pixels(each, at) for each in (base.value, limited.value, measured.mean))
    v, off = v - start, off - start
    share = _share(off, v)
    # noise and what an edge admits would count as pixels of which the model explains nothing
    beyond = pixels(np.abs(residual(measured.mean, base)) - base.tau - NOISE * np.sqrt(measured.variance), at)
    significant = (largest(beyond) > 0) & within.ravel()[at]
    if significant.any() and float(share[significant].mean()) < MEAN_ALPHA:
        return _nothing(base)
    value = put(base.value, at, start + share[:, None] * v)
    edge = base.edge | limited.edge
    ends = np.flatnonzero(edge)
    target = replace(
        base,
        value=value,
        lo=put(value, ends, np.minimum(pixels(base.lo, ends), pixels(limited.lo, ends))),
        hi=put(value, ends, np.maximum(pixels(base.hi, ends), pixels(limited.hi, ends))),
        tau=put(base.tau, at, np.maximum(pixels(base.tau, at), pixels(limited.tau, at))),
        edge=edge,
    )
    # a pixel's alpha counts by the share of its footprint that the artifact can take, so no filter moves the area
    area = np.zeros(within.shape)
    area.ravel()[at] = share * base.share.ravel()[at]
    length = np.sqrt(total(v * v))[within.ravel()[at]]
    return target, np.where(within, area, 0.0), within, float(length.sum() / within.size)


def _share(off: Floats, v: Floats) -> Floats:
    """How far (n,) along ``v`` (n, 3) the deviations ``off`` (n, 3) lie, 0 .. 1."""
    return np.asarray(np.clip(total(off * v) / np.maximum(total(v * v), 1e-30), 0.0, 1.0))


def _nothing(base: Admissible) -> Explained:
    """What a model explains that does not fit."""
    return base, np.zeros(base.edge.shape), np.zeros(base.edge.shape, np.bool_), 0.0


def _mixture(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set where each sample takes the value of ``base`` or one of ``values``: as in ``_segment``.

    At pixel centres the picture must take one of the values, and so must every seed's that has one sample a pixel;
    where samples are averaged, anything between them.
    """
    within = support(base, values[0])
    for each in values[1:]:
        within |= support(base, each)
    everything = (base, *values)
    value, alpha, never = base.value, np.zeros(within.shape), base.never
    if not base.share_is_point:
        lo = np.minimum.reduce([each.lo for each in everything])
        hi = np.maximum.reduce([each.hi for each in everything])
        taken = np.clip(measured.mean, lo, hi)
        if measured.singles is not None:
            taken, missed = _taken(measured.singles, everything)
            never = within & (missed > np.maximum.reduce([largest(each.tau) for each in everything]))
        value = np.where(within[..., None], taken, base.value)
        off = largest(np.abs(value - base.value))
        reach = largest(np.maximum(hi - base.value, base.value - lo))
        alpha = np.where(within, np.clip(off / np.maximum(reach, 1e-30), 0.0, 1.0), 0.0)
    else:
        distance = total(np.abs(measured.mean - base.value))
        for each in values:
            nearer = total(np.abs(measured.mean - each.value))
            better = within & (nearer < distance)
            value = np.where(better[..., None], each.value, value)
            alpha = np.where(better, 1.0, alpha)
            distance = np.where(better, nearer, distance)
    edge = base.edge | np.logical_or.reduce([each.edge & within for each in values])
    at = (edge & within & (measured.singles is None))[..., None]
    # where one shows the darker half of a pixel's samples and the other the brighter one, all may be bright
    reaches = [each.samples or (each.lo, each.hi) for each in everything]
    lo = np.where(at, np.minimum.reduce([each for each, _ in reaches]), np.where(within[..., None], value, base.lo))
    hi = np.where(at, np.maximum.reduce([each for _, each in reaches]), np.where(within[..., None], value, base.hi))
    tau = np.where(within[..., None], np.maximum.reduce([each.tau for each in everything]), base.tau)
    target = replace(base, value=value, lo=lo, hi=hi, tau=tau, edge=edge, never=never)
    length = np.sqrt(total((values[0].value - base.value) ** 2))
    return target, alpha, within, float(length[within].sum() / within.size)


def _taken(singles: Floats, values: Sequence[Admissible]) -> tuple[Floats, Floats]:
    """The mean (h, w, 3) of the seeds' ``singles`` (n, h, w, 3), each moved to what one sample of the nearest of
    ``values`` may show, and by how much (h, w) the farthest of them is moved."""
    moved, farthest = np.zeros(singles.shape[1:]), np.zeros(singles.shape[1:3])
    for each in singles:
        least = np.full(farthest.shape, np.inf)
        nearest = np.zeros(each.shape)
        for value in values:
            assert value.sampled is not None
            low, high, _ = value.sampled
            missed = MISSED * (high - low)
            inside = np.clip(each, low - missed, high + missed)
            distance = largest(np.abs(each - inside))
            nearest = np.where((distance < least)[..., None], inside, nearest)
            least = np.minimum(distance, least)
        moved += nearest
        farthest = np.maximum(farthest, least)
    return np.asarray(moved / len(singles)), farthest


def _anything(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set where a picture may show anything in the support of ``values``: as in ``_segment``."""
    within = np.logical_or.reduce([support(base, each) for each in values])
    at = within[..., None]
    value = np.where(at, measured.mean, base.value)
    lo, hi = np.where(at, value, base.lo), np.where(at, value, base.hi)
    alpha = (within & (largest(np.abs(measured.mean - base.value) - base.tau) > 0)).astype(np.float64)
    length = float(within.sum())  # more than any list of values has: theirs is a mean over the picture
    return replace(base, value=value, lo=lo, hi=hi), alpha, within, length


def mixed_only(
    explained: Callable[..., Explained], least: float, measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it is a mixture: one value nearly everywhere is a choice, not chance.

    Where it deviates it must do so by a mean share of ``least`` or more.
    """
    found = explained(measured, base, *values)
    _, alpha, within, _ = found
    off = _off(measured, base, within)
    mixed = not within.any() or LEAST_MIXED <= float(alpha[within].mean()) <= MOST_MIXED
    if not mixed or (off.any() and float(alpha[off].mean()) < least):
        return _nothing(base)
    return found


def striped(
    explained: Callable[..., Explained], measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it is stripes: about half of what they may act on lies between them."""
    found = explained(measured, base, *values)
    _, alpha, within, _ = found
    most = MOST_STRIPED + STRIPED_SCATTER / float(np.sqrt(max(1.0, float(within.sum()))))
    return _nothing(base) if within.any() and float(alpha[within].mean()) > most else found


def fought(
    explained: Callable[..., Explained],
    first: Admissible,
    another: Admissible,
    measured: Measured,
    base: Admissible,
    *values: Admissible,
) -> Explained:
    """What ``explained`` admits, if it touches enough of what surfaces share to the last bits, or pixels by themselves.

    There one sees the ``first`` or ``another``; what lies on the straight way between them may be rare in each pixel.
    """
    surely = support(first, another)
    off = _off(measured, base, surely)
    between = _between(measured, base, (another, first), off) > MOST_BETWEEN
    few = surely.any() and np.count_nonzero(off) < LEAST_FOUGHT * np.count_nonzero(surely)
    if few and not (base.share_is_point and between and _by_themselves(off)):
        return _nothing(base)
    return mixed_only(explained, MEAN_FOUGHT if between else MEAN_ALPHA, measured, base, *values)


def _by_themselves(off: Bools) -> bool:
    """Whether most of the pixels ``off`` (h, w) have no other of them near."""
    from scipy import ndimage

    around = ndimage.uniform_filter(off.astype(np.float64), 5, mode="constant")
    return bool(off.any()) and float((around[off] < ALONE).mean()) >= LEAST_ALONE


def _off(measured: Measured, base: Admissible, within: Bools) -> Bools:
    """Where, ``within`` (h, w), a picture is off by more than the tolerance and its noise."""
    beyond = np.abs(measured.mean - base.value) - base.tau - NOISE * np.sqrt(measured.variance)
    return within & (largest(beyond) > 0)


def _between(measured: Measured, base: Admissible, values: Sequence[Admissible], off: Bools) -> float:
    """The share of the pixels ``off`` (h, w) that lie on the straight way from ``base`` to one of ``values``."""
    at = np.flatnonzero(off)
    if not at.size:
        return 0.0
    start, slack = pixels(base.value, at), pixels(base.tau, at) + NOISE * np.sqrt(pixels(measured.variance, at))
    away = pixels(measured.mean, at) - start
    found = np.zeros(at.size, np.bool_)
    for each in values:
        v = pixels(each.value, at) - start
        found |= largest(np.abs(away - _share(away, v)[:, None] * v) - slack) <= 0
    return float(found.mean())


def grained(
    explained: Callable[..., Explained], shares: bool, measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it is dots: shares alpha that differ from those around them, each by itself.

    A half-dark band, a black blot and another light are no acne. In a mean over many samples dots are small deviations,
    but still deviations; in blots neighbours deviate alike, and under another light half of all pixels do as those
    around them. Where alpha holds no ``shares``, only 0 and 1, the relative deviation is the share.
    """
    from scipy import ndimage

    found = explained(measured, base, *values)
    _, alpha, within, _ = found
    if not shares:
        bright = np.maximum(largest(np.abs(base.value)), largest(base.tau))
        alpha = np.where(within, np.minimum(largest(np.abs(measured.mean - base.value)) / bright, 1.0), 0.0)
    count = np.maximum(ndimage.uniform_filter(within.astype(np.float64), 5, mode="constant"), 1e-9)
    around = ndimage.uniform_filter(alpha * within, 5, mode="constant") / count
    around[count < ALONE] = 0.0  # a dot by itself differs from what is around it by all of its share
    off = np.where(within, alpha - around, 0.0)
    power = float((off**2).sum())
    dots = np.abs(off[_off(measured, base, within)])
    rough = not dots.size or float(np.median(dots)) > LEAST_GRAIN
    if not rough or power <= LEAST_GRAIN**2 * float((within & (alpha > 0)).sum()):
        return _nothing(base)
    alike = 0.5 * float((off[:, 1:] * off[:, :-1]).sum() + (off[1:] * off[:-1]).sum())
    if alike > (MOST_ALIKE + (WIDENED if base.widened else 0.0)) * power:
        return _nothing(base)
    return found


def widespread(
    explained: Callable[..., Explained], least: float, measured: Measured, base: Admissible, *values: Admissible
) -> Explained:
    """What ``explained`` admits, if it touches ``least`` of its support or more: few wrong pixels are no wrong rule."""
    found = explained(measured, base, *values)
    _, _, within, _ = found
    if within.any() and float(_off(measured, base, within).sum()) < least * float(within.sum()):
        return _nothing(base)
    return found


def _hull(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set of anything between the least and the most of ``base`` and ``values``: as in ``_segment``."""
    target, alpha, within, length = _mixture(measured, replace(base, share_is_point=False), *values)
    return replace(target, share_is_point=base.share_is_point), alpha, within, length


def stretched(
    measured: Measured,
    predict: Callable[[tuple[Model, ...]], Admissible],
    chosen: tuple[Model, ...],
    hulls: Sequence[Model],
) -> Admissible:
    """What ``chosen`` admit, and all that is as near to it as ``hulls`` reach: they move whatever surface is seen."""
    shown = predict(chosen)
    for each in hulls:
        shown, *_ = _hull(measured, shown, *(predict((*chosen, value)) for value in each.values()))
    return shown


RULES: dict[str, Callable[..., Explained]] = {
    "set": _mixture,
    "partial": _segment,
    "hull": _hull,
    "any": _anything,
}
