"""three.js in a browser: a z-buffer by way of WebGL, drawn by three's own shaders into a float32 texture.

Its highlights are Blinn's, multiplied by (n + 2)/8 and by N.L. Without a graphics card Chromium's SwiftShader draws.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Declaration, Found, Quality, Render
from notabug.adapters.browser import DEPTH, GET_BROWSER, NONE, SUBPIXEL_BITS, InBrowser
from notabug.adapters.child_job import Edit
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.shadow_maps import asked_for
from notabug.adapters.zbuffer import rasterised
from notabug.scenes_usd.scene import Scene

_CAPABILITIES = frozenset(
    {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "phong", "blinn", "cosine_weighted"}
)
UNIT = 1024.0  # a power of two, by which float32 numbers are multiplied without rounding


@dataclass(frozen=True, slots=True)
class ThreeJs:
    """three.js: pixel centres by default, a regular grid for more samples; no shadows, unless by ``shadow_maps``.

    Attributes
    ----------
    unit : by what the scene is drawn larger. At 1 light does not grow within a tenth of a unit of a point light.
    angle : what draws: Chromium's own SwiftShader, or the system's OpenGL by way of EGL.
    shadow_maps : distant lights have shadow maps as they ask for them, of which the nearest texel counts
        (``BasicShadowMap``); scenes whose lights do not ask are unsupported.
    browser : the program; by default the first Chromium on PATH.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before three.js reads it; a fault to be detected, for tests.
    """

    name: str = "threejs"
    unit: float = UNIT
    angle: Literal["swiftshader", "gl-egl"] = "swiftshader"
    shadow_maps: bool = False
    browser: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    install: str = f"notabug install threejs; {GET_BROWSER}"

    @property
    def capabilities(self) -> frozenset[str]:
        return (_CAPABILITIES - {"point_light"}) | {"shadows"} if self.shadow_maps else _CAPABILITIES

    def declaration(self, quality: Quality) -> Declaration:
        drawn = replace(
            rasterised(quality),
            depth=DEPTH[self.angle],
            coincident="unknown",
            lobe="blinn",
            normalised="n2over8",
            highlight="cosine",
            gouraud_shadows="none",
            texture_filter="bilinear",
            subpixel_bits=SUBPIXEL_BITS[self.angle],
        )
        if not self.shadow_maps:
            return drawn
        return replace(drawn, shadows="cast", shadow_algorithm="map")

    def find(self) -> Found:
        return self._route().find()

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        asked = asked_for(self.name, scene) if self.shadow_maps else NONE
        return self._route().render(scene, out, quality, self.unit, asked)

    def _route(self) -> InBrowser:
        return InBrowser(
            self.name,
            recipe="threejs",
            package="three",
            library="build/three.module.js",
            script="threejs_child.mjs",
            browser=self.browser,
            angle=self.angle,
            keep_jobs=self.keep_jobs,
            edit=self.edit,
        )


register(ThreeJs())
