"""The ``references`` command: build the corpus of reference pictures, or verify that it is what the code gives."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from notabug.exit_codes import ExitCode
from notabug.runs.progress import console
from notabug.runs.selection import choose, parse_variants
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene


def command(
    deed: str, sources: Sequence[str], variants: Sequence[str], deep: bool = False, as_json: bool = False
) -> ExitCode:
    """``build`` writes, ``verify`` only reads; the code is REFERENCE where something is missing or differs.

    Without ``variants`` every one of each set is taken. ``deep`` holds a part of each picture against far more samples
    instead of computing it again, and tells the worst of them all.
    """
    from notabug.references.predict import ReferenceNotFiniteError
    from notabug.references.store import DeepComparison, ReferenceMissingError, build, compare, compare_deep

    out = console(stderr=True)
    told: list[dict[str, Any]] = []
    code = ExitCode.OK
    worst = (0.0, "")
    for scene in _scenes(sources, variants):
        name = f"{scene.id} {scene.variant}".rstrip()
        try:
            found = None if deed == "build" else compare_deep(scene) if deep else compare(scene)
            said = str(build(scene) if found is None else found)
            fine = found is None or found.accepted
        except (ReferenceMissingError, ReferenceNotFiniteError) as error:
            found, said, fine = None, str(error), False
            out.print(said, markup=False, soft_wrap=True)
        else:
            out.print(f"{name}: {said}", markup=False, soft_wrap=True)
        told.append({"scene": scene.id, "variant": scene.variant, "fine": fine, "says": said})
        code = code if fine else ExitCode.REFERENCE
        if isinstance(found, DeepComparison) and found.ratio is not None and found.ratio >= worst[0]:
            worst = (found.ratio, name)
    if worst[1]:
        out.print(f"the worst ratio of error to bound is {worst[0]:.3g}: {worst[1]}", markup=False, soft_wrap=True)
    if as_json:
        print(json.dumps({"references": told}, ensure_ascii=False))
    return code


def _scenes(sources: Sequence[str], variants: Sequence[str]) -> Iterator[Scene]:
    """The scenes asked for, each combination of variants once: a default may be named, or left out."""
    seen = set()
    for choice in choose(sources, parse_variants(variants), every_variant=not variants):
        scene = read_scene(choice.source, choice.variants)
        key = (scene.path, scene.variant)
        if key not in seen:
            seen.add(key)
            yield scene
