"""The contract's material as a Mitsuba BSDF: Lambert, a Phong or Blinn lobe, mirror, transmission and opacity.

Mitsuba has no Phong or Blinn lobe, its glass has Fresnel's factors and eta^2, and an integrator that follows a mirror
follows diffuse bounces too. So this BSDF evaluates what lights send, and *samples* only what Whitted's recursion
follows: mirror, refracted and straight rays. Under ``path`` or ``volpath`` that makes his picture.

Where a material has one of those rays every sample takes it and the pixel's centre has no noise; where it has several,
each sample takes one at random, in proportion to its brightness.

Measured with 3.9.1, ``llvm_ad_rgb`` and ``scalar_rgb`` alike, against float64: highlights to 4e-6 of white up to an
exponent of 1e5; what is seen in mirrors and glass to what ``mitsuba_job.py`` says.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from notabug.adapters.job_types import MitsubaLook, PlugIn


def whitted(
    mi: Any, look: MitsubaLook, texture: PlugIn | None, maps: dict[str, PlugIn | None], *, one_sided: bool = False
) -> Any:
    """A BSDF of the loaded variant of Mitsuba (the module ``mi``) for the material ``look`` of a job.

    ``texture`` describes the bitmap that replaces the diffuse colour, or is None; ``maps`` has those of numbers, the
    opacity and the preview surface's own, by name. ``one_sided``: it is black from behind, as what ``twosided`` may
    hold.
    """
    import drjit as dr

    smooth = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection
    sides = mi.BSDFFlags.FrontSide if one_sided else mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
    bitmap = None if texture is None else mi.load_dict(texture)
    numbers = {name: mi.load_dict(each) for name, each in maps.items() if each is not None}
    cut = numbers.pop("opacity", None)
    # with a map every sample goes on straight, and brings as much as the map lets through where it met the surface
    chances = _chances(look["mirror"], look["transmission"], 1.0 - float(look["opacity"]) if cut is None else 1.0)

    opacity = partial(_opacity, dr, mi, look, cut)

    class Whitted(mi.BSDF):  # type: ignore[misc]  # the variant is known only when it is loaded
        def __init__(self) -> None:
            mi.BSDF.__init__(self, mi.Properties())
            self.m_components = [smooth | sides]
            for chance, kind in zip(
                chances, (mi.BSDFFlags.DeltaReflection, mi.BSDFFlags.DeltaTransmission, mi.BSDFFlags.Null), strict=True
            ):
                if chance:
                    self.m_components.append(kind | sides)
            if chances[1] and not chances[0]:  # total internal reflection
                self.m_components.append(mi.BSDFFlags.DeltaReflection | sides)
            self.m_flags = 0
            for each in self.m_components:
                self.m_flags |= each

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if one_sided:
                active &= mi.Frame3f.cos_theta(si.wi) > 0
            return _evaluated(dr, mi, look, bitmap, numbers, si, wo, active) * opacity(si, active)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
            ray, weight = _sampled(dr, mi, look, chances, si, sample1, 1.0 - opacity(si, active))
            return ray, dr.select(active, weight, 0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            return self.eval(ctx, si, wo, active), mi.Float(0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(1.0 - opacity(si, active))

        def to_string(self) -> str:
            return "Whitted[]"

    return Whitted()


def _opacity(dr: Any, mi: Any, look: MitsubaLook, cut: Any, si: Any, active: Any) -> Any:
    """How much of the surface is there: by the map ``cut``, whole or not at all where there is a threshold."""
    if cut is None:
        return mi.Float(look["opacity"])
    said, least = cut.eval_1(si, active), look.get("least_opacity", 0.0)
    return dr.select(said >= least, mi.Float(1.0), mi.Float(0.0)) if least else mi.Float(said)


def _evaluated(
    dr: Any,
    mi: Any,
    look: MitsubaLook,
    bitmap: Any | None,
    numbers: Mapping[str, Any],
    si: Any,
    wo: Any,
    active: Any,
) -> Any:
    """The light that goes from ``wo`` to the viewer, N.L included; the normal is turned to the viewer."""
    nv = mi.Frame3f.cos_theta(si.wi)
    side = dr.select(nv >= 0, 1.0, -1.0)
    nl = side * mi.Frame3f.cos_theta(wo)
    lit = (nl > 0) & active
    colour = mi.Color3f(look["diffuse"]) if bitmap is None else mi.Color3f(bitmap.eval_3(si, active))
    value = colour * nl
    if look["preview"]:
        said = {**look["preview"], **{name: map_.eval_1(si, active) for name, map_ in numbers.items()}}
        value = _preview(dr, mi, said, colour, mi.Vector3f(si.wi.x, si.wi.y, side * si.wi.z), wo, nl)
    elif any(look["specular"]):
        shine = _lobe(dr, mi, look, si.wi, wo)
        value += mi.Color3f(look["specular"]) * (shine * nl if look["cosine_weighted"] else shine)
    return dr.select(lit, value * (1.0 / math.pi), 0.0)


def _sampled(
    dr: Any,
    mi: Any,
    look: MitsubaLook,
    chances: tuple[float, float, float],
    si: Any,
    sample1: Any,
    rest: Any,
) -> tuple[Any, Any]:
    """One of the rays that go on, chosen by ``sample1`` with ``chances``, and its weight; ``rest`` passes straight."""
    mirror, transmission = mi.Color3f(look["mirror"]), mi.Color3f(look["transmission"])
    bs = dr.zeros(mi.BSDFSample3f)
    reflects, passes = sample1 < chances[0], sample1 >= 1.0 - chances[2]
    bs.wo = mi.Vector3f(-si.wi.x, -si.wi.y, si.wi.z)
    bs.pdf, bs.eta = 1.0, 1.0
    bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DeltaReflection)
    weight = mi.Color3f(0.0)
    if chances[0]:
        weight = dr.select(reflects, mirror / chances[0], weight)
    if chances[1]:
        refracts = (sample1 >= chances[0]) & (sample1 < 1.0 - chances[2])
        leaving = dr.dot(si.n, si.to_world(si.wi)) < 0
        eta = dr.select(leaving, look["ior"], 1.0 / look["ior"])
        nv = mi.Frame3f.cos_theta(si.wi)
        square = 1.0 - eta * eta * (1.0 - nv * nv)
        refracted = mi.Vector3f(
            -eta * si.wi.x, -eta * si.wi.y, dr.select(nv >= 0, -1.0, 1.0) * dr.sqrt(dr.maximum(square, 0.0))
        )
        through = refracts & (square >= 0)  # where not, total internal reflection
        bs.wo = dr.select(through, dr.normalize(refracted), bs.wo)
        bs.sampled_type = dr.select(through, mi.UInt32(+mi.BSDFFlags.DeltaTransmission), bs.sampled_type)
        weight = dr.select(refracts, transmission / chances[1], weight)
    if chances[2]:
        bs.wo = dr.select(passes, -si.wi, bs.wo)
        bs.sampled_type = dr.select(passes, mi.UInt32(+mi.BSDFFlags.Null), bs.sampled_type)
        weight = dr.select(passes, mi.Color3f(rest / chances[2]), weight)
    return bs, weight


def emitting(mi: Any, emission: list[float], texture: dict[str, Any] | None) -> Any:
    """A BSDF that reflects nothing and whose albedo, which an integrator can show, is what the surface emits.

    Mitsuba's own emitters are lights, shine from one side of a surface only, and are chosen at random.
    """
    import drjit as dr

    bitmap = None if texture is None else mi.load_dict(texture)

    class Emitting(mi.BSDF):  # type: ignore[misc]  # the variant is known only when it is loaded
        def __init__(self) -> None:
            mi.BSDF.__init__(self, mi.Properties())
            self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide]
            self.m_flags = self.m_components[0]

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            return dr.zeros(mi.BSDFSample3f), mi.Color3f(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0), mi.Float(0.0)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(emission) if bitmap is None else mi.Color3f(bitmap.eval_3(si, active))

        def to_string(self) -> str:
            return "Emitting[]"

    return Emitting()


def _chances(mirror: list[float], transmission: list[float], rest: float) -> tuple[float, float, float]:
    """How often a sample takes the mirror, the refracted and the straight ray: in proportion to their brightness.

    >>> _chances([0.5, 0.5, 0.5], [0.0, 0.0, 0.0], 0.0), _chances([0.0, 0.3, 0.6], [0.3, 0.3, 0.3], 0.4)
    ((1.0, 0.0, 0.0), (0.3, 0.3, 0.4))
    """
    weights = (sum(mirror) / 3.0, sum(transmission) / 3.0, rest)
    total = sum(weights)
    if not total:
        return 0.0, 0.0, 0.0
    return weights[0] / total, weights[1] / total, weights[2] / total


def _preview(
    dr: Any,
    mi: Any,
    said: Mapping[str, Any],
    colour: Any,
    V: Any,
    L: Any,
    nl: Any,
) -> Any:
    """UsdPreviewSurface's light of irradiance pi: see ``Preview`` of scenes_usd/scene.py; D and G are Mitsuba's own.

    ``V`` lies above the surface, ``nl`` is the cosine of ``L`` to the side that it is on.
    """
    L = mi.Vector3f(L.x, L.y, nl)
    H = dr.normalize(V + L)
    schlick = dr.power(dr.clip(1.0 - dr.dot(V, H), 0.0, 1.0), 5)
    normal = ((1.0 - said["ior"]) / (1.0 + said["ior"])) ** 2
    low, high, share = mi.Color3f(said["specular"]), mi.Color3f(1.0), 1.0
    if not said["specular_workflow"]:
        metallic = said["metallic"]
        high = dr.lerp(mi.Color3f(1.0), colour, metallic)
        low = dr.lerp(mi.Float(normal), mi.Float(1.0), metallic) * high
        share = 1.0 - metallic

    def lobe(roughness: Any) -> Any:
        surface = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, roughness * roughness)
        shown = surface.eval(H) * surface.G(V, L, H) / (4.0 * V.z) * math.pi
        return dr.select(V.z > 0, shown, 0.0)

    fresnel = low + (high - low) * schlick
    value = colour * (1.0 - fresnel) * (share * nl) + fresnel * lobe(said["roughness"])
    if said["clearcoat"]:
        value += said["clearcoat"] * (normal + (1.0 - normal) * schlick) * lobe(said["clearcoat_roughness"])
    return value


def _lobe(dr: Any, mi: Any, look: MitsubaLook, V: Any, L: Any) -> Any:
    """max(R.V, 0)^n or max(N.H, 0)^n for directions in the shading frame.

    The cosine c enters as 1 - c^2 or 1 - c, computed from the difference of vectors: with c itself, in float32, an
    exponent of 1e5 would be off by 0.6 %. log(1 - q) is -2 artanh(q / (2 - q)).
    """
    if look["lobe"] == "phong":
        difference = mi.Vector3f(L.x + V.x, L.y + V.y, L.z - V.z)  # L - R, R = (-Vx, -Vy, Vz)
        q = 0.5 * dr.squared_norm(difference)  # 1 - R.L
        exponent = float(look["exponent"])
    else:
        H = L + V
        q = (H.x * H.x + H.y * H.y) / dr.squared_norm(H)  # 1 - (N.H)^2
        exponent = 0.5 * float(look["exponent"])
    q = dr.clip(q, 0.0, 1.0)
    return dr.select(q < 1.0, dr.exp(-2.0 * exponent * dr.atanh(q / (2.0 - q))), 0.0)
