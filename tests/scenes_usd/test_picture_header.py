"""Files that are much work: refused by their headers, or read in a child with limits, with the same result."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

from notabug.scenes_usd import picture, picture_child, picture_header
from notabug.scenes_usd.picture import PictureError, read_header, read_picture, write_exr, write_png

PIXELS = np.random.default_rng(3).random((6, 5, 3)).astype(np.float32)


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> None:
    """No library, here or in a child, gets to see the file."""
    monkeypatch.setattr(picture, "_open", lambda path: 1 / 0)
    monkeypatch.setattr(picture, "read_by_child", lambda *_, **__: 1 / 0)


def exr(channels: int = 3, attributes: int = 0) -> bytes:
    """An EXR's header, and nothing behind it."""
    listed = b"".join(b"c%d\0" % index + struct.pack("<IB3xII", 1, 0, 1, 1) for index in range(channels)) + b"\0"
    values = [(b"channels", b"chlist", listed)]
    values += [(b"a%d" % index, b"int", struct.pack("<I", index)) for index in range(attributes)]
    body = b"".join(name + b"\0" + kind + b"\0" + struct.pack("<I", len(v)) + v for name, kind, v in values)
    return b"v/1\x01" + struct.pack("<I", 2) + body + b"\0"


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(folder: Path, texts: int, kind: bytes = b"zTXt") -> bytes:
    """A PNG with so many texts before its pixels."""
    write_png(folder / "plain.png", PIXELS)
    data = (folder / "plain.png").read_bytes()
    place = data.index(b"IDAT") - 4
    packed = zlib.compress(bytes(7 << 20))
    text = b"k\0\0" + packed if kind == b"zTXt" else b"k\0\1\0\0\0" + packed
    return data[:place] + chunk(kind, text) * texts + data[place:]


def tiff(pages: int, big: bool = False) -> bytes:
    """Empty pages, each of which names the next one."""
    if big:
        head, page, step = b"II+\0\x08\0\0\0" + struct.pack("<Q", 16), "<QQ", 16
    else:
        head, page, step = b"II*\0" + struct.pack("<I", 8), "<HI", 6
    at = len(head)
    return head + b"".join(
        struct.pack(page, 0, 0 if index == pages - 1 else at + step * (index + 1)) for index in range(pages)
    )


@pytest.mark.usefixtures("unread")
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("channels", "1024 channels"),
        ("a million channels", "channels"),
        ("attributes", "4096 attributes"),
        ("zTXt", "64 compressed texts"),
        ("iTXt", "64 compressed texts"),
        ("pages", "1024 pages"),
        ("pages without end", "1024 pages"),
        ("big pages", "1024 pages"),
    ],
)
def test_what_no_renderer_writes_is_refused_by_its_header(name: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(
        {
            "channels": lambda: exr(channels=1025),
            "a million channels": lambda: exr(channels=1_000_000),
            "attributes": lambda: exr(attributes=200_000),
            "zTXt": lambda: png(tmp_path, 65),
            "iTXt": lambda: png(tmp_path, 2000, b"iTXt"),
            "pages": lambda: tiff(1025),
            "pages without end": lambda: b"II*\0" + struct.pack("<IHI", 8, 0, 8),
            "big pages": lambda: tiff(1025, big=True),
        }[name]()
    )
    for read in (read_header, read_picture):
        with pytest.raises(PictureError, match=says):
            read(path)


def test_what_renderers_write_is_little_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture, "read_by_child", lambda *_, **__: 1 / 0)
    write_exr(tmp_path / "a.exr", PIXELS, metadata={f"key{index}": "value" for index in range(40)})
    write_png(tmp_path / "a.png", PIXELS)
    for suffix in ("tif", "hdr", "jpg", "pfm"):
        made = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(5, 6, 3, OpenImageIO.FLOAT))
        made.set_pixels(made.roi, PIXELS)
        assert made.write(str(tmp_path / f"a.{suffix}"))
    for path in sorted(tmp_path.iterdir()):
        assert read_picture(path).pixels.shape == PIXELS.shape, path.name
        assert read_header(path).width == 5


def heavy(folder: Path) -> Iterator[Path]:
    """Files that are much work, or may be, and are pictures all the same."""
    write_exr(folder / "attributes.exr", PIXELS, metadata={f"key{index}": "value" for index in range(300)})
    yield folder / "attributes.exr"
    (folder / "texts.png").write_bytes(png(folder, 6))
    yield folder / "texts.png"
    made = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(5, 6, 3, OpenImageIO.UINT8))
    made.set_pixels(made.roi, PIXELS)
    assert made.write(str(folder / "a.webp"))
    yield folder / "a.webp"


def test_a_child_reads_what_this_process_would(tmp_path: Path) -> None:
    for path in heavy(tmp_path):
        assert not picture_header.is_little_work(path)
        mine, read = picture.read_picture_here(path), read_picture(path)
        assert np.array_equal(mine.pixels, read.pixels)
        for name in ("channels", "quantum", "judged", "notes", "stored", "lossy", "metadata", "opaque"):
            assert getattr(mine, name) == getattr(read, name), name
        assert read_header(path) == picture.read_header_here(path)


def test_an_error_of_the_child_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.webp"
    path.write_bytes(b"RIFF" + bytes(100))
    with pytest.raises(PictureError, match=r"a\.webp: not a picture"):
        read_picture(path)


def test_a_reader_without_end_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_exr(tmp_path / "a.exr", PIXELS)
    (tmp_path / "sitecustomize.py").write_text(
        "import notabug.scenes_usd.picture_child as child, notabug.scenes_usd.picture as picture\n"
        "child.SECONDS = 1\n"
        "def forever(*_, **__):\n    while True: pass\n"
        "picture.read_picture_here = forever\n"
    )
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import sitecustomize as s; exec(open(sys.argv[1] + "
        "'/sitecustomize.py').read()); child.main(__import__('pathlib').Path(sys.argv[2]))"
    )
    run = picture_child.subprocess.run

    def start(command: list[str], **how: object) -> object:
        return run([command[0], "-c", code, str(tmp_path), command[-1]], **how)

    monkeypatch.setattr(picture_child.subprocess, "run", start)
    with pytest.raises(PictureError, match="ends its reader"):
        picture_child.read_by_child(tmp_path / "a.exr", "", srgb=False, header=False)
