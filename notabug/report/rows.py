"""What the page says of each result: its group, its cause in one sentence, its numbers, and what comes next."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from notabug.report.comparison import CHANGES, changes, expected_change
from notabug.report.next_steps import accept_command, accept_entry, why_command
from notabug.results.alike import alike
from notabug.results.record import Result
from notabug.results.wording import WORST_FIRST, area, counted, finding_names, number, readable, strongest

Key = tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class Shown:
    """One picture: ``name`` is that of its PNG, empty where there is nothing to see, and ``note`` says why."""

    title: str
    name: str = ""
    note: str = ""
    boxed: bool = False  # the findings' boxes lie over it


@dataclass(frozen=True, slots=True)
class Row:
    """One result as the page shows it. ``main`` are the pictures that tell the bug, ``more`` the others."""

    id: str
    result: Result
    cause: str
    expected: str  # new, worse, better, fixed or "": against what is expected
    against: str  # the same against the baseline
    main: tuple[Shown, ...]
    more: tuple[Shown, ...]
    facts: tuple[tuple[str, str, str], ...]  # the legend's word for it, name, value
    downloads: tuple[tuple[str, str], ...]  # title, path relative to the page
    why: str
    accept: str
    entry: str

    @property
    def words(self) -> str:
        """What a search looks through."""
        parts = (self.result.scene, self.result.variant, self.result.renderer, finding_names(self.result), self.cause)
        return " ".join(parts).lower()


@dataclass(frozen=True, slots=True)
class Same:
    """Rows of one renderer that are told as one, with what they have in common."""

    title: str
    cause: str
    rows: tuple[Row, ...]
    logs: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Group:
    """A section of the page: rows that are open as cards, rows that are folded, and rows that are told as one.

    The cards are by cause: the first row of each is open, the others of the same renderer and cause are folded below.
    """

    id: str
    title: str
    note: str
    cards: tuple[Same, ...] = ()
    rows: tuple[Row, ...] = ()
    same: tuple[Same, ...] = ()
    folded: bool = False

    @property
    def count(self) -> int:
        return sum(len(each.rows) for each in self.cards) + len(self.rows) + sum(len(each.rows) for each in self.same)


@dataclass(frozen=True, slots=True)
class Count:
    """One renderer's line of the summary."""

    renderer: str
    version: str
    words: Mapping[str, int]
    expected: Mapping[str, int]
    against: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class Summary:
    """The head of the page."""

    headline: str
    red: bool
    counts: tuple[Count, ...]
    expected: Mapping[str, tuple[Row, ...]] = field(default_factory=dict)
    against: Mapping[str, tuple[Row, ...]] = field(default_factory=dict)
    gone: int = 0  # jobs of the baseline that this run has not done


def key(result: Result) -> Key:
    return (result.scene, result.variant, result.renderer)


def row_id(result: Result) -> str:
    """The result's address on the page; two results never share one.

    >>> from notabug.metrics.verdict import Verdict
    >>> row_id(Result("acne/slab", "", "povray", "", Verdict("pass")))[:18]
    'acne-slab--povray-'
    """
    text = "\0".join(key(result))
    tag = hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=3).hexdigest()
    return re.sub(r"[^A-Za-z0-9_-]", "-", f"{result.scene}--{result.renderer}")[:80] + f"-{tag}"


def cause(result: Result) -> str:
    """One plain sentence: what is wrong and how much of it, else the verdict's own message."""
    verdict = result.verdict
    own = [finding for finding in verdict.findings if finding.kind == verdict.word]
    message = " ".join(verdict.message.split())
    if not own or verdict.word != "bug":
        return message
    names = ", ".join(dict.fromkeys(readable(each.name) for each in own))
    told = "; ".join(dict.fromkeys(each.message for each in own if each.message)) or message
    seen = "visible" if any(each.visible for each in own) else "which no eye would see"
    told += f"; {result.under}" if result.under else ""
    return f"{names[:1].upper()}{names[1:]}: {told} ({number(round(area(result), 1))} pixels, {seen})."


