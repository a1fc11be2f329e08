"""UsdUVTexture to Texture: the file is found beside its layer, read once and decoded to linear.

What the texture model of the tracer lacks is said with what it has: scale and bias are in the texels, and a border that
is black before a bias is a row of texels more that is clamped. Colours are as the file has them, whatever their alpha:
nothing is multiplied by it, and it is looked at only where something is connected to it. It is never decoded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pxr import Usd, UsdShade

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.fence import check_inside, outermost
from notabug.scenes_usd.picture import PictureError
from notabug.scenes_usd.reader_asset import automatic_space, exact_pixels, read_asset
from notabug.scenes_usd.reader_values import ROUNDED, check_number, checked, fault, read, where
from notabug.scenes_usd.reading import each_tried, note
from notabug.scenes_usd.scene import Floats, Placing, Texture, Wrap
from notabug.scenes_usd.srgb import decode_srgb

_INPUTS = {"file", "st", "wrapS", "wrapT", "sourceColorSpace", "scale", "bias", "fallback"}
_TRANSFORM_INPUTS = {"in", "rotation", "scale", "translation"}
_ONES, _ZEROS = (1.0,) * 4, (0.0,) * 4
_WRAPS = ("repeat", "clamp", "mirror", "black", "useMetadata")
_UDIM = "<UDIM>"

Four = tuple[float, float, float, float]
Use = Literal["colour", "light", "number", "normal"]
"""What a texture is: a colour from 0 to 1, light without an upper bound, one number from 0 to 1, or a vector."""
_RANGES: dict[Use, tuple[float, float]] = {
    "colour": (0.0, 1.0),
    "light": (0.0, math.inf),
    "number": (0.0, 1.0),
    "normal": (-1.0, 1.0),
}
_CHANNELS = {"outputs:r": 0, "outputs:g": 1, "outputs:b": 2, "outputs:a": 3}
_ALPHA = 3


@dataclass(frozen=True, slots=True, eq=False)
class Coordinates:
    """Where a texture is looked up: uv = (primvar ``name``) @ ``matrix`` (2, 2) + ``offset`` (2,).

    ``placing`` is the one UsdTransform2d that this follows from, where it follows from one alone.
    """

    name: str = "st"
    matrix: Floats = field(default_factory=lambda: np.eye(2))
    offset: Floats = field(default_factory=lambda: np.zeros(2))
    placing: Placing | None = None

    def then(self, matrix: Floats, offset: Floats) -> Coordinates:
        if np.array_equal(matrix, np.eye(2)) and not offset.any():
            return self
        return Coordinates(self.name, self.matrix @ matrix, self.offset @ matrix + offset)

    def same(self, other: Coordinates) -> bool:
        alike = np.array_equal(self.matrix, other.matrix) and np.array_equal(self.offset, other.offset)
        return self.name == other.name and alike

    def of(self, uv: Floats) -> Floats:
        """The coordinates (n, 2) of the primvar's values ``uv`` (n, 2), which are left alone where nothing moves."""
        if np.array_equal(self.matrix, np.eye(2)) and not self.offset.any():
            return uv
        return np.asarray(uv @ self.matrix + self.offset)


@dataclass(frozen=True, slots=True)
class _Look:
    """How a file is read; the same file read in the same way is one texture."""

    name: str
    wrap_s: Wrap
    wrap_t: Wrap
    space: str
    scale: Four = (1.0, 1.0, 1.0, 1.0)
    bias: Four = (0.0, 0.0, 0.0, 0.0)
    use: Use = "colour"
    channel: int = -1  # of a number

    @property
    def is_plain(self) -> bool:
        """Whether its texels are the file's."""
        return self.scale == (1.0,) * 4 and self.bias == (0.0,) * 4 and self.channel < 0


