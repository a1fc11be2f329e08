"""Before the steps: the numbers by which a picture of the calibration card accuses an adapter."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Calibration:
    """The numbers of metrics/calibration.py."""

    shift: float = number(0.1, "pixels", "a larger shift of the card is a fault of the adapter", "convention", "word")
    like: float = number(0.8, "correlation", "below it the picture does not show the card", "convention", "word")
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
