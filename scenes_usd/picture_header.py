"""The headers of picture files, counted before any library sees more of them: how much is it to read this file?

Libraries take a time that grows with the square of an EXR's channels, keep every attribute, and unpack every text of a
PNG. A file of more than what no renderer writes is refused. One that is known to be little work is read in this
process, anything else in a child with limits (``picture_child``).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from notabug.scenes_usd.errors import NotabugError

MAX_CHANNELS = 1024  # of all layers of a part
MAX_ATTRIBUTES = 4096  # of a file
MAX_TEXTS = 64  # compressed chunks of a PNG, each of which may unpack to eight megabytes
MAX_PAGES = 1024
FEW_CHANNELS, FEW_ATTRIBUTES, FEW_PARTS, FEW_TEXTS = 64, 256, 16, 4  # up to which reading takes no time to speak of
SMALL = 64 << 20  # bytes of a file, likewise
TILE = 256  # pixels: with smaller tiles their table alone is long
_LONGEST = 255  # characters of an EXR's names

_MAGIC = {
    b"v/1\x01": "exr",
    b"\x89PNG\r\n\x1a\n": "png",
    b"II*\0": "tiff",
    b"MM\0*": "tiff",
    b"II+\0": "tiff",
    b"MM\0+": "tiff",
    b"#?": "plain",  # Radiance
    **{f"P{kind}".encode(): "plain" for kind in "123456fF7"},
    b"\xff\xd8\xff": "plain",  # JPEG
    b"BM": "plain",
    b"SDPX": "plain",
    b"XPDS": "plain",
    b"RIFF": "other",  # WebP
    b"GIF8": "other",
    b"8BPS": "other",
    b"DDS ": "other",
    b"SIMPLE": "other",  # FITS
    b"FOR4": "other",  # Maya's IFF
    b"\x01\xda": "other",  # SGI
    b"\x53\x80\xf6\x34": "other",  # Softimage
    b"\x80\x2a\x5f\xd7": "other",  # Cineon
    b"\0\0\x01\0": "other",  # ICO
    b"\0\0\0\x0c": "other",  # JPEG 2000 and JPEG XL
    b"\xff\x4f\xff\x51": "other",
    b"\xff\x0a": "other",
    b"/\x08g\xab": "other",
    b"\xab\x67\x08/": "other",
}
_WITHOUT_MAGIC = frozenset({".tga", ".tpic", ".rla"})


class PictureError(NotabugError):
    """A picture that cannot be read: missing, empty, truncated, not a picture, absurdly large."""


def is_little_work(path: Path) -> bool:
    """Whether reading the file at ``path`` is little work; raises PictureError where it is absurdly much."""
    try:
        with path.open("rb") as file:
            head = file.read(16)
            kind = next((kind for magic, kind in _MAGIC.items() if head.startswith(magic)), "")
            if not kind and path.suffix.lower() not in _WITHOUT_MAGIC:
                raise PictureError(
                    "not a picture (its first bytes are those of no format)",
                    where=str(path),
                    expected="EXR, PNG, TIFF, HDR or PFM",
                )
            small = path.stat().st_size <= SMALL
            if kind in ("exr", "png", "tiff"):
                counted = {"exr": _exr, "png": _png, "tiff": _tiff}[kind](file, str(path))
                return small and counted
            return small and kind == "plain"
    except (struct.error, IndexError):  # it ends within its header, which its library will say
        return True
    except OSError as error:
        raise PictureError("cannot be read", where=str(path), got=error.strerror or str(error)) from error


def _exr(file: IO[bytes], where: str) -> bool:
    file.seek(4)
    (flags,) = _numbers(file, "<I")
    several = bool(flags & 0x1000)
    attributes = parts = 0
    most_channels, tiny_tiles = 0, False
    while True:
        count = 0
        for name, size in _attributes(file):
            attributes, count = attributes + 1, count + 1
            _refuse(attributes, MAX_ATTRIBUTES, "attributes", where)
            start = file.tell()
            if name == b"channels":
                _refuse(size // 18, 2 * MAX_CHANNELS * 16, "channels", where)  # 18: a name of one letter and its zero
                channels = _channels(file.read(size))
                _refuse(channels, MAX_CHANNELS, "channels", where)
                most_channels = max(most_channels, channels)
            elif name == b"tiles":
                wide, high = _numbers(file, "<II")
                tiny_tiles = tiny_tiles or wide * high < TILE
            file.seek(start + size)
        if not count:
            break
        parts += 1
        _refuse(parts, MAX_ATTRIBUTES, "parts", where)
        if not several:
            break
    few = most_channels <= FEW_CHANNELS and attributes <= FEW_ATTRIBUTES and parts <= FEW_PARTS
    return few and not tiny_tiles


def _attributes(file: IO[bytes]) -> Iterator[tuple[bytes, int]]:
    """Name and size of each attribute of one header of an EXR, the file at the attribute's value."""
    while True:
        name = _name(file)
        if not name:
            return
        _name(file)  # its type
        (size,) = _numbers(file, "<I")
        yield name, size


def _name(file: IO[bytes]) -> bytes:
    """A text that ends with a zero; struct.error where it does not end."""
    start = file.tell()
    found, zero, _ = file.read(_LONGEST + 1).partition(b"\0")
    if not zero:
        raise struct.error("a name without an end")
    file.seek(start + len(found) + 1)
    return found


def _channels(listed: bytes) -> int:
    """The number of channels in an EXR's list of them: a name, a zero and 16 bytes each, and a zero at the end."""
    count = at = 0
    while at < len(listed) and listed[at]:
        at = listed.index(b"\0", at) + 17 if b"\0" in listed[at:] else len(listed)
        count += 1
    return count


def _png(file: IO[bytes], where: str) -> bool:
    at, chunks, texts = 8, 0, 0
    while True:
        file.seek(at)
        (length,) = _numbers(file, ">I")
        kind = file.read(4)
        if len(kind) < 4:
            raise struct.error("a chunk without a name")
        if kind == b"IEND":
            return texts <= FEW_TEXTS and chunks <= FEW_ATTRIBUTES
        if kind != b"IDAT":
            chunks += 1
            texts += kind in (b"zTXt", b"iTXt", b"iCCP")
            _refuse(texts, MAX_TEXTS, "compressed texts", where)
            _refuse(chunks, MAX_ATTRIBUTES, "chunks", where)
        at += 12 + length


def _tiff(file: IO[bytes], where: str) -> bool:
    file.seek(0)
    order = "<" if file.read(2) == b"II" else ">"
    big = _numbers(file, f"{order}H")[0] == 43
    if big:
        file.seek(8)
    (at,) = _numbers(file, order + ("Q" if big else "I"))
    pages = entries = 0
    while at:
        pages += 1
        _refuse(pages, MAX_PAGES, "pages", where)
        file.seek(at)
        (count,) = _numbers(file, order + ("Q" if big else "H"))
        entries += count
        _refuse(entries, MAX_ATTRIBUTES, "attributes", where)
        file.seek(count * (20 if big else 12), 1)
        (at,) = _numbers(file, order + ("Q" if big else "I"))
    return pages <= FEW_PARTS and entries <= FEW_ATTRIBUTES


def _numbers(file: IO[bytes], form: str) -> tuple[int, ...]:
    return struct.unpack(form, file.read(struct.calcsize(form)))


def _refuse(count: int, most: int, what: str, where: str) -> None:
    if count > most:
        raise PictureError(
            f"the header holds more than {most} {what}",
            where=where,
            expected=f"at most {most}",
            do="write the file without what is no picture",
        )
