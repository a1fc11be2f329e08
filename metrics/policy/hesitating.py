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
    regular: float = number(
        16.0 / 15.0,
        "ratio",
        "of the variance of all places of an even slope to that of 4 x 4 subsamples",
        "derived: 16 / 15",
        "word",
    )
    chance: float = number(
        1e-6, "chance", "of noise to go as far as its bound anywhere in a picture", "convention", "word"
    )
    branches: int = number(
        3,
        "rays",
        "that go on from a surface, of which a renderer may follow one and weigh it by their number",
        "derived: the surface itself, its mirror ray and its refracted ray",
        "word",
    )
    enough_bright: int = number(256, "pixels", "fewer bright ones cannot look noisy", "convention", "word")
    least_wrong: float = number(
        0.05, "of the bright pixels", "that must be wrong in a picture that looks noisy", "convention", "word"
    )
    one_sided: float = number(
        0.05,
        "of the wrong pixels",
        "that must be too bright in a picture that looks noisy, and too dark: else it is acne, or holes",
        "convention",
        "word",
    )
    most_alike: float = number(
        0.3, "correlation", "of neighbours in a picture that looks noisy, at most", "convention", "word"
    )
    most_biased: float = number(
        0.3, "standard deviations", "of the mean deviation in a picture that looks noisy, at most", "convention", "word"
    )
