"""Scenes from outside the corpus are data of unknown making: what they may refer to, and what reading them may cost.

Two fences. A scene may name only files below its own folder: layers, payloads, textures. And it is first read in a
child process with a limit of time and of memory, since nesting without end, arrays without end and prims that double
at each level end OpenUSD's parser or this process before any check could. A scene that has passed is remembered by its
contents.

``NOTABUG_TRUST`` names a folder (or several, as in PATH) whose scenes pass both fences unseen.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any

from notabug.scenes_usd.errors import SceneError

TRUST = "NOTABUG_TRUST"
SECONDS = 30  # of processor time in the child, and twice as many on the clock
MEMORY = 4 << 30  # bytes of address space in the child
FILE = 256 << 20  # bytes of one layer
LAYERS = 256
LOOKED_AT = 5000  # files beside a scene


def is_trusted(path: Path) -> bool:
    """Whether ``path``, resolved, is the corpus's or below a folder that ``NOTABUG_TRUST`` names."""
    corpus = Path(__file__).resolve().parent
    named = [Path(each).resolve() for each in os.environ.get(TRUST, "").split(os.pathsep) if each]
    return any(path.is_relative_to(each) for each in (corpus, *named))


def check_scene(path: Path) -> None:
    """Raise SceneError where reading ``path``, which is resolved, would harm; by a child, unless it is known."""
    if not is_trusted(path):
        seen = path.stat()
        _read_once(path, seen.st_size, seen.st_mtime_ns)


@lru_cache(maxsize=4096)
def _read_once(path: Path, _size: int, _changed: int) -> None:
    """Let a child read ``path`` unless its mark is there; asked once for each state of the file."""
    _check_size(path)
    mark = _mark(path)
    if mark is not None and mark.is_file():
        return
    command = [sys.executable, "-P", "-m", "notabug.scenes_usd.untrusted_child", str(path)]
    try:
        ended = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=2 * SECONDS, cwd=path.parent, check=False
        )
        got = f"exit state {ended.returncode}" if ended.returncode else ""
    except subprocess.TimeoutExpired:
        got = f"no end after {2 * SECONDS} s"
    if got:
        raise SceneError(
            "reading this file ends its reader: nested too deep, or too large",
            where=str(path),
            expected=f"{SECONDS} s and {MEMORY >> 30} GiB to be enough",
            got=got,
            do=f"make it smaller; or set {TRUST} to its folder where you trust it",
        )
    if mark is not None:
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.touch()


def check_layers(path: Path) -> None:
    """Raise SceneError where the layers of ``path`` name files outside its folder. Layers are opened, not composed."""
    from pxr import Sdf, Tf

    root = path.parent
    waiting, seen = [str(path)], set[str]()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        if len(seen) > LAYERS:
            raise SceneError("too many layers", where=str(path), expected=f"at most {LAYERS}")
        outer = Path(_outer(name))
        if not outer.is_file():
            continue  # composing says so
        check_inside(outer, root, where=str(path))
        _check_size(outer)
        try:
            layer = Sdf.Layer.FindOrOpen(name)
        except Tf.ErrorException:
            continue  # composing says so
        if layer is None:
            continue
        named = {*layer.GetCompositionAssetDependencies(), *layer.GetExternalAssetDependencies()}
        for each in named - {""}:
            if "://" in each:
                raise SceneError("a scene may name only files", where=name, got=each)
            resolved = layer.ComputeAbsolutePath(each)
            check_inside(Path(_outer(resolved)), root, where=name, got=each)
            waiting.append(resolved)


def check_inside(file: Path, root: Path, *, where: str, got: str = "") -> None:
    """Raise SceneError where ``file``, links followed, is not below the folder ``root``."""
    if not file.resolve().is_relative_to(root.resolve()):
        raise SceneError(
            "a file outside of the scene's folder",
            where=where,
            expected=f"below {root}",
            got=got or str(file),
            do=f"copy it there; or set {TRUST} to a folder that holds both",
        )


def _outer(name: str) -> str:
    """The file that holds ``name``: the package of a path such as ``a.usdz[b.usd]``."""
    from pxr import Ar

    return str(Ar.SplitPackageRelativePathOuter(name)[0]) if Ar.IsPackageRelativePath(name) else name


def _check_size(path: Path) -> None:
    size = path.stat().st_size
    if size > FILE:
        raise SceneError("the file is too large", where=str(path), expected=f"at most {FILE >> 20} MiB", got=str(size))


def _mark(path: Path) -> Path | None:
    """A file in the cache that stands for ``path`` with the contents that it and its folder have now.

    None where the folder holds so much that looking through it would take longer than reading the scene.
    """
    import platformdirs

    state: Any = hashlib.blake2b(path.read_bytes(), digest_size=16)
    state.update(str(path).encode("utf-8", "surrogateescape"))
    count = 0
    for inner, folders, files in os.walk(path.parent):
        count += len(files) + len(folders)
        if count > LOOKED_AT:
            return None
        folders.sort()
        for name in sorted(files):
            if name.endswith((".usd", ".usda", ".usdc", ".usdz")):
                seen = (Path(inner) / name).lstat()
                state.update(f"{inner}/{name} {seen.st_size} {seen.st_mtime_ns}".encode("utf-8", "surrogateescape"))
    cache = Path(os.environ.get("NOTABUG_CACHE") or platformdirs.user_cache_dir("notabug"))
    return cache / "scenes" / str(state.hexdigest())
