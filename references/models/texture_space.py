"""Texture space: borders, seams, negative coordinates, transforms of coordinates, and how coarsely texels are weighed.

Graphics hardware and atlases approximate the filter of a texture in known ways, and meshes with one texture coordinate
a point cannot hold a seam. Where each can act follows from the coordinates and the texels alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.model import Edit, Model, edit_meshes
from notabug.references.models.texel import leaves, pixels
from notabug.scenes_usd.reader_texture import moved_by
from notabug.scenes_usd.scene import Floats, Mesh, Placing, Scene, Texture
from notabug.scenes_usd.srgb import encode_srgb

BITS = (4, 5, 6, 7, 8)  # Vulkan asks for 4 at least, Direct3D for 8, CUDA's textures have 8
_HARDWARE = (
    "CUDA C++ Programming Guide, Linear Filtering: 8 bits of fraction; Direct3D 11.3 functional specification, section "
    "7.18.8; Vulkan 1.3, VkPhysicalDeviceLimits: subTexelPrecisionBits"
)
_ATLAS = "Wloka 2005, Improved batching via texture atlases, in ShaderX3; NVIDIA 2004, Texture atlas tools"
_SRGB = "EXT_texture_sRGB, issue 24; OpenGL 4.6 specification, section 8.24"
_SEAM = (
    "Houdini, GU_TextureUtils.h: GUfixVertexTextureSeams (the entire map appears, reversed, in that span); three.js "
    "9496; newton-physics/newton 3628; ssbucarlos/smash-ultimate-blender 104"
)
_NEGATIVE = (
    "C: casts to int round towards zero, and fmod has the sign of its first argument; UsdUVTexture: wrapS, wrapT"
)
_TRANSFORM = "UsdTransform2d: result = in * scale * rotate + translation"


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with textured meshes."""
    shown = [each for each in scene.meshes if each.uv is not None and scene.materials[each.material].textures]
    if not shown:
        return
    textures = [
        (mesh, scene.textures[index]) for mesh in shown for index in sorted(scene.materials[mesh.material].textures)
    ]
    yield from _weights()
    if any(_meets_border(mesh, texture) for mesh, texture in textures):
        yield from _borders()
    if all(texture.colour_space == "sRGB" for texture in scene.textures):  # the switch is of every lookup
        yield from _decodings()
    for first in (True, False):
        if any(_differ(mesh.uv, _welded(mesh, first).uv) for mesh in shown):
            yield from _seams(first)
    if leaves(scene):
        yield from _negative(textures)
    if any(scene.materials[mesh.material].placing for mesh in shown):
        yield from _transforms()


def _weights() -> Iterator[Model]:
    """Weights of few bits: what is seen lies between those rounded down and up along each axis."""
    for bits in BITS:
        yield Model(
            name="texel_weights",
            kind="limitation",
            rule="hull",
            claim=f"texels are weighed by multiples of 1/{2**bits}",
            cites=_HARDWARE,
            options={"texel_bits": bits, "texel_up": 0},
            others=tuple({"texel_bits": bits, "texel_up": up} for up in (1, 2, 3)),
            when=("texture_bits", str(bits)),
            strict=True,
        )


def _borders() -> Iterator[Model]:
    claim = "a texture that repeats is not filtered across its border: half a texel there shows the last one alone"
    options = {"texel_border": "clamped"}
    for kind, value in (("limitation", "clamped"), ("fault", "wrapped")):
        yield Model(
            name="border_not_filtered" if kind == "limitation" else "border_filter_lost",
            kind="limitation" if kind == "limitation" else "fault",
            claim=claim if kind == "limitation" else f"{claim}, although it is declared that they are mixed",
            cites=_ATLAS,
            options=options,
            when=("texture_border", value),
            strict=kind == "fault",
        )


def _decodings() -> Iterator[Model]:
    claim = "an sRGB texture is decoded after its texels are mixed"
    for kind, value in (("limitation", "after"), ("fault", "before")):
        yield Model(
            name="decoded_after_filter" if kind == "limitation" else "texture_decoded_late",
            kind="limitation" if kind == "limitation" else "fault",
            claim=claim if kind == "limitation" else f"{claim}, although it is declared that it is decoded before",
            cites=_SRGB,
            edit=_encoded,
            options={"texel_decoding": "after"},
            when=("texture_decoding", value),
            strict=kind == "fault",
        )


def _encoded(scene: Scene) -> Scene:
    """Every texture as its file has it, for lookups that decode what they have mixed."""
    return pixels(encode_srgb)(scene)


def _seams(first: bool) -> Iterator[Model]:
    which = "first" if first else "last"
    claim = (
        f"points at a seam have one texture coordinate, that of the {which} face: a column of faces shows the picture"
    )
    for kind, value in (("limitation", which), ("fault", "split")):
        yield Model(
            name="welded_seam" if kind == "limitation" else "seam_welded",
            kind="limitation" if kind == "limitation" else "fault",
            claim=claim,
            cites=_SEAM,
            edit=welded(first=first),
            when=("uv_seam", value),
            strict=kind == "limitation",
        )


