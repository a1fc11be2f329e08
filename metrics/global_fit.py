"""Step 5 of docs/judge.md, the whole picture: its gain, its shift and its warp, which also name the cause."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.channels import largest, pixels, total
from notabug.metrics.few_pixels import FewGain, few_gain
from notabug.metrics.formulas import DEVIATION, joined
from notabug.metrics.image_filters import Bools, blurred
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.references.tracer.precision import RELATIVE

Floats = npt.NDArray[np.floating]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class GlobalFit:
    """The gain and its standard error; the shift in pixels (x right, y down) and its standard errors; and the warp.

    The warp is what a magnification, an aspect or a roll does: the farthest that anything with an edge moves against
    the middle of all that has, in pixels, with its standard error.

    ``channels`` are the gains of red, green and blue alone, each with its error. Errors hold a quarter of what rounding
    can do to a flat picture: it rounds all of its pixels alike. ``untold`` is a gain that the picture may have and that
    too few pixels show to tell; 1 where there is none.
    """

    gain: float = 1.0
    gain_error: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    shift_error: tuple[float, float] = (0.0, 0.0)
    channels: tuple[tuple[float, float], ...] = ()
    warp: float = 0.0
    warp_error: float = 0.0
    untold: float = 1.0

    @property
    def severity(self) -> tuple[float, float, float]:
        """Gain, shift and warp over what is allowed."""
        gains = ((self.gain, self.gain_error), *self.channels)
        return (
            max(abs(gain - 1.0) / (RELATIVE + POLICY.global_fit.errors * error) for gain, error in gains),
            max(
                abs(each) / (POLICY.global_fit.shift + 3.0 * error)
                for each, error in zip(self.shift, self.shift_error, strict=True)
            ),
            self.warp / (POLICY.global_fit.shift + 3.0 * self.warp_error),
        )

    @property
    def gained(self) -> bool:
        return self.severity[0] > 1.0

    @property
    def shifted(self) -> bool:
        return self.severity[1] > 1.0

    @property
    def warped(self) -> bool:
        return self.severity[2] > 1.0

    @property
    def triggers(self) -> tuple[str, ...]:
        found = {"gain": self.gained, "shift": self.shifted, "warp": self.warped}
        return tuple(name for name, fired in found.items() if fired)


def global_fit(measured: Measured, to: Admissible, excluded: Bools) -> GlobalFit:
    """The gain on smooth pixels by Tukey-weighted least squares, the shift at edges by Huber regression.

    ``excluded`` (h, w) are pixels that a limitation may change. A fit is believed only where it describes most of the
    picture: an artifact in a corner is no gain.
    """
    gains = _gains(measured, to, excluded)
    (gain, gain_error), *channels = ((each.gain, each.error) for each in gains)
    value = total(to.value)
    off = total(measured.mean) - gain * value
    shift, shift_error = _shift(measured, value, off, excluded)
    found = GlobalFit(gain, gain_error, shift, shift_error, tuple(channels), *_warp(measured, value, off, excluded))
    untold = max((each.gain for each in gains if each.open), key=lambda each: abs(each - 1.0), default=1.0)
    return found if found.gained else replace(found, untold=untold)


def untold_gain(found: GlobalFit) -> str:
    """Why nobody can say whether there is a gain, or ""."""
    if found.untold == 1.0:
        return ""
    return (
        f"too few pixels to tell a gain: what is lit is {found.untold:.3f} times as bright as it should be, which the"
        " samples at its edges may do by chance; draw it larger, or with more samples, and declare them"
    )


def _gains(measured: Measured, to: Admissible, excluded: Bools) -> list[FewGain]:
    """The gain and its standard error of all channels together, and of each alone."""
    smooth = ~to.edge & ~excluded
    dark = POLICY.global_fit.lit * max(float(to.value.max(initial=0.0)), 1e-30)
    even, bright = (some(np.flatnonzero(each)) for each in (smooth, smooth & (largest(to.value) > dark)))
    allowed = pixels(to.tau, even).astype(np.float64) / np.maximum(pixels(to.value, even), 1e-30)
    x, y, tau, variance = (
        pixels(each, bright).astype(np.float64) for each in (to.value, measured.mean, to.tau, measured.variance)
    )
    least = float(to.tau.min(initial=np.inf))
    found = []
    for of in (slice(0, 3), slice(0, 1), slice(1, 2), slice(2, 3)):
        # where the tolerance is wide, by fine texture say, a wider filter looks like a gain: x regresses to its mean
        most = 2.0 * float(np.median(allowed[:, of])) if even.size else 0.0
        good = some(np.flatnonzero((x[:, of] > dark) & (tau[:, of] <= most * x[:, of])))
        if good.size < POLICY.global_fit.min_pixels:
            found.append(few_gain(measured, to, excluded, of, dark))
            continue
        values, gained, noise = (each[:, of].ravel()[good] for each in (x, y, variance))
        gain, error = _gain(values, gained, noise, least, measured.kappa)
        if abs(gain - 1.0) > RELATIVE + POLICY.global_fit.errors * error:
            seeds = [pixels(picture, bright)[:, of].ravel()[good].astype(np.float64) for picture in measured.pictures]
            error += _skewed(gain, [_gain(values, seed, noise * measured.seeds, least, 1.0)[0] for seed in seeds])
        found.append(FewGain(gain, error, many=True))
    return found


def _skewed(gain: float, seeds: list[float]) -> float:
    """How far skewed noise may have moved the ``gain`` of a mean of pictures, whose own gains are ``seeds``.

    A robust fit leaves rare bright samples out, so it is darker than the mean of what they come from. Averaging K
    pictures divides that skew by K: a gain that grows from one picture to the mean of all is not there yet.
    """
    return abs(gain - float(np.mean(seeds))) if seeds else 0.0


def _gain(x: Floats, y: Floats, variance: Floats, least: float, kappa: float) -> tuple[float, float]:
    """The gain of ``y`` (n,) over ``x`` (n,), and its standard error; ``least`` is the least tolerance of all."""
    ratio = y / x
    gain = float(np.median(ratio))
    spread = DEVIATION * float(np.median(np.abs(ratio - gain)))
    noise = np.sqrt(variance) / x
    scale, square = np.maximum(np.maximum(spread, POLICY.global_fit.least_gain_scatter), noise), x * x
    for _ in range(POLICY.global_fit.gain_turns):
        u = (ratio - gain) / (POLICY.regression.tukey * scale)
        weight = np.maximum(1.0 - u * u, 0.0) ** 2 * square
        total = float(weight.sum())
        if total <= 0:
            return gain, 0.0
        gain = float((weight * ratio).sum() / total)
    error = float(np.sqrt(((weight * scale) ** 2).sum()) / total) * np.sqrt(kappa)
    error += least / float(np.median(x)) / POLICY.global_fit.errors
    agree = np.abs(ratio - gain) < 0.5 * max(abs(gain - 1.0), RELATIVE) + 3.0 * noise
    if float(agree.mean()) < 0.5:  # not one gain: something else
        return 1.0, error
    return gain, error


def some(places: Places) -> Places:
    """Some of ``places`` (n,), evenly spread."""
    return places[:: max(1, places.size // POLICY.global_fit.enough)]


def _shift(
    measured: Measured, value: Floats, off: Floats, excluded: Bools
) -> tuple[tuple[float, float], tuple[float, float]]:
    least = (0.0, 0.0)
    for blur, leaves in POLICY.global_fit.leaves:
        change, at, terms = _moved(value, off, excluded, blur)
        if at.size < POLICY.global_fit.min_pixels:
            break
        alike = max(1.0, joined(blur))
        found = _huber(terms, change, _variance(measured, at) / alike)
        if found is None:
            break
        fit, variances, before, after = found
        across, down = (float(each) for each in np.sqrt(measured.kappa * alike * variances[:2]))
        least = least if any(least) else (across, down)
        # what no shift takes away: mean |noise|
        noise = float(np.sqrt(2.0 / np.pi * total(pixels(measured.variance, at)) / alike).sum())
        if after - noise <= leaves * (before - noise):  # a shift explains the edges, or it is no shift
            return (float(fit[0]), float(fit[1])), (across, down)
    return (0.0, 0.0), least


def _warp(measured: Measured, value: Floats, off: Floats, excluded: Bools) -> tuple[float, float]:
    """How far the pixels that can show it move against their middle, and its standard error.

    Not how far the picture's corners would: of one line a blur makes a warp that is wild where there is nothing to see.
    """
    change, at, moved = _moved(value, off, excluded, POLICY.global_fit.blur)
    if at.size < POLICY.global_fit.min_pixels:
        return 0.0, 0.0
    h, w = value.shape
    v, u = (2.0 * each / max(1, size - 1) - 1.0 for each, size in zip(np.divmod(at, w), (h, w), strict=True))
    dx, dy = moved[:, 0], moved[:, 1]
    # places (u, v) in -1 .. 1 move by (s + A (u, v)) pixels
    bent = np.concatenate([moved, np.stack([u * dx, v * dx, u * dy, v * dy], axis=1)], axis=1)
    alike = joined(POLICY.global_fit.blur)
    noise = _variance(measured, at) / alike
    plain, found = _huber(moved, change, noise), _huber(bent, change, noise)
    if plain is None or found is None:
        return 0.0, 0.0
    fit, variances, before, after = found
    u, v = u - u.mean(), v - v.mean()
    scatter = measured.kappa * alike * variances[3:].max()
    error = float(np.sqrt(scatter) * np.hypot(u, v).max())
    # a warp explains the edges, and a shift does not, or it is no warp
    if after > POLICY.global_fit.warp_leaves * min(before, plain[3]):
        return 0.0, error
    across_u, across_v, down_u, down_v = fit[3:]
    return float(np.hypot(across_u * u + across_v * v, down_u * u + down_v * v).max()), error


def _moved(value: Floats, off: Floats, excluded: Bools, blur: float) -> tuple[Floats, Places, Floats]:
    """What to regress on what: the difference (n,), blurred, at some pixels (n,) that are steep enough to show that
    something has moved, and the terms (n, 3) there; ``value`` and ``off`` (h, w) are sums over channels.

    A picture moved by (sx, sy) is R - sx dR/dx - sy dR/dy; the Laplacian takes up a benign blur.
    """
    value, off = blurred(value, blur), blurred(off, blur)
    wide = np.pad(value, 1, mode="edge")
    around = left, right, upper, lower = wide[1:-1, :-2], wide[1:-1, 2:], wide[:-2, 1:-1], wide[2:, 1:-1]
    dx, dy = 0.5 * (right - left), 0.5 * (lower - upper)
    steep = np.abs(dx) + np.abs(dy) > POLICY.global_fit.steep * float(value.max(initial=0.0))
    at = some(np.flatnonzero(steep & ~excluded))
    place = np.divmod(at, value.shape[1])
    bend = sum(each[place] for each in around) - len(around) * value[place]  # the Laplacian
    return off[place], at, np.stack([-dx[place], -dy[place], bend], axis=1)


def _variance(measured: Measured, at: Places) -> Floats:
    """The variance (n,) of the sum of the channels, whose noise is the same at worst, of the pixels ``at`` (n,)."""
    return np.asarray(total(np.sqrt(pixels(measured.variance, at))) ** 2)


def _huber(terms: Floats, off: Floats, noise: Floats) -> tuple[Floats, Floats, float, float] | None:
    """Huber's regression of ``off`` (n,) on ``terms`` (n, k): (fit, its variances, sum |off| before, and after).

    The variances are the larger of what the residuals say and of what the ``noise`` (n,), a variance, makes of the fit:
    where half of the pixels are black and agree to the last bit, the residuals alone would say far too little.
    """
    a, b = terms.astype(np.float64), off.astype(np.float64)
    weight = np.ones_like(b)
    fit: Floats = np.zeros(a.shape[1])
    for _ in range(POLICY.global_fit.shift_turns):
        normal = a.T @ (a * weight[:, None])
        normal += 1e-12 * np.trace(normal) * np.eye(len(fit))
        try:
            fit = np.linalg.solve(normal, a.T @ (b * weight))
        except np.linalg.LinAlgError:
            return None
        r = b - a @ fit
        scale = max(DEVIATION * float(np.median(np.abs(r))), POLICY.global_fit.least_shift_scatter)
        weight = np.minimum(1.0, POLICY.regression.huber * scale / np.maximum(np.abs(r), 1e-12))
    r = b - a @ fit
    inverse = np.linalg.inv(normal)
    alike = float((weight * r**2).sum() / max(weight.sum(), 1.0)) * inverse
    pull = a * weight[:, None] @ inverse
    variances = np.maximum(np.diag(alike), noise @ pull**2)
    return fit, variances, float(np.abs(b).sum()), float(np.abs(r).sum())
