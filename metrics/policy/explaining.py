"""Step 6: the numbers of the search for an explanation."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Rules:
    """The numbers of metrics/rules.py."""

    mean_alpha: float = number(
        0.25,
        "share",
        "a partial limitation that explains its significant pixels by less on average does not apply",
        "convention",
        "word",
    )
    mean_fought: float = number(
        0.05,
        "share",
        "the same of surfaces that coincide",
        "measured: Mitsuba shows another surface in a tenth of a pixel's samples",
        "word",
    )
    most_between: float = number(
        0.9,
        "share",
        "of what is off must lie between the two surfaces for `rules.mean_fought` to apply",
        "convention",
        "word",
    )
    least_mixed: float = number(
        0.0003, "share", "mean share of the other values below which there is no mixture", "convention", "word"
    )
    most_mixed: float = number(0.97, "share", "and above which it is a choice", "convention", "word")
    most_striped: float = number(
        0.5,
        "share",
        "of what a shadow map's stripes may act on that is dark",
        "derived: beside its texel a surface is nearer to the light as often as farther; measured .35 to .51",
        "word",
    )
    striped_scatter: float = number(
        8.0,
        "over the root of a number of pixels",
        "that share may be larger by",
        "derived: two standard deviations of a mean of stripes of 64 pixels",
        "word",
    )
    least_touched: float = number(
        0.1,
        "of a support",
        "a fault that may do anything, and acts on less of it, is not that fault",
        "convention",
        "name",
    )
    least_dotted: float = number(
        0.3,
        "of a support",
        "the same of a fault that shows dots: fewer are no missing epsilon",
        "derived: without an epsilon chance decides at each hit, and half of all samples are wrong",
        "name",
    )
    least_fought: float = number(
        0.02,
        "of what surfaces share",
        "fewer wrong pixels there are not a fight of surfaces, unless they are dots",
        "measured: renderers show another surface on a sixth of it or more",
        "word",
    )
    least_alone: float = number(
        0.5,
        "share",
        "of fewer wrong pixels that lie by themselves: they are dots, as where a depth buffer holds nearly all depths "
        "alike",
        "derived: (1 - .02)^24 = .62 of random dots do; measured: Filament's on `visibility/coincident_planes`",
        "word",
    )
    noise: float = number(
        3.0, "standard errors", "beyond which a pixel is off, for the structural tests", "convention", "word"
    )
    least_grain: float = number(
        0.01,
        "share, root mean square",
        "by which shares differ from those around where there are dots",
        "convention",
        "word",
    )
    most_alike: float = number(
        0.3,
        "correlation",
        "of neighbours' differences, above which there are blots and no dots",
        "measured: a blot's is above .5, and a Gaussian filter's .37 (see `rules.widened`)",
        "word",
    )
    widened: float = number(
        0.15,
        "correlation",
        "more is allowed where the pixel filter is wider than a box",
        "measured: a Gaussian filter's is .37",
        "word",
    )
    alone: float = number(
        1.5,
        "pixels",
        "of a support around a dot, with the dot: where there are fewer it differs from them by all of its share",
        "derived: less than two pixels",
        "word",
    )
    around: int = number(5, "pixels", "side of the neighbourhood that a share is compared with", "convention", "word")


@dataclass(frozen=True, slots=True)
class Explain:
    """The numbers of metrics/explain.py."""

    largest_set: int = number(3, "models", "in a set that is searched", "convention", "word")
    largest_grown: int = number(
        6,
        "models",
        "in a set that is grown one by one; and as many whose changes reach.py adds up",
        "convention",
        "word",
    )
    likeliest: int = number(
        4, "models", "that are fitted in full, of those by which an unexplained set may grow", "convention", "time"
    )
    shorter: float = number(
        0.9,
        "of the bug leg",
        "a larger set that leaves more than it of what a smaller one leaves is no better, also beside a fault",
        "convention",
        "word",
    )
    values_in_pairs: int = number(4, "values", "of one feature that are tried in sets of two", "convention", "word")
    values_in_threes: int = number(2, "values", "and in sets of three", "convention", "word")
    pairs: int = number(
        8, "pairs", "of models, those that leave least, from which sets of three grow", "convention", "time"
    )
    few: float = number(
        0.1,
        "of the picture",
        "where fewer pixels are wrong, they are traced closely",
        "measured: half a texel at the borders of a card's patches, which no pixel's centre shows, "
        "is .05 of 64 x 64 pixels",
        "word",
    )


@dataclass(frozen=True, slots=True)
class Quick:
    """The numbers of metrics/quick.py."""

    least_told: float = number(
        0.5, "of the wrong pixels", "must lie off edges, or quick pictures tell nothing", "convention", "time"
    )
    told_by: int = number(
        2048, "pixels", "that tell of larger sets", "derived: the error of a sum over them is 2 %", "time"
    )
    nearer: float = number(
        0.95,
        "of what the best set leaves",
        "a set whose quick picture leaves more is not predicted",
        "convention",
        "time",
    )
    farther: float = number(
        2.0, "ratio", "nor one whose quick picture makes so much more wrong elsewhere", "convention", "time"
    )
    acts: float = number(
        0.25,
        "tolerances",
        "by which a pixel's centre moves where a model may act",
        "convention: it does beyond one",
        "time",
    )
    surely: float = number(2.0, "tolerances", "and where it surely acts", "convention", "time")


@dataclass(frozen=True, slots=True)
class Reach:
    """The numbers of metrics/reach.py."""

    beyond: float = number(
        3.0,
        "ratio",
        "to that sum, above which nothing explains a pixel",
        "convention: two limitations may do more together than each does alone",
        "time",
    )
    most_factors: int = number(4, "choices", "on top of which all models are looked at", "convention", "time")
    room: float = number(
        1.5, "ratio", "to that sum, of a set whose own quick picture is looked at as well", "convention", "time"
    )
    noise: float = number(4.0, "standard errors", "that a pixel may be off by chance", "convention", "time")
    least_share: float = number(0.05, "of the wrong pixels", "must be out of reach", "convention", "time")
    least_pixels: int = number(
        16, "pixels", "and so many: fewer may be edges that no quick picture shows", "convention", "time"
    )
    fewest: int = number(2, "pixels", "the same where each model is predicted in full", "convention", "time")
    told_by: int = number(512, "pixels", "that tell of all", "convention", "time")
