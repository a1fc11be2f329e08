"""``bench faults``: many damaged files, and whether each is read or refused in time, in memory and without a trace.

Cases are done by a child, a batch at a time, so that one that ends its process is known and costs no other. The bench
goes on where it was stopped while the code is the same.
"""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from notabug.bench.faults_cases import KINDS, fault
from notabug.exit_codes import ExitCode
from notabug.folders import write_json
from notabug.printable import escaped
from notabug.progress import console
from notabug.tool import fingerprint, tool

FULL = {"pictures": 10_000, "records": 50_000, "scenes": 10_000, "configurations": 15_000, "expectations": 15_000}
QUICK = dict.fromkeys(KINDS, 200)
BATCH = 500
SECONDS = 20.0  # of processor time for one case
MEMORY = 4 << 30  # bytes of address space: 2 GiB beside what the libraries map
STILL = 120.0  # seconds on the clock without a case that ends
SHOWN = 10

Record = dict[str, Any]  # cases: how many are done, faults: [number, what]


def command(*, quick: bool, seed: int, out: Path, resume: bool, as_json: bool) -> ExitCode:
    """Take every case, write ``out/faults.json``; exit 1 where one was taken wrongly."""
    begun = time.perf_counter()
    code = fingerprint("scenes_usd", "references", "adapters", "metrics", "bench")
    counts = QUICK if quick else FULL
    path = out / "faults.json"
    done = _earlier(path, code, seed) if resume else {}
    loud = console(stderr=True)

    def save() -> Record:
        document = {
            "schema": 1,
            "tool": tool(),
            "what": "faults",
            "key": [code, seed],
            "seconds": time.perf_counter() - begun,
            "kinds": done,
        }
        write_json(path, document)
        return document

    for kind in KINDS:
        state = done.setdefault(kind, {"cases": 0, "faults": []})
        while state["cases"] < counts[kind]:
            count = min(BATCH, counts[kind] - state["cases"])
            took, faults = batch(kind, seed, state["cases"], count)
            state["cases"] += took
            state["faults"] += faults
            save()
            loud.print(
                f"{time.perf_counter() - begun:6.0f} s  {kind}: {state['cases']} of {counts[kind]}", markup=False
            )
    document = save()
    if as_json:
        print(escaped(json.dumps(document, ensure_ascii=False)))
    else:
        _show(done, path)
    return ExitCode.BUG if any(state["faults"] for state in done.values()) else ExitCode.OK


def batch(
    kind: str,
    seed: int,
    first: int,
    count: int,
    program: Callable[[str, int, int, int, Path], Sequence[str]] | None = None,
) -> tuple[int, list[list[Any]]]:
    """How many of the cases from ``first`` on were taken, up to ``count``, and the faults: [number, what].

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
    faults = [[number, what] for number, what in lines if what]
    if len(begun) == count and child.returncode == 0:
        return count, faults
    last = begun[-1] if begun else first
    return last - first + 1, [*faults, [last, _ending(child.returncode) if moving else f"no end in {STILL:g} s"]]


def _ending(code: int) -> str:
    if code == -getattr(signal, "SIGPROF", 0):
        return f"more than {SECONDS:g} s of processor time"
    return f"it ended its process: exit state {code}"


def _child(kind: str, seed: int, first: int, count: int, notes: Path) -> list[str]:
    numbers = map(str, (seed, first, count))
    return [sys.executable, "-P", "-m", "notabug.bench.faults", kind, *numbers, str(notes)]


def take(kind: str, seed: int, first: int, count: int, notes: Path) -> None:
    """Take ``count`` cases in this process and note each: [number, null] when it begins, [number, what] for a fault."""
    with contextlib.suppress(ImportError, ValueError):  # not everywhere
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with notes.open("a", encoding="utf-8") as log:
        for number in range(first, first + count):
            log.write(f"{json.dumps([number, None])}\n")
            log.flush()
            if hasattr(signal, "setitimer"):
                signal.setitimer(signal.ITIMER_PROF, SECONDS)
            if what := fault(kind, seed, number):
                log.write(f"{json.dumps([number, what])}\n")


def _earlier(path: Path, code: str, seed: int) -> dict[str, Record]:
    """What an earlier bench with the same code and seed has done."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        kinds: dict[str, Record] = document["kinds"] if document["key"] == [code, seed] else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return kinds


def _show(done: dict[str, Record], path: Path) -> None:
    table = Table("kind", "cases", "faults", box=None)
    for kind, state in done.items():
        table.add_row(kind, str(state["cases"]), str(len(state["faults"])))
    console().print(table)
    for kind, state in done.items():
        for number, what in state["faults"][:SHOWN]:
            console().print(f"{kind} {number}: {what}", markup=False, soft_wrap=True)
    console().print(str(path), markup=False, soft_wrap=True)


if __name__ == "__main__":
    take(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5]))
