"""Writes docs/judge-sensitivity.md: what notabug.bench.verdict.sensitivity measured, kept in judge-sensitivity.json.

``python docs/judge_sensitivity.py`` writes the page; ``python docs/judge_sensitivity.py NEW.json ...`` first takes the
rows of newer measurements into the file that is kept.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TypedDict

from notabug.bench.verdict.reads import EVERY

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "judge-sensitivity.md"
KEPT = ROOT / "docs" / "judge-sensitivity.json"
HEAD = """\
# What each number decides

How much a verdict depends on each of [the numbers that decide](judge-numbers.md). A judgement that never reads a number
cannot move by it. So a fixed sample was judged once with a note of every number that is read: {pictures} pictures, most
of 40 x 40 pixels from the tuning half of `notabug bench verdict` ({words}),
and {cards} pictures of the calibration card as right and wrong adapters give it. Then pictures that read a number were
judged with it halved and doubled; where the first of them showed no change, the others were judged until one did.

`python -m notabug.bench.verdict.sensitivity OUT.json` measures it, and goes on where it was stopped;
`python docs/judge_sensitivity.py OUT.json` writes this page. A sample is small: a number that moves nothing here may
decide a picture that is not in it. Nothing was tuned by it.

- **read by**: pictures of the sample whose judgement, name or card reads the number
- **word**: verdicts that become another word; a change to `bug` is a false alarm, one from it a bug that is missed
- **name**: verdicts of the same word whose findings have other names
- **figure**: verdicts whose `severity`, how near they are to `bug`, changes by more than a tenth
- **detail**: verdicts in which any other number, box or message changes at all
- **search stopped**: the search took more than five times as much processor time, and was given up

"""
OLDER = """\
Rows with a star were measured before reads were noted, on 27 pictures of the same half, of which four were named;
details were not compared, and a search was stopped at fifteen times the time.

"""


class Effect(TypedDict, total=False):
    """What halving or doubling a number does, of ``judged`` pictures."""

    judged: int
    words: int
    names: int
    figures: int
    details: int
    changes: list[str]
    fails: str
    older: bool


class Measured(TypedDict):
    """judge-sensitivity.json."""

    pictures: int
    cards: int
    words: dict[str, int]
    reads: dict[str, int]
    rows: dict[str, dict[str, Effect]]


def moves(effect: Effect) -> bool:
    """Whether anything changes."""
    return told(effect) != "-"


def told(effect: Effect) -> str:
    """An effect in a cell of the table.

    >>> told({"judged": 9, "words": 1, "names": 0, "figures": 2, "details": 3, "changes": ["pass to bug"]})
    '1 word (pass to bug), 2 figures of 9'
    >>> told({"judged": 9, "words": 0, "names": 0, "figures": 0, "details": 3, "changes": []})
    '3 details of 9'
    """
    if "fails" in effect:
        return "search stopped" if effect["fails"].startswith("TimeoutError") else f"fails: {effect['fails'][:60]}"
    counts = {"word": effect["words"], "name": effect["names"], "figure": effect["figures"]}
    if not any(counts.values()):
        counts = {"detail": effect["details"]}
    which = f" ({', '.join(sorted(set(effect['changes'])))})" if effect["changes"] else ""
    parts = [
        f"{count} {name}{'s' if count > 1 else ''}{which if name == 'word' else ''}"
        for name, count in counts.items()
        if count
    ]
    return f"{', '.join(parts)} of {effect['judged']}" if parts else "-"


def starred(name: str, row: dict[str, Effect]) -> str:
    """The number's name in a table, with a star where it was measured in the older way."""
    older = any(effect.get("older") for effect in row.values())
    return f"`{name}`" + r" \*" * older


def listed(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def page(measured: Measured) -> str:
    """The page of what was ``measured``."""
    rows, reads = measured["rows"], measured["reads"]
    words = ", ".join(f"{count} `{word}`" for word, count in sorted(measured["words"].items()))
    moving = [name for name in EVERY if name in rows and any(map(moves, rows[name].values()))]
    still = [name for name in EVERY if name in rows and name not in moving and reads.get(name)]
    unread = [name for name in EVERY if not reads.get(name) and name not in moving]
    left = [name for name in EVERY if name not in rows and name not in unread]
    deciding = sum(any(effect.get("words", 0) for effect in rows[name].values()) for name in moving)
    lines = [HEAD.format(pictures=measured["pictures"], cards=measured["cards"], words=words)]
    lines.append(
        f"Of {len(EVERY)} numbers {deciding} move a word, {len(moving) - deciding} only a name, a figure, a detail or "
        f"the time of the search, {len(still)} nothing in the pictures that read them, and {len(unread)} are read by "
        f"none of them{f'; {len(left)} are not measured yet' if left else ''}.\n\n"
    )
    if any(effect.get("older") for row in rows.values() for effect in row.values()):
        lines.append(OLDER)
    lines.append("| number | read by | halved | doubled |\n|---|---|---|---|\n")
    for name in moving:
        halved, doubled = (told(rows[name][kind]) for kind in ("halved", "doubled"))
        lines.append(f"| {starred(name, rows[name])} | {reads[name]} | {halved} | {doubled} |\n")
    if still:
        lines.append("\n## Numbers that moved nothing\n\nThe pictures that read each were judged with it.\n\n")
        lines.append("| number | read by | judged |\n|---|---|---|\n")
        judged = {name: rows[name]["halved"]["judged"] for name in still}
        lines += [f"| {starred(name, rows[name])} | {reads[name]} | {judged[name]} |\n" for name in still]
    if unread:
        lines.append(f"\n## Numbers that no picture of the sample reads\n\n{listed(unread)}.\n")
    if left:
        lines.append("\n## Not measured yet\n\n| number | read by |\n|---|---|\n")
        lines += [f"| `{name}` | {reads[name]} |\n" for name in left]
    return "".join(lines)


def main(newer: list[Path]) -> None:
    """Take ``newer`` measurements in, and write the page."""
    measured: Measured | None = json.loads(KEPT.read_text("utf-8")) if KEPT.exists() else None
    for path in newer:
        read: Measured = json.loads(path.read_text("utf-8"))
        rows = {**(measured["rows"] if measured else {}), **read["rows"]}
        measured = {**read, "rows": {name: rows[name] for name in EVERY if name in rows}}
    assert measured is not None, "nothing was measured yet"
    KEPT.write_text(json.dumps(measured, indent=1) + "\n", "utf-8")
    PAGE.write_text(page(measured), "utf-8")


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
