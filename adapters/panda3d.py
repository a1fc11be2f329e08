"""Panda3D: a game engine whose fixed-function OpenGL lights vertices, always in a child process.

It is the one renderer here that interpolates colours (Gouraud 1971), over flat meshes as over smooth ones, and over
the two triangles of each quad. Its highlights are Blinn's, cut off where N.L < 0 at a vertex. Without a graphics card
Mesa's llvmpipe draws, in float32.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Declaration, Found, Quality, Render, UnsupportedError
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import environment_python, version_in
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.zbuffer import grid, rasterised
from notabug.scenes_usd.scene import Scene

MOST_EXPONENT = 128.0  # OpenGL 1.1 specification, table 2.7: of GL_SHININESS


@dataclass(frozen=True, slots=True)
class Panda3D:
    """Panda3D on OpenGL without shaders: pixel centres by default, a regular grid for more samples; no shadows.

    Attributes
    ----------
    highlights : what V is in Blinn's lobe: the direction to the eye (``local``), or the view axis everywhere
        (``infinite``), as OpenGL has it unless it is told otherwise.
    python : the interpreter that has panda3d; by default that of ``notabug install panda3d``, else this one.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before Panda3D reads it; a fault to be detected, for tests.
    """

    name: str = "panda3d"
    highlights: Literal["local", "infinite"] = "local"
    python: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "phong", "blinn", "coloured_highlight"}
    )
    install: str = (
        "notabug install panda3d, or pip install notabug[panda3d]; apt install libegl1 libgl1 libgl1-mesa-dri"
    )

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            rasterised(quality),
            depth="fixed24",
            coincident="unknown",
            lobe="blinn",
            interpolation="gouraud",
            gouraud_meshes="all",
            texture_filter="bilinear",
        )

    def find(self) -> Found:
        python = self._python()
        return Found(version_in(python, "panda3d", where=self.name, install=self.install), python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        self._check_exponents(scene)
        self.find()
        threads = {"LP_NUM_THREADS": str(quality.threads)} if quality.threads else {}
        script = Script(self.name, self._python(), "panda3d_child.py", threads, self.keep_jobs, self.edit, served=True)
        settings = {"grid": grid(quality), "local_viewer": self.highlights == "local"}
        return script.render(scene, out, quality, settings, "Panda3D", samples=grid(quality) ** 2)

    def _check_exponents(self, scene: Scene) -> None:
        materials = [scene.materials[shape.material] for shape in scene.objects]
        most = max((material.exponent for material in materials if any(material.specular)), default=0.0)
        if most > MOST_EXPONENT:
            raise UnsupportedError(
                "an exponent that fixed-function OpenGL does not have",
                where=f"adapter {self.name!r}",
                expected=f"at most {MOST_EXPONENT:g}",
                got=f"{most:g}",
                do="choose another renderer for this scene",
            )

    def _python(self) -> str:
        return self.python or environment_python("panda3d")


register(Panda3D())
