"""Step 3: the numbers that say what a pixel may show."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Admissible:
    """The numbers of metrics/admissible.py."""

    grid: float = number(
        0.2,
        "of the range in the footprints around",
        "tolerance for what subsamples may miss",
        "measured: 832 clean pictures of the tuning split at 64 x 64, .02 of the pixel's own range gave 82 false "
        "alarms, this 1; derived: an eighth and a tenth of a step, of grids of 4 x 4 and 5 x 5",
        "word",
    )
    edge: float = number(
        0.19,
        "of an edge's step",
        "an edge pixel of a known filter may be off by it",
        "measured: .146 at most in clean pictures of every scene by box, tent and Gaussian, 64 x 64",
        "word",
    )
    enough: int = number(
        16,
        "samples a pixel",
        "with fewer, an edge admits all of its step",
        "convention: with fewer it may be half of the step",
        "word",
    )
    side: float = number(
        0.25,
        "of the footprint",
        "a pixel at whose centre less than it is otherwise has no edge within a quarter of a pixel of the centre",
        "derived: a rasteriser's grid of 1/16 pixel moves an edge by 1/32",
        "word",
    )
    beside: float = number(
        0.03125,
        "pixels",
        "beside the centres of edge pixels that are looked at closely, "
        "where a renderer with one sample a pixel may look as well",
        "derived: a rasteriser's grid of 1/16 pixel moves an edge by 1/32",
        "word",
    )
    centres: float = number(
        1.5,
        "of what more directions to lights with a size change at a centre",
        "a picture of pixels' centres may be off by it",
        "derived: 987 directions have a quarter of the error of 233 (233 / 987), and so has the picture",
        "word",
    )
    missed: float = number(
        0.25,
        "of the range of subsamples",
        "by which single samples may lie beyond it",
        "derived: 4 x 4 regular subsamples of an even slope miss a sixth at either end, of a bend more",
        "word",
    )
    suspicious: float = number(
        2.0,
        "standard errors",
        "beyond, the light that an epsilon lets in is computed (leeway)",
        "convention: it is computed where it may matter",
        "time",
    )
    stray: int = number(2, "samples", "of a pixel that last bits may lead astray", "convention", "word")
    rounding: float = number(
        0.05,
        "of a step",
        "beyond half a step, or a whole one where Ward's RGBE cuts, that rounding to the output's format may do",
        "convention: a little, for a rounding before it",
        "word",
    )
    bend: float = number(
        0.15,
        "of the Laplacian",
        "tolerance for a pixel filter that is neither point nor box, off edges",
        "convention",
        "word",
    )


@dataclass(frozen=True, slots=True)
class Leeway:
    """The numbers of metrics/leeway.py."""

    half: float = number(
        0.5,
        "of a pixel's footprint",
        "the largest epsilon that is reasonable",
        "convention: beyond, shadows visibly come off what throws them",
        "word",
    )
    far: float = number(3.0, "pixels", "how far along a shadow's retreat is looked", "convention", "word")
    step: float = number(0.5, "pixels", "and in which steps", "convention", "word")
    small: float = number(1e-3, "of an epsilon", "the step of a numerical derivative", "convention", "word")
