"""What of a broken relation goes with a bug report: the smallest pair of scenes, and both values at one pixel."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from notabug.adapters.base import RendererError
from notabug.bench.metamorphic import Check, Draw, check
from notabug.bench.metamorphic_relations import Relation
from notabug.runs.folders import write_text
from notabug.runs.shrinking import reduced, size
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.writer import write_scene


def write_reduced(
    made: Check, scene: Scene, relation: Relation, draw: Draw, folder: Path, note: Callable[[str], None]
) -> Path:
    """Shrink ``scene`` while ``relation`` stays broken as in ``made``, and write it, its double and a README."""

    def broken(smaller: Scene) -> bool:
        try:
            found = check(relation, smaller, made.renderer, draw, made.allowed)
        except (RendererError, ValueError, ArithmeticError):
            return False
        return found is not None and found.broken

    small = reduced(scene, broken, note)
    other = relation.second(small)
    assert other is not None, "a relation that is broken has a second scene"
    files = (
        write_scene(relation.first(small), folder / "scene.usda"),
        write_scene(other, folder / "double.usda"),
    )
    one, two = (draw(read_scene(file)) for file in files)  # what was written, not what it was written from
    y, x = divmod(int(np.abs(one - two).max(axis=2).argmax()), one.shape[1])
    values = " | ".join(" ".join(f"{float(value):.6g}" for value in each[y, x]) for each in (one, two))
    write_text(
        folder / "README.md",
        f"# {made.renderer} breaks a relation: {made.relation}\n\n"
        f"The picture should stay the same when {made.claim}. `scene.usda` ({size(small)}) and `double.usda` are a\n"
        f"pair for which it does not, at one sample a pixel through its centre.\n\n"
        f"At pixel ({x}, {y}), counted from 0 at the top left, linear RGB radiance:\n\n"
        f"| scene.usda | double.usda |\n|---|---|\n| {values} |\n\n"
        f"Reduced from `{made.scene}`, where {made.pixels} pixels away from edges differed by up to\n"
        f"{made.largest:.1e} of the brightest; {made.allowed:.0e} is allowed.\n",
    )
    return folder
