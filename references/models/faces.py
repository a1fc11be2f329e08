"""Faults of single faces: one that is missing, and cracks between those that should meet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from notabug.references.models.model import Edit, Model, edit_meshes
from notabug.references.viewing import centre_rays, projected
from notabug.scenes_usd.scene import Floats, Material, Mesh, Scene
from notabug.scenes_usd.triangulate import split_ngons, triangulate

Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Gone = dict[int, frozenset[int]]
"""Numbers of triangles that are missing, by the number of their object."""

_WATERTIGHT = "Woop, Benthin and Wald 2013, Watertight ray/triangle intersection; OpenGL specification: fill rules"
_STAGE = "UsdGeomMesh: faceVertexIndices"

OR_BLACK = ", or drawn black, as where their normals point away from the light"
"""What faces may be that seem to be missing where what lies behind them is black."""
CRACK = 1.0  # pixels by which corners are drawn back: two faces then part by about one
BACKING = 1e-4  # of the distance, by which what shows in a dark crack lies behind the face
WITHIN = np.array([(a, b) for a in (0.12, 0.33, 0.54) for b in (0.12, 0.33, 0.54) if a + b < 0.9])
"""Places in a triangle, as weights of its second and third corner, at which it is looked for in the picture."""
MISSED = 0.8  # share of a triangle's places that are wrong where it is missing; at its border others show
VISIBLE = 0.25  # share of its places that a triangle must show at least
LARGE = 100.0  # pixels: the area from which on every pixel of a triangle is looked at
SMALLEST = 1.0  # pixels: the area of a triangle that can be told
MOST_MISSING = 0.22  # share of the triangles beyond which it is another fault than faces that are left out


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with meshes."""
    if not any(True for _ in scene.meshes):
        return
    yield Model(
        name="face_missing",
        kind="fault",
        claim="a triangle is missing",
        cites=_STAGE,
        edit=_largest_missing,
        placed=lambda wrong: missing(scene, wrong),
        if_black=OR_BLACK,
    )
    if not any(len(each.counts) > 1 or each.has_ngons for each in scene.meshes):
        return
    for claim, edit in (
        ("there are cracks between faces, in which what lies behind them is seen", cracked),
        ("there are cracks between faces, which are dark", darkly_cracked),
    ):
        yield Model(
            name="cracks",
            kind="fault",
            claim=claim,
            cites=_WATERTIGHT,
            rule="set",
            edit=edit,
            local=True,
            rare=True,  # cracks of a fine mesh show dots nearly everywhere
        )


def cracked(scene: Scene) -> Scene:
    """Every face of every mesh drawn back from its edges by half a pixel."""
    return edit_meshes(scene, _drawn_back(scene))


def darkly_cracked(scene: Scene) -> Scene:
    """As ``cracked``, with black faces behind the cracks."""
    eye, back = scene.camera.to_world[3, :3], scene.camera.to_world[2, :3]
    black = len(scene.materials)

    def behind(points: Floats) -> Floats:
        off = points - eye
        if scene.camera.orthographic:
            return points + BACKING * (off @ back)[:, None] * back
        return np.asarray(eye + off * (1.0 + BACKING))

    backs = tuple(
        replace(
            each,
            path=f"{each.path}/Cracks",
            points=np.ascontiguousarray(behind(each.points)),
            material=black,
            normals=None,
            uv=None,
        )
        for each in scene.as_intended().meshes
    )
    parted = cracked(scene)
    return replace(
        parted, objects=(*parted.objects, *backs), materials=(*scene.materials, Material("/Cracks", (0.0, 0.0, 0.0)))
    )


def _drawn_back(scene: Scene) -> Callable[[Mesh], Mesh]:
    def change(mesh: Mesh) -> Mesh:
        cut = split_ngons(mesh, "02") if mesh.has_ngons else mesh
        corners = cut.points[cut.corners].reshape(-1, 3, 3)
        middle = corners.mean(axis=1, keepdims=True)
        seen, _ = projected(scene, corners)
        centre, _ = projected(scene, middle)
        away = np.linalg.norm(seen - centre, axis=2, keepdims=True)
        share = np.minimum(CRACK / np.maximum(away, 1e-9), 0.5)
        moved = (corners + (middle - corners) * share).reshape(-1, 3)
        share = share.reshape(-1, 1)

        def inwards(values: Floats | None) -> Floats | None:
            if values is None:
                return None
            mean = np.repeat(values.reshape(-1, 3, values.shape[1]).mean(axis=1), 3, axis=0)
            return np.ascontiguousarray(values + (mean - values) * share)

        normals = inwards(cut.normals)
        if normals is not None:
            normals = np.ascontiguousarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))
        return replace(
            cut,
            points=np.ascontiguousarray(moved),
            corners=np.arange(len(moved), dtype=np.int32),
            normals=normals,
            uv=inwards(cut.uv),
        )

    return change


