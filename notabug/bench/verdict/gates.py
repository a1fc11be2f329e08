"""The comparison gates that rendering teams use, with the numbers that their projects publish.

A gate scores a picture against a reference: 1 and more fails it at its own threshold, and more is worse. Those that no
project uses with a fixed number (``own`` False) are scored by the metric itself; for them only a best threshold exists.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.srgb import encode_srgb

Floats = npt.NDArray[np.floating]

VARIANCE_FLOOR = 1e-4  # Mitsuba's
SLACK = 0.0025  # share of pixel channels that Mitsuba's test may fail
_YIQ = np.array([[0.299, 0.587, 0.114], [0.596, -0.274, -0.322], [0.211, -0.523, 0.312]])
_YIQ_WEIGHTS = np.array([0.5053, 0.299, 0.1957])  # Kotsarenko and Ramos 2010, as pixelmatch has them
_YIQ_LARGEST = 35215.0 / 255.0**2  # of that distance


@dataclass(frozen=True, eq=False)
class Pair:
    """A picture and its reference, (h, w, 3) linear, and the variance of the picture's mean where it is known."""

    picture: Floats
    reference: Floats
    variance: Floats

    @cached_property
    def encoded(self) -> tuple[Floats, Floats]:
        """Both as 8-bit sRGB, 0 to 1."""
        return eight_bit(self.picture), eight_bit(self.reference)

    @cached_property
    def ciede(self) -> Floats:
        """CIEDE2000 (h, w) of the encoded pictures."""
        from skimage import color

        a, b = (color.rgb2lab(each) for each in self.encoded)
        return np.asarray(color.deltaE_ciede2000(a, b))

    @cached_property
    def ictcp(self) -> Floats:
        """Delta E_ITP (h w,)."""
        from notabug.metrics import perceive

        return perceive.delta_itp(self.reference.reshape(-1, 3), self.picture.reshape(-1, 3))

    @cached_property
    def yee(self) -> int:
        """How many pixels Yee's metric sees a difference in."""
        import OpenImageIO as oiio  # noqa: N813 - its own name for itself

        result = oiio.CompareResults()
        a, b = (oiio.ImageBuf(np.ascontiguousarray(each, np.float32)) for each in (self.picture, self.reference))
        oiio.ImageBufAlgo.compare_Yee(a, b, result)
        return int(result.nfail)


@dataclass(frozen=True, slots=True)
class Gate:
    """A gate's name, its score, and whether 1 is its owner's threshold."""

    name: str
    score: Callable[[Pair], float]
    own: bool = True


def gates() -> tuple[Gate, ...]:
    """Every gate."""
    return (
        Gate("Cycles", _failing(0.016, 0.01, srgb=True)),
        Gate("Cycles, volumes", _failing(0.048, 0.03, srgb=True)),
        Gate("EEVEE", _failing(4 / 255, 0.0008, srgb=True)),
        Gate("Storm", _perceptual(1.0, 0.01)),
        Gate("OpenUSD, strict", _perceptual(0.05, 0.0003)),
        Gate("OpenImageIO", _failing(0.008, 0.0004, hard=0.024)),
        Gate("OSL cornell", _failing(0.01, 0.01, hard=0.01, relative=0.001)),
        Gate("arnold-usd", _failing(1e-5, 0.33334, hard=0.0157)),
        Gate("appleseed", lambda pair: float((_off(pair) > 2.001 / 255).sum()) / 9.0),
        Gate("Filament", _failing(5 / 255, 0.001, srgb=True)),
        Gate("three.js", lambda pair: _more(float((_yiq(pair) > 0.1**2 * _YIQ_LARGEST).mean()), 0.001)),
        Gate("Khronos glTF", _khronos),
        Gate("Mitsuba z-test", _mitsuba),
        Gate("mean FLIP", _flip, own=False),
        Gate("SSIM", _ssim, own=False),
        Gate("CIEDE2000, mean", lambda pair: float(pair.ciede.mean()), own=False),
        Gate("CIEDE2000, 99 %", lambda pair: float(np.percentile(pair.ciede, 99)), own=False),
        Gate("ICtCp, mean", lambda pair: float(pair.ictcp.mean()), own=False),
        Gate("ICtCp, 99 %", lambda pair: float(np.percentile(pair.ictcp, 99)), own=False),
        Gate("RMSE", lambda pair: math.sqrt(float(((pair.picture - pair.reference) ** 2).mean())), own=False),
    )


