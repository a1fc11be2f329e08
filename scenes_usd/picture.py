"""Picture files: read any format OpenImageIO knows, write EXR; a damaged file is a clear error, never a guess.

What is read is what a viewer shows: which channels are the picture says ``picture_layers``, where its pixels belong
``picture_place``, how exact their numbers are ``picture_numbers``.
"""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.picture_child import read_by_child
from notabug.scenes_usd.picture_header import MAX_CHANNELS, is_little_work
from notabug.scenes_usd.picture_header import PictureError as PictureError
from notabug.scenes_usd.picture_layers import Layer, choose, layers_of
from notabug.scenes_usd.picture_numbers import Lossy, Numbers, lossy_of, numbers_of, once_coarser
from notabug.scenes_usd.picture_place import TURNED, orientation, placed
from notabug.scenes_usd.srgb import decode_srgb

if TYPE_CHECKING:
    from types import ModuleType

    import OpenImageIO

Pixels = npt.NDArray[np.float32]

MAX_PARTS = 256
MAX_TOGETHER = 16  # channels that are read although one lies between those that are wanted
MAX_LISTED = 12  # layers that an error names
MAX_PIXELS = 1 << 26  # 8192 x 8192: a header that claims more is refused before anything is allocated


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """``pixels`` (h, w, 3) float32, row 0 at the top, as a viewer shows the file over black.

    Values are as stored, integers scaled to 0..1, without colour conversion unless the reader was asked for one.

    Attributes
    ----------
    channels : of the layer that was read: 1 or 3, and one more where it has alpha.
    quantum, relative_quantum : the step of the number format at 1.0, and whether it scales with the value.
    shared_exponent : the step scales with the largest channel of the pixel.
    judged : the names of the channels that were read.
    notes : what was done with them that the file's numbers alone do not show, for people.
    opaque : there is no alpha, or it is 1 everywhere.
    stored : the file's number format: uint8, half, float ...
    lossy : the coding, where it loses more than a step.
    alpha : (h, w) as stored, where it was asked for and there is any.
    """

    pixels: Pixels
    channels: int
    quantum: float
    relative_quantum: bool
    metadata: Mapping[str, str]
    shared_exponent: bool = False
    judged: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    opaque: bool = True
    stored: str = "float"
    lossy: Lossy | None = None
    alpha: Pixels | None = None


@dataclass(frozen=True, slots=True)
class Header:
    """What a picture file says of itself, as in Picture; ``width`` and ``height`` are those of the picture."""

    width: int
    height: int
    channels: int
    quantum: float
    relative_quantum: bool
    shared_exponent: bool = False


@dataclass(frozen=True, slots=True)
class _Chosen:
    """The layer of an open file that is the picture, and the header of its part."""

    layer: Layer
    spec: OpenImageIO.ImageSpec
    kind: str  # OpenImageIO's name of the file format
    parts: int

    @property
    def indices(self) -> tuple[int, ...]:
        """Of the channels: one or three, and alpha where there is any."""
        alpha = () if self.layer.alpha is None else (self.layer.alpha,)
        return (*self.layer.colours, *alpha)

    @property
    def stored(self) -> str:
        """The coarsest number format of the three channels."""
        formats = [str(self.spec.channelformat(colour)) for colour in self.layer.colours]
        return max(formats, key=lambda each: numbers_of(self.spec, self.kind, each).quantum)

    @property
    def numbers(self) -> Numbers:
        return numbers_of(self.spec, self.kind, self.stored)


def read_header(path: Path, layer: str = "") -> Header:
    """The header of the picture in ``path``, without its pixels; ``layer`` as for read_picture."""
    _check_there(path)
    if is_little_work(path):
        return read_header_here(path, layer)
    return Header(**read_by_child(path, layer, srgb=False, header=True))


def read_header_here(path: Path, layer: str = "") -> Header:
    """``read_header`` in this process, whatever work it is."""
    source = _open(path)
    try:
        chosen = _choose(source, path, layer)
    finally:
        source.close()
    width, height = chosen.spec.full_width, chosen.spec.full_height
    if orientation(chosen.spec, chosen.kind) in TURNED:
        width, height = height, width
    numbers = chosen.numbers
    return Header(width, height, len(chosen.indices), numbers.quantum, numbers.relative, numbers.shared)


def read_picture(path: Path, *, layer: str = "", srgb: bool = False, with_alpha: bool = False) -> Picture:
    """Read the picture in ``path`` as a viewer shows it, or ``with_alpha`` its colours and its alpha as stored.

    ``layer`` names the layer or part that is meant where the file has several; without it ``picture_layers`` chooses.
    One channel is repeated to three. The display window is taken: pixels outside the data window are 0, pixels of the
    data window outside of it are left out. The file's Orientation is applied.

    Alpha is left out, as over black. Where the file says that it is straight (PNG, TGA, TIFF by its tag) colours are
    therefore multiplied by it, in linear light: after decoding where ``srgb`` asks to decode. Where alpha is 0 all
    over the picture the renderer wrote none, and colours stay. Associated alpha, as in EXR, is in the colours already.
    OpenImageIO's own multiplication, which knows no encoding, is switched off.

    What is much work, or may be, is read in a child with limits of time and memory.
    """
    _check_there(path)
    if is_little_work(path):
        return read_picture_here(path, layer=layer, srgb=srgb, with_alpha=with_alpha)
    read = read_by_child(path, layer, srgb, header=False, with_alpha=with_alpha)
    lossy = None if read["lossy"] is None else Lossy(**read["lossy"])
    texts = {name: tuple(read[name]) for name in ("judged", "notes")}
    return Picture(**{**read, **texts, "lossy": lossy})


