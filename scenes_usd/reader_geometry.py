"""UsdGeomMesh, the solids and UsdGeomSphere to Mesh and Sphere: world space, corner arrays, one winding."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from pxr import Usd, UsdGeom

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.opinion import BLOCKED, Opinion
from notabug.scenes_usd.primvar import Places, Values
from notabug.scenes_usd.reader_faces import sound_faces
from notabug.scenes_usd.reader_solids import solid_faces
from notabug.scenes_usd.reader_texture import Coordinates
from notabug.scenes_usd.reader_values import check_reach, fault, integers, number, opinion, turns_over, value, vectors
from notabug.scenes_usd.scene import Floats, Ints, Mesh, Sphere
from notabug.scenes_usd.schemes import SCHEMES, Scheme

SHORTEST = 1e-30  # length of a normal: its square is still a float64 by far, and no exporter writes such a one

Bools = npt.NDArray[np.bool_]


def read_sphere(prim: Usd.Prim, material: int, matrix: Floats, path: str) -> Sphere:
    """The analytic sphere at ``prim``, placed by ``matrix``."""
    radius = number(prim, "radius", 1.0, low=0.0)
    if radius == 0.0:
        raise fault(prim, "radius", "out of range", expected="above 0", got="0")
    check_reach(prim, "radius", radius * matrix[:3, :3] + matrix[3, :3])
    return Sphere(path, radius, material, matrix)


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """The faces of a prim in its own frame, before anything is placed.

    Attributes
    ----------
    normals : (c, 3), not normalised, and the attribute they come from; None for flat facets.
    values : texture coordinates (c, 2) by primvar.
    parent : (f,) the face of the prim's own mesh that each face is part of; None where they are these.
    """

    prim: Usd.Prim
    points: Floats
    counts: Ints
    corners: Ints
    normals_name: str
    normals: Floats | None
    values: dict[str, Floats]
    parent: Places | None
    left_handed: bool


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """The faces of a shape that have one material: ``faces`` (f,) of the prim's own mesh, or None for all of them."""

    path: str
    material: int
    coordinates: Coordinates
    faces: Bools | None = None

    def moved(self, old: str, new: str) -> Part:
        """The same part of an object that is called ``new`` instead of ``old``."""
        return self if old == new else replace(self, path=new + self.path[len(old) :])


PixelSize = Callable[[Floats], Floats]


def read_shape(prim: Usd.Prim, names: Collection[str], pixel: PixelSize) -> Shape:
    """The mesh or solid at ``prim`` with the texture coordinates ``names``; ``pixel`` is a pixel's local size there."""
    if not prim.IsA(UsdGeom.Mesh):
        faces = solid_faces(prim, pixel)
        counts, corners = faces.counts.astype(np.int32), faces.corners.astype(np.int32)
        return Shape(prim, faces.points, counts, corners, "normals", faces.normals, {}, None, False)
    left_handed = value(prim, "orientation", "word", "rightHanded") == "leftHanded"
    points = vectors(prim, "points", 3)
    counts, corners = _topology(prim, len(points))
    scheme = value(prim, "subdivisionScheme", "word")
    if scheme in SCHEMES:
        return _subdivided(prim, scheme, points, counts, corners, names, pixel, left_handed)
    if scheme != "none":
        expected = f"none, {', '.join(SCHEMES)}"
        raise fault(prim, "subdivisionScheme", "unknown scheme", expected=expected, got=str(scheme))
    normals_name, normals = _normals(prim, points, counts, corners)
    values = {}
    for name in names:
        found = _corner_primvar(prim, f"primvars:{name}", 2, len(points), counts, corners)
        if found is not None:
            values[name] = found
    shape = Shape(prim, points, counts, corners, normals_name, normals, values, None, left_handed)
    holes = _holes(prim, len(counts))
    return _of_faces(shape, ~np.isin(np.arange(len(counts)), holes)) if len(holes) else shape


def _holes(prim: Usd.Prim, faces: int) -> Ints:
    found = integers(prim, "holeIndices")
    outside = np.flatnonzero((found < 0) | (found >= faces))
    if outside.size:
        got = str(found[outside[0]])
        raise fault(prim, "holeIndices", f"element {outside[0]} is out of range", expected=f"0 to {faces - 1}", got=got)
    return found


def _of_faces(shape: Shape, chosen: Bools) -> Shape:
    """``shape`` with only the ``chosen`` faces (f,) and the points that they use."""
    corner = np.repeat(chosen, shape.counts)
    used, corners = np.unique(shape.corners[corner], return_inverse=True)
    parent = np.arange(len(shape.counts)) if shape.parent is None else shape.parent
    return replace(
        shape,
        points=shape.points[used],
        counts=shape.counts[chosen],
        corners=corners.astype(np.int32),
        normals=None if shape.normals is None else shape.normals[corner],
        values={name: found[corner] for name, found in shape.values.items()},
        parent=parent[chosen],
    )


