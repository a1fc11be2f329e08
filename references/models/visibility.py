"""Visibility inconsistency: surfaces so close to each other that rounding decides which one is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from notabug.references.models.model import Model
from notabug.scenes_usd.scene import Mesh, Scene
from notabug.scenes_usd.triangulate import triangulate

_PAPER = "Woo, Pearce and Ouellette 1996, figure 9"

# What cannot be told apart along a ray, relative to distance and size: a few roundings of a float32 intersection, or of
# the float32 points that renderers with double arithmetic store too.
FLOAT = {"float32": 16 * 2.0**-24, "float64": 4 * 2.0**-24}
BITS = {"fixed16": 16, "fixed24": 24}


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with more than one object, or with a mesh that is folded over itself."""
    if len(scene.objects) < 2 and not any(_folded(each) for each in scene.meshes):
        return
    for precision, resolution in FLOAT.items():
        yield _fight("precision", precision, {"resolution": resolution})
    near, far = scene.camera.near, scene.camera.far
    for depth, bits in BITS.items():
        # a step of a fixed-point depth buffer at the depth z is z^2 (1/n - 1/f) / 2^b; a few of them may swap
        step = 4.0 * (1.0 / near - 1.0 / far) / 2.0**bits
        yield _fight("depth", depth, {"resolution": FLOAT["float32"], "near_resolution": step})
    # float32 with near at 0 rounds depths close to 1 to 2^-24, as 24 fixed bits do; with near at 1 the rounding shrinks
    # with the depth, to 2^-24 of it
    step = 4.0 * (1.0 / near - 1.0 / far) / 2.0**24
    yield _fight("depth", "float32", {"resolution": FLOAT["float32"], "near_resolution": step})
    yield _fight("depth", "reversed32", {"resolution": 2 * FLOAT["float32"]})


def _folded(mesh: Mesh) -> bool:
    """Whether a face is turned against the normals of its corners, so that it lies over or under others."""
    if mesh.normals is None:
        return False
    cut = triangulate(mesh)
    facet = np.cross(cut.points[:, 1] - cut.points[:, 0], cut.points[:, 2] - cut.points[:, 0])
    return bool((np.einsum("tkx,tx->tk", mesh.normals[cut.corner], facet) < 0).all(axis=1).any())


def _fight(field: str, value: str, resolution: dict[str, float]) -> Model:
    return Model(
        name="coincident_surfaces",
        kind="limitation",
        rule="set",
        claim="of surfaces that coincide within the renderer's resolution another one wins from pixel to pixel",
        cites=_PAPER,
        options={"ties": "another", **resolution},
        others=({"ties": "unlit", **resolution},),
        when=(field, value),
    )
