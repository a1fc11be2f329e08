"""Step 8: the numbers that decide what a bug is called."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class Names:
    """The numbers of metrics/names.py."""

    remains: float = number(
        0.15,
        "of the bug leg",
        "a name may leave",
        "measured: right names leave .08, a gamma in the place of an albedo .18",
        "name",
    )
    nothing: float = number(
        0.02,
        "of the bug leg",
        "counts as nothing",
        "measured: where two renderers see different surfaces at an edge",
        "name",
    )
    exact: float = number(0.01, "misfit", "that leaves nothing for another name to explain", "convention", "name")
    rounded: float = number(
        0.01,
        "share of `names.exact`",
        "the misfit of a name that is rounding: there two are alike unless one is half of the other",
        "measured: 0.0018 of it for the right names of 7/57 of the generality bench, 2026-11-30",
        "name",
    )
    worse: float = number(
        1.5,
        "ratio",
        "a fault whose quick picture deviates so much more than that of a name that leaves nothing is not fitted",
        "convention",
        "name",
    )
    noise: float = number(
        1.0,
        "misfit",
        "of a picture that a fault explains",
        "derived: .8 where all of it is Gaussian noise, the mean of its absolute value",
        "name",
    )
    laden: float = number(
        1.1, "ratio", "by which one number more must lower the misfit, and one limitation more", "convention", "name"
    )
    better: float = number(0.97, "ratio", "of misfits: else the name that was tried first stays", "convention", "name")
    rarely: int = number(10, "ratio", "a rare fault must leave so much less than `names.nothing`", "convention", "name")


@dataclass(frozen=True, slots=True)
class Naming:
    """The numbers of metrics/naming.py."""

    same: float = number(0.97, "correlation", "from which two pictures show the same scene", "convention", "name")
    other: float = number(0.7, "correlation", "below which they do not", "convention", "name")
    level: float = number(
        1.5,
        "ratio",
        "of two misfits of quick pictures that are one level apart: within a level ranks decide which fault is tried "
        "first",
        "convention",
        "name",
    )


@dataclass(frozen=True, slots=True)
class WholePicture:
    """The numbers of metrics/whole_picture.py."""

    sharpened: int = number(3, "vectors", "of a shift that are predicted in full, and one more", "convention", "time")
    roughly: float = number(
        0.55, "pixels", "by which a shift may be mistaken where edges are aliased", "convention", "name"
    )


@dataclass(frozen=True, slots=True)
class Lattice:
    """The numbers of metrics/lattice.py."""

    side: int = number(
        64,
        "points",
        "at the least along each side of a square picture's lattice",
        "measured: 23 faults at 256 x 256 have the same names with 64, 96 and 128",
        "time",
    )


@dataclass(frozen=True, slots=True)
class BugLeg:
    """The numbers of metrics/bug_leg.py."""

    hope: float = number(
        0.7, "of the bug leg", "a fault that leaves more is not tried beside limitations", "convention", "time"
    )
    told: float = number(
        0.25,
        "of what is wrong",
        "that a pixel's centre may be off its mean, for quick pictures to tell of it",
        "convention",
        "time",
    )
    few_told: int = number(
        16, "pixels", "fewer, on the lattice, do not tell that a fault is hopeless", "convention", "time"
    )
    farther: float = number(
        1.05,
        "ratio",
        "of misfits, beyond which a cause in the whole picture is not looked at in full",
        "convention",
        "time",
    )


@dataclass(frozen=True, slots=True)
class Fitted:
    """The numbers of metrics/fitted.py."""

    all_black: float = number(
        0.9,
        "of pixels",
        'of what a missing surface takes away must leave black for its message to add "or drawn black"; '
        "the others are edges, which differ in part",
        "convention",
        "nothing",
    )
    black: float = number(
        0.01, "of the reference", "below it a value is black, in that message alone", "convention", "nothing"
    )
    choice: float = number(0.05, "misfit", "added for a fault that may choose at each pixel", "convention", "name")
    free: float = number(1.1, "ratio", "and its misfit is multiplied by it", "convention", "name")
    nearly: float = number(0.03, "of the bug leg", "a strength that leaves less is good enough", "convention", "time")


@dataclass(frozen=True, slots=True)
class Likely:
    """The numbers of metrics/likely.py."""

    steps: tuple[int, ...] = number(
        (4, 1),
        "pixels",
        "sides of blocks in which changes are compared",
        "convention: a texture that has moved by more than a texel is found only where it is blurred",
        "name",
    )
    likely: int = number(8, "faults", "that are fitted in full", "convention", "time")
    alike: float = number(0.3, "correlation", "of the changes below which a fault is not tried", "convention", "time")
    least_alike: float = number(0.1, "correlation", "and below which it is never tried", "convention", "time")
    few: int = number(
        2, "faults", "that are tried even where they are less alike than `likely.alike`", "convention", "time"
    )
    equal: float = number(
        0.9, "share of the change", "that two quick pictures of one fault have in common", "convention", "name"
    )
    well: float = number(
        0.2, "share of the change", "a strength that leaves less fits: no other one is looked at", "convention", "time"
    )
    farther: tuple[tuple[float, ...], ...] = number(
        ((1.5, 2.0, 3.0, -1.0), (0.8, 1.25), (0.9, 1.1)),
        "times the strength",
        "further strengths that are looked at, in turn",
        "convention",
        "name",
    )
    much_less: float = number(
        0.8, "ratio", "of what the first strength leaves: another one must leave less", "convention", "name"
    )
    clip: float = number(
        30.0, "tolerances", "a larger change counts no more", "convention: one highlight would decide", "name"
    )
    joint_steps: tuple[int, ...] = number(
        (8, 4, 2, 1),
        "pixels",
        "sides of blocks, at each step towards strengths along several axes",
        "convention",
        "name",
    )
    joint_turns: int = number(4, "steps", "most steps at each of those sides", "convention", "name")
    enough: int = number(256, "values", "fewer off edges tell nothing of a fault", "convention", "name")
    worth: int = number(4, "ratio", "a change is weighed by its tolerance over this", "convention", "name")
    turns: int = number(4, "steps", "of a fit by Huber's weights", "convention: it has settled by then", "name")
    most: int = number(
        20,
        "strengths",
        "a fault is no more than so many times as strong as its usual strength, along any axis",
        "convention",
        "name",
    )
    most_factor: float = number(9.0, "strengths", "a factor is no more than 1 + 9", "convention", "name")
    least_factor: float = number(0.9, "strengths", "and no less than 1 - .9", "convention", "name")
    least: float = number(
        0.01,
        "strengths",
        "the step from no fault at all; and along one of several axes a smaller part is none",
        "convention",
        "name",
    )


@dataclass(frozen=True, slots=True)
class Causes:
    """The numbers of metrics/causes.py."""

    power: float = number(
        2.2, "exponent", "that is widely used in the place of sRGB's curve", "derived: common use", "name"
    )
    least_shift: float = number(
        0.05, "pixels", "a smaller shift is none", "convention: aliased edges fake more", "name"
    )
    least_side: int = number(8, "pixels", "of a smaller picture no shift is told", "convention", "name")
    same_shift: float = number(0.02, "pixels", "between two shifts that are tried as one", "convention", "name")
    shifts_tried: int = number(2, "shifts", "of those found", "convention", "name")
    farthest: float = number(0.25, "of the smaller side", "a larger shift is another picture", "convention", "name")
    least_difference: float = number(
        1e-6, "of the brightest value", "a smaller difference tells nothing of a shift", "convention", "name"
    )
    dark: float = number(1e-4, "linear value", "a darker pixel tells nothing of a gamma", "convention", "name")
    black: float = number(1e-3, "of the brightest value", "below it a picture is black", "convention", "name")
    no_gain: float = number(1e-3, "ratio", "a gain this near to 1 is none", "convention", "name")
    settled: float = number(1e-3, "pixels", "a smaller step ends the refinement of a shift", "convention", "name")
    no_zoom: float = number(
        0.003,
        "ratio",
        "a smaller magnification is none; a larger one of the card is a fault of the adapter",
        "convention",
        "word",
    )
    edge: float = number(
        0.01, "share", "an edge's coverage that still counts after a change of the picture", "convention", "name"
    )
    near_pi: float = number(
        0.01, "ratio", "a gain this near to pi, its inverse or 4 pi is called that", "convention", "nothing"
    )
    no_gamma: float = number(
        0.01,
        "exponent",
        "a gamma this near to 1 is none; one of the card farther from it is a fault of the adapter",
        "convention",
        "word",
    )
    gain_from: float = number(
        0.05, "of the brightest value", "a darker pixel tells nothing of a gain", "convention", "name"
    )
    clipped: float = number(
        0.98, "linear value", "a brighter pixel may be clipped and tells nothing of a gamma", "convention", "name"
    )
    zoom_fine: float = number(
        0.015, "ratio", "from the best rough magnification as far the fine search goes", "convention", "name"
    )
    cut_off: float = number(
        1.02, "ratio", "a value that is so much brighter than the picture's brightest was cut off", "convention", "name"
    )
    farthest_refined: float = number(
        1.5, "pixels", "a refined shift that leads farther is not believed", "convention", "name"
    )
    zoom_stride: int = number(
        4, "pixels", "of the rows and columns that the rough search for a magnification looks at", "convention", "time"
    )
    most_gamma: int = number(5, "exponent", "the greatest gamma; the least is its inverse", "convention", "name")
    shift_turns: int = number(8, "steps", "of a shift's refinement", "convention", "name")
    upsampling: int = number(20, "-", "phase correlation is refined to a twentieth of a pixel", "convention", "name")
    zoom_fine_steps: int = number(31, "steps", "of the fine search for a magnification", "convention", "name")
    zoom_steps: int = number(57, "steps", "of the rough search for a magnification", "convention", "name")
