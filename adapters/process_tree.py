"""The processes that one job has started, however far they went: children, their children, and those that detached.

A process that detaches is handed to init, out of reach, unless an ancestor has asked for orphans: on Linux this process
does. Which job an orphan belongs to is known from a mark in the environment that every child inherits. Elsewhere, and
where a program starts another with an empty environment, only the process group and the live tree are found.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import secrets
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import psutil

MARK = "NOTABUG_JOB"
_SET_CHILD_SUBREAPER = 36  # of prctl(2)
_ROUNDS = 100  # of killing: a program that forks while it dies needs more than one
_PAUSE = 0.01


@cache
def adopt_orphans() -> bool:
    """Make orphans below this process its own children, once; False where the system has no such thing."""
    if platform.system() != "Linux":
        return False
    library = ctypes.CDLL(None, use_errno=True)
    asked: int = library.prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    return asked == 0


@dataclass(slots=True)
class Tree:
    """The processes of one job: those whose environment holds ``mark``, and whatever was seen below ``root``."""

    mark: str = field(default_factory=lambda: secrets.token_hex(8))
    root: int = 0
    seen: dict[int, psutil.Process] = field(default_factory=dict)

    def members(self, *, quickly: bool = False) -> list[psutil.Process]:
        """Every live process of the job; takes some 3 ms, more on a busy machine: the whole process table is read.

        ``quickly`` asks Linux for the children of each process instead, which may leave one out that starts or ends
        meanwhile: good enough for a look that is soon followed by another.
        """
        known = {self.root} | self.seen.keys()
        with contextlib.suppress(psutil.Error):
            below = _told_below(os.getpid()) if quickly else None
            for child in psutil.Process().children(recursive=True) if below is None else below:
                if self._is_ours(child, known):
                    known.add(child.pid)
                    self.seen[child.pid] = child
        return [each for each in self.seen.values() if _is_live(each)]

    def _is_ours(self, process: psutil.Process, known: set[int]) -> bool:
        if process.pid in known:
            return True
        try:
            return process.ppid() in known or process.environ().get(MARK) == self.mark
        except psutil.Error:
            return False

    def usage(self) -> tuple[int, float]:
        """Resident bytes and seconds of processor time of all live members, with the children they waited for."""
        memory, seconds = 0, 0.0
        for member in self.members(quickly=True):
            with contextlib.suppress(psutil.Error):
                memory += member.memory_info().rss
                seconds += sum(member.cpu_times()[:4])  # user, system, and both of the children
        return memory, seconds

    def kill(self) -> None:
        """Kill every member and collect the adopted ones; the root is left for its owner to wait for."""
        if _childless():
            return
        for _ in range(_ROUNDS):
            live = [member for member in self.members() if member.pid != self.root]
            if not live:
                self._collect()
                return
            for each in live:
                with contextlib.suppress(psutil.Error):
                    each.kill()
            time.sleep(_PAUSE)
            for each in live:
                with contextlib.suppress(ChildProcessError):  # a grandchild: its parent collects it, or we do next time
                    os.waitpid(each.pid, os.WNOHANG)

    def _collect(self) -> None:
        """Collect the dead that came here since nobody below waited for them: those seen, and those of its session."""
        for child in psutil.Process().children():
            with contextlib.suppress(psutil.Error, OSError):
                dead = child.status() == psutil.STATUS_ZOMBIE and child.pid != self.root
                if dead and (child.pid in self.seen or os.getsid(child.pid) == self.root):
                    os.waitpid(child.pid, os.WNOHANG)


@cache
def _lists_children() -> bool:
    return Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").exists()


def _told_below(parent: int) -> list[psutil.Process] | None:
    """The processes below ``parent`` as the kernel lists them, nearest first; None where it has no such lists."""
    if not _lists_children():
        return None
    found: list[psutil.Process] = []
    waiting = [parent]
    while waiting:
        process = waiting.pop(0)
        for child in _told_children(process):
            with contextlib.suppress(psutil.Error):
                found.append(psutil.Process(child))
                waiting.append(child)
    return found


def _told_children(process: int) -> Iterator[int]:
    """Those of each thread of ``process``; a thread, or all of it, may have ended since it was named."""
    with contextlib.suppress(OSError):
        for thread in Path(f"/proc/{process}/task").iterdir():
            with contextlib.suppress(OSError):
                yield from map(int, (thread / "children").read_text("ascii").split())


def _childless() -> bool:
    """Whether this process has no child at all, so no orphan either: asked in microseconds, where orphans come here."""
    if not adopt_orphans():
        return False
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return True
    return False


def _is_live(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False
