"""``python docs/figures.py``: render figures.png, our counterparts of the paper's figures, with the in-house tracer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO

from notabug.references.tracer.envelope import trace_picture
from notabug.references.tracer.options import Options
from notabug.scenes_usd.reader import read_scene

SIDE, GAP, COLUMNS = 256, 6, 4
# scene, variants, float32; facets shadow each other in all of them
PANELS: tuple[tuple[str, dict[str, str], bool], ...] = (
    ("acne/grazing_plane", {"camera_distance": "1e3", "light_elevation": ".1"}, True),
    ("acne/with_terminator", {}, True),
    ("terminator/sphere", {"tessellation": "16x8"}, False),
    ("separation/t_highlight", {}, False),
    ("separation/t_highlight", {"part": "diffuse"}, False),
    ("separation/t_highlight", {"part": "specular"}, False),
    ("separation/cutoff", {}, False),
    ("mirror/corner", {}, False),
    ("visibility/coincident_spheres", {}, True),
    ("visibility/standing", {}, True),
    ("texture/uneven_quad", {"split": "split02"}, False),
    ("texture/uneven_quad", {"split": "grid15"}, False),
)


def panel(scene: str, variants: dict[str, str], single: bool) -> npt.NDArray[np.float64]:
    """One picture, cut to a square, sRGB-encoded 0..1."""
    drawn = trace_picture(
        read_scene(scene, variants),
        Options(shadows="facets"),
        samples=1 if single else 16,
        dtype=np.float32 if single else np.float64,
    )
    top, left = ((size - min(drawn.shape[:2])) // 2 for size in drawn.shape[:2])
    square = drawn[top : top + min(drawn.shape[:2]), left : left + min(drawn.shape[:2])]
    step = square.shape[0] / SIDE
    rows = ((np.arange(SIDE) + 0.5) * step).astype(int)
    linear = np.clip(square[rows][:, rows], 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def main() -> None:
    rows = -(-len(PANELS) // COLUMNS)
    sheet = np.ones((rows * (SIDE + GAP) - GAP, COLUMNS * (SIDE + GAP) - GAP, 3), np.float32)
    for i, each in enumerate(PANELS):
        y, x = (part * (SIDE + GAP) for part in divmod(i, COLUMNS))
        sheet[y : y + SIDE, x : x + SIDE] = panel(*each)
    image = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(sheet.shape[1], sheet.shape[0], 3, OpenImageIO.UINT8))
    image.set_pixels(image.roi, sheet)
    image.write(str(Path(__file__).with_name("figures.png")))


if __name__ == "__main__":
    main()
