"""Children: a renderer runs in its own process group, within limits, and leaves only its exit state and its log.

A renderer may abort, hang, print gigabytes, eat the memory, fill the disk or start children of its own that detach;
none of that may harm the run it is part of.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal

import psutil

from notabug.adapters.base import RendererError
from notabug.adapters.process_tree import MARK, Tree, adopt_orphans
from notabug.adapters.trees import replaced, size, states

LOG_BYTES = 1 << 16  # of a longer log the last bytes are kept: that is where the reason for a failure stands
_QUOTED_LINES = 12  # of the log, in an error's message
_QUOTED = 200  # characters of each
_DRAIN = 2.0  # seconds to read what is left in the pipe of a child that has ended
_GRACE = 1.0  # seconds between asking a child to end and ending it
_LOOK = 0.1  # seconds from one look at a child's memory, processor time and files to the next
_OUTPUT = 4 << 30  # bytes that a job may write where nothing else is said

_KEEPER = Path(__file__).with_name("keeper.py")  # a program, which only Linux could import

Stopped = Literal["", "time", "cpu", "memory", "output"]


@dataclass(frozen=True, slots=True)
class Limits:
    """What a child and all that it starts may use together. 0 stands for no limit.

    Attributes
    ----------
    cpu : seconds of processor time.
    memory : bytes resident; at 0, nine tenths of the machine's.
    output : bytes in the child's folder, and in any one file that it writes anywhere.
    """

    cpu: float = 0.0
    memory: int = 0
    output: int = _OUTPUT


DEFAULT = Limits()


@dataclass(frozen=True, slots=True)
class Ended:
    """How a child ended. ``exit`` is the exit code, negative for the signal that ended it; ``log`` its output.

    ``stopped`` names the limit at which it was stopped, "" where it ended by itself.
    """

    command: tuple[str, ...]
    exit: int
    stopped: Stopped
    seconds: float
    log: str

    @property
    def timed_out(self) -> bool:
        return self.stopped == "time"

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
        program = Path(self.command[0]).name
        if self.stopped:
            what, advice = _LIMIT[self.stopped]
            raise failure(
                f"{program} was stopped after {self.seconds:.1f} s, {what}", where=where, log=self.log, do=do or advice
            )
        if self.exit:
            got = self.signal or f"exit code {self.exit}"
            raise failure(f"{program} failed", where=where, got=got, log=self.log, do=do)
        return self


_LIMIT: dict[str, tuple[str, str]] = {
    "time": ("its time limit", "raise the time limit (timeout), or render fewer samples"),
    "cpu": ("its limit of processor time", "raise the limit (cpu), or render fewer samples"),
    "memory": ("its memory limit", "raise the limit (memory), or correct the renderer"),
    "output": ("its output limit", "raise the limit (output), or correct the renderer"),
}


def failure(what: str, *, where: str, expected: str = "", got: str = "", log: str = "", do: str = "") -> RendererError:
    """A RendererError that quotes the last lines of ``log`` and carries all of it."""
    lines = [line.rstrip()[-_QUOTED:] for line in log.splitlines() if line.strip()][-_QUOTED_LINES:]
    quoted = "".join(f"\n  | {line}" for line in lines)
    do = (do or ("see what it printed" if lines else "")) + quoted
    error = RendererError(what, where=f"adapter {where!r}", expected=expected, got=got, do=do)
    error.log = log
    return error


def run_child(
    command: Sequence[str],
    *,
    where: str,
    folder: Path,
    timeout: float,
    environment: Mapping[str, str] | None = None,
    limits: Limits = DEFAULT,
) -> Ended:
    """Run ``command`` (a list: nothing is ever read by a shell) in ``folder`` and wait at most ``timeout`` seconds.

    ``environment`` is added to this process's own. Whatever the child has started and still runs when the child ends,
    or when the wait is interrupted, is killed, also what has left its process group. Only a child that cannot be
    started is an error here; the caller looks at the exit with ``Ended.check``.
    """
    adopt_orphans()
    tree, before = Tree(), states(folder.absolute())[1:]
    started = time.perf_counter()
    child, told = start_child(command, folder, {**(environment or {}), MARK: tree.mark}, limits, where=where)
    tree.root = child.pid
    assert child.stdout is not None
    log = Log(child.stdout)
    try:
        stopped = _watch(child, log, tree, folder, started + timeout, limits)
    finally:
        if child.poll() is None:
            ask_to_end(child)
        kill_group(child.pid)
        child.wait()
        tree.kill()
        log.drain()
        said = told.read().split()
        told.close()
    if said[:1] == ["failed"]:
        raise not_started(command, where, os.strerror(int(said[1])))
    code = os.waitstatus_to_exitcode(int(said[1])) if said else child.returncode
    seconds = float(said[2]) if said else time.perf_counter() - started
    if gone := replaced(before):
        raise failure(
            f"it replaced a folder of the run, {gone}", where=where, log=log.text(), do="correct the renderer"
        )
    if not stopped and limits.output and size(folder, limits.output) >= limits.output:
        stopped = "output"  # the system let no more be written, and the child may have taken it for any error
    elif not stopped and code == -signal.SIGXCPU:
        stopped = "cpu"
    return Ended(tuple(command), code, stopped, seconds, log.text())


def start_child(
    command: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    limits: Limits,
    *,
    where: str,
    stdin: int = subprocess.DEVNULL,
    stderr: int = subprocess.STDOUT,
) -> tuple[subprocess.Popen[bytes], IO[str]]:
    """``command`` as a process, and what its keeper tells of its end; no word where the system has no keeper.

    ``environment`` is added to this process's own. What the child leaves among temporary files goes with ``folder``:
    Blender's are there still when it is killed.
    """
    whole = {**os.environ, "TMPDIR": str(folder.absolute()), **environment}
    try:
        return _start(command, folder, whole, limits, stdin, stderr)
    except (OSError, ValueError) as error:  # ValueError: a null byte
        raise not_started(command, where, getattr(error, "strerror", None) or str(error)) from error


def _start(
    command: Sequence[str], folder: Path, environment: Mapping[str, str], limits: Limits, stdin: int, stderr: int
) -> tuple[subprocess.Popen[bytes], IO[str]]:
    has_keeper = sys.platform.startswith("linux") and bool(sys.executable)
    words, told, tell = list(command), *os.pipe()
    try:
        if has_keeper:
            numbers = (os.getpid(), tell, limits.output, int(limits.cpu) + 1 if limits.cpu else 0)
            words = [sys.executable, "-I", "-S", str(_KEEPER), *map(str, numbers), *words]
        child = subprocess.Popen(
            words,
            cwd=folder,
            env=environment,
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=stderr,
            start_new_session=True,
            pass_fds=(tell,) if has_keeper else (),
        )
    except BaseException:
        os.close(told)
        raise
    finally:
        os.close(tell)
    return child, os.fdopen(told, encoding="ascii")


def not_started(command: Sequence[str], where: str, got: str) -> RendererError:
    """The error of a program that the system could not start."""
    return failure(f"cannot start {command[0]}", where=where, got=got, do="is it executable?")


def made_picture(path: Path, *, where: str, log: str) -> Path:
    """``path``, where the renderer left a file there; a renderer that says it succeeded and did not is an error.

    The folder must have been fresh, so that a file there cannot be an older run's.
    """
    if not path.is_file() or path.stat().st_size == 0:
        raise failure("the renderer ended without an error but left no picture", where=where, got="no file", log=log)
    return path


class Log:
    """The last LOG_BYTES of what a child printed."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self.pipe, self.tail, self.open = pipe, bytearray(), True

    def read(self) -> None:
        chunk = os.read(self.pipe.fileno(), 1 << 16)
        self.open = bool(chunk)
        self.tail += chunk
        del self.tail[:-LOG_BYTES]

    def wait(self, seconds: float) -> None:
        """Read what there is, after at most ``seconds`` without any."""
        with selectors.DefaultSelector() as ready:
            ready.register(self.pipe, selectors.EVENT_READ)
            if ready.select(max(0.0, seconds)):
                self.read()

    def drain(self) -> None:
        """Read what is left; a process out of reach may hold the pipe open: it is not waited for."""
        end = time.perf_counter() + _DRAIN
        with selectors.DefaultSelector() as ready:
            ready.register(self.pipe, selectors.EVENT_READ)
            while self.open and ready.select(max(0.0, end - time.perf_counter())):
                self.read()
        self.pipe.close()

    def text(self) -> str:
        return bytes(self.tail).decode("utf-8", "replace")


