"""Step 8 of docs/judge.md, the name: causes that act on the whole picture and need no model: flips, gain, shift ...

Each is a change of what is admissible. The one after which the picture fits is the cause.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from notabug.metrics.admissible import Admissible
from notabug.metrics.formulas import DEVIATION
from notabug.metrics.image_filters import Bools
from notabug.metrics.noise import Measured
from notabug.metrics.policy import POLICY
from notabug.references.models.camera import shift_message
from notabug.references.tracer.precision import RELATIVE
from notabug.scenes_usd.srgb import decode_srgb, encode_srgb

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """A named change of the whole picture: from the set that is admissible without it to the one under it.

    ``numbers`` are what the verdict then prints in the place of those that only a picture without a bug leg has.
    ``of_values`` is what it makes of values (..., 3), where it changes each pixel by itself. ``strengths`` are the
    numbers of which ``cause_called`` makes it again. A ``turn`` puts pixels elsewhere as a whole: it
    leaves nothing to a blend. A shift ``moves`` all of them by two numbers.
    """

    name: str
    message: str
    under: Callable[[Admissible], Admissible]
    numbers: Mapping[str, float] = field(default_factory=dict)
    of_values: Callable[[Floats], Floats] | None = None
    strengths: tuple[float, ...] = ()
    turn: bool = False
    moves: bool = False


def changed(to: Admissible, change: Callable[[Floats], Floats]) -> Admissible:
    """``to`` under the ``change`` of a picture; edges go through it as 0 and 1, the tolerance by the change's slope."""
    edge = change(np.repeat(to.edge[..., None].astype(np.float64), 3, axis=2))[..., 0] > POLICY.causes.edge
    tau = np.maximum(np.abs(change(to.value + to.tau) - change(to.value)), to.tau.min())
    samples = None if to.samples is None else (change(to.samples[0]), change(to.samples[1]))
    return replace(to, value=change(to.value), lo=change(to.lo), hi=change(to.hi), tau=tau, edge=edge, samples=samples)


def encoded(linear: Floats) -> Floats:
    """The sRGB-encoded values of linear ones, clipped to [0, 1]."""
    return encode_srgb(np.clip(linear, 0.0, 1.0))


def _moving(name: str, message: str, change: Callable[[Floats], Floats]) -> Cause:
    """The cause whose ``change`` of a picture moves its pixels."""
    return Cause(name, message, lambda to: changed(to, change))


def _cause(name: str, message: str, change: Callable[[Floats], Floats]) -> Cause:
    """The cause whose ``change`` changes each pixel by itself."""
    return replace(_moving(name, message, change), of_values=change)


def shift_numbers(dx: float, dy: float) -> dict[str, float]:
    """The numbers of a verdict that tell of a shift."""
    return {"shift_x": dx, "shift_y": dy}


def _shift(mean: Floats, dx: float, dy: float) -> Cause:
    def under(to: Admissible) -> Admissible:
        return without_border(changed(to, lambda a: shifted(a, dx, dy)), mean, dx, dy)

    return Cause("pixel_shift", shift_message(dx, dy), under, shift_numbers(dx, dy), strengths=(dx, dy), moves=True)


def _gain(gain: float) -> Cause:
    made = _cause("light_gain", gain_message(gain), lambda a: a * gain)
    return replace(made, numbers={"gain": gain}, strengths=(gain,))


def _cut_off(top: float) -> Cause:
    made = _cause("clamped", f"values are cut off at {top:.4g}", lambda a: np.minimum(a, top))
    return replace(made, strengths=(top,))


def _power(gamma: float) -> Cause:
    said = f"values are raised to the power {gamma:.3f}{why_power(gamma)}"
    made = _cause("gamma", said, lambda a: np.power(np.maximum(a, 0.0), gamma))
    return replace(made, strengths=(gamma,))


def _scale(scale: float) -> Cause:
    made = _moving(
        "field_of_view",
        f"the picture is scaled by {scale:.4f} about its centre: the field of view or the aspect is wrong",
        lambda a: zoomed(a, scale),
    )
    return replace(made, strengths=(scale,))


def _encoded(to: Admissible) -> Admissible:
    found = changed(to, encoded)
    return replace(found, tau=np.maximum(found.tau, 2.0 * RELATIVE))


def causes(measured: Measured, to: Admissible) -> Iterator[Cause]:
    """Every cause worth trying for this picture, which ``to`` admits but for it."""
    mean = measured.mean
    bright = max(float(to.value.max(initial=0.0)), 1e-30)
    if float(np.abs(mean).max(initial=0.0)) < POLICY.causes.black * bright:
        yield _black()
        return
    yield from _of_no_strength()
    gain = _median_ratio(mean, to.value, bright)
    if gain is not None:
        yield _gain(gain)
    top = _top(mean, to.value)
    if top is not None:
        yield _cut_off(top)
    gamma = _gamma(mean, to.value, bright)
    if gamma is not None:
        yield _power(gamma)
    for dx, dy in find_shifts(mean, to.value):
        yield _shift(mean, dx, dy)
    scale = find_scale(mean, to.value)
    if scale is not None:
        yield _scale(scale)


