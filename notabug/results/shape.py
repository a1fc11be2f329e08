"""Shapes of JSON documents of unknown making: the whole document is checked at the door, before anybody uses a part.

What passes has the types that are asked for, finite numbers of a size that arithmetic stands, and names that a file
could have. Texts may hold anything, since messages quote logs. One error, RecordError, names the place.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from notabug.scenes_usd.errors import NotabugError

MOST_BYTES = 1 << 29  # of a document
LONGEST = 1 << 20  # characters of a text: a log that a message quotes
LARGEST = 1e100  # of numbers


class RecordError(NotabugError):
    """A record that no run has written."""


@dataclass(frozen=True, slots=True)
class Value:
    """A plain value; ``words`` are the only texts that are right, where there are any."""

    kind: Literal["text", "number", "whole", "flag"]
    none: bool = False
    words: frozenset[str] = frozenset()
    longest: int = LONGEST
    is_name: bool = False  # a text without NUL
    is_file: bool = False  # a name that the system can be asked for


@dataclass(frozen=True, slots=True)
class Many:
    """A list, or with ``named`` an object, all of whose values have one shape."""

    of: Shape
    named: bool = False
    length: int = -1  # of a list, where it is fixed


@dataclass(frozen=True, slots=True)
class Fields:
    """An object whose keys are known. Others may be there: a later version may have more to say."""

    required: Mapping[str, Shape]
    optional: Mapping[str, Shape] = field(default_factory=dict)


Shape = Value | Many | Fields
TEXT, NUMBER, WHOLE, FLAG = Value("text"), Value("number"), Value("whole"), Value("flag")
NAME = Value("text", longest=4096, is_name=True)  # as long as the system's longest path
FILE = Value("text", longest=4096, is_name=True, is_file=True)


def read_document(path: Path, shape: Shape) -> dict[str, object]:
    """The JSON object of that shape in the file at ``path``. Raises RecordError, and OSError if it is unreadable."""
    where = str(path)
    if path.stat().st_size > MOST_BYTES:
        raise RecordError("the record is too large", where=where, expected=f"at most {MOST_BYTES >> 20} MiB")
    try:
        document = json.loads(path.read_bytes().decode("utf-8"))
    except RecursionError:
        raise RecordError("not a run's record", where=where, got="lists or objects without end") from None
    except ValueError as error:
        raise RecordError("not a run's record", where=where, got=str(error)) from None
    check(document, shape, where)
    found: dict[str, Any] = document
    return found


def check(value: object, shape: Shape, where: str) -> None:
    """Raise RecordError, which names the place below ``where``, where ``value`` has not the ``shape``."""
    if isinstance(shape, Value):
        _check_plain(value, shape, where)
    elif isinstance(shape, Fields):
        if not isinstance(value, dict):
            raise _wrong(where, "an object", value)
        for key in shape.required:
            if key not in value:
                raise RecordError("not a run's record", where=where, expected=f"the key {key!r}")
        for key, inner in {**shape.required, **shape.optional}.items():
            if key in value:
                check(value[key], inner, f"{where}: {key}")
    elif shape.named:
        if not isinstance(value, dict):
            raise _wrong(where, "an object", value)
        for key, inside in value.items():
            _check_plain(key, NAME, where)
            check(inside, shape.of, f"{where}: {key[:40]}")
    else:
        if not isinstance(value, list) or shape.length not in (-1, len(value)):
            raise _wrong(where, "a list" if shape.length < 0 else f"a list of {shape.length}", value)
        for index, inside in enumerate(value):
            check(inside, shape.of, f"{where}[{index}]")


def _check_plain(value: object, shape: Value, where: str) -> None:
    if value is None and shape.none:
        return
    if shape.kind == "text":
        if not isinstance(value, str) or len(value) > shape.longest or (shape.is_name and "\0" in value):
            raise _wrong(where, "a text", value)
        if shape.is_file and not _can_be_asked_for(value):
            raise _wrong(where, "the name of a file", value)
        if shape.words and value not in shape.words:
            raise _wrong(where, f"one of {', '.join(sorted(shape.words))}", value)
    elif shape.kind == "flag":
        if not isinstance(value, bool):
            raise _wrong(where, "true or false", value)
    else:
        kinds = (int,) if shape.kind == "whole" else (int, float)
        if isinstance(value, bool) or not isinstance(value, kinds) or not abs(value) <= LARGEST:
            raise _wrong(where, "a whole number" if shape.kind == "whole" else "a number", value)
        if isinstance(value, float) and not math.isfinite(value):
            raise _wrong(where, "a finite number", value)


def _can_be_asked_for(name: str) -> bool:
    """Whether ``name`` has bytes: half a surrogate pair has none, but for those that stand for bytes themselves."""
    try:
        name.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        return False
    return True


def _wrong(where: str, expected: str, value: object) -> RecordError:
    try:
        got = repr(value)[:60]
    except (RecursionError, ValueError):  # ValueError: a number of more digits than Python writes
        got = type(value).__name__
    return RecordError("not a run's record", where=where, expected=expected, got=ascii(got)[1:-1])
