"""What a reader of a report does next with a result: command lines and an entry to accept it, ready to be copied."""

from __future__ import annotations

import shlex
from pathlib import Path

from notabug.commands.accept import entry_for
from notabug.printable import printable
from notabug.results.expect_file import ACCEPTED, entry_text
from notabug.results.record import Result
from notabug.scenes_usd.view import options_for

DEFAULT_OUT = Path("notabug-out")
REASON = "say why"


def why_command(result: Result, out: Path, peak: tuple[int, int] | None) -> str:
    """Asks what each model predicts at the worst pixel, or what stands for it; "" without a picture.

    Where a record does not say which pixel that is, it is ``peak``, else the middle of the largest finding.
    """
    if not result.image:
        return ""
    words = ["notabug", "why", (out / result.image).as_posix()]
    place = result.worst or peak or _middle(result)
    return shlex.join([*words, "--pixel", f"{place[0]},{place[1]}"] if place else words)


def going_on(result: Result, out: Path) -> str:
    """For a log: the commands that explain ``result`` and that make it again, a line each."""
    lines = (("explain", why_command(result, out, None)), ("again", result.command))
    return "\n".join(printable(f"{what}: {' '.join(command.split())}") for what, command in lines if command)


def accept_command(result: Result, out: Path) -> str:
    """Writes ``result`` to the expectation file; "" where there is nothing to accept."""
    if result.verdict.word not in ACCEPTED:
        return ""
    words = ["notabug", "accept", result.scene, "-r", result.renderer]
    words += options_for(result.variant)
    if out != DEFAULT_OUT:
        words += ["--run", out.as_posix()]
    return shlex.join([*words, "--because", REASON])


def accept_entry(result: Result, models: str) -> str:
    """The entry of ``notabug.expect.toml`` that ``accept_command`` writes, to be pasted where there is no run."""
    if result.verdict.word not in ACCEPTED:
        return ""
    return entry_text(entry_for(result, REASON, models, "", None, 0.1))


def _middle(result: Result) -> tuple[int, int] | None:
    decisive = [each for each in result.verdict.findings if each.kind == result.verdict.word]
    if not decisive:
        return None
    largest = max(decisive, key=lambda finding: finding.area_px)
    x0, y0, x1, y1 = largest.regions[0] if largest.regions else largest.region
    return ((x0 + x1) // 2, (y0 + y1) // 2)
