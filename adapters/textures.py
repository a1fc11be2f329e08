"""Textures for renderers that lack a wrap mode: said with those that they have.

A mirrored texture is one twice as large that repeats; one with a black border has a row of black texels more on each
side and is clamped; a clamped one repeats once its border is repeated as far as the uv reach.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import UnsupportedError
from notabug.adapters.job_types import Clear
from notabug.scenes_usd.scene import Floats, Material, Mesh, Scene, Texture, Wrap

MAX_TEXELS = 8192  # the longest side of a texture once its border is repeated


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """``pixels`` (h, w, 3) to be repeated on both axes, and uv' = uv * a + b, the coordinates on them; a and b (2,)."""

    pixels: Floats
    a: Floats
    b: Floats


def shown_uv(scene: Scene, index: int) -> Floats:
    """Every uv (n, 2) at which the texture ``index`` is shown."""
    shown = [shape for shape in scene.objects if index in scene.materials[shape.material].textures]
    meshes = [each.uv for each in shown if isinstance(each, Mesh) and each.uv is not None]
    if len(meshes) < len(shown):
        bare = next(each for each in shown if not isinstance(each, Mesh) or each.uv is None)
        raise UnsupportedError("a texture on an object without uv", where=bare.path, do="give it primvars:st")
    return np.concatenate(meshes) if meshes else np.zeros((0, 2))


def grow(texture: Texture, uv: Floats) -> Grown:
    """``texture`` such that repeating it looks, at the coordinates ``uv`` (n, 2), as its own wrap modes do.

    >>> from pathlib import Path
    >>> step = Texture(Path("t.png"), np.array([[[0.0] * 3, [1.0] * 3]]), wrap_s="clamp")
    >>> grown = grow(step, np.array([[0.0, 0.0], [1.5, 1.0]]))
    >>> grown.pixels[0, :, 0].tolist(), grown.a.tolist(), grown.b.tolist()
    ([0.0, 0.0, 1.0, 1.0, 1.0], [0.4, 1.0], [0.2, 0.0])
    """
    if not is_plain(texture):
        first = _plain(texture)
        plain = replace(texture, pixels=first.pixels, wrap_s=_PLAIN[texture.wrap_s], wrap_t=_PLAIN[texture.wrap_t])
        then = grow(plain, uv * first.a + first.b)
        return Grown(then.pixels, first.a * then.a, first.b * then.a + then.b)
    height, width = texture.pixels.shape[:2]
    rows, above, below = _indices(height, 1.0 - uv[:, 1], texture.wrap_t, texture)
    columns, left, right = _indices(width, uv[:, 0], texture.wrap_s, texture)
    grown = np.array([width + left + right, height + above + below], np.float64)
    pixels = np.ascontiguousarray(texture.pixels[rows][:, columns])
    return Grown(pixels, np.array([width, height]) / grown, np.array([left, below]) / grown)


def is_plain(texture: Texture) -> bool:
    """Whether the texture repeats or is clamped on each axis."""
    return {texture.wrap_s, texture.wrap_t} <= {"repeat", "clamp"}


def plain_wraps(scene: Scene, draws: Callable[[Texture], bool] = is_plain) -> Scene:
    """The scene with textures that repeat or clamp on each axis, but for those that the renderer ``draws`` as they are.

    Raises UnsupportedError where the maps of a material would no longer be looked up at one place.
    """
    grown = {index: _plain(each) for index, each in enumerate(scene.textures) if not draws(each)}
    if not grown:
        return scene
    still = Grown(np.zeros((0, 0, 3)), np.ones(2), np.zeros(2))
    moved: dict[int, Grown] = {}
    for place, material in enumerate(scene.materials):
        ways = [grown.get(index, still) for index in sorted(material.textures)]
        if any(not (np.array_equal(way.a, ways[0].a) and np.array_equal(way.b, ways[0].b)) for way in ways):
            raise _several(material)
        if ways:
            moved[place] = ways[0]
    objects = tuple(
        replace(shape, uv=shape.uv * moved[shape.material].a + moved[shape.material].b)
        if isinstance(shape, Mesh) and shape.uv is not None and shape.material in moved
        else shape
        for shape in scene.objects
    )
    textures = tuple(
        replace(each, pixels=grown[index].pixels, wrap_s=_PLAIN[each.wrap_s], wrap_t=_PLAIN[each.wrap_t])
        if index in grown
        else each
        for index, each in enumerate(scene.textures)
    )
    return replace(scene, objects=objects, textures=textures)


