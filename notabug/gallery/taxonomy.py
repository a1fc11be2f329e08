"""The taxonomy: what the gallery says of each artifact class."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any


@dataclass(frozen=True, slots=True)
class Kind:
    """One artifact class: ``innocent`` says why it is no bug, ``guilty`` when it is one.

    ``emblem`` names the scene, perhaps its variants, and the model whose picture stands for the class.
    """

    id: str
    name: str
    symptom: str
    cause: str
    what: str
    innocent: str
    guilty: str
    formulas: tuple[str, ...]
    emblem: Mapping[str, Any]


@cache
def taxonomy() -> tuple[Kind, ...]:
    """The classes in the order of the paper's table, calibration last."""
    text = files("notabug.gallery").joinpath("taxonomy.toml").read_text(encoding="utf-8")
    return tuple(
        Kind(id=name, **{**entry, "formulas": tuple(entry["formulas"])}) for name, entry in tomllib.loads(text).items()
    )
