"""trend: one renderer over several runs: what changed from each to the next, and every scene's course."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from notabug.gallery.entries import Exhibit, Run
from notabug.results.changes import RANK, between
from notabug.results.record import Result
from notabug.results.wording import area, number, strongest


@dataclass(frozen=True, slots=True)
class Change:
    """A scene whose result is another one in the later run; ``better`` is None where neither is."""

    scene: str
    variant: str
    before: Result
    after: Result
    better: bool | None
    what: str


@dataclass(frozen=True, slots=True)
class Step:
    """From one run to the next."""

    before: Run
    after: Run
    changes: tuple[Change, ...]
    same: int


@dataclass(frozen=True, slots=True)
class Line:
    """A quantity over runs as points of a plot 100 wide and 24 high; None where a run has no result."""

    name: str
    values: tuple[float | None, ...]

    @property
    def path(self) -> str:
        top = max((value for value in self.values if value is not None), default=0.0) or 1.0
        last = max(1, len(self.values) - 1)
        points = [(100 * at / last, 22 - 20 * each / top) for at, each in enumerate(self.values) if each is not None]
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


@dataclass(frozen=True, slots=True)
class Course:
    """One scene and variant over the runs."""

    scene: str
    variant: str
    results: tuple[Result | None, ...]
    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True)
class Trend:
    """One renderer's runs in the order in which they were given; ``steps`` newest first."""

    renderer: str
    runs: tuple[Run, ...]
    steps: tuple[Step, ...]
    courses: tuple[Course, ...]


def trends(exhibits: Sequence[Exhibit], runs: Sequence[Run]) -> list[Trend]:
    """A trend for each renderer that two or more runs hold."""
    renderers = dict.fromkeys(result.renderer for run in runs for result in run.results)
    made = []
    for renderer in renderers:
        own = [run for run in runs if any(result.renderer == renderer for result in run.results)]
        if len(own) > 1:
            courses = tuple(_course(exhibit, renderer, own) for exhibit in exhibits)
            courses = tuple(course for course in courses if any(course.results))
            steps = tuple(_step(courses, own, at) for at in range(len(own) - 1, 0, -1))
            made.append(Trend(renderer, tuple(own), steps, courses))
    return made


def _course(exhibit: Exhibit, renderer: str, runs: Sequence[Run]) -> Course:
    found = {id(each.run): each.result for each in exhibit.drawn if each.result.renderer == renderer}
    results = tuple(found.get(id(run)) for run in runs)
    lines = (
        Line("area, px", tuple(None if result is None else area(result) for result in results)),
        Line("strength, jnd", tuple(None if result is None else strongest(result) for result in results)),
        Line("time, s", tuple(None if result is None else result.seconds.get("render", 0.0) for result in results)),
    )
    return Course(exhibit.scene, exhibit.variant, results, lines)


def _step(courses: Sequence[Course], runs: Sequence[Run], at: int) -> Step:
    changes, same = [], 0
    for course in courses:
        before, after = course.results[at - 1], course.results[at]
        if before is None or after is None:
            continue
        change = _change(course, before, after)
        if change is None:
            same += 1
        else:
            changes.append(change)
    changes.sort(key=lambda each: (each.better is not False, -RANK[each.after.verdict.word]))
    return Step(runs[at - 1], runs[at], tuple(changes), same)


def _change(course: Course, before: Result, after: Result) -> Change | None:
    change = between(before, after)
    if change is None:
        return None
    if change.before != change.after:
        what = f"{change.before} → {change.after}"
    elif change.names_before != change.names_after:
        what = f"{change.names_before or 'nothing'} → {change.names_after or 'nothing'}"
    elif change.area_px[0] != change.area_px[1]:
        what = f"area {change.area_px[0]:.0f} → {change.area_px[1]:.0f} px"
    else:
        what = f"strength {number(change.jnd[0], 2)} → {number(change.jnd[1], 2)} jnd"
    better = {"worse": False, "better": True, "other": None}[change.course]
    return Change(course.scene, course.variant, before, after, better, what)