def _watch(
    child: subprocess.Popen[bytes], log: Log, tree: Tree, folder: Path, deadline: float, limits: Limits
) -> Stopped:
    """Wait for ``child`` while reading its output; the limit that it broke, or ""."""
    look = time.perf_counter() + _LOOK
    with selectors.DefaultSelector() as ready, contextlib.ExitStack() as closing:
        ready.register(log.pipe, selectors.EVENT_READ)
        pause = _LOOK
        if sys.platform.startswith("linux"):  # wakes at once; elsewhere the end is looked for
            end = os.pidfd_open(child.pid)
            closing.callback(os.close, end)
            ready.register(end, selectors.EVENT_READ)
        else:
            pause = 0.01
        while child.poll() is None:
            now = time.perf_counter()
            if now >= deadline:
                return "time"
            if now >= look:
                broken = broken_limit(tree, folder, limits)
                if broken:
                    return broken
                look = time.perf_counter() + _LOOK
            for key, _ in ready.select(max(0.0, min(deadline, look, now + pause) - now)):
                if key.fileobj is log.pipe:
                    log.read()
                    if not log.open:
                        ready.unregister(log.pipe)
    return ""


def broken_limit(tree: Tree, folder: Path, limits: Limits) -> Stopped:
    """The limit that the job is beyond, or ""."""
    memory, seconds = tree.usage()
    if memory > (limits.memory or 0.9 * psutil.virtual_memory().total):
        return "memory"
    if limits.cpu and seconds > limits.cpu:
        return "cpu"
    return "output" if limits.output and size(folder, limits.output) > limits.output else ""


def ask_to_end(child: subprocess.Popen[bytes]) -> None:
    """SIGTERM, so that a renderer may tidy up; one that does not listen is killed."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGTERM)
    with contextlib.suppress(subprocess.TimeoutExpired):
        child.wait(2.0 * _GRACE)  # its keeper gives it one, and then kills


def kill_group(leader: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)
