"""GitHub annotations of a run: one workflow command a line."""

from __future__ import annotations

from pathlib import Path

from notabug.report.next_steps import going_on
from notabug.report.sentence import scene_file, sentence, title
from notabug.results.document import RunDocument
from notabug.results.record import Result


def github(document: RunDocument, results: list[Result], out: Path) -> str:
    """An error for what fails, a warning for what a gate lets pass though it was not expected, and commands."""
    del document
    lines = []
    for result in results:
        if result.fails or result.surprising or result.verdict.word == "error":
            level = "error" if result.fails else "warning"
            place = f"file={_value(scene_file(result))},title={_value(title(result))}"
            told = "\n".join(part for part in (sentence(result), going_on(result, out)) if part)
            lines.append(f"::{level} {place}::{_data(told)}")
    return "".join(f"{line}\n" for line in lines)


def _data(text: str) -> str:
    """Escaped as the runner undoes it, so that no text ends the command or begins another one."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _value(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