_PLAIN: dict[Wrap, Wrap] = {"repeat": "repeat", "clamp": "clamp", "mirror": "repeat", "black": "clamp"}


def _plain(texture: Texture) -> Grown:
    """``texture`` with what is mirrored, or black, beyond its border in its pixels."""
    pixels, a, b = texture.pixels, np.ones(2), np.zeros(2)
    for axis, wrap in ((1, texture.wrap_s), (0, texture.wrap_t)):
        here, size = 1 - axis, pixels.shape[axis]  # the coordinate that runs along this axis of the picture
        if wrap == "mirror":  # row 0 is at v = 1: what is mirrored comes after the picture in u, before it in v
            turned = np.flip(pixels, axis)
            pixels = np.concatenate([pixels, turned] if axis == 1 else [turned, pixels], axis=axis)
            a[here] = 0.5
        elif wrap == "black":
            margin = [(0, 0), (0, 0), (0, 0)]
            margin[axis] = (1, 1)
            pixels = np.pad(pixels, margin)
            a[here], b[here] = size / (size + 2), 1 / (size + 2)
    return Grown(np.ascontiguousarray(pixels), a, b)


def same_wraps(scene: Scene) -> Scene:
    """The scene with textures that are repeated, or clamped, on both axes.

    One that is clamped on one axis alone is repeated, with its border repeated as far as its uv reach.
    """
    return _repeated(plain_wraps(scene), lambda texture: texture.wrap_s != texture.wrap_t)


def repeated(scene: Scene) -> Scene:
    """The scene with textures that are repeated on both axes, the borders of clamped ones as far as their uv reach."""
    return _repeated(plain_wraps(scene), lambda texture: "clamp" in (texture.wrap_s, texture.wrap_t))


def _repeated(scene: Scene, which: Callable[[Texture], bool]) -> Scene:
    for index, texture in enumerate(scene.textures):
        if not which(texture):
            continue
        users = {place for place, material in enumerate(scene.materials) if index in material.textures}
        check_alone(scene, index)
        grown = grow(texture, shown_uv(scene, index))
        objects = tuple(
            replace(shape, uv=shape.uv * grown.a + grown.b)
            if isinstance(shape, Mesh) and shape.uv is not None and shape.material in users
            else shape
            for shape in scene.objects
        )
        tiled = replace(texture, pixels=grown.pixels, wrap_s="repeat", wrap_t="repeat")
        textures = (*scene.textures[:index], tiled, *scene.textures[index + 1 :])
        scene = replace(scene, objects=objects, textures=textures)
    return scene


def check_alone(scene: Scene, index: int) -> None:
    """Raise UnsupportedError where coordinates that are moved for the texture ``index`` would move another one, too."""
    for material in scene.materials:
        if index in material.textures and len(material.textures) > 1:
            raise _several(material)


def _several(material: Material) -> UnsupportedError:
    return UnsupportedError(
        "several maps, of which one must be cut larger for its wrap modes",
        where=material.path,
        do="repeat or clamp all maps of the material, on both axes",
    )


def _indices(size: int, at: Floats, wrap: str, texture: Texture) -> tuple[npt.NDArray[np.integer], int, int]:
    """The texels along one axis with the border repeated, and how many of them were added before and after.

    Between texel centres k and k + 1 lie the coordinates with floor(at * size - 0.5) = k.
    """
    if wrap == "repeat" or not len(at):
        return np.arange(size), 0, 0
    first, last = (int(each) for each in np.floor(np.array([at.min(), at.max()]) * size - 0.5))
    before, after = max(0, -first), max(0, last + 2 - size)
    if size + before + after > MAX_TEXELS:
        raise UnsupportedError(
            "uv far outside a clamped texture",
            where=str(texture.path),
            expected=f"at most {MAX_TEXELS} texels with the repeated border",
            got=str(size + before + after),
            do="bring the uv closer to 0..1",
        )
    return np.clip(np.arange(-before, size + after), 0, size - 1), before, after


def clear(material: Material) -> Clear:
    """What a job says of the map of opacity of ``material``, if it has one."""
    if material.opacity_map < 0:
        return {}
    return {"opacity_map": material.opacity_map, "least_opacity": material.least_opacity}
