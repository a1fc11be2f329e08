"""The folder of everything that can be computed again, on any machine: where there is none a temporary one will do."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

import platformdirs

from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.ownership import how_to_allow, why_foreign

VARIABLE = "NOTABUG_CACHE"


class CacheError(NotabugError):
    """The folder that ``NOTABUG_CACHE`` names cannot be used."""


def cache_root() -> Path:
    """The folder of everything notabug can recompute: ``$NOTABUG_CACHE``, or the user's cache folder.

    It is there and can be written to. A user may have no home and a container no place to write: then a temporary
    folder takes its place until this process ends, and a line on standard error says so. But a folder that somebody
    chose is expected to keep what is put there: where it cannot, that is an error.
    """
    chosen = os.environ.get(VARIABLE, "")
    return _writable(chosen) if chosen else _usual(platformdirs.user_cache_dir("notabug"))


@lru_cache(maxsize=16)
def _writable(chosen: str) -> Path:
    reason = _why_not(Path(chosen))
    if reason:
        raise CacheError(
            "the cache cannot be used",
            where=f"{VARIABLE}={chosen}",
            expected="a folder in which files can be made",
            got=reason,
            do=f"set {VARIABLE} to another folder, or unset it",
        )
    return Path(chosen)


@lru_cache(maxsize=16)
def _usual(name: str) -> Path:
    folder = Path(name)
    reason = _why_not(folder) if folder.is_absolute() else "the user has no home"  # "~" stays where there is none
    if not reason:
        return folder
    instead = tempfile.mkdtemp(prefix="notabug-cache-")
    atexit.register(_remove, instead, os.getpid())
    os.environ[VARIABLE] = instead  # for the processes that this one starts
    print(
        f"notabug: cannot use the cache {folder} ({reason}); using {instead} for now, so that every run starts"
        f" anew: set {VARIABLE} to a folder that lasts",
        file=sys.stderr,
    )
    return Path(instead)


def _why_not(folder: Path) -> str:
    """Why ``folder`` cannot be used, as no file can be made there or others could have put files there, or ""."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if why := why_foreign(folder):
            return f"{why}: {how_to_allow(folder)}"
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        return error.strerror or str(error)


def _remove(folder: str, process: int) -> None:
    if os.getpid() == process:  # and not a child that was forked
        shutil.rmtree(folder, ignore_errors=True)
