"""Picture files: read any format OpenImageIO knows, write EXR; a damaged file is a clear error, never a guess."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.errors import NotabugError

Pixels = npt.NDArray[np.float32]

MAX_CHANNELS = 64
MAX_PIXELS = 1 << 26  # 8192 x 8192: a header that claims more is refused before anything is allocated


class PictureError(NotabugError):
    """A picture that cannot be read: missing, empty, truncated, not a picture, absurdly large."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """``pixels`` (h, w, 3) float32 as stored (no colour conversion; integers scaled to 0..1), row 0 at the top.

    ``quantum`` is the step of the file's number format at 1.0, ``relative_quantum`` whether it scales with the value.
    """

    pixels: Pixels
    channels: int
    quantum: float
    relative_quantum: bool
    metadata: Mapping[str, str]


_QUANTUM = {
    "uint8": (1 / 255, False),
    "uint16": (1 / 65535, False),
    "half": (2.0**-11, True),
    "float": (2.0**-24, True),
}


@dataclass(frozen=True, slots=True)
class Header:
    """What a picture file says of itself; ``quantum`` and ``relative_quantum`` as in Picture."""

    width: int
    height: int
    channels: int
    quantum: float
    relative_quantum: bool


def read_header(path: Path) -> Header:
    """The header of the first image in ``path``, without its pixels."""
    source = _open(path)
    try:
        spec = source.spec()
        quantum, relative = _QUANTUM.get(str(spec.format), (2.0**-24, True))
        return Header(spec.width, spec.height, spec.nchannels, quantum, relative)
    finally:
        source.close()


def read_picture(path: Path) -> Picture:
    """Read the first image in ``path``. One channel is repeated to three; alpha and further channels are left out."""
    import OpenImageIO

    source = _open(path)
    try:
        spec = source.spec()
        data = source.read_image(OpenImageIO.FLOAT)
        problem = _reason(source)
        if data is None or problem:
            raise PictureError(
                f"the file is damaged or truncated ({problem})",
                where=str(path),
                do="render it again; the copy is incomplete",
            )
        stored = str(spec.format)
        metadata = _metadata(spec)
    finally:
        source.close()
    pixels = np.asarray(data, np.float32).reshape(spec.height, spec.width, -1)
    channels = int(pixels.shape[2])
    pixels = np.repeat(pixels[:, :, :1], 3, axis=2) if channels < 3 else np.ascontiguousarray(pixels[:, :, :3])
    quantum, relative = _QUANTUM.get(stored, (2.0**-24, True))
    return Picture(pixels, channels, quantum, relative, metadata)


def _reason(told: Any) -> str:
    """What went wrong in OpenImageIO's words, which may quote bytes of the file that are no text."""
    try:
        return " ".join(told.geterror().split())
    except UnicodeDecodeError:
        return "its header is no text"


def _metadata(spec: Any) -> dict[str, str]:
    """The header's attributes that are text or can be written as such."""
    found = {}
    for each in spec.extra_attribs:
        with contextlib.suppress(UnicodeDecodeError):
            found[str(each.name)] = str(each.value)
    return found


def _open(path: Path) -> Any:
    """An open OpenImageIO input, whose header is of a size that can be held in memory."""
    import OpenImageIO

    where = str(path)
    if not path.is_file():
        raise PictureError("no such file", where=where, do="check the path")
    if path.stat().st_size == 0:
        raise PictureError("the file is empty (0 bytes)", where=where, do="the renderer was stopped before it wrote")
    upright = OpenImageIO.ImageSpec()
    upright.attribute("pnm:pfmflip", 1)  # a PFM's first row is the lowest; 3.2 turns it round only when told so
    source = OpenImageIO.ImageInput.open(where, upright)
    if source is None:
        raise PictureError(
            f"not a picture ({_reason(OpenImageIO)})", where=where, expected="EXR, PNG, TIFF, HDR or PFM"
        )
    spec = source.spec()
    if spec.width * spec.height * max(spec.depth, 1) > MAX_PIXELS or spec.nchannels > MAX_CHANNELS:
        source.close()
        raise PictureError(
            f"the header claims {spec.width} x {spec.height} pixels of {spec.nchannels} channels",
            where=where,
            expected=f"at most {MAX_PIXELS} pixels and {MAX_CHANNELS} channels",
        )
    return source


def write_exr(
    path: Path, pixels: npt.NDArray[np.floating], *, half: bool = False, metadata: Mapping[str, str] = {}
) -> None:
    """Write (h, w, c) pixels as a zip-compressed EXR, atomically: the file is complete or not there."""
    import OpenImageIO

    height, width, channels = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, channels, OpenImageIO.HALF if half else OpenImageIO.FLOAT)
    spec.attribute("compression", "zip")
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    for key, value in metadata.items():
        spec.attribute(key, value)
    partial = path.with_name(f".{path.stem}.{os.getpid()}.partial.exr")
    target = OpenImageIO.ImageOutput.create(str(partial))
    if target is None or not target.open(str(partial), spec):
        raise PictureError(f"cannot write ({OpenImageIO.geterror()})", where=str(path), do="is the folder writable?")
    done = target.write_image(np.ascontiguousarray(pixels, np.float32))
    done = target.close() and done
    if not done:
        partial.unlink(missing_ok=True)
        raise PictureError(f"cannot write ({target.geterror()})", where=str(path), do="is the disk full?")
    partial.replace(path)


def write_png(path: Path, pixels: npt.NDArray[np.floating]) -> None:
    """Write (h, w, 3) values in 0..1 (others are clipped) as a 16-bit PNG without colour conversion."""
    import OpenImageIO

    data = np.ascontiguousarray(np.round(np.clip(pixels, 0.0, 1.0) * 65535.0).astype(np.uint16))
    spec = OpenImageIO.ImageSpec(data.shape[1], data.shape[0], data.shape[2], OpenImageIO.UINT16)
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    target = OpenImageIO.ImageOutput.create(str(path))
    if target is None or not target.open(str(path), spec) or not target.write_image(data) or not target.close():
        raise PictureError(f"cannot write ({OpenImageIO.geterror()})", where=str(path), do="is the disk full?")