def read_picture_here(path: Path, *, layer: str = "", srgb: bool = False, with_alpha: bool = False) -> Picture:
    """``read_picture`` in this process, whatever work it is."""
    source = _open(path)
    try:
        chosen = _choose(source, path, layer)
        data = _read(source, chosen)
        problem = _reason(source)
        if data is None or problem:
            raise PictureError(
                f"the file is damaged or truncated ({problem})",
                where=str(path),
                do="render it again; the copy is incomplete",
            )
    finally:
        source.close()
    spec, numbers = chosen.spec, chosen.numbers
    data, notes = placed(data, spec, chosen.kind)
    colours = len(chosen.layer.colours)
    pixels, alpha = data[:, :, :colours], data[:, :, colours:]
    numbers = once_coarser(pixels, numbers)
    if numbers.quantum != chosen.numbers.quantum and not numbers.relative:
        notes += (f"its values are all steps of 1/{round(1 / numbers.quantum)}",)
    if srgb:
        pixels = decode_srgb(pixels).astype(np.float32)
    opaque = bool((alpha == 1.0).all())
    if not opaque and not with_alpha and spec.get_int_attribute("oiio:UnassociatedAlpha", 0):
        pixels, numbers, said = _over_black(pixels, alpha, numbers)
        notes += said
    exposure = spec.get_float_attribute("hdr:exposure", 1.0)
    if exposure != 1.0:
        notes += (f"its header's EXPOSURE of {exposure:g} was not divided out",)
    if chosen.parts > 1:
        notes = (f"part {chosen.layer.part_name!r}, one of {chosen.parts}", *notes)
    return Picture(
        np.ascontiguousarray(np.repeat(pixels, 3, axis=2) if colours == 1 else pixels),
        len(chosen.indices),
        numbers.quantum,
        numbers.relative,
        _metadata(spec),
        numbers.shared,
        tuple(str(spec.channelnames[colour]) for colour in chosen.layer.colours),
        notes,
        opaque,
        chosen.stored,
        lossy_of(spec, chosen.kind, chosen.stored, path),
        np.ascontiguousarray(alpha[:, :, 0]) if with_alpha and alpha.shape[2] else None,
    )


def _over_black(pixels: Pixels, alpha: Pixels, numbers: Numbers) -> tuple[Pixels, Numbers, tuple[str, ...]]:
    """Linear ``pixels`` with straight ``alpha`` as they look over black, their numbers, and a word for people."""
    if not alpha.any():
        return pixels, numbers, ("its alpha is 0 everywhere and was left out",)
    numbers = replace(numbers, quantum=2.0 * numbers.quantum)  # both factors are rounded
    return pixels * alpha, numbers, ("its alpha is straight: colours were multiplied by it",)


def _read(source: OpenImageIO.ImageInput, chosen: _Chosen) -> Pixels | None:
    """The chosen channels (h, w, c) as stored; None where the file is damaged."""
    indices = chosen.indices
    first, last = min(indices), max(indices) + 1
    if last - first > MAX_TOGETHER:
        each = [_range(source, chosen, index, index + 1) for index in indices]
        return None if any(one is None for one in each) else np.concatenate([one for one in each if one is not None], 2)
    data = _range(source, chosen, first, last)
    if data is None or indices == tuple(range(first, last)):
        return data
    return data[:, :, [index - first for index in indices]]


def _range(source: OpenImageIO.ImageInput, chosen: _Chosen, first: int, last: int) -> Pixels | None:
    """The channels from ``first`` to before ``last`` of the chosen part, or None."""
    import OpenImageIO

    data = source.read_image(chosen.layer.part, 0, first, last, OpenImageIO.FLOAT)
    return None if data is None else np.asarray(data, np.float32).reshape(chosen.spec.height, chosen.spec.width, -1)


