"""Text of .usda files: the same numbers give the same bytes on every machine, and people can read them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

import numpy as np

Vector = Sequence[float]


def number(x: float) -> str:
    """The shortest text of ``x`` as float32, after rounding to 8 decimals so that libm's last bit does not show."""
    single = np.float32(round(float(x), 8)) + np.float32(0.0)  # no negative zero
    return str(np.format_float_positional(single, unique=True, trim="-"))


def vector(v: Iterable[float]) -> str:
    """``(1, 0.5, 0)``."""
    return f"({', '.join(number(x) for x in v)})"


def vectors(rows: Iterable[Vector], per_line: int = 8) -> str:
    """``[(...), (...)]``, broken into lines of ``per_line`` entries where there are more."""
    return _lines([vector(row) for row in rows], per_line)


def integers(values: Iterable[int], per_line: int = 24) -> str:
    """``[0, 1, 2]``, broken into lines of ``per_line`` entries where there are more."""
    return _lines([str(int(value)) for value in values], per_line)


def indent(text: str, levels: int = 1) -> str:
    """``text`` moved right by four spaces a level."""
    return textwrap.indent(text, "    " * levels)


def block(head: str, *parts: str) -> str:
    """``head`` and braces around ``parts``, which are separated by blank lines."""
    body = "\n\n".join(part.strip("\n") for part in parts)
    return f"{head}\n{{\n{indent(body)}\n}}"


def card(words: dict[str, str], requires: Sequence[str] = ()) -> str:
    """The customData entry ``dictionary notabug``: strings in the given order, then ``requires``."""
    lines = [f'string {key} = "{text}"' for key, text in words.items()]
    if requires:
        lines.append(f"string[] requires = [{', '.join(quote(word) for word in requires)}]")
    return "customData = {\n    dictionary notabug = {\n" + indent("\n".join(lines), 2) + "\n    }\n}"


def quote(text: str) -> str:
    """``text`` in double quotes."""
    return f'"{text}"'


def _lines(entries: list[str], per_line: int) -> str:
    if len(entries) <= per_line:
        return f"[{', '.join(entries)}]"
    rows = [", ".join(entries[i : i + per_line]) for i in range(0, len(entries), per_line)]
    return "[\n" + indent(",\n".join(rows)) + "\n]"
