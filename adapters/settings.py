"""Typed values out of a configuration table: each getter says what it expected where it finds something else."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from notabug.adapters.config import Table

PLACEHOLDERS = ("scene", "image", "width", "height", "samples", "seed", "threads", "folder")
_UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "KIB": 1 << 10, "MIB": 1 << 20, "GIB": 1 << 30}
_HOLE = re.compile(r"\{\{|\}\}|\{([^{}]*)\}|[{}]")


def text(table: Table, key: str, default: str) -> str:
    found = table.values.get(key, default)
    if not isinstance(found, str) or "\0" in found:
        raise table.fault(key, "not a string", got=repr(found))
    return found


def choice(table: Table, key: str, default: str, options: Sequence[str]) -> str:
    found = text(table, key, default)
    if found not in options:
        raise table.fault(key, "not one of its values", expected=f"one of {', '.join(options)}", got=repr(found))
    return found


def flag(table: Table, key: str, default: bool) -> bool:
    found = table.values.get(key, default)
    if not isinstance(found, bool):
        raise table.fault(key, "not a truth value", expected="true or false", got=repr(found))
    return found


def number(table: Table, key: str, default: float, low: float, high: float) -> float:
    found = table.values.get(key, default)
    if isinstance(found, bool) or not isinstance(found, int | float) or not low <= found <= high:
        raise table.fault(key, "not a number in its range", expected=f"{low:g} to {high:g}", got=repr(found))
    return found


def whole(table: Table, key: str, default: int, low: int, high: int) -> int:
    found = number(table, key, default, low, high)
    if not isinstance(found, int):
        raise table.fault(key, "not a whole number", got=repr(found))
    return found


def size(table: Table, key: str, default: int) -> int:
    """Bytes: a number, or words such as ``2 GiB``."""
    found = table.values.get(key, default)
    if isinstance(found, str):
        match = re.fullmatch(r"(\d{1,9}(?:\.\d{1,6})?)\s*([A-Za-z]{0,3})", found.strip())
        if match and match[2].upper() in _UNITS:
            return round(float(match[1]) * _UNITS[match[2].upper()])
    elif isinstance(found, int) and not isinstance(found, bool) and found >= 0:
        return found
    raise table.fault(key, "not a size", expected='bytes, or words such as "2 GiB"', got=repr(found))


def words(table: Table, key: str, default: Sequence[str] = ()) -> tuple[str, ...]:
    found: Any = table.values.get(key, list(default))
    if isinstance(found, str):
        raise table.fault(key, "not a list", expected='one string a word, as in ["prog", "--flag"]', got=repr(found))
    if not isinstance(found, list) or not all(isinstance(each, str) and "\0" not in each for each in found):
        raise table.fault(key, "not a list of strings", got=repr(found))
    return tuple(found)


def check_holes(table: Table, key: str, word: str, names: Sequence[str] = PLACEHOLDERS) -> None:
    """Raise ConfigError where ``word`` has a placeholder that is none of ``names``; ``{{`` and ``}}`` are braces."""
    for match in _HOLE.finditer(word):
        if match.group() not in ("{{", "}}") and match.group(1) not in names:
            of_a_call = match.group(1) in PLACEHOLDERS
            raise table.fault(
                key,
                f"{match.group()!r} changes from picture to picture"
                if of_a_call
                else f"unknown placeholder {match.group()!r}",
                expected=" ".join(f"{{{name}}}" for name in names),
                do="a server reads it from the line of each job" if of_a_call else "write {{ and }} for braces",
            )


def filled(each: str, values: dict[str, str]) -> str:
    """``each`` with its placeholders replaced, once: what a value holds is never read again.

    >>> filled("-o {image} {{}}", {"image": "{seed}.exr"})
    '-o {seed}.exr {}'
    """
    return _HOLE.sub(lambda match: values[match[1]] if match[1] is not None else match.group()[0], each)


def names_hole(parts: Sequence[str], name: str) -> bool:
    """Whether one of ``parts`` has the placeholder ``name``."""
    return any(match[1] == name for part in parts for match in _HOLE.finditer(part))
