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


@dataclass(frozen=True, slots=True)
class InHouse:
    """The ray tracer of ``notabug.references.tracer``: pixel centres by default, box-filtered random samples for more.

    ``faults`` names models of the scene to be switched on: how the labelled benchmark makes its bugs.
    """

    name: str = "inhouse"
    precision: Literal["float32", "float64"] = "float64"
    faults: tuple[str, ...] = ()
    install: str = "part of notabug"
    capabilities: frozenset[str] = frozenset(
        {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
        | {"cosine_weighted", "coloured_highlight", "mirror", "transmission", "shadows"}
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
            ngon_split="",
            silhouette="keep",
            opacity_shadow="attenuate",
            glass_shadow="opaque",
            total_reflection="transmission",
            texture_filter="bilinear",
        )

    def find(self) -> Found:
        from notabug import __version__

        return Found(version=__version__, where="this package")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        from notabug.references.models.model import models
        from notabug.references.predict import configured
        from notabug.references.tracer.envelope import trace_picture

        check_supported(self, scene)
        drawn = replace(scene, intent=None)  # meshes are drawn as they are, whatever they stand for
        wanted = ("facet_self_shadow", *self.faults)
        # of several models of a name, one a light or an axis say, the first
        chosen = {each.name: each for each in reversed(list(models(scene))) if each.name in wanted}.values()
        configured_scene, options = configured(drawn, chosen)
        samples = max(1, quality.samples)
        made = []
        for seed in quality.seeds if samples > 1 else quality.seeds[:1]:
            start = time.perf_counter()
            pixels = trace_picture(
                configured_scene,
                replace(options, ties="nearest"),
                samples=samples,
                seed=seed,
                dtype=self.precision,
                threads=quality.threads,
            )
            image = out / f"inhouse-{seed}.exr"
            write_exr(image, pixels)
            made.append(Render(image, seed, samples, time.perf_counter() - start))
        return tuple(made)


register(InHouse())
