"""One result as a title and a sentence, the same in every format, and the file that a reader would open for it."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

from notabug.printable import printable
from notabug.results.record import Result
from notabug.results.wording import area, finding_names, number, strongest
from notabug.scenes_usd.fence import SUFFIXES


def title(result: Result) -> str:
    """``terminator/sphere tessellation=24x12 povray``."""
    return printable(" ".join(part for part in (result.scene, result.variant, result.renderer) if part))


def sentence(result: Result) -> str:
    """Verdict, names and size, the cause, then what was expected and why that was accepted, as far as there are such.

    >>> from notabug.metrics.verdict import Verdict
    >>> sentence(Result("acne/slab", "", "povray", "", Verdict("error", message="no such file"), state="new"))
    'error: no such file; new'
    """
    verdict = result.verdict
    head: list[str] = [verdict.word]
    if names := finding_names(result):
        head.append(f"{names} ({number(round(area(result), 1))} px, jnd {number(strongest(result), 2)})")
    if verdict.message and verdict.word not in ("pass", "limitation"):
        head.append("; ".join(part for part in (" ".join(verdict.message.split()), result.under) if part))
    parts = [": ".join(head)]
    if result.state:
        parts.append(f"{result.state}{f', expected {result.expected}' if result.surprising else ''}")
    if result.because:
        parts.append(f"accepted because {result.because}")
    return printable("; ".join(parts))


def scene_file(result: Result) -> str:
    """The scene's file, relative to this folder where it is below it; a scene of the corpus by its place in it.

    Only the record is asked: the scene need not be there.
    """
    if "/" in result.scene:
        return f"scenes_usd/{result.scene}.usda"
    try:
        words = shlex.split(result.command)
    except ValueError:
        words = []
    named = next((Path(word) for word in words if word.endswith(SUFFIXES) and Path(word).stem == result.scene), None)
    if named is None:
        return f"{result.scene}.usda"
    here = Path.cwd()
    path = Path(os.path.normpath(here / named))
    return path.relative_to(here).as_posix() if path.is_relative_to(here) else path.name
