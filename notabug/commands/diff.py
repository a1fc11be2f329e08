"""The ``diff`` command: what changed from one run to a later one, worst first."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from rich.table import Table
from rich.text import Text

from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.results.changes import Change, changed_numbers, compare
from notabug.results.record import Result, load
from notabug.results.wording import STYLE, number
from notabug.runs.progress import console


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
    elif changes:
        console().print(_table(changes))
    worse = sum(change.worse for change in changes)
    if not as_json:
        same = len({(each.scene, each.variant, each.renderer) for run in runs for each in run}) - len(changes)
        for name, values in numbers.items():
            was, now = ("none" if value is None else f"{value:g}" for value in values)
            console().print(f"judged by another {name}: {was} → {now}", markup=False)
        console().print(f"{worse} worse, {len(changes) - worse} otherwise changed, {same} the same")
    return ExitCode.BUG if worse else ExitCode.OK


def _table(changes: list[Change]) -> Table:
    drawn = Table(box=None, header_style="bold", pad_edge=False)
    for name in ("", "scene", "variant", "renderer", "verdict", "findings", "area px", "jnd"):
        drawn.add_column(name, overflow="fold")
    for change in changes:
        names = dict.fromkeys((change.names_before or "–", change.names_after or "–"))
        drawn.add_row(
            Text("worse" if change.worse else "", style="bold red"),
            *(Text(part) for part in (change.scene, change.variant, change.renderer)),
            Text(f"{change.before or 'none'} → {change.after or 'none'}", style=STYLE.get(change.after, "")),
            Text(" → ".join(names)),
            Text(" → ".join(number(round(part, 1)) for part in change.area_px)),
            Text(" → ".join(number(part, 2) for part in change.jnd)),
        )
    return drawn
