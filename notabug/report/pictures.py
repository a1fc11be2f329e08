"""Pictures for the page: linear floats to 8-bit sRGB, maps to magma, both as PNG inside a data address."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
import numpy.typing as npt

from notabug.report.magma import MAGMA
from notabug.scenes_usd.srgb import encode_srgb

Bytes = npt.NDArray[np.uint8]

_NOT_FINITE = (255, 0, 255)  # no picture of the corpus is magenta, so a NaN stands out


def tone_map(pixels: npt.NDArray[np.floating], white: float = 1.0) -> Bytes:
    """(h, w, 3) linear radiance as 8-bit sRGB (IEC 61966-2-1): ``white`` and above clip to 255, NaN is magenta."""
    finite = np.isfinite(pixels).all(axis=2)
    linear = np.clip(np.nan_to_num(pixels) / white, 0.0, 1.0)
    out: Bytes = np.rint(encode_srgb(linear) * 255.0).astype(np.uint8)
    out[~finite] = _NOT_FINITE
    return out


def levels(values: npt.NDArray[np.floating]) -> Bytes:
    """(h, w) in 0..1 as the 256 steps of the colour map."""
    steps: Bytes = np.rint(np.clip(np.nan_to_num(values, nan=1.0), 0.0, 1.0) * 255.0).astype(np.uint8)
    return steps


def png(pixels: Bytes) -> bytes:
    """A PNG file (ISO/IEC 15948) of (h, w, 3) sRGB, or of (h, w) indices into magma."""
    height, width = pixels.shape[:2]
    indexed = pixels.ndim == 2
    rows = pixels.reshape(height, -1)
    if indexed:
        filtered = rows
        kind = np.zeros((height, 1), np.uint8)
    else:  # filter "sub": each byte less the pixel to its left, which halves the size of shaded pictures
        filtered = rows.copy()
        filtered[:, 3:] = rows[:, 3:] - rows[:, :-3]
        kind = np.ones((height, 1), np.uint8)
    data = zlib.compress(np.hstack([kind, filtered]).tobytes(), 6)  # level 9 takes eight times as long for 9 % less
    header = struct.pack(">IIBBBBB", width, height, 8, 3 if indexed else 2, 0, 0, 0)
    palette = _chunk(b"PLTE", MAGMA) if indexed else b""
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + palette + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def address(pixels: Bytes) -> str:
    """A ``data:`` address of the PNG."""
    return "data:image/png;base64," + base64.b64encode(png(pixels)).decode("ascii")


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
