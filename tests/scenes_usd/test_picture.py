"""Picture files: what is written comes back, and damage is named."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from notabug.scenes_usd.picture import PictureError, read_header, read_picture, write_coded, write_exr
from notabug.scenes_usd.picture_numbers import jpeg_quality

VALUES = np.array([[[0.0, 1.0, -0.25], [1e-6, 65000.0, 3.14159]], [[2.0, 0.5, 1e30], [7.0, 8.0, 9.0]]], np.float32)


def test_exr_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, VALUES, metadata={"notabug:scene": "texture/x"})
    picture = read_picture(path)
    np.testing.assert_array_equal(picture.pixels, VALUES)
    assert (picture.channels, picture.quantum, picture.relative_quantum) == (3, 2.0**-24, True)
    assert picture.metadata["notabug:scene"] == "texture/x"
    assert [each.name for each in tmp_path.iterdir()] == ["a.exr"], "no partial file stays"


def test_half_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    values = np.float32([[[1 / 3, 100.1, 1e-5]]])
    write_exr(path, values, half=True)
    picture = read_picture(path)
    np.testing.assert_array_equal(picture.pixels, values.astype(np.float16).astype(np.float32))
    assert (picture.quantum, picture.relative_quantum) == (2.0**-11, True)


def test_non_finite_values_survive(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    values = np.float32([[[np.nan, np.inf, -np.inf]]])
    write_exr(path, values)
    np.testing.assert_array_equal(read_picture(path).pixels, values)


def test_one_channel_is_repeated(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, VALUES[:, :, :1])
    picture = read_picture(path)
    assert picture.channels == 1
    np.testing.assert_array_equal(picture.pixels, np.repeat(VALUES[:, :, :1], 3, axis=2))


def test_alpha_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, np.concatenate([VALUES, VALUES[:, :, :1]], axis=2))
    picture = read_picture(path)
    assert picture.channels == 4
    np.testing.assert_array_equal(picture.pixels, VALUES)


def test_missing_and_empty(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    with pytest.raises(PictureError, match=r"a\.exr: no such file"):
        read_picture(path)
    path.touch()
    with pytest.raises(PictureError, match="0 bytes"):
        read_picture(path)
    with pytest.raises(PictureError, match="no such file"):
        read_picture(tmp_path)


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.txt"])
def test_text_is_no_picture(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text("this is a log file, not a picture\n" * 20)
    with pytest.raises(PictureError, match="not a picture"):
        read_picture(path)


@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9, 0.999])
def test_truncated_exr(kept: float, tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, np.random.default_rng(0).random((64, 64, 3), np.float32))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    with pytest.raises(PictureError, match=r"damaged|not a picture"):
        read_picture(path)


def test_truncated_png(tmp_path: Path, png: Callable[..., bytes]) -> None:
    data = png(np.random.default_rng(0).integers(0, 256, 64 * 64 * 3, np.uint8).tobytes(), 64, 64)
    path = tmp_path / "a.png"
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(PictureError, match="damaged"):
        read_picture(path)


def test_more_pixels_than_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, VALUES)
    monkeypatch.setattr("notabug.scenes_usd.picture.MAX_PIXELS", 3)
    with pytest.raises(PictureError, match=r"the header claims 2 x 2 pixels of 3 channels; expected at most 3 pixels"):
        read_picture(path)


def test_huge_header(tmp_path: Path) -> None:
    """117 bytes that claim five gigabytes are refused before they are allocated, here by OpenImageIO itself."""
    path = tmp_path / "a.hdr"
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 20000 +X 20000\n" + bytes(64))
    with pytest.raises(PictureError, match="header"):
        read_picture(path)


def test_huge_exr_header(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, VALUES)
    data = path.read_bytes()
    window, huge = struct.pack("<4i", 0, 0, 1, 1), struct.pack("<4i", 0, 0, 99_999, 99_999)
    assert window in data
    path.write_bytes(data.replace(window, huge))
    with pytest.raises(PictureError):
        read_picture(path)


def test_unwritable_folder(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="cannot write"):
        write_exr(tmp_path / "gone" / "a.exr", VALUES)


def test_the_first_row_of_a_pfm_is_the_lowest(tmp_path: Path) -> None:
    """As the format's description by Debevec says."""
    path = tmp_path / "two.pfm"
    path.write_bytes(b"PF\n1 2\n-1.0\n" + np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], "<f4").tobytes())
    assert read_picture(path).pixels[:, 0, 0].tolist() == [1.0, 0.0]