class Textures:
    """The textures of a stage by first use: the same file read in the same way has one index.

    Their files must be below ``root``, unless it is None.
    """

    def __init__(self, root: Path | None = None) -> None:
        self.root = root
        self.found: list[Texture] = []
        self._index: dict[_Look, tuple[int, Floats, Floats]] = {}

    def lookup(
        self, user: Usd.Prim, attribute: str, output: Usd.Attribute, use: Use = "colour"
    ) -> tuple[int, Coordinates]:
        """The index of the texture whose ``output`` feeds ``attribute`` of the shader ``user``, and where it is read.

        Raises SceneError where it cannot be read; where its file is missing but a fallback authored, that is drawn.
        """
        shader = UsdShade.Shader(output.GetPrim())
        outputs = ("outputs:rgb",) if use != "number" else tuple(_CHANNELS)
        if str(shader.GetShaderId()) != "UsdUVTexture" or output.GetName() not in outputs:
            raise fault(
                user,
                attribute,
                "unsupported connection",
                expected=f"{', '.join(outputs)} of a UsdUVTexture",
                got=str(output.GetPath()),
            )
        _check_inputs(shader, _INPUTS)
        names: list[str] = []
        each_tried(
            lambda: _coordinates(shader),
            lambda: _wrap(shader, "wrapS"),
            lambda: _wrap(shader, "wrapT"),
            lambda: _space(shader),
            lambda: _four(shader, "scale", _ONES),
            lambda: _four(shader, "bias", _ZEROS),
            lambda: names.append(self._file(shader)),
        )
        coordinates, space, (name,) = _coordinates(shader), _space(shader), names
        wrap_s, wrap_t = _wrap(shader, "wrapS"), _wrap(shader, "wrapT")
        scale, bias = _four(shader, "scale", _ONES), _four(shader, "bias", _ZEROS)
        look = _Look(name, wrap_s, wrap_t, space, scale, bias, use, _CHANNELS.get(str(output.GetName()), -1))
        if look not in self._index:
            texture, matrix, offset = _load(shader, look)
            self._index[look] = len(self.found), matrix, offset
            self.found.append(texture)
        index, matrix, offset = self._index[look]
        return index, coordinates.then(matrix, offset)

    def _file(self, shader: UsdShade.Shader) -> str:
        """The resolved name of the texture's file; "" where it is missing and there is a fallback in its stead."""
        prim = shader.GetPrim()
        asset = checked(prim, "inputs:file", _get(shader, "file"), "asset")
        got = f"@{asset.path}@" if asset is not None else "no path"
        if asset is not None and _UDIM in asset.path:
            raise fault(prim, "inputs:file", "tiled textures (UDIM) are not supported", expected="one picture", got=got)
        name = asset.resolvedPath if asset is not None else ""
        if not name:
            if _get(shader, "fallback") is not None:
                note("approximated", where(prim, "inputs:file"), f"no such texture file: its fallback is drawn ({got})")
                return ""
            raise fault(prim, "inputs:file", "no such texture file", got=got, do="paths are relative to their layer")
        if self.root is not None:
            check_inside(Path(outermost(name)), self.root, where=where(prim, "inputs:file"), got=got)
        return str(name)


