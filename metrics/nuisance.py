"""Step 4: a gain, a shift and a warp of the whole picture, which also name the cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from notabug.metrics.admissible import Admissible, laplacian
from notabug.metrics.channels import total
from notabug.metrics.noise import Measured

Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]

GAIN = 0.004  # a gain within this of 1, plus some standard errors, is none
ERRORS = 4.0  # standard errors: at three 1 in 400 gains of nothing but noise is one
SHIFT = 0.2  # pixels; aliased edges fake up to 0.13
WARP = 0.2  # pixels by which what is farthest from the middle moves against it; in clean pictures up to 0.14
_BLUR = 1.0  # standard deviation: a warp moves the border by more pixels than a gradient reaches
# (standard deviation of a blur, share of the change that a shift may leave): across a hard edge a picture is no line,
# and a shift leaves most of what it has changed; with both pictures blurred it is one, and a shift must leave little.
_LEAVES = ((0.0, 0.75), (0.7, 0.5))
_MIN_PIXELS = 64
_ENOUGH = 20_000  # values that fix a gain far better than its tolerance


@dataclass(frozen=True, slots=True)
class Nuisance:
    """The gain and its standard error; the shift in pixels (x right, y down) and its standard errors; and the warp.

    The warp is what a magnification, an aspect or a roll does: the farthest that anything with an edge moves against
    the middle of all that has, in pixels, with its standard error.

    ``channels`` are the gains of red, green and blue alone, each with its error. Errors hold a quarter of what rounding
    can do to a flat picture: it rounds all of its pixels alike.
    """

    gain: float = 1.0
    gain_error: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    shift_error: tuple[float, float] = (0.0, 0.0)
    channels: tuple[tuple[float, float], ...] = ()
    warp: float = 0.0
    warp_error: float = 0.0

    @property
    def severity(self) -> tuple[float, float, float]:
        """Gain, shift and warp over what is allowed."""
        gains = ((self.gain, self.gain_error), *self.channels)
        return (
            max(abs(gain - 1.0) / (GAIN + ERRORS * error) for gain, error in gains),
            max(abs(each) / (SHIFT + 3.0 * error) for each, error in zip(self.shift, self.shift_error, strict=True)),
            self.warp / (WARP + 3.0 * self.warp_error),
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


def nuisance(measured: Measured, to: Admissible, excluded: Bools) -> Nuisance:
    """The gain on smooth pixels by Tukey-weighted least squares, the shift at edges by Huber regression.

    ``excluded`` (h, w) are pixels that a limitation may change. A fit is believed only where it describes most of the
    picture: an artifact in a corner is no gain.
    """
    smooth = ~to.edge & ~excluded
    gain, gain_error = _gain(measured, to, np.repeat(smooth[..., None], 3, axis=2))
    channels = tuple(_gain(measured, to, smooth[..., None] & (np.arange(3) == k)) for k in range(3))
    shift, shift_error = _shift(measured, to, gain, excluded)
    return Nuisance(gain, gain_error, shift, shift_error, channels, *_warp(measured, to, gain, excluded))


def _gain(measured: Measured, to: Admissible, smooth: Bools) -> tuple[float, float]:
    # where the tolerance is wide, by fine texture say, a wider filter looks like a gain: x regresses towards its mean
    tau, value = to.tau.ravel(), to.value.ravel()
    some = _some(np.flatnonzero(smooth))
    most = 2.0 * np.median(tau[some] / np.maximum(value[some], 1e-30)) if some.size else 0.0
    bright = np.flatnonzero(smooth.ravel() & (value > 0.02 * max(float(value.max(initial=0.0)), 1e-30)))
    bright = bright[tau[bright] <= most * value[bright]]
    if bright.size < _MIN_PIXELS:
        return 1.0, 0.0
    bright = _some(bright)
    x, y, variance = (each.ravel()[bright].astype(np.float64) for each in (to.value, measured.mean, measured.variance))
    ratio = y / x
    gain = float(np.median(ratio))
    spread = 1.4826 * float(np.median(np.abs(ratio - gain)))
    noise = np.sqrt(variance) / x
    scale = np.maximum(np.maximum(spread, 1e-4), noise)
    for _ in range(5):
        u = (ratio - gain) / (4.685 * scale)
        weight = np.where(np.abs(u) < 1, (1 - u * u) ** 2, 0.0) * x * x
        total = float(weight.sum())
        if total <= 0:
            return gain, 0.0
        gain = float((weight * ratio).sum() / total)
    error = float(np.sqrt(((weight * scale) ** 2).sum()) / total) * np.sqrt(measured.kappa)
    error += float(to.tau.min()) / float(np.median(x)) / ERRORS
    agree = np.abs(ratio - gain) < 0.5 * max(abs(gain - 1.0), GAIN) + 3.0 * noise
    if float(agree.mean()) < 0.5:  # not one gain: something else
        return 1.0, error
    return gain, error


def _some(places: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Some _ENOUGH of ``places`` (n,), evenly spread."""
    return places[:: max(1, places.size // _ENOUGH)]


def _shift(
    measured: Measured, to: Admissible, gain: float, excluded: Bools
) -> tuple[tuple[float, float], tuple[float, float]]:
    least = (0.0, 0.0)
    for blur, leaves in _LEAVES:
        value, mean = (_blurred(total(each), blur) for each in (to.value, measured.mean))
        at, dx, dy = _slopes(value, excluded)
        if at.sum() < _MIN_PIXELS:
            break
        # a picture moved by (sx, sy) is R - sx dR/dx - sy dR/dy; the Laplacian takes up a benign blur
        terms = np.stack([-dx[at], -dy[at], laplacian(value)[at]], axis=1)
        alike = max(1.0, 4.0 * np.pi * blur**2)  # pixels: neighbours are after the blur
        found = _huber(terms, mean[at] - gain * value[at], _variance(measured, at) / alike)
        if found is None:
            break
        fit, variances, before, after = found
        across, down = (float(each) for each in np.sqrt(measured.kappa * alike * variances[:2]))
        least = least if any(least) else (across, down)
        # what no shift takes away: mean |noise|
        noise = float(np.sqrt(2.0 / np.pi * total(measured.variance[at]) / alike).sum())
        if after - noise <= leaves * (before - noise):  # a shift explains the edges, or it is no shift
            return (float(fit[0]), float(fit[1])), (across, down)
    return (0.0, 0.0), least


def _warp(measured: Measured, to: Admissible, gain: float, excluded: Bools) -> tuple[float, float]:
    """How far the pixels that can show it move against their middle, and its standard error.

    Not how far the picture's corners would: of one line a blur makes a warp that is wild where there is nothing to see.
    """
    value, mean = (_blurred(total(each), _BLUR) for each in (to.value, measured.mean))
    at, dx, dy = _slopes(value, excluded)
    if at.sum() < _MIN_PIXELS:
        return 0.0, 0.0
    h, w = value.shape
    v, u = (each[at] for each in np.mgrid[-1.0 : 1.0 : h * 1j, -1.0 : 1.0 : w * 1j])
    dx, dy = -dx[at], -dy[at]
    # places (u, v) in -1 .. 1 move by (s + A (u, v)) pixels
    moved = np.stack([dx, dy, laplacian(value)[at]], axis=1)
    bent = np.concatenate([moved, np.stack([u * dx, v * dx, u * dy, v * dy], axis=1)], axis=1)
    off = mean[at] - gain * value[at]
    alike = 4.0 * np.pi * _BLUR**2  # pixels: neighbours are after the blur
    noise = _variance(measured, at) / alike
    plain, found = _huber(moved, off, noise), _huber(bent, off, noise)
    if plain is None or found is None:
        return 0.0, 0.0
    fit, variances, before, after = found
    u, v = u - u.mean(), v - v.mean()
    scatter = measured.kappa * alike * variances[3:].max()
    error = float(np.sqrt(scatter) * np.hypot(u, v).max())
    if after > 0.75 * min(before, plain[3]):  # a warp explains the edges, and a shift does not, or it is no warp
        return 0.0, error
    return float(np.hypot(fit[3] * u + fit[4] * v, fit[5] * u + fit[6] * v).max()), error


def _variance(measured: Measured, at: Bools) -> Floats:
    """The variance (n,) of the sum of the channels, whose noise is the same at worst, of the pixels ``at`` (h, w)."""
    return np.asarray(total(np.sqrt(measured.variance[at])) ** 2)


def _blurred(value: Floats, blur: float) -> Floats:
    return np.asarray(ndimage.gaussian_filter(value, blur, mode="nearest")) if blur else value


def _slopes(value: Floats, excluded: Bools) -> tuple[Bools, Floats, Floats]:
    """Where (h, w) the picture is steep enough to show that it has moved, and its slopes across and down."""
    dx, dy = (ndimage.correlate1d(value, [-0.5, 0.0, 0.5], axis=axis, mode="nearest") for axis in (1, 0))
    at = (np.abs(dx) + np.abs(dy) > 0.05 * float(value.max(initial=0.0))) & ~excluded
    return at, dx, dy


def _huber(terms: Floats, off: Floats, noise: Floats) -> tuple[Floats, Floats, float, float] | None:
    """Huber's regression of ``off`` (n,) on ``terms`` (n, k): (fit, its variances, sum |off| before, and after).

    The variances are the larger of what the residuals say and of what the ``noise`` (n,), a variance, makes of the fit:
    where half of the pixels are black and agree to the last bit, the residuals alone would say far too little.
    """
    a, b = terms.astype(np.float64), off.astype(np.float64)
    weight = np.ones_like(b)
    fit: Floats = np.zeros(a.shape[1])
    for _ in range(6):
        normal = a.T @ (a * weight[:, None])
        normal += 1e-12 * np.trace(normal) * np.eye(len(fit))
        try:
            fit = np.linalg.solve(normal, a.T @ (b * weight))
        except np.linalg.LinAlgError:
            return None
        r = b - a @ fit
        scale = max(1.4826 * float(np.median(np.abs(r))), 1e-6)
        weight = np.minimum(1.0, 1.345 * scale / np.maximum(np.abs(r), 1e-12))
    r = b - a @ fit
    inverse = np.linalg.inv(normal)
    alike = float((weight * r**2).sum() / max(weight.sum(), 1.0)) * inverse
    pull = a * weight[:, None] @ inverse
    variances = np.maximum(np.diag(alike), noise @ pull**2)
    return fit, variances, float(np.abs(b).sum()), float(np.abs(r).sum())
