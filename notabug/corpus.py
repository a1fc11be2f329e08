"""The ``references`` command: build the corpus of reference pictures, or verify that it is what the code gives."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import cast

from notabug.exit_codes import ExitCode
from notabug.progress import console
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.selection import choose, parse_variants

Build = Callable[[Scene], Path]  # writes a scene's references and says where
Verify = Callable[[Scene], Iterable[str]]  # what is missing or differs, a sentence each


def command(deed: str, sources: Sequence[str], variants: Sequence[str]) -> ExitCode:
    """``build`` writes, ``verify`` only reads; the code is REFERENCE where something is missing or differs."""
    store = importlib.import_module("notabug.references.store")
    code = ExitCode.OK
    for choice in choose(sources, parse_variants(variants)):
        scene = read_scene(choice.source, choice.variants)
        name = f"{scene.id} {scene.variant}".rstrip()
        if deed == "build":
            console(stderr=True).print(f"{name}: {cast(Build, store.build)(scene)}", markup=False, soft_wrap=True)
            continue
        problems = list(cast(Verify, store.verify)(scene))
        for problem in problems or ["as the code gives it"]:
            console(stderr=True).print(f"{name}: {problem}", markup=False, soft_wrap=True)
        if problems:
            code = ExitCode.REFERENCE
    return code
