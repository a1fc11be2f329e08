"""Faults of geometry: wrong vertex normals, lost faces and objects, mirrored transforms, exchanged materials."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from notabug.references.models.faces import OR_BLACK
from notabug.references.models.model import Edit, Model, edit_meshes
from notabug.scenes_usd.authoring.shapes import lat_long
from notabug.scenes_usd.scene import Floats, Ints, Mesh, Scene, Sphere

_NORMALS = "Turkowski 1990, Transformations of Surface Normal Vectors; UsdGeomMesh: normals, orientation"
_STAGE = "UsdGeomXformable, UsdShadeMaterialBindingAPI"


AROUND, HIGH = 256, 128  # facets of a mesh that stands for a sphere, around its axis and from pole to pole
_EXCHANGED = np.eye(3)[[0, 2, 1]]
UP_AXES: tuple[tuple[Floats, str], ...] = (
    (_EXCHANGED * [1.0, 1.0, -1.0], " and z negated"),
    (_EXCHANGED * [1.0, -1.0, 1.0], " and y negated"),
    (_EXCHANGED, ""),
)
"""Matrices for row vectors that take a vector for one of a stage with the other up axis, and what they do besides."""


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with objects; those of vertex normals where a mesh has them and a light shows them."""
    if scene.lights and any(each.normals is not None for each in scene.meshes):
        yield from _of_normals(scene)
    if scene.lights and any(isinstance(each, Sphere) or each.normals is not None for each in scene.objects):
        for axis in range(3):
            yield Model(
                name="normals_negated",
                kind="fault",
                claim=f"the {'xyz'[axis]} of normals is negated, points are where they should be",
                cites=_NORMALS,
                edit=_negated(axis),
                local=True,
            )
    if len(scene.objects) > 1:
        for index, each in enumerate(scene.objects):
            yield Model(
                name="object_missing",
                kind="fault",
                claim=f"{each.path} is missing, or faces of it are",
                cites=_STAGE,
                edit=_without(index),
                local=True,
                darkened=_unlit(each.path),
                if_black=OR_BLACK,
            )
    used = sorted({shape.material for shape in scene.objects})
    for first, second in ((a, b) for a in used for b in used if a < b):
        yield Model(
            name="materials_exchanged",
            kind="fault",
            claim=f"{scene.materials[first].path} and {scene.materials[second].path} are exchanged",
            cites=_STAGE,
            edit=_exchanged(first, second),
        )
    for axis in range(3):
        yield Model(
            name="geometry_mirrored",
            kind="fault",
            claim=f"every mesh is mirrored along {'xyz'[axis]}",
            cites=_STAGE,
            edit=lambda scene, axis=axis: edit_meshes(scene, lambda mesh: mirrored(mesh, axis)),  # type: ignore[misc]
            rare=True,  # a mirrored floor shows what a flipped texture shows
        )


def _of_normals(scene: Scene) -> Iterator[Model]:
    changes: list[tuple[str, str, Callable[[Mesh], Floats], bool]] = [
        ("normals_flipped", "interpolated normals point inwards", lambda mesh: -_of(mesh), True),
        ("normals_swapped", "each corner has the normal of the next one", _swapped, False),
        ("normals_lost", "faces at the first point have lost their normals", _lost, False),
        ("normals_of_first_corner", "each face has the normal of its first corner", _first, False),
    ]
    if any(_skews(each) for each in scene.meshes):
        claim = "normals are transformed by M instead of its inverse transpose"
        changes.append(("normals_by_matrix", claim, by_matrix, False))
    for name, claim, change, local in changes:
        yield Model(name=name, kind="fault", claim=claim, cites=_NORMALS, edit=normals(change), local=local)
    for turn, how in UP_AXES:
        yield Model(
            name="normals_up_axis",
            kind="fault",
            claim=f"the normals of meshes have y and z exchanged{how}, their points have not",
            cites=f"{_NORMALS}; UsdGeom: upAxis",
            edit=normals(lambda mesh, turn=turn: np.asarray(_of(mesh) @ turn)),  # type: ignore[misc]
            local=True,
        )


def normals(change: Callable[[Mesh], Floats]) -> Edit:
    """An edit of the normals of every mesh that has some; ``change`` returns (c, 3)."""

    def one(mesh: Mesh) -> Mesh:
        return mesh if mesh.normals is None else replace(mesh, normals=np.ascontiguousarray(change(mesh)))

    return lambda scene: edit_meshes(scene, one)


def _negated(axis: int) -> Edit:
    """An edit that negates one component, in world space, of every smooth normal: of meshes, and of exact spheres."""
    sign = np.where(np.arange(3) == axis, -1.0, 1.0)
    change = normals(lambda mesh: _of(mesh) * sign)

    def edit(scene: Scene) -> Scene:
        objects = tuple(smooth_mesh(each) if isinstance(each, Sphere) else each for each in scene.objects)
        return change(replace(scene, objects=objects))

    return edit


