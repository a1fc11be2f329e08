"""Beside the steps of docs/judge.md: what the judge is doing, for whoever waits for it.

A picture of a scene with large lights takes seconds to predict, and a judgement may need dozens. Each step says what it
begins; who listens decides what is shown. Nothing here changes a verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str], object]

_LISTENER: ContextVar[Listener | None] = ContextVar("listener", default=None)


def doing(what: str) -> None:
    """Tell whoever listens ``what`` is begun now."""
    listener = _LISTENER.get()
    if listener is not None:
        listener(what)


@contextmanager
def telling(listener: Listener) -> Iterator[None]:
    """Let ``listener`` hear of every step until the end of the block."""
    before = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(before)
