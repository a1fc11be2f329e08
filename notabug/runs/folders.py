"""Where a job's files go: names from scenes, variants and renderers become folder names that stay inside the run."""

from __future__ import annotations

import hashlib
import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from filelock import FileLock, Timeout

from notabug.adapters.trees import make, remove
from notabug.runs.own_folder import claim
from notabug.scenes_usd.errors import FileError, NotabugError
from notabug.scenes_usd.temporary import remove_left

_UNSAFE = re.compile(r"[^A-Za-z0-9_.,=+-]")
_LONGEST = 80  # characters of one folder name: with its hash well below the 255 bytes that file systems allow


class FolderInUseError(NotabugError):
    """Another run is writing into the folder."""


@contextmanager
def sole_writer(out: Path) -> Iterator[None]:
    """``out``, made if need be, for this run alone. The system drops the lock when a process ends, however it ends."""
    claim(out, "run")
    lock = FileLock(out / ".notabug.lock", blocking=False)
    try:
        lock.acquire()
    except Timeout:
        raise FolderInUseError(
            "another run is writing into this folder", where=str(out), do="wait for it, or choose another with --out"
        ) from None
    except OSError as error:
        raise FileError.of(error, where=str(out), do="choose a folder that can be written to with --out") from error
    try:
        _remove_partial(out)
        remove_left()
        yield
    finally:
        lock.release()


LOCK = ".job.lock"


@contextmanager
def job_lock(folder: Path, out: Path) -> Iterator[None]:
    """The job's ``folder`` below ``out``, made if need be, for one process at a time: of two with one job one waits.

    What an earlier renderer put in its way, such as a link to somewhere else, is removed.
    """
    make(folder, out)
    lock = folder / LOCK
    if lock.is_symlink() or (lock.exists() and not lock.is_file()):
        remove(lock)
    with FileLock(lock):
        _remove_partial(folder)
        yield


def _remove_partial(folder: Path) -> None:
    """Remove the files that a process which was killed had half written there."""
    for path in folder.glob(".*.partial*"):
        remove(path)


def folder_name(text: str) -> str:
    """``text`` as the name of one folder: never empty, hidden, ``..`` or with a separator; unequal texts stay unequal.

    >>> folder_name("tessellation=24x12"), folder_name("")
    ('tessellation=24x12', 'default')
    """
    if not text:
        return "default"
    safe = _UNSAFE.sub("_", text)[:_LONGEST].lstrip(".-") or "_"
    if safe == text:
        return safe
    return f"{safe}-{hashlib.blake2b(text.encode('utf-8', 'surrogatepass'), digest_size=4).hexdigest()}"


def scene_folder(out: Path, scene: str, variant: str) -> Path:
    """``out/<class>/<scene>/<variant>``; a scene from outside the corpus has the class ``own``."""
    group, _, name = scene.partition("/")
    if not name:
        group, name = "own", scene
    return out.joinpath(*(folder_name(part) for part in (group, name, variant)))


def job_folder(out: Path, scene: str, variant: str, renderer: str) -> Path:
    """The ``scene_folder``'s own for ``renderer``."""
    return scene_folder(out, scene, variant) / folder_name(renderer)


def write_json(path: Path, document: object) -> None:
    """Write ``document`` to ``path`` atomically: a reader sees the old file or the new one, never half of it."""
    write_text(path, json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` atomically. No link is followed; surrogates, which are no text, are escaped."""
    number, name = tempfile.mkstemp(prefix=f".{path.name[:_LONGEST]}.", suffix=".partial", dir=path.parent)
    partial = Path(name)
    try:
        with os.fdopen(number, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
        partial.chmod(0o666 & ~_umask())
        partial.replace(path)
    except BaseException as error:
        if isinstance(error, OSError) and error.filename is None:  # of a full disk the system says no place
            error.filename = str(path)
        partial.unlink(missing_ok=True)
        raise


@cache
def _umask() -> int:
    """The process's mask of permissions, which the system tells only who sets it."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
