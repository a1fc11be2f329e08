"""A run as Markdown: the summary of a build's page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from notabug.metrics.verdict import GLYPH
from notabug.printable import printable
from notabug.results.document import RunDocument
from notabug.results.record import Result
from notabug.results.wording import area, finding_names, number, strongest, tally

_MARKS = re.compile(r"([\\`*_{}\[\]<>()#+\-.!|~&@])")


def markdown(document: RunDocument, results: list[Result], out: Path) -> str:
    """What fails, what was accepted, and the count of verdicts for each renderer."""
    del out
    gate = document.get("gate", {"unused": [], "file": ""})
    failing = [result for result in results if result.fails]
    known = [result for result in results if not result.fails and (result.because or result.surprising)]
    lines = [
        "## notabug",
        "",
        f"{_plain(tally(result.verdict.word for result in results))}; {len(failing)} failing",
        "",
    ]
    lines += _table("Failing", failing)
    lines += _table("Accepted, or other than expected", known)
    lines += ["| renderer | verdicts |", "|---|---|"]
    for renderer in dict.fromkeys(result.renderer for result in results):
        words = tally(result.verdict.word for result in results if result.renderer == renderer)
        lines.append(f"| {_plain(renderer)} | {_plain(words)} |")
    lines += [
        f"| {_plain(name)} | not installed: {_plain(found['missing'])} |"
        for name, found in document["renderers"].items()
        if "missing" in found
    ]
    if gate["unused"]:
        lines += ["", f"{len(gate['unused'])} entries of {_plain(gate['file'])} met no result of this run."]
    return "\n".join(lines) + "\n"


def _table(name: str, results: Sequence[Result]) -> list[str]:
    if not results:
        return []
    lines = [f"### {name}", "", "| | scene | variant | renderer | found | area px | jnd | state | |", "|---" * 9 + "|"]
    for result in results:
        note = result.because or result.verdict.message
        cells = (GLYPH[result.verdict.word], result.scene, result.variant, result.renderer, finding_names(result))
        sizes = (number(round(area(result), 1)), number(strongest(result), 2)) if result.verdict.findings else ("", "")
        lines.append("| " + " | ".join(_plain(text) for text in (*cells, *sizes, result.state, note)) + " |")
    return [*lines, ""]


def _plain(text: str) -> str:
    """``text`` as itself, whatever it would mean in Markdown or HTML."""
    return _MARKS.sub(lambda mark: f"&#{ord(mark[1])};", printable(" ".join(text.split())))
