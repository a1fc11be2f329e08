"""Steps 9 and 10: the numbers of what an eye sees, and of what a verdict lists."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Perceive:
    """The numbers of metrics/perceive.py."""

    white: float = number(100.0, "cd/m2", "shown for the value 1.0", "convention: a display's usual white", "visible")
    pixels_per_degree: float = number(
        67.0,
        "pixels a degree",
        "at which FLIP looks",
        "derived: FLIP's default, .7 m from a display .7 m wide of 3840 pixels",
        "visible",
    )
    reach: int = number(
        10, "pixels", "that FLIP's filters reach", "derived: three standard deviations of the widest", "time"
    )


@dataclass(frozen=True, slots=True)
class Judge:
    """The numbers of metrics/judge.py."""

    regions: int = number(12, "boxes", "that a finding lists at most", "convention", "nothing")
    rel_mse: float = number(
        1e-2,
        "linear value squared",
        "added to the square of the reference in relMSE",
        "convention: the usual one",
        "nothing",
    )
