"""Workarounds of naive texture interpolation."""

from __future__ import annotations

from notabug.references.workarounds.workaround import Setting, Workaround

_PAPER = "Woo, Pearce and Ouellette 1996, naive texture interpolation"
_QUAD = "texture/uneven_quad"

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
