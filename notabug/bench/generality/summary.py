"""From the records of the bench to its numbers and its tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from notabug.bench.generality.examine import Record

CONTROLS = ("black", "noise")  # pictures that must not pass
WORDS = ("pass", "limitation", "bug", "inconclusive", "unsupported", "error", "traceback")


def summary(records: Sequence[Record]) -> Record:
    """Counts of each part, and the records that somebody has to look at."""
    parts = list(dict.fromkeys(each["part"] for each in records))
    return {part: _part(part, [each for each in records if each["part"] == part]) for part in parts}


def _part(part: str, records: Sequence[Record]) -> Record:
    found: dict[str, Any] = {"pictures": len(records), "words": words(records)}
    found["tracebacks"] = [each for each in records if each["word"] == "traceback"]
    found["errors"] = [each for each in records if each["word"] == "error"]
    found["controls_passed"] = [
        each for each in records if each["renderer"] in CONTROLS and each["word"] in ("pass", "limitation")
    ]
    if part != "faults":
        found["false_bugs"] = [
            each
            for each in records
            if each["word"] == "bug" and each["renderer"] not in CONTROLS and not each.get("fault")
        ]
    if part in ("faults", "exports"):
        shown = [each for each in records if each.get("shows")]
        named = [each for each in shown if each["word"] == "bug" and each.get("named")]
        found["shown"] = len(shown)
        found["called_bug"] = _share(sum(each["word"] == "bug" for each in shown), len(shown))
        found["named_right"] = _share(sum(_right(each) for each in named), len(named))
        found["missed"] = [each for each in shown if each["word"] != "bug"]
        found["misnamed"] = [each for each in named if not _right(each)]
        found["judging"] = judging([record for record in named if "judging" in record])
        found["kinds"] = sorted({f"{each['renderer']}: {each['fault']}" for each in shown})
    if part == "limitations":
        judged = [each for each in records if each["word"] in ("pass", "limitation", "bug", "inconclusive")]
        found["called_bug"] = _share(sum(each["word"] == "bug" for each in judged), len(judged))
    return found


def judging(records: Sequence[Record]) -> dict[str, dict[str, float]]:
    """The time that a verdict took, in seconds that passed and in those of processors: median, 95 % and the longest."""
    if not records:
        return {}
    taken = {kind: [record["judging"][kind] for record in records] for kind in ("seconds", "processor")}
    shares = {"median": 50, "95 %": 95, "longest": 100}
    return {
        kind: {name: round(float(np.percentile(times, share)), 3) for name, share in shares.items()}
        for kind, times in taken.items()
    }


def _right(record: Record) -> bool:
    return bool(record["bugs"]) and record["bugs"][0] in record["right"]


def _share(hits: int, of: int) -> Record:
    return {"hits": hits, "of": of, "share": hits / of if of else None}


def words(records: Sequence[Record]) -> dict[str, dict[str, int]]:
    """How often each word was said of each renderer's pictures."""
    counts: dict[str, Counter[str]] = {}
    for each in records:
        counts.setdefault(each["renderer"], Counter())[each["word"]] += 1
    return {name: {word: count[word] for word in WORDS} for name, count in counts.items()}


def is_bad(found: Record) -> bool:
    """Whether something is wrong with us: a false bug, a traceback, a control that passed."""
    return any(found.get(key) for key in ("false_bugs", "tracebacks", "controls_passed"))


def sentence(record: Record) -> str:
    """A record in one line: where it is from, and what was said."""
    what = record.get("mesh") or f"{record['seed']}/{record['index']}"
    details = " ".join(str(record[key]) for key in ("fault", "limitation", "traits") if record.get(key))
    names = ", ".join(record.get("bugs", []))
    pixels = f", {record['bug_pixels']:.0f} pixels" if record.get("bug_pixels") else ""
    word = f"{record['word']} {names}".rstrip()
    return f"{record['part']} {what} {record['renderer']}: {word}{pixels} ({details}) {record['message']}"
