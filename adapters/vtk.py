"""VTK: the z-buffer of scientific visualisation, through its Python package, always in a child process.

VTK's own shaders are judged, in float32 and without a window. Without a graphics card Mesa's llvmpipe draws. Highlights
are Phong's R.V, neither normalised nor weighted. N-gons go in as they are, and VTK makes a fan from the first corner.
VTK 9 has no Gouraud: ``SetInterpolationToGouraud`` draws as Phong does. Transparency is left out: VTK sorts it by depth
peeling into textures of 8 bits, so that an opacity of .25 comes back as 64/255.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Declaration, Found, Quality, Render
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import environment_python, version_in
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.textures import same_wraps
from notabug.adapters.zbuffer import grid, rasterised
from notabug.scenes_usd.scene import Scene


@dataclass(frozen=True, slots=True)
class Vtk:
    """VTK on OpenGL: pixel centres by default, a regular grid for more samples; no shadows.

    Attributes
    ----------
    depth : format of the depth buffer.
    interpolation : over smooth meshes: normals, or nothing.
    python : the interpreter that has vtk; by default that of ``notabug install vtk``, else this one.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before VTK reads it; a fault to be detected, for tests.
    """

    name: str = "vtk"
    depth: Literal["fixed16", "fixed24", "float32"] = "fixed24"
    interpolation: Literal["phong", "flat"] = "phong"
    python: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "phong", "coloured_highlight"}
    )
    install: str = "notabug install vtk, or pip install notabug[vtk]; apt install libegl1 libgl1 libgl1-mesa-dri"

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            rasterised(quality),
            ngon_split="fan",
            depth=self.depth,
            coincident="unknown",
            interpolation=self.interpolation,
            gouraud_shadows="none",
            texture_filter="bilinear",
            coordinates="unknown",  # VTK moves float64 points far off to the origin before it makes them float32
        )

    def find(self) -> Found:
        python = self._python()
        return Found(version_in(python, "vtk", where=self.name, install=self.install), python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        self.find()
        threads = {"LP_NUM_THREADS": str(quality.threads)} if quality.threads else {}
        script = Script(self.name, self._python(), "vtk_child.py", threads, self.keep_jobs, self.edit, served=True)
        settings = {"grid": grid(quality), "depth": self.depth, "interpolation": self.interpolation}
        return script.render(same_wraps(scene), out, quality, settings, "VTK", samples=grid(quality) ** 2)

    def _python(self) -> str:
        return self.python or environment_python("vtk")


register(Vtk())
