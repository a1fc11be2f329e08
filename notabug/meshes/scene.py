"""A scene about a mesh that is none: camera, light and card from its bounds, one material for all of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from notabug.meshes.cutting import cut
from notabug.meshes.files import RawMesh, read_mesh_file
from notabug.scenes_usd.framing import framed
from notabug.scenes_usd.scene import Floats, Material, Mesh, Scene, Texture

GREY = (0.6, 0.6, 0.6)


def scene_from_mesh_file(
    path: Path,
    *,
    texture: Texture | None = None,
    size: tuple[int, int] = (96, 96),
    azimuth: float = 30.0,
    elevation: float = 25.0,
    up: str = "Y",
) -> Scene:
    """The mesh in the file at ``path`` (OBJ, STL, PLY or OFF) as a scene of its own; see ``scene_from_mesh``."""
    made = scene_from_mesh(
        read_mesh_file(path),
        name=path.stem,
        texture=texture,
        size=size,
        azimuth=azimuth,
        elevation=elevation,
        up=up,
    )
    return replace(made, path=path)


def scene_from_mesh(
    mesh: RawMesh,
    *,
    name: str = "mesh",
    texture: Texture | None = None,
    size: tuple[int, int] = (96, 96),
    azimuth: float = 30.0,
    elevation: float = 25.0,
    up: str = "Y",
    bent: bool = False,
) -> Scene:
    """``mesh`` under a point light, seen whole from ``azimuth`` degrees round and ``elevation`` above.

    It is a grey Lambertian surface, or shows ``texture`` where it has coordinates. Faces that the scene contract
    cannot say are cut into triangles, but ``bent`` keeps quads whole; normals without a length become their face's.
    """
    plain = cut(mesh, bent=bent)
    shown = texture is not None and plain.uv is not None
    material = Material("/Scene/Materials/Surface", GREY, texture=0 if shown else -1)
    made = Mesh(
        path="/Scene/Mesh",
        points=np.ascontiguousarray(plain.points),
        counts=plain.counts,
        corners=plain.corners,
        material=0,
        normals=_normals(plain),
        uv=plain.uv if shown else None,
    )
    return framed(
        [made],
        [material],
        [texture] if shown and texture is not None else [],
        name=name,
        size=size,
        azimuth=azimuth,
        elevation=elevation,
        up=up,
    )


def _normals(mesh: RawMesh) -> Floats | None:
    """The mesh's normals at unit length; a corner whose normal has none gets its face's, or up."""
    if mesh.normals is None:
        return None
    lengths = np.linalg.norm(mesh.normals, axis=1)
    bad = ~(lengths > 1e-20)
    normals = mesh.normals / np.where(bad, 1.0, lengths)[:, None]
    if bad.any():
        first = np.cumsum(mesh.counts) - mesh.counts
        a, b, c = (mesh.points[mesh.corners[first + step]] for step in range(3))
        plane = np.cross(b - a, c - a)
        size = np.linalg.norm(plane, axis=1, keepdims=True)
        plane = np.where(size > 0.0, plane / np.where(size > 0.0, size, 1.0), [0.0, 1.0, 0.0])
        normals[bad] = np.repeat(plane, mesh.counts, axis=0)[bad]
    return np.ascontiguousarray(normals)
