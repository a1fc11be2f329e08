"""The reading of one stage in hand: what is noted on the way, and the frame that is read.

A fault does not end the reading. It is noted where it is found, a value that harms nothing takes the place of the bad
one, and the reading goes on to the next attribute, so that one look at a file tells all of its faults. Outside of a
reading a fault is raised at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Literal, TypeVar

from notabug.scenes_usd.errors import ManyFaultsError, SceneError
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.view import AS_IT_IS, View

Kind = Literal["approximated", "not read", "out of the contract"]

T = TypeVar("T")
DIRECT_ONLY = "direct light only"  # begins what is said of a light or material of which no more is drawn


@dataclass(frozen=True, slots=True)
class Remark:
    """What a reading says of one prim or attribute.

    ``approximated``: the picture is that of something near it, as ``what`` says. ``not read``: the picture lacks it.
    ``out of the contract``: the scene is refused for it; ``error`` says why.
    """

    kind: Kind
    where: str
    what: str
    error: SceneError | None = None

    @property
    def path(self) -> str:
        """The prim's path."""
        return self.where.partition(".")[0]

    @property
    def mends(self) -> tuple[Opinion, ...]:
        """The opinions that would take the scene into the contract."""
        return self.error.mends if self.error is not None else ()


@dataclass(slots=True)
class Reading:
    """One reading: the ``view`` and what was noted so far, each thing once."""

    view: View = field(default_factory=View)
    remarks: dict[tuple[str, str, str], Remark] = field(default_factory=dict)

    def add(self, remark: Remark) -> None:
        got = remark.error.got if remark.error is not None else ""
        self.remarks.setdefault((remark.where, remark.what, got), remark)

    @property
    def errors(self) -> tuple[SceneError, ...]:
        return tuple(remark.error for remark in self.remarks.values() if remark.error is not None)

    def end(self) -> None:
        """Raise what was found to be out of the contract: one SceneError, or all of them as ManyFaultsError."""
        errors = self.errors
        if len(errors) == 1:
            raise errors[0]
        if errors:
            raise ManyFaultsError(errors)


_in_hand: ContextVar[Reading | None] = ContextVar("reading", default=None)


@contextmanager
def reading(view: View | None = None) -> Iterator[Reading]:
    """A reading that what is called inside adds to."""
    made = Reading(view or AS_IT_IS)
    token = _in_hand.set(made)
    try:
        yield made
    finally:
        _in_hand.reset(token)


def view() -> View:
    """Which picture of the stage is read."""
    now = _in_hand.get()
    return now.view if now is not None else AS_IT_IS


def remarks() -> tuple[Remark, ...]:
    """What has been noted so far."""
    now = _in_hand.get()
    return tuple(now.remarks.values()) if now is not None else ()


def frame() -> float | None:
    """The time code that is read; None where values must not change."""
    return view().time


def note(kind: Kind, where: str, what: str) -> None:
    """Note something that refuses nothing; nothing happens outside of a reading."""
    now = _in_hand.get()
    if now is not None:
        now.add(Remark(kind, where, what))


def refuse(error: SceneError) -> None:
    """Note ``error`` and return; raise it outside of a reading."""
    now = _in_hand.get()
    if now is None:
        raise error
    for part in error.errors if isinstance(error, ManyFaultsError) else (error,):
        # frames hold the stage, and a stage that is held is not read again when its file changes
        part.__traceback__ = part.__context__ = part.__cause__ = None
        now.add(Remark("out of the contract", part.where, part.what, part))


@contextmanager
def going_on() -> Iterator[None]:
    """A fault inside is noted, and the reading goes on after the block; outside of a reading it is raised."""
    try:
        yield
    except SceneError as error:
        refuse(error)


def recovered(read: Callable[[], T], fallback: T) -> T:
    """What ``read`` gives; where it raises a fault that is noted, ``fallback``."""
    try:
        return read()
    except SceneError as error:
        refuse(error)
        return fallback


def each_tried(*looks: Callable[[], object]) -> None:
    """Do all ``looks``, whichever fail: of several faults all but the last are noted, and the last is raised."""
    faults: list[SceneError] = []
    for look in looks:
        try:
            look()
        except SceneError as error:
            faults.append(error)
    for fault in faults[:-1]:
        refuse(fault)
    if faults:
        raise faults[-1]
