"""What a configuration table declares of a renderer's pictures, and how pictures of each encoding are read."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any, Literal, get_args, get_origin, get_type_hints

from notabug.adapters import settings
from notabug.adapters.base import Declaration
from notabug.adapters.config import Table
from notabug.scenes_usd.picture import decode_srgb as decode_srgb
from notabug.scenes_usd.picture_numbers import NUMBERS

PIXELS = NUMBERS
"""Number formats: the step at 1, and whether it scales with the value or with the largest channel of the pixel."""

SRGB_SLOPE = 2.4 / 1.055  # of the decoding at 1: by so much does a step of the file grow
RADIUS = {"point": 0.0, "box": 0.5, "tent": 1.0, "gaussian": 2.0, "unknown": 2.0}  # pixels, where none is declared
_DERIVED = ("quantum", "relative_quantum", "shared_exponent", "white")
_HINTS: dict[str, Any] = {name: hint for name, hint in get_type_hints(Declaration).items() if name not in _DERIVED}
KEYS = (*_HINTS, "pixels", "encoding", "capabilities")
CAPABILITIES = frozenset(
    {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
    | {"cosine_weighted", "coloured_highlight", "mirror", "transmission", "shadows"}
)


def declaration(table: Table, *, ngon_split: str) -> Declaration:
    """The table's Declaration; what it does not say is unknown, precision float32, and without noise."""
    fallback: dict[str, Any] = {each.name: each.default for each in fields(Declaration)}
    fallback |= {"precision": "float32", "filter": "unknown", "noisy": False, "ngon_split": ngon_split}
    said: dict[str, Any] = {}
    for name, hint in _HINTS.items():
        if get_origin(hint) is Literal:
            said[name] = settings.choice(table, name, fallback[name], get_args(hint))
        elif hint is bool:
            said[name] = settings.flag(table, name, fallback[name])
    said["samples"] = settings.whole(table, "samples", 0, 0, 1 << 20)
    said["radius"] = settings.number(table, "radius", RADIUS[said["filter"]], 0.0, 16.0)
    said["hit_error"] = settings.number(table, "hit_error", fallback["hit_error"], -1.0, 1.0)
    numbers = PIXELS[pixels(table)]
    return Declaration(
        **said,
        quantum=numbers.quantum * (SRGB_SLOPE if is_srgb(table) else 1.0),
        relative_quantum=numbers.relative,
        shared_exponent=numbers.shared,
        white=math.inf if numbers.relative else 1.0,
    )


def pixels(table: Table) -> str:
    """The number format of the pictures: a Radiance file holds only one."""
    usual = "rgbe" if table.values.get("image") == "hdr" else "float"
    return settings.choice(table, "pixels", usual, tuple(PIXELS))


def is_srgb(table: Table) -> bool:
    """Whether the pictures are sRGB-encoded."""
    return settings.choice(table, "encoding", "linear", ("linear", "srgb")) == "srgb"


def capabilities(table: Table) -> frozenset[str]:
    """What the renderer can draw; everything where the table does not say."""
    found = frozenset(settings.words(table, "capabilities", sorted(CAPABILITIES)))
    unknown = sorted(found - CAPABILITIES)
    if unknown:
        raise table.fault(
            "capabilities", f"unknown capability {unknown[0]!r}", expected=f"some of {', '.join(sorted(CAPABILITIES))}"
        )
    return found
