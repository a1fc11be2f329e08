"""The ``diff`` command: what changed from one run to a later one, worst first."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.results.changes import Change, changed_numbers, compare
from notabug.results.record import Result, load
from notabug.results.wording import STYLE, counted, number
from notabug.runs.progress import INDENT, SHORTEST, console, shortened

_ANY = 10_000  # columns: more than any table of changes takes
_PLAIN = "default not bold"


def command(before: Path, after: Path, as_json: bool) -> ExitCode:
    """Print the changes from ``before`` to ``after``; BUG where one is for the worse."""
    documents = [load(folder) for folder in (before, after)]
    runs = [[Result.from_dict(each) for each in document["results"]] for document in documents]
    changes = compare(*runs)
    numbers = changed_numbers(*(document["policy"] for document in documents))
    if as_json:
        print(
            escaped(
                json.dumps(
                    {
                        "changes": [asdict(change) | {"worse": change.worse} for change in changes],
                        "policy": {name: list(values) for name, values in numbers.items()},
                    },
                    ensure_ascii=False,
                )
            )
        )
    else:
        _listing([change for change in changes if not _one_sided(change)], console())
    worse = sum(change.worse for change in changes)
    if not as_json:
        same = len({(each.scene, each.variant, each.renderer) for run in runs for each in run}) - len(changes)
        for name, values in numbers.items():
            was, now = ("none" if value is None else f"{value:g}" for value in values)
            console().print(f"judged by another {name}: {was} → {now}", markup=False)
        unmet = sum(map(_one_sided, changes))
        if unmet:
            what = "of a scene that the renderer cannot draw and that one run did not select"
            console().print(f"left out: {counted(unmet, 'change')} {what}", soft_wrap=True)
        console().print(f"{worse} worse, {len(changes) - worse} otherwise changed, {same} the same")
    return ExitCode.BUG if worse else ExitCode.OK


def _one_sided(change: Change) -> bool:
    """Whether ``change`` only says that a renderer cannot draw what one of the runs did not ask for."""
    return {change.before, change.after} == {"unsupported", ""}


def _listing(changes: Sequence[Change], out: Console) -> None:
    """Print ``changes``: as a table where it has room, else each in a line or two."""
    fits = Measurement.get(out, out.options.update(max_width=_ANY), _table(changes)).maximum <= out.width
    if fits:
        out.print(_table(changes))
        return
    for change in changes:
        for line in lines(change, out.width):
            out.print(line, soft_wrap=True)


def lines(change: Change, width: int) -> list[Text]:
    """One change in ``width`` columns: a line that names it, and one of what is found where there is anything."""
    head = Text("worse  " if change.worse else "       ", style="bold red")
    head.append(f"{change.before or 'none'} → {change.after or 'none'}  ", style=STYLE.get(change.after, ""))
    head.append(f"{change.renderer}  ", style=_PLAIN)
    name = " ".join(part for part in (change.scene, change.variant) if part)
    made = [head.append(shortened(name, max(SHORTEST, width - len(head.plain))), style=_PLAIN)]
    found = _names(change) if change.names_before or change.names_after else ""
    if any(change.area_px):
        found += f"; {_arrow(change.area_px, 1)} px, jnd {_arrow(change.jnd)}"
    folded = textwrap.wrap(found, max(SHORTEST, width - INDENT), break_long_words=False, break_on_hyphens=False)
    return [*made, *(Text(" " * INDENT + part) for part in folded)]


def _names(change: Change) -> str:
    return " → ".join(dict.fromkeys((change.names_before or "–", change.names_after or "–")))


def _arrow(values: tuple[float, float], digits: int | None = None) -> str:
    return " → ".join(number(value, 2) if digits is None else number(round(value, digits)) for value in values)


def _table(changes: Sequence[Change]) -> Table:
    drawn = Table(box=None, header_style="bold", pad_edge=False)
    for name in ("", "scene", "variant", "renderer", "verdict", "findings", "area px", "jnd"):
        drawn.add_column(name, overflow="fold")
    for change in changes:
        drawn.add_row(
            Text("worse" if change.worse else "", style="bold red"),
            *(Text(part) for part in (change.scene, change.variant, change.renderer)),
            Text(f"{change.before or 'none'} → {change.after or 'none'}", style=STYLE.get(change.after, "")),
            Text(_names(change)),
            Text(_arrow(change.area_px, 1)),
            Text(_arrow(change.jnd)),
        )
    return drawn