def smooth_mesh(sphere: Sphere) -> Mesh:
    """A mesh with the sphere's own normals, for shading that no exact sphere has.

    It has so many facets that its outline is less than a hundredth of a pixel inside the sphere's where that is 100
    pixels wide.
    """
    unit, corners = _unit_mesh()
    linear, origin = sphere.to_world[:3, :3], sphere.to_world[3, :3]
    if np.linalg.det(linear) < 0.0:  # mirrored: seen from outside the corners run clockwise
        corners = corners[:, ::-1]
    outwards = unit @ np.linalg.inv(linear).T
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    at = np.ascontiguousarray(corners.reshape(-1))
    return Mesh(
        sphere.path,
        points=unit * sphere.radius @ linear + origin,
        counts=np.full(len(corners), 3, np.int32),
        corners=at,
        material=sphere.material,
        normals=outwards[at],
        to_world=sphere.to_world,
    )


@cache
def _unit_mesh() -> tuple[Floats, Ints]:
    """Points (p, 3) of the unit sphere, which are their own normals, and corners (t, 3) of its triangles."""
    points, faces = lat_long(AROUND, HIGH)
    return np.array(points, np.float64), np.array(faces, np.int32)


def _of(mesh: Mesh) -> Floats:
    assert mesh.normals is not None
    return mesh.normals


def _skews(mesh: Mesh) -> bool:
    sizes = np.linalg.svd(mesh.to_world[:3, :3])[1]
    return mesh.normals is not None and bool(sizes.max() > 1.001 * sizes.min())


def by_matrix(mesh: Mesh) -> Floats:
    """Normals as they come out of M: local ones are n M^T for row vectors, because n is local (M^-1)^T."""
    matrix = mesh.to_world[:3, :3]
    wrong = _of(mesh) @ matrix.T @ matrix
    return np.asarray(wrong / np.linalg.norm(wrong, axis=1, keepdims=True))


def _starts(mesh: Mesh) -> Floats:
    """(c,) the number of the first corner of each corner's face."""
    starts = np.concatenate([[0], np.cumsum(mesh.counts)[:-1]])
    return np.repeat(starts, mesh.counts)


def _swapped(mesh: Mesh) -> Floats:
    start = _starts(mesh)
    size = np.repeat(mesh.counts, mesh.counts)
    return np.asarray(_of(mesh)[start + (np.arange(len(start)) - start + 1) % size])


def _first(mesh: Mesh) -> Floats:
    return np.asarray(_of(mesh)[_starts(mesh)])


def _lost(mesh: Mesh) -> Floats:
    """Faces that use point 0 get their own normal: the test ``if (index)`` takes 0 for none."""
    face = np.repeat(np.arange(len(mesh.counts)), mesh.counts)
    hit = np.zeros(len(mesh.counts), bool)
    hit[face[mesh.corners == 0]] = True
    first = np.unique(_starts(mesh))
    p = mesh.points[mesh.corners]
    flat = np.cross(p[first + 1] - p[first], p[first + 2] - p[first])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
    flat *= np.where((flat * _of(mesh)[first]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    return np.where(hit[face][:, None], flat[face], _of(mesh))


def _unlit(path: str) -> Edit:
    """An edit after which no light falls on the object of that path, which casts its shadows all the same."""
    return lambda scene: replace(
        scene, lights=tuple(replace(light, unlit=(*light.unlit, path)) for light in scene.lights)
    )


def _without(index: int) -> Edit:
    return lambda scene: replace(scene, objects=scene.objects[:index] + scene.objects[index + 1 :])


def _exchanged(first: int, second: int) -> Edit:
    other = {first: second, second: first}

    def edit(scene: Scene) -> Scene:
        objects = tuple(replace(shape, material=other.get(shape.material, shape.material)) for shape in scene.objects)
        return replace(scene, objects=objects)

    return edit


def mirrored(mesh: Mesh, axis: int) -> Mesh:
    """``mesh`` mirrored along a world axis about the middle of its bounds, still facing outwards."""
    flip = np.where(np.arange(3) == axis, -1.0, 1.0)
    middle = (mesh.points.min(axis=0) + mesh.points.max(axis=0)) / 2
    start, size = _starts(mesh), np.repeat(mesh.counts, mesh.counts)
    back = 2 * start + size - 1 - np.arange(len(start))  # the other way round, so that faces keep their side
    return replace(
        mesh,
        points=np.ascontiguousarray((mesh.points - middle) * flip + middle),
        corners=np.ascontiguousarray(mesh.corners[back]),
        normals=None if mesh.normals is None else np.ascontiguousarray((mesh.normals * flip)[back]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[back]),
    )
