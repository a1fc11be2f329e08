"""Help, completion and examples: what a stranger asks first."""

from __future__ import annotations

import inspect
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, get_type_hints

import pytest
import typer

from notabug.adapters.base import Found
from notabug.adapters.config import Table
from notabug.adapters.configured import configured
from notabug.adapters.zbuffer import ZBuffer
from notabug.cli import _told, app
from notabug.command_line import completing
from notabug.command_line.examples import EXAMPLES
from notabug.commands.run import _beginning
from notabug.results.wording import duration
from notabug.runs.plan import Plan, left_out
from notabug.runs.selection import choose
from notabug.scenes_usd.errors import Asked, ManyFaultsError, SceneError
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.view import AS_IT_IS

TABLE = Table({"command": ["./mine", "{scene}", "{image}"]}, "renderers.mine", Path())
COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
NO_DATA: frozenset[str] = frozenset()  # commands that yield nothing a program would read


def test_every_command_ends_its_help_with_an_example() -> None:
    assert set(EXAMPLES) == set(COMMANDS)
    for name, command in COMMANDS.items():
        assert command.epilog == f"Example: {EXAMPLES[name]}"


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_understood(name: str) -> None:
    program, command, *words = shlex.split(EXAMPLES[name])
    assert (program, command) == ("notabug", name)
    COMMANDS[command].make_context(command, words, resilient_parsing=False)


def test_every_command_that_yields_data_has_json() -> None:
    for command in app.registered_commands:
        assert command.callback is not None
        name = command.name or command.callback.__name__
        assert ("as_json" in inspect.signature(command.callback).parameters) == (name not in NO_DATA), name
        assert get_type_hints(command.callback).get("as_json", bool) is bool


def test_a_shell_completes_scenes_and_renderers() -> None:
    assert "terminator" in dict(completing.scenes("term"))
    assert "terminator/sphere" in dict(completing.scenes("terminator/s"))
    assert completing.scenes("no such") == []
    assert "zbuffer" in completing.renderers("z")
    words = {"COMP_WORDS": "notabug run terminator/sph", "COMP_CWORD": "2", "_NOTABUG_COMPLETE": "complete_bash"}
    code = "import sys; sys.argv = ['notabug']; from notabug.cli import app; app(prog_name='notabug')"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=os.environ | words, check=False
    )
    assert done.stdout.split() == ["terminator/sphere"]


@pytest.mark.parametrize(("mended", "said"), [(0, ""), (1, "mends all but 1"), (2, "writes that down")])
def test_a_refused_scene_says_whether_a_layer_would_mend_it(
    mended: int, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = (SceneError("one", where="/A"), SceneError("two", where="/B"))
    monkeypatch.setattr("notabug.commands.check.faults_left", lambda *_: faults[mended:])
    for fault in faults:
        fault.asked = Asked("my scene.usda", {}, AS_IT_IS)
    for fault in faults[:mended]:
        fault.mends = (Opinion("/A", "visibility", "token", "invisible"),)
    assert _told(ManyFaultsError(faults)) == 2
    told = capsys.readouterr().err
    assert told.count("notabug: /") == 2
    assert said in told
    assert ("notabug adapt 'my scene.usda' --out own.usda" in told) == bool(mended)


@pytest.mark.parametrize("text", [None, "", "#usda 1.0\ndef {"])
def test_a_file_that_no_layer_can_mend_is_not_sent_to_adapt(
    text: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from notabug.commands.check import command
    from notabug.scenes_usd.view import view_of

    path = tmp_path / "scene.usda"
    if text is not None:
        path.write_text(text)
    assert command(source=str(path), variants=[], view=view_of("", None, []), as_json=False) == 2
    out = capsys.readouterr().out
    assert "out of the contract" in out
    assert "adapt" not in out


@pytest.mark.parametrize(
    ("missing", "asked", "lines"),
    [
        ((), False, 0),
        (("vtk",), False, 1),
        (("vtk", "cycles", "pygfx"), False, 1),
        (("vtk", "cycles", "pygfx"), True, 3),
        (("vtk", "cycles", "mine", "povray"), False, 3),  # one's own and a system's are told by themselves
    ],
)
def test_renderers_that_nobody_need_have_are_one_line(missing: tuple[str, ...], asked: bool, lines: int) -> None:
    told = left_out({name: f"install it ({name})" for name in missing}, asked=asked)
    assert len(told) == lines
    assert all(name in " ".join(told) for name in missing)
    assert ("install it (mine)" in " ".join(told)) == ("mine" in missing)


@pytest.mark.parametrize(
    ("own", "told"),
    [(0, ""), (1, ", and what mine0 takes to draw"), (2, ", and what mine0 and mine1 take to draw")],
)
def test_nobody_knows_how_long_a_renderer_of_one_s_own_draws(own: int, told: str, tmp_path: Path) -> None:
    made = {f"mine{at}": configured(f"mine{at}", TABLE, {}) for at in range(own)}
    found = {name: (each, Found("1", "here")) for name, each in {"zbuffer": ZBuffer(), **made}.items()}
    said = _beginning(Plan(tuple(choose(["terminator", "texture", "acne", "phong"], {})), found, tmp_path))
    assert f"on two idle cores{told}; later ones" in said


def test_a_run_says_what_it_does_and_how_long_that_takes(door: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from notabug.commands import run as running

    monkeypatch.setattr(running, "FIRST", 40.0)
    assert door("run", "terminator/sphere", "texture/uneven_quad") == 0
    told = " ".join(door.stderr.split())
    jobs = re.search(r"rendering and judging 2 scenes(?:, (\d+) pictures)? with", told)
    assert jobs is not None
    assert jobs[1] != "2", "where there is one picture of each scene the number is told once"
    assert f"the first run takes {duration(40.0 * int(jobs[1] or 2))}" in told
    assert door("run", "terminator/sphere", "texture/uneven_quad") == 0  # which keeps what is finished
    assert "the first run takes" not in " ".join(door.stderr.split())
