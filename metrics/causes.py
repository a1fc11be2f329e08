"""Step 8, first half: causes that act on the whole picture and need no model of the scene: flips, gain, shift ...

Each is a change of what is admissible. The one after which the picture fits is the cause.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.noise import Measured

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """A named change of the whole picture: from the set that is admissible without it to the one under it."""

    name: str
    message: str
    under: Callable[[Admissible], Admissible]


def changed(to: Admissible, change: Callable[[Floats], Floats]) -> Admissible:
    """``to`` under the ``change`` of a picture; edges go through it as 0 and 1, the tolerance by the change's slope."""
    edge = change(np.repeat(to.edge[..., None].astype(np.float64), 3, axis=2))[..., 0] > 0.01
    tau = np.maximum(np.abs(change(to.value + to.tau) - change(to.value)), to.tau.min())
    samples = None if to.samples is None else (change(to.samples[0]), change(to.samples[1]))
    return replace(to, value=change(to.value), lo=change(to.lo), hi=change(to.hi), tau=tau, edge=edge, samples=samples)


def encoded(linear: Floats) -> Floats:
    """The sRGB transfer function (IEC 61966-2-1) of linear values, clipped to [0, 1]."""
    x = np.clip(linear, 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4) - 0.055)


def _cause(name: str, message: str, change: Callable[[Floats], Floats]) -> Cause:
    return Cause(name, message, lambda to: changed(to, change))


def _encoded(to: Admissible) -> Admissible:
    found = changed(to, encoded)
    return replace(found, tau=np.maximum(found.tau, 0.008))


def causes(measured: Measured, to: Admissible) -> Iterator[Cause]:
    """Every cause worth trying for this picture, which ``to`` admits but for it."""
    mean = measured.mean
    bright = max(float(to.value.max(initial=0.0)), 1e-30)
    if float(np.abs(mean).max(initial=0.0)) < 1e-3 * bright:
        yield _cause("black", "every pixel is black: no light, no object or no camera", np.zeros_like)
        return
    yield _cause("upside_down", "the picture is upside down", lambda a: a[::-1])
    yield _cause("mirrored", "the picture is mirrored left to right", lambda a: a[:, ::-1])
    yield _cause("rotated", "the picture is rotated by 180 degrees", lambda a: a[::-1, ::-1])
    yield _cause("channels_swapped", "red and blue are exchanged", lambda a: a[..., ::-1])
    yield Cause(
        "srgb_encoded",
        "the picture looks sRGB-encoded, expected linear (write linear values or declare --encoding srgb)",
        _encoded,
    )
    gain = _median_ratio(mean, to.value, bright)
    if gain is not None:
        yield _cause("light_gain", gain_message(gain), lambda a: a * gain)
    top = _top(mean, to.value)
    if top is not None:
        yield _cause("clamped", f"values are cut off at {top:.4g}", lambda a: np.minimum(a, top))
    gamma = _gamma(mean, to.value, bright)
    if gamma is not None:
        yield _cause(
            "gamma", f"values are raised to the power {gamma:.3f}", lambda a: np.power(np.maximum(a, 0.0), gamma)
        )
    for dx, dy in find_shifts(mean, to.value):
        yield _cause(
            "pixel_shift",
            f"the picture is shifted by ({dx:+.2f}, {dy:+.2f}) pixels (right, down)",
            lambda a, dx=dx, dy=dy: shifted(a, dx, dy),  # type: ignore[misc]
        )
    scale = find_scale(mean, to.value)
    if scale is not None:
        yield _cause(
            "field_of_view",
            f"the picture is scaled by {scale:.4f} about its centre: the field of view or the aspect is wrong",
            lambda a: zoomed(a, scale),
        )


def gain_message(gain: float) -> str:
    """What a gain of the whole picture means in words."""
    for value, why in ((math.pi, ": a 1/pi is missing"), (1 / math.pi, ": a 1/pi too many"), (4 * math.pi, ": 4 pi")):
        if abs(gain / value - 1) < 0.01:
            return f"gain {gain:.4f}{why}"
    return f"gain {gain:.4f}: every value is multiplied by it"


def shifted(picture: Floats, dx: float, dy: float) -> Floats:
    """``picture`` (h, w, c) moved by pixels to the right and down, bilinear, what is outside as the nearest inside."""
    from scipy import ndimage

    return np.asarray(ndimage.shift(picture, (dy, dx, 0), order=1, mode="nearest"))


def zoomed(picture: Floats, scale: float, step: int = 1) -> Floats:
    """``picture`` (h, w, c) larger by ``scale`` about its centre, bilinear, black outside: every ``step``-th pixel."""
    from scipy import ndimage

    h, w, channels = picture.shape
    offset = [(h - 1) / 2 * (1 - 1 / scale), (w - 1) / 2 * (1 - 1 / scale), 0.0]
    shape = (-(-h // step), -(-w // step), channels)
    matrix = [step / scale, step / scale, 1.0]
    return np.asarray(ndimage.affine_transform(picture, matrix, offset, shape, order=1, mode="constant"))


def _median_ratio(mean: Floats, value: Floats, bright: float) -> float | None:
    at = value > 0.05 * bright
    if at.sum() < 64:
        return None
    gain = float(np.median(mean[at] / value[at]))
    return gain if gain > 0 and abs(gain - 1) > 1e-3 else None


def _top(mean: Floats, value: Floats) -> float | None:
    """Where values are cut off: what a picture shows of all that should be brighter than its brightest value."""
    above = value > 1.02 * float(mean.max(initial=0.0))
    return float(np.median(mean[above])) if above.sum() >= 8 else None


def _gamma(mean: Floats, value: Floats, bright: float) -> float | None:
    at = (value > 0.02 * bright) & (value < 0.98) & (mean > 1e-4) & (mean < 0.98)
    if at.sum() < 64:
        return None
    gamma = float(np.median(np.log(mean[at]) / np.log(value[at])))
    return gamma if 0.2 < gamma < 5 and abs(gamma - 1) > 0.01 else None


def find_shifts(mean: Floats, value: Floats) -> Iterator[tuple[float, float]]:
    """Shifts (right, down) in pixels worth trying, by phase correlation: to the pixel, and to a twentieth."""
    from scipy import ndimage
    from skimage.registration import phase_cross_correlation

    # of the gradients: the border that a shift brings in would pull smooth shading towards no shift at all
    a, b = (np.hypot(*(ndimage.sobel(each.sum(axis=2), axis) for axis in (0, 1))) for each in (value, mean))
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return
    for upsample in (1, 20):
        move, _, _ = phase_cross_correlation(b, a, upsample_factor=upsample, normalization=None)
        if 0.05 < max(abs(move)) < 0.25 * min(a.shape):
            yield float(move[1]), float(move[0])


def find_scale(mean: Floats, value: Floats) -> float | None:
    """The magnification about the centre that fits best, by a search on every fourth pixel and a refinement."""
    a, b = (each.sum(axis=2, keepdims=True) for each in (value, mean))

    def misfit(scale: float, step: int) -> float:
        return float(np.abs(zoomed(a, scale, step) - b[::step, ::step]).mean())

    coarse = np.geomspace(0.5, 2.0, 57)
    best = float(coarse[int(np.argmin([misfit(each, 4) for each in coarse]))])
    fine = best * np.linspace(0.985, 1.015, 31)
    best = float(fine[int(np.argmin([misfit(each, 2) for each in fine]))])
    return best if abs(best - 1) > 0.003 else None
