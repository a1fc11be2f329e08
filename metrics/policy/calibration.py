"""Before the steps: the numbers by which a picture of the calibration card accuses an adapter."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Calibration:
    """The numbers of metrics/calibration.py."""

    gamma: float = number(
        0.01,
        "exponent",
        "a reading of the card whose gamma is farther from 1 is a fault of the adapter; a nearer one is taken for 1",
        "convention",
        "word",
    )
    shift: float = number(0.1, "pixels", "the same for a shift of the picture", "convention", "word")
    scale: float = number(0.003, "ratio", "the same for a magnification", "convention", "word")
    like: float = number(0.8, "correlation", "below it the picture does not show the card", "convention", "word")
    fits: float = number(
        0.008,
        "share of white",
        "what the readings may leave; above, they do not describe the picture and accuse nobody",
        "convention: twice the tolerance",
        "word",
    )
    tones: int = number(
        32,
        "steps",
        "the card's values are sorted into so many, of equal ratio, to look for the worst tone",
        "convention",
        "word",
    )
    noise: float = number(
        1e-4, "relative", "a deviation between seeds that is more than rounding", "convention", "word"
    )
    box: float = number(12.0**-0.5, "pixels", "standard deviation of a box of one pixel", "derived: 12^(-1/2)", "word")
    blurred: float = number(
        0.5, "share", "of the difference at edges that a blur may leave; else it is no blur", "convention", "word"
    )
    point_width: float = number(
        0.35,
        "pixels",
        "standard deviation of the widest pixel filter that may be declared a point",
        "convention",
        "word",
    )
    box_width: float = number(0.4, "pixels", "and a box", "convention: above the .29 of a box of one pixel", "word")
    tent_width: float = number(0.6, "pixels", "and a tent", "convention: above the .41 of a tent of radius 1", "word")
