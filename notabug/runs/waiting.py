"""What a command says while the judge works: nothing where it is quick, else what it is doing and for how long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.text import Text

from notabug.metrics.telling import telling
from notabug.runs.progress import shortened

PATIENCE = 5.0  # seconds that pass before anything is said
AGAIN = 30.0  # seconds from one line to the next in a log, which keeps them all


@contextmanager
def saying(
    console: Console, subject: str, *, clock: Callable[[], float] = time.monotonic, quiet: bool = False
) -> Iterator[None]:
    """Say on ``console``, from PATIENCE on, what the judge is doing: on a terminal in one line that goes.

    A line names how many pictures have been predicted, so that a reader sees that it goes on, and that it ends.
    """
    begun = clock()
    said = begun + PATIENCE - AGAIN
    predicted = 0
    status = console.status("") if console.is_terminal and not quiet else None
    started = False

    def listener(what: str) -> None:
        nonlocal said, predicted, started
        predicted += what.startswith("predicts")
        now = clock()
        line = f"{subject}: {now - begun:.0f} s, {predicted} pictures predicted so far; {what}"
        if quiet or now - begun < PATIENCE:
            return
        if status is not None:
            status.update(Text(shortened(line, max(20, console.width - 4))))
            if not started:
                started = True
                status.start()
        elif now - said >= AGAIN:
            said = now
            console.print(Text(line, style="dim"), soft_wrap=True)

    try:
        with telling(listener):
            yield
    finally:
        if status is not None and started:
            status.stop()
