"""predict: the envelope that a set of models gives for a scene, computed once and kept by a hash of all that enters."""

from __future__ import annotations

import contextlib
import hashlib
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.references import _native
from notabug.references.cache import cache_root, source_hash
from notabug.references.models.model import Model
from notabug.references.tracer.emitters import DRAWN_DIRECTIONS, PREVIEW_DIRECTIONS
from notabug.references.tracer.envelope import Envelope, trace_changes, trace_envelope, trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd import triangulate
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Scene

# What an envelope is computed by: the tracer, as it was built and by which compiler, and the cutting of polygons.
SOURCE_HASH = "-".join(
    [
        source_hash(Path(__file__).parent / "tracer"),
        source_hash(Path(triangulate.__file__).parent),
        _native.SOURCES,
        _native.COMPILER,
    ]
)
Bools = npt.NDArray[np.bool_]

WORTH_KEEPING = 0.005  # seconds: what takes less to compute is not kept, as its file would save nothing
CACHE_BYTES = 2 << 30  # the oldest files of a kind go when the cache has grown beyond this
SWEEPS = ("00", "40", "80", "c0")  # beginnings of the names, one in 64, after which it is looked at


class ReferenceNotFiniteError(NotabugError):
    """A reference holds NaN or Inf: nothing can be judged by it, for no comparison with NaN is ever true."""


def configured(scene: Scene, models: Iterable[Model]) -> tuple[Scene, Options]:
    """The scene and the tracer's switches under ``models``; none: the reference. A fault's switches win.

    What is read wrong comes first, since limitations act on it.
    """
    options: dict[str, object] = {}
    for model in sorted(models, key=lambda each: (not each.read, each.kind == "fault")):
        scene = model.edit(scene)
        options.update(model.options)
    return scene.as_intended(), Options(**options)  # type: ignore[arg-type]


def predict(scene: Scene, models: Iterable[Model] = (), *, cached: bool = True) -> Envelope:
    """The envelope of ``scene`` under ``models`` (none: the reference), from the cache where it is there.

    Raises ReferenceNotFiniteError where the reference holds NaN or Inf; what models predict may overflow.

    The cache's key is the configured scene's contents, the switches, the sources that compute it and the version of
    numpy; its values are float32 (relative error 6e-8, far below any tolerance).
    """
    chosen = tuple(models)
    envelope = _predicted(*configured(scene, chosen), cached=cached)
    if not chosen:
        for values in (envelope.point, envelope.mean, envelope.lo, envelope.hi, envelope.variance):
            check_finite(values, scene)
    return envelope


@dataclass(frozen=True, slots=True, eq=False)
class Near:
    """An envelope that was traced near the changes of another one, and ``way``: a hash of all that it follows from."""

    envelope: Envelope
    way: str


def predict_near(
    scene: Scene, models: Iterable[Model], known: Near, also: Bools | None = None, fine: Bools | None = None
) -> Near:
    """The envelope of ``scene`` under ``models``, as far as it differs from one that is ``known`` of the scene.

    It is what ``predict`` gives at the pixels ``also`` (h, w) and wherever a centre of a pixel nearby shows what
    differs, and as exact as references are at the pixels ``fine`` (h, w): see trace_changes. The way of the scene's
    reference is "".
    """
    configured_scene, options = configured(scene, models)
    way = known.way or _path(*configured(scene, ()), "envelopes").stem
    for kind, places in (("also", also), ("fine", fine)):
        if places is not None:
            way += kind + hashlib.blake2b(places.tobytes(), digest_size=16).hexdigest()
    path = _path(configured_scene, options, "envelopes", way)
    try:
        return Near(_stored(path), path.stem)
    except (OSError, ValueError, EOFError):
        _forget(path)
    began = time.perf_counter()
    envelope = _stored_form(trace_changes(configured_scene, options, known.envelope, also, fine))
    if time.perf_counter() - began > WORTH_KEEPING:
        _keep(path, list(envelope.arrays().values()))
    return Near(envelope, path.stem)


def _predicted(scene: Scene, options: Options, *, cached: bool) -> Envelope:
    """The envelope of a configured scene."""
    path = _path(scene, options, "envelopes")
    if cached:
        try:
            return _stored(path)
        except (OSError, ValueError, EOFError):  # no file, or a damaged one
            _forget(path)
    envelope = _stored_form(trace_envelope(scene, options))
    if cached:
        _keep(path, list(envelope.arrays().values()))
    return envelope


def check_finite(values: npt.NDArray[np.floating], scene: Scene) -> None:
    """Raise ReferenceNotFiniteError where ``values`` (h, w, 3), predicted of ``scene``, hold NaN or Inf."""
    wrong = ~np.isfinite(values).all(axis=2)
    if not wrong.any():
        return
    y, x = (int(each[0]) for each in np.nonzero(wrong))
    how_many = f"NaN or Inf at {int(wrong.sum())} of {wrong.size} pixels"
    raise ReferenceNotFiniteError(
        "the reference is not finite",
        where=f"{scene.id} {scene.variant}".rstrip(),
        expected="finite values",
        got=f"{how_many}, the first at ({x}, {y}): {values[y, x].tolist()}",
        do="look there for opposite normals, a light on a surface, or light whose square float32 cannot hold, 1e19",
    )


