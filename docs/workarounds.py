"""``python docs/workarounds.py RUN``: write workarounds.md from a run that was made with ``--workarounds``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from notabug.references.workarounds.workaround import workarounds
from notabug.results.record import load
from notabug.results.wording import number, readable

HEAD = """# The paper's workarounds, with and without

`notabug run --workarounds` renders each of these scenes without the workaround (before), with it (after), and where it
fails (limit). Area and jnd are those of all artifacts that the judge finds, FLIP is the mean over the picture
of both legs, facets are triangles. Words in brackets say what is altered besides the variant; such a picture is judged
as if nothing had been, so `bug` in an *after* or *limit* row means only that no model of the scene predicts it.
Renderers that cannot be given the setting, or that do not show the artifact, have no rows.
`python docs/workarounds.py RUN` wrote this page.
"""


def page(rows: list[dict[str, Any]]) -> str:
    """The page as Markdown."""
    parts = [HEAD]
    for each in workarounds():
        shown = [row for row in rows if row["workaround"] == each.name and row["outcome"] != "not shown"]
        parts.append(
            f"## {readable(each.name)} ({each.artifact_class})\n\n{_sentence(each.claim)} *{_sentence(each.caveat)}*\n"
            f"{each.cites}.\n\n"
            "| renderer | | scene and variant | verdict | area px | jnd | FLIP | facets |\n"
            "|---|---|---|---|--:|--:|--:|--:|"
        )
        lines = [_line(row["renderer"], when, effect) for row in shown for when, effect in _effects(row)]
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts).replace("|\n\n|", "|\n|")


def _effects(row: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [("before", row["before"]), ("after", row["after"]), *(("limit", each) for each in row["limits"])]


def _line(renderer: str, when: str, effect: dict[str, Any]) -> str:
    names = ", ".join(readable(each) for each in effect["findings"])
    verdict = f"{effect['verdict']}: {names}" if names else effect["verdict"]
    numbers = (number(round(effect["area_px"], 1)), number(effect["jnd"], 2), number(effect["flip"], 2))
    cells = (renderer, when, f"`{effect['scene']}` {effect['variant']}", verdict, *numbers, str(effect["facets"]))
    return f"| {' | '.join(cells)} |"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


if __name__ == "__main__":
    document = load(Path(sys.argv[1]))
    Path(__file__).with_name("workarounds.md").write_text(page(document["workarounds"]), encoding="utf-8")
