"""Naive interpolation: uv and normals that are linear in triangles where the polygon means a bilinear patch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from notabug.references.models.model import Edit, Model, edit_meshes, in_strengths
from notabug.scenes_usd.faces import are_affine, local_points, polygons, shapes
from notabug.scenes_usd.scene import Floats, Mesh, Scene
from notabug.scenes_usd.triangulate import Diagonal, split_ngons, triangulate

_PAPER = "Woo, Pearce and Ouellette 1996, figures 10 and 11"

_CUTS: dict[Diagonal, str] = {
    "02": "two triangles, cut along corners 0 and 2",
    "13": "two triangles, cut along corners 1 and 3",
    "shorter": "two triangles, cut along the shorter diagonal",
    "fan": "a fan of triangles from the first corner, although the face is not convex",
}


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with n-gons, or with textured meshes."""
    textured = [each for each in _drawn(scene) if each.uv is not None and scene.materials[each.material].textures]
    if textured and scene.intent is not None:
        diagonal = _diagonal_of(scene, scene.intent)
        yield Model(
            name=f"quad_split_{diagonal}" if diagonal else "coarse_uv",
            kind="limitation",
            claim=f"uv are linear in two triangles, cut along corners {diagonal[0]} and {diagonal[1]}"
            if diagonal
            else "uv are linear in the triangles of a subdivision",
            cites=_PAPER,
            edit=lambda scene: replace(scene, intent=None),
        )
    else:
        yield from _cuts(scene)
    if not textured:
        return
    yield Model(
        name="affine_uv",
        kind="fault",
        claim="uv are interpolated in screen space, without perspective",
        cites="Heckbert 1989, section 2.3; Blinn 1992",
        edit=_splitter("02"),
        options={"affine": True},
    )
    yield Model(
        name="swapped_uv",
        kind="fault",
        claim="u and v are exchanged",
        cites=_PAPER,
        edit=_uv(lambda uv, _: uv[:, ::-1]),
    )
    yield Model(
        name="flipped_v",
        kind="fault",
        claim="v runs downwards",
        cites="USD: st (0, 0) is the bottom left corner of the picture",
        edit=_uv(lambda uv, _: uv * np.array([1.0, -1.0]) + np.array([0.0, 1.0])),
        looks_like="upside_down",
    )
    for axis in range(2):
        yield in_strengths(
            lambda strength, axis=axis: Model(  # type: ignore[misc]
                name="shifted_uv",
                kind="fault",
                claim=f"uv are off by {strength:.3g} texels in {'uv'[axis]}",
                cites=_PAPER,
                edit=_uv(lambda uv, size: uv + np.eye(2)[axis] * strength / size),
            ),
            1.0,
        )
    for u, v in ((0.5, 0.5), (-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)):
        yield Model(
            name="texel_centre",
            kind="fault",
            claim=f"texels are looked up at their corners, not their centres: uv are off by ({u:+}, {v:+}) texels",
            cites="Heckbert 1990, What are the coordinates of a pixel?, Graphics Gems I",
            edit=_uv(lambda uv, size, by=(u, v): uv + np.array(by) / size),  # type: ignore[misc]
        )


def _cuts(scene: Scene) -> Iterator[Model]:
    """The ways to cut faces of more than three corners, shape, normals and uv together, that make a difference."""
    shown = [bool(material.textures) for material in scene.materials]
    bends = any(_bends(mesh, mesh.normals) or (shown[mesh.material] and _bends(mesh, mesh.uv)) for mesh in scene.meshes)
    folds = any(_folds(mesh) for mesh in scene.meshes)
    for each, how in _CUTS.items():
        if folds if each == "fan" else bends:
            cut = Model(
                name=f"quad_split_{each}",
                kind="limitation",
                claim=f"uv and normals are linear in {how}",
                cites=_PAPER,
                edit=_splitter(each),
                when=("ngon_split", each),
            )
            yield cut
            if each == "02" and not folds:  # a plain fan is the same cut; who declares nothing has it already
                yield replace(cut, when=("ngon_split", "fan"), strict=True)


def _drawn(scene: Scene) -> list[Mesh]:
    return [*scene.meshes, *([scene.intent] if scene.intent else [])]


def _bends(mesh: Mesh, values: Floats | None) -> bool:
    """Whether it matters how the mesh's n-gons are cut, by their shape or by their corners' ``values``.

    Not where they are flat and the values affine, as on a rectangle.
    """
    flat = shapes(mesh).flat
    if not flat.all():
        return True
    if values is None:
        return False
    points = local_points(mesh)
    return any(not are_affine(points[mesh.corners[at]], values[at]).all() for _, at in polygons(mesh))


def _folds(mesh: Mesh) -> bool:
    """Whether a plain fan from the first corner is another cut than the face's shape allows."""
    if shapes(mesh).convex.all():
        return False
    plain, sound = (triangulate(mesh, each).corner for each in ("fan", "02"))
    return plain.shape != sound.shape or bool((plain != sound).any())


def _splitter(diagonal: Diagonal) -> Edit:
    return lambda scene: edit_meshes(scene, lambda mesh: split_ngons(mesh, diagonal))


def _uv(change: Callable[[Floats, Floats], Floats]) -> Edit:
    """An edit of the uv of every textured mesh; ``change(uv, (width, height) of its first texture)`` returns new uv."""

    def edit(scene: Scene) -> Scene:
        def one(mesh: Mesh) -> Mesh:
            shown = scene.materials[mesh.material].textures
            if mesh.uv is None or not shown:
                return mesh
            height, width = scene.textures[min(shown)].pixels.shape[:2]
            return replace(mesh, uv=np.ascontiguousarray(change(mesh.uv, np.array([width, height], np.float64))))

        return edit_meshes(scene, one)

    return edit


def _diagonal_of(scene: Scene, intent: Mesh) -> Diagonal | None:
    """The diagonal by which what is drawn in the place of ``intent`` was cut from it, or None if it was not."""
    parent = intent.path.rsplit("/", 1)[0] + "/"
    drawn = [mesh for mesh in scene.meshes if mesh.path.startswith(parent)]
    if len(drawn) != 1:
        return None
    found = triangulate(drawn[0]).points
    diagonals: tuple[Diagonal, ...] = ("02", "13")
    for diagonal in diagonals:
        cut = triangulate(intent, diagonal).points
        if len(cut) == len(found) and _corner_set(cut) == _corner_set(found):
            return diagonal
    return None


def _corner_set(points: Floats) -> set[bytes]:
    """The triangles ``points`` (t, 3, 3), each whatever corner it starts at and whichever way it goes round."""
    x, y, z = np.moveaxis(points + 0.0, 2, 0)  # no negative zeros
    order = np.lexsort((z, y, x), axis=-1)
    return {row.tobytes() for row in np.take_along_axis(points + 0.0, order[:, :, None], axis=1)}
