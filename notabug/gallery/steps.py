"""How far the building of a gallery is: a bar on a terminal, a line at each tenth of the way in a log."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Protocol, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from notabug.results.wording import duration

T = TypeVar("T")
_LINES = 10  # of a log, for each part of the work


class Steps(Protocol):
    """Goes through ``items`` and tells how far it is with ``what``."""

    def __call__(self, items: Sequence[T], what: str) -> Iterable[T]: ...


def silent(items: Sequence[T], what: str) -> Iterable[T]:
    """Tells nothing."""
    del what
    return items


def told_on(console: Console, clock: Callable[[], float] = time.monotonic) -> Steps:
    """Tells on ``console``."""

    def steps(items: Sequence[T], what: str) -> Iterator[T]:
        return _bar(items, what, console) if console.is_terminal else _log(items, what, console, clock)

    return steps


def _bar(items: Sequence[T], what: str, console: Console) -> Iterator[T]:
    columns = (BarColumn(12), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    with Progress(TextColumn("{task.description}"), *columns, console=console, transient=True) as bar:
        yield from bar.track(items, description=what)


def _log(items: Sequence[T], what: str, console: Console, clock: Callable[[], float]) -> Iterator[T]:
    begun, tenth = clock(), 0
    for done, item in enumerate(items, 1):
        yield item
        if done * _LINES // len(items) > tenth and done < len(items):
            tenth = done * _LINES // len(items)
            left = duration((clock() - begun) / done * (len(items) - done))
            console.print(f"{what}: {done} of {len(items)}, {left} left", markup=False, soft_wrap=True)
