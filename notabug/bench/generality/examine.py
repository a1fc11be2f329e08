"""One scene by one renderer: drawn and judged, and what came of it as a record; nothing it does ends the bench."""

from __future__ import annotations

import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from notabug.adapters.base import Adapter, Declaration, Pixels, Quality, RendererError, UnsupportedError
from notabug.adapters.declared import RADIUS, unknown
from notabug.metrics.judge import judge
from notabug.metrics.verdict import Verdict
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Scene

Record = dict[str, Any]

QUALITIES = {  # card of the deck: how a renderer is asked to draw
    "default": Quality(),
    "point": Quality(samples=1),
    "box": Quality(samples=16),
}
NOISE = 2.0  # the noise picture is even between 0 and this many times the mean of the right one


def guarded(work: Callable[[], Record]) -> Record:
    """What ``work`` returns, or the word ``error``, ``unsupported`` or ``traceback`` with what was raised."""
    start = time.perf_counter()
    try:
        made = work()
    except UnsupportedError as error:
        made = {"word": "unsupported", "message": error.what}
    except (RendererError, NotabugError) as error:
        made = {"word": "error", "message": " ".join(str(error).split())}
    except Exception as error:
        made = {"word": "traceback", "message": f"{type(error).__name__}: {error}", "trace": traceback.format_exc()}
    return {**made, "seconds": round(time.perf_counter() - start, 3)}


def pictures_by(adapter: Adapter, scene: Scene, quality: Quality) -> list[Pixels]:
    """The pictures of ``scene`` by every seed."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as scratch:
        made = adapter.render(scene, Path(scratch), quality)
        return [read_picture(each.image).pixels for each in made]


def said(verdict: Verdict) -> Record:
    """What a record keeps of a verdict."""
    return {
        "word": verdict.word,
        "triggers": list(verdict.triggers),
        "bugs": [each.name for each in verdict.findings if each.kind == "bug"],
        "limitations": [each.name for each in verdict.findings if each.kind == "limitation"],
        "conventions": [each.name for each in verdict.findings if each.kind == "convention"],
        "bug_pixels": verdict.numbers.get("bug_pixels", 0.0),
        "message": verdict.message,
    }


def examine(scene: Scene, adapter: Adapter, quality: Quality, *, naming: bool) -> Record:
    """Draw and judge ``scene`` by ``adapter``."""

    def work() -> Record:
        pictures = pictures_by(adapter, scene, quality)
        return verdict_on(pictures, scene, adapter.declaration(quality), naming=naming)

    return {"renderer": adapter.name, **guarded(work)}


def verdict_on(pictures: Sequence[Pixels], scene: Scene, declaration: Declaration, *, naming: bool) -> Record:
    """What is said of ``pictures``, and the seconds that it took: those that passed, and those of processors."""
    passed, busy = time.perf_counter(), time.process_time()
    verdict = judge(pictures, scene, declaration, perceive=False, naming=naming).verdict
    passed, busy = time.perf_counter() - passed, time.process_time() - busy
    return {**said(verdict), "judging": {"seconds": round(passed, 3), "processor": round(busy, 3)}}


def unknown_making() -> Declaration:
    """What is known of a single file of which nothing is said: every choice is open, so most is admitted."""
    known: dict[str, Any] = {"precision": "float32", "filter": "unknown", "radius": RADIUS["unknown"], "noisy": False}
    return Declaration(**unknown(), **known, quantum=2.0**-24, relative_quantum=True)


def controls(scene: Scene, seed: int) -> list[Record]:
    """Pictures that must not pass: black and noise, as a single file of unknown making. Where black is right, none."""
    declaration = unknown_making()
    shape = scene.height, scene.width, 3
    brightness = [0.0]

    def black() -> Record:
        judged = judge([np.zeros(shape, np.float32)], scene, declaration, perceive=False, naming=False)
        brightness[0] = float(judged.reference.mean())
        return said(judged.verdict)

    def noise() -> Record:
        rng = np.random.default_rng((seed, 2))
        pixels = rng.uniform(0.0, NOISE * brightness[0], shape).astype(np.float32)
        return verdict_on([pixels], scene, declaration, naming=False)

    first = {"renderer": "black", **guarded(black)}
    if first["word"] not in ("traceback", "error") and not brightness[0]:
        return []
    return [first, {"renderer": "noise", **guarded(noise)}]
