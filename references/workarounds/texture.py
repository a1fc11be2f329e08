"""Workarounds of naive texture interpolation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CloughTocher2DInterpolator

from notabug.references.models.model import edit_meshes
from notabug.references.workarounds.workaround import Setting, Workaround
from notabug.scenes_usd.scene import Floats, Mesh, Scene
from notabug.scenes_usd.triangulate import triangulate

_PAPER = "Woo, Pearce and Ouellette 1996, naive texture interpolation"
_QUAD = "texture/uneven_quad"

_PARTS = 12  # along each edge of a triangle: so fine that what is left of linear interpolation is not seen


def smooth_uv(mesh: Mesh) -> Mesh:
    """``mesh``, a planar one, in small triangles whose uv a C1 piecewise cubic through its points' uv gives.

    Clough and Tocher's element on Delaunay triangles, as SciPy has it (Alfeld 1984 for the scheme).
    """
    if mesh.uv is None:
        return mesh
    origin = mesh.points.mean(axis=0)
    plane = np.linalg.svd(mesh.points - origin, full_matrices=False)[2][:2].T
    _, first = np.unique(mesh.corners, return_index=True)
    known = CloughTocher2DInterpolator((mesh.points[mesh.corners[first]] - origin) @ plane, mesh.uv[first])
    points = _divided(triangulate(mesh).points)
    flat = ((points - origin) @ plane - _centre(known)) * (1 - 1e-12) + _centre(known)  # the outline is inside too
    return replace(
        mesh,
        points=np.ascontiguousarray(points),
        counts=np.full(len(points) // 3, 3, np.int32),
        corners=np.arange(len(points), dtype=np.int32),
        uv=np.ascontiguousarray(known(flat)),
        normals=None,
    )


def _centre(known: CloughTocher2DInterpolator) -> Floats:
    centre: Floats = known.tri.points.mean(axis=0)
    return centre


def _divided(triangles: Floats) -> Floats:
    """Each of ``triangles`` (n, 3, 3) in _PARTS^2 alike ones: their corners (n _PARTS^2 3, 3)."""
    weights, n = [], _PARTS
    for i in range(n):
        for j in range(n - i):
            corners = [(i, j), (i + 1, j), (i, j + 1)]
            weights += corners if i + j == n - 1 else [*corners, (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    a, b = np.array(weights).T / n
    found: Floats = np.einsum("kc,ncx->nkx", np.stack([1 - a - b, a, b], axis=1), triangles).reshape(-1, 3)
    return found


def _smooth(scene: Scene) -> Scene:
    return replace(edit_meshes(scene, smooth_uv), intent=scene.intent)


WORKAROUNDS = (
    Workaround(
        name="subdivision",
        artifact_class="texture",
        claim="the quadrilateral is cut into 15 x 15 cells with the uv of its bilinear patch before it is triangles",
        cites=f"{_PAPER}, figure 11",
        reduces=("quad_split_02", "coarse_uv"),
        before=Setting(_QUAD, {"split": "split02"}),
        after=Setting(_QUAD, {"split": "grid15"}),
        caveat="the error falls with the square of the cell: a few cells keep much of it",
        limits=(Setting(_QUAD, {"split": "grid2"}),),
    ),
    Workaround(
        name="c1_interpolation",
        artifact_class="texture",
        claim="uv follow a piecewise cubic that is smooth across the edges of the triangles",
        cites=f"{_PAPER}; Clough and Tocher 1965; Alfeld 1984",
        reduces=("coarse_uv",),
        before=Setting(_QUAD, {"split": "grid4"}),
        after=Setting(_QUAD, {"split": "grid4"}, "C1 uv", _smooth),
        caveat="a curve is no better than the points that it goes through: of two triangles little can be known",
        limits=(Setting(_QUAD, {"split": "split02"}, "C1 uv", _smooth),),
    ),
    Workaround(
        name="evenly_sized_cells",
        artifact_class="texture",
        claim="as many cells, none of them much larger than the others",
        cites=_PAPER,
        reduces=("coarse_uv",),
        before=Setting(_QUAD, {"split": "uneven8"}),
        after=Setting(_QUAD, {"split": "grid8"}),
        caveat="even cells that are too large are no better than uneven ones",
        limits=(Setting(_QUAD, {"split": "grid4"}),),
    ),
    Workaround(
        name="uv_aware_simplification",
        artifact_class="texture",
        claim="a mesh is simplified where its uv are linear too, not only where its surface is flat",
        cites=f"{_PAPER}; Garland and Heckbert 1998",
        reduces=("coarse_uv",),
        before=Setting("texture/simplified", {"simplified": "without_uv"}),
        after=Setting("texture/simplified", {"simplified": "with_uv"}),
        caveat="what is simplified still differs from the whole mesh",
    ),
)
