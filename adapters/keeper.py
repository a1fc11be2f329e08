"""The process between notabug and a renderer, on Linux: nothing that it starts outlives it, whoever ends first.

``python -I -S keeper.py PARENT STATUS OUTPUT CPU PROGRAM...`` runs PROGRAM and, when that ends, ends all that it left.
When PARENT, a process id, is gone, however it went, everything ends as well. Orphans come here, however far they
detached, since this process is their reaper (PR_SET_CHILD_SUBREAPER); should it be killed, the renderer is too
(PR_SET_PDEATHSIG).

OUTPUT and CPU are limits in bytes of a file and in seconds that the system keeps; 0: none. To the open file STATUS goes
``ended WAIT_STATUS SECONDS``, or ``failed ERRNO`` where PROGRAM could not be started. Only the standard library is
imported, and little of it, for this starts with every job.
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
import time

_SET_PDEATHSIG, _SET_CHILD_SUBREAPER = 1, 36  # of prctl(2)
_GRACE = 1.0  # seconds in which a renderer that is asked to end may tidy up
_PAUSE = 0.01


def main() -> None:
    parent, status, output, cpu = map(int, sys.argv[1:5])
    prctl = ctypes.CDLL(None).prctl
    prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    prctl(_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    if os.getppid() != parent:  # it went before it could be asked for
        return
    os.set_inheritable(status, False)
    began = time.monotonic()
    program = os.fork()
    if program == 0:
        _become(prctl, status, output, cpu)
    _let_go()
    signal.signal(signal.SIGCHLD, lambda *_: None)  # so that it wakes what waits for signals
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGCHLD})
    ended = _wait(program, None)
    if ended is None:  # asked to end
        _signal_group(program, signal.SIGTERM)
        ended = _wait(program, _GRACE)
    seconds = time.monotonic() - began
    _signal_group(program, signal.SIGKILL)
    ended = _end_all(program, ended)
    os.write(status, f"ended {ended} {seconds:.6f}\n".encode())


def _become(prctl: ctypes._NamedFuncPointer, status: int, output: int, cpu: int) -> None:
    """Become the program, in a group of its own; the session is this process's, by which its dead are known."""
    try:
        prctl(_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        os.setpgid(0, 0)
        if output:
            _limit(resource.RLIMIT_FSIZE, output, output)
        if cpu:
            _limit(resource.RLIMIT_CPU, cpu, cpu + 1)
        for each in (signal.SIGPIPE, signal.SIGXFSZ):  # which Python ignores, and a program would inherit that
            signal.signal(each, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, set())
        os.execvp(sys.argv[5], sys.argv[5:])  # noqa: S606 - that is what it is for
    except OSError as error:
        os.write(status, f"failed {error.errno}\n".encode())
    finally:
        os._exit(127)


def _let_go() -> None:
    """Hold neither end of the program's pipes: who reads them sees that the program has closed its own."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for pipe in (0, 1):
        os.dup2(nothing, pipe)
    os.close(nothing)


def _limit(kind: int, soft: int, hard: int) -> None:
    """Set a limit, but none above one that is there already."""
    there = resource.getrlimit(kind)[1]
    if there != resource.RLIM_INFINITY:
        soft, hard = min(soft, there), min(hard, there)
    resource.setrlimit(kind, (soft, hard))


def _wait(program: int, seconds: float | None) -> int | None:
    """The wait status of ``program`` when it has ended; None after a SIGTERM, or after ``seconds``."""
    end = None if seconds is None else time.monotonic() + seconds
    while True:
        try:
            while True:
                pid, status = os.waitpid(-1, os.WNOHANG)  # an orphan that ended is collected as well
                if pid == program:
                    return status
                if pid == 0:
                    break
        except ChildProcessError:
            return None
        if end is None:
            if signal.sigwait({signal.SIGTERM, signal.SIGCHLD}) == signal.SIGTERM:
                return None
        elif time.monotonic() >= end:
            return None
        else:
            time.sleep(_PAUSE)


def _end_all(program: int, ended: int | None) -> int:
    """Kill and collect every child, and what becomes one by that; the wait status of ``program``."""
    while True:
        for pid in _children():
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        try:
            pid, status = os.waitpid(-1, 0)
        except ChildProcessError:
            return ended if ended is not None else signal.SIGKILL
        if pid == program:
            ended = status


def _children() -> list[int]:
    """The live children of this process, by the process table."""
    own, found = os.getpid(), []
    for name in os.listdir("/proc"):  # noqa: PTH208 - pathlib takes longer to import than all of this
        if name.isdecimal():
            try:
                with open(f"/proc/{name}/stat", "rb") as file:  # noqa: PTH123
                    fields = file.read().rpartition(b")")[2].split()
            except OSError:
                continue
            if int(fields[1]) == own and fields[0] != b"Z":
                found.append(int(name))
    return found


def _signal_group(program: int, number: int) -> None:
    try:
        os.killpg(program, number)
    except (ProcessLookupError, PermissionError):
        return


if __name__ == "__main__":
    main()
