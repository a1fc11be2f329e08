"""bench speed: the tracer against Embree, an envelope, a verdict, the start of the program and its memory, in one run.

Times are the best of several repetitions in turn (A B A B), because the machines this runs on are noisy.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration, Quality
from notabug.adapters.inhouse import InHouse
from notabug.bench.memory import PICTURES
from notabug.metrics.judge import judge
from notabug.references import _native
from notabug.references.tracer.envelope import trace_envelope
from notabug.references.tracer.flatten import Flat, flatten
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene

REPEATS = 5
RAYS = 1024  # squared
AS_EMBREE = 1.0
MOST_MEMORY = 400 << 20  # bytes of a judge
AWAY = 1e-5  # units towards the light: where a shadow ray starts, for Embree knows of no face to pass over
TESSELLATION = "96x48"  # of the ball that is traced

Rays = tuple[Callable[[], npt.NDArray[Any]], str, npt.NDArray[np.float64], npt.NDArray[np.float64]]
"""What traces them, Embree's word for the question, their origins and directions."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured figure and what is asked of it; ``met`` None where it could not be measured."""

    name: str
    value: float | None
    unit: str
    asked: str
    met: bool | None
    note: str = ""

    def as_dict(self) -> dict[str, object]:
        return asdict(self)


def measure() -> list[Figure]:
    """Every figure of the bench; about a minute."""
    return [*_against_embree(), _envelope(), *_verdicts(), _start(), _memory(PICTURES)]


def _best(*works: Callable[[], object], repeats: int = REPEATS) -> list[float]:
    """The shortest time of each work in seconds, after one run that is not counted, the works taking turns."""
    for work in works:
        work()
    best = [float("inf")] * len(works)
    for _ in range(repeats):
        for i, work in enumerate(works):
            start = time.perf_counter()
            work()
            best[i] = min(best[i], time.perf_counter() - start)
    return best


def camera_rays(scene: Scene, side: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Origins and unit directions (side * side, 3) of the camera's rays through a square raster's pixel centres."""
    camera = scene.camera
    y, x = (np.mgrid[0:side, 0:side].reshape(2, -1, 1) + 0.5) / side
    axes = camera.to_world[:3, :3]
    directions = (2 * x - 1) * camera.tan_x * axes[0] + (1 - 2 * y) * camera.tan_y * axes[1] - axes[2]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.tile(camera.to_world[3, :3], (len(directions), 1)), directions


def _against_embree() -> list[Figure]:
    """Camera rays, and from what they hit rays to the light, each against Embree with the same rays."""
    scene = read_scene("terminator/sphere", {"tessellation": TESSELLATION})
    flat = flatten(scene)
    origins, directions = camera_rays(scene, RAYS)
    hits, distances, _ = _native.trace(flat, origins, directions)
    hit = hits >= 0
    points = origins[hit] + distances[hit, None] * directions[hit]
    to = np.asarray(scene.lights[0].position) - points
    far = np.linalg.norm(to, axis=1)
    to /= far[:, None]
    starts = points + AWAY * to
    threads = os.cpu_count() or 1
    camera: Rays = (lambda: _native.trace(flat, origins, directions, threads)[0], "INTERSECT", origins, directions)
    shadow: Rays = (lambda: _native.occluded(flat, starts, to, far, threads), "OCCLUDED", starts, to)
    return [_ratio("camera rays", flat, camera, None), _ratio("shadow rays", flat, shadow, far)]


def _ratio(what: str, flat: Flat, rays: Rays, far: npt.NDArray[np.float64] | None) -> Figure:
    """Rays per second of ours over Embree's, both tracing ``rays`` through the triangles of ``flat``."""
    ours, query, origins, directions = rays
    name, asked = f"tracer, {what} per second against Embree (float32, 1 thread)", f"at least {AS_EMBREE}"
    n, threads = len(directions), os.cpu_count() or 1
    if importlib.util.find_spec("embreex") is None:
        (seconds,) = _best(ours)
        rate = n / seconds / 1e6
        return Figure(name, None, "x", asked, None, f"{rate:.2f} Mrays/s; no Embree: pip install 'notabug[bench]'")
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    embree = EmbreeScene()
    TriangleMesh(embree, flat.points.reshape(-1, 3, 3).astype(np.float32))
    single = origins.astype(np.float32), directions.astype(np.float32)
    ends = np.full(n, 1e37, np.float32) if far is None else far.astype(np.float32)

    def theirs() -> npt.NDArray[np.int64]:
        return np.asarray(embree.run(*single, ends.copy(), query=query))  # it writes into the distances

    a, b = _best(ours, theirs)
    mine, other = ours(), theirs()
    agree = float(((mine == other) if far is None else (mine == (other >= 0))).mean())
    note = f"ours {n / a / 1e6:.2f} Mrays/s in float64 on {threads} threads, Embree {n / b / 1e6:.2f}; "
    return Figure(name, b / a, "x", asked, b / a >= AS_EMBREE, note + f"the same for {100 * agree:.4f} % of the rays")


def _envelope() -> Figure:
    scene = read_scene("terminator/sphere", {"tessellation": TESSELLATION})
    (seconds,) = _best(lambda: trace_envelope(scene))
    note = "256 x 256, 16 subsamples a pixel, 64 at edges, float64"
    return Figure("envelope, warm", seconds, "s", "under 1 s", seconds < 1.0, note)


def _verdicts() -> list[Figure]:
    made = []
    for source, samples in (("terminator/sphere", 1), ("terminator/sphere", 16), ("texture/uneven_quad", 1)):
        scene, adapter = read_scene(source), InHouse()
        quality = Quality(samples=samples)
        declaration = adapter.declaration(quality)
        with tempfile.TemporaryDirectory(prefix="notabug-") as folder:
            pictures = [read_picture(each.image).pixels for each in adapter.render(scene, Path(folder), quality)]

        def work(
            pictures: Sequence[npt.NDArray[np.float32]] = pictures,
            scene: Scene = scene,
            declaration: Declaration = declaration,
        ) -> None:
            judge(pictures, scene, declaration, perceive=False)

        (seconds,) = _best(work)
        name = f"judge, cached references, without FLIP: {source}, {len(pictures)} picture(s)"
        made.append(Figure(name, seconds, "s", "under 0.1 s", seconds < 0.1, f"{scene.width} x {scene.height}"))
    return made


def _memory(pictures: int) -> Figure:
    """The peak of a process of its own that does nothing else."""
    command = [sys.executable, "-m", "notabug.bench.memory", str(pictures)]
    most = int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    note = f"{pictures} pictures in one process; python -m notabug.bench.memory N judges N"
    asked = f"under {MOST_MEMORY >> 20} MB"
    return Figure("judge, peak memory", most / (1 << 20), "MB", asked, most < MOST_MEMORY, note)


def _start() -> Figure:
    command = [sys.executable, "-m", "notabug.cli", "--help"]
    (seconds,) = _best(lambda: subprocess.run(command, check=True, capture_output=True))
    return Figure("notabug --help, from start to end", seconds, "s", "under 0.3 s", seconds < 0.3, "")
