"""``notabug.expect.toml``: read whole and checked, written one entry at a time with everything else left as it was."""

from __future__ import annotations

import datetime
import math
import re
import tomllib
from pathlib import Path
from typing import Any

from notabug.results.expectation import Band, Entry
from notabug.scenes_usd.catalogue import VERDICTS
from notabug.scenes_usd.errors import NotabugError

NAME = "notabug.expect.toml"
HEAD = """\
# What this project has accepted of its renderers' pictures; `notabug accept` writes an entry. Each holds for one scene,
# variant and renderer while area (pixels) and jnd stay within [least, most], until it expires.
"""
ACCEPTED = tuple(word for word in VERDICTS if word != "pass")
_TEXTS = ("renderer", "scene", "variant", "verdict", "name", "because", "link", "models")
_KEYS = (*_TEXTS, "area_px", "jnd", "expires")
_HEADER = re.compile(r"^[ \t]*\[\[[ \t]*accepted[ \t]*\]\]", re.MULTILINE)


class ExpectationError(NotabugError):
    """An expectation file that cannot be used, or an entry that cannot be written."""


def read(path: Path) -> tuple[Entry, ...]:
    """The entries of the file at ``path``; raises ExpectationError naming file, entry and key."""
    try:
        return parse(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise ExpectationError("cannot be read", where=str(path), got=str(error)) from error


def parse(text: str, where: str = NAME) -> tuple[Entry, ...]:
    """The entries that ``text`` holds."""
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ExpectationError("not valid TOML", where=where, got=str(error)) from error
    tables = document.get("accepted", [])
    if set(document) - {"accepted"} or not isinstance(tables, list):
        got = ", ".join(sorted(document))
        raise ExpectationError("not an expectation file", where=where, expected="[[accepted]] tables", got=got)
    entries = tuple(_entry(each, f"{where}: accepted[{index}]") for index, each in enumerate(tables))
    for index, each in enumerate(entries):
        if each.key in {other.key for other in entries[:index]}:
            raise ExpectationError(
                "a second entry for the same job",
                where=f"{where}: accepted[{index}]",
                got=" ".join(each.key),
                do="keep one",
            )
    return entries


def _entry(table: object, where: str) -> Entry:
    if not isinstance(table, dict):
        raise ExpectationError("not a table", where=where, got=repr(table))
    if unknown := sorted(set(table) - set(_KEYS)):
        raise ExpectationError("unknown key", where=where, expected=", ".join(_KEYS), got=", ".join(unknown))
    for key in _TEXTS:
        if not isinstance(table.get(key, ""), str):
            raise ExpectationError("not a text", where=f"{where}.{key}", got=repr(table[key]))
    for key in ("renderer", "scene", "verdict", "because", "models"):
        if not table.get(key, "").strip():
            raise ExpectationError("missing", where=f"{where}.{key}")
    if table["verdict"] not in ACCEPTED:
        raise ExpectationError(
            "not a verdict to accept",
            where=f"{where}.verdict",
            expected=f"one of {', '.join(ACCEPTED)}",
            got=repr(table["verdict"]),
        )
    expires = table.get("expires")
    if expires is not None and type(expires) is not datetime.date:
        raise ExpectationError("not a date", where=f"{where}.expires", expected="2027-01-31", got=repr(expires))
    texts = {key: table[key] for key in _TEXTS if key in table}
    area, jnd = (_band(table[key], f"{where}.{key}") if key in table else None for key in ("area_px", "jnd"))
    return Entry(**{"variant": "", **texts}, area_px=area, jnd=jnd, expires=expires)


def _band(value: object, where: str) -> Band:
    if isinstance(value, list) and len(value) == 2 and all(type(end) in (int, float) for end in value):
        least, most = value
        if 0.0 <= least <= most < math.inf:
            return (float(least), float(most))
    raise ExpectationError("not a band", where=where, expected="[least, most]", got=repr(value))


def with_entry(text: str, entry: Entry) -> str:
    """``text`` with ``entry`` in its sorted place, or in place of the one for the same job; all else as it was."""
    import tomlkit

    there = parse(text)
    document = tomlkit.parse(text)
    wanted = values(entry)
    for index, each in enumerate(there):
        if each.key == entry.key:
            tables_there: Any = document["accepted"]
            table = tables_there[index]
            for key in set(table) - set(wanted):
                del table[key]
            for key, value in wanted.items():
                table[key] = value
            return _checked(tomlkit.dumps(document), {*there[:index], *there[index + 1 :], entry})
    place = _place(text, sum(each.key < entry.key for each in there))
    before, after = text[:place], text[place:]
    if not before.strip():
        before = before or HEAD
    before = before.rstrip("\n") + "\n\n" if before.strip() else before
    return _checked(before + entry_text(entry) + (f"\n{after}" if after else ""), {*there, entry})


def entry_text(entry: Entry) -> str:
    """``entry`` as it stands in the file, its header included."""
    import tomlkit

    block = tomlkit.document()
    tables = tomlkit.aot()
    made = tomlkit.table()
    for key, value in values(entry).items():
        made.add(key, value)
    tables.append(made)
    block.add("accepted", tables)
    return tomlkit.dumps(block).strip("\n") + "\n"


def _place(text: str, index: int) -> int:
    """Where entry ``index`` begins, comment lines right above it included; the end of ``text`` after the last."""
    starts = [each.start() for each in _HEADER.finditer(text)]
    if index >= len(starts):
        return len(text)
    place = starts[index]
    while place:
        above = text.rfind("\n", 0, place - 1) + 1
        if not text[above:place].lstrip().startswith("#"):
            break
        place = above
    return place


def values(entry: Entry) -> dict[str, object]:
    """What the file says of ``entry``."""
    told: dict[str, Any] = {key: getattr(entry, key) for key in _TEXTS if getattr(entry, key)}
    for key in ("area_px", "jnd"):
        band = getattr(entry, key)
        if band is not None:
            told[key] = list(band)
    if entry.expires is not None:
        told["expires"] = entry.expires
    return told


def _checked(text: str, wanted: set[Entry]) -> str:
    if set(parse(text)) != wanted:
        raise ExpectationError("cannot be edited safely", where=NAME, do="write the entry by hand")
    return text
