"""Workarounds of normal maps: what a renderer, and whoever makes the map, can do where a mapped normal faces away."""

from __future__ import annotations

from collections.abc import Mapping

from notabug.references.workarounds.workaround import Setting, Workaround

_BUMPS = "normal_maps/bumps"
_SCHUESSLER = "Schuessler et al. 2017, Microfacet-based normal mapping for robust Monte Carlo path tracing"
_MITSUBA = {"mitsuba": {"normal_maps": "unflipped"}}


def _painted(slope: str) -> Setting:
    """Surfaces are black where their mapped normals face away."""
    return _drawn(slope, "black where normals face away", ("mapped_normal_black",), {"mapped_away": "black"}, _MITSUBA)


def _drawn(
    slope: str,
    label: str,
    models: tuple[str, ...],
    declares: Mapping[str, object],
    others: Mapping[str, Mapping[str, object]],
) -> Setting:
    """In-house with ``models`` switched on, and the ``others`` that can be told the same."""
    adapters = {"inhouse": {"limitations": models}, **others}
    return Setting(_BUMPS, {"slope": slope}, label, declares=declares, adapters=adapters)


WORKAROUNDS = (
    Workaround(
        name="raised_normals",
        artifact_class="normal_maps",
        claim="highlights have the mapped normal raised until it mirrors the view above the surface, and none is black",
        cites="Keller et al. 2017, The Iray light transport simulation and rendering system; Cycles: bump map "
        "correction; Mitsuba turns such normals instead: flip_invalid_normals",
        reduces=("mapped_normal_black",),
        before=_painted("steep"),
        after=_drawn("steep", "raised", ("mapped_normal_raised",), {"mapped_away": "raised"}, {}),
        caveat="it mends the view alone: light from behind the surface still reaches bumps where it is not cut off",
        limits=(
            _drawn(
                "steep",
                "raised, light not cut off",
                ("mapped_normal_raised", "bump_light_leak"),
                {"mapped_away": "raised", "bump_light": "lit"},
                {},
            ),
        ),
    ),
    Workaround(
        name="flatter_map",
        artifact_class="normal_maps",
        claim="the map's normals lean less than the view does from the surface, so that none faces away",
        cites=f"{_SCHUESSLER}, section 2; UsdUVTexture: scale and bias",
        reduces=("mapped_normal_black",),
        before=_painted("steep"),
        after=_painted("gentle"),
        caveat="bumps lose their contrast, and a view that is lower than they are steep has black ones again",
        limits=(_painted("medium"),),
    ),
)
