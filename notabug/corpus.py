"""The ``references`` command: build the corpus of reference pictures, or verify that it is what the code gives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from notabug.exit_codes import ExitCode
from notabug.progress import console
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.selection import choose, parse_variants


def command(deed: str, sources: Sequence[str], variants: Sequence[str], deep: bool = False) -> ExitCode:
    """``build`` writes, ``verify`` only reads; the code is REFERENCE where something is missing or differs.

    Without ``variants`` every one of each set is taken. ``deep`` holds a part of each picture against far more samples
    instead of computing it again, and tells the worst of them all.
    """
    from notabug.references.predict import ReferenceNotFiniteError
    from notabug.references.store import DeepComparison, ReferenceMissingError, build, compare, compare_deep

    out = console(stderr=True)
    code = ExitCode.OK
    worst = (0.0, "")
    for scene in _scenes(sources, variants):
        name = f"{scene.id} {scene.variant}".rstrip()
        try:
            if deed == "build":
                out.print(f"{name}: {build(scene)}", markup=False, soft_wrap=True)
                continue
            found = compare_deep(scene) if deep else compare(scene)
        except (ReferenceMissingError, ReferenceNotFiniteError) as error:
            out.print(str(error), markup=False, soft_wrap=True)
            code = ExitCode.REFERENCE
            continue
        out.print(f"{name}: {found}", markup=False, soft_wrap=True)
        if not found.accepted:
            code = ExitCode.REFERENCE
        if isinstance(found, DeepComparison) and found.ratio is not None and found.ratio >= worst[0]:
            worst = (found.ratio, name)
    if worst[1]:
        out.print(f"the worst ratio of error to bound is {worst[0]:.3g}: {worst[1]}", markup=False, soft_wrap=True)
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
