"""What a configuration table declares of a renderer's pictures, and how pictures of each encoding are read."""

from __future__ import annotations

import contextlib
import inspect
import math
import re
from collections.abc import Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from notabug.adapters import settings
from notabug.adapters.base import Apart, Declaration
from notabug.adapters.config import ConfigError, Table
from notabug.references.models.area_shadows import LARGEST_GRID
from notabug.scenes_usd.nearest import instead_of
from notabug.scenes_usd.picture_numbers import NUMBERS

PIXELS = NUMBERS
"""Number formats: the step at 1, and whether it scales with the value or with the largest channel of the pixel."""

SRGB_SLOPE = 2.4 / 1.055  # of the decoding at 1: by so much does a step of the file grow
RADIUS = {"point": 0.0, "box": 0.5, "tent": 1.0, "gaussian": 2.0, "unknown": 2.0}  # pixels, where none is declared
_DERIVED = ("quantum", "relative_quantum", "shared_exponent", "white")
_HINTS: dict[str, Any] = {name: hint for name, hint in get_type_hints(Declaration).items() if name not in _DERIVED}
OF_NUMBERS = ("quantum", "white")  # of the output, where it is coarser than its file's format
KEYS = (*_HINTS, *OF_NUMBERS, "pixels", "encoding", "capabilities", "not_together")
CAPABILITIES = frozenset(
    {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
    | {"cosine_weighted", "coloured_highlight", "mirror", "transmission", "shadows", "orthographic", "aperture_offset"}
    | {"ggx", "dielectric", "emission", "normal_map", "opacity_map", "cutout"}
    | {"sphere_light", "rect_light", "disk_light", "cylinder_light", "sun_light", "dome_light"}
    | {"dome_texture", "light_beam", "light_multipliers", "light_link"}
)
_UNSAID = CAPABILITIES - {
    "orthographic",
    "aperture_offset",
    "ggx",
    "dielectric",
    "emission",
    "normal_map",
    "opacity_map",
    "cutout",
    "sphere_light",
    "rect_light",
    "disk_light",
    "cylinder_light",
    "sun_light",
    "dome_light",
    "dome_texture",
    "light_beam",
    "light_multipliers",
    "light_link",
}  # cameras, surfaces and lights that no driver knows which was written before them


# What a table's renderer does where the table does not say: as the contract has it, or as far as that differs from
# renderer to renderer, unknown. Of a picture of unknown making everything is.
_OF_A_TABLE: dict[str, Any] = {
    "precision": "float32",
    "filter": "unknown",
    "noisy": None,
    "bounces": -1,
    "light_grid": -1,
}
_OF_A_PICTURE = {
    name: "unknown"
    for name, hint in _HINTS.items()
    if get_origin(hint) is Literal and "unknown" in get_args(hint) and name != "filter"
} | {"bounces": -1, "light_grid": -1}
SMALLEST_WHITE = 1e-6  # radiance: below it no picture of the corpus shows anything
_MOST = {
    "bounces": 8,
    "light_grid": LARGEST_GRID,
    "subpixel_bits": 16,
    "texture_bits": 16,
    "samples": 1 << 20,
    "radius": 16.0,
    "hit_error": 1.0,
    "epsilon": 1e9,
    "shadow_resolution": 1 << 16,
    "shadow_width": 1e12,
    "shadow_bias": 1e9,
    "shadow_normal_bias": 1e9,
}
_UNKNOWN = frozenset(
    {"bounces", "light_grid", "hit_error", "epsilon", *(name for name in _MOST if name.startswith("shadow_"))}
)
"""Numbers of which -1 says that they are unknown."""


def declaration(table: Table, *, ngon_split: str) -> Declaration:
    """The table's Declaration; what it does not say is unknown, and precision float32."""
    fallback: dict[str, Any] = {each.name: each.default for each in fields(Declaration)}
    fallback |= {**_OF_A_TABLE, "ngon_split": ngon_split}
    fallback["shadows"] = "cast" if "shadows" in (capabilities(table) or CAPABILITIES) else "none"
    fallback["radius"] = RADIUS[settings.choice(table, "filter", "unknown", tuple(RADIUS))]
    said = {name: _value(table, name, fallback[name]) for name in _HINTS}
    numbers = PIXELS[pixels(table)]
    step = settings.number(table, "quantum", numbers.quantum, *bounds("quantum"))
    return Declaration(
        **said,
        quantum=step * (SRGB_SLOPE if is_srgb(table) else 1.0),
        relative_quantum=numbers.relative,
        shared_exponent=numbers.shared,
        white=settings.number(table, "white", math.inf if numbers.relative else 1.0, *bounds("white")),
    )


def _value(table: Table, name: str, fallback: Any) -> Any:
    """What ``table`` says of the Declaration's field ``name``, in the field's type."""
    hint = _HINTS[name]
    if get_origin(hint) is Literal:
        return settings.choice(table, name, fallback, get_args(hint))
    if hint in (bool, bool | None):
        return settings.flag(table, name, False) if name in table.values else fallback
    least, most = bounds(name)
    if hint is int:
        return settings.whole(table, name, fallback, int(least), int(most))
    return settings.number(table, name, fallback, least, most)


def hint(name: str) -> object:
    """The type of the value of ``name``, a key of a declaration."""
    return float if name in OF_NUMBERS else _HINTS.get(name)


def bounds(name: str) -> tuple[float, float]:
    """The least and the largest value of ``name``, a key whose value is a number."""
    if name in OF_NUMBERS:
        return (0.0, 1.0) if name == "quantum" else (SMALLEST_WHITE, math.inf)
    return (-1.0 if name in _UNKNOWN else 0.0, _MOST[name])


def unknown() -> dict[str, Any]:
    """What is declared of a picture of unknown making: that nothing is known."""
    return dict(_OF_A_PICTURE)


def said(words: Sequence[str]) -> dict[str, Any]:
    """``KEY=VALUE`` words as fields of a Declaration.

    >>> said(["interpolation=gouraud", "bounces=1", "noisy=true"])
    {'interpolation': 'gouraud', 'bounces': 1, 'noisy': True}
    """
    values: dict[str, Any] = {}
    for word in words:
        key, equals, value = word.partition("=")
        if not equals:
            raise ConfigError("not KEY=VALUE", where="--declare", expected="such as interpolation=gouraud", got=word)
        values[key.strip()] = _typed(hint(key.strip()), value.strip())
    table = Table(values, "--declare", Path())
    table.check_keys([*_HINTS, *OF_NUMBERS])
    found = {name: _value(table, name, None) for name in values if name in _HINTS}
    found |= {name: settings.number(table, name, 0.0, *bounds(name)) for name in values if name in OF_NUMBERS}
    if "filter" in found:
        found.setdefault("radius", RADIUS[found["filter"]])
    return found


def _typed(hint: object, text: str) -> bool | float | str:
    """``text`` as the value that it would be in a table; left as it is where it is none of the kind."""
    if hint in (bool, bool | None):
        return {"true": True, "false": False}.get(text.lower(), text)
    if text == "unknown" and hint in (int, float):
        return -1
    with contextlib.suppress(ValueError):
        return int(text) if hint is int else float(text) if hint is float else text
    return text


_DEFAULTS = {each.name: each.default for each in fields(Declaration) if each.default is not MISSING}


def declarations() -> list[dict[str, str]]:
    """Every key of a Declaration with its values, what is taken where it is not given, and what it means."""
    meaning = _meanings()
    rows = []
    for name, hint in _HINTS.items():
        least = "-1 (unknown)" if name in _UNKNOWN else "0"
        values = (
            " ".join(arg or '""' for arg in get_args(hint))
            if get_origin(hint) is Literal
            else "true false"
            if hint in (bool, bool | None)
            else f"{least} to {_MOST[name]:g}"
        )
        default = _OF_A_PICTURE.get(name, _OF_AN_OPTION.get(name, _DEFAULTS.get(name, "")))
        shown = "unknown" if default == -1 else f"{default}"
        rows.append({"key": name, "values": values, "default": shown, "meaning": meaning[name]})
    for name, values in (("quantum", "0 to 1"), ("white", f"{SMALLEST_WHITE:g} or more")):
        rows.append({"key": name, "values": values, "default": "the file's", "meaning": meaning[name]})
    return rows


_OF_AN_OPTION = {
    "precision": "float32",
    "filter": "unknown",
    "radius": "the filter's",
    "noisy": "true if several pictures are given",
    "samples": "0",
    "hit_error": "8 roundings",
    "epsilon": "unknown",
}


def _meanings() -> dict[str, str]:
    """What each field of a Declaration means, as its docstring says."""
    found: dict[str, str] = {}
    for entry in re.split(r"\n(?=\w[\w, ]* : )", inspect.getdoc(Declaration) or ""):
        names, _, text = entry.partition(" : ")
        found |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    return found


def pixels(table: Table) -> str:
    """The number format of the pictures: a Radiance file holds only one."""
    usual = "rgbe" if table.values.get("image") == "hdr" else "float"
    return settings.choice(table, "pixels", usual, tuple(PIXELS))


def is_srgb(table: Table) -> bool:
    """Whether the pictures are sRGB-encoded."""
    return settings.choice(table, "encoding", "linear", ("linear", "srgb")) == "srgb"


def capabilities(table: Table) -> frozenset[str]:
    """What the renderer can draw; where the table does not say everything but cameras that are no plain pinhole."""
    found = frozenset(settings.words(table, "capabilities", sorted(_UNSAID)))
    unknown = sorted(found - CAPABILITIES)
    if unknown:
        raise table.fault(
            "capabilities", f"unknown capability {unknown[0]!r}", expected=f"some of {', '.join(sorted(CAPABILITIES))}"
        )
    return found


def not_together(table: Table) -> tuple[Apart, ...]:
    """Which of its capabilities the renderer does not have together in one scene."""
    expected = 'lists of two or more capabilities, such as [["phong", "point_light"]]'
    found = table.values.get("not_together", [])
    if not isinstance(found, list) or not all(isinstance(words, list) for words in found):
        raise table.fault("not_together", "not a list of lists", expected=expected, got=repr(found))
    for words in found:
        if not all(isinstance(word, str) for word in words) or len(set(words)) < 2:
            raise table.fault("not_together", "not two capabilities or more", expected=expected, got=repr(words))
        unknown = sorted(set(words) - CAPABILITIES)
        if unknown:
            expected, meant = instead_of(unknown[0], sorted(CAPABILITIES))
            raise table.fault("not_together", f"unknown capability {unknown[0]!r}", expected=expected, do=meant)
    return tuple(dict.fromkeys(Apart(frozenset(words)) for words in found))


def spheres(table: Table) -> Literal["exact", "mesh"]:
    """Whether the renderer gets exact spheres, or meshes in their places."""
    return "mesh" if settings.choice(table, "spheres", "exact", get_args(_HINTS["spheres"])) == "mesh" else "exact"
