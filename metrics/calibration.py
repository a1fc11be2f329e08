"""Before the steps of docs/judge.md: what stands between a picture of the calibration card and the card.

It is read off in numbers and said in words.

A picture is read in steps, each on what the one before has undone: orientation and order of channels by correlation, a
shift by phase correlation, a magnification by search, then gain and gamma by a line in logarithms. Two faults at once,
such as upside down and sRGB-encoded, are both found. Nothing here corrects a picture that is judged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.metrics.causes import encoded, find_scale, find_shifts, why_gain, why_power, zoomed
from notabug.metrics.formulas import BOX_DEVIATION
from notabug.metrics.image_checks import invalid
from notabug.metrics.policy import POLICY
from notabug.references.models.camera import half_if_near
from notabug.references.tracer.envelope import Envelope
from notabug.references.tracer.precision import RELATIVE

Floats = npt.NDArray[np.floating]


_TURNS = {"": (1, 1), "upside_down": (-1, 1), "mirrored": (1, -1), "rotated": (-1, -1)}
_ADVICE = {
    "upside_down": "upside down: write the top row first, or turn the camera's up round",
    "mirrored": "mirrored: the camera's right is its x axis",
    "rotated": "rotated by 180 degrees: turn both axes of the picture round",
}


@dataclass(frozen=True, slots=True)
class Reading:
    """What a picture of the card shows.

    ``orientation`` is "" or a key of ``_ADVICE``; ``channels`` the card's channels in the picture's order ("rgb");
    ``gain`` and ``gamma`` those of value = gain * card ** gamma; ``srgb`` that the transfer is sRGB's; ``shift`` in
    pixels (right, down); ``scale`` the magnification; ``width`` the standard deviation of the pixel filter in pixels
    (a box has 0.29); ``noise`` the deviation between seeds over the mean; ``repeats`` whether the same seed gave the
    same picture, None where that was not tried. ``causes`` are named faults and ``sentence`` says what to change.
    """

    orientation: str = ""
    channels: str = "rgb"
    gain: float = 1.0
    gamma: float = 1.0
    srgb: bool = False
    shift: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0
    width: float = 0.0
    noise: float = 0.0
    repeats: bool | None = None
    causes: tuple[str, ...] = ()
    sentence: str = ""


def read_card(
    pictures: Sequence[Floats], card: Envelope, declaration: Declaration, repeats: bool | None = None
) -> Reading:
    """Read ``pictures`` (seeds, each (h, w, 3) linear) of the scene whose reference is ``card``."""
    value = np.asarray(card.point if declaration.filter == "point" else card.mean, np.float64)
    wrong = invalid(pictures, *value.shape[:2])
    if wrong is not None:
        return Reading(repeats=repeats, causes=(wrong.name,), sentence=wrong.message)
    mean: Floats = np.asarray(np.stack(pictures).mean(axis=0, dtype=np.float64))
    if float(np.ptp(mean)) <= POLICY.causes.black * float(value.max()):
        return _blank(mean, value, repeats)
    likeness, orientation, channels = _orientation(mean, value)
    down, across = _TURNS[orientation]
    upright = mean[::down, ::across][..., ["rgb".index(channel) for channel in channels]]
    if likeness < POLICY.calibration.like:
        return _unlike(mean, value, repeats)
    shift, scale, moved = _place(upright, value)
    shift = (half_if_near(shift[0]), half_if_near(shift[1]))
    gain, gamma, srgb, fitted, misfit = _transfer(upright, moved)
    noise = _noise(pictures, mean)
    reading = Reading(
        orientation,
        channels,
        gain,
        gamma,
        srgb,
        shift,
        scale,
        width=_width(upright, fitted),
        noise=noise,
        repeats=repeats,
    )
    if misfit > 2.0 * RELATIVE:
        return reading
    of_points = declaration.filter != "point" and _shows_points(upright, card)
    said = dict(_faults(reading, declaration, of_points=of_points))
    return Reading(
        **{name: getattr(reading, name) for name in Reading.__slots__ if name not in ("causes", "sentence")},
        causes=tuple(said),
        sentence=("the picture is " + "; it is ".join(said.values())) if said else "",
    )


def _unlike(mean: Floats, value: Floats, repeats: bool | None) -> Reading:
    """The reading of a picture that no turn makes the card: its two axes are exchanged, or it is another one."""
    if mean.shape[0] == mean.shape[1] and _orientation(mean.swapaxes(0, 1), value)[0] >= POLICY.calibration.like:
        what = "u and v of the texture, or the picture's rows and columns, are exchanged"
        return Reading(repeats=repeats, causes=("axes_exchanged",), sentence=f"the card lies on its side: {what}")
    what = "the picture is not one of the card: does the renderer read the scene?"
    return Reading(repeats=repeats, causes=("not_the_card",), sentence=what)


def _blank(mean: Floats, value: Floats, repeats: bool | None) -> Reading:
    if float(mean.max()) < POLICY.causes.black * float(value.max()):
        return Reading(repeats=repeats, causes=("black",), sentence="the picture is black: no light, object or camera")
    what = "the picture is of one colour: the card is not in view, or not lit"
    return Reading(repeats=repeats, causes=("one_colour",), sentence=what)


def _faults(reading: Reading, declaration: Declaration, *, of_points: bool) -> list[tuple[str, str]]:
    """Name and words of each fault, the coarsest first; ``of_points``: each pixel shows its centre and nothing else."""
    found: list[tuple[str, str]] = []
    if reading.orientation:
        found.append((reading.orientation, _ADVICE[reading.orientation]))
    if reading.channels != "rgb":
        found.append(("channels_swapped", f"in the channel order {reading.channels}: write red, green, blue"))
    x, y = reading.shift
    if max(abs(x), abs(y)) > POLICY.calibration.shift:
        where = f"({x:+.2f}, {y:+.2f})"
        found.append(("pixel_shift", f"shifted by {where} pixels (right, down): pixel centres lie at +0.5"))
    if abs(reading.scale - 1.0) > POLICY.causes.no_zoom:
        wrong = f"magnified by {reading.scale:.4f}: the field of view is 2 atan(tan_x) across and 2 atan(tan_y) high"
        found.append(("field_of_view", wrong))
    if reading.srgb:
        found.append(("srgb_encoded", 'sRGB-encoded: write linear values, or declare encoding = "srgb"'))
    elif abs(reading.gamma - 1.0) > POLICY.causes.no_gamma:
        power = f"{reading.gamma:.3f}{why_power(reading.gamma)}"
        found.append(("gamma", f"raised to the power {power}: write linear values"))
    if not reading.srgb and abs(reading.gain - 1.0) > RELATIVE:
        found.append(("light_gain", f"{reading.gain:.4f} times as bright as it should be{why_gain(reading.gain)}"))
    widest = {
        "point": POLICY.calibration.point_width,
        "box": POLICY.calibration.box_width,
        "tent": POLICY.calibration.tent_width,
    }
    if reading.width > widest.get(declaration.filter, math.inf) and not found:
        found.append(("filter_undeclared", _too_blurred(reading.width, declaration.filter)))
    if of_points and declaration.filter in widest | {"gaussian": 0.0} and not found:
        found.append(("filter_undeclared", _too_sharp(declaration.filter)))
    if not declaration.noisy and reading.repeats is False:
        found.append(("noise_undeclared", "another one when it is drawn again: declare noisy = true and pass {seed}"))
    return found


def _too_blurred(width: float, said: str) -> str:
    """What to change where edges are softer than those of the filter that is ``said``."""
    wider = {"point": '"box", "tent" or "gaussian"', "box": '"tent" or "gaussian"'}.get(said, '"gaussian"')
    return (
        f"softer at edges than the declaration says: a pixel is the mean of what lies within some {width:.2f} pixels "
        f'of its centre (a box filter has 0.29, a tent 0.41), but filter = "{said}" is declared: declare the filter '
        f"that the renderer has, {wider} with its radius, or switch its filter off"
    )


def _too_sharp(said: str) -> str:
    """What to change where each pixel shows one point, and the filter that is ``said`` would mix several."""
    return (
        f"sharper at edges than the declaration says: each pixel shows the colour at its centre alone, but "
        f'filter = "{said}" is declared, which mixes colours along edges: declare filter = "point", or draw more '
        "samples per pixel"
    )


def _shows_points(mean: Floats, card: Envelope) -> bool:
    """Whether along edges of the ``card`` most pixels of ``mean`` show their centres, and not means over pixels."""
    point, over = (np.asarray(each, np.float64) for each in (card.point, card.mean))
    tolerance = 2.0 * RELATIVE * float(point.max())
    at = np.abs(point - over).max(axis=2) > tolerance
    return bool(at.any()) and float(np.median(np.abs(mean - point).max(axis=2)[at])) <= tolerance


def _orientation(mean: Floats, value: Floats) -> tuple[float, str, str]:
    """The largest correlation, at any magnification, and the turn and the order of channels that give it."""
    from scipy import ndimage

    small = ndimage.uniform_filter(value, (4, 4, 1))[2::4, 2::4]
    sizes = [small] + [zoomed(small, each) for each in np.geomspace(0.6, 1.7, 23)]
    targets = np.stack([_normal(size) for size in sizes])
    best = (-2.0, "", "rgb")
    for name, (down, across) in _TURNS.items():
        turned = ndimage.uniform_filter(mean[::down, ::across], (4, 4, 1))[2::4, 2::4]
        for order in permutations("rgb"):
            other = _normal(turned[..., ["rgb".index(each) for each in order]])
            likeness = float((targets @ other).max())
            if likeness > best[0] + 1e-9:
                best = (likeness, name, "".join(order))
    return best


def _normal(picture: Floats) -> Floats:
    """The picture as a vector of mean 0 and length 1, so that a product of two is their correlation."""
    flat = (picture - picture.mean()).ravel()
    return np.asarray(flat / max(float(np.linalg.norm(flat)), 1e-30))


def _place(mean: Floats, value: Floats) -> tuple[tuple[float, float], float, Floats]:
    """Shift, magnification, and ``value`` under them: whichever of the two, or neither, brings it nearest."""
    from scipy import ndimage

    gain = float(np.median(mean[_smooth(value)] / value[_smooth(value)])) if _smooth(value).any() else 1.0
    scaled = value * gain
    tried: list[tuple[float, tuple[float, float], float, Floats]] = [(_misfit(mean, scaled), (0.0, 0.0), 1.0, value)]
    for dx, dy in find_shifts(mean, scaled):
        moved = np.asarray(ndimage.shift(value, (dy, dx, 0), order=3, mode="nearest"))  # bilinear would blur it
        tried.append((_misfit(mean, moved * gain), (dx, dy), 1.0, moved))
    scale = find_scale(mean, scaled)
    if scale is not None:
        moved = zoomed(value, scale)
        tried.append((_misfit(mean, moved * gain), (0.0, 0.0), scale, moved))
    least = min(tried, key=lambda each: each[0])
    _, shift, scale_found, moved = least if least[0] < 0.7 * tried[0][0] else tried[0]
    return shift, scale_found, moved


def _misfit(a: Floats, b: Floats) -> float:
    """The mean difference of the pictures' gradients: where their edges lie, whatever their tones are."""
    return float(sum(np.abs(np.diff(a, axis=axis) - np.diff(b, axis=axis)).mean() for axis in (0, 1)))


