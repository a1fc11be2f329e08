"""Children: a renderer runs in its own process group, with a time limit, and leaves only its exit state and its log.

A renderer may abort, hang, print gigabytes or start children of its own; none of that may harm the run it is part of.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from notabug.adapters.base import RendererError

LOG_BYTES = 1 << 16  # of a longer log the last bytes are kept: that is where the reason for a failure stands
_QUOTED_LINES = 12  # of the log, in an error's message
_DRAIN = 2.0  # seconds to read what is left in the pipe of a child that has ended


@dataclass(frozen=True, slots=True)
class Ended:
    """How a child ended. ``exit`` is the exit code, negative for the signal that ended it; ``log`` its output."""

    command: tuple[str, ...]
    exit: int
    timed_out: bool
    seconds: float
    log: str

    @property
    def signal(self) -> str:
        """The name of the signal that ended the child ("SIGABRT"), or "" where it exited."""
        if self.exit >= 0:
            return ""
        try:
            return signal.Signals(-self.exit).name
        except ValueError:
            return f"signal {-self.exit}"

    def check(self, where: str, do: str = "") -> Ended:
        """This, where the child succeeded; raises RendererError in the name of the adapter ``where`` if not."""
        if self.timed_out:
            raise failure(
                f"{_program(self)} was stopped after {self.seconds:.1f} s, its time limit",
                where=where,
                log=self.log,
                do=do or "raise the time limit (Quality.timeout), or render fewer samples",
            )
        if self.exit:
            got = f"{self.signal}" if self.signal else f"exit code {self.exit}"
            raise failure(f"{_program(self)} failed", where=where, got=got, log=self.log, do=do)
        return self


def failure(what: str, *, where: str, got: str = "", log: str = "", do: str = "") -> RendererError:
    """A RendererError that quotes the last lines of ``log`` and carries all of it."""
    lines = [line.rstrip() for line in log.splitlines() if line.strip()][-_QUOTED_LINES:]
    quoted = "".join(f"\n  | {line}" for line in lines)
    error = RendererError(what, where=f"adapter {where!r}", got=got, do=(do or "see its log") + quoted)
    error.log = log
    return error


def run_child(
    command: Sequence[str],
    *,
    where: str,
    folder: Path,
    timeout: float,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run ``command`` (a list: nothing is ever read by a shell) in ``folder`` and wait at most ``timeout`` seconds.

    ``environment`` is added to this process's own. Whatever the child's group still runs when the child ends, or when
    the wait is interrupted, is killed. Only a child that cannot be started is an error here; the caller looks at the
    exit with ``Ended.check``.
    """
    started = time.perf_counter()
    try:
        child = subprocess.Popen(
            list(command),
            cwd=folder,
            env={**os.environ, **(environment or {})},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    except OSError as error:
        raise failure(
            f"cannot start {command[0]}", where=where, got=error.strerror or str(error), do="is it executable?"
        ) from error
    tail = bytearray()
    assert child.stdout is not None
    reader = threading.Thread(target=_keep_tail, args=(child.stdout.fileno(), tail), daemon=True)
    reader.start()
    timed_out = False
    try:
        child.wait(timeout)
    except subprocess.TimeoutExpired:
        timed_out = True
    finally:
        _kill_group(child.pid)
        child.wait()
        reader.join(_DRAIN)  # an escaped grandchild may hold the pipe open: do not wait for it
        if not reader.is_alive():
            child.stdout.close()
    seconds = time.perf_counter() - started
    return Ended(tuple(command), child.returncode, timed_out, seconds, bytes(tail).decode("utf-8", "replace"))


def made_picture(path: Path, *, where: str, log: str) -> Path:
    """``path``, where the renderer left a file there; a renderer that says it succeeded and did not is an error.

    The folder must have been fresh, so that a file there cannot be an older run's.
    """
    if not path.is_file() or path.stat().st_size == 0:
        raise failure("the renderer ended without an error but left no picture", where=where, got="no file", log=log)
    return path


def _program(ended: Ended) -> str:
    return Path(ended.command[0]).name


def _keep_tail(pipe: int, tail: bytearray) -> None:
    """Read ``pipe`` to its end and keep the last LOG_BYTES in ``tail``."""
    while chunk := os.read(pipe, 1 << 16):
        tail += chunk
        del tail[:-LOG_BYTES]


def _kill_group(leader: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)