def welded(*, first: bool) -> Edit:
    """An edit after which every point of a textured mesh has one texture coordinate."""

    def one(scene: Scene, mesh: Mesh) -> Mesh:
        return _welded(mesh, first) if scene.materials[mesh.material].textures else mesh

    return lambda scene: edit_meshes(scene, lambda mesh: one(scene, mesh))


def _welded(mesh: Mesh, first: bool) -> Mesh:
    if mesh.uv is None:
        return mesh
    corner = np.zeros(len(mesh.points), np.intp)
    order = np.arange(len(mesh.corners))
    if first:  # what is written last stays
        order = order[::-1]
    corner[mesh.corners[order]] = order
    return replace(mesh, uv=np.ascontiguousarray(mesh.uv[corner[mesh.corners]]))


def _differ(one: Floats | None, other: Floats | None) -> bool:
    return one is not None and other is not None and not np.array_equal(one, other)


def _meets_border(mesh: Mesh, texture: Texture) -> bool:
    """Whether the mesh shows a place of ``texture`` where the last texels mix with the first."""
    if mesh.uv is None or not len(mesh.uv):
        return False
    height, width = texture.pixels.shape[:2]
    for axis, (size, wrap) in enumerate(((width, texture.wrap_s), (height, texture.wrap_t))):
        low, high = mesh.uv[:, axis].min() * size, mesh.uv[:, axis].max() * size
        border = size * (np.floor((low - 0.5) / size) + 1.0)  # the first whose half texel beyond it is shown
        if wrap == "repeat" and size > 1 and border - 0.5 < high:
            return True
    return False


def _negative(textures: list[tuple[Mesh, Texture]]) -> Iterator[Model]:
    """Faults of coordinates below 0, or, counted from the other side, above 1."""
    below = [
        (axis, wrap)
        for mesh, texture in textures
        for axis, wrap in enumerate((texture.wrap_s, texture.wrap_t))
        if mesh.uv is not None and (mesh.uv[:, axis] < 0.0).any()
    ]
    if any(wrap != "mirror" for _, wrap in below):
        yield _fault("negative_uv", "negative texture coordinates lose their sign", {"negative_uv": "mirrored"})
    if any(wrap != "clamp" for _, wrap in below):
        yield _fault("negative_uv", "negative texture coordinates are taken for 0", {"negative_uv": "clamped"})
    for way, rows in (("truncated", "top"), ("truncated_up", "bottom")):
        claim = f"texels left of 0 are found by rounding towards zero, not down; rows count from the {rows}"
        yield _fault("negative_uv", claim, {"negative_uv": way})


def _fault(name: str, claim: str, options: dict[str, str]) -> Model:
    return Model(name=name, kind="fault", claim=claim, cites=_NEGATIVE, options=options)


def _transforms() -> Iterator[Model]:
    """Faults of who reads a UsdTransform2d."""
    ways: tuple[tuple[str, str, Callable[[Floats, Placing], Floats]], ...] = (
        ("uv_transform_ignored", "the transform of texture coordinates is ignored", lambda st, _: st),
        (
            "uv_transform_order",
            "texture coordinates are moved before they are scaled and turned",
            lambda st, p: (st + np.array(p.translation)) @ moved_by(p)[0],
        ),
        (
            "uv_transform_order",
            "texture coordinates are turned before they are scaled",
            lambda st, p: st @ _turn(p.rotation) * np.array(p.scale) + np.array(p.translation),
        ),
        (
            "uv_transform_turned",
            "texture coordinates are turned clockwise",
            lambda st, p: _moved(st, replace(p, rotation=-p.rotation)),
        ),
    )
    for name, claim, change in ways:
        yield Model(name=name, kind="fault", claim=claim, cites=_TRANSFORM, edit=_placed(change))


def _turn(degrees: float) -> Floats:
    return moved_by(Placing(rotation=degrees))[0]


def _moved(st: Floats, placing: Placing) -> Floats:
    matrix, offset = moved_by(placing)
    return np.asarray(st @ matrix + offset)


def _placed(change: Callable[[Floats, Placing], Floats]) -> Edit:
    """An edit by which coordinates before their transform are moved by ``change``."""

    def one(scene: Scene, mesh: Mesh) -> Mesh:
        placing = scene.materials[mesh.material].placing
        if placing is None or mesh.uv is None or not all(placing.scale):
            return mesh
        matrix, offset = moved_by(placing)
        before = (mesh.uv - offset) @ np.linalg.inv(matrix)
        return replace(mesh, uv=np.ascontiguousarray(change(before, placing)))

    return lambda scene: edit_meshes(scene, lambda mesh: one(scene, mesh))