def make_row(
    result: Result,
    out: Path,
    pictures: tuple[tuple[Shown, ...], tuple[Shown, ...]],
    peak: tuple[int, int] | None,
    models: str,
    against: str,
    *,
    files: bool,
) -> Row:
    """The row of ``result``; ``peak`` is its worst pixel, ``files``: the page lies beside the pictures."""
    named = {"picture": result.image, **{readable(name): path for name, path in result.images.items()}}
    distinct = {path: title for title, path in reversed(named.items()) if path.endswith(".exr")}
    telling = result.verdict.word in ("bug", "inconclusive", "limitation", "error")
    return Row(
        id=row_id(result),
        result=result,
        cause=cause(result),
        expected=expected_change(result),
        against=against,
        main=pictures[0],
        more=pictures[1],
        facts=facts(result),
        downloads=tuple((title, path) for path, title in reversed(distinct.items())) if files else (),
        why=why_command(result, out, peak) if telling else "",
        accept=accept_command(result, out) if telling else "",
        entry=accept_entry(result, models) if telling and result.verdict.word != "error" else "",
    )


def facts(result: Result) -> tuple[tuple[str, str, str], ...]:
    """The numbers of a result, as (the legend's word, name, value)."""
    verdict = result.verdict
    made: list[tuple[str, str, str]] = []
    if verdict.findings:
        made.append(("area", "area", f"{number(round(area(result), 1))} px"))
        made.append(("jnd", "jnd", number(strongest(result), 2)))
        if significance := max(finding.z for finding in verdict.findings):
            made.append(("z", "z", number(significance)))
    for name, leg in verdict.legs.items():
        if leg.pixels:
            told = f"{leg.pixels} px, FLIP {number(leg.flip)}, max {number(leg.flip_max)}"
            made.append(("FLIP", f"{readable(name)} leg", told))
    if result.samples:
        told = f"{result.samples} x {result.seeds} seeds" if result.seeds > 1 else str(result.samples)
        made.append(("", "samples", told))
    if result.samples or result.seconds.get("render"):
        seconds = result.seconds
        made.append(("", "seconds", f"{number(seconds['render'])} render, {number(seconds['judge'])} judge"))
    numbers = ((readable(name), number(value, 4)) for name, value in verdict.numbers.items() if name != "seeds")
    made += [("", name, value) for name, value in numbers]
    if verdict.triggers:
        made.append(("", "triggers", ", ".join(verdict.triggers)))
    if result.renderer_version:
        made.append(("", "version", result.renderer_version))
    return tuple(made)


def worst_first(row: Row) -> tuple[object, ...]:
    """A sort key: what fails, then what an eye would see, by its area, by how visible it is."""
    result = row.result
    visible = any(finding.visible for finding in result.verdict.findings)
    return (not result.fails, not visible, -area(result), -strongest(result), *key(result))


def groups(rows: Sequence[Row], out: Path) -> list[Group]:
    """The sections of the page, what needs attention first; empty ones are left out."""
    of = {word: [row for row in rows if row.result.verdict.word == word] for word in WORST_FIRST}
    failing = [row for row in rows if row.result.fails and row.result.verdict.word not in ("bug", "error")]
    rest = {word: [row for row in found if row not in failing] for word, found in of.items()}
    worst = "worst first: what fails the run, then what an eye would see, then by area"
    other = "not a bug, but not what is expected of it"
    agree, lacks = "the picture agrees with the reference", "the renderer lacks what the scene needs"
    made = [
        Group("bugs", "Bugs", worst, cards=_by_cause(sorted(of["bug"], key=worst_first))),
        Group("fails", "Other results that fail", other, rows=tuple(sorted(failing, key=worst_first))),
        Group("errors", "Errors", "the renderer failed, or is not judged", same=_same(of["error"], out)),
        Group("inconclusive", "Inconclusive", "too noisy or too lossy to tell", rows=tuple(rest["inconclusive"])),
        Group(
            "limitations",
            "Limitations",
            "what a legitimate algorithm must show",
            rows=tuple(sorted(rest["limitation"], key=worst_first)),
            folded=True,
        ),
        Group("passes", "Passes", agree, rows=tuple(rest["pass"]), folded=True),
        Group("unsupported", "Unsupported", lacks, same=_same(rest["unsupported"], out), folded=True),
    ]  # fmt: skip
    return [group for group in made if group.count]


