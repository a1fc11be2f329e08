"""Folders for temporary files, and processes that end with this one: what a process that is killed cannot tidy up.

A folder is held by a lock, which the system drops however its process ends. Whoever needs a folder next removes those
that nobody holds.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

if sys.platform != "win32":  # which has no such locks: there the system's own tidying must do
    import fcntl

_HELD, _NEW = "notabug-held-", "notabug-new-"  # a folder is new until it is held
_FREE = "notabug-free-"  # where none can be held, and none is removed by others
_SOON = 60.0  # seconds: a new folder that is older was left
_SET_PDEATHSIG = 1  # of prctl(2)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A new folder, gone afterwards; what killed processes have left of theirs goes first."""
    remove_left()
    new = Path(tempfile.mkdtemp(prefix=_NEW))
    with contextlib.ExitStack() as closing:
        prefix = _FREE
        if sys.platform != "win32":
            opened = os.open(new, os.O_RDONLY)
            closing.callback(os.close, opened)
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(opened, fcntl.LOCK_SH)
                prefix = _HELD
        folder = new.rename(new.with_name(new.name.replace(_NEW, prefix, 1)))
        closing.callback(shutil.rmtree, folder, ignore_errors=True)
        yield folder


def remove_left() -> None:
    """Remove the temporary folders of this user that no process holds."""
    if sys.platform == "win32":
        return
    place = Path(tempfile.gettempdir())
    for path in [*place.glob(f"{_HELD}*"), *place.glob(f"{_NEW}*")]:
        with contextlib.suppress(OSError):  # another process may be at it too
            if path.name.startswith(_NEW) and time.time() - path.lstat().st_mtime < _SOON:
                continue
            opened = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                if os.fstat(opened).st_uid == os.geteuid():
                    fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)  # raises where it is held
                    shutil.rmtree(path)
            finally:
                os.close(opened)


def end_with(parent: int) -> None:
    """Have this process killed when the process ``parent``, which started it, ends; on Linux alone."""
    if not sys.platform.startswith("linux"):
        return
    import ctypes

    ctypes.CDLL(None).prctl(_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it went before it could be asked for
        os.kill(os.getpid(), signal.SIGKILL)
