"""How far a picture is from the reference, in several measures, and what its smallest error comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration
from notabug.bench.stability_kinds import edges
from notabug.metrics.image_filters import widened
from notabug.references.tracer.envelope import Envelope
from notabug.references.tracer.precision import ABSOLUTE, RELATIVE
from notabug.scenes_usd.srgb import encode_srgb

Floats = npt.NDArray[np.floating]

MEASURES = ("relmse", "flip", "flip_p99", "ciede2000", "wrong")
_SMALL = 1e-2  # keeps relMSE finite in black regions (Rousselle, Knaus and Zwicker 2011)
UNIT32 = 2.0**-24


def errors(picture: Floats, reference: Floats) -> dict[str, float]:
    """Every measure of MEASURES; 0 for equal pictures.

    relmse: mean of (I - R)^2 / (R^2 + 0.01). flip, flip_p99: mean and 99th percentile of LDR-FLIP. ciede2000: mean
    colour difference of the sRGB pictures, 1 about just noticeable. wrong: share of the pixels beyond the tolerance.
    """
    from skimage.color import deltaE_ciede2000, rgb2lab

    from notabug.metrics.perceive import flip

    map_ = flip(reference, picture)
    labs = [rgb2lab(encode_srgb(np.clip(each, 0.0, 1.0))) for each in (reference, picture)]
    off = np.abs(picture - reference) > RELATIVE * np.abs(reference) + ABSOLUTE
    return {
        "relmse": relmse(picture, reference),
        "flip": float(map_.mean()),
        "flip_p99": float(np.percentile(map_, 99)),
        "ciede2000": float(deltaE_ciede2000(*labs).mean()),
        "wrong": float(off.any(axis=2).mean()),
    }


def relmse(picture: Floats, reference: Floats) -> float:
    """Mean of (I - R)^2 / (R^2 + 0.01).

    >>> round(relmse(np.array([1.1]), np.array([1.0])), 6)
    0.009901
    """
    return float(((picture - reference) ** 2 / (reference**2 + _SMALL)).mean())


@dataclass(frozen=True, slots=True)
class Floor:
    """The relative error that no number of samples removes, at the centres of smooth lit pixels.

    ``expected`` is the median that the declared number format alone gives; ``cause`` says in words what it comes from.
    """

    median: float
    p99: float
    expected: float
    cause: str


def floor(picture: Floats, of: Envelope, declaration: Declaration, exponent: float = 1.0) -> Floor:
    """The floor of a picture of pixel centres against the reference ``of`` (its ``point``).

    Rounding to steps of q is off by q/4 at the median. A float32 renderer rounds in every operation of a shader, so a
    few unit roundoffs are expected of it, times the ``exponent`` of a highlight; one that computes in float64 and
    writes float32 is off by u/2.
    """
    smooth = ~widened(edges(of), 1) & (of.point > 0.02).all(axis=2)
    value = of.point[smooth]
    if not value.size:
        return Floor(0.0, 0.0, 0.0, "no smooth lit pixels to measure it on")
    relative = np.abs(picture[smooth] - value) / value
    median, p99 = (float(np.percentile(relative, each)) for each in (50, 99))
    if not declaration.relative_quantum:
        expected = float(np.median(declaration.quantum / 4.0 / value))
        name = f"output in steps of 1/{round(1 / declaration.quantum)}"
    elif declaration.quantum >= 2.0**-12:
        expected, name = declaration.quantum / 2.0, "half-float output"
    elif declaration.precision == "float64":
        expected, name = UNIT32 / 2.0, "float32 output of float64 arithmetic"
    else:
        expected, name = 4.0 * UNIT32 * exponent, "float32 arithmetic"
        if exponent > 1.0:
            name += ", multiplied by the highlight's exponent"
    if median <= 4.0 * expected:
        return Floor(median, p99, expected, name)
    return Floor(median, p99, expected, f"more than {name} explains")