def _choose(source: OpenImageIO.ImageInput, path: Path, wanted: str) -> _Chosen:
    """The part and channels of the open file ``source`` that are the picture, the part's header read."""
    kind = str(source.format_name())
    parts: list[OpenImageIO.ImageSpec] = []
    while len(parts) < MAX_PARTS and source.seek_subimage(len(parts), 0):
        _check_size(source.spec(), path)
        parts.append(source.spec())
        if kind != "openexr" and not wanted:  # pages, frames, thumbnails: every viewer opens the first
            break
    found = layers_of(parts)
    layer = choose(found, wanted)
    if layer is None:
        known = "; ".join(str(each) for each in found[:MAX_LISTED])
        known += f"; {len(found) - MAX_LISTED} more" if len(found) > MAX_LISTED else ""
        what = "several layers may be the picture" if any(each.colours for each in found) else "no channel is a colour"
        raise PictureError(
            f"no layer {wanted!r} that is a picture" if wanted else what,
            where=str(path),
            expected="R, G and B without a layer's name, or one layer that has them or is called Combined or beauty",
            got=f"layers: {known}",
            do="which? --layer NAME",
        )
    spec = parts[layer.part]
    if spec.deep or spec.depth > 1:
        raise PictureError(
            f"{'deep data' if spec.deep else 'a volume'} is no picture", where=str(path), expected="one value a pixel"
        )
    count = max(len(parts), spec.get_int_attribute("oiio:subimages", 1))
    return _Chosen(layer, spec, kind, count if kind == "openexr" or wanted else 1)


def _reason(told: ModuleType | OpenImageIO.ImageInput) -> str:
    """What went wrong in OpenImageIO's words, which may quote bytes of the file that are no text."""
    try:
        return " ".join(told.geterror().split())
    except UnicodeDecodeError:
        return "its header is no text"


def _metadata(spec: OpenImageIO.ImageSpec) -> dict[str, str]:
    """The header's attributes that are text or can be written as such."""
    found = {}
    for attrib in spec.extra_attribs:
        with contextlib.suppress(UnicodeDecodeError):
            found[str(attrib.name)] = str(attrib.value)
    return found


def _check_there(path: Path) -> None:
    """Raise PictureError where there is no file at ``path``, or an empty one."""
    if not path.is_file():
        raise PictureError("no such file", where=str(path), do="check the path")
    if path.stat().st_size == 0:
        raise PictureError(
            "the file is empty (0 bytes)", where=str(path), do="the renderer was stopped before it wrote"
        )


def _open(path: Path) -> OpenImageIO.ImageInput:
    """An open OpenImageIO input, whose header is of a size that can be held in memory."""
    import OpenImageIO

    where = str(path)
    upright = OpenImageIO.ImageSpec()
    upright.attribute("pnm:pfmflip", 1)  # a PFM's first row is the lowest; 3.2 turns it round only when told so
    upright.attribute("oiio:UnassociatedAlpha", 1)  # no multiplication by alpha on reading
    source = OpenImageIO.ImageInput.open(where, upright)
    if source is None:
        raise PictureError(
            f"not a picture ({_reason(OpenImageIO)})", where=where, expected="EXR, PNG, TIFF, HDR or PFM"
        )
    try:
        _check_size(source.spec(), path)
    except PictureError:
        source.close()
        raise
    return source


def _check_size(spec: OpenImageIO.ImageSpec, path: Path) -> None:
    """Raise PictureError where a picture with the header ``spec`` is too large to be held in memory."""
    shown = spec.full_width * spec.full_height
    if max(spec.width * spec.height * max(spec.depth, 1), shown) > MAX_PIXELS or spec.nchannels > MAX_CHANNELS:
        raise PictureError(
            f"the header claims {spec.width} x {spec.height} pixels of {spec.nchannels} channels"
            + (f" in a window of {spec.full_width} x {spec.full_height}" if shown > spec.width * spec.height else ""),
            where=str(path),
            expected=f"at most {MAX_PIXELS} pixels and {MAX_CHANNELS} channels",
        )


def write_exr(
    path: Path,
    pixels: npt.NDArray[np.floating],
    *,
    half: bool = False,
    metadata: Mapping[str, str] = {},
    channels: tuple[str, ...] = (),
) -> None:
    """Write (h, w, c) pixels as a zip-compressed EXR, atomically: the file is complete or not there.

    ``channels`` are the names of the c channels; without them they are R, G, B and A.
    """
    import OpenImageIO

    height, width, count = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, count, OpenImageIO.HALF if half else OpenImageIO.FLOAT)
    if channels:
        spec.channelnames = channels
    spec.attribute("compression", "zip")
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    for key, value in metadata.items():
        spec.attribute(key, value)
    partial = path.with_name(f".{path.stem}.{secrets.token_hex(8)}.partial.exr")  # which nobody has put a link under
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
    data = np.round(np.clip(pixels, 0.0, 1.0) * 65535.0).astype(np.uint16)
    write_coded(path, data, "uint16", {"oiio:ColorSpace": "lin_rec709_scene"})


def write_coded(path: Path, pixels: npt.NDArray[np.generic], stored: str, attributes: Mapping[str, str]) -> None:
    """Write (h, w, c) ``pixels`` in the format of the suffix as ``stored`` numbers, with OpenImageIO's attributes."""
    import OpenImageIO

    data = np.ascontiguousarray(pixels)
    spec = OpenImageIO.ImageSpec(data.shape[1], data.shape[0], data.shape[2], OpenImageIO.TypeDesc(stored))
    for key, value in attributes.items():
        spec.attribute(key, value)
    target = OpenImageIO.ImageOutput.create(str(path))
    if target is None or not target.open(str(path), spec) or not target.write_image(data) or not target.close():
        raise PictureError(f"cannot write ({OpenImageIO.geterror()})", where=str(path), do="is the disk full?")