def _subdivided(
    prim: Usd.Prim,
    scheme: Scheme,
    points: Floats,
    counts: Ints,
    corners: Ints,
    names: Collection[str],
    pixel: PixelSize,
    left_handed: bool,
) -> Shape:
    """The limit surface of the mesh at ``prim``. Normals that it has as well say nothing, as the schema has it."""
    from notabug.scenes_usd.reader_subdivision import control_net, on_limit  # with what it takes to load

    wide, at = counts.astype(np.int64), corners.astype(np.int64)
    net = control_net(prim, scheme, wide, at, len(points))
    values = {}
    for name in names:
        found = _primvar(prim, f"primvars:{name}", 2, len(points), counts, corners)
        if found is not None:
            values[name] = found
    made = on_limit(prim, scheme, net, points, values, pixel, _holes(prim, len(counts)).astype(np.int64))
    counts, corners = made.counts.astype(np.int32), made.corners.astype(np.int32)
    normals = made.normals
    if normals is not None and left_handed:
        normals = -normals  # they are those of faces that turn the other way
    return Shape(prim, made.points, counts, corners, "normals", normals, made.values, made.parent, left_handed)


def place(shape: Shape, part: Part, matrix: Floats) -> Mesh | None:
    """One part of ``shape`` in world space, counter-clockwise from outside; None where no face of it has an area.

    Corners in one place are one, and faces without an area are left out.
    """
    prim = shape.prim
    if part.faces is not None:
        parent = np.arange(len(shape.counts)) if shape.parent is None else shape.parent
        shape = _of_faces(shape, part.faces[parent])
    points, counts, corners, normals = shape.points, shape.counts, shape.corners, shape.normals
    uv = shape.values.get(part.coordinates.name)
    kept, counts = sound_faces(points, counts, corners, normals, uv) if len(counts) else (np.zeros(0, int), counts)
    if not len(counts):
        return None
    if normals is not None:
        _check_directions(prim, shape.normals_name, normals, kept)
    if len(kept) < len(corners):
        corners = corners[kept]
        normals = None if normals is None else normals[kept]
        uv = None if uv is None else uv[kept]

    linear = matrix[:3, :3]
    if turns_over(linear) != shape.left_handed:
        order = reversed_order(counts)
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
        path=part.path,
        points=placed,
        counts=counts,
        corners=np.ascontiguousarray(corners),
        material=part.material,
        normals=normals,
        uv=None if uv is None else np.ascontiguousarray(part.coordinates.of(uv)),
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
    try:
        first = _corner_primvar(prim, name, 3, len(points), counts, corners)
        if first is not None:
            return name, first
        name = "normals"
        values = vectors(prim, name, 3)
        if not len(values):
            return name, None
        interpolation = str(UsdGeom.Mesh(prim).GetNormalsInterpolation())
        found = _spread(prim, name, values, interpolation, len(points), counts, corners)
        return name, found.values[found.at]
    except SceneError as error:
        error.mends = error.mends or _facets(prim, name)
        raise


def _facets(prim: Usd.Prim, name: str) -> tuple[Opinion, ...]:
    """The opinion that a mesh has no normals ``name``: then its facets are drawn."""
    return opinion(prim, name, BLOCKED, "", "bad normals: the mesh is drawn by its facets")


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
            mends=_facets(prim, name),
        )


def _corner_primvar(prim: Usd.Prim, name: str, width: int, points: int, counts: Ints, corners: Ints) -> Floats | None:
    """The primvar ``name`` per corner (c, width), indices resolved, or None where it has no value."""
    found = _primvar(prim, name, width, points, counts, corners)
    return None if found is None else found.values[found.at]


def _primvar(prim: Usd.Prim, name: str, width: int, points: int, counts: Ints, corners: Ints) -> Values | None:
    """The primvar ``name`` and which of its values each corner has; None where it has no value."""
    primvar = UsdGeom.Primvar(prim.GetAttribute(name))
    if not primvar or not primvar.HasValue():
        return None
    values = vectors(prim, name, width)
    interpolation = str(primvar.GetInterpolation())
    if not primvar.IsIndexed():
        return _spread(prim, name, values, interpolation, points, counts, corners)
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
    if interpolation != "faceVarying":
        return _spread(prim, name, values[indices], interpolation, points, counts, corners)
    at = _spread(prim, name, indices[:, None].astype(np.float64), interpolation, points, counts, corners).at
    return Values(values, indices[at].astype(np.int64), interpolation)


def _spread(
    prim: Usd.Prim, name: str, values: Floats, interpolation: str, points: int, counts: Ints, corners: Ints
) -> Values:
    """Which of ``values`` (n, k) each corner has, by their USD interpolation."""
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
        at = np.arange(len(corners))
    elif interpolation == "uniform":
        at = np.repeat(np.arange(len(counts)), counts)
    elif interpolation == "constant":
        at = np.zeros(len(corners), np.int64)
    else:
        at = corners.astype(np.int64)
    return Values(values, at, interpolation)


def reversed_order(counts: Ints) -> Ints:
    """The permutation (c,) that turns every face round and keeps its first corner, so diagonals keep their names."""
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    size = np.repeat(counts, counts)
    place = np.arange(len(starts)) - starts
    return np.asarray(starts + (size - place) % size, np.int32)
