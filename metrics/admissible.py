"""Step 3 of docs/judge.md, what is admitted: the values that a hypothesis admits at each pixel, and its tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.channels import largest, pixels, put
from notabug.metrics.formulas import BOX_VARIANCE, gaussian_variance, most_variance, tent_variance
from notabug.metrics.image_checks import finite
from notabug.metrics.image_filters import Bools, extreme, laplacian, weighed, widened
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.references.tracer.envelope import Envelope, changes
from notabug.references.tracer.precision import ABSOLUTE, BENT, RANDOM_EDGE, RELATIVE

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Admissible:
    """One fixed picture with its slack: (h, w, 3) ``value``, ``lo`` <= ``value`` <= ``hi``, ``tau``; (h, w) ``edge``.

    Off the edges lo = value = hi, and a picture may differ from it by the tolerance ``tau``. At edges, where a sample
    that falls a thousandth of a pixel beside ours may see another surface, anything from lo to hi is admitted.
    """

    value: Floats
    lo: Floats
    hi: Floats
    tau: Floats
    edge: Bools
    share: Floats  # (h, w) share of the footprint that was spared facet self-shadow: see Envelope.spared
    share_is_point: bool = False  # one sample a pixel, at its centre
    widened: float = 0.0  # by how much the filter's variance exceeds that of the pixel
    samples: tuple[Floats, Floats] | None = None  # (h, w, 3) least and most of single samples, where lo, hi are nearer
    sampled: tuple[Floats, Floats, Floats] | None = None  # least and most of one random sample, and its variance
    never: Bools | None = None  # (h, w) where a single sample of some seed shows what none can
    # of a renderer with random samples (see at_random):
    missed: Floats | None = None  # (h, w, 3) the part of ``tau`` that stands for what subsamples may miss
    inner: Bools | None = None  # (h, w) pixels that no edge crosses, though one may be next to them
    exact: Bools | None = None  # (h, w) those of them whose samples a second look knows, so that none is astray
    stray: float = 1.0  # share of a pixel's samples that last bits may lead astray


def reckonable(envelope: Envelope) -> bool:
    """Whether a picture can be held against ``envelope``: a NaN or an infinity would win or hide every comparison."""
    return all(bool(finite(each).all()) for each in (envelope.point, envelope.mean, envelope.lo, envelope.hi))


def admissible(
    envelope: Envelope,
    declaration: Declaration,
    tolerance: float = RELATIVE,
    peak: float = math.inf,
    leeway: Floats | None = None,
    fine: Bools | None = None,
    unsure: Floats | None = None,
) -> Admissible:
    """What ``envelope`` admits for pictures of a renderer that declares its pixel filter and its output's precision.

    ``peak`` is the brightest value of the reference: a hypothesis with a brighter one is given no wider tolerance for
    it everywhere else. ``leeway`` (h, w, 3) is by how much the edges of shadows may be lit; None: not at all.
    ``unsure`` (h, w, 3) is by how much values at centres may be off; None: by rounding alone. At the pixels ``fine``
    (h, w) the envelope is as exact as its bound says, and the pictures' own samples are random: what those miss is
    noise.
    """
    point = declaration.filter == "point"
    value: Floats = envelope.point if point else envelope.mean
    reach = math.ceil(declaration.radius)
    inner = ~(envelope.edge | edges(envelope, reach, cast=True)) if at_random(declaration) else None
    edge = edges(envelope, reach)
    exact = None if fine is None or inner is None else fine & inner
    if exact is not None:
        edge &= ~exact
    lo: Floats = envelope.lo
    hi: Floats = envelope.hi
    for _ in range(reach):
        lo, hi = extreme(lo, np.minimum), extreme(hi, np.maximum)
    reach_of_filter = widening(declaration)
    if reach_of_filter:
        value = filtered(value, reach_of_filter)
    if math.isfinite(declaration.white):
        value, lo, hi = (np.minimum(each, declaration.white) for each in (value, lo, hi))
    tau = tolerance * np.abs(value) + ABSOLUTE * max(min(float(value.max(initial=0.0)), peak), 1e-9)
    tau += _rounded(declaration, value, hi)
    if point and unsure is not None:  # an error that is nought by chance is not so next to it
        tau += POLICY.admissible.centres * extreme(extreme(unsure, np.maximum), np.maximum)
    samples = missed = None
    sampled = (lo, hi, envelope.variance if declaration.filter == "box" else most_variance(hi - lo))
    if not point:
        inside = np.maximum(envelope.hi - envelope.lo - slope(envelope.mean), 0.0)
        inside[envelope.edge] = 0.0
        missed = POLICY.admissible.grid * extreme(extreme(inside, np.maximum), np.maximum)
        if fine is not None and exact is not None:  # where an edge crosses, the interval from lo to hi stands for it
            at = np.flatnonzero(fine)
            bound = np.where(exact[..., None], envelope.bound, 0.0)
            missed = put(missed, at, np.minimum(pixels(missed, at), pixels(bound, at)))
        tau += missed
        missed = None if inner is None else missed
        if declaration.filter != "unknown" and declaration.samples >= POLICY.admissible.enough:
            share = RANDOM_EDGE if declaration.noisy else POLICY.admissible.edge
            span, samples = hi - lo, (lo, hi)
            slack = share * span
            lo, hi = np.maximum(lo, value - slack), np.minimum(hi, value + slack)
            if leeway is not None:
                cast = np.flatnonzero(edges(envelope, reach, cast=True))
                hi = put(hi, cast, pixels(hi, cast) + pixels(leeway, cast))
    if declaration.filter not in ("point", "box"):
        bend = extreme(largest(np.abs(laplacian(value))), np.maximum)
        tau += POLICY.admissible.bend * np.where(edge, 0.0, bend)[..., None]
    spared = envelope.spared_point if point else envelope.spared
    at = np.flatnonzero(edge)
    lo, hi = (put(value, at, pixels(each, at)) for each in (lo, hi))
    stray = 1.0 if point or not declaration.samples else min(1.0, POLICY.admissible.stray / declaration.samples)
    if point:
        slack = POLICY.admissible.edge * (hi - lo)
        clear = beside_centre(envelope) < POLICY.admissible.side
        lo, hi = (
            np.where(clear[..., None], which(each, value + sign * slack), each)
            for each, which, sign in ((lo, np.maximum, -1.0), (hi, np.minimum, 1.0))
        )
        sampled = (lo, hi, np.zeros_like(value))
    return Admissible(
        value, lo, hi, tau, edge, spared, point, reach_of_filter, samples, sampled, None, missed, inner, exact, stray
    )


def at_random(declaration: Declaration) -> bool:
    """Whether a pixel's samples fall anywhere in it by chance, and nowhere else, and are enough to tell their noise."""
    return declaration.noisy is True and declaration.filter == "box" and declaration.samples >= POLICY.admissible.enough


