"""What UsdLux says of a dome's picture: its file, its parameterization, and where its pole points."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.fence import check_inside, outermost
from notabug.scenes_usd.opinion import Opinion
from notabug.scenes_usd.picture import Picture, PictureError
from notabug.scenes_usd.reader_asset import Space, automatic_space, exact_pixels, read_asset
from notabug.scenes_usd.reader_values import fault, opinion, shown, value, where, world_matrix
from notabug.scenes_usd.reading import note, recovered
from notabug.scenes_usd.scene import Emitter, Floats, Texture
from notabug.scenes_usd.srgb import decode_srgb

_FILE, _FORMAT = "inputs:texture:file", "inputs:texture:format"
_LATLONG = ("automatic", "latlong")
_POLES = ("scene", "Y", "Z")
_STANDING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # 90 degrees about x: +y goes to +z
_SRGB = ("sRGB", "srgb_rec709_scene", "srgb_texture")  # names of colour spaces
_LINEAR = ("raw", "linear", "lin_rec709", "lin_rec709_scene", "Linear Rec.709 (sRGB)")
MOST_PIXELS = 1 << 25
_SIMILAR = 1e-5  # relative deviation of a dome's axes from a rotation


def with_picture(prim: Usd.Prim, emitter: Emitter, root: Path | None) -> Emitter:
    """``emitter`` of the dome ``prim`` with the picture that it names, if any, in the dome's own frame.

    The picture's file must be below ``root``, unless it is None. UsdLux: its upper row is +Y, its middle +Z, longitude
    pi/2 +X, a quarter of the width from the left. Of a DomeLight_1 the pole may be the stage's up axis or +Z: then it
    is turned by 90 degrees about x, as OpenUSD's own adapter has it.
    """
    asset = value(prim, _FILE, "asset")
    if not getattr(asset, "path", ""):
        return emitter
    none = opinion(prim, _FILE, "asset", "", "the dome's colour alone")
    given = str(value(prim, _FORMAT, "word", "automatic"))
    if given not in _LATLONG:
        raise fault(
            prim,
            _FORMAT,
            "this parameterization is not supported",
            expected=" or ".join(_LATLONG),
            got=given,
            mends=none,
        )
    axes = recovered(lambda: _axes(prim, none), np.eye(3))
    texture = _texture(prim, str(asset.path), str(asset.resolvedPath), root, none)
    height, width = texture.pixels.shape[:2]
    if width != 2 * height:
        note(
            "approximated",
            where(prim, _FILE),
            f"{width} x {height} pixels: a latitude-longitude map is twice as wide as high",
        )
    return replace(emitter, axes=axes, texture=texture)


def _axes(prim: Usd.Prim, none: tuple[Opinion, ...]) -> Floats:
    """The rows (3, 3) are where the dome's own x, y and z point to in world space: rotated, or mirrored."""
    linear = world_matrix(prim)[:3, :3]
    size = abs(float(np.linalg.det(linear))) ** (1.0 / 3.0)
    turned = linear / size
    if np.abs(turned @ turned.T - np.eye(3)).max() > _SIMILAR:
        raise fault(
            prim,
            "xformOpOrder",
            "a dome with a picture is scaled unevenly, or sheared",
            expected="a rotation",
            got=shown(linear.round(6).tolist()),
            mends=none,
        )
    pole = "Y"
    if prim.GetTypeName() == "DomeLight_1":
        pole = str(value(prim, "poleAxis", "word", "scene"))
        if pole not in _POLES:
            raise fault(prim, "poleAxis", "no such axis", expected=", ".join(_POLES), got=pole, mends=none)
        if pole == "scene":
            pole = str(UsdGeom.GetStageUpAxis(prim.GetStage()))
    u, _, v = np.linalg.svd(_STANDING @ turned if pole == "Z" else turned)  # the nearest one whose rows are square
    return np.ascontiguousarray(u @ v)


def _texture(prim: Usd.Prim, path: str, name: str, root: Path | None, none: tuple[Opinion, ...]) -> Texture:
    """The picture, linear. What a file of eight bits and three channels holds is sRGB, as of any texture."""
    got = f"@{path}@"
    if not name:
        raise fault(prim, _FILE, "no such texture file", got=got, do="paths are relative to their layer", mends=none)
    if root is not None:
        check_inside(Path(outermost(name)), root, where=where(prim, _FILE), got=got)
    try:
        picture = read_asset(name)
    except PictureError as error:
        raise SceneError(
            error.what, where=where(prim, _FILE), expected=error.expected, got=error.got or name, do=error.do
        ) from error
    pixels = exact_pixels(picture)
    if not np.isfinite(pixels).all() or pixels.min() < 0.0:
        raise fault(prim, _FILE, "a dome's pixels are out of range", expected="numbers from 0 on", got=got, mends=none)
    if not picture.opaque:
        note("approximated", where(prim, _FILE), "the picture's alpha is left out")
    if pixels.shape[0] * pixels.shape[1] > MOST_PIXELS:
        got = f"{pixels.shape[1]} x {pixels.shape[0]}"
        raise fault(prim, _FILE, "a dome's picture is too large", expected="at most 8192 x 4096", got=got, mends=none)
    space = _space(prim, picture)
    return Texture(Path(name), decode_srgb(pixels) if space == "sRGB" else pixels, "repeat", "clamp", space)


def _space(prim: Usd.Prim, picture: Picture) -> Space:
    """What the attribute's metadata says of its colour space, or what the file's kind means by itself."""
    said = str(prim.GetAttribute(_FILE).GetColorSpace())
    if said in _SRGB:
        return "sRGB"
    return "raw" if said in _LINEAR else automatic_space(picture)
