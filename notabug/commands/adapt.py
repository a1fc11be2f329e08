"""The ``adapt`` command: a layer over a team's own scene that makes it judgeable, and a list of what the layer says."""

from __future__ import annotations

import json
from pathlib import Path

from rich.text import Text

from notabug.commands.check import says
from notabug.commands.judge import one_variant
from notabug.exit_codes import ExitCode
from notabug.runs.progress import console
from notabug.scenes_usd.adapted import Adapted, adapt
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.reader import SUFFIXES, find
from notabug.scenes_usd.view import View


def command(*, source: str, out: Path, variants: list[str], view: View, size: str, as_json: bool) -> ExitCode:
    """Write the layer ``out`` over ``source`` and print what it says."""
    if out.suffix not in SUFFIXES[:3]:
        raise SelectionError("not a USD layer", where="--out", expected="a .usda, .usdc or .usd file", got=str(out))
    chosen = one_variant(variants)
    path = find(source, chosen, view)
    target = out.resolve()
    if target == path:
        raise SelectionError("the scene itself", where="--out", got=str(out), do="name another file")
    if not path.is_relative_to(target.parent):
        raise SelectionError(
            "a scene may name only files below its own folder",
            where="--out",
            expected=f"a file in {path.parent}, or above it",
            got=str(out),
        )
    made = adapt(path, target, chosen, view, _pixels(size))
    if as_json:
        print(json.dumps(_document(source, out, made), ensure_ascii=False))
    else:
        _show(source, out, made)
    return ExitCode.OK if made.survey.scene is not None else ExitCode.USAGE


def _pixels(text: str) -> tuple[int, int] | None:
    """The size that ``WxH`` says.

    >>> _pixels("640x480"), _pixels("")
    ((640, 480), None)
    """
    if not text:
        return None
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise SelectionError("not a size", where="--size", expected="WxH, as in 640x480", got=text)
    return int(width), int(height)


def _document(source: str, out: Path, made: Adapted) -> dict[str, object]:
    left = [remark for remark in made.survey.remarks if remark.error is not None]
    return {
        "schema": "notabug-adapt/1",
        "scene": source,
        "layer": str(out),
        "judged": made.survey.scene is not None,
        "says": list(made.says),
        "left": [{"where": remark.where, "what": remark.what} for remark in left],
    }


def _show(source: str, out: Path, made: Adapted) -> None:
    screen = console()
    for line in made.says:
        screen.print(Text(f"+ {line}"), soft_wrap=True)
    for remark in made.survey.remarks:
        if remark.error is not None:
            left = Text("✗ out of the contract: ", style="bold red")
            screen.print(left.append(says(remark), style="default not bold"), soft_wrap=True)
    screen.print(Text(f"{out}: a layer over {source}, {len(made.says)} opinions"), soft_wrap=True)
    if made.survey.scene is not None:
        screen.print(Text(f"next: notabug run {out}"), soft_wrap=True)