def missing(scene: Scene, wrong: Bools, known: Gone | None = None) -> Model | None:
    """The fault of the triangles that lie where the picture is ``wrong`` (h, w); None where there are none, or many.

    ``known`` are triangles that are missing anyway: then ``wrong`` is where the picture differs from one without them.
    """
    from notabug.references.predict import predict  # which itself knows of models

    known = known or {}
    found: list[tuple[float, int, int, int, Ints]] = []
    total = 0
    # what is seen tells of a shadow, which may be as dark as what is behind a missing triangle, that it is another one
    seen = predict(_without(known)(scene) if known else scene).ids
    for index, mesh in enumerate(scene.objects):
        if isinstance(mesh, Mesh) and len(mesh.counts):
            found += [
                (depth, index, face, what, at)
                for depth, face, what, at in _wrong_triangles(scene, mesh, wrong, seen)
                if face not in known.get(index, ())
            ]
            total += int((mesh.counts - 2).sum())
    taken = np.zeros(wrong.shape, np.bool_)
    gone = {index: set(triangles) for index, triangles in known.items()}
    before = count = sum(len(triangles) for triangles in gone.values())
    shown: dict[int, dict[int, int]] = {}  # at an object's silhouette what is behind it is seen: whose is what is seen
    for _, index, _, what, places in found:
        by = shown.setdefault(what, {})
        by[index] = by.get(index, 0) + len(places)
    for _, index, triangle, what, places in sorted(found, key=lambda each: each[:3]):  # the nearest one was seen
        x, y = places.T
        if index == max(shown[what], key=lambda each, of=what: shown[of][each]) and taken[y, x].mean() < 0.5:  # type: ignore[misc]
            taken[y, x] = True
            gone.setdefault(index, set()).add(triangle)
            count += 1
    if count == before or count > max(2.0, MOST_MISSING * total):
        return None
    paths = ", ".join(scene.objects[index].path for index in gone)
    said = "a triangle" if count == 1 else f"{count} triangles"
    every = {index: frozenset(each) for index, each in gone.items()}
    return Model(
        name="face_missing",
        kind="fault",
        claim=f"{said} of {paths} {'is' if count == 1 else 'are'} missing",
        cites=_STAGE,
        edit=_without(every),
        placed=lambda left: missing(scene, left, every),
        if_black=OR_BLACK,
    )


def _largest_missing(scene: Scene) -> Scene:
    """``scene`` without the triangle that faces the camera and is largest in the picture."""
    largest: tuple[float, int, int] = (-1.0, 0, 0)
    for index, mesh in enumerate(scene.objects):
        if isinstance(mesh, Mesh) and len(mesh.counts):
            seen, depth = projected(scene, triangulate(mesh).points)
            one, other = seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0]
            area = one[:, 1] * other[:, 0] - one[:, 0] * other[:, 1]  # y is down: counter-clockwise ones are positive
            area = np.where(depth.min(axis=1) > 0, area, -1.0)
            largest = max(largest, (float(area.max()), index, int(area.argmax())))
    return _without({largest[1]: frozenset({largest[2]})})(scene)


