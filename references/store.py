"""The reference corpus: one EXR for every scene and variant, to look at, to publish, and to check this code against.

The judge predicts afresh, and looks here only to recognise a picture of another scene. ``verify`` is how a change of
the tracer, of a library or of a machine that moves a reference is noticed. Values are half floats, the mean over each
pixel's footprint; the header says from what they came, and nothing in the file depends on when or where it was written.
"""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug import __version__
from notabug.references import _native
from notabug.references.cache import source_hash
from notabug.references.predict import check_finite, configured
from notabug.references.tracer.envelope import GRID, REFINE, trace_envelope, trace_samples
from notabug.references.tracer.precision import MOST, asked
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import Picture, PictureError, read_picture, write_exr
from notabug.scenes_usd.scene import Scene

CORPUS = Path(__file__).resolve().parent / "corpus"
CHANNELS = ("R", "G", "B", "bound.R", "bound.G", "bound.B")
DEEP = 4096  # samples of a pixel, 64 x 64, that a reference is held against
PIXELS = 512  # of a picture that are looked at so closely
GOLDEN = (5.0**0.5 - 1.0) / 2.0  # the smaller part of the golden section
TOLERANCE = 1  # units in the last place that another processor's powers and square roots may move a value by
BEYOND_HALF = 65520.0  # halfway from the largest half float, 65504, to the next one: rounded, it is infinite

Halves = npt.NDArray[np.float16]


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A reference as it is stored: ``pixels`` (h, w, 3), and by how much each may be off, ``bound`` (h, w, 3).

    What was asked of a pixel is in its bound; where the bound is less, the samples tell no more.
    """

    pixels: Halves
    bound: Halves


_SAFE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.,=+-]*")
_EPOCH = "1970:01:01 00:00:00"  # the EXR writer would put the time of day


class ReferenceMissingError(NotabugError):
    """The corpus holds no reference for a scene and variant."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """How a stored reference differs from what this code gives.

    ``pixels`` of them do, by at most ``ulps`` units in the last place of a half float. ``changed`` tells that the
    scene's digest is not the one it was built from; alone that is accepted, for another processor may round the
    transforms of a scene otherwise.
    """

    pixels: int
    ulps: int
    changed: bool = False

    def __str__(self) -> str:
        what = f"{self.pixels} pixels differ, at most {self.ulps} ulp" if self.pixels else "identical"
        if self.accepted:
            what += f" ({TOLERANCE} is accepted)" if self.pixels else ""
            return what + (", although the scene's digest is another one" if self.changed else "")
        why = "the scene changed since its reference was built" if self.changed else "the scene is unchanged"
        return f"{what}; {why}: look at the new picture, then run `notabug references build`"

    @property
    def accepted(self) -> bool:
        return self.ulps <= TOLERANCE


def place(scene_id: str, variant: str = "") -> Path:
    """The reference's file: ``corpus/<class>/<scene>/<variant or default>.exr``."""
    parts = [*scene_id.split("/"), variant or "default"]
    if len(parts) != 3 or not all(_SAFE.fullmatch(part) for part in parts):
        raise NotabugError(
            "the reference corpus holds the scenes of the corpus only",
            where=f"{scene_id} {variant}".rstrip(),
            expected="<class>/<scene>",
            do="other scenes are predicted whenever they are judged and need no stored reference",
        )
    return CORPUS.joinpath(*parts[:2], f"{parts[2]}.exr")


def read_bound(scene_id: str, variant: str = "") -> npt.NDArray[np.float32] | None:
    """The bound (h, w, 3) of the stored reference's error; None where the file is of a time before there was one."""
    try:
        return read_picture(place(scene_id, variant), layer="bound").pixels
    except PictureError:
        return None


def read(scene_id: str, variant: str = "") -> Picture:
    """The stored reference with its metadata. Raises ReferenceMissingError where there is none."""
    path = place(scene_id, variant)
    if not path.is_file():
        chosen = "".join(f" --variant {each}" for each in variant.split(",") if each)
        raise ReferenceMissingError(
            "no reference is stored",
            where=f"{scene_id} {variant}".rstrip(),
            do=f"run `notabug references build {scene_id}{chosen}`",
        )
    return read_picture(path)


def others(scene: Scene) -> Iterator[tuple[str, npt.NDArray[np.float32]]]:
    """What is stored of other scenes, every variant of the size of ``scene``: (the scene's id, (h, w, 3))."""
    for path in sorted(CORPUS.glob("*/*/*.exr")):
        name = path.parent.relative_to(CORPUS).as_posix()
        if name != scene.id:
            pixels = read_picture(path).pixels
            if pixels.shape[:2] == (scene.height, scene.width):
                yield name, pixels


def compute(scene: Scene) -> Reference:
    """The reference of ``scene``, computed now, as it is stored."""
    scene_meant, options = configured(scene, ())
    found = trace_envelope(scene_meant, options, most=MOST)
    mean = found.mean
    check_finite(mean, scene)
    if float(np.abs(mean).max()) >= BEYOND_HALF:
        raise NotabugError(
            "the reference does not fit into half floats",
            where=f"{scene.id} {scene.variant}".rstrip(),
            expected="at most 65504",
            got=f"{float(np.max(mean)):g}",
            do="lower the lights",
        )
    bound = found.bound.astype(np.float16)
    least = np.nextafter(bound, np.float16(np.inf))  # rounding must not make it too small
    return Reference(mean.astype(np.float32).astype(np.float16), np.where(bound < found.bound, least, bound))


