"""Step 10 of docs/judge.md, the verdict: Verdict and Finding, what is said of a picture; they go through JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypedDict, cast

from notabug.scenes_usd.catalogue import Word as Word

GLYPH: dict[Word, str] = {
    "pass": "✓",
    "limitation": "≈",
    "bug": "✗",
    "inconclusive": "?",
    "unsupported": "–",
    "error": "!",
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One region that deviates, with its explanation.

    ``regions`` are the boxes of its parts, largest first. ``area_px`` is the sum of alpha (the share of a pixel that
    the artifact takes) over the region's pixels, so noise and filter do not move it. ``jnd`` is the 95th percentile
    of ICtCp's Delta E_ITP over the region (1: just noticeable). ``z`` is the largest significance: |residual| in
    units of its standard error (or of the tolerance when there is no noise). ``region`` is [x0, y0, x1, y1) in
    pixels, y down. ``worst`` is its worst pixel, (x, y): of a bug the one that is farthest outside of what is admitted.
    ``strengths`` are the numbers that were fitted of a bug that comes in all strengths: a gain, a shift's two.
    """

    kind: Literal["limitation", "convention", "bug"]
    name: str
    area_px: float
    region: tuple[int, int, int, int]
    jnd: float = 0.0
    z: float = 0.0
    visible: bool = True
    message: str = ""
    regions: tuple[tuple[int, int, int, int], ...] = ()
    worst: tuple[int, ...] = ()
    strengths: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Leg:
    """One leg of the way reference -> nearest admissible picture -> picture, in perceptual units (0 when empty)."""

    pixels: int = 0
    flip: float = 0.0  # mean FLIP over the picture
    flip_max: float = 0.0
    itp: float = 0.0  # 95th percentile of Delta E_ITP over the leg's pixels


class VerdictSaid(TypedDict):
    """A verdict as ``as_dict`` gives it; findings and legs hold the fields of their classes."""

    word: Word
    findings: list[dict[str, Any]]
    legs: dict[str, dict[str, Any]]
    triggers: list[str]
    message: str
    numbers: dict[str, float]


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on one picture (all seeds of it together)."""

    word: Word
    findings: tuple[Finding, ...] = ()
    legs: dict[str, Leg] = field(default_factory=lambda: {"limitation": Leg(), "bug": Leg()})
    triggers: tuple[str, ...] = ()  # which tests fired: pixels, tile, gain, shift, invalid
    message: str = ""  # one sentence for people
    numbers: dict[str, float] = field(default_factory=dict)  # rmse, gain, shift_x, shift_y, freedom ...

    def as_dict(self) -> VerdictSaid:
        return cast(VerdictSaid, asdict(self))

    @classmethod
    def from_dict(cls, data: VerdictSaid) -> Verdict:
        return cls(
            word=data["word"],
            findings=tuple(_finding(finding) for finding in data["findings"]),
            legs={name: Leg(**leg) for name, leg in data["legs"].items()},
            triggers=tuple(data["triggers"]),
            message=data["message"],
            numbers=dict(data["numbers"]),
        )


def _finding(data: dict[str, Any]) -> Finding:
    boxes = {"region": tuple(data["region"]), "regions": tuple(tuple(box) for box in data.get("regions", ()))}
    numbers = {name: tuple(data.get(name, ())) for name in ("worst", "strengths")}
    return Finding(**{**data, **boxes, **numbers})
