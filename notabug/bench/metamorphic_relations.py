"""Relations between two scenes that must give the same picture: no reference is needed to see one broken.

Each makes of a scene another one, or None where it has nothing to act on.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Material, Mesh, Object, Scene, Texture
from notabug.scenes_usd.transform import rotation, transformed, translation


@dataclass(frozen=True, slots=True)
class Relation:
    """``first`` and ``second`` of a scene must look alike; ``first`` is mostly the scene itself.

    ``claim`` completes "the picture is the same when ...". ``stored`` relations pass through float32 files on both
    sides, so that only the relation differs.
    """

    name: str
    claim: str
    second: Callable[[Scene], Scene | None]
    first: Callable[[Scene], Scene] = lambda scene: scene


def translate(scene: Scene) -> Scene:
    return transformed(scene, translation(10.0, -7.0, 4.0))


def rotate(scene: Scene) -> Scene:
    return transformed(scene, rotation((1.0, 2.0, 3.0), 71.0))


def scale(scene: Scene) -> Scene:
    return transformed(scene, np.diag([3.0, 3.0, 3.0, 1.0]))


def bake(scene: Scene) -> Scene:
    """Meshes without a transform of their own; spheres keep only their place."""
    moved: list[Object] = []
    for shape in scene.objects:
        if isinstance(shape, Mesh):
            moved.append(replace(shape, to_world=np.eye(4)))
            continue
        size = float(np.cbrt(np.linalg.det(shape.to_world[:3, :3])))
        even = np.allclose(shape.to_world[:3, :3] @ shape.to_world[:3, :3].T, size**2 * np.eye(3), atol=1e-9 * size**2)
        place = np.eye(4)
        place[3, :3] = shape.to_world[3, :3]
        moved.append(replace(shape, radius=shape.radius * size, to_world=place) if even else shape)
    return replace(scene, objects=tuple(moved))


def split(scene: Scene) -> Scene | None:
    """The largest mesh as two: every second face in each."""
    meshes = [mesh for mesh in scene.meshes if len(mesh.counts) > 1]
    if not meshes or scene.intent is not None:
        return None
    largest = max(meshes, key=lambda mesh: len(mesh.counts))
    odd = np.arange(len(largest.counts)) % 2 == 1
    parts = [replace(keep_faces(largest, half), path=largest.path + end) for half, end in ((~odd, "A"), (odd, "B"))]
    objects = [part for shape in scene.objects for part in (parts if shape is largest else [shape])]
    return replace(scene, objects=tuple(objects))


def keep_faces(mesh: Mesh, kept: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Mesh:
    """The mesh with the faces (f,) ``kept`` only, and the points that they use."""
    corner = np.repeat(kept, mesh.counts)
    used, corners = np.unique(mesh.corners[corner], return_inverse=True)
    return replace(
        mesh,
        points=np.ascontiguousarray(mesh.points[used]),
        counts=np.ascontiguousarray(mesh.counts[kept]),
        corners=np.ascontiguousarray(corners, np.int32),
        normals=None if mesh.normals is None else np.ascontiguousarray(mesh.normals[corner]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[corner]),
    )


def reorder_objects(scene: Scene) -> Scene | None:
    return replace(scene, objects=scene.objects[::-1]) if len(scene.objects) > 1 else None


def reorder_faces(scene: Scene) -> Scene | None:
    if not any(len(mesh.counts) > 1 for mesh in scene.meshes):
        return None
    return replace(
        scene, objects=tuple(_reversed(shape) if isinstance(shape, Mesh) else shape for shape in scene.objects)
    )


def _reversed(mesh: Mesh) -> Mesh:
    starts = np.concatenate([[0], np.cumsum(mesh.counts)[:-1]])
    order = np.concatenate([np.arange(s, s + n) for s, n in zip(starts[::-1], mesh.counts[::-1], strict=True)])
    return replace(
        mesh,
        counts=np.ascontiguousarray(mesh.counts[::-1]),
        corners=np.ascontiguousarray(mesh.corners[order]),
        normals=None if mesh.normals is None else np.ascontiguousarray(mesh.normals[order]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[order]),
    )


def identity_texture(scene: Scene) -> Scene | None:
    """Every constant colour from a texture of that colour."""
    textures, materials = list(scene.textures), []
    for material in scene.materials:
        if material.texture >= 0:
            materials.append(material)
            continue
        pixels = np.broadcast_to(np.array(material.diffuse), (2, 2, 3)).copy()
        materials.append(replace(material, texture=len(textures)))
        textures.append(Texture(Path(f"constant{len(textures)}"), pixels, "clamp", "clamp"))
    if len(textures) == len(scene.textures) or list(scene.spheres):
        return None
    objects = tuple(_with_uv(shape) if isinstance(shape, Mesh) else shape for shape in scene.objects)
    return replace(scene, textures=tuple(textures), materials=tuple(materials), objects=objects)


def _with_uv(mesh: Mesh) -> Mesh:
    """Coordinates of a square for each face, so that quads keep a bilinear map that can be inverted."""
    if mesh.uv is not None:
        return mesh
    starts = np.repeat(np.cumsum(mesh.counts) - mesh.counts, mesh.counts)
    place = np.arange(len(mesh.corners)) - starts
    angle = 2.0 * np.pi * place / np.repeat(mesh.counts, mesh.counts)
    return replace(mesh, uv=np.stack([0.5 + 0.25 * np.cos(angle), 0.5 + 0.25 * np.sin(angle)], axis=1))


def identity_normals(scene: Scene) -> Scene | None:
    """Flat facets with their own normals written out."""
    if not any(mesh.normals is None for mesh in scene.meshes):
        return None
    return replace(
        scene, objects=tuple(_with_normals(shape) if isinstance(shape, Mesh) else shape for shape in scene.objects)
    )


def _with_normals(mesh: Mesh) -> Mesh:
    if mesh.normals is not None:
        return mesh
    starts = np.cumsum(mesh.counts) - mesh.counts
    a, b, c = (mesh.points[mesh.corners[starts + k]] for k in range(3))
    facet = np.cross(b - a, c - a)
    facet /= np.linalg.norm(facet, axis=1)[:, None]
    return replace(mesh, normals=np.ascontiguousarray(np.repeat(facet, mesh.counts, axis=0)))


def two_half_lights(scene: Scene) -> Scene:
    lights = []
    for light in scene.lights:
        r, g, b = light.intensity
        half = replace(light, intensity=(r / 2.0, g / 2.0, b / 2.0))
        lights += [half, replace(half, path=light.path + "Again")]
    return replace(scene, lights=tuple(lights))


def copied_materials(scene: Scene) -> Scene:
    """Every object with a material of its own."""
    own: list[Material] = []
    objects = []
    for index, each in enumerate(scene.objects):
        own.append(replace(scene.materials[each.material], path=f"{scene.materials[each.material].path}Copy{index}"))
        objects.append(replace(each, material=index))
    return replace(scene, objects=tuple(objects), materials=tuple(own))


def stored(suffix: str = ".usda", metres: float = 1.0, up: str = "Y") -> Callable[[Scene], Scene]:
    """The scene as it comes back from a file."""

    def through(scene: Scene) -> Scene:
        from notabug.scenes_usd.writer import write_scene

        with tempfile.TemporaryDirectory(prefix="notabug-") as folder:
            path = write_scene(scene, Path(folder) / f"scene{suffix}", metres_per_unit=metres, up=up)
            return replace(read_scene(path), id=scene.id, variants=scene.variants)

    return through


RELATIONS = (
    Relation("translate", "everything is moved", translate),
    Relation("rotate", "everything is turned", rotate),
    Relation("scale", "everything is three times as large and the lights nine times as strong", scale),
    Relation("bake", "transforms are moved into the vertices", bake),
    Relation("split", "a mesh is split in two", split),
    Relation("reorder_objects", "objects come in another order", reorder_objects),
    Relation("reorder_faces", "faces come in another order", reorder_faces),
    Relation("usdc", "the file is binary", stored(".usdc"), stored(".usda")),
    Relation("metres_per_unit", "the unit of length has another name", stored(metres=0.01), stored()),
    Relation("up_axis", "the stage calls another axis up", stored(up="Z"), stored()),
    Relation("identity_texture", "a constant colour comes from a constant texture", identity_texture),
    Relation("identity_normals", "flat facets have their normals written out", identity_normals),
    Relation("two_half_lights", "each light is two of half the strength", two_half_lights),
    Relation("copied_materials", "each object has a copy of its material", copied_materials),
)
