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
        print(json.dumps({"tool": tool(), "figures": [each.as_dict() for each in figures]}, ensure_ascii=False))
    else:
        table = Table("what", "measured", "asked", "", "note")
        for each in figures:
            value = "-" if each.value is None else f"{each.value:.3g} {each.unit}"
            mark = {True: "✓", False: "✗", None: "?"}[each.met]
            table.add_row(each.name, value, each.asked, mark, each.note)
        console().print(table)
    return ExitCode.BUG if any(each.met is False for each in figures) else ExitCode.OK