def cause_called(name: str, strengths: tuple[float, ...], mean: Floats) -> Cause | None:
    """The cause of that ``name`` in the picture ``mean`` (h, w, 3), made again of its ``strengths``.

    So it can be looked at again at the strength that the judge has fitted. None: there is no such cause.
    """
    if name == "pixel_shift" and len(strengths) == 2:
        return _shift(mean, *strengths)
    of_one = {"light_gain": _gain, "clamped": _cut_off, "gamma": _power, "field_of_view": _scale}
    if name in of_one and len(strengths) == 1:
        return of_one[name](*strengths)
    plain = (_black(), *_of_no_strength())
    return next((cause for cause in plain if cause.name == name and not strengths), None)


def _black() -> Cause:
    return _cause("black", "every pixel is black: no light, no object or no camera", np.zeros_like)


def _of_no_strength() -> Iterator[Cause]:
    for turn in (
        _moving("upside_down", "the picture is upside down", lambda a: a[::-1]),
        _moving("mirrored", "the picture is mirrored left to right", lambda a: a[:, ::-1]),
        _moving("rotated", "the picture is rotated by 180 degrees", lambda a: a[::-1, ::-1]),
    ):
        yield replace(turn, turn=True)
    yield _cause("channels_swapped", "red and blue are exchanged", lambda a: a[..., ::-1])
    yield Cause(
        "srgb_encoded",
        "the picture looks sRGB-encoded, expected linear (write linear values or declare --encoding srgb)",
        _encoded,
        of_values=encoded,
    )
    # The two curves lie near each other, so a picture that went through one and came back by the other looks right.
    yield _cause(
        "decoded_by_power",
        f"an sRGB-encoded picture was decoded by the power {POLICY.causes.power}, not by sRGB's curve",
        lambda a: np.power(encoded(a), POLICY.causes.power),
    )
    yield _cause(
        "encoded_by_power",
        f"a picture that is decoded by sRGB's curve was encoded by the power 1/{POLICY.causes.power}",
        lambda a: decode_srgb(np.power(np.clip(a, 0.0, 1.0), 1.0 / POLICY.causes.power)),
    )


def gain_message(gain: float) -> str:
    """What a gain of the whole picture means in words."""
    return f"gain {gain:.4f}{why_gain(gain) or ': every value is multiplied by it'}"


def why_gain(gain: float) -> str:
    """Which factor a gain may be that is often missing, or ""."""
    for value, why in ((math.pi, ": a 1/pi is missing"), (1 / math.pi, ": a 1/pi too many"), (2 * math.tau, ": 4 pi")):
        if abs(gain / value - 1) < POLICY.causes.near_pi:
            return why
    return ""


def why_power(gamma: float) -> str:
    """Which habit a power of the whole picture may come from, or ""."""
    usual = POLICY.causes.power
    for value, why in (
        (1.0 / usual, f", 1/{usual}: encoded where linear values are expected"),
        (1.0 / usual**2, f", that of 1/{usual} twice: encoded two times"),
        (usual, f", {usual}: decoded once too often"),
    ):
        if abs(gamma / value - 1.0) < POLICY.causes.near_pi:
            return why
    return ""


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
    at = value > POLICY.causes.gain_from * bright
    if at.sum() < POLICY.global_fit.min_pixels:
        return None
    gain = float(np.median(mean[at] / value[at]))
    return gain if gain > 0 and abs(gain - 1) > POLICY.causes.no_gain else None


def _top(mean: Floats, value: Floats) -> float | None:
    """Where values are cut off: what a picture shows of all that should be brighter than its brightest value."""
    above = value > POLICY.causes.cut_off * float(mean.max(initial=0.0))
    return float(np.median(mean[above])) if above.sum() >= POLICY.regression.enough else None


def _gamma(mean: Floats, value: Floats, bright: float) -> float | None:
    clipped = POLICY.causes.clipped
    at = (value > POLICY.global_fit.lit * bright) & (value < clipped) & (mean > POLICY.causes.dark) & (mean < clipped)
    if at.sum() < POLICY.global_fit.min_pixels:
        return None
    gamma = float(np.median(np.log(mean[at]) / np.log(value[at])))
    most = POLICY.causes.most_gamma
    return gamma if 1.0 / most < gamma < most and abs(gamma - 1) > POLICY.causes.no_gamma else None


