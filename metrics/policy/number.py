"""For docs/judge.md: what is said of a number that decides, beside its value."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeVar

Decides = Literal["word", "name", "time", "visible", "nothing"]
"""What changes with a number: the word of a verdict, what a bug or a limitation is called, how long the search takes,
what is said to be visible, or only what is printed."""
KINDS = ("derived", "measured", "convention")
"""The first word of a source: it follows from a formula, it was read off pictures, or somebody chose it."""
Value = TypeVar("Value", bound=float | tuple[object, ...])


@dataclass(frozen=True, slots=True)
class Said:
    """What is said of a number; ``meaning`` goes on where ``unit`` ends."""

    unit: str
    meaning: str
    source: str
    decides: Decides


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """A number that decides and stands in references/, ``name`` with its module; it belongs to a ``step``."""

    name: str
    step: str
    unit: str
    meaning: str
    source: str
    decides: Decides


def number(value: Value, unit: str, meaning: str, source: str, decides: Decides) -> Value:
    """A field of a group of numbers, ``value`` unless another one is given.

    Raises ValueError where the ``source`` does not say of which of KINDS it is.
    """
    if not source.startswith(KINDS):
        raise ValueError(f"a source begins with one of {', '.join(KINDS)}, not {source!r}")
    return field(default=value, metadata={"said": Said(unit, meaning, source, decides)})
