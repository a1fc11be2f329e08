"""Pictures of unknown making: any bytes are a picture or a clear error, and no header is believed without bounds."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from notabug.scenes_usd.picture import MAX_PIXELS, PictureError, read_header, read_picture, write_exr, write_png


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small picture in each format that renderers write."""
    import OpenImageIO

    folder = tmp_path_factory.mktemp("samples")
    pixels = np.random.default_rng(1).random((6, 5, 3)).astype(np.float32)
    write_exr(folder / "a.exr", pixels)
    write_png(folder / "a.png", pixels)
    for suffix in ("tif", "hdr"):
        made = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(5, 6, 3, OpenImageIO.FLOAT))
        made.set_pixels(made.roi, pixels)
        assert made.write(str(folder / f"a.{suffix}"))
    (folder / "a.pfm").write_bytes(b"PF\n5 6\n-1.0\n" + pixels[::-1].tobytes())
    return {path.suffix: path.read_bytes() for path in folder.iterdir()}


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_bytes_are_a_picture_or_a_clear_error(
    data: st.DataObject, samples: dict[str, bytes], tmp_path: Path
) -> None:
    suffix = data.draw(st.sampled_from(sorted(samples)))
    damaged = bytearray(samples[suffix])
    for _ in range(data.draw(st.integers(1, 6))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / f"damaged{suffix}"
    path.write_bytes(damaged[: data.draw(st.integers(1, len(damaged)))])
    try:
        picture = read_picture(path)
    except PictureError:
        return
    assert picture.pixels.shape[2] == 3
    assert picture.pixels.shape[0] * picture.pixels.shape[1] <= MAX_PIXELS


@given(data=st.binary(max_size=300))
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_no_crash(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "any.exr"
    path.write_bytes(data)
    with pytest.raises(PictureError):
        read_header(path)


@pytest.mark.parametrize("side", [100_000, 2_000_000_000])
def test_a_header_of_ten_thousand_million_pixels_is_refused(
    side: int, samples: dict[str, bytes], tmp_path: Path
) -> None:
    data = samples[".exr"]
    small, large = struct.pack("<iiii", 0, 0, 4, 5), struct.pack("<iiii", 0, 0, side - 1, side - 1)
    assert data.count(small) == 2  # data and display window
    path = tmp_path / "huge.exr"
    path.write_bytes(data.replace(small, large))
    with pytest.raises(PictureError):
        read_picture(path)
