"""Results that say the same: one renderer's mistake is told once, with a count, wherever it is told."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from notabug.results.gate import OF_FILES
from notabug.results.record import Result

_VARYING = (
    (re.compile(r"'[^']*'|\"[^\"]*\""), "''"),  # what is quoted: a name, a prim's path
    (re.compile(r"[^\s;,:()]*/[^\s;,:()]*"), "PATH"),
    (re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"), "N"),
)


_WORDS = r"[a-z_]+(?: with [a-z_]+)*"  # a feature, or several that are missing together alone
_NEEDS = re.compile(rf" needs ({_WORDS}(?:, {_WORDS})*);")  # as adapters.requirements says it


@dataclass(frozen=True, slots=True)
class Alike:
    """Results of one verdict whose messages differ by names, paths and numbers only.

    They are one renderer's, or, where the disk is to blame, of several.
    """

    results: tuple[Result, ...]

    @property
    def first(self) -> Result:
        return self.results[0]

    @property
    def renderers(self) -> tuple[str, ...]:
        """Whose results they are: several renderers' only where none of them is to blame."""
        return tuple(dict.fromkeys(result.renderer for result in self.results))

    @property
    def message(self) -> str:
        """The message of the first, on one line."""
        return " ".join(self.first.verdict.message.split())

    @property
    def told(self) -> str:
        """The message of the first; of what is unsupported the features that are missing, with how often."""
        if self.first.verdict.word != "unsupported":
            return self.message
        lacks = Counter(name for result in self.results for name in missing_features(result))
        if not lacks:
            return self.message
        if set(lacks.values()) == {len(self.results)}:  # each lacks all of it: the count of results says how often
            return "it lacks " + ", ".join(lacks)
        return "it lacks " + ", ".join(f"{name} ({count})" for name, count in lacks.most_common())

    @property
    def logs(self) -> tuple[str, ...]:
        """The logs of those that have one, relative to the run's folder."""
        return tuple(dict.fromkeys(result.log for result in self.results if result.log))


def alike(results: Sequence[Result]) -> list[Alike]:
    """``results`` by renderer, verdict and kind of message, each kind in the place of its first result."""
    found: dict[tuple[str, str, str], list[Result]] = {}
    for result in results:
        lacking = bool(missing_features(result))
        same = "lacking" if lacking else kind(result.verdict.message, result.scene)
        blamed = "" if OF_FILES in result.verdict.triggers else result.renderer  # a full disk is told once, for all
        key = (blamed, result.verdict.word, same)
        found.setdefault(key, []).append(result)
    return [Alike(tuple(same)) for same in found.values()]


def missing_features(result: Result) -> tuple[str, ...]:
    """What an unsupported scene needs and the renderer has not, as the message names it."""
    if result.verdict.word != "unsupported":
        return ()
    told = _NEEDS.search(result.verdict.message)
    return tuple(told[1].split(", ")) if told else ()


def kind(message: str, scene: str = "") -> str:
    """``message`` without what differs from one scene to the next.

    >>> kind("adapter 'mine': cannot open texture out/a.png; exit code 3") == kind("adapter 'mine': cannot open "
    ...      "texture out/b/c.png; exit code 4")
    True
    """
    text = " ".join(message.split())
    if scene:
        text = text.replace(scene, "SCENE")
    for pattern, name in _VARYING:
        text = pattern.sub(name, text)
    return text
