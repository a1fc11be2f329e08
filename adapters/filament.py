"""Filament, Google's renderer for Android and the web, through the Python package filly, in a child that stays.

Filament's own shaders are judged, with neither tone mapping nor antialiasing. A picture is a half float to Filament
and has 8 bits when it comes back: the child finds the half float out, by many exposures. Without a graphics card Mesa's
llvmpipe draws.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from notabug.adapters.base import Declaration, Found, Quality, Render
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import environment_python, probed, version_in
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.textures import same_wraps
from notabug.adapters.zbuffer import grid, rasterised
from notabug.scenes_usd.scene import Scene

FARTHEST = 64.0  # of what lamps light, from the eye: Filament dims that beyond 89, and leaves it black beyond 100
HALF = 2.0**-10  # of a value: a step of a half float, which llvmpipe cuts off and does not round
_DRIVER = "apt install libegl1 libgl1 libgl1-mesa-dri"
_SCRIPT = "filament_child.py"


@dataclass(frozen=True, slots=True)
class Filament:
    """Filament: pixel centres by default, a regular grid for more samples; matt surfaces, and no shadows.

    Attributes
    ----------
    unit : by what the scene is drawn larger, a power of two; 0: as large as Filament's lamps light. They light nothing
        that is farther from the eye than 100, and within .01 of one light does not grow.
    python : the interpreter that has filly; by default that of ``notabug install filament``, else this one.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before Filament reads it; a fault to be detected, for tests.
    """

    name: str = "filament"
    unit: float = 0.0
    python: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset({"mesh", "normals", "uv", "texture", "point_light", "distant_light"})
    install: str = f"notabug install filament; {_DRIVER}"

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            rasterised(quality),
            quantum=HALF,
            depth="fixed24",
            coincident="unknown",
            gouraud_shadows="none",
            texture_filter="bilinear",
        )

    def find(self) -> Found:
        python = self._python()
        version = version_in(python, "filly", where=self.name, install="notabug install filament")
        device = probed(python, _SCRIPT, where=self.name, what="no OpenGL 4.1 without a window", driver=_DRIVER)
        return Found(f"filly {version} ({device})", python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        self.find()
        threads = {"LP_NUM_THREADS": str(quality.threads)} if quality.threads else {}
        script = Script(self.name, self._python(), _SCRIPT, threads, self.keep_jobs, self.edit, stays=("--serve",))
        settings = {"grid": grid(quality), "unit": self.unit or _unit(scene)}
        return script.render(same_wraps(scene), out, quality, settings, "Filament", samples=grid(quality) ** 2)

    def _python(self) -> str:
        return self.python or environment_python("filament")


def _unit(scene: Scene) -> float:
    """The largest power of two that keeps all of ``scene`` within ``FARTHEST`` of the eye; 1 without lamps."""
    if all(light.kind != "point" for light in scene.lights):
        return 1.0
    eye = scene.camera.to_world[3, :3]
    distances = [float(np.linalg.norm(mesh.points - eye, axis=1).max(initial=0.0)) for mesh in scene.meshes]
    farthest = max(distances, default=0.0)
    return 2.0 ** math.floor(math.log2(FARTHEST / farthest)) if farthest > 0.0 else 1.0


register(Filament())
