"""The ``list`` command: scenes, variants, renderers, models, workarounds, declarations, the judge's numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from notabug.adapters.base import RendererMissingError
from notabug.adapters.declared import declarations
from notabug.adapters.registry import adapters
from notabug.adapters.requirements import not_together
from notabug.exit_codes import ExitCode
from notabug.metrics.policy import entries, plain
from notabug.printable import escaped
from notabug.references.models.model import models
from notabug.references.workarounds.workaround import workarounds
from notabug.runs.progress import console
from notabug.scenes_usd.card import CLASSES
from notabug.scenes_usd.catalogue import scenes
from notabug.scenes_usd.reader import read_scene


def list_scenes() -> list[dict[str, object]]:
    """Every scene of the corpus with its claim, in the order of the paper's table."""
    return [
        {
            "id": scene.id,
            "variants": [f"{name} ({len(values)})" for name, values in scene.variants.items()],
            "claim": scene.claim,
        }
        for scene in scenes()
    ]


def list_variants() -> list[dict[str, object]]:
    """Every variant set: its scene, its variants, its default."""
    return [
        {"scene": scene.id, "set": name, "variants": list(values), "default": scene.defaults.get(name, "")}
        for scene in scenes()
        for name, values in scene.variants.items()
    ]


def list_renderers() -> list[dict[str, object]]:
    """Every adapter: the renderer's version or how to install it, and what it can draw, not all of it together."""
    rows: list[dict[str, object]] = []
    for name, adapter in adapters().items():
        try:
            version = adapter.find().version
        except RendererMissingError:
            version = f"not installed: {adapter.install}"
        apart = [str(each) for each in not_together(adapter)]
        capabilities = sorted(adapter.capabilities)
        rows.append({"renderer": name, "version": version, "capabilities": capabilities, "not_together": apart})
    return rows


def list_models() -> list[dict[str, object]]:
    """Every limitation, convention and fault that can act on a scene of the corpus, and on which."""
    rows: dict[str, dict[str, Any]] = {}
    for scene in scenes():
        for model in models(read_scene(scene.id)):
            row = rows.setdefault(
                model.name,
                {"model": model.name, "kind": model.kind, "rule": model.rule, "claim": model.claim, "scenes": []},
            )
            if scene.id not in row["scenes"]:  # several models of one name differ in a parameter
                row["scenes"].append(scene.id)
    order = ("limitation", "convention", "fault")
    return sorted(rows.values(), key=lambda row: (order.index(row["kind"]), row["model"]))


def list_workarounds() -> list[dict[str, object]]:
    """Every workaround with the class it serves, in the order of the paper's table."""
    return [
        {
            "workaround": each.name,
            "class": each.artifact_class,
            "scenes": list(dict.fromkeys(setting.scene for setting in each.settings)),
            "claim": each.claim,
            "caveat": each.caveat,
        }
        for each in sorted(workarounds(), key=lambda workaround: CLASSES.index(workaround.artifact_class))
    ]


def list_policy() -> list[dict[str, object]]:
    """Every number that decides a verdict, by the step of docs/judge.md that uses it."""
    return [
        {
            "step": (re.findall(r"Step (\d+)", entry.step) or [entry.step.split()[0].lower()])[0],
            "number": entry.name,
            "value": plain(entry.value),
            "unit": entry.said.unit,
            "meaning": entry.said.meaning,
            "source": entry.said.source,
            "decides": entry.said.decides,
        }
        for entry in entries()
    ]


LISTS: Mapping[str, Callable[[], Sequence[Mapping[str, object]]]] = {
    "scenes": list_scenes,
    "variants": list_variants,
    "renderers": list_renderers,
    "models": list_models,
    "workarounds": list_workarounds,
    "declarations": declarations,
    "policy": list_policy,
}


_WIDE = ("claim", "caveat", "version", "values", "meaning", "scenes", "rule", "unit", "source")


def ranges(places: Sequence[int]) -> str:
    """Ascending numbers in few words.

    >>> ranges([1, 2, 3, 5, 7, 8])
    '1-3, 5, 7-8'
    """
    runs: list[list[int]] = []
    for place in places:
        if runs and place == runs[-1][-1] + 1:
            runs[-1].append(place)
        else:
            runs.append([place])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def _numbered(rows: Sequence[Mapping[str, object]]) -> tuple[list[dict[str, object]], list[str]]:
    """Models with their scenes as numbers, and the names of these, each once."""
    names = [entry.id for entry in scenes()]
    place = {name: at for at, name in enumerate(names, 1)}
    shown = []
    for row in rows:
        own = sorted(place[str(name)] for name in _many(row["scenes"]))
        shown.append({**row, "scenes": "all" if len(own) == len(names) else ranges(own)})
    return shown, names


def _many(value: object) -> list[object]:
    """``value``, which is a list."""
    assert isinstance(value, list)
    return value


def command(topic: str, as_json: bool) -> ExitCode:
    """Print one of the lists; the code is NOTHING where it is empty."""
    rows: Sequence[Mapping[str, object]] = LISTS[topic]()
    if as_json:
        print(escaped(json.dumps({topic: rows}, ensure_ascii=False)))
    elif rows:
        names: list[str] = []
        if topic == "models":
            rows, names = _numbered(rows)
        table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
        for name, value in rows[0].items():
            table.add_column(name, no_wrap=isinstance(value, str) and name not in _WIDE)
        for row in rows:
            cells = (", ".join(map(str, value)) if isinstance(value, list) else str(value) for value in row.values())
            table.add_row(*map(Text, cells))
        console().print(table)
        if names:
            numbered = (f"{at} {name}" for at, name in enumerate(names, 1))
            console().print(f"\nscenes: {', '.join(numbered)}", markup=False)
    return ExitCode.OK if rows else ExitCode.NOTHING
