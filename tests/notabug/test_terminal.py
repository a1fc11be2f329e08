"""What stands on a terminal of 80 columns: changes that fit, causes before results, and nothing twice."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console

from notabug.commands import diff
from notabug.commands.summary import counts, named_briefly, one_picture
from notabug.metrics.verdict import Finding, Verdict
from notabug.results.changes import compare
from notabug.results.record import Result
from notabug.runs.progress import LOG_WIDTH, Board, causes, console, key_of
from notabug.runs.selection import Choice, choose
from notabug.scenes_usd.errors import SelectionError

LONG = "visibility/coincident_spheres"
VARIANT = "gap=0,surface=mesh,transform=turned,world_offset=1000000"


def result(scene: str, word: Any, message: str = "", variant: str = VARIANT, state: Any = "") -> Result:
    found = (Finding(word, "coincident_surfaces", 1234.5, (0, 0, 9, 9), jnd=12.25),) if word == "bug" else ()
    return Result(scene, variant, "my renderer", "1", Verdict(word, found, message=message), state=state)


@pytest.mark.parametrize("width", [60, 80, 120])
def test_a_change_fits_in_lines(width: int) -> None:
    changes = compare([result(LONG, "pass")], [result(LONG, "bug")]) + compare([result("a/b", "bug")], [])
    for change in changes:
        shown = diff.lines(change, width)
        assert all(len(line.plain) <= width for line in shown)
        assert change.renderer in shown[0].plain
        assert f"{change.before or 'none'} → {change.after or 'none'}" in shown[0].plain
        assert "0 → 1234 px" in shown[1].plain or "1234 → 0 px" in shown[1].plain
    assert diff.lines(changes[0], width)[0].plain.startswith("worse")


def test_changes_are_a_table_only_where_it_fits() -> None:
    changes = compare([result(LONG, "pass")], [result(LONG, "bug")])
    for width, table in ((80, False), (220, True)):
        out = Console(file=io.StringIO(), width=width, color_system=None)
        diff._listing(changes, out)
        assert isinstance(out.file, io.StringIO)
        text = out.file.getvalue()
        assert ("area px" in text) == table
        assert all(len(line) <= width for line in text.splitlines())


def test_what_one_run_did_not_select_and_nobody_can_draw_is_counted() -> None:
    both = compare([result("a/b", "unsupported"), result("a/c", "pass")], [result("a/d", "unsupported")])
    assert [change.scene for change in both if diff._one_sided(change)] == ["a/d", "a/b"]
    assert not any(map(diff._one_sided, compare([result("a/b", "unsupported")], [result("a/b", "bug")])))


@pytest.mark.parametrize(
    ("said", "width"),
    [("80", 80), ("132", 132), ("", LOG_WIDTH), ("wide", LOG_WIDTH), ("3", LOG_WIDTH)],
)
def test_a_pipe_has_the_width_that_columns_says(said: str, width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", said)
    monkeypatch.setattr("sys.stdout", io.StringIO())
    assert console().width == width


def test_a_cause_covers_its_results_and_a_single_one_is_left() -> None:
    found = [result(f"a/{index}", "bug", "gain 0.3183") for index in range(6)] + [result("b/c", "bug", "flipped")]
    (line,), covered = causes(found)
    assert "6 scenes" in line.plain
    assert "gain 0.3183" in line.plain
    assert covered == {key_of(each) for each in found[:6]}


def test_the_board_knows_of_which_results_it_told_all() -> None:
    board = Board(Console(file=io.StringIO(), width=80), lambda _: None, brief=frozenset({"a/1"}))
    first, again = result("a/1", "bug", "gain 0.5"), result("a/2", "bug", "gain 0.25")
    board.done(first, False)
    board.done(again, False)  # in the words of the first but for the number, which is not printed again
    board.done(result("a/3", "unsupported", "no"), False)
    assert board.shown == {("a/1", "", "my renderer")}


def test_a_variant_is_named_only_where_there_is_another() -> None:
    choices = [Choice("a/1", "a/1"), Choice("a/2", "a/2", {"x": "1"}), Choice("a/3", "a/3"), Choice("a/3", "a/3")]
    assert one_picture(choices) == {"a/1"}
    found = named_briefly([result(f"a/{index}", "pass") for index in (1, 2, 3)], choices)
    assert [each.variant for each in found] == ["", VARIANT, VARIANT]


def test_what_nobody_expected_is_in_the_counts() -> None:
    found = [result("a/1", "bug", state="new"), result("a/2", "pass")]
    assert counts(found) == "1 pass, 1 bug (not expected)"
    expected = replace(result("a/3", "bug"), expected="bug")
    assert counts([*found, expected]) == "1 pass, 2 bug; 1 not expected"
    error = result("a/4", "error", state="new")
    assert counts([*found, error]) == "1 pass, 1 bug (not expected), 1 error (not expected)"
    assert counts(found[1:]) == "1 pass"
    assert counts(found, "quiet") == "1 pass, 1 bug"


@pytest.mark.parametrize("word", ["highlight", "kitchen", "reflections", "b"])
def test_a_class_that_does_not_exist_is_answered_by_the_classes(word: str) -> None:
    with pytest.raises(SelectionError) as caught:
        choose([word], {})
    assert "/" not in str(caught.value).replace(".usda/.usdc/.usd/.usdz", "").replace("or a ", "")
    assert "acne" in caught.value.expected
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("early", ["choose", "find_renderers"])
def test_an_interrupt_before_anything_is_finished_says_how_to_go_on(
    early: str, door: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(f"notabug.commands.run.{early}", interrupted)
    assert door.run("terminator/sphere") == 130
    assert "stopped before a result was finished; the same command begins again" in " ".join(door.stderr.split())
