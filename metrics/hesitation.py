"""Step 7 of docs/judge.md, can the picture tell: why no verdict is possible.

Noise may be all that is wrong with one picture, or noise or the scene itself may hide what is.

A random sample is a ray through a random place of the pixel's footprint, to lights that are points or directions. So a
pixel's noise lies between the least and the largest value that a sample there can have, its variance is at most that of
one sample, and over many pixels it cancels. What lies beyond is no noise, however noisy it looks, and a picture that is
declared to be deterministic has none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.admissible import Admissible, residual
from notabug.metrics.channels import largest, pixels, spread
from notabug.metrics.excused import excused
from notabug.metrics.explain import Explanation
from notabug.metrics.formulas import most_variance
from notabug.metrics.global_fit import some
from notabug.metrics.image_filters import widened
from notabug.metrics.noise import Measured, tiles
from notabug.metrics.policy import POLICY
from notabug.metrics.quick import Predict
from notabug.metrics.rules import support
from notabug.references.models.model import Model
from notabug.references.tracer.envelope import GRID
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


def hesitation(
    measured: Measured,
    found: Explanation,
    predicted: Predict,
    open_to: Sequence[Model],
    scene: Scene,
    declaration: Declaration,
    given: int,
) -> str:
    """Why no verdict is possible on ``given`` pictures, or ""; what a bug would be called has no say in it."""
    if measured.noisy:
        reason = _too_noisy(measured, found)
    elif given > 1 or not found.triggers or declaration.noisy is False:
        reason = ""  # seeds that agree to the last bit have no noise
    elif not may_be_noise(measured, found, predicted(()), scene, declaration):
        reason = ""
    elif declaration.noisy:
        reason = "one picture of a noisy renderer: render at least two seeds"
    elif _looks_noisy(measured, found):
        reason = "the picture looks noisy and there is only one: give at least two independent seeds"
    else:
        reason = ""
    return reason or _beyond_telling(found, open_to, predicted, declaration)


def _too_noisy(measured: Measured, found: Explanation) -> str:
    smooth = some(np.flatnonzero(~found.target.edge))
    variance, tau = (pixels(each, smooth) for each in (measured.variance, found.target.tau))
    ratio = float(np.median(np.sqrt(measured.kappa * variance) / POLICY.noise.tile / tau)) if smooth.size else 0.0
    if not found.triggers and POLICY.hesitation.blind * ratio > 1.0:
        factor = (POLICY.hesitation.blind * ratio) ** 2
        return f"too noisy: {factor:.1f} times as many samples would decide"
    return ""


def _beyond_telling(found: Explanation, open_to: Sequence[Model], predicted: Predict, declaration: Declaration) -> str:
    """Why a picture that chance explains says nothing, or "": rounding may then do that to most of what is lit."""
    if found.triggers or not any(each.rule == "set" for each in found.models):
        return ""
    bare = predicted(())
    lit = largest(bare.value) > 0
    for each in open_to:
        if each.shows == "dots":
            share = float((support(bare, predicted((each,))) & lit).sum()) / max(1.0, float(lit.sum()))
            if share > POLICY.hesitation.untellable:
                return (
                    f"no picture can tell here: with a rounding of {declaration.hit_error:.1e} of the distance no"
                    f" reasonable epsilon prevents {each.name} on {share:.0%} of what is lit; bring camera or scene"
                    " nearer"
                )
    return ""


def may_be_noise(
    measured: Measured, found: Explanation, reference: Admissible, scene: Scene, declaration: Declaration
) -> bool:
    """Whether random samples of the scene could have made what is wrong with one picture: see the file's head."""
    least, most, variance = _one_sample(found, reference, scene)
    margin = POLICY.admissible.missed * (most - least) + found.target.tau
    wrong = found.significance.pixels
    outside = wrong & (largest(np.maximum(measured.mean - most, least - measured.mean) - margin) > 0)
    sized = any(light.emitter is not None for light in scene.lights)
    if not sized and np.count_nonzero(outside & ~excused(outside, measured.mean, found.target)):
        return False
    smooth = spread(~found.target.edge)
    off = residual(measured.mean, found.target) * smooth
    # what a grid of subsamples may miss, which a pixel's tolerance holds, cancels over many pixels as noise does
    value = np.abs(found.target.value)
    quantum = declaration.quantum * (value if declaration.relative_quantum else 1.0)
    tau = (
        RELATIVE * value + ABSOLUTE * float(value.max(initial=0.0)) + (0.5 + POLICY.admissible.rounding) * quantum
    ) * smooth
    shared = max(1.0, (2.0 * declaration.radius) ** 2)  # pixels that a sample counts for
    every_place = GRID**2 / (GRID**2 - 1)  # times the variance of regular subsamples of an even slope
    variance = every_place * variance * smooth / max(1, declaration.samples)
    square = ((1.0 + 2.0 * POLICY.admissible.missed) * (most - least) * smooth) ** 2
    if sized:
        # few of a renderer's directions may carry most of a light: then no bound is known, but how pixels scatter is
        variance = _scatter(off)
        square = variance + off**2
    return _cancels(np.abs(_sums(off)), _sums(tau), _sums(variance) * shared, float(square.max()) ** 0.5 * shared) and (
        # a square of that mean is off its own by no more variance than the largest square times the mean
        _cancels(
            _sums(off**2), _sums(variance + tau**2), _sums(square * variance) * shared, float(square.max()) * shared
        )
    )


