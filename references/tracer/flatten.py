"""Scene -> Flat: the arrays that the native code reads (references/native/scene.h), in the precision asked for.

What a scene lacks is None.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from notabug.references.tracer.emitters import emitters
from notabug.references.tracer.hierarchy import Corners, hierarchy_of
from notabug.references.tracer.skies import Skies, skies
from notabug.references.tracer.tangents import scene_tangents
from notabug.scenes_usd.faces import patches, shapes
from notabug.scenes_usd.scene import Light, Mesh, Object, Preview, Scene
from notabug.scenes_usd.triangulate import Triangles, triangulate

Array = npt.NDArray[Any]
Real = Callable[[npt.ArrayLike], Array]
"""What brings numbers into the arithmetic of the kernels."""


class Quads(NamedTuple):
    """Faces with four corners, for their bilinear maps: plane coordinates and the plane's frame."""

    of_triangle: Array  # (t,) quad of each triangle, or -1
    corners: Array  # (q, 4) face corners into Flat.normal and Flat.uv
    plane: Array  # (q, 8) x, y of the four corners in the face's plane, in a unit of about its size
    frame: Array  # (q, 9) origin, x axis, y axis, both over that unit
    points: Array  # (q, 12) the four corners


class Textures(NamedTuple):
    """All textures end to end: texel k of a picture is ``texels[first + k]``, row 0 at v = 1."""

    texels: Array  # (n, 3)
    info: Array  # (textures, 5) int64: first, width, height, wrap_s, wrap_t by their place in WRAPS


class Spheres(NamedTuple):
    """Analytic spheres: world to local and back, as 3x4 affine maps for column vectors, row by row."""

    radius: Array  # (s,)
    to_local: Array  # (s, 12)
    to_world: Array  # (s, 12)
    object: Array  # (s,)


class Lobes(NamedTuple):
    """Highlights per material: specular rgb and exponent; kind 0 none, 1 Phong, 2 Blinn, +2 cosine-weighted."""

    specular: Array  # (m, 4)
    kind: Array  # (m,)


class Secondary(NamedTuple):
    """What sends rays on, per material: opacity, mirror rgb, transmission rgb, index of refraction."""

    coefficients: Array  # (m, 8)


class Previews(NamedTuple):
    """UsdPreviewSurface per material: see PreviewSurface and PreviewMaps of references/native/scene.h."""

    surface: Array  # (m, 13)
    maps: Array  # (m, 4) textures, or -1


class Cutouts(NamedTuple):
    """Opacity from textures, per material: see Cutouts of references/native/scene.h."""

    map: Array  # (m,) a texture, or -1
    least: Array  # (m,) what it must say where the surface is whole; 0: it says how much of it is there


class Flat(NamedTuple):
    """A scene for the native code. Triangles are in the order of the hierarchy's leaves."""

    nodes: Array  # (nodes, 64) of the hierarchy: see bvh.widen
    boxes: Array  # (5,) what its boxes are relative to
    leaves: Array  # (leaves, 36) triangles side by side
    first: Array  # (leaves,) triangle of each leaf
    points: Array  # (t, 9)
    face: Array  # (t,) flat face of the whole scene: rays leaving a face do not hit it again
    object: Array  # (t,) index into Scene.objects
    corner: Array  # (t, 3) face corners into normal and uv
    sagitta: Array  # (t,) how far the facet may lie below the surface its normals imply; -1 where it is flat
    normal: Array  # (c, 3)
    uv: Array  # (c, 2)
    material: Array  # (objects,)
    diffuse: Array  # (m, 3)
    texture: Array  # (m,) or -1
    light: Array  # (lights, 7): 0 with a place | 1 without, position or direction, intensity or radiance
    emitters: Array | None  # (lights, 42) where any has a size, beam, multiplier or link: Emitter of native/scene.h
    links: (
        Array | None
    )  # (lights, objects) uint8: 1 where the light does not reach it, 2 where it casts no shadow of it
    camera: Array  # (17,): origin, x axis * tan_x, y axis * tan_y, -z axis, near, far, shift_x, shift_y, orthographic
    radius: Any  # of the whole scene, a scalar of the arrays' precision, for error bounds
    quads: Quads | None
    textures: Textures | None
    skies: Skies | None
    spheres: Spheres | None
    lobes: Lobes | None
    secondary: Secondary | None
    previews: Previews | None
    cutouts: Cutouts | None
    tangents: Array | None  # (c, 3) where any surface has a normal map


