"""Step 7: the numbers that say when no picture can tell."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Hesitation:
    """The numbers of metrics/hesitation.py."""

    blind: float = number(3.0, "standard errors", "of a tile's mean must fit into the tolerance", "convention", "word")
    untellable: float = number(
        0.25,
        "of the lit pixels",
        "where rounding may take light from more, no picture can tell acne",
        "convention",
        "word",
    )
    enough_bright: int = number(256, "pixels", "fewer bright ones cannot look noisy", "convention", "word")
    least_wrong: float = number(
        0.05,
        "share",
        "of the bright pixels that must be wrong in a picture that looks noisy; and of those that must be too bright, "
        "and too dark: else it is acne, or holes",
        "convention",
        "word",
    )
    most_alike: float = number(
        0.3, "correlation", "of neighbours in a picture that looks noisy, at most", "convention", "word"
    )
    most_biased: float = number(
        0.3, "standard deviations", "of the mean deviation in a picture that looks noisy, at most", "convention", "word"
    )