def _load(shader: UsdShade.Shader, look: _Look) -> tuple[Texture, Floats, Floats]:
    """The texture, and what its coordinates are moved by: uv @ matrix (2, 2) + offset (2,)."""
    prim = shader.GetPrim()
    if not look.name:
        colour = _shown(np.array(_four(shader, "fallback", (0.0, 0.0, 0.0, 1.0)))[None, None], look)
        return Texture(Path("fallback"), colour), np.eye(2), np.zeros(2)
    linear, space = _texels(prim, look)
    wraps: list[Wrap] = []
    matrix, offset = np.eye(2), np.zeros(2)
    for axis, wrap in ((1, look.wrap_s), (0, look.wrap_t)):
        here = 1 - axis  # the coordinate that runs along this axis of the picture
        size = linear.shape[axis]
        lifted = wrap == "black" and any(look.bias)  # the bias lifts what is beyond the border, too
        if lifted:
            margin = [(0, 0), (0, 0), (0, 0)]
            margin[axis] = (1, 1)
            linear = np.pad(linear, margin)
            matrix[here, here], offset[here] = size / (size + 2), 1 / (size + 2)
        wraps.append("clamp" if lifted else wrap)
    if not look.is_plain:
        linear = _shown(linear * np.array(look.scale) + np.array(look.bias), look)
        low, high = _RANGES[look.use]
        if linear.min() < low - ROUNDED or linear.max() > high + ROUNDED:
            name = "inputs:scale" if look.scale != (1.0,) * 4 else "inputs:bias"
            got = f"{linear.min():g} to {linear.max():g}"
            raise fault(
                prim, name, "texels times scale plus bias are out of range", expected=f"{low:g} to {high:g}", got=got
            )
        linear = np.clip(linear, low, high)
    # texels that are no longer the file's have no file: what writes the scene writes them
    path = Path(look.name) if look.is_plain else Path(f"{Path(look.name).stem}-as-drawn")
    texture = Texture(path, np.ascontiguousarray(linear[..., :3]), wraps[0], wraps[1], space)
    return texture, matrix, offset


def _shown(texels: Floats, look: _Look) -> Floats:
    """Of ``texels`` (h, w, 4) the colours (h, w, 3), or three times the channel that is looked at."""
    return texels[..., :3] if look.channel < 0 else np.repeat(texels[..., look.channel, None], 3, axis=2)


def _texels(prim: Usd.Prim, look: _Look) -> tuple[Floats, Literal["raw", "sRGB"]]:
    """The file's pixels (h, w, 4), linear, and the colour space that they were decoded from.

    Alpha is 1 where the file has none, as the specification says.
    """
    name, space = look.name, look.space
    try:
        picture = read_asset(name, with_alpha=True)
    except PictureError as error:
        raise SceneError(
            error.what,
            where=f"{prim.GetPath()}.inputs:file",
            expected=error.expected,
            got=error.got or name,
            do=error.do,
        ) from error
    if space == "auto":
        space = automatic_space(picture)
        if space == "sRGB" and look.use in ("number", "normal") and look.channel != _ALPHA:
            what = f"not said: a {look.use} of eight bits is decoded as sRGB, as the specification has it"
            note("approximated", where(prim, "inputs:sourceColorSpace"), what)
    pixels = exact_pixels(picture)
    if pixels.shape[2] == _ALPHA:
        pixels = np.concatenate([pixels, np.ones((*pixels.shape[:2], 1))], axis=2)
    low, high = _RANGES[look.use]
    used = _shown(pixels, look)
    if not (np.isfinite(used).all() and used.min() >= low - ROUNDED and used.max() <= high + ROUNDED):
        raise fault(prim, "inputs:file", "texels out of range", expected=f"{low:g} to {high:g}", got=name)
    pixels = np.clip(pixels, low, high)
    if space == "sRGB" and look.channel != _ALPHA:
        return np.concatenate([decode_srgb(pixels[..., :_ALPHA]), pixels[..., _ALPHA:]], axis=2), "sRGB"
    return pixels, "raw"


def _coordinates(shader: UsdShade.Shader) -> Coordinates:
    """Where ``shader`` is looked up: a primvar, moved by any number of UsdTransform2d."""
    node = _behind(shader, "st")
    moves: list[Placing] = []
    while node and str(node.GetShaderId()) == "UsdTransform2d" and len(moves) < _MOST_MOVES:
        moves.append(_transform(node))
        node = _behind(node, "in")
    if not node or str(node.GetShaderId()) != "UsdPrimvarReader_float2":
        got = str(node.GetShaderId()) if node else "no connection"
        raise fault(
            shader.GetPrim(),
            "inputs:st",
            "unsupported texture coordinates",
            expected="a UsdPrimvarReader_float2, or UsdTransform2d over one",
            got=got,
        )
    name = checked(node.GetPrim(), "inputs:varname", _get(node, "varname"), "word", "")
    if not name:
        raise fault(node.GetPrim(), "inputs:varname", "no name", expected="that of a primvar", got=repr(name))
    found = Coordinates(name)
    for move in reversed(moves):
        found = found.then(*moved_by(move))
    return replace(found, placing=moves[0]) if len(moves) == 1 and moves[0] != Placing() else found


