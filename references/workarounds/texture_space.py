"""Workarounds of texture space: gutters round a picture, points that are split at a seam, filters in the shader."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.references.workarounds.workaround import Setting, Workaround
from notabug.scenes_usd.scene import Floats, Mesh, Scene, Texture

_WRAP, _SEAM = "texture_space/wrap", "texture_space/seam"
Ints = npt.NDArray[np.int64]
GUTTER = 1  # texels: bilinear lookup reaches half a texel beyond the border


def gutter(scene: Scene) -> Scene:
    """The scene with every repeated texture as a strip: as often as it is shown, and a gutter of what comes next.

    It is clamped, so nothing is asked of a filter at its border.
    """
    textures, moves = [], []
    for index, texture in enumerate(scene.textures):
        uv = [
            mesh.uv for mesh in scene.meshes if mesh.uv is not None and scene.materials[mesh.material].texture == index
        ]
        low = np.floor(np.concatenate(uv).min(axis=0)).astype(np.int64)
        high = np.ceil(np.concatenate(uv).max(axis=0)).astype(np.int64)
        made, a, b = _strip(texture, low, high)
        textures.append(made)
        moves.append((a, b))

    def moved(mesh: Mesh) -> Mesh:
        texture = scene.materials[mesh.material].texture
        if mesh.uv is None or texture < 0:
            return mesh
        a, b = moves[texture]
        return replace(mesh, uv=np.ascontiguousarray(mesh.uv * a + b))

    objects = tuple(moved(each) if isinstance(each, Mesh) else each for each in scene.objects)
    return replace(scene, objects=objects, textures=tuple(textures))


def _strip(texture: Texture, low: Ints, high: Ints) -> tuple[Texture, Floats, Floats]:
    """``texture`` from ``low`` to ``high`` (u, v; whole numbers) with a gutter, and uv' = uv * a + b on it."""
    height, width = texture.pixels.shape[:2]
    size = np.array([width, height])
    pixels = texture.pixels
    a, b = np.ones(2), np.zeros(2)
    for axis, wrap in ((1, texture.wrap_s), (0, texture.wrap_t)):
        if wrap != "repeat":
            continue
        here = 1 - axis
        times = int(high[here] - low[here])
        pixels = np.concatenate([pixels] * times, axis=axis)
        margin = [(0, 0), (0, 0), (0, 0)]
        margin[axis] = (GUTTER, GUTTER)
        pixels = np.pad(pixels, margin, mode="wrap")
        whole = times * size[here] + 2 * GUTTER
        a[here], b[here] = size[here] / whole, (GUTTER - low[here] * size[here]) / whole
    made = replace(
        texture,
        pixels=np.ascontiguousarray(pixels),
        wrap_s="clamp" if texture.wrap_s == "repeat" else texture.wrap_s,
        wrap_t="clamp" if texture.wrap_t == "repeat" else texture.wrap_t,
    )
    return made, a, b


def split(scene: Scene) -> Scene:
    """The scene whose meshes have a point of its own for every corner of a face."""

    def one(mesh: Mesh) -> Mesh:
        corners = np.arange(len(mesh.corners), dtype=np.int32)
        return replace(mesh, points=np.ascontiguousarray(mesh.points[mesh.corners]), corners=corners)

    return replace(scene, objects=tuple(one(each) if isinstance(each, Mesh) else each for each in scene.objects))


def _ours(**switches: str | int) -> dict[str, dict[str, str | int]]:
    return {"inhouse": switches}


WORKAROUNDS = (
    Workaround(
        name="texture_gutter",
        artifact_class="texture_space",
        claim="a picture has a gutter of the texels that come next, so that its border is never filtered",
        cites="Wloka 2005, Improved batching via texture atlases, in ShaderX3; GPU Gems 2, chapter 3",
        reduces=("border_not_filtered",),
        before=Setting(_WRAP, {}, "border clamped", adapters=_ours(texture_border="clamped")),
        after=Setting(_WRAP, {}, "border clamped, gutter", gutter, adapters=_ours(texture_border="clamped")),
        caveat="a gutter of one texel is enough for bilinear lookup, and no help against weights of few bits",
        limits=(
            Setting(
                _WRAP,
                {},
                "border clamped, gutter, 4 bits",
                gutter,
                adapters=_ours(texture_border="clamped", texture_bits=4),
            ),
        ),
    ),
    Workaround(
        name="split_points_at_seams",
        artifact_class="texture_space",
        claim="a point with two texture coordinates becomes two points in one place",
        cites="three.js 9496; ssbucarlos/smash-ultimate-blender 104",
        reduces=("welded_seam",),
        before=Setting(_SEAM, {}, "one coordinate a point", adapters=_ours(uv_seam="first")),
        after=Setting(_SEAM, {}, "one coordinate a point, split", split, adapters=_ours(uv_seam="first")),
        caveat="more columns make the squeezed one narrower; it stays",
        limits=(Setting(_SEAM, {"columns": "27"}, "one coordinate a point", adapters=_ours(uv_seam="first")),),
    ),
    Workaround(
        name="filter_in_the_shader",
        artifact_class="texture_space",
        claim="four texels are fetched and mixed in floating point, not by the sampler's weights of few bits",
        cites="CUDA C++ Programming Guide, Linear Filtering; adapters/opengl_shaders.py does so",
        reduces=("texel_weights",),
        before=Setting(_WRAP, {}, "weights of 4 bits", adapters=_ours(texture_bits=4)),
        after=Setting(_WRAP, {}, "weights in floating point", adapters=_ours(texture_bits=0)),
        caveat="8 bits, as most hardware has, still show where dark texels lie beside bright ones",
        limits=(Setting(_WRAP, {}, "weights of 8 bits", adapters=_ours(texture_bits=8)),),
    ),
)
