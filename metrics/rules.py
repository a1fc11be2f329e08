"""Step 6 of docs/judge.md, what explains it: what the rule of a model admits.

``partial`` admits a segment, ``set`` a mixture, ``hull`` anything between, ``any`` anything at all. A rule fits its
admissible set to a picture; structure.py says what the picture must show besides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import largest, pixels, put, total
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict
from notabug.references.models.model import Model

Floats = npt.NDArray[np.floating]
Explained = tuple[Admissible, Floats, Bools, float]
"""An admissible set, the share alpha (h, w) of a model in it, its support (h, w), and its freedom."""


def support(bare: Admissible, other: Admissible, *, own: bool = False) -> Bools:
    """Where (h, w) two admissible sets differ by more than the tolerance: the larger one, or ``bare``'s ``own``."""
    off = np.abs(other.value - bare.value)
    off -= bare.tau if own else np.maximum(bare.tau, other.tau)
    return np.asarray(largest(off) > 0)


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """A ``model`` that is no choice, fitted to a picture on top of what others admit, ``base``.

    ``chosen`` are the choices beside it, and ``hulls`` what moves every surface that is seen.
    """

    measured: Measured
    base: Admissible
    model: Model
    chosen: tuple[Model, ...]
    hulls: tuple[Model, ...]
    predict: Predict

    def shown(self, chosen: tuple[Model, ...]) -> Admissible:
        """What ``chosen`` admit, and all that is as near to it as hulls reach: they move whatever surface is seen."""
        admitted = self.predict(chosen)
        for hull in self.hulls:
            values = [self.predict((*chosen, value)) for value in hull.values()]
            admitted, *_ = _hull(self.measured, admitted, *values)
        return admitted

    def values(self) -> tuple[Admissible, ...]:
        """What each value of the model admits."""
        return tuple(self.shown((*self.chosen, value)) for value in self.model.values())

    def off(self, within: Bools) -> Bools:
        """Where, ``within`` (h, w), the picture is off by more than the tolerance and its noise."""
        noise = POLICY.rules.noise * np.sqrt(self.measured.variance)
        return within & (largest(np.abs(self.measured.mean - self.base.value) - self.base.tau - noise) > 0)


def _segment(measured: Measured, base: Admissible, limited: Admissible) -> Explained:
    """The admissible set between ``base`` and ``limited``: (set, alpha (h, w), support (h, w), freedom)."""
    within = support(base, limited)
    # a picture that is off by as much as the limited one, or a little more, is beyond the tolerance before the support
    # begins: it lies on the segment wherever there is one
    at = np.flatnonzero((limited.value != base.value).any(axis=2))
    start, v, off = (pixels(each, at) for each in (base.value, limited.value, measured.mean))
    v, off = v - start, off - start
    share = share_of(off, v)
    # noise and what an edge admits would count as pixels of which the model explains nothing
    beyond = pixels(
        np.abs(residual(measured.mean, base)) - base.tau - POLICY.rules.noise * np.sqrt(measured.variance), at
    )
    significant = (largest(beyond) > 0) & within.ravel()[at]
    if significant.any() and float(share[significant].mean()) < POLICY.rules.mean_alpha:
        return nothing(base)
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


def share_of(off: Floats, v: Floats) -> Floats:
    """How far (n,) along ``v`` (n, 3) the deviations ``off`` (n, 3) lie, 0 .. 1."""
    return np.asarray(np.clip(total(off * v) / np.maximum(total(v * v), 1e-30), 0.0, 1.0))


def nothing(base: Admissible) -> Explained:
    """What a model explains that does not fit."""
    return base, np.zeros(base.edge.shape), np.zeros(base.edge.shape, np.bool_), 0.0


def _mixture(measured: Measured, base: Admissible, *values: Admissible, own: bool = False) -> Explained:
    """The admissible set where each sample takes the value of ``base`` or one of ``values``: as in ``_segment``.

    At pixel centres the picture must take one of the values, and so must every seed's that has one sample a pixel;
    where samples are averaged, anything between them. ``own``: see ``support``.
    """
    within = support(base, values[0], own=own)
    for each in values[1:]:
        within |= support(base, each, own=own)
    everything = (base, *values)
    value, alpha, never = base.value, np.zeros(within.shape), base.never
    if not base.share_is_point:
        lo = np.minimum.reduce([each.lo for each in everything])
        hi = np.maximum.reduce([each.hi for each in everything])
        taken = np.clip(measured.mean, lo, hi)
        if measured.single:
            taken, missed = _taken(measured.pictures, everything)
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
    at = (edge & within & (not measured.single))[..., None]
    # where one shows the darker half of a pixel's samples and the other the brighter one, all may be bright
    reaches = [each.samples or (each.lo, each.hi) for each in everything]
    lo = np.where(at, np.minimum.reduce([each for each, _ in reaches]), np.where(within[..., None], value, base.lo))
    hi = np.where(at, np.maximum.reduce([each for _, each in reaches]), np.where(within[..., None], value, base.hi))
    tau = np.where(within[..., None], np.maximum.reduce([each.tau for each in everything]), base.tau)
    target = replace(base, value=value, lo=lo, hi=hi, tau=tau, edge=edge, never=never)
    length = np.sqrt(total((values[0].value - base.value) ** 2))
    return target, alpha, within, float(length[within].sum() / within.size)


def _taken(pictures: Sequence[Floats], values: Sequence[Admissible]) -> tuple[Floats, Floats]:
    """The mean (h, w, 3) of the seeds' ``pictures``, each moved to what one sample of the nearest of ``values`` may
    show, and by how much (h, w) the farthest of them is moved."""
    moved, farthest = np.zeros(pictures[0].shape), np.zeros(pictures[0].shape[:2])
    for picture in pictures:
        single = np.asarray(picture, np.float32)
        least = np.full(farthest.shape, np.inf)
        nearest = np.zeros(single.shape)
        for value in values:
            assert value.sampled is not None
            low, high, _ = value.sampled
            missed = POLICY.admissible.missed * (high - low)
            inside = np.clip(single, low - missed, high + missed)
            distance = largest(np.abs(single - inside))
            nearest = np.where((distance < least)[..., None], inside, nearest)
            least = np.minimum(distance, least)
        moved += nearest
        farthest = np.maximum(farthest, least)
    return np.asarray(moved / len(pictures)), farthest


def _anything(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set where a picture may show anything in the support of ``values``: as in ``_segment``."""
    within = np.logical_or.reduce([support(base, each) for each in values])
    at = within[..., None]
    value = np.where(at, measured.mean, base.value)
    lo, hi = np.where(at, value, base.lo), np.where(at, value, base.hi)
    alpha = (within & (largest(np.abs(measured.mean - base.value) - base.tau) > 0)).astype(np.float64)
    length = float(within.sum())  # more than any list of values has: theirs is a mean over the picture
    return replace(base, value=value, lo=lo, hi=hi), alpha, within, length


def _hull(measured: Measured, base: Admissible, *values: Admissible) -> Explained:
    """The admissible set of anything between the least and the most of ``base`` and ``values``: as in ``_segment``.

    A value that is brighter has a larger tolerance: what is off by more than the base's own, and less than that, is
    between them as well.
    """
    target, alpha, within, length = _mixture(measured, replace(base, share_is_point=False), *values, own=True)
    return replace(target, share_is_point=base.share_is_point), alpha, within, length


RULES: Mapping[str, Callable[..., Explained]] = {
    "set": _mixture,
    "partial": _segment,
    "hull": _hull,
    "any": _anything,
}
