"""Picture files: what is written comes back, and damage is named."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from notabug.scenes_usd.picture import PictureError, read_picture, write_exr

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
