"""From pictures on disk to a judged result on disk: read, judge, write what the report shows."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from notabug.adapters.base import Declaration
from notabug.adapters.spheres import as_given
from notabug.metrics.judge import Judgement, judge
from notabug.metrics.verdict import Verdict
from notabug.references.store import others
from notabug.scenes_usd.picture import Picture, read_picture, write_exr
from notabug.scenes_usd.scene import Scene

BLACK = "the reference is black everywhere: look at the scene's lights and camera, for this picture shows nothing"


@dataclass(frozen=True, slots=True)
class Outcome:
    """A verdict, the files that show it (name to path), and the seconds that reading, judging and writing took.

    ``channels`` and ``notes`` say what was read of the pictures and what was done with it, as in Picture.
    """

    verdict: Verdict
    image: Path
    images: dict[str, Path]
    size: tuple[int, int]
    seconds: float
    channels: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def judge_pictures(
    paths: Sequence[Path],
    scene: Scene,
    declaration: Declaration,
    folder: Path | None,
    *,
    pictures: Sequence[Picture] | None = None,
    srgb: bool = False,
) -> Outcome:
    """Judge the pictures at ``paths`` (seeds of one renderer); write maps into ``folder`` unless it is None.

    ``pictures`` are those at ``paths`` where they are read and decoded already; ``srgb`` tells that they were encoded.
    ``image`` of the outcome is the mean of the seeds, or the picture itself when there is one linear picture.
    """
    start = time.perf_counter()
    if pictures is None:
        pictures = [read_picture(path) for path in paths]
    height, width = pictures[0].pixels.shape[:2]
    judgement = judge_read(pictures, scene, declaration, srgb=srgb)
    image, images = (paths[0], {}) if folder is None else _write(judgement, folder, paths, height, width)
    return Outcome(
        judgement.verdict,
        image,
        images,
        (width, height),
        time.perf_counter() - start,
        _told([picture.judged for picture in pictures]),
        _told(
            [
                as_given(scene, declaration).notes[len(scene.notes) :],
                *([] if judgement.reference.any() else [(BLACK,)]),
                *(picture.notes for picture in pictures),
            ]
        ),
    )


def judge_read(pictures: Sequence[Picture], scene: Scene, declaration: Declaration, *, srgb: bool = False) -> Judgement:
    """The judgement on ``pictures``; in a file that loses much a bug is only what the loss does not explain."""
    pixels = [picture.pixels for picture in pictures]
    judgement = judge(pixels, scene, declaration, others=lambda: others(scene))
    lossy = next((picture.lossy for picture in pictures if picture.lossy), None)
    if lossy is None or not judgement.verdict.triggers:
        return judgement
    from notabug.runs.lossy_coding import lifted, spared

    if [finding.name for finding in judgement.verdict.findings] == [
        "negative"
    ]:  # what rings beside an edge falls below 0
        pixels = [lifted(pixel, judgement.nearest, lossy, srgb=srgb) for pixel in pixels]
        judgement = judge(pixels, scene, declaration, others=lambda: others(scene))
    if not judgement.verdict.triggers or "invalid" in judgement.verdict.triggers:
        return judgement
    # of what is off in no single pixel, a gain or a shift, the nearest picture is the picture itself
    meant = judgement.nearest if judgement.verdict.legs["bug"].pixels else judgement.reference
    left = [spared(pixel, meant, lossy, srgb=srgb) for pixel in pixels]
    again = judge(left, scene, declaration, perceive=lossy.bounded, naming=False)
    if again.verdict.triggers:
        return judgement
    if lossy.bounded:
        return again
    message = f"{lossy.name} holds too little: what is off may be what it lost; store EXR, TIFF or PNG"
    findings = tuple(finding for finding in judgement.verdict.findings if finding.kind != "bug")
    return replace(
        judgement, verdict=replace(judgement.verdict, word="inconclusive", findings=findings, message=message)
    )


def _told(of_each: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """What is told of any of the pictures, each once."""
    return tuple(dict.fromkeys(each for told in of_each for each in told))


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
