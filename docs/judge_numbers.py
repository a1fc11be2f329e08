"""Writes the values of docs/judge-numbers.md anew, and says which numbers of metrics/ have no row, or are gone.

A number is a constant of a module, or a literal in the code of a function. Literals that every program is full of, a
half or a one, need no row, and neither do files that decide nothing.
"""

from __future__ import annotations

import ast
import importlib
import re
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "judge-numbers.md"
FOLDER = ROOT / "metrics"
ROW = re.compile(r"^\| `([^`]+)` \| ([^|]*) \|", re.M)

SMALL = frozenset({0, 0.5, 1, 2, 3})
"""Literals that need no row: half and twice, counts of axes and channels."""
AGAINST_ZERO = 1e-8
"""Smaller literals only keep from dividing by zero."""
DECIDES_NOTHING = frozenset({"why", "verdict", "predictions", "channels", "neighbours"})
"""They show, hold, keep in memory, or compute without a choice."""
STANDARDS = {
    "perceive": "matrices and constants of ITU-R BT.709, BT.2020, BT.2100, BT.2124 and SMPTE ST 2084",
    "calibration": "the resolution of searches; its limits are constants",
}
"""Files whose literals need no row, and what they are."""
NOT_NUMBERS = frozenset(
    {"calibration._TURNS", "perceive._TO_2020", "perceive._TO_LMS", "perceive._TO_ICTCP", "excused.TOUCHING"}
)
NOT_NUMBERS |= {f"perceive.{name}" for name in ("_PEAK", "_M1", "_M2", "_C1", "_C2", "_C3")}
"""Constants that a standard states, the turns of a picture, and the shape of a neighbourhood."""


def shown(value: Any) -> str:
    """``value`` as the page has it."""
    if isinstance(value, Mapping):
        joint = ": " if all(isinstance(key, int) for key in value) else " "
        return ", ".join(f"{key}{joint}{shown(each)}" for key, each in value.items())
    if isinstance(value, tuple):
        return f"({', '.join(map(shown, value))})"
    return f"{value:g}"


def numeric(value: Any) -> bool:
    """Whether ``value`` is a number, or made of numbers."""
    if isinstance(value, Mapping):
        return bool(value) and all(numeric(each) for each in value.values())
    if isinstance(value, tuple):
        return bool(value) and all(numeric(each) for each in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def constants(name: str) -> Iterator[tuple[str, Any]]:
    """``file.NAME`` and the value of each number that is assigned at the top of metrics/``name``.py."""
    module = importlib.import_module(f"notabug.metrics.{name}")
    for node in ast.parse((FOLDER / f"{name}.py").read_text("utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
        for target in targets:
            for part in ast.walk(target):
                if isinstance(part, ast.Name) and part.id.isupper() and numeric(getattr(module, part.id)):
                    yield f"{name}.{part.id}", getattr(module, part.id)


def literals(name: str) -> Iterator[tuple[str, Any]]:
    """``file: literal`` and the value of each number that stands in a function of metrics/``name``.py."""
    for node in ast.parse((FOLDER / f"{name}.py").read_text("utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            for part in ast.walk(node):
                value = part.value if isinstance(part, ast.Constant) else None
                if numeric(value) and value not in SMALL and abs(value) > AGAINST_ZERO:
                    yield f"{name}: {shown(value)}", value


@cache
def found() -> Mapping[str, str]:
    """Every number that decides, by the name of its row: its value as the page shows it."""
    files = sorted(each.stem for each in FOLDER.glob("*.py"))
    result: dict[str, str] = {}
    for name in files:
        if name == "__init__" or name in DECIDES_NOTHING:
            continue
        result |= {key: shown(value) for key, value in constants(name) if key not in NOT_NUMBERS}
        if name not in STANDARDS:
            result |= {key: shown(value) for key, value in literals(name)}
    return result


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
