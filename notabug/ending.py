"""How the program ends when it is stopped or fails: exit code, one line on standard error, and the trace in a file.

Only the standard library is imported: this must work where nothing else does.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterator
from types import FrameType

INTERNAL = 70  # EX_SOFTWARE of sysexits.h, as in exit_codes.py


class Stopped(BaseException):
    """A signal asked this process to end: like KeyboardInterrupt no ``except Exception`` catches it."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def exit_state(error: BaseException) -> int:
    """The exit code of a process that ``error``, a Stopped or a KeyboardInterrupt, ended, as shells count: 130, 143."""
    return 128 + (error.number if isinstance(error, Stopped) else signal.SIGINT)


@contextlib.contextmanager
def signals_as_exceptions() -> Iterator[None]:
    """SIGTERM and SIGHUP raise Stopped in here, as SIGINT raises KeyboardInterrupt: what is open is closed in order."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # a SIGHUP that is ignored, as by nohup, stays ignored
    before = {each: signal.signal(each, _stop) for each in numbers if signal.getsignal(each) is not signal.SIG_IGN}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop(number: int, frame: FrameType | None) -> None:
    del frame
    raise Stopped(number)


def report_defect(error: BaseException) -> int:
    """Tell in one line of a defect of notabug; the exit code. 1, Python's own, would tell of a renderer's bug."""
    what = f"{type(error).__name__}: {' '.join(str(error).split())}"
    with contextlib.suppress(OSError, ValueError):
        sys.stderr.write(f"notabug: internal error: {what}; please report it {saved_trace(error)}\n")
    return INTERNAL


def saved_trace(error: BaseException) -> str:
    """Where the trace of ``error`` was saved; the trace itself where nothing can be written."""
    trace = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="notabug-", suffix=".log", delete=False, encoding="utf-8", errors="backslashreplace"
        ) as log:
            log.write(f"{sys.argv}\n{trace}")
            return f"with the trace in {log.name}"
    except OSError:
        return f"with the trace\n{trace}"
