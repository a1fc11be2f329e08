"""Misdeeds with the picture: none, an old one, a wrong one, one that is none, one that is too much."""

from __future__ import annotations

import array
import os
import struct
import zlib

from notabug.bench.misbehaving.job import MIB, deed, draw, grey, height, image, name, pictures, put, width, write


@deed
def no_image() -> None:
    pass


@deed
def empty_image() -> None:
    put(b"")


@deed
def folder_image() -> None:
    os.mkdir(image)


@deed
def fifo_image() -> None:
    os.mkfifo(image)


@deed
def linked_image() -> None:
    os.symlink(f"{pictures}/good.pfm", image)


@deed
def hard_linked_image() -> None:
    """Of a picture that was there before the job."""
    os.utime(f"{pictures}/{name}.pfm", (1e9, 1e9))
    os.link(f"{pictures}/{name}.pfm", image)


@deed
def stale_image() -> None:
    write(grey)
    os.utime(image, (1e9, 1e9))


@deed
def image_of_the_future() -> None:
    draw()
    os.utime(image, (4e9, 4e9))


@deed
def wrong_size() -> None:
    write([0.25] * 48, (4, 4))


@deed
def negative_size() -> None:
    write(grey, (-width, -height))


@deed
def truncated() -> None:
    write(grey, cut=len(grey))


@deed
def runs_on() -> None:
    """The picture, and then eight megabytes that are none of it."""
    draw()
    with open(image, "ab") as out:
        out.write(bytes(8 * MIB))


@deed
def non_finite() -> None:
    write([*grey[:-1], float("nan")])


@deed
def enormous_values() -> None:
    write([3.4e38] * len(grey))


@deed
def negative() -> None:
    write([*grey[:-1], -1.0])


@deed
def swapped_bytes() -> None:
    """Its header says that the highest byte comes first."""
    put(f"PF\n{width} {height}\n1.0\n".encode() + array.array("f", grey).tobytes())


@deed
def one_channel() -> None:
    write(grey[::3], channels=1)


@deed
def not_a_picture() -> None:
    put(b"<script>alert('no')</script>\n" * 50)


@deed
def huge_header() -> None:
    write(grey, (100_000, 100_000))


@deed
def endless_header() -> None:
    put(b"PF\n" + b"9" * (8 * MIB))


@deed
def thousands_of_channels() -> None:
    """An EXR's header, whose channels a library would compare each with each."""
    listed = b"".join(f"c{number}\0".encode() + struct.pack("<iIii", 2, 0, 1, 1) for number in range(20_000)) + b"\0"
    put(b"v/1\x01" + struct.pack("<I", 2) + b"channels\0chlist\0" + struct.pack("<I", len(listed)) + listed + b"\0")


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(wide: int, high: int, *chunks: bytes) -> bytes:
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", wide, high, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(chunks) + chunk(b"IEND", b"")


@deed
def hundreds_of_texts() -> None:
    """A PNG whose texts unpack to eight megabytes each."""
    text = chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(8 * MIB)))
    put(png(width, height, *[text] * 500, chunk(b"IDAT", zlib.compress(bytes((3 * width + 1) * height)))))


@deed
def picture_bomb() -> None:
    """A PNG of 40,000 x 40,000 pixels in five megabytes: the same packed block of zeros again and again."""
    side = 40_000
    whole, rest = divmod((3 * side + 1) * side, MIB)
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    blocks = [packer.compress(bytes(MIB)) + packer.flush(zlib.Z_FULL_FLUSH) for _ in range(2)]
    last = packer.compress(bytes(rest)) + packer.flush()
    check = struct.pack(">HH", (whole * MIB + rest) % 65521, 1)  # Adler-32 of zeros
    put(png(side, side, chunk(b"IDAT", b"\x78\x9c" + blocks[0] + blocks[1] * (whole - 1) + last + check)))
