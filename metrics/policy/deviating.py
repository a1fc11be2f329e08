"""Step 4: the numbers that say which pixels and tiles deviate."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Significance:
    """The numbers of metrics/significance.py."""

    rate: float = number(
        0.01, "share", "false discovery rate, of pixels and of tiles", "convention: Benjamini and Hochberg 1995", "word"
    )
    false: int = number(
        2,
        "pixels",
        "that may be false discoveries",
        "derived: at `significance.rate` one right picture in 100 has one",
        "word",
    )
    certain: float = number(
        1e-6,
        "chance in the whole picture",
        "a pixel below it is no false discovery; and of noise to go as far as its bound",
        "convention",
        "word",
    )
    floor: float = number(
        0.02,
        "of the tolerance",
        "a smaller standard error is raised to it: few seeds may agree by chance",
        "convention",
        "word",
    )
    small: int = number(4, "pixels", "side of a small tile", "convention", "word")
    fewest: int = number(
        16,
        "pixels",
        "a tile of the side `noise.tile` with fewer of them tells nothing; a small one with fewer than half of its own",
        "convention",
        "word",
    )
    outward: float = number(
        0.4,
        "standard errors",
        "by which noise drives a value at the end of an interval out of it, on average",
        "derived: the mean of the positive part of a normal variable, (2 pi)^(-1/2)",
        "word",
    )


@dataclass(frozen=True, slots=True)
class Excused:
    """The numbers of metrics/excused.py."""

    near: int = number(2, "pixels", "from an edge, within which a wrong pixel may be excused", "convention", "word")
    around: int = number(4, "pixels", "as far lies what a stray ray may see", "convention", "word")
    pair: int = number(
        2,
        "pixels",
        "the largest group of touching pixels that chance makes",
        "derived: groups of three occur in 1 of 1,000 pictures at 400 edge pixels, 20 N `excused.rate`^3",
        "word",
    )
    rate: float = number(
        5e-3,
        "chance",
        "of a pixel along an edge to be wrong by last bits",
        "measured: POV-Ray 3 of 357 at most, Mitsuba 3 of 1,101, ours none; "
        "this project's scenes at 64 x 64, two views each",
        "word",
    )
    sure: float = number(1e-3, "chance", "of more such pixels than are excused", "convention", "word")
    budget: int = number(
        8, "pixels", "excused at most, however long the edges are", "measured: 5 at most in right pictures", "word"
    )
