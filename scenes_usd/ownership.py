"""Whose files are taken at their word: this user's and the system's, since nobody else should decide what runs here.

A configuration file names programs that run, a cache holds what verdicts are made from. Where another user owns one, or
anybody may write to it, whoever can do so could make this user run a program or believe a verdict. ``NOTABUG_OWNERS``
names the users, by name or number and joined by commas, that are trusted all the same, as in a container whose files
belong to a user outside.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

VARIABLE = "NOTABUG_OWNERS"


def why_foreign(path: Path) -> str:
    """Why ``path``, which is there, may be somebody else's work, or ""; "" too where a system has no owners."""
    if not hasattr(os, "geteuid"):
        return ""
    seen = path.stat()
    if seen.st_uid not in {0, os.geteuid(), *_trusted()}:
        return f"it belongs to {_name(seen.st_uid)}"
    return "anybody may write to it" if seen.st_mode & stat.S_IWOTH else ""


def how_to_allow(path: Path) -> str:
    """What a user can do who trusts ``path``, or is to be trusted with it."""
    seen = path.stat()
    if seen.st_mode & stat.S_IWOTH:
        return f"chmod o-w {path}"
    return f"set {VARIABLE}={_name(seen.st_uid)} where you trust them"


def _trusted() -> set[int]:
    """The numbers of the users that ``NOTABUG_OWNERS`` names; with sudo also who called it."""
    found = set[int]()
    for word in os.environ.get(VARIABLE, "").split(","):
        number = _number(word.strip())
        if number is not None:
            found.add(number)
    if os.geteuid() == 0 and os.environ.get("SUDO_UID", "").isdecimal():
        found.add(int(os.environ["SUDO_UID"]))
    return found


def _number(word: str) -> int | None:
    if word.isdecimal():
        return int(word)
    try:
        import pwd

        return pwd.getpwnam(word).pw_uid
    except (ImportError, KeyError, ValueError):
        return None


def _name(number: int) -> str:
    try:
        import pwd

        return pwd.getpwuid(number).pw_name
    except (ImportError, KeyError):
        return str(number)
