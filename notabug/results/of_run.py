"""A picture that lies in a run's folder: its result, and what the run knows of it, so that nobody need say it again."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.registry import adapter
from notabug.report.loading import inside, results_of
from notabug.results.record import Result, load
from notabug.scenes_usd.errors import SelectionError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.view import View, from_text


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a picture comes from: its run's folder and record, and its result."""

    out: Path
    document: Mapping[str, Any]
    result: Result

    @property
    def source(self) -> str:
        """The scene as it was asked for: an id, or a USD file by its path."""
        words = shlex.split(self.result.command)
        if "--scene" in words[:-1]:  # of `notabug judge`
            return words[words.index("--scene") + 1]
        given = [word for word in words[2:3] if not word.startswith("-")]
        return given[0] if given and words[1] == "run" else self.result.scene

    @property
    def choice(self) -> tuple[dict[str, str], View]:
        """The variants of the picture's scene and its view."""
        return from_text(self.result.variant)

    def scene(self) -> Scene:
        """The scene as the run took it."""
        variants, view = self.choice
        judged = shlex.split(self.result.command)[1:2] == ["judge"]  # what it was drawn by saw the file as it is
        sized = replace(view, size=self.result.size) if judged else view
        return take_scene(self.source, variants, sized, "picture" if judged else "scene").scene

    def declaration(self) -> Declaration:
        """What the renderer of the picture declares; for a picture that was judged as a file, what was said of it."""
        told = self.document.get("declaration")
        if isinstance(told, dict):
            known = {each.name for each in fields(Declaration)}
            values: dict[str, Any] = {
                name: math.inf if value is None else value for name, value in told.items() if name in known
            }
            return Declaration(**values)
        quality = Quality(samples=self.result.samples, seeds=tuple(range(max(1, self.result.seeds))))
        return adapter(self.result.renderer).declaration(quality)

    def worst_pixel(self) -> tuple[int, int] | None:
        """Where the judge says that the picture is most wrong; in a record that does not say it, by the judge's map."""
        told = self.result.worst
        if told is not None:
            return told
        name = self.result.images.get("bug_map") or self.result.images.get("limitation_map", "")
        if name:
            values = np.nan_to_num(read_picture(inside(self.out, name)).pixels[:, :, 0])
            y, x = np.unravel_index(int(np.argmax(values)), values.shape)
            return (int(x), int(y))
        if not self.result.verdict.findings:
            return None
        x0, y0, x1, y1 = max(self.result.verdict.findings, key=lambda finding: finding.area_px).region
        return ((x0 + x1) // 2, (y0 + y1) // 2)


def origin(image: Path) -> Origin | None:
    """The run that ``image`` is a picture of; None where it lies in no run, or the run has no such result."""
    path = image.resolve()
    for folder in path.parents:
        if not (folder / "run.json").is_file():
            continue
        document = load(folder)
        name = path.relative_to(folder).as_posix()
        for result in results_of(document):
            renders = path.parent.parent if path.parent.name == "renders" else path.parent
            own = (folder / result.image).resolve() if result.image else None
            if name == result.image or (own is not None and renders in own.parents and renders != folder):
                return Origin(folder, document, result)
    return None


def found(image: Path) -> Origin:
    """``origin``; raises SelectionError where there is none."""
    known = origin(image)
    if known is None:
        raise SelectionError("no run's picture", where=str(image), do="name its scene with --scene, and --pixel X,Y")
    return known