def sagitta(points: npt.NDArray[np.float64], normals: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The depth (t,) of flat triangles below the surface that their normals imply; both arrays are (t, 3, 3).

    An arc of length e that turns by the angle a has the sagitta e * a / 8; the largest of the three edges counts, and
    twice, because the middle of a facet lies deeper than the middle of its edges (at most 4/3 times for a sphere).
    """
    chord = np.linalg.norm(points - np.roll(points, -1, axis=1), axis=2)
    turn = np.linalg.norm(normals - np.roll(normals, -1, axis=1), axis=2)
    return np.asarray(2.0 * (chord * turn).max(axis=1) / 8.0)


class _Geometry(NamedTuple):
    """What of a Flat follows from the meshes alone; ``reach`` is the farthest coordinate."""

    nodes: Array
    boxes: Array
    leaves: Array
    first: Array
    points: Array
    face: Array
    object: Array
    corner: Array
    sagitta: Array
    normal: Array
    uv: Array
    quads: Quads | None
    reach: float


@lru_cache(maxsize=2)  # most models edit no mesh; more would hold much memory where meshes are large
def _geometry(objects: tuple[Object, ...], dtype: np.dtype[np.generic]) -> _Geometry:
    parts: list[Triangles] = []
    owners, faces, corners, depths = [], [], [], []
    normals, uvs = [np.zeros((0, 3))], [np.zeros((0, 2))]
    quads: list[tuple[npt.NDArray[np.float64], int, int]] = []  # points (4, 3), first corner, face
    face_base = corner_base = 0
    for index, each in enumerate(objects):
        if not isinstance(each, Mesh):
            continue
        cut = _with_area(triangulate(each), dtype)
        flat_faces = _flat_faces(each, cut)
        parts.append(cut)
        owners.append(np.full(len(cut.face), index))
        faces.append(flat_faces + face_base)
        corners.append(cut.corner + corner_base)
        total = len(each.corners)
        if each.normals is None:
            depths.append(np.full(len(cut.face), -1.0))
            normals.append(np.zeros((total, 3)))
        else:
            depths.append(sagitta(cut.points, each.normals[cut.corner]))
            normals.append(each.normals)
        uvs.append(np.zeros((total, 2)) if each.uv is None else each.uv)
        if each.normals is not None or each.uv is not None:
            starts = np.concatenate([[0], np.cumsum(each.counts)[:-1]])
            for face in np.flatnonzero(patches(each)):
                first = int(starts[face])
                quads.append((each.points[each.corners[first : first + 4]], first + corner_base, int(face) + face_base))
        face_base += max(len(each.counts), int(flat_faces.max(initial=-1)) + 1)
        corner_base += total

    points = np.concatenate([part.points for part in parts]) if parts else np.zeros((0, 3, 3))
    hierarchy = hierarchy_of(Corners(points.reshape(-1, 9)), dtype)
    order = hierarchy.order
    face_of = _joined(faces, order, np.int32)
    real = partial(_real, dtype)
    return _Geometry(
        nodes=hierarchy.nodes,
        boxes=hierarchy.boxes,
        leaves=hierarchy.leaves,
        first=hierarchy.first,
        points=hierarchy.points,
        face=face_of,
        object=_joined(owners, order, np.int32),
        corner=_joined(corners, order, np.int32).reshape(-1, 3),
        sagitta=real(np.concatenate(depths)[order] if depths else []),
        normal=real(np.concatenate(normals)),
        uv=real(np.concatenate(uvs)),
        quads=_quads(quads, face_of, real),
        reach=float(np.abs(points).max(initial=0.0)),
    )


def _real(dtype: np.dtype[np.generic], array: npt.ArrayLike) -> Array:
    return np.ascontiguousarray(array, dtype)


def flatten(scene: Scene, dtype: npt.DTypeLike = np.float64) -> Flat:
    """The arrays of ``scene`` in ``dtype`` (float32 or float64); the hierarchy is built in float64 either way."""
    geometry = _geometry(tuple(scene.objects), np.dtype(dtype))._asdict()
    real = partial(_real, np.dtype(dtype))
    materials = scene.materials
    reach = [geometry.pop("reach")] + [np.abs(each.to_world[:3]).sum() * each.radius for each in scene.spheres]
    reach += [np.abs(each.to_world[3, :3]).max() for each in scene.spheres]
    tangents = scene_tangents(scene)
    return Flat(
        **geometry,
        material=np.array([each.material for each in scene.objects], np.int32),
        diffuse=real([each.diffuse for each in materials]).reshape(-1, 3),
        texture=np.array([each.texture for each in materials], np.int32),
        light=real([_light(each) for each in scene.lights]).reshape(-1, 7),
        emitters=emitters(scene.lights, np.dtype(dtype)),
        links=_links(scene),
        camera=real(_camera(scene)),
        radius=np.dtype(dtype).type(max(reach)),
        textures=_textures(scene, real),
        skies=skies(scene.lights, real),
        spheres=_spheres(scene, real),
        lobes=_lobes(scene, real),
        secondary=_secondary(scene, real),
        previews=_previews(scene, real),
        cutouts=_cutouts(scene, real),
        tangents=None if tangents is None else real(tangents),
    )


def _with_area(cut: Triangles, dtype: npt.DTypeLike) -> Triangles:
    """``cut`` without triangles whose normal is nothing in the arithmetic of ``dtype``: no ray can be said to hit one.

    The kernels take the root of the normal's square, a fourth power of the edges.
    """
    limits = np.finfo(np.dtype(dtype))
    a, b, c = np.moveaxis(cut.points.astype(dtype).astype(np.float64), 1, 0)
    square = np.square(np.cross(b - a, c - a)).sum(axis=1)
    drawn = (square >= float(limits.smallest_subnormal)) & (square <= float(limits.max))
    if drawn.all():
        return cut
    return Triangles(cut.corner[drawn], cut.point[drawn], cut.points[drawn], cut.face[drawn])


def _flat_faces(mesh: Mesh, cut: Triangles) -> npt.NDArray[np.int32]:
    """The flat face (t,) that each triangle lies in: its polygon; where that bends, a face of its own behind them."""
    bent = ~shapes(mesh).flat[cut.face]
    own = len(mesh.counts) + np.cumsum(bent, dtype=np.int32) - 1
    return np.where(bent, own, cut.face).astype(np.int32)


def _joined(parts: Sequence[npt.NDArray[np.integer]], order: Array, dtype: npt.DTypeLike) -> Array:
    return np.ascontiguousarray(np.concatenate(parts)[order], dtype) if parts else np.zeros(0, dtype)


def _light(light: Light) -> tuple[float, ...]:
    far = light.kind in ("distant", "sun", "dome")
    return (float(far), *(light.direction if far else light.position), *light.intensity)


def _links(scene: Scene) -> Array | None:
    if not any(light.is_linked for light in scene.lights):
        return None
    paths = [shape.path for shape in scene.objects]
    return np.array(
        [[(path in light.unlit) + 2 * (path in light.unshadowing) for path in paths] for light in scene.lights],
        np.uint8,
    )


def _camera(scene: Scene) -> npt.NDArray[np.float64]:
    camera = scene.camera
    x, y, z, origin = (camera.to_world[i, :3] for i in range(4))
    rest = [camera.near, camera.far, camera.shift_x, camera.shift_y, float(camera.orthographic)]
    return np.concatenate([origin, x * camera.tan_x, y * camera.tan_y, -z, rest])


def _quads(found: list[tuple[npt.NDArray[np.float64], int, int]], face: Array, real: Real) -> Quads | None:
    if not found:
        return None
    numbers = np.array([number for _, _, number in found])
    first = np.array([start for _, start, _ in found])
    points = np.array([corners for corners, _, _ in found])
    of_face = np.full(max(int(face.max(initial=0)), int(numbers.max())) + 1, -1, np.int32)
    of_face[numbers] = np.arange(len(found))
    x = _unit(points[:, 1] - points[:, 0])
    z = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])
    y = np.cross(_unit(z), x)
    # a power of two is exact; it keeps fourth powers in float32's range
    scale = 2.0 ** -np.round(np.log2(np.ptp(points, axis=1).max(axis=1)))[:, None]
    x, y = x * scale, y * scale
    off = points - points[:, :1]
    plane = np.stack([(off * axis[:, None]).sum(axis=2) for axis in (x, y)], axis=2)
    return Quads(
        of_face[face],
        (first[:, None] + np.arange(4)).astype(np.int32),
        real(plane.reshape(-1, 8)),
        real(np.hstack([points[:, 0], x, y])),
        real(points.reshape(-1, 12)),
    )


def _unit(vectors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """``vectors`` (n, 3), each at length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


WRAPS = ("repeat", "clamp", "mirror", "black")  # in the order of Wrap in references/native/scene.h


def _textures(scene: Scene, real: Real) -> Textures | None:
    if not scene.textures:
        return None
    info, first = [], 0
    for each in scene.textures:
        height, width = each.pixels.shape[:2]
        info.append((first, width, height, WRAPS.index(each.wrap_s), WRAPS.index(each.wrap_t)))
        first += width * height
    texels = np.concatenate([each.pixels.reshape(-1, 3) for each in scene.textures])
    return Textures(real(texels), np.array(info, np.int64))


def _spheres(scene: Scene, real: Real) -> Spheres | None:
    found = [(i, each) for i, each in enumerate(scene.objects) if not isinstance(each, Mesh)]
    if not found:
        return None
    return Spheres(
        real([each.radius for _, each in found]),
        real([np.linalg.inv(each.to_world).T[:3].ravel() for _, each in found]),
        real([each.to_world.T[:3].ravel() for _, each in found]),
        np.array([i for i, _ in found], np.int32),
    )


def _lobes(scene: Scene, real: Real) -> Lobes | None:
    if not any(any(each.specular) for each in scene.materials):
        return None
    kind = [
        (1 if each.lobe == "phong" else 2) + 2 * each.cosine_weighted if any(each.specular) else 0
        for each in scene.materials
    ]
    return Lobes(real([(*each.specular, each.exponent) for each in scene.materials]), np.array(kind, np.int32))


def _secondary(scene: Scene, real: Real) -> Secondary | None:
    rows = [(each.opacity, *each.mirror, *each.transmission, each.ior) for each in scene.materials]
    plain = not any(each.sends_on for each in scene.materials)
    if plain and all(each.preview is None for each in scene.materials) and all(each.is_plain for each in scene.lights):
        return None
    return Secondary(real(rows))


def _cutouts(scene: Scene, real: Real) -> Cutouts | None:
    maps = [each.opacity_map for each in scene.materials]
    if max(maps, default=-1) < 0:
        return None
    return Cutouts(np.array(maps, np.int32), real([each.least_opacity for each in scene.materials]))


_MASKING = ("separable", "correlated", "schlick")  # in the order of Masking in references/native/scene.h


def _previews(scene: Scene, real: Real) -> Previews | None:
    found = [each.preview for each in scene.materials]
    if not any(found):
        return None
    surface = [(0.0,) * 13 if each is None else _preview(each) for each in found]
    maps = [(-1,) * 4 if each is None else each.maps for each in found]
    return Previews(real(surface), np.array(maps, np.int32))


def _preview(surface: Preview) -> tuple[float, ...]:
    return (
        2.0 if surface.specular_workflow else 1.0,
        surface.metallic,
        surface.roughness,
        surface.ior,
        surface.clearcoat,
        surface.clearcoat_roughness,
        float(_MASKING.index(surface.masking)),
        *surface.specular,
        *surface.emission,
    )
