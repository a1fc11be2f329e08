"""From a table ``renderers.NAME`` to an adapter: a command, a folder of files, or one of the known adapters, set."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_type_hints

from notabug.adapters import declared, settings
from notabug.adapters.base import Adapter
from notabug.adapters.command import Command
from notabug.adapters.config import ConfigError, Table
from notabug.adapters.export.formats import FORMATS
from notabug.adapters.files import SUFFIXES, Files
from notabug.adapters.joined import Joined
from notabug.adapters.process import DEFAULT, Limits
from notabug.adapters.server import START_SECONDS

COMMAND_KEYS = ("command", "version", "files", "scene", "image", "layer", "samples", "environment", "install", "server")
LIMIT_KEYS = ("timeout", "start_timeout", "cpu", "memory", "output", "retries")
JOINED_KEYS = ("not_together", "spheres")  # which the table of a known adapter may have as well
FILES_KEYS = ("files", "layer", "version", "install")
_CUT = frozenset({"json", "gltf", "pbrt", "povray", "mitsuba"})  # formats in which we cut n-gons, along 0-2
OF_A_SERVER = ("threads", "folder")
"""Placeholders of the command of a server: it reads the others, which change with the picture, from its input."""
_DAY = 86400.0


def configured(name: str, table: Table, known: Mapping[str, Adapter]) -> Adapter:
    """The adapter that ``table`` describes; ``known`` are those that it may set (``adapter = "zbuffer"``)."""
    if "adapter" not in table.values and name in known and _is_of_ones_own(table):
        raise ConfigError(
            f"notabug itself has a renderer called {name!r}",
            where=table.where,
            expected="another name for yours, or keys that set ours",
            do=f"call the table, say, [renderers.my_{name}]",
        )
    if "adapter" in table.values or name in known:
        return _known(name, table, known)
    if "command" in table.values:
        return _command(name, table)
    if "files" in table.values:
        return _files(name, table)
    table.check_keys([*COMMAND_KEYS, *LIMIT_KEYS, *declared.KEYS, "files", "adapter"])
    raise table.fault("command", "missing", expected="command, files or adapter")


def _is_of_ones_own(table: Table) -> bool:
    """Whether ``table`` describes a renderer: a list of words to call, a format of scenes, or a folder of pictures."""
    return isinstance(table.values.get("command"), list) or not {"scene", "image", "files"}.isdisjoint(table.values)


def _command(name: str, table: Table) -> Command:
    table.check_keys([*COMMAND_KEYS, *LIMIT_KEYS, *declared.KEYS])
    command = settings.words(table, "command")
    if not command:
        raise table.fault("command", "empty", expected='a list such as ["./render", "{scene}", "{image}"]')
    given = table.inner("environment")
    environment = {key: settings.text(given, key, "") for key in given.values}
    for key in environment:
        if not key or "=" in key or "\0" in key:
            raise given.fault(key, "not a name of a variable")
    serves = settings.flag(table, "server", False)
    holes = OF_A_SERVER if serves else settings.PLACEHOLDERS
    for word in command:
        settings.check_holes(table, "command", word, holes)
    for key, word in environment.items():
        settings.check_holes(given, key, word, holes)
    for hole in () if serves else ("scene", "image"):
        if not settings.names_hole([*command, *environment.values()], hole):
            raise table.fault("command", f"does not name {{{hole}}}", do="the renderer must be told its files")
    if "start_timeout" in table.values and not serves:
        raise table.fault("start_timeout", "is for servers", do="set server = true, or leave it out")
    depends = settings.words(table, "files")
    for each in depends:
        if not each or Path(each).is_absolute():
            raise table.fault("files", "not a glob below the file's folder", expected='such as "lib/*.py"', got=each)
    scene = settings.choice(table, "scene", "json", tuple(FORMATS))
    version = table.values.get("version", "")
    return Command(
        name=name,
        command=command,
        folder=table.folder,
        declared=declared.declaration(table, ngon_split="02" if scene in _CUT else "unknown"),
        capabilities=declared.capabilities(table),
        not_together=declared.not_together(table),
        scene=scene,
        image=settings.choice(table, "image", "exr", sorted(each[1:] for each in SUFFIXES)),
        pixels=declared.pixels(table),
        srgb=declared.is_srgb(table),
        layer=settings.text(table, "layer", ""),
        samples=settings.whole(table, "samples", 1, 1, 1 << 20),
        version=settings.words(table, "version") if isinstance(version, list) else settings.text(table, "version", ""),
        files=depends,
        environment=environment,
        timeout=settings.number(table, "timeout", 600.0, 0.001, _DAY),
        limits=Limits(
            cpu=settings.number(table, "cpu", 0.0, 0.0, _DAY * 256),
            memory=settings.size(table, "memory", 0),
            output=settings.size(table, "output", DEFAULT.output),
        ),
        server=serves,
        start_timeout=settings.number(table, "start_timeout", START_SECONDS, 0.001, _DAY),
        retries=settings.whole(table, "retries", 0, 0, 10),
        install=settings.text(table, "install", f"see {table.where}"),
        key=_key(table),
    )


def _files(name: str, table: Table) -> Files:
    table.check_keys([*FILES_KEYS, *declared.KEYS])
    return Files(
        name=name,
        folder=table.folder / settings.text(table, "files", ""),
        declared=declared.declaration(table, ngon_split="unknown"),
        capabilities=declared.capabilities(table),
        not_together=declared.not_together(table),
        pixels=declared.pixels(table),
        srgb=declared.is_srgb(table),
        layer=settings.text(table, "layer", ""),
        version=settings.text(table, "version", ""),
        install=settings.text(table, "install", "put the pictures there"),
        key=_key(table),
    )


def _known(name: str, table: Table, known: Mapping[str, Adapter]) -> Adapter:
    """A known adapter under the table's name with the table's values for its fields."""
    base = settings.choice(table, "adapter", name, sorted(known))
    adapter: Any = known[base]
    fields = {each.name for each in dataclasses.fields(adapter)} if dataclasses.is_dataclass(adapter) else set()
    fields -= {"name", "capabilities", "install", *JOINED_KEYS}
    table.check_keys(["adapter", *fields, *JOINED_KEYS])
    hints = get_type_hints(type(adapter))
    changes: dict[str, Any] = {}
    for key in table.values.keys() - {"adapter", *JOINED_KEYS}:
        changes[key] = _value(table, key, hints[key])
    made: Adapter = dataclasses.replace(adapter, name=name, **changes)
    if table.values.keys().isdisjoint(JOINED_KEYS):
        return made
    return Joined(made, declared.spheres(table), declared.not_together(table))


def _value(table: Table, key: str, hint: object) -> object:
    if hint is bool:
        return settings.flag(table, key, False)
    if hint is int:
        return settings.whole(table, key, 0, 0, 1 << 24)
    if hint is float:
        return settings.number(table, key, 0.0, -1e9, 1e9)
    if hint is str:
        return settings.text(table, key, "")
    if options := getattr(hint, "__args__", ()):
        if all(isinstance(each, str) for each in options):
            return settings.choice(table, key, "", options)
        if options[0] is str:
            return settings.words(table, key)
    raise table.fault(key, "cannot be set from a file")


def _key(table: Table) -> str:
    text = json.dumps(table.values, sort_keys=True, default=str)
    return hashlib.blake2b(text.encode("utf-8", "surrogatepass"), digest_size=8).hexdigest()
