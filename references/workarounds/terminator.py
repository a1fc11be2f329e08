"""Workarounds of the terminator problem."""

from __future__ import annotations

from notabug.references.workarounds.workaround import Setting, Workaround

_PAPER = "Woo, Pearce and Ouellette 1996, the terminator problem"
_FACETS = ("facet_self_shadow",)

_SPHERE = "terminator/sphere"


def _lifted(by: float, scene: str = _SPHERE, tessellation: str = "16x8") -> Setting:
    """Shadow rays start ``by`` sagittas of the facet outside it."""
    label = f"offset {by:g} sagittas"
    return Setting(scene, {"tessellation": tessellation}, label, adapters={"inhouse": {"offset": by}})


WORKAROUNDS = (
    Workaround(
        name="snyder_barr_offset",
        artifact_class="terminator",
        claim="shadow rays start outside the facet, along its normal, where the smooth surface is meant to be",
        cites=f"{_PAPER}; Snyder and Barr 1987, section 5",
        reduces=_FACETS,
        before=Setting(_SPHERE, {"tessellation": "16x8"}),
        after=_lifted(1.0),
        caveat="too small it leaves steps, too large it moves shadows, and a concave surface is lit where it is dark",
        limits=(_lifted(0.1), _lifted(30.0), _lifted(1.0, "terminator/bowl", "24x12")),
    ),
    Workaround(
        name="finer_tessellation",
        artifact_class="terminator",
        claim="more facets lie closer to the smooth surface, so their shadows reach less far",
        cites=_PAPER,
        reduces=_FACETS,
        before=Setting(_SPHERE, {"tessellation": "16x8"}),
        after=Setting(_SPHERE, {"tessellation": "96x48"}),
        caveat="the area falls as one over the facets along an edge: half of it takes four times as many facets",
        limits=(Setting(_SPHERE, {"tessellation": "48x24"}),),
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
        limits=(Setting(_SPHERE, {"tessellation": "8x4"}),),
    ),
)
