"""The files of one job: fresh pictures of a renderer, and what of an earlier run is still true and kept.

``renders.json`` lists the pictures and ``result.json`` holds the result, each under a key of all that enters it.
"""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

from notabug.adapters.base import Adapter, Found, Quality, Render
from notabug.adapters.trees import empty, replaced, states
from notabug.results.record import RecordError, Result
from notabug.results.shape import FILE, NUMBER, TEXT, WHOLE, Fields, Many, Shape, check
from notabug.runs.folders import LOCK, write_json, write_text
from notabug.runs.provenance import fingerprint
from notabug.runs.workers import rendering
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Scene

_PICTURE: dict[str, Shape] = {"image": FILE, "seed": WHOLE, "samples": WHOLE, "seconds": NUMBER, "command": Many(TEXT)}
_RENDERS = Fields({"key": TEXT, "renders": Many(Fields(_PICTURE))})  # of renders.json
OF_RENDERS = frozenset({LOCK, "renders", "renders.json", "log.txt"})  # what another judge's result is made from


def draw_fresh(scene: Scene, adapter: Adapter, folder: Path, key: str, quality: Quality) -> tuple[Render, ...]:
    """Fresh pictures in ``folder/renders``. ``folder`` is emptied first, so that no old file can pass for a new one.

    Whatever the renderer leaves beside the pictures, where our own files will be, is removed.
    """
    empty(folder, frozenset({LOCK}))
    pictures = folder / "renders"
    pictures.mkdir()
    before = states(pictures)
    with rendering():
        renders = adapter.render(scene, pictures, quality)
    if gone := replaced(before):
        raise NotabugError("the renderer replaced a folder of the run", where=str(gone), do="correct the renderer")
    empty(folder, frozenset({LOCK, "renders"}))
    if not renders:
        raise NotabugError(
            "the adapter returned no picture", where=f"adapter {adapter.name!r}", do="correct the adapter"
        )
    listed = [
        {
            "image": relative(render.image, folder),
            "seed": render.seed,
            "samples": render.samples,
            "seconds": render.seconds,
            "command": list(render.command),
        }
        for render in renders
    ]
    keep_log(folder, "\n".join(render.log for render in renders if render.log))
    write_json(folder / "renders.json", {"key": key, "renders": listed})
    return renders


def kept_renders(folder: Path, key: str) -> tuple[Render, ...]:
    """The pictures of an earlier run, when they are all there and were made the same way; else nothing."""
    stored = _load(folder / "renders.json")
    if stored.get("key") != key:
        return ()
    try:
        check(stored, _RENDERS, str(folder))
    except RecordError:
        return ()
    kept: Any = stored["renders"]  # of the shape that was checked
    renders = tuple(
        Render(folder / said["image"], said["seed"], said["samples"], said["seconds"], tuple(said["command"]))
        for said in kept
    )
    there = all(
        render.image.is_file() and render.image.resolve().is_relative_to(folder.resolve()) for render in renders
    )
    return renders if there and not (folder / "renders").is_symlink() else ()


def kept_result(folder: Path, key: str, out: Path) -> Result | None:
    """The finished result of an earlier run, when nothing that enters it has changed and its pictures are there."""
    stored = _load(folder / "result.json")
    if stored.get("key") != key:
        return None
    try:
        result = Result.from_dict(stored["result"])
    except (RecordError, KeyError):
        return None
    return result if all((out / each).is_file() for each in (result.image, *result.images.values())) else None


def keys_of(scene: Scene, adapter: Adapter, found: Found, quality: Quality) -> dict[str, str]:
    """What a picture and what a result depend on, as text."""
    made = [scene.digest(), adapter.name, found.version, found.key, quality.samples, list(quality.seeds)]
    return {name: json.dumps([*made, code]) for name, code in made_by().items()}


def made_by() -> dict[str, str]:
    """The fingerprints of the code that makes a picture, and of that which makes a result of it."""
    floors = {"render": ("scenes_usd", "adapters"), "result": ("scenes_usd", "references", "adapters", "metrics")}
    return {name: fingerprint(*each) for name, each in floors.items()}


def _load(path: Path) -> dict[str, object]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def relative(path: Path, base: Path) -> str:
    """``path`` seen from ``base``; a picture elsewhere is a defect of the adapter."""
    try:
        return path.resolve().relative_to(base.resolve()).as_posix()
    except ValueError:
        raise NotabugError("a picture lies outside of its folder", where=str(path), expected=f"below {base}") from None


def keep_log(folder: Path, log: str) -> Path | None:
    """Where ``log`` was written beside the result; None where it is empty or cannot be written."""
    if log:
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            write_text(folder / "log.txt", log)
            return folder / "log.txt"
    return None