def _transfer(mean: Floats, value: Floats) -> tuple[float, float, bool, Floats, float]:
    """Gain, gamma, whether it is sRGB's curve, ``value`` under the transfer, and what that leaves.

    The last is the error of the worst tone, over white: a wrong albedo is no gamma. Values at the top may be clipped
    and count for nothing.
    """
    at = _smooth(value) & (mean > 1e-4 * mean.max()) & (mean < 0.999 * mean.max())
    if at.sum() < POLICY.global_fit.min_pixels:
        return 1.0, 1.0, False, value, math.inf
    x, y = np.log(value[at]), np.log(mean[at])
    gamma = float(np.cov(x, y)[0, 1] / max(float(x.var(ddof=1)), 1e-30))
    gamma = 1.0 if abs(gamma - 1.0) < POLICY.causes.no_gamma else gamma
    gain = float(np.exp(np.median(y - gamma * x)))
    power = gain * np.maximum(value, 0.0) ** gamma
    as_srgb = encoded(value)
    tone = np.digitize(x, np.linspace(x.min(), x.max(), POLICY.calibration.tones))
    left = [_worst_tone((mean - each)[at], tone) / float(mean.max()) for each in (power, as_srgb)]
    if left[1] < 0.5 * left[0]:
        return 1.0, 1.0, True, as_srgb, left[1]
    return gain, gamma, False, power, left[0]