STEPS = np.arange(18, dtype=np.float32).reshape(2, 3, 3) * 10 / 255


def coded(path: Path, pixels: np.ndarray, stored: str = "uint8", **attributes: object) -> Path:
    write_coded(path, pixels, stored, attributes)  # type: ignore[arg-type]
    return path


@pytest.mark.parametrize(
    ("number", "stored"),
    [
        (0, lambda p: p),
        (1, lambda p: p[:, ::-1]),
        (2, lambda p: p[::-1]),
        (3, lambda p: p[::-1, ::-1]),
        (4, lambda p: p.transpose(1, 0, 2)),
        (5, lambda p: p[:, ::-1].transpose(1, 0, 2)),
        (6, lambda p: p[::-1].transpose(1, 0, 2)),
        (7, lambda p: p[::-1, ::-1].transpose(1, 0, 2)),
    ],
)
def test_the_orientations_of_dpx(number: int, stored: Callable[[np.ndarray], np.ndarray], tmp_path: Path) -> None:
    """SMPTE 268M: along a line and from line to line, 0 is right and down, 4 is down and right."""
    path = coded(tmp_path / "a.dpx", stored(STEPS))
    data = bytearray(path.read_bytes())
    data[768:770] = struct.pack(">H" if data[:4] == b"SDPX" else "<H", number)
    path.write_bytes(data)
    np.testing.assert_allclose(read_picture(path).pixels, STEPS, atol=1e-6)
    header = read_header(path)
    assert (header.width, header.height) == (3, 2)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif"])
def test_orientation_in_other_formats(name: str, tmp_path: Path) -> None:
    flat = np.full((8, 16, 3), 100 / 255, np.float32)
    path = coded(tmp_path / name, flat, Orientation=6)
    picture = read_picture(path)
    assert picture.pixels.shape == (16, 8, 3)
    assert (read_header(path).width, read_header(path).height) == (8, 16)
    assert picture.notes == ("its Orientation is 6: columns are stored as rows, the right one first",)


@pytest.mark.parametrize(("bits", "turned"), [(0x00, 4), (0x10, 3), (0x20, 1), (0x30, 2)])
def test_openimageio_turns_a_tga_by_its_descriptor(bits: int, turned: int, tmp_path: Path) -> None:
    stored = {1: STEPS, 2: STEPS[:, ::-1], 3: STEPS[::-1, ::-1], 4: STEPS[::-1]}[turned]
    texels = np.rint(stored[:, :, ::-1] * 255).astype(np.uint8).tobytes()
    (tmp_path / "a.tga").write_bytes(struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, 3, 2, 24, bits) + texels)
    np.testing.assert_allclose(read_picture(tmp_path / "a.tga").pixels, STEPS, atol=1e-6)


@pytest.mark.parametrize("quality", [10, 50, 75, 90, 99])
def test_the_quality_of_a_jpeg(quality: int, tmp_path: Path) -> None:
    path = coded(tmp_path / "a.jpg", np.full((16, 16, 3), 0.5, np.float32), Compression=f"jpeg:{quality}")
    assert abs(jpeg_quality(path.read_bytes()) - quality) <= 1 + (quality < 25) * 4, "tables are clipped to 255"
    lossy = read_picture(path).lossy
    assert lossy is not None
    assert lossy.suffix == ".jpg"
    assert jpeg_quality(b"\xff\xd8") == 50
    assert jpeg_quality(path.read_bytes()[:40]) == 50


