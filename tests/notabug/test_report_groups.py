"""How a report tells of bugs: one card for a cause, each number once, and commands that leave the run as it is."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from notabug.adapters.base import Quality
from notabug.gallery.steps import silent, told_on
from notabug.metrics.calibration import Reading
from notabug.metrics.verdict import Finding, Verdict
from notabug.report.rows import Row, groups, make_row, summarise
from notabug.results.gate import OF_FILES
from notabug.results.record import Result
from notabug.runs.calibration import objection
from notabug.runs.plan import reproduce
from notabug.runs.selection import Choice

OUT = Path("runs/first")


def row(scene: str, word: Any, message: str = "", renderer: str = "mine", state: Any = "", pixels: float = 9.0) -> Row:
    found = (Finding(word, "light_gain", pixels, (0, 0, 9, 9), jnd=2.0),) if word == "bug" else ()
    verdict = Verdict(word, found, message=message)
    result = Result(scene, "x=1", renderer, "1", verdict, state=state, fails=word == "bug")
    return make_row(result, OUT, ((), ()), None, "", "", files=True)


def test_bugs_of_one_cause_are_one_card_with_the_others_below() -> None:
    rows = [row(f"a/{index}", "bug", "gain 0.3183", pixels=index) for index in range(6)]
    rows += [row("b/1", "bug", "gain 0.3183", renderer="other"), row("c/1", "bug", "flipped")]
    rows += [row("d/1", "bug"), row("d/2", "bug")]  # of which nothing is said are not alike
    (bugs,) = groups(rows, OUT)
    assert bugs.count == len(rows)
    sizes = {(same.title, len(same.rows)) for same in bugs.cards}
    assert sizes == {("mine: gain 0.3183", 6), ("other: gain 0.3183", 1), ("mine: flipped", 1), ("mine: ", 1)}
    (gain,) = [same for same in bugs.cards if len(same.rows) > 1]
    assert gain.cause == "6 scenes"
    assert gain.rows[0].result.scene == "a/5", "the worst is open"


def test_variants_of_one_scene_are_counted_as_such() -> None:
    (bugs,) = groups([row("a/1", "bug", "gain 2"), row("a/1", "bug", "gain 2")], OUT)
    assert [same.cause for same in bugs.cards] == ["2 variants"]


def test_what_only_names_the_cards_once_more_is_left_out_of_the_head() -> None:
    bugs = [row(f"a/{index}", "bug", "gain", state="new") for index in range(6)]
    passes = [row("b/1", "pass")]
    head = summarise([*bugs, *passes], {}, None)
    assert head.headline == "6 bug, 1 pass"
    assert not any(head.expected.values())
    known, grown = row("e/1", "bug"), row("e/2", "limitation")
    swapped = [replace(known, result=replace(known.result, fails=False))]
    swapped += [replace(grown, result=replace(grown.result, fails=True))]
    assert summarise(swapped, {}, None).headline == "1 of 2 results fails; in all 1 bug, 1 limitation"
    limited = row("c/1", "limitation", state="new")
    head = summarise([*bugs, limited], {}, None)
    assert len(head.expected["new"]) == 7, "of what has no card the list tells"


@pytest.mark.parametrize(
    ("out", "again"), [(Path("notabug-out"), "notabug-out-again"), (Path("runs/my run"), "'runs/my run-again'")]
)
def test_the_command_that_draws_again_leaves_the_run_as_it_is(out: Path, again: str) -> None:
    choice = Choice("a/1", "a/1")
    said = reproduce(choice, "mine", Quality(), out, "gap=0,x=1")
    assert said == f"notabug run a/1 -r mine --variant gap=0 --variant x=1 --out {again}"


def test_a_full_disk_is_told_as_the_disks() -> None:
    said = "out/card: cannot read or write; got No space left on device; make room on the disk"
    disk = Verdict("error", message=said, triggers=(OF_FILES,))
    nothing = Reading.__new__(Reading)
    assert objection(nothing, disk, lambda: None) == said
    assert "the card could not be drawn" in objection(nothing, Verdict("error", message="it crashed"), lambda: None)


def test_a_gallery_says_how_far_it_is_and_how_long_it_takes_yet() -> None:
    clock = iter(float(second) for second in range(0, 10_000, 10))
    out = Console(file=io.StringIO(), width=80)
    done = list(told_on(out, lambda: next(clock))(list(range(40)), "pictures"))
    assert done == list(range(40))
    assert isinstance(out.file, io.StringIO)
    lines = out.file.getvalue().splitlines()
    assert len(lines) == 9
    assert lines[0] == "pictures: 4 of 40, about 2 minutes left"
    assert list(told_on(out)([], "pictures")) == []
    assert list(silent([1, 2], "pictures")) == [1, 2]
