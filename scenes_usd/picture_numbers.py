"""The numbers of picture files: the step of each format, formats that lose more than a step, and values that came
through a coarser format before."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import OpenImageIO


@dataclass(frozen=True, slots=True)
class Numbers:
    """The step of a number format at 1; whether it grows with the value, or with the largest channel of the pixel."""

    quantum: float
    relative: bool = False
    shared: bool = False


NUMBERS: dict[str, Numbers] = {
    "float": Numbers(2.0**-24, relative=True),
    "half": Numbers(2.0**-11, relative=True),
    "uint16": Numbers(1 / 65535),
    "uint12": Numbers(1 / 4095),
    "uint10": Numbers(1 / 1023),
    "uint8": Numbers(1 / 255),
    # Radiance: eight bits for each channel under the exponent of the largest, whose own eighth bit is always set
    "rgbe": Numbers(2.0**-7, relative=True, shared=True),
}
_PXR24 = Numbers(2.0**-16, relative=True)  # OpenEXR rounds floats to 24 bits, 15 of them behind the point
_SIGNED = {"int8": 127, "int16": 32767}
_WHOLE = {"uint8": 8, "uint16": 16}
_FEWEST = 16  # distinct values, below which it is chance that all are steps of an integer format
_STEPS = (255, 65535)  # of the integer formats from which pictures are converted to floats
_ROUNDED = 2.0**-22  # parts of a value by which conversions to float32 and back may move it


def numbers_of(spec: OpenImageIO.ImageSpec, kind: str, stored: str) -> Numbers:
    """The number format ``stored`` of channels in a file of the OpenImageIO format ``kind``."""
    if kind == "hdr":
        return NUMBERS["rgbe"]
    if kind == "openexr" and stored == "float" and _compression(spec) == "pxr24":
        return _PXR24
    if stored in _WHOLE:
        bits = spec.get_int_attribute("oiio:BitsPerSample", 0)
        return Numbers(1 / (2 ** (bits if 0 < bits < _WHOLE[stored] else _WHOLE[stored]) - 1))
    if stored in _SIGNED:
        return Numbers(1 / _SIGNED[stored])
    return NUMBERS.get(stored, NUMBERS["float"])  # 32-bit integers and doubles are read as float32


def once_coarser(pixels: npt.NDArray[np.float32], numbers: Numbers) -> Numbers:
    """``numbers``, or those of the coarser format through which all of ``pixels`` have come: half, or whole steps.

    >>> once_coarser(np.float32([0.5, 1.25, 3.0]), NUMBERS["float"]) == NUMBERS["half"]
    True
    """
    if numbers != NUMBERS["float"]:
        return numbers
    finite = pixels[np.isfinite(pixels)]
    with np.errstate(over="ignore"):
        if np.array_equal(finite.astype(np.float16), finite):
            return NUMBERS["half"]
    if finite.min(initial=0.0) < 0.0 or finite.max(initial=0.0) > 1.0:
        return numbers
    for steps in _STEPS:
        counted = finite.astype(np.float64) * steps
        whole = np.rint(counted)
        if (np.abs(counted - whole) <= _ROUNDED * steps).all() and np.unique(whole).size >= _FEWEST:
            return Numbers(1 / steps)
    return numbers


@dataclass(frozen=True, slots=True)
class Lossy:
    """A coding that loses more than a step, and with what OpenImageIO codes in the same way, to see how much.

    ``name`` is for people; ``suffix`` and ``attributes`` make a writer, of ``stored`` numbers. It codes ``block`` x
    ``block`` pixels together. ``bounded``: no value loses more than the step that its format declares.
    """

    name: str
    suffix: str
    stored: str = "uint8"
    attributes: dict[str, str] = field(default_factory=dict)
    block: int = 16  # JPEG's largest unit: two 8 x 8 blocks either way where colours are subsampled; DWA has 8, B44 4
    bounded: bool = False


UNKNOWN_QUALITY = 50  # of JPEG, half of its scale: what is assumed of a coding whose quality its files do not tell
_LOSSY_EXR = frozenset({"dwaa", "dwab", "b44", "b44a"})
_LOSSY_KINDS = {"webp": "WebP", "jpeg2000": "JPEG 2000", "jpegxl": "JPEG XL", "gif": "GIF", "dds": "DDS"}
_LOSSY_TIFF = frozenset({"jpeg", "jp2000", "webp", "lerc"})
# The means of the two example tables of ITU-T T.81, annex K.1, which libjpeg scales by its quality.
_LUMINANCE_MEAN, _CHROMINANCE_MEAN = 57.625, 86.015625


def lossy_of(spec: OpenImageIO.ImageSpec, kind: str, stored: str, path: Path) -> Lossy | None:
    """The coding of the file at ``path`` where it loses more than a step of its numbers."""
    compression = _compression(spec)
    if kind == "hdr":  # cutting all values moves the whole picture to one side, which no rounding does
        return Lossy("RGBE", ".hdr", "float", block=1, bounded=True)
    if kind == "openexr" and compression in _LOSSY_EXR:
        if compression.startswith("b44") and stored != "half":
            return None  # B44 leaves floats as they are
        level = spec.get_float_attribute("openexr:dwaCompressionLevel", 45.0)  # OpenEXR's default
        coded = f"{compression}:{level:g}" if compression.startswith("dwa") else compression
        return Lossy(compression.upper(), ".exr", stored, {"compression": coded})
    if kind == "jpeg":
        quality = jpeg_quality(path.read_bytes())
        sampling = spec.get_string_attribute("jpeg:subsampling", "4:2:0")
        return _jpeg(f"JPEG of quality {quality}, colours {sampling}", quality, sampling)
    name = _LOSSY_KINDS.get(kind) or (
        f"TIFF with {compression}" if kind == "tiff" and compression in _LOSSY_TIFF else ""
    )
    if not name:
        return None
    return _jpeg(f"{name}, taken to lose as much as JPEG of quality {UNKNOWN_QUALITY}", UNKNOWN_QUALITY, "4:2:0")


def _jpeg(name: str, quality: int, sampling: str) -> Lossy:
    return Lossy(name, ".jpg", "uint8", {"Compression": f"jpeg:{quality}", "jpeg:subsampling": sampling})


def jpeg_quality(data: bytes) -> int:
    """The quality 1..100 at which libjpeg's tables are as coarse as those of the JPEG file ``data``."""
    at, scales = 2, []
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker, length = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "big")
        if marker == 0xDA:  # the picture itself begins
            break
        if marker == 0xDB:
            scales += _scales(data[at + 4 : at + 2 + length])
        at += 2 + max(length, 2)
    scale = 100.0 * max(scales, default=1.0)  # percent
    return int(np.clip(round((200.0 - scale) / 2.0 if scale <= 100.0 else 5000.0 / scale), 1, 100))


def _scales(segment: bytes) -> list[float]:
    """How coarse each quantisation table in a DQT segment is, in parts of the example table for its components."""
    found, at = [], 0
    while at < len(segment):
        wide, number = segment[at] >> 4, segment[at] & 15
        table = np.frombuffer(segment[at + 1 : at + 1 + 64 * (1 + bool(wide))], ">u2" if wide else "u1")
        found.append(float(table.mean()) / (_CHROMINANCE_MEAN if number else _LUMINANCE_MEAN) if table.size else 1.0)
        at += 1 + 64 * (1 + bool(wide))
    return found


def _compression(spec: OpenImageIO.ImageSpec) -> str:
    return str(spec.get_string_attribute("compression", "")).partition(":")[0].lower()
