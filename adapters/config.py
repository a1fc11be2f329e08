"""Renderers that a team describes in a file: the tables ``renderers.NAME`` of ``notabug.toml`` or ``pyproject.toml``.

The file is looked for in the working directory and then in each folder above it. In one folder ``notabug.toml`` is
taken before ``pyproject.toml``, and a ``pyproject.toml`` without a table ``tool.notabug`` does not count. The first
file found is the only one read: nothing is merged from folders above it. ``NOTABUG_CONFIG`` names a file instead.
A file that is found and that another user may have written is refused; one that is named is not.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.nearest import instead_of
from notabug.scenes_usd.ownership import how_to_allow, why_foreign

VARIABLE = "NOTABUG_CONFIG"
FILE, SHARED = "notabug.toml", "pyproject.toml"
LONGEST = 60  # characters of a renderer's name, which is a folder's too and stands in every line of a run
_MOST = 1 << 20  # bytes of a file: nobody writes more by hand


class ConfigError(NotabugError):
    """A configuration file that cannot be used: names the file and the key."""


@dataclass(frozen=True, slots=True)
class Table:
    """One table of a file: ``where`` names both for errors, ``folder`` is the file's."""

    values: Mapping[str, Any]
    where: str
    folder: Path

    def inner(self, key: str) -> Table:
        """The table ``key`` inside this one; empty where there is none."""
        found = self.values.get(key, {})
        if not isinstance(found, dict):
            raise ConfigError("not a table", where=f"{self.where}.{key}", got=repr(found))
        return Table(found, f"{self.where}.{key}", self.folder)

    def check_keys(self, known: Iterator[str] | list[str]) -> None:
        """Raise ConfigError for the first key that is not ``known``, with the known key that is most like it."""
        names = sorted(known)
        for key in self.values:
            if key not in names:
                expected, meant = instead_of(key, names)
                raise ConfigError(f"unknown key {key!r}", where=self.where, expected=expected, do=meant)

    def fault(self, key: str, what: str, *, expected: str = "", got: str = "", do: str = "") -> ConfigError:
        return ConfigError(what, where=f"{self.where}.{key}", expected=expected, got=got, do=do)


def find_config(start: Path | None = None) -> Path | None:
    """The file that counts for ``start`` (the working directory), or None."""
    named = os.environ.get(VARIABLE)
    if named:
        return Path(named)
    here = (start or Path.cwd()).resolve()
    for folder in (here, *here.parents):
        own, shared = folder / FILE, folder / SHARED
        if own.is_file():
            return _ours(own)
        if shared.is_file() and b"notabug" in _read(shared):
            tool = _parse(shared).get("tool")
            if isinstance(tool, dict) and "notabug" in tool:
                return _ours(shared)
    return None


def _ours(path: Path) -> Path:
    """``path``; raises ConfigError where somebody else may have written it: it names programs that this user runs."""
    try:
        why = why_foreign(path)
        if why:
            raise ConfigError(
                "a configuration that may be somebody else's is not read",
                where=str(path),
                got=why,
                do=f"{how_to_allow(path)}; or set {VARIABLE} to the file that is meant",
            )
    except OSError as error:
        raise ConfigError("cannot be read", where=str(path), got=error.strerror or str(error)) from error
    return path


def read_config(path: Path) -> Table:
    """The table of notabug's own settings in ``path``: all of ``notabug.toml``, ``tool.notabug`` of another file."""
    document = _parse(path)
    if path.name == SHARED:
        return Table(document, str(path), path.resolve().parent).inner("tool").inner("notabug")
    return Table(document, str(path), path.resolve().parent)


def renderer_tables(path: Path | None) -> dict[str, Table]:
    """The tables ``renderers.NAME`` of ``path`` by name; nothing where there is no file."""
    if path is None:
        return {}
    table = read_config(path)
    table.check_keys(["renderers"])
    renderers = table.inner("renderers")
    for name in renderers.values:
        if not name.isprintable() or not name.strip() or len(name) > LONGEST or set(name) & set("/\\,"):
            got = f"{len(name)} of them, {name[:20]!a}..." if len(name) > LONGEST else ascii(name)
            expected = f"1 to {LONGEST} printable characters without / \\ and comma"
            raise table.fault("renderers", "not a name for a renderer", expected=expected, got=got)
    return {name: renderers.inner(name) for name in renderers.values}


def _read(path: Path) -> bytes:
    try:
        if path.stat().st_size > _MOST:
            raise ConfigError("the file is too large", where=str(path), expected=f"at most {_MOST} bytes")
        return path.read_bytes()
    except OSError as error:
        raise ConfigError("cannot be read", where=str(path), got=error.strerror or str(error)) from error


def _parse(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(_read(path).decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ConfigError("not valid TOML", where=str(path), got=str(error)) from error
