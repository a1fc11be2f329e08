"""The ``bench`` command: runs a benchmark, prints its table, writes JSON."""

from __future__ import annotations

import json

from rich.table import Table

from notabug.bench.speed import measure
from notabug.exit_codes import ExitCode
from notabug.runs.progress import console
from notabug.runs.provenance import tool


def command(as_json: bool) -> ExitCode:
    """Measure speed and print the figures; exit 1 where one misses what is asked of it."""
    figures = measure()
    if as_json:
        print(json.dumps({"tool": tool(), "figures": [figure.as_dict() for figure in figures]}, ensure_ascii=False))
    else:
        table = Table("what", "measured", "asked", "", "note")
        for figure in figures:
            value = "-" if figure.value is None else f"{figure.value:.3g} {figure.unit}"
            mark = {True: "✓", False: "✗", None: "?"}[figure.met]
            table.add_row(figure.name, value, figure.asked, mark, figure.note)
        console().print(table)
    return ExitCode.BUG if any(figure.met is False for figure in figures) else ExitCode.OK
