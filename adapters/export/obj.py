"""Wavefront OBJ and MTL: meshes with their convex n-gons, normals and uv in full precision.

OBJ has no spheres, lights or cameras, and MTL's shading is nobody's in particular: those are in ``scene.json``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.export.description import SPLIT, texture_name
from notabug.scenes_usd.faces import shapes
from notabug.scenes_usd.scene import Floats, Material, Mesh, Scene
from notabug.scenes_usd.triangulate import triangulate


def write_obj(scene: Scene, folder: Path) -> Path:
    """``scene.obj`` and ``scene.mtl`` in ``folder``; object ``object<i>`` is that of ``scene.json``."""
    parts, base = ["mtllib scene.mtl"], np.ones(3, np.int64)
    for index, each in enumerate(scene.objects):
        if isinstance(each, Mesh):
            parts += [f"o object{index}", f"usemtl material{each.material}", *_mesh(each, base)]
            base += [len(each.points), *(0 if part is None else len(part) for part in (each.uv, each.normals))]
    (folder / "scene.mtl").write_text("\n".join(_material(*each) for each in enumerate(scene.materials)), "ascii")
    target = folder / "scene.obj"
    target.write_text("\n".join(parts) + "\n", "ascii")
    return target


def _mesh(mesh: Mesh, base: npt.NDArray[np.int64]) -> list[str]:
    """The lines of one mesh; indices count from ``base`` (points, uv, normals) since OBJ's run through the file."""
    lines = _rows("v", mesh.points)
    corner = np.arange(len(mesh.corners))
    words = [f"{each}" for each in (mesh.corners + base[0]).tolist()]
    uv = normals = [""] * len(words)
    if mesh.uv is not None:
        lines += _rows("vt", mesh.uv)
        uv = [f"{each}" for each in (corner + base[1]).tolist()]
    if mesh.normals is not None:
        lines += _rows("vn", mesh.normals)
        normals = [f"{each}" for each in (corner + base[2]).tolist()]
    if mesh.uv is not None or mesh.normals is not None:
        words = ["/".join(each).rstrip("/") for each in zip(words, uv, normals, strict=True)]
    lines += ["f " + " ".join(words[corner] for corner in face) for face in _faces(mesh)]
    return lines


def _faces(mesh: Mesh) -> Iterator[Sequence[int]]:
    """The corners of each face; of one that is not convex those of its triangles, for most readers make a fan of it."""
    ends = np.cumsum(mesh.counts).tolist()
    cut = triangulate(mesh, SPLIT)
    for face, (start, end) in enumerate(zip([0, *ends], ends, strict=False)):
        if shapes(mesh).convex[face]:
            yield range(start, end)
        else:
            yield from cut.corner[cut.face == face].tolist()


def _rows(word: str, rows: Floats) -> list[str]:
    return [f"{word} {' '.join(map(repr, row))}" for row in rows.tolist()]


def _material(index: int, material: Material) -> str:
    lines = [f"newmtl material{index}", f"Kd {_colour(material.diffuse)}", f"Ks {_colour(material.specular)}"]
    lines += [f"Ns {material.exponent!r}", f"d {material.opacity!r}", f"Ni {material.ior!r}", "illum 2"]
    if material.texture >= 0:
        lines.append(f"map_Kd {texture_name(material.texture, '.png')}")
    if material.opacity_map >= 0:
        lines.append(f"map_d {texture_name(material.opacity_map, '.png')}")
    return "\n".join(lines) + "\n"


def _colour(colour: tuple[float, float, float]) -> str:
    return " ".join(repr(float(each)) for each in colour)
