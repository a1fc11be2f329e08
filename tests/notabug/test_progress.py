"""What a run says on a terminal of 80 columns and in a log: lines that fit, and one mistake told once."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from notabug.metrics.verdict import Finding, Verdict
from notabug.results.record import Result
from notabug.runs.progress import Board, fits, lines, listing, messages, shortened

LONG = "visibility/coincident_spheres"
VARIANT = "gap=0,surface=mesh,transform=turned,world_offset=1000000"


def result(word: Any, message: str = "", *, scene: str = LONG, variant: str = VARIANT, **more: Any) -> Result:
    found = ()
    if word in ("bug", "limitation"):
        names = ("facet_self_shadow", "silhouette_flip", "gouraud_interpolation", "coincident_surfaces")
        found = tuple(Finding(word, name, 1234.5, (0, 0, 9, 9), jnd=12.25) for name in names)
    return Result(scene, variant, "my renderer", "1", Verdict(word, found, message=message), **more)


def screen(width: int, *, terminal: bool = True) -> Console:
    return Console(file=io.StringIO(), width=width, force_terminal=terminal, color_system=None, highlight=False)


def said(console: Console) -> list[str]:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue().splitlines()


@pytest.mark.parametrize("width", [60, 80, 100])
@pytest.mark.parametrize("word", ["bug", "limitation", "pass", "error", "inconclusive"])
def test_a_result_fits(width: int, word: str) -> None:
    shown = lines(result(word, "rays meet the surface that they start on, for want of an epsilon " * 3), width)
    assert all(len(line.plain) <= width for line in shown)
    assert shown[0].plain.startswith(lines(result(word), width)[0].plain[:12])
    assert "my renderer" in shown[0].plain
    if word == "bug":
        assert shown[0].plain.endswith("4938 px, jnd 12")  # the name is shortened, the numbers are not
        assert "…" in shown[0].plain
        assert "facet self shadow, silhouette flip" in shown[1].plain


@pytest.mark.parametrize("width", [60, 80, 100, 240])
@pytest.mark.parametrize("word", ["bug", "pass", "error"])
def test_what_was_expected_takes_no_room_from_the_name(width: int, word: str) -> None:
    other = replace(result(word), expected="limitation: coincident_surfaces")
    assert other.surprising
    shown = [line.plain for line in lines(other, width)]
    assert all(len(line) <= width for line in shown)
    assert sum("expected limitation: coincident_surfaces" in line for line in shown) == 1
    plain = lines(result(word), width)[0].plain
    assert shown[0] == plain if width < 240 else shown[0].startswith(plain)


@pytest.mark.parametrize("room", range(1, 40))
def test_the_middle_is_left_out(room: int) -> None:
    text = "terminator/sphere tessellation=24x12"
    short = shortened(text, room)
    assert len(short) == min(room, len(text))
    assert text.startswith(short.partition("…")[0])
    assert text.endswith(short.partition("…")[2])


def test_a_table_only_where_it_fits() -> None:
    found = [result("limitation"), result("pass")]
    for width in (80, 100, 120, 160):
        console = screen(width)
        for drawn in listing(found, console):
            console.print(drawn, soft_wrap=not hasattr(drawn, "columns"))
        there = said(console)
        assert all(len(line.rstrip()) <= width for line in there)
        assert there[0].startswith("scene") == fits(found, width)
    assert not fits(found, 80)
    assert fits(found, 160)


def test_one_mistake_is_told_once() -> None:
    wrong = [
        result("error", f"adapter 'mine': mine failed; got exit code {at}; log: out/{at}/log.txt", scene=f"a/{at}")
        for at in range(25)
    ]
    console = screen(80)
    with Board(console, lambda _: None) as board:
        board.begin(25)
        for each in wrong:
            board.done(each, False)
    assert sum("mine failed" in line for line in said(console)) == 1
    (told,) = messages(wrong, Path("out"))
    assert told.plain.startswith("! error  my renderer: 25 jobs failed alike: adapter 'mine': mine failed")
    assert told.plain.count("log.txt") == 1


def test_one_bug_in_several_scenes_is_one_line() -> None:
    cause = "light falls off linearly"
    wrong = [result("bug", cause, scene=f"a/{at}") for at in range(7)]
    (told,) = messages(wrong)
    assert told.plain == f"✗ bug  my renderer: 7 scenes (a/0, a/1, a/2, a/3, a/4 and 2 more): {cause}"
    variants = [result("bug", cause, scene="a/0"), result("bug", cause, scene="a/0"), result("bug", "flipped")]
    assert [line.plain.partition(": ")[2] for line in messages(variants)] == [cause, "flipped"]
    assert messages(variants)[0].plain.startswith("✗ bug  a/0 (2 variants) my renderer: ")


def test_what_is_unsupported_is_one_line_with_a_count() -> None:
    lacks = [
        result("unsupported", f"adapter 'mine': scene 'x' needs {what}; choose another renderer", scene=f"a/{what}")
        for what in ("glass", "mirror, sphere", "sphere")
    ]
    for terminal in (True, False):
        console = screen(160, terminal=terminal)
        with Board(console, lambda _: None) as board:
            for each in lacks:
                board.done(each, False)
        assert not any("unsupported" in line for line in said(console))
    assert listing(lacks, screen(80)) == []
    (told,) = messages(lacks)
    assert told.plain == "– unsupported  my renderer: 3 scenes: it lacks sphere (2), glass (1), mirror (1)"


def test_quiet_and_verbose() -> None:
    found = [result("pass"), result("bug", "black", fails=True), result("unsupported", "no glass"), result("bug")]
    for detail, count in (("quiet", 0), ("normal", 3), ("verbose", 4)):
        console = screen(160, terminal=False)
        with Board(console, lambda _: None, detail) as board:  # type: ignore[arg-type]
            for each in found:
                board.done(each, False)
        assert sum("my renderer" in line for line in said(console)) == count
    assert len([line for line in listing(found, screen(80), "quiet") if "my renderer" in str(line)]) == 1
    assert len([line for line in listing(found, screen(80), "verbose") if "my renderer" in str(line)]) == 4


def test_quiet_says_what_fails_and_the_count(door: Any) -> None:
    door.judge.verdicts["terminator/sphere"] = Verdict("bug", message="it is black")
    assert door.run("terminator/sphere", "texture/uneven_quad", "--quiet") == 1
    assert door.stderr == ""
    assert "it is black" in door.stdout
    assert "uneven_quad" not in door.stdout
    assert door.stdout.splitlines()[-1] == "1 pass, 1 bug"


def test_a_failing_renderer_is_told_once_with_its_log(door: Any) -> None:
    from notabug.adapters.process import failure

    for scene in ("terminator/sphere", "texture/uneven_quad", "phong/interpolation"):
        door.grey.mishaps[scene] = failure("grey failed", where="grey", got="exit code 3", log="cannot open texture")
    assert door.run("terminator/sphere", "texture/uneven_quad", "phong/interpolation") == 3
    assert door.stderr.count("cannot open texture") == 1
    assert door.stdout.count("cannot open texture") == 1
    assert "3 jobs failed alike" in door.stdout
    log = next(word for word in door.stdout.split() if word.endswith("log.txt"))
    assert Path(log).read_text() == "cannot open texture"
