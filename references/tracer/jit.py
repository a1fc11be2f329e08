"""The decorator of every kernel: compiled once, cached on disk, never stale.

Numba's own cache looks only at the file of the function itself, so a kernel that inlines another file's function would
keep the old code. Here the cache folder is named after a hash of all the kernels' sources.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from filelock import FileLock

from notabug.references.cache import cache_root, source_hash

_KEPT = 3  # caches of this many source versions stay on disk


def _folder() -> Path:
    root = cache_root() / "kernels"
    folder = root / source_hash(Path(__file__).parent)
    folder.mkdir(parents=True, exist_ok=True)
    old = sorted((each for each in root.iterdir() if each != folder), key=lambda each: each.stat().st_mtime)
    for each in old[: max(0, len(old) - _KEPT + 1)]:
        shutil.rmtree(each, ignore_errors=True)
    return folder


_FOLDER = _folder()
_compiled: set[str] = set()


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile ``function`` on first use: no fastmath, no contraction to FMA, releases the GIL, IEEE division.

    It counts no references to arrays, which would take more than half of the tracer's time, and more where two threads
    change the same count; so it cannot allocate any: its work space comes from the caller.
    """
    return _compile(function, _nrt=False)


def allocating(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as ``kernel`` does a ``function`` that makes arrays: one that is called once a picture."""
    return _compile(function)


def _compile(function: Callable[..., Any], **switches: bool) -> Callable[..., Any]:
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(_FOLDER)
    try:
        compiled: Callable[..., Any] = numba.njit(cache=True, nogil=True, error_model="numpy", **switches)(function)
        return compiled
    finally:
        numba.config.CACHE_DIR = before


def compile_once(name: str, call: Callable[[], object]) -> None:
    """Let ``call`` compile the kernel of that ``name``, in one process at a time: the next one finds it on the disk."""
    if name not in _compiled:
        with FileLock(_FOLDER / f"{name}.lock"):
            call()
        _compiled.add(name)
