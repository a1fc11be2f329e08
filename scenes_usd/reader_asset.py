"""Picture files that a stage names, also inside a .usdz package: their numbers, and the colour space they mean."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from pxr import Ar

from notabug.scenes_usd.picture import Picture, PictureError, read_picture
from notabug.scenes_usd.scene import Floats
from notabug.scenes_usd.temporary import temporary_folder

Space = Literal["raw", "sRGB"]


def read_asset(name: str, *, with_alpha: bool = False) -> Picture:
    """A picture file, also one inside a .usdz package; ``with_alpha`` as for read_picture."""
    if not Ar.IsPackageRelativePath(name):
        return read_picture(Path(name), with_alpha=with_alpha)
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(name))
    if not asset:
        raise PictureError("cannot be opened in its package", where=name)
    inner = Ar.SplitPackageRelativePathInner(name)[1]
    with temporary_folder() as folder:
        copy = folder / f"texture{Path(inner).suffix}"
        copy.write_bytes(asset.GetBuffer())
        return read_picture(copy, with_alpha=with_alpha)


def exact_pixels(picture: Picture) -> Floats:
    """The pixels (h, w, 3), with alpha if it was read (h, w, 4), as float64.

    Of whole numbers they are the exact fractions, without the float32 they came through.
    """
    pixels: Floats = picture.pixels.astype(np.float64)
    if picture.alpha is not None:
        pixels = np.concatenate([pixels, picture.alpha[..., None].astype(np.float64)], axis=2)
    if picture.quantum in (1 / 255, 1 / 65535):
        return np.asarray(np.rint(pixels / picture.quantum) / round(1 / picture.quantum))
    return pixels


def automatic_space(picture: Picture) -> Space:
    """UsdPreviewSurface, of ``auto``: eight bits and three or four channels are sRGB, all else is linear."""
    return "sRGB" if picture.channels in (3, 4) and picture.stored == "uint8" else "raw"
