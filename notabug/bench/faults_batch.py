"""Damaged files of ``bench faults``, a batch at a time: done by a child, so that a case that ends its process is known.

``python -m notabug.bench.faults_batch KIND SEED FIRST COUNT NOTES`` takes the cases and writes NOTES.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from notabug.bench.faults_cases import fault

SECONDS = 20.0  # of processor time for one case
MEMORY = 4 << 30  # bytes of address space: 2 GiB beside what the libraries map
STILL = 120.0  # seconds on the clock without a case that ends


@dataclass(frozen=True, slots=True)
class Taken:
    """What came of ``cases`` cases: ``faults`` are pairs of a case's number and what is wrong with it.

    ``longest`` are the seconds of processor time of the case that took most, ``memory`` the most bytes resident.
    """

    cases: int
    faults: tuple[tuple[int, str], ...] = ()
    longest: float = 0.0
    memory: int = 0


def batch(
    kind: str,
    seed: int,
    first: int,
    count: int,
    program: Callable[[str, int, int, int, Path], Sequence[str]] | None = None,
) -> Taken:
    """What came of the cases from ``first`` on, up to ``count``.

    The case at which the child ends is the last one that is taken. ``program`` gives the child's command line.
    """
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        notes = Path(name) / "notes"
        notes.touch()
        child = subprocess.Popen(
            (program or _child)(kind, seed, first, count, notes),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=name,
        )
        seen, since, moving = -1, time.monotonic(), True
        try:
            while child.poll() is None and moving:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    child.wait(1.0)
                if notes.stat().st_size != seen:
                    seen, since = notes.stat().st_size, time.monotonic()
                moving = time.monotonic() - since < STILL
        finally:
            child.kill()
            child.wait()
        lines = [json.loads(line) for line in notes.read_text(encoding="utf-8").splitlines() if line.endswith("]")]
    begun = [number for number, what in lines if what is None]
    faults = [(number, what) for number, what in lines if isinstance(what, str)]
    costs = [what for _, what in lines if isinstance(what, dict)]
    longest = max((cost["seconds"] for cost in costs), default=0.0)
    memory = max((cost["memory"] for cost in costs), default=0)
    if len(begun) == count and child.returncode == 0:
        return Taken(count, tuple(faults), longest, memory)
    last = begun[-1] if begun else first
    ending = _ending(child.returncode) if moving else f"no end in {STILL:g} s"
    return Taken(last - first + 1, (*faults, (last, ending)), longest, memory)


def _ending(code: int) -> str:
    if code == -getattr(signal, "SIGPROF", 0):
        return f"more than {SECONDS:g} s of processor time"
    return f"it ended its process: exit state {code}"


def _child(kind: str, seed: int, first: int, count: int, notes: Path) -> list[str]:
    numbers = map(str, (seed, first, count))
    return [sys.executable, "-P", "-m", "notabug.bench.faults_batch", kind, *numbers, str(notes)]


def take(kind: str, seed: int, first: int, count: int, notes: Path) -> None:
    """Take ``count`` cases in this process and note each: [number, null] when it begins, [number, what] for a fault.

    A case that took longer or more memory than those before it is noted with what it took.
    """
    with contextlib.suppress(ImportError, ValueError):  # not everywhere
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    longest, most = 0.0, 0
    with notes.open("a", encoding="utf-8") as log:
        for number in range(first, first + count):
            log.write(f"{json.dumps([number, None])}\n")
            log.flush()
            if hasattr(signal, "setitimer"):
                signal.setitimer(signal.ITIMER_PROF, SECONDS)
            begun = sum(os.times()[:4])
            if what := fault(kind, seed, number):
                log.write(f"{json.dumps([number, what])}\n")
            seconds, memory = sum(os.times()[:4]) - begun, _memory()
            if seconds > longest or memory > most:
                longest, most = max(seconds, longest), max(memory, most)
                log.write(f"{json.dumps([number, {'seconds': longest, 'memory': most}])}\n")


def _memory() -> int:
    """The most bytes that were ever resident, of this process or of one that it started."""
    try:
        import resource
    except ImportError:  # not everywhere
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    whose = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return max(resource.getrusage(each).ru_maxrss for each in whose) * unit


if __name__ == "__main__":
    take(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5]))
