"""Job folders: each job works in a folder of its own, so no picture of an earlier job can be taken for this one's."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from notabug.adapters.trees import remove


@contextlib.contextmanager
def job_folder(out: Path, name: str, *, keep: bool = False) -> Iterator[Path]:
    """A new folder in ``out`` for one job of the adapter ``name``; removed at the end, kept after an error or on wish.

    It is absolute, since the renderer runs in it. After an error of files, on a full disk, it is not kept: what was
    being written there is half a file.
    """
    folder = Path(tempfile.mkdtemp(prefix=f"{name}-job-", dir=out.resolve()))
    try:
        yield folder
    except OSError:
        _removed(folder)
        raise
    if not keep:
        _removed(folder)


def _removed(folder: Path) -> None:
    with contextlib.suppress(OSError):
        remove(folder)


def picture_path(out: Path, name: str, seed: int) -> Path:
    """Where the picture of the adapter ``name`` for ``seed`` goes; an older one there is removed."""
    path = out / f"{name}-seed{seed}.exr"
    remove(path)
    return path
