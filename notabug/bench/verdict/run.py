"""Exposes the groups of the design on all cores and keeps each group's records, so a stopped bench goes on."""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import groupby
from pathlib import Path
from typing import Any, Protocol, TypeVar

import notabug.bench.verdict
import notabug.metrics
import notabug.references
from notabug.references import _native
from notabug.references.cache import cache_root, source_hash
from notabug.runs.folders import write_text

Record = dict[str, Any]
LOOKS = 1.0  # seconds between two looks of a worker whether the bench is still there
TOGETHER = 6  # groups of a setting at most that one process does: at the end the others would wait for it


class Keyed(Protocol):
    """Work whose records are kept under its key; what shares a setting is done by one process."""

    def key(self) -> str: ...

    def setting(self) -> object: ...


Work = TypeVar("Work", bound=Keyed)


def folder() -> Path:
    """Where records are kept; another one for every version of the judge, the references and the bench."""
    sources = (notabug.bench.verdict, notabug.metrics, notabug.references)
    versions = [source_hash(Path(source.__path__[0])) for source in sources]
    return cache_root() / "bench" / "-".join([*versions, _native.SOURCES])


def kept(group: Keyed, within: Path) -> list[Record] | None:
    """The records of ``group`` from an earlier run, or None."""
    try:
        found = json.loads((within / f"{group.key()}.json").read_text())
    except (OSError, ValueError):
        return None
    return found if isinstance(found, list) else None


def run(
    groups: Sequence[Work], expose: Callable[[Work], list[Record]], within: Path, workers: int = 0
) -> Iterator[list[Record]]:
    """The records of every group: first those that are there, then the others as they are made."""
    within.mkdir(parents=True, exist_ok=True)
    waiting = []
    for group in groups:
        found = kept(group, within)
        if found is None:
            waiting.append(group)
        else:
            yield found
    if not waiting:
        return
    workers = workers or os.cpu_count() or 1
    context = multiprocessing.get_context("spawn")  # the kernels' threads do not survive a fork
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_end_with, initargs=(os.getpid(),)) as pool:
        settings = [list(each) for _, each in groupby(waiting, lambda work: work.setting())]
        parts = [setting[at : at + TOGETHER] for setting in settings for at in range(0, len(setting), TOGETHER)]
        made = [pool.submit(_setting, part, expose, within) for part in parts]
        try:
            for future in as_completed(made):
                yield from future.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _end_with(parent: int) -> None:
    """Have this process end when ``parent`` is gone: one that is killed cannot tell its workers, which hold a queue."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOKS)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _setting(groups: Sequence[Work], expose: Callable[[Work], list[Record]], within: Path) -> list[list[Record]]:
    """The records of each of ``groups``, one after the other in one process, kept as soon as they are made."""
    found = []
    for group in groups:
        records = expose(group)
        write_text(within / f"{group.key()}.json", json.dumps(records))
        found.append(records)
    return found
