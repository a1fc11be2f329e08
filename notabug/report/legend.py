"""What the words and numbers of the page mean: its legend and its tooltips."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Meaning:
    """A word of the page, and what it means in a sentence or two."""

    word: str
    text: str


LEGEND = (
    Meaning(
        "area",
        "How many pixels the artifact takes. Each pixel counts by the share of it that the artifact covers, so that "
        "noise and the pixel filter do not move the sum.",
    ),
    Meaning(
        "jnd",
        "How visible it is, in just noticeable differences: the 95th percentile of the colour difference ΔE ITP "
        "(ITU-R BT.2124) over the region. Below 1 an eye sees nothing.",
    ),
    Meaning(
        "z",
        "How certain it is: the largest difference in units of its standard error, or of the tolerance where there is "
        "no noise. Chance alone hardly ever reaches 5.",
    ),
    Meaning(
        "FLIP",
        "A perceptual difference from 0 (the same) to 1 (as different as black and white), as someone sees it who "
        "flips between two pictures (Andersson et al., 2020).",
    ),
    Meaning(
        "difference",
        "Where and how much the picture is wrong. For a bug it is measured from the nearest admissible picture, else "
        "from the reference; black is no difference, pale yellow the largest.",
    ),
    Meaning(
        "nearest admissible",
        "Of all the pictures that a legitimate renderer may draw of the scene, the one nearest to this one. What is "
        "left between the two is the bug.",
    ),
    Meaning(
        "leg",
        "The limitation leg goes from the reference to the nearest admissible picture, the bug leg from there to the "
        "picture. An empty bug leg is no bug.",
    ),
    Meaning("new", "It is worse than a pass, and nothing says that it was expected."),
    Meaning("worse", "It is more, or of a worse kind, than what was accepted or than the baseline shows."),
    Meaning("better", "It is less, or of a better kind, than what was accepted or than the baseline shows."),
    Meaning("fixed", "It passes now: delete its entry, if there is one."),
)