def build(scene: Scene) -> Path:
    """Compute the reference of ``scene`` and write it; the same code and libraries write the same bytes."""
    path = place(scene.id, scene.variant)
    made = compute(scene)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        writable = os.access(path.parent, os.W_OK)
    except OSError:
        writable = False
    if not writable:
        raise NotabugError(
            "the reference corpus cannot be written to",
            where=str(path.parent),
            do="an installed package is read-only: build in a checkout, installed with `pip install -e .`",
        )
    write(path, made, provenance(scene))
    return path


def write(path: Path, made: Reference, metadata: Mapping[str, str]) -> None:
    """Write a reference: its picture, and the bound as a layer of that name."""
    pixels = np.concatenate([made.pixels, made.bound], axis=2).astype(np.float32)
    write_exr(path, pixels, half=True, metadata=metadata, channels=CHANNELS)


def provenance(scene: Scene) -> dict[str, str]:
    """What the reference of ``scene`` follows from: the header of its file."""
    return {
        "DateTime": _EPOCH,
        "notabug:scene": scene.id,
        "notabug:variant": scene.variant,
        "notabug:digest": scene.digest(),
        "notabug:model": "reference",
        "notabug:tracer": f"{source_hash(Path(__file__).parent / 'tracer')}-{_native.SOURCES}",
        "notabug:samples": f"{GRID}x{GRID}, {REFINE}x{REFINE} where mixed, up to {MOST} by the estimated error",
        "notabug:versions": f"notabug {__version__}, numpy {np.__version__}, python {platform.python_version()}",
    }


def compare(scene: Scene) -> Comparison:
    """Compute the reference of ``scene`` again and hold it against the stored one."""
    stored = read(scene.id, scene.variant)
    changed = stored.metadata.get("notabug:digest") != scene.digest()
    computed = compute(scene).pixels
    if stored.pixels.shape != computed.shape:
        return Comparison(computed.shape[0] * computed.shape[1], 0xFFFF, changed)
    steps = np.abs(_ordered(stored.pixels.astype(np.float16)) - _ordered(computed))
    return Comparison(int((steps > 0).any(axis=2).sum()), int(steps.max(initial=0)), changed)


@dataclass(frozen=True, slots=True)
class DeepComparison:
    """How pixels of a stored reference differ from means of DEEP samples.

    ``ratio`` is the largest one of a pixel's error to its bound, at the pixel ``at`` (x, y), of ``pixels`` that were
    looked at; None where the file holds no bound.
    """

    ratio: float | None
    at: tuple[int, int] = (0, 0)
    pixels: int = 0

    def __str__(self) -> str:
        if self.ratio is None:
            return "it holds no bound of its error: run `notabug references build`"
        what = f"the error is at most {self.ratio:.3g} of its bound, at {self.at} of {self.pixels} pixels"
        return what if self.accepted else f"{what}: the estimate of the error is wrong there"

    @property
    def accepted(self) -> bool:
        return self.ratio is not None and self.ratio <= 1.0


def compare_deep(scene: Scene) -> DeepComparison:
    """Hold the stored reference of ``scene`` against DEEP samples, at PIXELS pixels.

    Half of them are those with the largest bounds, as a part of what is asked there, the others lie all over (see
    ``scattered``). A pixel
    may be off by its bound, or by what is asked of it where that is more, by half a unit of the last place of what is
    stored, and by what the samples it is held against may be off.
    """
    stored, bound = read(scene.id, scene.variant).pixels, read_bound(scene.id, scene.variant)
    if bound is None or stored.shape != (scene.height, scene.width, 3):
        return DeepComparison(None)
    scene_meant, options = configured(scene, ())
    least = asked(stored, bound, np.zeros(stored.shape[:2], np.bool_), float(stored.max()))
    worst = np.argsort((bound / np.maximum(least, 1e-30)).max(axis=2), axis=None, kind="stable")[::-1]
    chosen = np.unique(np.concatenate([worst[: PIXELS // 2], scattered(worst.size, PIXELS // 2)]))
    deep, error = trace_samples(scene_meant, options, chosen, DEEP)
    allowed = np.maximum(bound, least).reshape(-1, 3)[chosen] + error
    allowed += 0.5 * np.spacing(stored.astype(np.float16)).astype(np.float64).reshape(-1, 3)[chosen]
    ratio = (np.abs(stored.reshape(-1, 3)[chosen] - deep) / np.maximum(allowed, 1e-30)).max(axis=1)
    y, x = divmod(int(chosen[ratio.argmax()]), scene.width)
    return DeepComparison(float(ratio.max()), (x, y), len(chosen))


def scattered(size: int, count: int) -> npt.NDArray[np.intp]:
    """``count`` of the numbers below ``size``, or all: evenly spread, and in a picture over its rows and its columns.

    Each is the golden section of ``size`` behind the one before; even steps would lie on few columns of a picture.
    """
    if count >= size:
        return np.arange(size)
    return np.unique((np.arange(count) * (GOLDEN * size) % size).astype(np.intp))


def verify(scene: Scene) -> list[str]:
    """What is wrong with the stored reference of ``scene``: nothing where it is as computed, to TOLERANCE."""
    found = compare(scene)
    return [] if found.accepted else [str(found)]


def _ordered(halves: Halves) -> npt.NDArray[np.int32]:
    """The number of each half float in the order of all of them, so that neighbours differ by one; -0 equals 0."""
    bits = halves.view(np.int16).astype(np.int32)
    return np.where(bits < 0, -(bits & 0x7FFF), bits).astype(np.int32)
