"""Babylon.js in a browser: a z-buffer by way of WebGL, drawn by Babylon's own materials into a float32 texture.

Surfaces without a highlight are Babylon's PBRMaterial, set to Lambert's law. Shiny ones are its StandardMaterial, whose
highlight is Blinn's, neither cut off nor weighted by N.L. Its point lights do not fall with the distance
(docs/defects/babylon-point-falloff), so shiny surfaces are drawn under distant lights only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Apart, Declaration, Found, Quality, Render
from notabug.adapters.browser import DEPTH, GET_BROWSER, SUBPIXEL_BITS, InBrowser
from notabug.adapters.child_job import Edit
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.zbuffer import rasterised
from notabug.scenes_usd.scene import Scene

_NO_FALLOFF = "with a highlight, the light of Babylon's point light does not fall with the distance"


@dataclass(frozen=True, slots=True)
class Babylon:
    """Babylon.js: pixel centres by default, a regular grid for more samples; no shadows.

    Attributes
    ----------
    angle : what draws: Chromium's own SwiftShader, or the system's OpenGL by way of EGL. Mesa reads Babylon's textures
        in half floats, as Babylon's shaders allow.
    browser : the program; by default the first Chromium on PATH.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before Babylon reads it; a fault to be detected, for tests.
    """

    name: str = "babylon"
    angle: Literal["swiftshader", "gl-egl"] = "swiftshader"
    browser: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "phong", "blinn", "coloured_highlight"}
    )
    not_together: tuple[Apart, ...] = (
        Apart(frozenset({"phong", "point_light"}), _NO_FALLOFF),
        Apart(frozenset({"blinn", "point_light"}), _NO_FALLOFF),
    )
    install: str = f"notabug install babylon; {GET_BROWSER}"

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            rasterised(quality),
            depth=DEPTH[self.angle],
            coincident="unknown",
            lobe="blinn",
            highlight="uncut",
            gouraud_shadows="none",
            texture_filter="bilinear",
            subpixel_bits=SUBPIXEL_BITS[self.angle],
        )

    def find(self) -> Found:
        return self._route().find()

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        return self._route().render(scene, out, quality, 1.0)

    def _route(self) -> InBrowser:
        return InBrowser(
            self.name,
            recipe="babylon",
            package="babylonjs",
            library="babylon.js",
            script="babylon_child.mjs",
            browser=self.browser,
            angle=self.angle,
            keep_jobs=self.keep_jobs,
            edit=self.edit,
        )


register(Babylon())
