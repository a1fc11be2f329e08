"""The program ``notabug``: its commands, and what is said and which code it ends with where a command fails."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from typing import Any, cast

import typer

from notabug.command_line import judging, machine, runs, scenes
from notabug.command_line.app import app
from notabug.ending import Stopped, exit_state, report_defect, signals_as_exceptions
from notabug.exit_codes import ExitCode, exit_code
from notabug.scenes_usd.errors import FileError, NotabugError, SceneError, is_of_files

__all__ = ["app", "judging", "machine", "main", "runs", "scenes"]  # importing those four adds the commands to ``app``


def main() -> None:
    """The program: an error that a user can act on is one line on standard error and an exit code, never a trace."""
    for stream in (sys.stdout, sys.stderr):  # a terminal that lacks a glyph gets a question mark, not a trace
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        with signals_as_exceptions():
            code = app(standalone_mode=False)  # by itself typer ends with 1, a renderer's bug, where output is closed
            sys.stdout.flush()
        if code == exit_state(KeyboardInterrupt()):  # which typer has caught
            raise KeyboardInterrupt
    except BrokenPipeError:  # the reader of our output went away
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or Python complains of it at its end
        sys.exit(ExitCode.OK)
    except (KeyboardInterrupt, typer.Abort, Stopped) as error:
        with contextlib.suppress(OSError):
            sys.stderr.write("notabug: stopped\n")
        sys.exit(exit_state(error))
    except Exception as error:
        sys.exit(_told(error))
    sys.exit(code or ExitCode.OK)


def _told(error: Exception) -> int:
    """Say what ``error`` is in one line; the exit code."""
    if hasattr(error, "exit_code") and hasattr(error, "show"):  # typer's own, of words that it does not understand
        from typer.rich_utils import rich_format_error

        rich_format_error(cast(Any, error))
        return int(error.exit_code)
    if is_of_files(error):
        assert isinstance(error, OSError)
        error = FileError.of(error)
    if not isinstance(error, NotabugError):
        return report_defect(error)
    from rich.text import Text

    from notabug.runs.progress import console

    out = console(stderr=True)
    parts = getattr(error, "errors", (error,))  # of a scene that breaks the contract in many ways each
    for part in sorted(parts, key=_place) if len(parts) > 1 else parts:  # in the order in which check lists them
        asked = getattr(part, "asked", None)
        says = " ".join((str(part) if asked is None else asked.named(str(part))).split())
        line = Text("notabug: ", style="bold red").append(says, style="default not bold")
        out.print(line, soft_wrap=True)
    scenes = [part for part in parts if isinstance(part, SceneError)]
    if any(part.mends for part in scenes):
        from notabug.commands.check import steps_after  # with all that it takes to look at a scene

        for step in steps_after(scenes):
            out.print(Text(step), soft_wrap=True)
    return exit_code(error)


def _place(error: Exception) -> tuple[str, str]:
    """The prim that ``error`` is about, and the attribute."""
    where = str(getattr(error, "where", ""))
    return where.partition(".")[0], where


if __name__ == "__main__":
    main()