def _scatter(off: Floats) -> Floats:
    """The variance (h, w, 3) of what changes by chance from pixel to pixel in ``off``: half of neighbours' squares.

    Each pair's is given to both of its pixels, a quarter each of the four that a pixel is in.
    """
    found = np.zeros_like(off)
    for axis in (0, 1):
        square = (np.diff(off, axis=axis) / 2.0) ** 2 / 2.0
        before = tuple(slice(None, -1) if axis == k else slice(None) for k in range(2))
        after = tuple(slice(1, None) if axis == k else slice(None) for k in range(2))
        found[before] += square
        found[after] += square
    return found


def _sums(values: Floats) -> Floats:
    """The sums (n, 3) of ``values`` (h, w, 3) over tiles, and over the picture."""
    summed = tiles(np.asarray(values, np.float64)).reshape(-1, 3)
    return np.concatenate([summed, summed.sum(axis=0, keepdims=True)])


def _cancels(off: Floats, mean: Floats, variance: Floats, largest: float) -> bool:
    """Whether sums ``off`` (n, 3) exceed their ``mean`` by no more than chance has it anywhere in the picture.

    Boucheron, Lugosi and Massart 2013, Concentration Inequalities, theorem 2.10, Bernstein's inequality: a sum of
    independent values of that ``variance``, each at most ``largest``, exceeds its mean by sqrt(2 v t) + c t, where c is
    a third of the largest value, with a chance of at most exp(-t).
    """
    t = math.log(2.0 * off.size / POLICY.significance.certain)
    return bool((off <= mean + np.sqrt(2.0 * variance * t) + largest / 3.0 * t).all())


def _one_sample(found: Explanation, reference: Admissible, scene: Scene) -> tuple[Floats, Floats, Floats]:
    """The least and the most (h, w, 3) that one random sample may show, and the largest variance that it may have.

    Of several lights, or of several rays that go on from a surface, a renderer may follow one at random, and weigh it
    by the number of them.
    """
    assert reference.sampled is not None
    low, high, variance = reference.sampled
    least, most = np.minimum(low, found.target.lo), np.maximum(high, found.target.hi)
    bends = any(each.sends_on for each in scene.materials)
    if len(scene.lights) > 1 or bends:
        if bends:  # the surface, its mirror ray, its refracted one
            most = np.full_like(most, 3 * float(most.max()))
        most = max(1, len(scene.lights)) * most
        least = np.zeros_like(least)
        variance = most_variance(most - least)
    return least, most, variance


def _looks_noisy(measured: Measured, found: Explanation) -> bool:
    """A residual that changes sign from pixel to pixel all over the smooth parts is noise, not a fault."""
    off = measured.mean - found.target.value
    r = off[..., int(np.argmax((off**2).sum(axis=(0, 1))))]  # where red and blue are exchanged their sum says nothing
    smooth = ~widened(found.target.edge, 1)
    bright = smooth & (largest(found.target.value) > 0)
    wrong = r[found.significance.pixels & bright]
    if bright.sum() < POLICY.hesitation.enough_bright or wrong.size < POLICY.hesitation.least_wrong * bright.sum():
        return False
    # all too dark, or all too bright: acne, or holes
    if not POLICY.hesitation.least_wrong < float((wrong > 0).mean()) < 1.0 - POLICY.hesitation.least_wrong:
        return False
    centred = np.where(bright, r - r[bright].mean(), 0.0)
    power = float((centred**2).sum()) / float(bright.sum())
    both = bright[:, 1:] & bright[:, :-1]
    lag = float((centred[:, 1:] * centred[:, :-1])[both].mean()) if both.any() else power
    bias = abs(float(r[bright].mean()))
    return lag < POLICY.hesitation.most_alike * power and bias < POLICY.hesitation.most_biased * float(np.sqrt(power))
