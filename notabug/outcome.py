"""From pictures on disk to a judged result on disk: read, judge, write what the report shows."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from notabug.adapters.base import Declaration
from notabug.metrics.judge import Judgement, judge
from notabug.metrics.verdict import Verdict
from notabug.references.store import others
from notabug.scenes_usd.picture import read_picture, write_exr
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class Outcome:
    """A verdict, the files that show it (name to path), and the seconds that reading, judging and writing took."""

    verdict: Verdict
    image: Path
    images: dict[str, Path]
    size: tuple[int, int]
    seconds: float


def judge_pictures(paths: Sequence[Path], scene: Scene, declaration: Declaration, folder: Path | None) -> Outcome:
    """Judge the pictures at ``paths`` (seeds of one renderer); write maps into ``folder`` unless it is None.

    ``image`` of the outcome is the mean of the seeds, or the picture itself when there is one linear picture.
    """
    start = time.perf_counter()
    pictures = [read_picture(path).pixels for path in paths]
    height, width = pictures[0].shape[:2]
    judgement = judge(pictures, scene, declaration, others=lambda: others(scene))
    image, images = (paths[0], {}) if folder is None else _write(judgement, folder, paths, height, width)
    return Outcome(judgement.verdict, image, images, (width, height), time.perf_counter() - start)


def _write(
    judgement: Judgement, folder: Path, paths: Sequence[Path], height: int, width: int
) -> tuple[Path, dict[str, Path]]:
    folder.mkdir(parents=True, exist_ok=True)
    image = paths[0]
    if (height, width) == judgement.mean.shape[:2] and (len(paths) > 1 or not image.is_relative_to(folder)):
        image = folder / "mean.exr"
        write_exr(image, judgement.mean)
    # where nothing is a bug the nearest admissible picture is the picture itself
    images = {} if (judgement.nearest != judgement.mean).any() else {"nearest": image}
    for name, pixels in (
        ("nearest", judgement.nearest),
        ("reference", judgement.reference),
        ("limitation_map", judgement.limitation_map),
        ("bug_map", judgement.bug_map),
    ):
        if name not in images and (pixels.any() or not name.endswith("_map")):  # a leg that is empty has no map
            images[name] = folder / f"{name}.exr"
            write_exr(images[name], np.atleast_3d(pixels), half=name.endswith("_map"))
    return image, images
