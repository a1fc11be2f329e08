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
BITS = {"fixed16": 16, "fixed24": 24, "float32": 24}
STEPS = 4.0  # of a fixed-point depth buffer; so near surfaces may swap
# Depths in [0, 1] are computed in float32 before they are stored: measured, OpenGL's are off by up to 7 of these. A
# float32 buffer with near at 0 rounds most depths so too.
ARITHMETIC = 8.0 * 2.0**-24
FAR_ABOVE = 5e-4  # of distance and size: 500 times what float32 cannot tell apart


def models(scene: Scene) -> Iterator[Model]:
    """Models of a scene with more than one object, or with a mesh that is folded over itself."""
    if len(scene.objects) < 2 and not any(_folded(mesh) for mesh in scene.meshes):
        return
    yield Model(
        name="another_wins",
        kind="convention",
        claim="where surfaces coincide up to the rounding of their points, another one is seen than the scene's first",
        cites=_PAPER,
        options={"ties": "another"},
        when=("coincident", "another"),
    )
    for precision, resolution in FLOAT.items():
        yield _fight(f"ray_{precision}", {"resolution": resolution})
    near, far = scene.camera.near, scene.camera.far
    for depth, bits in BITS.items():
        # a step of a fixed-point depth buffer at the depth z is z^2 (1/n - 1/f) / 2^b
        step = max(STEPS * 2.0**-bits, ARITHMETIC) * (1.0 / near - 1.0 / far)
        yield _fight(f"depth_{depth}", {"resolution": FLOAT["float32"], "near_resolution": step})
    # with near at 1 the rounding shrinks with the depth, to 2^-24 of it
    yield _fight("depth_reversed32", {"resolution": 2 * FLOAT["float32"]})
    yield Model(
        name="colour_of_neither",
        kind="fault",
        rule="any",
        shows="wide",
        claim="where surfaces coincide the picture has the colour of none of them",
        cites=_PAPER,
        options={"ties": "blend", "resolution": FLOAT["float32"]},
    )
    yield Model(
        name="hole",
        kind="fault",
        rule="set",
        claim="where surfaces coincide neither is seen, but what is behind all surfaces",
        cites=_PAPER,
        options={"ties": "hole", "resolution": FLOAT["float32"]},
    )
    yield Model(
        name="loser_wins",
        kind="fault",
        rule="set",
        claim="a surface is seen though another lies in front of it, by far more than any renderer fails to resolve",
        cites=_PAPER,
        options={"ties": "another", "resolution": FAR_ABOVE},
    )


def _folded(mesh: Mesh) -> bool:
    """Whether a face is turned against the normals of its corners, so that it lies over or under others."""
    if mesh.normals is None:
        return False
    cut = triangulate(mesh)
    facet = np.cross(cut.points[:, 1] - cut.points[:, 0], cut.points[:, 2] - cut.points[:, 0])
    return bool((np.einsum("tkx,tx->tk", mesh.normals[cut.corner], facet) < 0).all(axis=1).any())


def _fight(resolves: str, resolution: dict[str, float]) -> Model:
    # a depth buffer alone casts no shadows: where a ball's back wins over its front it is not in the ball's shadow
    seen = {"shadows": "none"} if resolves.startswith("depth") else {}
    return Model(
        name="coincident_surfaces",
        kind="limitation",
        rule="set",
        claim="where surfaces coincide within the renderer's resolution, which one is seen changes by pixel",
        cites=_PAPER,
        options={"ties": "another", **resolution},
        others=({"ties": "unlit", **resolution}, {"ties": "next", **resolution, **seen}),
        when=("resolves", resolves),
        shows="crossing",
        sure={"ties": "another", "resolution": FLOAT["float64"]},
    )
