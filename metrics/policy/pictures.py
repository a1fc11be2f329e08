"""Steps 1 and 2: the numbers by which a picture is one, and by which seeds tell their noise."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class ImageChecks:
    """The numbers of metrics/image_checks.py."""

    negative: float = number(
        -1e-6, "linear value", "a pixel below it is negative", "convention: rounding of a renderer's own sums", "word"
    )
    largest: float = number(
        1e15,
        "linear value",
        "a larger pixel counts as infinite",
        "derived: 256 squares of it are near the largest float32",
        "word",
    )


@dataclass(frozen=True, slots=True)
class Noise:
    """The numbers of metrics/noise.py."""

    tile: int = number(16, "pixels", "side of a tile over which means are taken", "convention", "word")
    outlier: float = number(
        10.0,
        "ratio of variances",
        "a pixel so much noisier than its 24 neighbours keeps its own variance",
        "derived: F(K - 1, 24 (K - 1)) exceeds it with a chance of 1e-5 at four seeds",
        "word",
    )
    reach: int = number(
        2,
        "pixels",
        "variances are pooled over a square that reaches so far from a pixel: 5 x 5. "
        "Half of its pixels are degrees of freedom, for each seed beyond the first",
        "convention",
        "word",
    )
