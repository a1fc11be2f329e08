"""Folders that a renderer could write to: how much is in them, whether they are still the same, and their removal.

Nothing here follows a link, and nothing is taken to be shallow: a renderer may leave folders nested thousands deep.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import stat
from pathlib import Path

DEEPEST = 64  # folders below each other, and
MOST = 100_000  # files and folders in all, that a job may leave: more cannot be counted while it runs
_BLOCK = 512  # bytes in which the system counts what a file takes


def size(folder: Path, enough: int) -> int:
    """The bytes that all files below ``folder`` take; counting stops beyond ``enough``.

    More than ``enough`` also where folders are nested deeper than DEEPEST, hold over MOST files, or cannot be read.
    """
    total, entries, beyond, top = 0, 0, False, str(folder).count(os.sep)

    def failed(error: OSError) -> None:
        nonlocal beyond
        beyond = beyond or not isinstance(error, FileNotFoundError)  # which was removed meanwhile

    for inner, folders, files in os.walk(folder, onerror=failed):
        entries += len(folders) + len(files)
        for name in files:
            with contextlib.suppress(OSError):
                total += os.lstat(os.path.join(inner, name)).st_blocks * _BLOCK  # noqa: PTH118 - a path for each is slow
        beyond = beyond or entries > MOST or inner.count(os.sep) - top > DEEPEST
        if total > enough or beyond:
            break
    return enough + 1 if beyond else total


State = tuple[Path, int, int, int]


def states(folder: Path) -> tuple[State, ...]:
    """What tells ``folder`` and each folder above it from another of the same name."""
    return tuple((path, *_identity(path)) for path in (folder, *folder.parents))


def replaced(before: tuple[State, ...]) -> Path | None:
    """The first folder of ``before`` that is no longer the same, as where a link took its place, or None."""
    return next((path for path, *identity in before if [*_identity(path)] != identity), None)


def _identity(path: Path) -> tuple[int, int, int]:
    """Device, number and kind: a link that takes a folder's place may get its number."""
    try:
        seen = os.lstat(path)
    except OSError:
        return 0, 0, 0
    return seen.st_dev, seen.st_ino, stat.S_IFMT(seen.st_mode)


def make(folder: Path, root: Path) -> None:
    """Make ``folder``, which lies below ``root``; what is there in its way, a link or a file, is removed."""
    root.mkdir(parents=True, exist_ok=True)
    place = root
    for name in folder.relative_to(root).parts:
        place /= name
        if place.is_symlink() or (place.exists() and not place.is_dir()):
            place.unlink()
        place.mkdir(exist_ok=True)


def empty(folder: Path, keep: frozenset[str] = frozenset()) -> None:
    """Remove everything in ``folder`` but the files called as ``keep`` says."""
    for path in list(folder.iterdir()):
        if path.name not in keep:
            remove(path)


def remove(path: Path) -> None:
    """Remove ``path``, whatever it is, of any depth; a link is removed and not followed."""
    try:
        is_folder = stat.S_ISDIR(os.lstat(path).st_mode)
    except FileNotFoundError:
        return
    if not is_folder:
        path.unlink()
    elif {os.open, os.unlink, os.rename, os.rmdir} <= os.supports_dir_fd:
        above = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
        try:
            _remove_folders(above, path.name)
        finally:
            os.close(above)
    else:
        shutil.rmtree(path)


def _remove_folders(above: int, name: str) -> None:
    """Remove the folder ``name`` of the open folder ``above``: inner folders first move up, so that none is deep."""
    waiting = [name]
    while waiting:
        name = waiting.pop()
        try:
            opened = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=above)
        except PermissionError:  # a renderer took away the right to read it
            os.chmod(name, 0o700, dir_fd=above)
            opened = os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=above)
        try:
            with os.scandir(opened) as found:
                entries = [(entry.name, entry.is_dir(follow_symlinks=False)) for entry in found]
            if entries and not os.fstat(opened).st_mode & stat.S_IWUSR:
                os.fchmod(opened, 0o700)
            for inner, is_folder in entries:
                if is_folder:
                    moved = f".notabug-{secrets.token_hex(8)}"
                    os.rename(inner, moved, src_dir_fd=opened, dst_dir_fd=above)
                    waiting.append(moved)
                else:
                    os.unlink(inner, dir_fd=opened)
        finally:
            os.close(opened)
        os.rmdir(name, dir_fd=above)