def _by_cause(rows: Sequence[Row]) -> tuple[Same, ...]:
    """``rows`` by renderer and by what is said of them, each cause in the place of its first row."""
    found: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        message = " ".join(row.result.verdict.message.split())
        found.setdefault((row.result.renderer, message) if message else key(row.result), []).append(row)
    return tuple(
        Same(title=_title(first.result), cause=_scenes(same), rows=(first, *rest))
        for first, *rest in found.values()
        for same in [(first, *rest)]
    )


def _title(result: Result) -> str:
    """The renderer and its cause, with the one type of light under which it shows."""
    return f"{result.renderer}: {result.verdict.message}{f'; {result.under}' if result.under else ''}"


def _scenes(rows: Sequence[Row]) -> str:
    """How many scenes ``rows`` are of, or variants of one scene."""
    scenes = len({row.result.scene for row in rows})
    return counted(scenes, "scene") if scenes > 1 else counted(len(rows), "variant")


def _same(rows: Sequence[Row], out: Path) -> tuple[Same, ...]:
    of = {key(row.result): row for row in rows}
    return tuple(
        Same(
            title=", ".join(each.renderers),
            cause=each.told,
            rows=tuple(of[key(result)] for result in each.results),
            logs=tuple((out / log).as_posix() for log in each.logs),
        )
        for each in alike([row.result for row in rows])
    )


def summarise(rows: Sequence[Row], versions: Mapping[str, str], baseline: Mapping[Key, Result] | None) -> Summary:
    """The head of the page: counts a renderer, and what has changed."""
    by_state = {name: tuple(row for row in rows if row.expected == name) for name in CHANGES}
    if _told_by_cards(rows, by_state):
        by_state = dict.fromkeys(CHANGES, ())
    counts = []
    for renderer in dict.fromkeys(row.result.renderer for row in rows):
        own = [row for row in rows if row.result.renderer == renderer]
        counts.append(
            Count(
                renderer,
                versions.get(renderer, ""),
                {word: sum(row.result.verdict.word == word for row in own) for word in WORST_FIRST},
                {name: sum(row.result.renderer == renderer for row in by_state[name]) for name in CHANGES},
                {name: sum(row.against == name for row in own) for name in CHANGES},
            )
        )
    by_change = {name: tuple(row for row in rows if row.against == name) for name in CHANGES}
    failing = sum(row.result.fails for row in rows)
    here = {key(row.result) for row in rows}
    by_word: Counter[str] = Counter(row.result.verdict.word for row in rows)
    words = ", ".join(f"{by_word[word]} {word}" for word in WORST_FIRST if by_word[word]) or "no results"
    told = all(row.result.fails == (row.result.verdict.word in ("bug", "error")) for row in rows)
    fails = f"{failing} of {len(rows)} results fail{'s' if failing == 1 else ''}; in all "
    return Summary(
        headline=f"{'' if told else fails}{words}" if failing else f"nothing fails: {words}",
        red=bool(failing),
        counts=tuple(counts),
        expected=by_state,
        against=by_change,
        gone=len(baseline.keys() - here) if baseline is not None else 0,
    )


def _told_by_cards(rows: Sequence[Row], by_state: Mapping[str, Sequence[Row]]) -> bool:
    """Whether the list of what is not expected would only name the bugs, whose cards are the first of the page."""
    bugs = [row for row in rows if row.result.verdict.word == "bug"]
    return list(by_state["new"]) == bugs and not any(found for name, found in by_state.items() if name != "new")


def changes_against(results: Sequence[Result], baseline: Mapping[Key, Result] | None) -> dict[Key, str]:
    """How each result compares with the one of ``baseline``."""
    if baseline is None:
        return {}
    return changes(list(baseline.values()), results)
