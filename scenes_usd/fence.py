"""What a scene from outside the corpus may open: files below its own folder, by their real path, and nothing else.

It is asked twice. Before OpenUSD composes anything each layer is opened by itself and asked what it names: a file
outside is never opened, so no message can quote it. What cannot be known before composing is refused: paths that are
expressions, and value clips, which hold no more than a picture's one moment needs. After composing, the layers that
OpenUSD did open are asked for once more.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from notabug.scenes_usd.errors import SceneError

if TYPE_CHECKING:
    from pxr import Sdf, Usd

TRUST = "NOTABUG_TRUST"
FILE = 256 << 20  # bytes of one layer
LAYERS = 256
SUFFIXES = (".usda", ".usdc", ".usd", ".usdz")  # other formats come from plug-ins, which open what they like
_CLIPS = ("clips", "clipSets", "clipAssetPaths", "clipManifestAssetPath", "clipTemplateAssetPath")


class OutsideError(SceneError):
    """A scene that would open a file outside of its folder."""


def layers_of(path: Path) -> Iterator[tuple[Path, Sdf.Layer | None]]:
    """The files that ``path`` is composed of, itself first, and what is open of each: an Sdf.Layer, or None.

    Raises OutsideError where a layer names a file outside the folder of ``path``, in whatever variant. Layers are
    opened, not composed.
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
        outer = Path(outermost(name))
        layer = None
        if outer.is_file():  # where not, and where it cannot be opened, composing says so
            check_inside(outer, root, where=str(path))
            check_size(outer)
            with contextlib.suppress(Tf.ErrorException):
                layer = Sdf.Layer.FindOrOpen(name)
        yield outer, layer
        if layer is not None:
            waiting += _named(layer, name, root)


def _named(layer: Sdf.Layer, name: str, root: Path) -> Iterator[str]:
    """The layers that ``layer``, called ``name``, names, by their absolute paths; raises OutsideError."""
    _refuse_clips(layer, name)
    for asset in {*layer.GetCompositionAssetDependencies(), *layer.GetExternalAssetDependencies()} - {""}:
        if "://" in asset:
            raise OutsideError("a scene may name only files", where=name, got=asset)
        if asset.startswith("`"):
            raise OutsideError(
                "a path that is an expression is not followed",
                where=name,
                expected="the path of a file",
                got=asset,
                do=f"write the path out; or set {TRUST} to the scene's folder where you trust it",
            )
        resolved = layer.ComputeAbsolutePath(asset)
        check_inside(Path(outermost(resolved)), root, where=name, got=asset)
        if Path(_innermost(resolved)).suffix.lower() not in SUFFIXES:
            raise OutsideError(
                "a scene may be composed only of USD layers", where=name, expected=", ".join(SUFFIXES), got=asset
            )
        yield resolved


def _refuse_clips(layer: Sdf.Layer, name: str) -> None:
    """Raise OutsideError where a prim of ``layer`` has value clips, which are opened when a value is asked for."""
    found: list[str] = []

    def look(path: Sdf.Path) -> None:
        if path.IsPrimPath() or path.IsPrimVariantSelectionPath():
            keys = layer.GetObjectAtPath(path).ListInfoKeys()
            found.extend(f"{path} {key}" for key in _CLIPS if key in keys)

    layer.Traverse("/", look)
    if found:
        raise OutsideError(
            "value clips are not read: a picture shows one moment",
            where=name,
            got=found[0],
            do="flatten the clips into the layer (usdcat --flatten)",
        )


def check_opened(stage: Usd.Stage, path: Path) -> None:
    """Raise OutsideError where OpenUSD has opened a layer of ``stage`` outside the folder of ``path``."""
    for layer in stage.GetUsedLayers(True):
        if not layer.anonymous:
            check_inside(Path(outermost(layer.realPath or layer.identifier)), path.parent, where=str(path))


def check_inside(file: Path, root: Path, *, where: str, got: str = "") -> None:
    """Raise OutsideError where ``file``, links followed, is not below the folder ``root``."""
    if not file.resolve().is_relative_to(root.resolve()):
        raise OutsideError(
            "a file outside of the scene's folder",
            where=where,
            expected=f"below {root}",
            got=got or str(file),
            do=f"copy it there; or set {TRUST} to a folder that holds both",
        )


def check_size(path: Path) -> None:
    size = path.stat().st_size
    if size > FILE:
        raise SceneError("the file is too large", where=str(path), expected=f"at most {FILE >> 20} MiB", got=str(size))


def outermost(name: str) -> str:
    """The file that holds ``name``: the package of a path such as ``a.usdz[b.usd]``, without a format's arguments."""
    from pxr import Ar, Sdf

    name = str(Sdf.Layer.SplitIdentifier(name)[0])
    return str(Ar.SplitPackageRelativePathOuter(name)[0]) if Ar.IsPackageRelativePath(name) else name


def _innermost(name: str) -> str:
    """The layer itself: ``b.usd`` of ``a.usdz[b.usd]``."""
    from pxr import Ar, Sdf

    name = str(Sdf.Layer.SplitIdentifier(name)[0])
    while Ar.IsPackageRelativePath(name):
        name = str(Ar.SplitPackageRelativePathInner(name)[1])
    return name
