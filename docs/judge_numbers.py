"""Writes the values of docs/judge-numbers.md anew, and says which numbers of metrics/ have no row, or are gone.

A number is a constant of a module, or a literal in the code of a function: notabug/bench/verdict/numbers.py finds them.
Literals that every program is full of, a half or a one, need no row, and neither do files that decide nothing.
"""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path

from notabug.bench.verdict.numbers import found, numeric, shown

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "judge-numbers.md"
ROW = re.compile(r"^\| `([^`]+)` \| ([^|]*) \|", re.M)


def of_models(row: str) -> str | None:
    """The value of a constant of references/ that has a row, or None where there is no such constant."""
    path, _, name = row.rpartition(".")
    value = getattr(importlib.import_module(f"notabug.{path}"), name, None)
    return shown(value) if numeric(value) else None


def faults(text: str) -> list[str]:
    """What is wrong with the page ``text``, a sentence each."""
    rows = dict(ROW.findall(text))
    known = dict(found())
    known |= {row: value for row in rows if row.startswith("references.") and (value := of_models(row)) is not None}
    told = [f"`{row}` has no row: add one with its unit, meaning and source" for row in known.keys() - rows.keys()]
    told += [f"`{row}` is no longer in the code: take its row out" for row in rows.keys() - known.keys()]
    told += [
        f"`{row}` is {known[row]} in the code and {rows[row]} on the page: run python docs/judge_numbers.py"
        for row in rows.keys() & known.keys()
        if known[row] != rows[row]
    ]
    return sorted(told)


def anew(text: str) -> str:
    """The page ``text`` with the values of the code."""
    known = found()

    def row(match: re.Match[str]) -> str:
        name = match[1]
        value = of_models(name) if name.startswith("references.") else known.get(name)
        return f"| `{name}` | {match[2] if value is None else value} |"

    return ROW.sub(row, text)


if __name__ == "__main__":
    PAGE.write_text(anew(PAGE.read_text("utf-8")), "utf-8")
    left = faults(PAGE.read_text("utf-8"))
    print("\n".join(left) or f"{len(ROW.findall(PAGE.read_text('utf-8')))} numbers, all as in the code")
    sys.exit(bool(left))
