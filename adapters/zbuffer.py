"""The in-house z-buffer rasteriser as a renderer under test.

It draws what depth buffers draw: n-gons cut into triangles, depths of few bits, and shadows only from a shadow map.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Declaration, Found, Quality, Render
from notabug.adapters.job_folder import picture_path
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.shadow_maps import asked_for
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene, ShadowMap

CAPABILITIES = frozenset(
    {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
    | {"cosine_weighted", "coloured_highlight", "aperture_offset"}
)


@dataclass(frozen=True, slots=True)
class ZBuffer:
    """The rasteriser of ``notabug.references.raster``: pixel centres by default, a regular grid for more samples.

    Attributes
    ----------
    precision : float32, as all hardware has it. In float64 coplanar surfaces do not fight: depths are stored with fewer
        bits than they are computed with, so the errors round away.
    depth, normals, affine, shadow_map, shadow_bias, shadow_normal_bias : as in ``RasterOptions``. With a shadow map
        scenes with shadows are drawn too; without one they are unsupported.
    as_lit : shadow maps are as the scene's lights say, and scenes whose lights do not say it are unsupported.
    """

    name: str = "zbuffer"
    precision: Literal["float32", "float64"] = "float32"
    depth: Literal["fixed16", "fixed24", "float32", "reversed32"] = "fixed24"
    normals: Literal["phong", "gouraud", "flat"] = "phong"
    affine: bool = False
    shadow_map: int = 0
    shadow_bias: float = 0.0
    shadow_normal_bias: float = 0.0
    as_lit: bool = False
    install: str = "part of notabug"

    @property
    def capabilities(self) -> frozenset[str]:
        drawn = CAPABILITIES | {"orthographic"}
        return drawn | {"shadows"} if self._mapped else drawn

    @property
    def _mapped(self) -> bool:
        return bool(self.shadow_map) or self.as_lit

    def declaration(self, quality: Quality) -> Declaration:
        drawn = replace(
            rasterised(quality),
            precision=self.precision,
            depth=self.depth,
            interpolation=self.normals,
            gouraud_shadows="unknown" if self._mapped else "corners",  # with the light; there are none
            coordinates=self.precision,
        )
        if not self._mapped:
            return drawn
        drawn = replace(drawn, shadows="cast", shadow_algorithm="map", opacity_shadow="opaque")
        if self.as_lit:
            return drawn
        return replace(
            drawn,
            shadow_resolution=self.shadow_map,
            shadow_bias=self.shadow_bias,
            shadow_normal_bias=self.shadow_normal_bias,
        )

    def find(self) -> Found:
        from notabug import __version__

        return Found(version=__version__, where="this package")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        from notabug.references.raster.picture import RasterOptions, raster_picture

        check_supported(self, scene)
        shadows = self._shadows(scene)
        options = RasterOptions(
            depth=self.depth,
            normals=self.normals,
            affine=self.affine,
            shadow_map=shadows.resolution,
            shadow_bias=shadows.bias,
            shadow_normal_bias=shadows.normal_bias,
        )
        samples = grid(quality) ** 2
        start = time.perf_counter()
        pixels = raster_picture(scene, options, samples=samples, dtype=self.precision, threads=quality.threads)
        seed = quality.seeds[0] if quality.seeds else 0
        image = picture_path(out, self.name, seed)
        write_exr(image, pixels)
        return (Render(image, seed, samples, time.perf_counter() - start),)

    def _shadows(self, scene: Scene) -> ShadowMap:
        """How the maps of ``scene`` are made; a resolution of 0: there are none."""
        if not self.as_lit:
            return ShadowMap(self.shadow_map, self.shadow_bias, self.shadow_normal_bias)
        return asked_for(self.name, scene)


def grid(quality: Quality) -> int:
    """Samples along a pixel's edge: the smallest square grid that holds ``quality.samples``, one sample by default."""
    return max(1, math.isqrt(max(1, quality.samples) - 1) + 1)


def rasterised(quality: Quality) -> Declaration:
    """What renderers declare that draw triangles in float32, at one point or a grid of points of each pixel.

    Depth, the lobe, what is interpolated and which of coincident surfaces is seen are left to each.
    """
    point = grid(quality) == 1
    return Declaration(
        hit_error=0.0,
        precision="float32",
        filter="point" if point else "box",
        radius=0.0 if point else 0.5,
        quantum=2.0**-24,
        relative_quantum=True,
        noisy=False,
        samples=grid(quality) ** 2,
        ngon_split="02",
        silhouette="keep",
        behind_facet="lit",
        gouraud_shadows="corners",  # with the light; there are none
        coordinates="float32",
        shadows="none",
    )


register(ZBuffer())
register(ZBuffer(name="shadowmap", as_lit=True))
