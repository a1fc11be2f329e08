"""``bench faults``: does all hold that notabug promises under attack and under failure?

Its parts are misdeeds of a renderer, runs that are killed, disks that fill, and damaged files of each kind. Each is
taken a batch at a time; the bench goes on where it was stopped while the code is the same.
"""

from __future__ import annotations

import json
import random
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rich.table import Table

from notabug.bench import faults_disk, faults_kills, faults_misdeeds
from notabug.bench.faults_batch import Taken, batch
from notabug.bench.faults_cases import KINDS
from notabug.exit_codes import ExitCode
from notabug.printable import escaped
from notabug.runs.folders import write_json
from notabug.runs.progress import console
from notabug.runs.provenance import fingerprint, tool
from notabug.scenes_usd.errors import SelectionError

FILES = {"pictures": 10_000, "records": 50_000, "scenes": 10_000, "configurations": 15_000, "expectations": 15_000}
SHOWN = 10

Record = dict[str, Any]  # as Taken, and "skipped": why nothing was taken


def _possible() -> str:
    return ""


def _not_on_linux() -> str:
    return "" if sys.platform.startswith("linux") else "only on Linux does a renderer have a keeper"


@dataclass(frozen=True, slots=True)
class Part:
    """``full`` or ``quick`` cases, ``batch`` of them at a time by ``take``: of a seed, from a number on, so many.

    ``why_not`` says why the system cannot take them, or "".
    """

    full: int
    quick: int
    batch: int
    take: Callable[[int, int, int], Taken]
    why_not: Callable[[], str] = _possible


def misdeeds(seed: int, first: int, count: int) -> Taken:
    """Misdeeds of a renderer, in an order that ``seed`` draws, so that any beginning is a fair sample."""
    names = list(faults_misdeeds.MATRIX)
    random.Random(f"{seed} misdeeds").shuffle(names)  # noqa: S311 - no secret depends on it
    names = names[first : first + count]
    wrong = faults_misdeeds.take(names)
    return Taken(count, tuple((first, f"{name}: {what}") for name, what in wrong.items()))


def kills(seed: int, first: int, count: int) -> Taken:
    wrong = faults_kills.take(seed, first // faults_kills.KILLS, count)
    return Taken(count, tuple((first, what) for what in wrong))


def disks(seed: int, first: int, count: int) -> Taken:
    wrong = faults_disk.take(seed, first // faults_disk.POINTS, count)
    return Taken(count, tuple((first, what) for what in wrong))


PARTS = {
    "misdeeds": Part(len(faults_misdeeds.MATRIX), 4, 16, misdeeds, _not_on_linux),
    "kills": Part(100, 2, faults_kills.KILLS, kills, _not_on_linux),
    "disks": Part(20, 1, faults_disk.POINTS, disks, faults_disk.why_not),
    **{kind: Part(FILES[kind], 200, 500, partial(batch, kind)) for kind in KINDS},
}


def command(*, parts: Sequence[str], quick: bool, seed: int, out: Path, resume: bool, as_json: bool) -> ExitCode:
    """Take every case of ``parts`` (all when empty), write ``out/faults.json``; exit 1 where one was taken wrongly."""
    if unknown := set(parts) - PARTS.keys():
        raise SelectionError("no part of faults", where="--part", expected=", ".join(PARTS), got=", ".join(unknown))
    code = fingerprint("scenes_usd", "references", "adapters", "metrics", "bench")
    path = out / "faults.json"
    done = _earlier(path, code, seed) if resume else {}
    begun, loud = time.perf_counter(), console(stderr=True)

    def save() -> Record:
        document = {
            "schema": 2,
            "tool": tool(),
            "what": "faults",
            "key": [code, seed],
            "seconds": time.perf_counter() - begun,
            "parts": done,
        }
        write_json(path, document)
        return document

    for name in parts or PARTS:
        part = PARTS[name]
        state = done.setdefault(name, _as_record(Taken(0)))
        state["skipped"] = part.why_not()
        most = part.quick if quick else part.full
        while state["cases"] < most and not state["skipped"]:
            count = min(part.batch - state["cases"] % part.batch, most - state["cases"])
            _add(state, part.take(seed, state["cases"], count))
            save()
            seconds = time.perf_counter() - begun
            loud.print(f"{seconds:6.0f} s  {name}: {state['cases']} of {most}", markup=False)
    document = save()
    if as_json:
        print(escaped(json.dumps(document, ensure_ascii=False)))
    else:
        _show(done, path)
    return ExitCode.BUG if any(state["faults"] for state in done.values()) else ExitCode.OK


def _as_record(taken: Taken) -> Record:
    return asdict(taken) | {"faults": [list(fault) for fault in taken.faults], "skipped": ""}


def _add(state: Record, taken: Taken) -> None:
    state["cases"] += taken.cases
    state["faults"] += [list(fault) for fault in taken.faults]
    state["longest"] = max(state["longest"], taken.longest)
    state["memory"] = max(state["memory"], taken.memory)


def _earlier(path: Path, code: str, seed: int) -> dict[str, Record]:
    """What an earlier bench with the same code and seed has done."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        parts: dict[str, Record] = document["parts"] if document["key"] == [code, seed] else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return parts


def _show(done: dict[str, Record], path: Path) -> None:
    table = Table("part", "cases", "faults", "longest", "memory", box=None)
    for name, state in done.items():
        longest = f"{state['longest']:.2f} s" if state["longest"] else "-"
        memory = f"{state['memory'] / (1 << 20):.0f} MiB" if state["memory"] else "-"
        table.add_row(name, str(state["cases"]), str(len(state["faults"])), longest, memory)
    console().print(table)
    for name, state in done.items():
        if state["skipped"]:
            console().print(f"{name}: skipped, {state['skipped']}", markup=False, soft_wrap=True)
        for number, what in state["faults"][:SHOWN]:
            console().print(f"{name} {number}: {what}", markup=False, soft_wrap=True)
    console().print(str(path), markup=False, soft_wrap=True)
