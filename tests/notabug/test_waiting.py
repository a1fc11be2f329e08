"""Who waits for the judge hears what it is doing: nothing where it is quick, a line now and then in a log."""

from __future__ import annotations

import io

from rich.console import Console

from notabug.metrics.telling import doing, telling
from notabug.runs.waiting import AGAIN, PATIENCE, saying


def heard(times: list[float], *, terminal: bool = False, quiet: bool = False) -> str:
    """What is said where a step is begun at each of ``times`` in seconds."""
    clock = iter([0.0, *times])
    console = Console(file=io.StringIO(), width=80, force_terminal=terminal, color_system=None)
    with saying(console, "judging a/b", clock=lambda: next(clock), quiet=quiet):
        for place in range(len(times)):
            doing(f"predicts model_{place}")
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_a_quick_judgement_says_nothing() -> None:
    assert heard([0.1, 1.0, PATIENCE - 0.1]) == ""
    assert heard([0.1, 1.0, PATIENCE - 0.1], terminal=True) == ""


def test_a_log_hears_of_a_slow_one_now_and_then() -> None:
    said = heard([1.0, PATIENCE, PATIENCE + 1.0, PATIENCE + AGAIN, 1e4]).splitlines()
    assert said[0] == "judging a/b: 5 s, 2 pictures predicted so far; predicts model_1"
    assert [line.split("predicts ")[1] for line in said] == ["model_1", "model_3", "model_4"]
    assert heard([100.0], quiet=True) == ""


def test_a_terminal_has_one_line_that_goes() -> None:
    assert "predicts model_1" in heard([1.0, 50.0], terminal=True)


def test_nobody_need_listen_and_the_first_listener_comes_back() -> None:
    doing("nothing that anyone hears")
    told: list[str] = []
    with telling(told.append):
        with telling(lambda what: told.append(f"inner {what}")):
            doing("a")
        doing("b")
    doing("c")
    assert told == ["inner a", "b"]
