"""Workarounds of the terminator problem."""

from __future__ import annotations

from notabug.references.workarounds.workaround import Setting, Workaround

_PAPER = "Woo, Pearce and Ouellette 1996, the terminator problem"
_FACETS = ("facet_self_shadow",)

WORKAROUNDS = (
    Workaround(
        name="finer_tessellation",
        artifact_class="terminator",
        claim="more facets lie closer to the smooth surface, so their shadows reach less far",
        cites=_PAPER,
        reduces=_FACETS,
        before=Setting("terminator/sphere", {"tessellation": "16x8"}),
        after=Setting("terminator/sphere", {"tessellation": "96x48"}),
        caveat="the area falls as one over the facets along an edge: half of it takes four times as many facets",
        limits=(Setting("terminator/sphere", {"tessellation": "48x24"}),),
    ),
    Workaround(
        name="evenly_spaced_facets",
        artifact_class="terminator",
        claim="as many facets, none of them wide where light and shade meet",
        cites=_PAPER,
        reduces=_FACETS,
        before=Setting("terminator/spacing", {"spacing": "uneven"}),
        after=Setting("terminator/spacing", {"spacing": "even"}),
        caveat="even facets that are too wide are no better than crowded ones",
        limits=(Setting("terminator/sphere", {"tessellation": "8x4"}),),
    ),
)
