"""One result as a title and a sentence, the same in every format, and the file that a reader would open for it."""

from __future__ import annotations

from pathlib import Path

from notabug.record import Result
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.reader import find
from notabug.words import area, finding_names, number, strongest


def title(result: Result) -> str:
    """``terminator/sphere tessellation=24x12 povray``."""
    return " ".join(part for part in (result.scene, result.variant, result.renderer) if part)


def sentence(result: Result) -> str:
    """Verdict, names, size, state, reason and message, as far as there are such."""
    verdict = result.verdict
    parts: list[str] = [verdict.word]
    if names := finding_names(result):
        parts.append(f"{names} ({number(round(area(result), 1))} px, jnd {number(strongest(result), 2)})")
    if result.state:
        parts.append(f"{result.state}{f', expected {result.expected}' if result.surprising else ''}")
    if result.because:
        parts.append(f"accepted because {result.because}")
    if verdict.message and verdict.word not in ("pass", "limitation"):
        parts.append(" ".join(verdict.message.split()))
    return "; ".join(parts)


def scene_file(result: Result) -> str:
    """The scene's file, relative to this folder where it is below it; a scene of the corpus by its place in it."""
    try:
        words = result.command.split()
        path = find(words[2] if words[:2] == ["notabug", "run"] and result.scene not in words else result.scene)
    except (SelectionError, IndexError, OSError):
        return f"{result.scene}.usda"
    here = Path.cwd().resolve()
    return path.relative_to(here).as_posix() if path.is_relative_to(here) else f"scenes_usd/{result.scene}.usda"
