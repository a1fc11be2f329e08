"""The ``list`` command: scenes, variants, renderers, models, workarounds, declarations."""

from __future__ import annotations

import json
from typing import Any

from rich.table import Table
from rich.text import Text

from notabug.adapters.base import RendererMissingError
from notabug.adapters.declared import declarations
from notabug.adapters.registry import adapters
from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.progress import console
from notabug.references.models.model import models
from notabug.references.workarounds.workaround import workarounds
from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.reader import read_scene


def list_scenes() -> list[dict[str, Any]]:
    """Every scene of the corpus with its claim, in the order of the paper's table."""
    return [
        {
            "id": each.id,
            "variants": [f"{name} ({len(values)})" for name, values in each.variants.items()],
            "claim": each.claim,
        }
        for each in scenes()
    ]


def list_variants() -> list[dict[str, Any]]:
    """Every variant set: its scene, its variants, its default."""
    return [
        {"scene": each.id, "set": name, "variants": list(values), "default": each.defaults.get(name, "")}
        for each in scenes()
        for name, values in each.variants.items()
    ]


def list_renderers() -> list[dict[str, Any]]:
    """Every adapter: the renderer's version or how to install it, and what it can draw."""
    rows = []
    for name, adapter in adapters().items():
        try:
            version = adapter.find().version
        except RendererMissingError:
            version = f"not installed: {adapter.install}"
        rows.append({"renderer": name, "version": version, "capabilities": sorted(adapter.capabilities)})
    return rows


def list_models() -> list[dict[str, Any]]:
    """Every limitation, convention and fault that can act on a scene of the corpus, and on which."""
    rows: dict[str, dict[str, Any]] = {}
    for each in scenes():
        for model in models(read_scene(each.id)):
            row = rows.setdefault(
                model.name,
                {"model": model.name, "kind": model.kind, "rule": model.rule, "claim": model.claim, "scenes": []},
            )
            row["scenes"].append(each.id)
    order = ("limitation", "convention", "fault")
    return sorted(rows.values(), key=lambda row: (order.index(row["kind"]), row["model"]))


def list_workarounds() -> list[dict[str, Any]]:
    """Every workaround with the class it serves, in the order of the paper's table."""
    rows = (
        {
            "workaround": each.name,
            "class": each.artifact_class,
            "scenes": list(dict.fromkeys(setting.scene for setting in each.settings)),
            "claim": each.claim,
            "caveat": each.caveat,
        }
        for each in workarounds()
    )
    return sorted(rows, key=lambda row: CLASSES.index(row["class"]))


LISTS = {
    "scenes": list_scenes,
    "variants": list_variants,
    "renderers": list_renderers,
    "models": list_models,
    "workarounds": list_workarounds,
    "declarations": declarations,
}


_WIDE = ("claim", "caveat", "version", "values", "meaning")


def command(topic: str, as_json: bool) -> ExitCode:
    """Print one of the lists; the code is NOTHING where it is empty."""
    rows = LISTS[topic]()
    if as_json:
        print(escaped(json.dumps({topic: rows}, ensure_ascii=False)))
    elif rows:
        table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
        for name, value in rows[0].items():
            table.add_column(name, no_wrap=isinstance(value, str) and name not in _WIDE)
        for row in rows:
            cells = (", ".join(value) if isinstance(value, list) else str(value) for value in row.values())
            table.add_row(*map(Text, cells))
        console().print(table)
    return ExitCode.OK if rows else ExitCode.NOTHING
