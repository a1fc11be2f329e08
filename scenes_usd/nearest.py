"""A name that does not exist: which one may have been meant, or which there are."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

LIKE = 0.75  # of two words' letters that are common, in order: from here on one is taken for a slip of the other
SEE_SCENES = "`notabug list scenes` has all"
FEW = 6  # names that are read at a glance: so many are listed beside the likeliest


def instead_of(word: str, known: Iterable[str], *, more: str = "", see: str = "") -> tuple[str, str]:
    """What an error about ``word``, which is none of ``known``, expects, and what it says to do.

    Where ``word`` is a slip of a known name that name is told, and a long list, in which nobody would find it, is left
    out; else all names are listed, then what ``more`` is taken. ``see`` says where all are described.

    >>> instead_of("blet", ["belt", "hat", "sock", "shoe", "coat", "scarf", "glove"])
    ('', "did you mean 'belt'?")
    >>> instead_of("cup", ["belt", "hat"], more="the path of a file")
    ('one of belt, hat, or the path of a file', '')
    """
    names = list(dict.fromkeys(known))
    likeliest = near(word, names)
    meant = f"did you mean {likeliest!r}?" if likeliest else ""
    listed = [*names, *([f"or {more}"] if more else [])] if not likeliest or len(names) <= FEW else []
    return f"one of {', '.join(listed)}" if listed else "", " ".join(part for part in (meant, see) if part)


def near(word: str, known: Iterable[str]) -> str:
    """The name that ``word`` is a slip of; "" where it is none."""
    by_lower = {name.lower(): name for name in reversed(list(dict.fromkeys(known)))}
    found = get_close_matches(word.lower(), by_lower, n=1, cutoff=LIKE)
    return by_lower[found[0]] if found else ""
