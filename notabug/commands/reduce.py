"""The ``reduce`` command: find the bug, shrink the scene, and write the folder that goes with a bug report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from notabug.adapters.base import Adapter, Quality
from notabug.adapters.registry import adapter
from notabug.commands.judge import one_variant
from notabug.exit_codes import ExitCode
from notabug.results.wording import readable, triple
from notabug.runs.folders import write_text
from notabug.runs.own_folder import check, claim
from notabug.runs.progress import console
from notabug.runs.shrinking import Examiner, Shown, bug, reduced, size
from notabug.scenes_usd.errors import NotabugError, SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import AS_IT_IS, View
from notabug.scenes_usd.writer import write_scene


def command(
    *,
    scene: str,
    renderer: str,
    variants: Sequence[str],
    view: View = AS_IT_IS,
    settings: Sequence[str],
    out: Path,
    samples: int,
    seeds: int,
    any_name: bool = False,
    as_json: bool = False,
) -> ExitCode:
    """Reduce ``scene`` for ``renderer`` into ``out``; exit 1, for there is a bug, or 5 where there is none."""
    quiet = console(stderr=True)
    check(out, "reduced scene")
    who = configured(adapter(renderer), settings)
    found = who.find()
    examiner = Examiner(who, Quality(samples=samples, seeds=tuple(range(seeds))))
    taken = take_scene(scene, one_variant(variants), view)
    start = taken.scene
    if taken.told(scene):
        quiet.print(Text(taken.told(scene)), soft_wrap=True)
    first = examiner.show(start)
    name = bug(first.verdict)
    if not name:
        quiet.print(Text(f"{scene}: the verdict on {renderer} is {first.verdict.word}, no bug; nothing to reduce"))
        return ExitCode.NOTHING
    quiet.print(Text(f"{readable(name)}: {size(start)}"))
    small = reduced(start, examiner.is_same("" if any_name else name), lambda text: quiet.print(Text(text)))
    claim(out, "reduced scene")
    path = write_scene(small, out / "scene.usda")
    shown = examiner.show(read_scene(path))  # what was written, not what it was written from
    name = bug(shown.verdict) if any_name else name
    if not name or bug(shown.verdict) != name:
        raise NotabugError(
            "the bug is gone from the file that was written",
            where=str(path),
            got=shown.verdict.word,
            do="keep the scene",
        )
    write_exr(out / "found.exr", shown.found)
    write_exr(out / "expected.exr", shown.expected)
    write_text(out / "README.md", readme(start.id, start.variant, who, found.version, settings, name, shown, start))
    text = f"{size(shown.scene)}, after {examiner.tried} pictures: {out}"
    if as_json:
        made = {"folder": str(out), "size": size(shown.scene), "pictures": examiner.tried, "pixel": list(shown.pixel)}
        print(json.dumps({"reduced": made, "message": shown.verdict.message}, ensure_ascii=False))
    else:
        console().print(Text(text), soft_wrap=True)
    return ExitCode.BUG


def configured(who: Adapter, settings: Sequence[str]) -> Adapter:
    """``who`` with ``KEY=VALUE`` attributes replaced; text attributes only, and booleans as true or false."""
    changes: dict[str, Any] = {}
    subject: Any = who
    known = {each.name: getattr(who, each.name) for each in fields(subject) if each.name != "name"}
    for word in settings:
        key, equals, value = word.partition("=")
        if not equals or not isinstance(known.get(key), str | bool):
            usable = ", ".join(k for k, v in known.items() if isinstance(v, str | bool))
            raise SelectionError("not a setting", where="--set", expected=f"KEY=VALUE, KEY one of {usable}", got=word)
        changes[key] = value == "true" if isinstance(known[key], bool) else value
    made: Adapter = replace(subject, **changes)
    return made


def readme(
    scene: str,
    variant: str,
    who: Adapter,
    version: str,
    settings: Sequence[str],
    name: str,
    shown: Shown,
    start: Scene,
) -> str:
    """The text that states what is expected and what is found."""
    x, y = shown.pixel
    expected, found = (triple(each[y, x]) for each in (shown.expected, shown.found))
    off = float(np.abs(shown.found - shown.expected).max())
    made = " ".join(filter(None, [who.name, version, *settings]))
    again = " ".join([*(f"--set {setting}" for setting in settings), f"--samples {shown.samples}"])
    return (
        f"# {readable(name).capitalize()} in {made}\n\n"
        f"`scene.usda` is all it takes: {size(shown.scene)}.\n\n"
        f"At pixel ({x}, {y}), counted from 0 at the top left, linear RGB radiance:\n\n"
        f"| expected | found |\n|---|---|\n| {expected} | {found} |\n\n"
        f"The largest difference in the picture is {off:.3g}. `expected.exr` and `found.exr` hold both pictures.\n\n"
        f"What the judge says: {shown.verdict.message or readable(name)}\n\n"
        f"Reduced from `{' '.join(filter(None, [scene, variant]))}` ({size(start)}). To see it again:\n\n"
        f"```sh\nnotabug reduce scene.usda -r {who.name} {again}".rstrip()
        + "\n```\n"
    )
