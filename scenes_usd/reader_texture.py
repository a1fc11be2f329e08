"""UsdUVTexture to Texture: the file is found beside its layer, read once and decoded to linear."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pxr import Ar, Usd, UsdShade

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.fence import check_inside, outermost
from notabug.scenes_usd.picture import Picture, PictureError, read_picture
from notabug.scenes_usd.reader_values import ROUNDED, check_plain, checked, fault, read
from notabug.scenes_usd.scene import Floats, Texture
from notabug.scenes_usd.srgb import decode_srgb

_INPUTS = {"file", "st", "wrapS", "wrapT", "sourceColorSpace", "scale", "bias", "fallback"}
_IDENTITY = {"scale": (1.0, 1.0, 1.0, 1.0), "bias": (0.0, 0.0, 0.0, 0.0)}

Wrap = Literal["repeat", "clamp"]


class Textures:
    """The textures of a stage by first use: the same file read in the same way has one index.

    Their files must be below ``root``, unless it is None.
    """

    def __init__(self, root: Path | None = None) -> None:
        self.root = root
        self.found: list[Texture] = []
        self._index: dict[tuple[str, str, str, str], int] = {}

    def index(self, user: Usd.Prim, attribute: str, output: Usd.Attribute) -> int:
        """The index of the texture whose ``output`` attribute feeds ``attribute`` of the shader ``user``."""
        shader = UsdShade.Shader(output.GetPrim())
        if str(shader.GetShaderId()) != "UsdUVTexture" or output.GetName() != "outputs:rgb":
            raise fault(
                user,
                attribute,
                "unsupported connection",
                expected="outputs:rgb of a UsdUVTexture",
                got=str(output.GetPath()),
            )
        prim = shader.GetPrim()
        for each in shader.GetInputs():
            if each.GetBaseName() not in _INPUTS:
                raise fault(prim, str(each.GetFullName()), "unknown input", expected=", ".join(sorted(_INPUTS)))
        for name, identity in _IDENTITY.items():
            check_plain(prim, f"inputs:{name}", _get(shader, name), identity, "not supported")
        _check_coordinates(shader)
        wrap_s, wrap_t = _wrap(shader, "wrapS"), _wrap(shader, "wrapT")
        space = checked(prim, "inputs:sourceColorSpace", _get(shader, "sourceColorSpace"), "word", "auto")
        if space not in ("raw", "sRGB", "auto"):
            raise fault(
                prim, "inputs:sourceColorSpace", "unknown colour space", expected="raw, sRGB or auto", got=space
            )
        asset = checked(prim, "inputs:file", _get(shader, "file"), "asset")
        name = asset.resolvedPath if asset is not None else ""
        if not name:
            got = f"@{asset.path}@" if asset is not None else "no path"
            raise fault(prim, "inputs:file", "no such texture file", got=got, do="paths are relative to their layer")
        if self.root is not None:
            check_inside(Path(outermost(name)), self.root, where=f"{prim.GetPath()}.inputs:file", got=f"@{asset.path}@")
        key = (name, wrap_s, wrap_t, space)
        if key not in self._index:
            self._index[key] = len(self.found)
            self.found.append(_load(prim, name, wrap_s, wrap_t, space))
        return self._index[key]


def _load(prim: Usd.Prim, name: str, wrap_s: Wrap, wrap_t: Wrap, space: str) -> Texture:
    try:
        picture = _read_asset(name)
    except PictureError as error:
        raise SceneError(
            error.what,
            where=f"{prim.GetPath()}.inputs:file",
            expected=error.expected,
            got=error.got or name,
            do=error.do,
        ) from error
    if not picture.opaque:
        raise fault(
            prim,
            "inputs:file",
            "textures with alpha are not supported",
            expected="no alpha, or one that is 1 everywhere",
            got=f"{picture.channels} channels with alpha below 1",
            do="store the texture without alpha, and opacity in the material",
        )
    if space == "auto":  # UsdPreviewSurface: eight bits and three or four channels are sRGB, all else is linear
        space = "sRGB" if picture.channels in (3, 4) and picture.stored == "uint8" else "raw"
    pixels: Floats = picture.pixels.astype(np.float64)
    if picture.quantum in (1 / 255, 1 / 65535):  # the exact fractions, without the float32 they were read through
        pixels = np.rint(pixels / picture.quantum) / round(1 / picture.quantum)
    if not (np.isfinite(pixels).all() and pixels.min() >= -ROUNDED and pixels.max() <= 1.0 + ROUNDED):
        raise fault(prim, "inputs:file", "texels out of range", expected="0 to 1", got=name)
    pixels = np.clip(pixels, 0.0, 1.0)
    linear = decode_srgb(pixels) if space == "sRGB" else pixels
    return Texture(Path(name), np.ascontiguousarray(linear), wrap_s, wrap_t, "sRGB" if space == "sRGB" else "raw")


def _read_asset(name: str) -> Picture:
    """A picture file, also one inside a .usdz package."""
    if not Ar.IsPackageRelativePath(name):
        return read_picture(Path(name))
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(name))
    if not asset:
        raise PictureError("cannot be opened in its package", where=name)
    inner = Ar.SplitPackageRelativePathInner(name)[1]
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / f"texture{Path(inner).suffix}"
        copy.write_bytes(asset.GetBuffer())
        return read_picture(copy)


def _check_coordinates(shader: UsdShade.Shader) -> None:
    """The texture must be looked up by the primvar ``st`` and nothing in between."""
    given = shader.GetInput("st")
    sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
    reader = UsdShade.Shader(sources[0].GetPrim()) if len(sources) == 1 else UsdShade.Shader()
    expected = 'a UsdPrimvarReader_float2 with varname "st"'
    if not reader or str(reader.GetShaderId()) != "UsdPrimvarReader_float2":
        got = str(reader.GetShaderId()) if reader else "no connection"
        raise fault(shader.GetPrim(), "inputs:st", "unsupported texture coordinates", expected=expected, got=got)
    name = checked(reader.GetPrim(), "inputs:varname", _get(reader, "varname"), "word", "")
    if name != "st":
        raise fault(
            reader.GetPrim(), "inputs:varname", "unsupported texture coordinates", expected="st", got=repr(name)
        )


def _wrap(shader: UsdShade.Shader, name: str) -> Wrap:
    found = checked(shader.GetPrim(), f"inputs:{name}", _get(shader, name), "word", "useMetadata")
    if found == "repeat":
        return "repeat"
    if found == "clamp":
        return "clamp"
    raise fault(shader.GetPrim(), f"inputs:{name}", "not supported", expected="repeat or clamp", got=found)


def _get(shader: UsdShade.Shader, name: str) -> Any:
    """The input's value, through interface connections, whatever its type; None where it has none."""
    given = shader.GetInput(name)
    sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
    return read(shader.GetPrim(), f"inputs:{name}", sources[0]) if sources else None
