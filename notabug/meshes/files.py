"""Polygon meshes out of files that are no scenes: OBJ read here, with its polygons; STL, PLY and OFF by trimesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.scene import Floats, Ints

BY_TRIMESH = (".stl", ".ply", ".off")
LARGEST = 1 << 26  # bytes of a file


class MeshFileError(NotabugError):
    """A file that cannot be read as a mesh."""


@dataclass(frozen=True, slots=True, eq=False)
class RawMesh:
    """``points`` (p, 3), ``counts`` (f,) corners a face, ``corners`` (c,) into the points, per corner ``normals``
    (c, 3), of any length, and ``uv`` (c, 2), or None."""

    points: Floats
    counts: Ints
    corners: Ints
    normals: Floats | None = None
    uv: Floats | None = None


def read_mesh_file(path: Path) -> RawMesh:
    """The mesh in the file at ``path``: all of its parts as one."""
    suffix = path.suffix.lower()
    if suffix not in (".obj", *BY_TRIMESH):
        expected = ", ".join((".obj", *BY_TRIMESH))
        raise MeshFileError(
            "not a known kind of mesh file", where=str(path), expected=expected, got=suffix or "no suffix"
        )
    try:
        if path.stat().st_size > LARGEST:
            raise MeshFileError("the file is too large", where=str(path), expected=f"at most {LARGEST >> 20} MiB")
        made = parse_obj(path.read_text("utf-8", "replace"), str(path)) if suffix == ".obj" else _by_trimesh(path)
    except OSError as error:
        raise MeshFileError("cannot be read", where=str(path), got=error.strerror or str(error)) from error
    if not len(made.counts):
        raise MeshFileError("the file holds no faces", where=str(path), expected="polygons of at least three corners")
    if not np.isfinite(made.points).all():
        raise MeshFileError("a coordinate is not finite", where=str(path))
    return made


def parse_obj(text: str, where: str = "") -> RawMesh:
    """The faces of a Wavefront OBJ: ``v``, ``vt``, ``vn`` and ``f``; all else is passed over.

    Normals, or coordinates, are there only where every corner has one.
    """
    tables: dict[str, list[list[float]]] = {"v": [], "vt": [], "vn": []}
    widths = {"v": 3, "vt": 2, "vn": 3}
    counts: list[int] = []
    chosen: list[tuple[int, int, int]] = []
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), 1):
        word, *rest = line.split("#")[0].split() or [""]
        try:
            if word in tables:
                row = [float(each) for each in rest[: widths[word]]]
                if word == "vt" and len(row) == 1:
                    row.append(0.0)
                if len(row) != widths[word]:
                    raise ValueError(f"{len(row)} numbers")
                tables[word].append(row)
            elif word == "f":
                face = [_corner(each, tables) for each in rest]
                if len(face) < 3:
                    raise ValueError(f"a face of {len(face)} corners")
                counts.append(len(face))
                chosen += face
        except ValueError as error:
            raise MeshFileError("cannot be read as OBJ", where=f"{where}:{number}", got=str(error)) from error
    indices = np.array(chosen, np.int64).reshape(-1, 3)

    def of(column: int, name: str) -> Floats | None:
        if not len(indices) or (indices[:, column] < 0).any():
            return None
        return np.array(tables[name])[indices[:, column]]

    return RawMesh(
        points=np.array(tables["v"]).reshape(-1, 3),
        counts=np.array(counts, np.int32),
        corners=indices[:, 0].astype(np.int32),
        normals=of(2, "vn"),
        uv=of(1, "vt"),
    )


def _corner(word: str, tables: dict[str, list[list[float]]]) -> tuple[int, int, int]:
    """The indices (point, uv, normal) of ``word``, such as ``3/1/2`` or ``-1//-1``, from 0; -1: none."""
    parts = word.split("/")
    found = []
    for text, name in zip([*parts, "", ""], ("v", "vt", "vn"), strict=False):
        if not text:
            found.append(-1)
            continue
        known, index = len(tables[name]), int(text)
        place = index - 1 if index > 0 else known + index
        if index == 0 or not 0 <= place < known:
            raise ValueError(f"index {index} of {known} {name}")
        found.append(place)
    if found[0] < 0:
        raise ValueError(f"corner {word!r}")
    return found[0], found[1], found[2]


def _by_trimesh(path: Path) -> RawMesh:
    try:
        import trimesh
    except ImportError as error:
        raise MeshFileError(
            "the package trimesh is not installed", where=str(path), do="pip install 'notabug[bench]'"
        ) from error
    try:
        made: Any = trimesh.load(path, process=False, force="mesh")
        faces = np.asarray(made.faces, np.int32).reshape(-1, 3)
        points = np.asarray(made.vertices, np.float64).reshape(-1, 3)
    except Exception as error:  # whatever its parsers raise of a broken file
        raise MeshFileError(
            "trimesh cannot read it", where=str(path), got=f"{type(error).__name__}: {error}"
        ) from error
    uv = getattr(made.visual, "uv", None)
    known = uv is not None and len(uv) == len(points)
    return RawMesh(
        points=points,
        counts=np.full(len(faces), 3, np.int32),
        corners=np.ascontiguousarray(faces.ravel()),
        uv=np.asarray(uv, np.float64)[faces.ravel()] if known else None,
    )
