"""The program that all commands belong to, with what it says of itself."""

from __future__ import annotations

from typing import Annotated

import typer

from notabug import __version__

app = typer.Typer(
    name="notabug",
    help="Is it a rendering bug, or really not? Renders canonical scenes and says of every picture whether it is "
    "correct, shows an expected limitation, or a genuine bug.",
    epilog="Exit codes: 0 nothing worse than accepted, 1 bug, 2 usage, 3 renderer error, 4 missing reference, 5 "
    "nothing selected, 70 a defect of notabug, 130 or 143 stopped by a signal.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"notabug {__version__}")
        raise typer.Exit


@app.callback()
def _notabug(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    del version
