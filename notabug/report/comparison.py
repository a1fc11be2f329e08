"""How results have changed, in the four words of the page: new, worse, better, fixed."""

from __future__ import annotations

from collections.abc import Sequence

from notabug.results.changes import Change, compare
from notabug.results.record import Result

CHANGES = ("new", "worse", "better", "fixed")

_OF_STATE: dict[str, str] = {
    "new": "new",
    "grew": "worse",
    "expired": "worse",
    "models changed": "worse",
    "improved": "better",
    "fixed": "fixed",
}


def expected_change(result: Result) -> str:
    """Against what is expected of ``result``; what fails and was never expected is new."""
    known = _OF_STATE.get(result.state, "")
    return known or ("new" if result.fails else "")


def changes(before: Sequence[Result], after: Sequence[Result]) -> dict[tuple[str, str, str], str]:
    """The results of ``after`` that are not as they were in ``before``, by scene, variant and renderer."""
    found = compare(list(before), list(after))
    return {(each.scene, each.variant, each.renderer): told for each in found if (told := _told(each))}


def _told(change: Change) -> str:
    if not change.after:
        return ""
    if change.worse:
        return "new" if change.after in ("bug", "error") and change.before != change.after else "worse"
    if not change.before:
        return ""
    if change.after == "pass" and change.before in ("bug", "error", "inconclusive"):
        return "fixed"
    return "better" if change.course == "better" else ""
