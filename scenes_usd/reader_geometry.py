"""UsdGeomMesh and UsdGeomSphere to Mesh and Sphere: world space, corner arrays, one winding."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from notabug.scenes_usd.reader_faces import sound_faces
from notabug.scenes_usd.reader_values import (
    check_reach,
    fault,
    integers,
    number,
    turns_over,
    value,
    vectors,
    world_matrix,
)
from notabug.scenes_usd.scene import Floats, Ints, Mesh, Sphere

SHORTEST = 1e-30  # length of a normal: its square is still a float64 by far, and no exporter writes such a one

Places = npt.NDArray[np.int64]


def read_sphere(prim: Usd.Prim, material: int) -> Sphere:
    """The analytic sphere at ``prim``."""
    radius = number(prim, "radius", 1.0, low=0.0)
    if radius == 0.0:
        raise fault(prim, "radius", "out of range", expected="above 0", got="0")
    matrix = world_matrix(prim)
    check_reach(prim, "radius", radius * matrix[:3, :3] + matrix[3, :3])
    return Sphere(str(prim.GetPath()), radius, material, matrix)


def read_mesh(prim: Usd.Prim, material: int) -> Mesh | None:
    """The mesh at ``prim``: its points in world space, every attribute per corner, counter-clockwise from outside.

    Corners in one place are one, and faces without an area are left out; None where none is left.
    """
    scheme = value(prim, "subdivisionScheme", "word")
    if scheme != "none":
        raise fault(
            prim,
            "subdivisionScheme",
            "subdivision surfaces are not supported",
            expected="none",
            got=str(scheme),
            do='author uniform token subdivisionScheme = "none"',
        )
    if len(integers(prim, "holeIndices")):
        raise fault(prim, "holeIndices", "holes are not supported", do="leave the faces out")
    points = vectors(prim, "points", 3)
    counts, corners = _topology(prim, len(points))
    normals_name, normals = _normals(prim, points, counts, corners)
    uv = _corner_primvar(prim, "primvars:st", 2, len(points), counts, corners)
    kept, counts = sound_faces(points, counts, corners, normals, uv)
    if not len(counts):
        return None
    if normals is not None:
        _check_directions(prim, normals_name, normals, kept)
    if len(kept) < len(corners):
        corners = corners[kept]
        normals = None if normals is None else normals[kept]
        uv = None if uv is None else uv[kept]

    matrix = world_matrix(prim)
    linear = matrix[:3, :3]
    mirrored = turns_over(linear)
    if mirrored != (value(prim, "orientation", "word", "rightHanded") == "leftHanded"):
        order = _reversed_order(counts)
        corners = corners[order]
        normals = None if normals is None else normals[order]
        uv = None if uv is None else uv[order]
    if normals is not None:
        unit = 2.0 ** np.floor(np.log2(np.abs(linear).max()))  # exact; keeps squares in range
        normals = normals @ np.linalg.inv(linear / unit).T
        normals = np.ascontiguousarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    placed = np.ascontiguousarray(points @ linear + matrix[3, :3])
    check_reach(prim, "points", placed)
    return Mesh(
        path=str(prim.GetPath()),
        points=placed,
        counts=counts,
        corners=np.ascontiguousarray(corners),
        material=material,
        normals=normals,
        uv=None if uv is None else np.ascontiguousarray(uv),
        to_world=matrix,
    )


def _topology(prim: Usd.Prim, points: int) -> tuple[Ints, Ints]:
    """faceVertexCounts (f,) and faceVertexIndices (c,), checked against each other and the number of points."""
    counts = integers(prim, "faceVertexCounts")
    corners = integers(prim, "faceVertexIndices")
    if not len(counts):
        raise fault(prim, "faceVertexCounts", "the mesh has no faces")
    if counts.min() < 3:
        face = int(np.argmin(counts))
        raise fault(prim, "faceVertexCounts", f"face {face} has {counts[face]} corners", expected="at least 3")
    if counts.sum() != len(corners):
        raise fault(
            prim,
            "faceVertexIndices",
            "does not match faceVertexCounts",
            expected=f"{counts.sum()} indices",
            got=str(len(corners)),
        )
    outside = np.flatnonzero((corners < 0) | (corners >= points))
    if outside.size:
        raise fault(
            prim,
            "faceVertexIndices",
            f"element {outside[0]} is out of range",
            expected=f"0 to {points - 1}",
            got=str(corners[outside[0]]),
        )
    return counts, corners


def _normals(prim: Usd.Prim, points: Floats, counts: Ints, corners: Ints) -> tuple[str, Floats | None]:
    """Their attribute, and local normals per corner, not normalised, or None.

    ``primvars:normals`` wins over ``normals``, as USD says.
    """
    name = "primvars:normals"
    found = _corner_primvar(prim, name, 3, len(points), counts, corners)
    if found is not None:
        return name, found
    name = "normals"
    values = vectors(prim, name, 3)
    if not len(values):
        return name, None
    interpolation = str(UsdGeom.Mesh(prim).GetNormalsInterpolation())
    return name, _per_corner(prim, name, values, interpolation, len(points), counts, corners)


def _check_directions(prim: Usd.Prim, name: str, normals: Floats, kept: Places) -> None:
    """Raise SceneError for a normal without a length at a corner that is ``kept``; others are seen nowhere."""
    zero = kept[np.linalg.norm(normals[kept], axis=1) < SHORTEST]
    if zero.size:
        raise fault(
            prim,
            name,
            f"the normal of corner {zero[0]} has no length",
            expected="a direction",
            do="leave the normals out, and the mesh is drawn by its facets, or author each",
        )


def _corner_primvar(prim: Usd.Prim, name: str, width: int, points: int, counts: Ints, corners: Ints) -> Floats | None:
    """The primvar ``name`` per corner (c, width), indices resolved, or None where it has no value."""
    primvar = UsdGeom.Primvar(prim.GetAttribute(name))
    if not primvar or not primvar.HasValue():
        return None
    values = vectors(prim, name, width)
    if primvar.IsIndexed():
        indices = integers(prim, f"{name}:indices", primvar.GetIndicesAttr())
        outside = np.flatnonzero((indices < 0) | (indices >= len(values)))
        if outside.size:
            raise fault(
                prim,
                f"{name}:indices",
                f"element {outside[0]} is out of range",
                expected=f"0 to {len(values) - 1}",
                got=str(indices[outside[0]]),
            )
        values = values[indices]
    return _per_corner(prim, name, values, str(primvar.GetInterpolation()), points, counts, corners)


def _per_corner(
    prim: Usd.Prim, name: str, values: Floats, interpolation: str, points: int, counts: Ints, corners: Ints
) -> Floats:
    """``values`` (n, k) spread over the corners (c, k) by their USD interpolation."""
    wanted = {"constant": 1, "uniform": len(counts), "varying": points, "vertex": points, "faceVarying": len(corners)}
    if interpolation not in wanted:
        raise fault(prim, name, f"unknown interpolation {interpolation!r}", expected=f"one of {', '.join(wanted)}")
    if len(values) != wanted[interpolation]:
        raise fault(
            prim,
            name,
            f"wrong length for interpolation {interpolation}",
            expected=str(wanted[interpolation]),
            got=str(len(values)),
        )
    if interpolation == "faceVarying":
        return values
    if interpolation == "uniform":
        return np.repeat(values, counts, axis=0)
    if interpolation == "constant":
        return np.repeat(values, len(corners), axis=0)
    return values[corners]


def _reversed_order(counts: Ints) -> Ints:
    """The permutation (c,) that turns every face round and keeps its first corner, so diagonals keep their names."""
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    size = np.repeat(counts, counts)
    place = np.arange(len(starts)) - starts
    return np.asarray(starts + (size - place) % size, np.int32)
