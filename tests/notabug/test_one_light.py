"""A bug that comes with one type of light is told with it, where a run's results tell, and only there."""

from __future__ import annotations

from typing import Any

import pytest

from notabug.metrics.verdict import Finding, Verdict
from notabug.report.rows import cause
from notabug.report.sentence import sentence
from notabug.results.one_light import told_by_lights
from notabug.results.record import Result
from notabug.runs.progress import messages

SAID = "under point lights only: 2 scenes show it, 2 under distant lights do not"


def result(scene: str, word: Any, *lights: str, bug: str = "light_gain", renderer: str = "mine") -> Result:
    found = (Finding("bug", bug, 9.0, (0, 0, 9, 9), message="gain 3.1416"),) if word == "bug" else ()
    message = "gain 3.1416" if word == "bug" else ""
    return Result(scene, "", renderer, "1", Verdict(word, found, message=message), lights=lights)


def shown(*kinds: tuple[Any, ...]) -> list[str]:
    return [each.under for each in told_by_lights([result(f"a/{i}", *kind) for i, kind in enumerate(kinds)])]


BUG, RIGHT, FACETS = ("bug", "point"), ("pass", "distant"), ("limitation", "distant")


def test_a_bug_of_one_type_of_light_says_so() -> None:
    assert shown(BUG, BUG, RIGHT, FACETS) == [SAID, SAID, "", ""]


@pytest.mark.parametrize(
    "kinds",
    [
        (BUG, BUG, RIGHT),  # one scene that does not show it may be chance
        (BUG, RIGHT, RIGHT),
        (BUG, BUG, RIGHT, RIGHT, ("pass", "point")),  # one that should show it does not
        (BUG, BUG, RIGHT, RIGHT, ("bug", "distant")),  # under another light too
        (BUG, BUG, ("unsupported", "distant"), ("error", "distant")),  # of these nothing is known
        (BUG, BUG, ("pass", "distant", "point"), ("pass", "distant", "point")),  # lit by both: they tell nothing
        (BUG, BUG, ("pass",), ("pass",)),  # a record of an earlier version, or a scene without lights
    ],
)
def test_what_a_run_does_not_tell_is_not_said(kinds: tuple[tuple[Any, ...], ...]) -> None:
    assert set(shown(*kinds)) == {""}


def test_another_bug_may_hide_it_and_renderers_are_kept_apart() -> None:
    results = [result(f"a/{i}", *kind) for i, kind in enumerate((BUG, BUG, RIGHT, RIGHT))]
    hidden = result("a/8", "bug", "point", bug="unexplained")
    theirs = [result(f"a/{i}", "bug", kind, renderer="theirs") for i, kind in enumerate(("point", "distant"))]
    assert [each.under for each in told_by_lights([*results, hidden, *theirs])] == [SAID, SAID, *[""] * 5]
    assert told_by_lights(told_by_lights(results)) == told_by_lights(results)


@pytest.mark.parametrize("light", ["dome", "rect", "sun"])
def test_it_holds_for_every_type_of_light(light: str) -> None:
    assert shown(("bug", light), ("bug", light), RIGHT, RIGHT)[0].startswith(f"under {light} lights only")


def test_it_stands_wherever_the_cause_does() -> None:
    results = told_by_lights([result(f"a/{i}", *kind) for i, kind in enumerate((BUG, BUG, RIGHT, RIGHT))])
    first = results[0]
    assert f"gain 3.1416; {SAID}" in cause(first)
    assert f"gain 3.1416; {SAID}" in sentence(first)
    (line,) = messages(results)
    assert line.plain.count(SAID) == 1
    assert Result.from_dict(first.as_dict()) == first