def eight_bit(linear: Floats) -> Floats:
    """Linear to 8-bit sRGB and back to 0..1 (still encoded)."""
    return np.asarray(np.round(encode_srgb(np.clip(linear, 0.0, 1.0)) * 255.0) / 255.0)


def _more(share: float, allowed: float) -> float:
    """``share`` as a score: above ``allowed`` it exceeds 1; at ``allowed`` it does not."""
    return share / allowed * (1.0 - 1e-9)


def _failing(threshold: float, share: float, *, srgb: bool = False, hard: float = 0.0, relative: float = 0.0) -> (
    Callable[[Pair], float]
):  # fmt: skip
    """idiff and oiiotool --fail, --failpercent, --hardfail, --failrelative, by OpenImageIO's own comparison."""
    epsilon = 1e-6  # 8-bit steps are multiples of 1/255: equal to the threshold is not above it

    def score(pair: Pair) -> float:
        import OpenImageIO as oiio  # noqa: N813 - its own name for itself

        first, second = pair.encoded if srgb else (pair.picture, pair.reference)
        a, b = (oiio.ImageBuf(np.ascontiguousarray(each, np.float32)) for each in (first, second))
        result = oiio.ImageBufAlgo.compare(a, b, threshold + epsilon, threshold, relative, relative)
        failed = _more(result.nfail / (first.shape[0] * first.shape[1]), share)
        return max(failed, result.maxerror / hard * (1.0 - 1e-6)) if hard else failed

    return score


def _perceptual(threshold: float, share: float) -> Callable[[Pair], float]:
    """idiff -p: as without, and by Yee's metric too (Yee, Pattanaik and Greenberg 2001)."""
    plain = _failing(threshold, share)

    def score(pair: Pair) -> float:
        return max(plain(pair), _more(pair.yee / (pair.picture.shape[0] * pair.picture.shape[1]), share))

    return score


def _off(pair: Pair) -> Floats:
    a, b = pair.encoded
    return np.abs(a - b)


def _yiq(pair: Pair) -> Floats:
    a, b = pair.encoded
    return np.asarray(((a - b) @ _YIQ.T) ** 2 @ _YIQ_WEIGHTS)


def _khronos(pair: Pair) -> float:
    """Root mean square of the YIQ distance in decibels; -22 dB is the limit."""
    rms = math.sqrt(float(_yiq(pair).mean()) / _YIQ_LARGEST)
    return float(10.0 ** ((20.0 * math.log10(max(rms, 1e-12)) + 22.0) / 20.0))


def _mitsuba(pair: Pair) -> float:
    """The share of pixel channels that fail a two-sided z-test at 1 % with Sidak's correction, over the slack."""
    from scipy import special

    z = np.abs(pair.picture - pair.reference) / np.sqrt(np.maximum(pair.variance, VARIANCE_FLOOR))
    p = 2.0 * special.ndtr(-z)
    alpha = 1.0 - (1.0 - 0.01) ** (1.0 / pair.picture[..., 0].size)
    return _more(float((p < alpha).mean()), SLACK)


def _flip(pair: Pair) -> float:
    from notabug.metrics import perceive

    return float(perceive.flip(pair.reference, pair.picture).mean())


def _ssim(pair: Pair) -> float:
    from skimage.metrics import structural_similarity

    a, b = pair.encoded
    return 1.0 - float(structural_similarity(a, b, channel_axis=2, data_range=1.0))