def _worst_tone(error: Floats, tone: npt.NDArray[np.integer]) -> float:
    """The largest median ``error`` (n,) of the tones (n,) that enough values have."""
    found = [abs(float(np.median(error[tone == each]))) for each in np.unique(tone) if (tone == each).sum() >= 32]
    return max(found, default=math.inf)


def _smooth(value: Floats) -> npt.NDArray[np.bool_]:
    """Values (h, w, 3) that are bright enough and whose neighbourhood, three pixels wide each way, is of one tone."""
    from scipy import ndimage

    spread = ndimage.maximum_filter(value, (7, 7, 1)) - ndimage.minimum_filter(value, (7, 7, 1))
    return np.asarray((value > 0.01 * value.max()) & (spread.max(axis=2, keepdims=True) < 0.02 * value.max()))


def _width(mean: Floats, value: Floats) -> float:
    """The standard deviation of the filter: of the Gaussian that, over the box that ``value`` has, fits ``mean``."""
    from scipy import ndimage

    widths = np.linspace(0.0, 2.4, 25)
    misfits = [_misfit(mean, ndimage.gaussian_filter(value, (width, width, 0))) for width in widths]
    best = int(np.argmin(misfits))
    # dots are no blur, though a blur hides them
    if best == len(widths) - 1 or misfits[best] > POLICY.calibration.blurred * misfits[0]:
        return BOX_DEVIATION
    return math.hypot(BOX_DEVIATION, float(widths[best]))


def _noise(pictures: Sequence[Floats], mean: Floats) -> float:
    if len(pictures) < 2:
        return 0.0
    deviation = np.std(np.stack(pictures), axis=0, ddof=1)
    lit = mean > 0.01 * mean.max()
    noise = float((deviation[lit] / mean[lit]).mean()) if lit.any() else 0.0
    return noise if noise > POLICY.calibration.noise else 0.0
