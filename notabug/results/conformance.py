"""The conformance table: of each feature of UsdPreviewSurface and UsdLux what each renderer makes of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.table import Table
from rich.text import Text

from notabug.results.document import ResultSaid
from notabug.results.wording import STYLE, readable
from notabug.scenes_usd.catalogue import PREVIEW

RIGHT = "right"


@dataclass(frozen=True, slots=True)
class Row:
    """One feature, what the specification says of it, and by renderer the judge's word and the cell's text."""

    feature: str
    claim: str
    cells: dict[str, tuple[str, str]]


def rows(results: Iterable[ResultSaid]) -> list[Row]:
    """A row for each scene of the preview surface's among the ``results`` of a ``run.json``, in their order."""
    found: dict[str, Row] = {}
    for result in results:
        group, _, feature = result["scene"].partition("/")
        if group == PREVIEW:
            row = found.setdefault(feature, Row(feature, result["claim"], {}))
            row.cells[result["renderer"]] = result["verdict"], cell(result)
    return list(found.values())


def cell(result: ResultSaid) -> str:
    """``right``, ``convention: NAMES``, ``limitation: NAMES``, ``bug: NAME``, or the judge's other words."""
    word: str = result["verdict"]
    names = {kind: [readable(each["name"]) for each in result["findings"] if each["kind"] == kind] for kind in _KINDS}
    if word == "pass":
        return f"convention: {', '.join(names['convention'])}" if names["convention"] else RIGHT
    return f"{word}: {', '.join(names[word])}" if names.get(word) else word


_KINDS = ("convention", "limitation", "bug")


def _renderers(table: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(name for row in table for name in row.cells))


def table(found: Sequence[Row]) -> Table:
    """The table for a terminal."""
    names = _renderers(found)
    drawn = Table("feature", *names, title="UsdPreviewSurface and UsdLux")
    for row in found:
        cells = (row.cells.get(name, ("", "")) for name in names)
        drawn.add_row(readable(row.feature), *(Text(text, style=STYLE.get(word, "")) for word, text in cells))
    right = [sum(row.cells.get(name, ("", ""))[1] == RIGHT for row in found) for name in names]
    drawn.add_section()
    drawn.add_row("right", *(f"{count} of {len(found)}" for count in right))
    return drawn


def markdown(found: Sequence[Row]) -> list[str]:
    """The lines of the table for a page, with what the specification says of each feature."""
    names = _renderers(found)
    lines = [f"| feature | what is specified | {' | '.join(names)} |", "|---|---|" + "---|" * len(names)]
    for row in found:
        cells = " | ".join(row.cells.get(name, ("", ""))[1] for name in names)
        lines.append(f"| {readable(row.feature)} | {row.claim} | {cells} |")
    return lines