@lru_cache(maxsize=4)  # pictures of one scene are judged one after the other; one of 256 x 256 takes 6 MB
def _stored(path: Path) -> Envelope:
    """The envelope in the cache's file ``path``, whose name is a hash of all that enters; read-only."""
    with path.open("rb") as stored:  # plain arrays one after the other: a zip would check their sums again
        arrays = {each.name: np.load(stored) for each in fields(Envelope)}
    for array in arrays.values():
        array.flags.writeable = False
    return Envelope(**arrays)


def preview(scene: Scene, models: Iterable[Model] = ()) -> npt.NDArray[np.float32]:
    """The picture (h, w, 3) at pixel centres of ``scene`` under ``models``, from the cache where it is there."""
    configured_scene, options = configured(scene, models)
    path = _path(configured_scene, options, "previews")
    try:
        return _stored_picture(path)
    except (OSError, ValueError, EOFError):
        _forget(path)
    began = time.perf_counter()
    picture = _single(trace_picture(configured_scene, options, directions=PREVIEW_DIRECTIONS))
    if time.perf_counter() - began > WORTH_KEEPING:
        _keep(path, [picture])
    return picture


def centre_error(scene: Scene, known: Envelope) -> npt.NDArray[np.float32] | None:
    """By how much (h, w, 3) the reference ``known`` of ``scene`` is off at pixels' centres; None: by rounding alone.

    Of a light with a size a centre knows as much as CENTRE_DIRECTIONS tell: the error is what more of them change.
    """
    if not any(light.emitter is not None for light in scene.lights):
        return None
    path = _path(*configured(scene, ()), "previews", "exact centres")
    try:
        exact = _stored_picture(path)
    except (OSError, ValueError, EOFError):
        _forget(path)
        exact = _single(trace_picture(*configured(scene, ()), directions=DRAWN_DIRECTIONS))
        _keep(path, [exact])
    return _single(np.abs(exact - known.point))


def preview_at(scene: Scene, models: Iterable[Model], at: npt.NDArray[np.intp]) -> npt.NDArray[np.float32]:
    """The pixels (n, 3) of ``preview`` numbered ``at`` (n,); they are not kept, as few of them take less to draw."""
    seen = trace_picture(*configured(scene, models), at=at, directions=PREVIEW_DIRECTIONS)
    return _single(seen.reshape(-1, 3)[at])


@lru_cache(maxsize=16)
def _stored_picture(path: Path) -> npt.NDArray[np.float32]:
    """As ``_stored``, of a picture."""
    picture = np.asarray(np.load(path), np.float32)
    picture.flags.writeable = False
    return picture


def _path(scene: Scene, options: Options, kind: str, base: str = "") -> Path:
    key = hashlib.blake2b(digest_size=16)
    for part in (scene.digest(), repr(options), SOURCE_HASH, np.__version__, base):
        key.update(part.encode())
    return cache_root() / kind / f"{key.hexdigest()}.npy"


def _stored_form(envelope: Envelope) -> Envelope:
    """The envelope as the cache gives it back, so that a first run and a second one judge alike.

    What is beyond float32 is infinite there.
    """
    floats: Any = {k: _single(v.astype(np.float64)) for k, v in envelope.arrays().items() if v.dtype == np.float64}
    return replace(envelope, **floats)


def _single(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """``values`` in float32, those beyond its range as infinities."""
    most = float(np.finfo(np.float32).max)
    beyond = np.abs(values) > most
    if beyond.any():
        values = np.where(beyond, np.copysign(np.inf, values), values)
    return values.astype(np.float32)


def _forget(path: Path) -> None:
    """Remove what cannot be read; where nothing can be removed, nothing was kept."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


def _keep(path: Path, arrays: Sequence[npt.NDArray[np.generic]]) -> None:
    partial = path.with_suffix(f".{os.getpid()}.partial")  # a name that the sweep below, in any process, leaves alone
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with partial.open("wb") as stored:
            for array in arrays:
                np.save(stored, array)
        partial.replace(path)
    except OSError:  # a full disk, or a folder that cannot be written, costs time, not a verdict
        _forget(partial)
        return
    if not path.name.startswith(SWEEPS):  # looking at every file takes longer than drawing a small picture
        return
    kept = []
    for each in path.parent.glob("*.npy"):
        with contextlib.suppress(FileNotFoundError):  # another process's sweep was faster
            state = each.stat()
            kept.append((state.st_mtime, state.st_size, each))
    total = sum(size for _, size, _ in kept)
    for _, size, each in sorted(kept):
        if total <= CACHE_BYTES:
            break
        total -= size
        each.unlink(missing_ok=True)
