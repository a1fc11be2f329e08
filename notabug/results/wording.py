"""How verdicts and numbers are written for people: the same words and styles on the terminal and in the report."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable

from notabug.metrics.verdict import Finding
from notabug.results.record import Result

STYLE: dict[str, str] = {
    "pass": "green",
    "limitation": "cyan",
    "bug": "bold red",
    "inconclusive": "yellow",
    "unsupported": "dim",
    "error": "bold magenta",
}
WORST_FIRST = ("bug", "error", "inconclusive", "limitation", "pass", "unsupported")  # the verdicts as pages have them


def number(value: float | None, digits: int = 3) -> str:
    """``value`` in at most ``digits`` significant digits, without an exponent where it stays short.

    >>> number(0.00412345), number(41.0), number(None), number(123456.0)
    ('0.00412', '41', '–', '123456')
    """
    if value is None or not math.isfinite(value):
        return "–"
    if value == round(value) and abs(value) < 1e7:
        return str(round(value))
    return f"{value:.{digits}g}" if abs(value) < 10**digits else str(round(value))


def triple(values: Iterable[float]) -> str:
    """The numbers of a pixel.

    >>> triple((0.25, 1.0, 1 / 3))
    '0.25 1 0.33333'
    """
    return " ".join(f"{float(value):.5g}" for value in values)


def readable(name: str) -> str:
    """``facet_self_shadow`` as ``facet self shadow``."""
    return name.replace("_", " ")


def duration(seconds: float) -> str:
    """How long something takes, as one says what one does not know to the second.

    >>> duration(12.2), duration(63), duration(187)
    ('about 15 s', 'about a minute', 'about 3 minutes')
    """
    if seconds < 55.0:
        return f"about {5 * math.ceil(seconds / 5.0):.0f} s"
    minutes = round(seconds / 60.0)
    return "about a minute" if minutes <= 1 else f"about {minutes} minutes"


def counted(count: int, thing: str) -> str:
    """A number of things.

    >>> counted(1, "mesh"), counted(2, "light")
    ('1 mesh', '2 lights')
    """
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def finding_names(result: Result) -> str:
    """The findings' names, each once; of a bug what is wrong, and then the limitations that are there beside it."""
    made = decisive(result)
    told = list(dict.fromkeys(readable(finding.name) for finding in made))
    also = [readable(finding.name) for finding in result.verdict.findings if finding not in made]
    also = [name for name in dict.fromkeys(also) if name not in told]
    if result.verdict.word == "bug" and also:
        return f"{', '.join(told)} beside {', '.join(also)}"
    return ", ".join(dict.fromkeys(readable(finding.name) for finding in result.verdict.findings))


def decisive(result: Result) -> tuple[Finding, ...]:
    """The findings that made the verdict: the bugs of a bug, the limitations of a limitation, else all."""
    findings = result.verdict.findings
    return tuple(finding for finding in findings if finding.kind == result.verdict.word) or findings


def area(result: Result) -> float:
    """The area of the decisive findings in pixels."""
    return sum(each.area_px for each in decisive(result))


def strongest(result: Result) -> float:
    """The largest jnd among the decisive findings."""
    return max((each.jnd for each in decisive(result)), default=0.0)


def tally(words: Iterable[str]) -> str:
    """``3 pass, 1 bug``: the verdict words counted, in the order of their seriousness."""
    counted = Counter(words)
    return ", ".join(f"{counted[word]} {word}" for word in STYLE if counted[word]) or "no results"