@pytest.mark.parametrize(
    ("name", "stored", "compression", "lossy"),
    [
        ("a.exr", "half", "dwaa:45", True),
        ("a.exr", "float", "dwab", True),
        ("a.exr", "half", "b44", True),
        ("a.exr", "float", "b44", False),
        ("a.exr", "half", "zip", False),
        ("a.exr", "float", "pxr24", False),
        ("a.tif", "uint8", "lzw", False),
        ("a.png", "uint8", "", False),
    ],
)
def test_which_codings_lose_more_than_a_step(
    name: str, stored: str, compression: str, lossy: bool, tmp_path: Path
) -> None:
    pixels = np.random.default_rng(0).random((32, 32, 3), np.float32)
    picture = read_picture(coded(tmp_path / name, pixels, stored, compression=compression))
    assert (picture.lossy is not None) == lossy
    if not lossy:
        step = picture.quantum * (np.abs(pixels) if picture.relative_quantum else 1.0)
        assert (np.abs(picture.pixels - pixels) <= step).all()


def test_a_tiff_may_hold_a_jpeg(tmp_path: Path) -> None:
    """OpenImageIO reads such files and does not write them."""
    image = pytest.importorskip("PIL.Image")
    image.fromarray(np.full((16, 16, 3), 90, np.uint8)).save(tmp_path / "a.tif", compression="jpeg")
    lossy = read_picture(tmp_path / "a.tif").lossy
    assert lossy is not None
    assert lossy.name == "TIFF with jpeg, taken to lose as much as JPEG of quality 50"


def test_rgbe_cuts_up_to_a_step_of_the_largest_channel(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).random((64, 64, 3), np.float32) * np.float32([1.0, 0.1, 0.01])
    picture = read_picture(coded(tmp_path / "a.hdr", pixels, "float"))
    lost = (pixels - picture.pixels) / pixels.max(axis=2, keepdims=True)
    assert lost.min() >= -1e-6
    assert 0.9 * picture.quantum < lost.max() <= picture.quantum
    assert picture.shared_exponent


def test_values_that_came_through_a_coarser_format(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).random((16, 16, 3), np.float32)
    for values, quantum, relative in (
        (pixels, 2.0**-24, True),
        (pixels.astype(np.float16), 2.0**-11, True),
        (np.rint(pixels * 255) / 255, 1 / 255, False),
        (np.rint(pixels * 65535) / 65535, 1 / 65535, False),
        (np.rint(pixels * 255) / 255 * 1.5, 2.0**-24, True),
    ):
        write_exr(tmp_path / "a.exr", values)
        picture = read_picture(tmp_path / "a.exr")
        assert (picture.quantum, picture.relative_quantum) == (quantum, relative)


def test_luminance_is_a_picture_and_the_first_page_counts(tmp_path: Path) -> None:
    grey = read_picture(coded(tmp_path / "a.png", STEPS[:, :, :1], "uint16"))
    assert grey.judged == ("Y",)
    np.testing.assert_allclose(grey.pixels, np.repeat(STEPS[:, :, :1], 3, axis=2), atol=1e-5)


def test_a_layer_among_very_many_channels(tmp_path: Path) -> None:
    """Red, green and blue far apart are read one by one."""
    import OpenImageIO

    names = [f"x{index:02}.{each}" for index in range(40) for each in "XYZ"]
    spec = OpenImageIO.ImageSpec(2, 2, 123, OpenImageIO.FLOAT)
    spec.channelnames = (*names[:60], "B", *names[60:90], "G", *names[90:], "R")
    values = np.tile(np.arange(123, dtype=np.float32), (2, 2, 1))
    target = OpenImageIO.ImageOutput.create(str(tmp_path / "a.exr"))
    assert target.open(str(tmp_path / "a.exr"), spec)
    assert target.write_image(values)
    assert target.close()
    assert read_picture(tmp_path / "a.exr").pixels[0, 0].tolist() == [122.0, 91.0, 60.0]