def find_shifts(mean: Floats, value: Floats) -> Iterator[tuple[float, float]]:
    """Shifts (right, down) in pixels worth trying: phase correlation's and none at all, each refined on the picture."""
    from scipy import ndimage
    from skimage.registration import phase_cross_correlation

    if min(value.shape[:2]) < POLICY.causes.least_side:
        return
    # of the gradients: the border that a shift brings in would pull smooth shading towards no shift at all
    a, b = (np.hypot(*(ndimage.sobel(each.sum(axis=2), axis) for axis in (0, 1))) for each in (value, mean))
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return
    starts = [(0.0, 0.0)]
    for upsample in (1, POLICY.causes.upsampling):
        move, _, _ = phase_cross_correlation(b, a, upsample_factor=upsample, normalization=None)
        starts.append((float(move[1]), float(move[0])))
    refined = [refined_shift(mean, value, start) for start in dict.fromkeys(starts)]
    ranked: list[tuple[float, tuple[float, float]]] = []
    for found in (*refined, *starts):
        new = all(max(abs(found[0] - x), abs(found[1] - y)) > POLICY.causes.same_shift for _, (x, y) in ranked)
        if new and POLICY.causes.least_shift < max(map(abs, found)) < POLICY.causes.farthest * min(a.shape):
            off = np.abs(shifted(value, *found) - mean)[~brought_in(a.shape, *found)]
            ranked.append((float(off.mean()), found))
    for _, found in sorted(ranked)[: POLICY.causes.shifts_tried]:
        yield found


def refined_shift(mean: Floats, value: Floats, start: tuple[float, float]) -> tuple[float, float]:
    """The shift (right, down) near ``start`` by which ``value`` fits ``mean`` best, a gain aside: by Gauss and Newton.

    Pixels that differ most, an artifact or a limitation, weigh less (Huber), and the border that the shift brings in
    has no say. Where it leads away from ``start`` by more than a pixel, ``start`` was better.
    """
    from scipy import ndimage

    a, b = (np.asarray(each.sum(axis=2), np.float64) for each in (value, mean))
    x, y = start
    coefficients = ndimage.spline_filter(a, order=3)  # bilinear blurs by what it moves: it pulls to whole pixels
    for _ in range(POLICY.causes.shift_turns):
        moved = ndimage.shift(coefficients, (y, x), order=3, mode="nearest", prefilter=False)
        inner = ~brought_in(a.shape, x, y)
        down, right = np.gradient(moved)
        terms = np.stack([each[inner] for each in (-right, -down, moved)], axis=1)
        off = (b - moved)[inner]
        weight = np.ones_like(off)
        step: Floats = np.zeros(3)
        for _ in range(3):
            normal = terms.T @ (terms * weight[:, None])
            normal += 1e-9 * max(float(np.trace(normal)), 1e-30) * np.eye(3)
            step = np.linalg.solve(normal, terms.T @ (off * weight))
            left = np.abs(off - terms @ step)
            # of what is left where there is an edge: half of most pictures is black and left with nothing
            told = left[left > POLICY.causes.least_difference * float(a.max())]
            scale = POLICY.regression.huber * DEVIATION * float(np.median(told)) if told.size else math.inf
            weight = np.minimum(1.0, scale / np.maximum(left, 1e-30))
        x, y = x + float(np.clip(step[0], -0.5, 0.5)), y + float(np.clip(step[1], -0.5, 0.5))
        if max(abs(x - start[0]), abs(y - start[1])) > POLICY.causes.farthest_refined or not math.isfinite(x + y):
            return start
        if max(abs(step[:2])) < POLICY.causes.settled:
            break
    return x, y


def brought_in(shape: tuple[int, ...], right: float, down: float) -> Bools:
    """The pixels (h, w) at the border that a shift brings in from outside, of which nothing is known."""
    result = np.zeros(shape[:2], np.bool_)
    x, y = (
        math.ceil(abs(each) - POLICY.causes.same_shift) + 1 if abs(each) > POLICY.causes.same_shift else 0
        for each in (right, down)
    )
    result[:, : x if right > 0 else 0] = True
    result[:, shape[1] - (x if right < 0 else 0) :] = True
    result[: y if down > 0 else 0] = True
    result[shape[0] - (y if down < 0 else 0) :] = True
    return result


def without_border(to: Admissible, mean: Floats, right: float, down: float) -> Admissible:
    """``to``, which admits whatever ``mean`` (h, w, 3) shows at the border that a shift brings in."""
    border = brought_in(to.edge.shape, right, down)[..., None]
    value, lo, hi = (np.where(border, mean, each) for each in (to.value, to.lo, to.hi))
    return replace(to, value=value, lo=lo, hi=hi)


def find_scale(mean: Floats, value: Floats) -> float | None:
    """The magnification about the centre that fits best, by a search on every fourth pixel and a refinement."""
    a, b = (each.sum(axis=2, keepdims=True) for each in (value, mean))

    def misfit(scale: float, step: int) -> float:
        return float(np.abs(zoomed(a, scale, step) - b[::step, ::step]).mean())

    coarse = np.geomspace(0.5, 2.0, POLICY.causes.zoom_steps)
    best = float(coarse[int(np.argmin([misfit(each, POLICY.causes.zoom_stride) for each in coarse]))])
    aside = POLICY.causes.zoom_fine
    fine = best * np.linspace(1.0 - aside, 1.0 + aside, POLICY.causes.zoom_fine_steps)
    best = float(fine[int(np.argmin([misfit(each, 2) for each in fine]))])
    return best if abs(best - 1) > POLICY.causes.no_zoom else None
