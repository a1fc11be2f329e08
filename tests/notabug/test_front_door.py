"""Help, completion and examples: what a stranger asks first."""

from __future__ import annotations

import inspect
import os
import shlex
import subprocess
import sys
from typing import Any, get_type_hints

import pytest
import typer

from notabug import completing
from notabug.cli import app
from notabug.examples import EXAMPLES

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
