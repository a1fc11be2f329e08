"""Step 5: the numbers of gains, shifts and warps of the whole picture."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.metrics.policy.number import number


@dataclass(frozen=True, slots=True)
class GlobalFit:
    """The numbers of metrics/global_fit.py."""

    errors: float = number(
        4.0,
        "standard errors",
        "of a gain that are chance",
        "measured: at 3, 1 in 400 gains of nothing but noise is called one",
        "word",
    )
    shift: float = number(
        0.2,
        "pixels",
        "a smaller shift, and 3 standard errors more, is none; so is a warp by less of what lies farthest out",
        "measured: in clean pictures aliased edges fake shifts of up to .13 and warps of up to .14",
        "word",
    )
    blur: float = number(
        1.0,
        "pixels",
        "standard deviation by which pictures are blurred before a warp is fitted",
        "convention: the border moves by more pixels than a gradient reaches",
        "word",
    )
    leaves: tuple[tuple[float, float], ...] = number(
        ((0.0, 0.75), (0.7, 0.5)),
        "(pixels, share)",
        "of the change a shift may leave so much, with the pictures blurred by so much, or it is no shift",
        "convention",
        "word",
    )
    min_pixels: int = number(64, "pixels", "fewer tell neither a gain, a gamma nor a shift", "convention", "word")
    enough: int = number(
        20_000, "pixels", "more are not looked at", "derived: they fix a gain far better than its tolerance", "time"
    )
    lit: float = number(
        0.02, "of the brightest value", "a darker pixel shows no gain and no gamma", "convention", "word"
    )
    steep: float = number(
        0.05, "of the brightest value", "a steeper pixel shows that something has moved", "convention", "word"
    )
    warp_leaves: float = number(0.75, "share", "a warp that leaves more of the change is none", "convention", "word")
    least_gain_scatter: float = number(1e-4, "ratio", "least scale of a gain's scatter", "convention", "word")
    least_shift_scatter: float = number(1e-6, "linear value", "least scale of a shift's scatter", "convention", "word")
    gain_turns: int = number(5, "steps", "of the gain's fit", "convention: it has settled by then", "word")
    shift_turns: int = number(6, "steps", "of the shift's fit", "convention: it has settled by then", "word")


@dataclass(frozen=True, slots=True)
class FewPixels:
    """The numbers of metrics/few_pixels.py."""

    mostly: float = number(
        0.5, "of the lit pixels", "that no limitation may change, or nothing is said of a gain", "convention", "word"
    )
    support: float = number(
        0.5,
        "share",
        "of the peak's gain that the flux must show",
        "convention: a wider filter leaves the flux as it is",
        "word",
    )
    large_slack: float = number(
        2.0,
        "standard deviations",
        "that an edge's tolerance stands for; and of noise by which an open gain must exceed `few_pixels.untold`",
        "convention",
        "word",
    )
    steps: int = number(32, "steps", "of an edge's coverage: pixels of one step are off alike", "convention", "word")
    few_steps: int = number(
        8, "steps", "from which on their scatter tells how well samples agree", "convention", "word"
    )
    least_scatter: float = number(0.05, "of what edges admit", "a smaller scatter is luck", "convention", "word")
    rounded: float = number(
        4.0, "standard errors", "that rounding of flat pixels, all alike, may be", "convention", "word"
    )
    untold: float = number(
        0.02,
        "ratio",
        "a larger gain that few pixels cannot tell from none makes the picture `inconclusive`",
        "convention",
        "word",
    )


@dataclass(frozen=True, slots=True)
class Regression:
    """Robust fits, of steps 5 and 8."""

    enough: int = number(8, "values", "fewer have no median that tells of them all", "convention", "word")
    tukey: float = number(
        4.685, "scales", "Tukey's weight is zero beyond it", "derived: 95 % efficiency under normal noise", "word"
    )
    huber: float = number(
        1.345, "scales", "Huber's weight falls beyond it", "derived: 95 % efficiency under normal noise", "word"
    )