def beside_centre(envelope: Envelope) -> Floats:
    """The share (h, w) of each pixel's footprint that shows something else than its centre."""
    span = largest(envelope.hi - envelope.lo)
    return np.asarray(largest(np.abs(envelope.mean - envelope.point)) / np.maximum(span, 1e-30))


def _rounded(declaration: Declaration, value: Floats, hi: Floats) -> Floats | float:
    """By how much the output's number format may move ``value`` (h, w, 3), or what is admitted there up to ``hi``."""
    slack = POLICY.admissible.rounding
    if declaration.shared_exponent:
        return (1.0 + slack) * declaration.quantum * largest(np.maximum(np.abs(value), np.abs(hi)))[..., None]
    return (0.5 + slack) * declaration.quantum * (np.abs(value) if declaration.relative_quantum else 1.0)


def slope(value: Floats) -> Floats:
    """By how much ``value`` (h, w, 3) changes over a pixel where it changes evenly: the least change within two pixels.

    Subsamples know an even slope's mean, wherever they lie; an edge's they do not, and beside an edge it is flat.
    """
    change = _steps(value, 1) + _steps(value, 0)
    return np.asarray(BENT * extreme(extreme(change, np.minimum), np.minimum))


def _steps(value: Floats, axis: int) -> Floats:
    """|the next value - this one| along ``axis``, the last as the one before; 0 where there is only one."""
    if value.shape[axis] == 1:
        return np.zeros_like(value)
    widths = [(0, int(each == axis)) for each in range(value.ndim)]
    return np.pad(np.abs(np.diff(value, axis=axis)), widths, mode="edge")


def widening(declaration: Declaration) -> float:
    """By how much the declared filter's variance exceeds that of the pixel, in squared pixels; 0: unknown filter.

    A Gaussian has a standard deviation of half a pixel, less its value at the radius, as Mitsuba and pbrt have it.
    """
    if declaration.filter == "tent":
        return tent_variance(declaration.radius) - BOX_VARIANCE
    if declaration.filter == "gaussian":
        return gaussian_variance(declaration.radius) - BOX_VARIANCE
    return 0.0


def filtered(value: Floats, variance: float) -> Floats:
    """``value`` (h, w, 3), means over pixels, under the filter of three pixels that adds ``variance`` to each axis."""
    for axis in (0, 1):
        value = weighed(value, (1.0 - variance, variance / 2), axis)
    return value


def edges(envelope: Envelope, reach: int, *, cast: bool = False) -> Bools:
    """Pixels whose id changes inside them or towards a neighbour, widened by ``reach`` pixels; ``cast``: of shadows."""
    found = (envelope.cast if cast else envelope.edge) | changes(envelope.ids, cast=cast)
    return widened(found, reach)


def suspected(measured: Measured, envelope: Envelope, to: Admissible, declaration: Declaration) -> bool:
    """Whether a picture is brighter at the edge of a shadow than ``to`` admits, which knows of no epsilon.

    ``to`` must be that of the same ``envelope``. An epsilon is told from subsamples only where enough are taken.
    """
    if to.samples is None:
        return False
    cast = np.flatnonzero(edges(envelope, math.ceil(declaration.radius), cast=True))
    mean, hi, tau, variance = (pixels(each, cast) for each in (measured.mean, to.hi, to.tau, measured.variance))
    return bool((mean > hi + tau + POLICY.admissible.suspicious * np.sqrt(variance)).any())


def residual(mean: Floats, to: Admissible) -> Floats:
    """The signed distance (h, w, 3) of ``mean`` from the interval [lo, hi]; inside it 0."""
    nearest = np.maximum(mean, to.lo)
    np.minimum(nearest, to.hi, out=nearest)
    return np.subtract(mean, nearest, out=nearest)
