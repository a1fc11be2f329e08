"""What is expected of a result: by the corpus's tables or by what a team has accepted, and how a result compares."""

from __future__ import annotations

import datetime
from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from notabug.results.record import Result

State = Literal["", "as expected", "grew", "improved", "new", "fixed", "expired", "models changed"]
"""How a result compares with what is expected of it; "" where nothing is. An entry that no result met is "unused"."""

WORSE = frozenset({"grew", "new", "expired", "models changed"})
BETTER = frozenset({"improved", "fixed"})
Band = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Statement:
    """A verdict as tables write it: a word and the names of what was found; no names: any."""

    word: str
    names: frozenset[str] = frozenset()

    @classmethod
    def parse(cls, text: str) -> Statement:
        """
        >>> Statement.parse("limitation: facet_self_shadow").word
        'limitation'
        """
        word, _, names = text.partition(":")
        return cls(word.strip(), frozenset(each.strip() for each in names.split("+")) - {""})

    def fits(self, result: Result) -> bool:
        """The result has the word, and where names are stated exactly those of its decisive kind."""
        return self.word == result.verdict.word and (not self.names or self.names == found_names(result))


@dataclass(frozen=True, slots=True)
class Entry:
    """What a team has accepted: the result of one scene, variant and renderer, within bands, for a reason.

    ``area_px`` and ``jnd`` are [least, most] of the sum and of the largest of the decisive findings; ``models`` is the
    version of scenes, models and judge that it was accepted under.
    """

    renderer: str
    scene: str
    variant: str
    verdict: str
    because: str
    models: str
    name: str = ""  # "facet_self_shadow", several joined by " + "
    area_px: Band | None = None
    jnd: Band | None = None
    link: str = ""
    expires: datetime.date | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        return (self.renderer, self.scene, self.variant)

    @property
    def statement(self) -> Statement:
        return Statement.parse(f"{self.verdict}: {self.name}")


def found_names(result: Result) -> frozenset[str]:
    """The names of the findings that made the verdict."""
    return frozenset(finding.name for finding in result.verdict.findings if finding.kind == result.verdict.word)


def against_entry(result: Result, entry: Entry, models: str, today: datetime.date) -> State:
    """How ``result`` compares with an accepted ``entry``, when it was judged with ``models``."""
    state = _within_band(result, entry)
    if state == "as expected":
        return "expired" if entry.expires is not None and entry.expires < today else state
    return "models changed" if entry.models != models else state


def against_table(result: Result, stated: str) -> State:
    """How ``result`` compares with what the scene's own table states; with nothing stated a bug is new."""
    if not stated:
        return "new" if result.verdict.word == "bug" else ""
    statement = Statement.parse(stated)
    if result.verdict.word == statement.word:
        return "as expected"
    return "fixed" if result.verdict.word == "pass" else "new"


def leaves_upwards(result: Result, entry: Entry) -> bool:
    """The result is worse than the entry says, whatever it was accepted under."""
    return _within_band(result, entry) in WORSE


def _within_band(result: Result, entry: Entry) -> State:
    from notabug.results.wording import area, strongest

    word, statement = result.verdict.word, entry.statement
    if word == "pass":
        return "fixed"
    if word != statement.word:
        return "improved" if (statement.word, word) == ("bug", "limitation") else "new"
    found = found_names(result)
    sizes = [_side(area(result), entry.area_px), _side(strongest(result), entry.jnd)]
    if (statement.names and found - statement.names) or 1 in sizes:
        return "grew"
    return "improved" if (statement.names - found) or -1 in sizes else "as expected"


def _side(value: float, band: Band | None) -> int:
    """-1 below the band, 0 inside, 1 above."""
    if band is None:
        return 0
    return (value > band[1]) - (value < band[0])


def unused(entries: Collection[Entry], results: Collection[Result]) -> list[Entry]:
    """The entries that no result met."""
    met = {(result.renderer, result.scene, result.variant) for result in results}
    return [entry for entry in entries if entry.key not in met]