_MOST_MOVES = 16  # a chain of transforms that is longer is taken for a ring


def _behind(shader: UsdShade.Shader, name: str) -> UsdShade.Shader:
    """The shader whose output feeds the input ``name``; an invalid one where there is none."""
    given = shader.GetInput(name)
    sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
    return UsdShade.Shader(sources[0].GetPrim()) if len(sources) == 1 else UsdShade.Shader()


def moved_by(placing: Placing) -> tuple[Floats, Floats]:
    """UsdTransform2d: in * scale * rotation + translation, counter-clockwise in degrees; a matrix (2, 2) and a step."""
    angle = math.radians(placing.rotation)
    cos, sin = math.cos(angle), math.sin(angle)
    return np.diag(placing.scale) @ np.array([[cos, sin], [-sin, cos]]), np.array(placing.translation)


def _transform(shader: UsdShade.Shader) -> Placing:
    _check_inputs(shader, _TRANSFORM_INPUTS)
    turn = _get(shader, "rotation")
    angle = check_number(shader.GetPrim(), "inputs:rotation", 0.0 if turn is None else turn)
    (s, t), (u, v) = _numbers(shader, "scale", (1.0, 1.0)), _numbers(shader, "translation", (0.0, 0.0))
    return Placing((s, t), angle, (u, v))


def _check_inputs(shader: UsdShade.Shader, known: set[str]) -> None:
    """Note the inputs that ``shader`` does not have: no renderer looks at them."""
    for given in shader.GetInputs():
        if given.GetBaseName() not in known:
            what = f"an input that {shader.GetShaderId()} does not have"
            note("not read", where(shader.GetPrim(), str(given.GetFullName())), what)


def _four(shader: UsdShade.Shader, name: str, fallback: Four) -> Four:
    r, g, b, a = _numbers(shader, name, fallback)
    return r, g, b, a


def _numbers(shader: UsdShade.Shader, name: str, fallback: tuple[float, ...]) -> tuple[float, ...]:
    """As many finite numbers as ``fallback`` has, which they are where nobody authored them."""
    found = checked(shader.GetPrim(), f"inputs:{name}", _get(shader, name), "numbers", fallback)
    if len(found) != len(fallback) or not all(math.isfinite(each) for each in found):
        expected = f"{len(fallback)} finite numbers"
        raise fault(shader.GetPrim(), f"inputs:{name}", "out of range", expected=expected, got=str(found))
    return tuple(found)


def _wrap(shader: UsdShade.Shader, name: str) -> Wrap:
    """The wrap mode; files in use have no metadata that say one, and then the border is black."""
    found = checked(shader.GetPrim(), f"inputs:{name}", _get(shader, name), "word", "useMetadata")
    if found not in _WRAPS:
        expected = ", ".join(_WRAPS)
        raise fault(shader.GetPrim(), f"inputs:{name}", "not supported", expected=expected, got=found)
    wrap: Wrap = "black" if found == "useMetadata" else found
    return wrap


def _space(shader: UsdShade.Shader) -> str:
    """The colour space in which the file's values are to be taken."""
    prim = shader.GetPrim()
    space: str = checked(prim, "inputs:sourceColorSpace", _get(shader, "sourceColorSpace"), "word", "auto")
    if space not in ("raw", "sRGB", "auto"):
        raise fault(prim, "inputs:sourceColorSpace", "unknown colour space", expected="raw, sRGB or auto", got=space)
    return space


def _get(shader: UsdShade.Shader, name: str) -> object:
    """The input's value, through interface connections, whatever its type; None where it has none."""
    given = shader.GetInput(name)
    sources = UsdShade.Utils.GetValueProducingAttributes(given) if given else []
    return read(shader.GetPrim(), f"inputs:{name}", sources[0]) if sources else None
