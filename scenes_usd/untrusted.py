"""Scenes from outside the corpus are data of unknown making: what they may refer to, and what reading them may cost.

Two fences. A scene may name only files below its own folder: layers, payloads, textures. And it is first read in a
child process with a limit of time and of memory, since nesting without end, arrays without end and prims that double
at each level end OpenUSD's parser or this process before any check could. A scene that has passed is remembered by its
contents and by the states of the layers that it names.

``NOTABUG_TRUST`` names a folder (or several, as in PATH) whose scenes pass both fences unseen.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from notabug.scenes_usd.cache_folder import cache_root
from notabug.scenes_usd.errors import SceneError

TRUST = "NOTABUG_TRUST"
SECONDS = 30  # of processor time in the child, and twice as many on the clock
MEMORY = 4 << 30  # bytes of address space in the child
FILE = 256 << 20  # bytes of one layer
LAYERS = 256
TOGETHER = 32  # scenes that one child reads


def is_trusted(path: Path) -> bool:
    """Whether ``path``, resolved, is the corpus's or below a folder that ``NOTABUG_TRUST`` names."""
    corpus = Path(__file__).resolve().parent
    named = [Path(each).resolve() for each in os.environ.get(TRUST, "").split(os.pathsep) if each]
    return any(path.is_relative_to(each) for each in (corpus, *named))


def check_scenes(paths: Iterable[Path]) -> None:
    """Raise SceneError where reading one of ``paths``, which are resolved, would harm.

    What is not known from before is read by a child: one for many of them, which takes little longer than one for each
    takes to start. Where that goes wrong each is read by a child of its own, which tells the one at fault.
    """
    unknown = [path for path in dict.fromkeys(paths) if not is_trusted(path) and not _is_known(path)]
    for start in range(0, len(unknown), TOGETHER):
        part = unknown[start : start + TOGETHER]
        if len(part) == 1 or _read_by_child(part):
            for path in part:
                _read_alone(path)


_passed: dict[Path, list[int] | None] = {}  # by this process's own knowledge: file, its state


def _is_known(path: Path) -> bool:
    """Whether ``path`` passed before as it is now, in this process or, with the layers that it names, in another."""
    now = _state(path)
    if _passed.get(path) == now:
        return True
    _check_size(path)
    try:
        layers = json.loads(_mark(path).read_text(encoding="utf-8"))
        known = all(_state(Path(name)) == state for name, state in layers.items())
    except (OSError, ValueError, AttributeError):
        return False
    if known:
        _passed[path] = now
    return known


def _read_alone(path: Path) -> None:
    if got := _read_by_child([path]):
        raise SceneError(
            "reading this file ends its reader: nested too deep, or too large",
            where=str(path),
            expected=f"{SECONDS} s and {MEMORY >> 30} GiB to be enough",
            got=got,
            do=f"make it smaller; or set {TRUST} to its folder where you trust it",
        )


def _read_by_child(paths: Sequence[Path]) -> str:
    """What went wrong where a child read ``paths``, or "": then they are remembered."""
    before = [(_state(path), _mark(path)) for path in paths]
    command = [sys.executable, "-P", "-m", "notabug.scenes_usd.untrusted_child", *map(str, paths)]
    try:
        ended = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=2 * SECONDS,
            cwd=paths[0].parent,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no end after {2 * SECONDS} s"
    lines = ended.stdout.decode("utf-8", "replace").splitlines()
    if ended.returncode or len(lines) != len(paths):
        return f"exit state {ended.returncode}"
    for path, (state, mark), line in zip(paths, before, lines, strict=True):
        _passed[path] = state
        layers = json.loads(line)
        if layers is not None:  # of a scene that was refused for one of them the others were not looked at
            with contextlib.suppress(OSError):  # a full disk costs time: it is read by a child again
                mark.parent.mkdir(parents=True, exist_ok=True)
                mark.write_text(json.dumps({name: _state(Path(name)) for name in layers}), encoding="utf-8")
    return ""


def layers_of(path: Path) -> Iterator[tuple[Path, Any]]:
    """The files that ``path`` is composed of, itself first, and what is open of each: an Sdf.Layer, or None.

    Raises SceneError where a layer names a file outside the folder of ``path``. Layers are opened, not composed.
    """
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
        layer = None
        if outer.is_file():  # where not, and where it cannot be opened, composing says so
            check_inside(outer, root, where=str(path))
            _check_size(outer)
            with contextlib.suppress(Tf.ErrorException):
                layer = Sdf.Layer.FindOrOpen(name)
        yield outer, layer
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


def _state(path: Path) -> list[int] | None:
    """What tells one state of a file from another; None where it is not there."""
    try:
        seen = path.stat()
    except OSError:
        return None
    return [seen.st_size, seen.st_mtime_ns]


def _mark(path: Path) -> Path:
    """The file in the cache that holds the states of the layers with which ``path``, as it is now, has passed."""
    state: Any = hashlib.blake2b(path.read_bytes(), digest_size=16)
    state.update(str(path).encode("utf-8", "surrogateescape"))
    return cache_root() / "scenes" / str(state.hexdigest())
