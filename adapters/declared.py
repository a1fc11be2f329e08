"""What a configuration table declares of a renderer's pictures, and how pictures of each encoding are read."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

from notabug.adapters import settings
from notabug.adapters.base import Declaration, Pixels
from notabug.adapters.config import Table
from notabug.scenes_usd.picture import read_picture

PIXELS: dict[str, tuple[float, bool]] = {
    "float": (2.0**-24, True),
    "half": (2.0**-11, True),
    "uint16": (1 / 65535, False),
    "uint8": (1 / 255, False),
}
"""Number formats: the step at 1, and whether it scales with the value."""

SRGB_SLOPE = 2.4 / 1.055  # of the decoding at 1: by so much does a step of the file grow
RADIUS = {"point": 0.0, "box": 0.5, "tent": 1.0, "gaussian": 2.0, "unknown": 2.0}  # pixels, where none is declared
_DERIVED = ("quantum", "relative_quantum", "white")
_HINTS: dict[str, Any] = {name: hint for name, hint in get_type_hints(Declaration).items() if name not in _DERIVED}
KEYS = (*_HINTS, "pixels", "encoding", "capabilities")
CAPABILITIES = frozenset(
    {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
    | {"cosine_weighted", "coloured_highlight", "mirror", "transmission", "shadows"}
)


def declaration(table: Table, *, ngon_split: str) -> Declaration:
    """The table's Declaration; what it does not say is unknown, and precision float32."""
    fallback: dict[str, Any] = {each.name: each.default for each in fields(Declaration)}
    fallback |= {"precision": "float32", "filter": "unknown", "noisy": None, "ngon_split": ngon_split}
    said: dict[str, Any] = {}
    for name, hint in _HINTS.items():
        if get_origin(hint) is Literal:
            said[name] = settings.choice(table, name, fallback[name], get_args(hint))
        elif hint in (bool, bool | None):
            said[name] = settings.flag(table, name, False) if name in table.values else fallback[name]
    said["samples"] = settings.whole(table, "samples", 0, 0, 1 << 20)
    said["radius"] = settings.number(table, "radius", RADIUS[said["filter"]], 0.0, 16.0)
    said["hit_error"] = settings.number(table, "hit_error", fallback["hit_error"], -1.0, 1.0)
    quantum, relative = PIXELS[pixels(table)]
    step = quantum * (SRGB_SLOPE if is_srgb(table) else 1.0)
    return Declaration(**said, quantum=step, relative_quantum=relative, white=math.inf if relative else 1.0)


def pixels(table: Table) -> str:
    """The number format of the pictures."""
    return settings.choice(table, "pixels", "float", tuple(PIXELS))


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


def read_srgb(path: Path) -> Pixels:
    """The linear values of an sRGB-encoded picture."""
    return decode_srgb(read_picture(path).pixels)


def decode_srgb(encoded: npt.NDArray[np.floating]) -> Pixels:
    """IEC 61966-2-1 to linear; below 0 mirrored, above 1 by the same curve.

    >>> float(decode_srgb(np.array([0.5])).round(4)[0])
    0.214
    """
    size = np.abs(encoded)
    linear = np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.copysign(linear, encoded), np.float32)
