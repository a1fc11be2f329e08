"""Where the pixels of a file belong: its data and display windows, and the way in which its rows are stored."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import OpenImageIO

Pixels = npt.NDArray[np.float32]

TURNED = frozenset({5, 6, 7, 8})  # orientations that exchange width and height
_SAID = {
    2: "each row is stored from the right to the left",
    3: "rows are stored bottom up and from the right to the left",
    4: "rows are stored bottom up",
    5: "columns are stored as rows",
    6: "columns are stored as rows, the right one first",
    7: "columns are stored as rows, the right one first and each bottom up",
    8: "columns are stored as rows, each bottom up",
}
# Radiance's "+X +Y" stores columns from the left, each bottom up, which is 8, and "-X -Y" columns from the right, each
# top down, which is 6; OpenImageIO 3.2 has the two exchanged.
_RADIANCE = {6: 8, 8: 6}


def orientation(spec: OpenImageIO.ImageSpec, kind: str) -> int:
    """How the pixels are stored, 1 to 8 as in TIFF and Exif, in a file of the OpenImageIO format ``kind``."""
    found = int(spec.get_int_attribute("Orientation", 1))
    if kind == "hdr":
        found = _RADIANCE.get(found, found)
    return found if found in _SAID else 1


def placed(data: Pixels, spec: OpenImageIO.ImageSpec, kind: str) -> tuple[Pixels, tuple[str, ...]]:
    """``data`` (h, w, c) as stored, put in the display window and upright, and what that took, for people.

    A pixel (x, y) of the picture is the data's at (x - spec.x, y - spec.y) over the display window, and 0 where the
    data has none. The display window is thereby also a texture's unit square, as in OpenImageIO's own texture system.
    """
    turned = orientation(spec, kind)
    height, width = data.shape[:2]
    if kind == "dpx" and turned in TURNED:  # OpenImageIO exchanges the sides of the data, and not those of the window
        data = data.reshape(width, height, -1)
        height, width = width, height
    notes: tuple[str, ...] = ()
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    if (left, top, width, height) != (0, 0, spec.full_width, spec.full_height):
        data = _windowed(data, left, top, spec.full_width, spec.full_height)
        window = f"its data window is {width} x {height} at ({left}, {top})"
        notes += (f"{window} of the display window, {spec.full_width} x {spec.full_height}",)
    if turned != 1:
        data = _upright(data, turned)
        notes += (f"its Orientation is {turned}: {_SAID[turned]}",)
    return data, notes


def _windowed(data: Pixels, left: int, top: int, width: int, height: int) -> Pixels:
    """The window (height, width) whose corner lies at (-left, -top) of ``data``, 0 outside of it."""
    shown = np.zeros((height, width, data.shape[2]), data.dtype)
    rows, columns = (
        slice(max(0, at), max(0, min(size, at + count)))
        for at, size, count in ((top, height, data.shape[0]), (left, width, data.shape[1]))
    )
    if rows.start < rows.stop and columns.start < columns.stop:
        shown[rows, columns] = data[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    return shown


def _upright(data: Pixels, turned: int) -> Pixels:
    if turned in TURNED:
        data = data.transpose(1, 0, 2)
    across = turned in (2, 3, 6, 7)
    down = turned in (3, 4, 7, 8)
    return np.ascontiguousarray(data[:: -1 if down else 1, :: -1 if across else 1])
