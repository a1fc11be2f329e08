"""Writes docs/judge-sensitivity.md: what notabug.bench.verdict.sensitivity measured, kept in judge-sensitivity.json.

``python docs/judge_sensitivity.py`` writes the page; ``python docs/judge_sensitivity.py NEW.json ...`` first takes the
rows of newer measurements into the file that is kept.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TypedDict

from notabug.bench.verdict.numbers import found

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "judge-sensitivity.md"
KEPT = ROOT / "docs" / "judge-sensitivity.json"
HEAD = """\
# What each number decides

How much a verdict depends on each of [the numbers that decide](judge-numbers.md). A fixed sample of the tuning half of
`notabug bench verdict`, {pictures} pictures of 40 x 40 pixels ({words}),
was judged with each number halved and doubled; of numbers that only name a bug, the names of {bugs} bugs were compared.
`python -m notabug.bench.verdict.sensitivity OUT.json` measures it again, `python docs/judge_sensitivity.py OUT.json`
writes this page; a measurement that was stopped goes on with `docs/judge-sensitivity.json` as OUT.json.

A sample is small: a number that moves nothing here may decide a picture that is not in it. Nothing was tuned by it.

- **word**: verdicts that become another word; a change to `bug` is a false alarm, one from it a bug that is missed
- **name**: verdicts of the same word whose findings have other names
- **figure**: verdicts whose `severity`, how near they are to `bug`, changes by more than a tenth
- **search stopped**: the search took more than fifteen times as much processor time, and was given up

"""


class Effect(TypedDict, total=False):
    """What halving or doubling a number does."""

    words: int
    names: int
    figures: int
    changes: list[str]
    fails: str
    time: float


class Measured(TypedDict):
    """judge-sensitivity.json."""

    pictures: int
    bugs: int
    words: dict[str, int]
    rows: dict[str, dict[str, Effect]]


def moves(effect: Effect) -> bool:
    return bool(effect.get("fails") or effect["words"] or effect["names"] or effect["figures"])


def told(effect: Effect) -> str:
    """An effect in a cell of the table.

    >>> told({"words": 1, "names": 0, "figures": 2, "changes": ["pass to bug"], "time": 1.0})
    '1 word (pass to bug), 2 figures'
    """
    if "fails" in effect:
        return "search stopped" if effect["fails"].startswith("TimeoutError") else f"fails: {effect['fails'][:60]}"
    parts = []
    for key, name in (("words", "word"), ("names", "name"), ("figures", "figure")):
        count = {"words": effect["words"], "names": effect["names"], "figures": effect["figures"]}[key]
        if count:
            which = f" ({', '.join(sorted(set(effect['changes'])))})" if key == "words" else ""
            parts.append(f"{count} {name}{'s' if count > 1 else ''}{which}")
    return ", ".join(parts) or "-"


def page(measured: Measured) -> str:
    """The page of what was ``measured``."""
    rows = {name: row for name, row in measured["rows"].items() if set(row) == {"halved", "doubled"}}
    moving = {name: row for name, row in rows.items() if any(map(moves, row.values()))}
    words = ", ".join(f"{count} `{word}`" for word, count in sorted(measured["words"].items()))
    lines = [HEAD.format(pictures=measured["pictures"], bugs=measured["bugs"], words=words)]
    deciding = sum(any(effect.get("words", 0) for effect in row.values()) for row in rows.values())
    lines.append(
        f"Of {len(found())} numbers {len(rows)} were measured: {deciding} move a word, {len(moving) - deciding} only a "
        f"name, a figure or the time of the search, {len(rows) - len(moving)} nothing in this sample.\n\n"
    )
    lines.append("| number | halved | doubled |\n|---|---|---|\n")
    lines += [f"| `{name}` | {told(row['halved'])} | {told(row['doubled'])} |\n" for name, row in moving.items()]
    still = [f"`{name}`" for name in rows if name not in moving]
    lines.append(f"\n## Numbers that moved nothing\n\n{', '.join(still)}.\n")
    left = sorted(set(found()) - set(rows))
    if left:
        lines.append(f"\n## Not measured yet\n\n{', '.join(f'`{name}`' for name in left)}.\n")
    return "".join(lines)


def main(newer: list[Path]) -> None:
    measured: Measured | None = json.loads(KEPT.read_text("utf-8")) if KEPT.exists() else None
    for path in newer:
        read: Measured = json.loads(path.read_text("utf-8"))
        rows = {**(measured["rows"] if measured else {}), **read["rows"]}
        measured = {**read, "rows": {name: rows[name] for name in found() if name in rows}}
    assert measured is not None, "nothing was measured yet"
    KEPT.write_text(json.dumps(measured, indent=1) + "\n", "utf-8")
    PAGE.write_text(page(measured), "utf-8")


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
