"""What a picture costs: wall time, processor time and memory of one render in a fresh process."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import resource
import sys
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Adapter, Quality
from notabug.scenes_usd.scene import Scene

Floats = npt.NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Cost:
    """Seconds of wall time and of all processors, and MiB of the largest process; the process's start is included."""

    wall: float
    cpu: float
    memory: float

    def without(self, start: Cost) -> Cost:
        """What is left when the cost of an almost empty picture is taken off; never below 0."""
        return Cost(max(self.wall - start.wall, 0.0), max(self.cpu - start.cpu, 0.0), self.memory)


def render(adapter: Adapter, scene: Scene, quality: Quality) -> tuple[Cost, Floats]:
    """Draw ``scene`` in a fresh process; the cost, and the mean picture (h, w, 3).

    A renderer that is a program of its own is timed from its start to its end, one that is a library from the start of
    the interpreter, which it needs: both from nothing to a picture. Memory counts all processes of the job, each alone.
    """
    begun = time.perf_counter()
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        own, cost, pixels = pool.submit(_work, adapter, scene, quality).result()
        total = time.perf_counter() - begun
    return (Cost(total, cost.cpu, cost.memory) if own else cost), pixels


def _work(adapter: Adapter, scene: Scene, quality: Quality) -> tuple[bool, Cost, Floats]:
    """In the fresh process: (whether the adapter drew in it, the cost, the picture)."""
    from notabug.adapters.kept import end_kept
    from notabug.scenes_usd.picture import read_picture

    before = _used(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="notabug-") as folder, _Watch() as watch:
        made = adapter.render(scene, Path(folder), quality)
        wall = time.perf_counter() - start
        end_kept()  # what a child has used counts once it has ended
        pixels: Floats = np.asarray(
            np.mean([read_picture(each.image).pixels for each in made], axis=0, dtype=np.float64)
        )
    own = not made[0].command
    cpu = _used(resource.RUSAGE_SELF) if own else _used(resource.RUSAGE_CHILDREN) - before
    largest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss if own else watch.largest
    return own, Cost(wall, cpu, largest / _PER_MIB), pixels


_PER_MIB = 1024.0 if sys.platform != "darwin" else 1024.0**2
_POLL = 0.01


class _Watch:
    """The largest memory that a child, or a child's child, has held, in the unit of ru_maxrss.

    ru_maxrss of a child counts what the process that started it held, which here is more than many renderers do, so
    where there is /proc it is looked up there until the child ends, but not before it has become another program; a
    last peak of less than 10 ms may be missed.
    """

    def __init__(self) -> None:
        self.largest = 0.0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)

    def __enter__(self) -> _Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        if not self.largest:
            self.largest = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss

    def _look(self) -> None:
        own = os.getpid()
        words = Path("/proc/self/cmdline").read_bytes() if Path("/proc/self/cmdline").is_file() else b""
        while not self._end.wait(_POLL):
            for child in _below(own):
                with contextlib.suppress(OSError, ValueError, StopIteration):
                    if Path(f"/proc/{child}/cmdline").read_bytes() == words:
                        continue
                    lines = Path(f"/proc/{child}/status").read_text("ascii", "replace").splitlines()
                    peak = next(line for line in lines if line.startswith("VmHWM"))
                    self.largest = max(self.largest, float(peak.split()[1]))


def _below(pid: int) -> list[int]:
    """The processes that ``pid`` started, and theirs; none where there is no /proc."""
    found: list[int] = []
    for each in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in map(int, each.read_text("ascii").split()):
                found += [child, *_below(child)]
    return found


def _used(who: int) -> float:
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime
