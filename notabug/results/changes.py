"""What changed from one result to a later one: the one rule of ``diff``, of the report's baseline and of the trend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from notabug.results.record import Result
from notabug.results.wording import area, finding_names, strongest

RANK = {"pass": 0, "limitation": 1, "unsupported": 2, "inconclusive": 3, "error": 4, "bug": 5}
SAME = 1e-3  # relative: area and jnd that differ by less are the same, whatever the file's rounding


@dataclass(frozen=True, slots=True)
class Change:
    """One job of two runs; a side that lacks it has the verdict ""."""

    scene: str
    variant: str
    renderer: str
    before: str
    after: str
    names_before: str
    names_after: str
    area_px: tuple[float, float]
    jnd: tuple[float, float]

    @property
    def steps(self) -> int:
        """How many ranks worse; a job that is new or gone counts from a pass."""
        return RANK.get(self.after, 0) - RANK.get(self.before, 0)

    @property
    def course(self) -> Literal["worse", "better", "other"]:
        """What the change is; a renderer that has another name for what is no bug has got neither better nor worse."""
        if self.worse:
            return "worse"
        less = any(_grown(now, was) for was, now in (self.area_px, self.jnd))
        both = bool(self.before and self.after)
        return "better" if both and (self.steps < 0 or (self.steps == 0 and less)) else "other"

    @property
    def worse(self) -> bool:
        """Another verdict of a worse kind, another name, or more of the same."""
        if not self.before or not self.after:
            return self.after in ("bug", "error")
        grown = any(_grown(*each) for each in (self.area_px, self.jnd)) or self.names_before != self.names_after
        return self.steps > 0 or (self.steps == 0 and self.after in ("limitation", "bug") and grown)


def changed_numbers(before: dict[str, float], after: dict[str, float]) -> dict[str, tuple[float | None, float | None]]:
    """The numbers by which two runs were judged and that differ; none where a run does not say its numbers."""
    if not before or not after:
        return {}
    names = dict.fromkeys((*before, *after))
    pairs = {name: (before.get(name), after.get(name)) for name in names}
    return {name: (was, now) for name, (was, now) in pairs.items() if was != now}


def between(before: Result, after: Result) -> Change | None:
    """What changed from one result of a job to a later one, or None."""
    change = _change((after.scene, after.variant, after.renderer), before, after)
    return change if _changed(change) else None


def compare(before: list[Result], after: list[Result]) -> list[Change]:
    """The jobs whose verdict, names, area or jnd changed, worst first."""
    sides = [
        {(result.scene, result.variant, result.renderer): result for result in results} for results in (before, after)
    ]
    changes = [_change(key, sides[0].get(key), sides[1].get(key)) for key in sides[0] | sides[1]]
    changed = [change for change in changes if _changed(change)]
    return sorted(
        changed,
        key=lambda each: (
            *(not each.worse, -each.steps, each.area_px[0] - each.area_px[1]),
            *(each.scene, each.variant, each.renderer),
        ),
    )


def _change(key: tuple[str, str, str], before: Result | None, after: Result | None) -> Change:
    scene, variant, renderer = key
    return Change(
        *(scene, variant, renderer),
        before.verdict.word if before else "",
        after.verdict.word if after else "",
        finding_names(before) if before else "",
        finding_names(after) if after else "",
        (area(before) if before else 0.0, area(after) if after else 0.0),
        (strongest(before) if before else 0.0, strongest(after) if after else 0.0),
    )


def _changed(each: Change) -> bool:
    other = (each.before, each.names_before) != (each.after, each.names_after)
    return other or any(_grown(a, b) or _grown(b, a) for a, b in (each.area_px, each.jnd))


def _grown(before: float, after: float) -> bool:
    return after - before > SAME * max(abs(before), abs(after))
