"""The in-house ray tracer as a renderer under test: the references' own code, without the references' forgiveness.

It draws what a plain Whitted ray tracer draws: facets shadow the smooth surface they stand for.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Declaration, Found, Quality, Render
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene

_TEXTURES = ("texture_border", "texture_decoding", "texture_bits", "uv_seam")
PLAIN = ("facet_self_shadow", "facet_self_reflection", "facet_self_refraction")


@dataclass(frozen=True, slots=True)
class InHouse:
    """The ray tracer of ``notabug.references.tracer``: pixel centres by default, box-filtered random samples for more.

    Attributes
    ----------
    limitations : models of the scene that are switched on: by default what a plain Whitted ray tracer cannot help.
    interpolation : over smooth meshes: normals (``phong``), colours (``gouraud``), or nothing (``flat``).
    faults : further models to be switched on: how the labelled benchmark makes its bugs.
    ties : of surfaces in one place the ``nearest`` by rounding is seen, or the ``first`` of the scene.
    start, epsilon, refine, offset : where rays start, as in ``Options``: each workaround of surface acne, and of the
        terminator problem, with its caveats.
    texture_border, texture_decoding, texture_bits, uv_seam : how textures are looked up, as it then declares: what
        graphics hardware, atlases and meshes with one texture coordinate a point do.
    light_grid : points along each side of a rectangular light to which shadow rays go; 0: it is integrated.
    shadow_bias, shadow_normal_bias : what shadow rays meet nearer than that is passed over, and how far along the
        normal they start.
    """

    name: str = "inhouse"
    precision: Literal["float32", "float64"] = "float64"
    limitations: tuple[str, ...] = PLAIN
    interpolation: Literal["phong", "gouraud", "flat"] = "phong"
    faults: tuple[str, ...] = ()
    ties: Literal["nearest", "first"] = "nearest"
    start: Literal["exact", "none", "absolute", "relative", "error_bound"] = "exact"
    epsilon: float = 0.0
    refine: bool = False
    offset: float = 0.0
    texture_border: Literal["wrapped", "clamped"] = "wrapped"
    texture_decoding: Literal["before", "after"] = "before"
    texture_bits: int = 0
    uv_seam: Literal["split", "first", "last"] = "split"
    light_grid: int = 0
    shadow_bias: float = 0.0
    shadow_normal_bias: float = 0.0
    install: str = "part of notabug"
    capabilities: frozenset[str] = frozenset(
        {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
        | {
            "cosine_weighted",
            "coloured_highlight",
            "mirror",
            "transmission",
            "shadows",
            "orthographic",
            "aperture_offset",
        }
        | {"ggx", "dielectric", "emission", "normal_map", "opacity_map", "cutout"}
        | {"sphere_light", "rect_light", "disk_light", "cylinder_light", "sun_light", "dome_light"}
        | {"dome_texture", "light_beam", "light_multipliers", "light_link"}
    )

    def declaration(self, quality: Quality) -> Declaration:
        point = quality.samples <= 1
        return Declaration(
            precision=self.precision,
            filter="point" if point else "box",
            radius=0.0 if point else 0.5,
            quantum=2.0**-24,
            relative_quantum=True,
            noisy=not point,
            samples=max(1, quality.samples),
            ngon_split="",
            silhouette="keep",
            behind_facet="lit",
            mapped_away="keep",
            bump_light="cut",
            tangents="triangle",
            normal_level="127.5",
            opacity_shadow="attenuate",
            glass_shadow="opaque",
            total_reflection="transmission",
            glass_side="facet",
            texture_filter="bilinear",
            opacity_filter="separate",
            texture_border=self.texture_border,
            texture_decoding=self.texture_decoding,
            texture_bits=self.texture_bits,
            uv_seam=self.uv_seam,
            masking="separable",
            interpolation=self.interpolation,
            gouraud_shadows="corners",
            bounces_count="reflections",
            crossings="each",
            coordinates=self.precision,
            sphere_roots="stable",
            light_grid=self.light_grid,
            light_grid_shadow="each",
            shadow_bias=self.shadow_bias or -1.0,
            shadow_normal_bias=self.shadow_normal_bias or -1.0,
        )

    def find(self) -> Found:
        from notabug import __version__

        return Found(version=__version__, where="this package")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        from notabug.references.models.model import models
        from notabug.references.predict import configured
        from notabug.references.tracer.emitters import DRAWN_DIRECTIONS
        from notabug.references.tracer.envelope import trace_picture

        check_supported(self, scene)
        drawn = replace(scene, intent=None)  # meshes are drawn as they are, whatever they stand for
        on = (*self.limitations, *self.faults, f"{self.interpolation}_interpolation")
        # of several models of a name, one a light or an axis say, the first
        declared = {(name, str(getattr(self, name))) for name in _TEXTURES}
        known = [
            each
            for each in models(scene)
            if (each.name in on and ("gouraud_meshes", "all") not in each.also)
            or (each.kind == "limitation" and each.when in declared)
        ]
        named = {each.name: each.as_drawn() for each in reversed(known)}
        chosen = list(named.values())
        configured_scene, options = configured(drawn, chosen)
        ties = options.ties if options.ties != "first" else self.ties
        switches = {"start": self.start, "epsilon": self.epsilon, "refine": self.refine, "offset": self.offset}
        if self.light_grid:
            switches["light_grid"] = self.light_grid
        if self.shadow_bias:
            switches["shadow_gap"] = self.shadow_bias
        if self.shadow_normal_bias:
            switches["shadow_lift"] = self.shadow_normal_bias
        for each in chosen:  # a fault's own switches win
            switches |= {key: value for key, value in each.options.items() if key in switches}
        options = replace(options, ties=ties, **switches)  # type: ignore[arg-type]
        samples = max(1, quality.samples)
        made = []
        for seed in quality.seeds if samples > 1 else quality.seeds[:1]:
            start = time.perf_counter()
            pixels = trace_picture(
                configured_scene,
                options,
                samples=samples,
                seed=seed,
                dtype=self.precision,
                threads=quality.threads,
                directions=DRAWN_DIRECTIONS if samples == 1 else 0,
            )
            image = out / f"inhouse-{seed}.exr"
            write_exr(image, pixels)
            made.append(Render(image, seed, samples, time.perf_counter() - start))
        return tuple(made)


register(InHouse())