def _wrong_triangles(
    scene: Scene, mesh: Mesh, wrong: Bools, seen_there: Ints
) -> Iterator[tuple[float, int, int, Ints]]:
    """Depth, number, what is seen and places (x, y) of each triangle of ``mesh`` whose visible places are ``wrong``.

    What is seen where most of a triangle's places are wrong (``seen_there``, a number for each surface) is taken for
    the triangle; where something else is seen, that hides it.
    """
    corners = triangulate(mesh).points
    seen, depth = projected(scene, corners)
    one, other = seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0]
    area = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    behind = depth.min(axis=1) <= 0
    large = (depth.max(axis=1) > 0) & (behind | (area > LARGE))
    at = seen[:, :1] + WITHIN[:, :1] * one[:, None] + WITHIN[:, 1:] * other[:, None]
    height, width = wrong.shape
    inside = (at >= 0).all(axis=2) & (at[..., 0] < width) & (at[..., 1] < height)
    x, y = (np.where(inside, each, 0).astype(np.int64) for each in (at[..., 0], at[..., 1]))
    hit = inside & wrong[y, x]
    small = ~behind & ~large & (area >= SMALLEST) & hit.any(axis=1)
    small &= hit.sum(axis=1) >= VISIBLE * inside.sum(axis=1)
    rays = centre_rays(scene)
    for each in np.flatnonzero(small | large):
        if large[each]:
            column, row = _covered(rays, corners[each], None if behind[each] else seen[each])
        else:
            column, row = x[each][inside[each]], y[each][inside[each]]
        bad = wrong[row, column]
        if not bad.any() or bad.mean() < VISIBLE:
            continue
        ids = seen_there[row, column]
        values, counts = np.unique(ids[bad], return_counts=True)
        own = ids == values[counts.argmax()]
        if bad[own].mean() >= MISSED:
            nearness = float(np.maximum(depth[each], 0.0).mean())
            yield nearness, int(each), int(ids[own][0]), np.stack([column[own], row[own]], axis=1)


def _covered(
    rays: tuple[npt.NDArray[np.floating], npt.NDArray[np.floating]], triangle: Floats, place: Floats | None
) -> tuple[Ints, Ints]:
    """The pixels (columns, rows) whose centres' ``rays`` meet ``triangle`` (3, 3), which may reach behind the camera.

    ``rays`` are their starts and directions (h, w, 3). A triangle that is all before the camera has a ``place`` in the
    picture, its corners (3, 2) in pixels, outside of which no ray is tried.
    """
    height, width = rays[0].shape[:2]
    rows, columns = slice(0, height), slice(0, width)
    if place is not None:
        first = np.clip(np.floor(place.min(axis=0)) - 1, 0, (width, height)).astype(np.int64)
        last = np.clip(np.ceil(place.max(axis=0)) + 1, 0, (width, height)).astype(np.int64)
        columns, rows = (slice(int(least), int(most)) for least, most in zip(first, last, strict=True))
    starts, directions = (each[rows, columns] for each in rays)
    # start + t ray = first + u one + v other, by Cramer's rule
    one, other, start = triangle[1] - triangle[0], triangle[2] - triangle[0], starts - triangle[0]
    normal = np.cross(one, other)
    slope = directions @ normal
    slope = np.where(np.abs(slope) > 1e-300, slope, 1e-300)
    t = -(start @ normal) / slope
    point = start + t[..., None] * directions
    size = max(float(normal @ normal), 1e-300)
    u, v = point @ np.cross(other, normal) / size, point @ np.cross(normal, one) / size
    row, column = np.nonzero((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0))
    return column + columns.start, row + rows.start


def _without(gone: Gone) -> Edit:
    """Objects without the triangles of those numbers; a quad that loses one keeps the other."""

    def edit(scene: Scene) -> Scene:
        objects = [
            _reduced(each, gone[index]) if index in gone and isinstance(each, Mesh) else each
            for index, each in enumerate(scene.objects)
        ]
        return replace(scene, objects=tuple(each for each in objects if not isinstance(each, Mesh) or len(each.counts)))

    return edit


def _reduced(mesh: Mesh, gone: frozenset[int]) -> Mesh:
    cut = triangulate(mesh)
    lost = np.isin(np.arange(len(cut.face)), list(gone))
    touched = np.zeros(len(mesh.counts), np.bool_)
    touched[cut.face[lost]] = True
    start = np.concatenate([[0], np.cumsum(mesh.counts)[:-1]])
    corners: list[int] = []
    counts: list[int] = []
    kept: dict[int, list[npt.NDArray[np.integer]]] = {int(each): [] for each in np.flatnonzero(touched)}
    for triangle in np.flatnonzero(~lost & touched[cut.face]):
        kept[int(cut.face[triangle])].append(cut.corner[triangle])
    for face, count in enumerate(mesh.counts):
        parts = kept[face] if touched[face] else [np.arange(start[face], start[face] + count)]
        for each in parts:
            corners += [int(corner) for corner in each]
            counts.append(len(each))
    order = np.array(corners, np.intp)
    return replace(
        mesh,
        counts=np.array(counts, np.int32),
        corners=np.ascontiguousarray(mesh.corners[order]),
        normals=None if mesh.normals is None else np.ascontiguousarray(mesh.normals[order]),
        uv=None if mesh.uv is None else np.ascontiguousarray(mesh.uv[order]),
    )
