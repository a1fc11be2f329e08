"""pygfx on wgpu: a z-buffer by way of Vulkan, through its Python package, always in a child process.

pygfx's own shaders are judged, in float32 and without a window. Without a graphics card Mesa's lavapipe draws. Its
highlights are Blinn's, multiplied by (n + 2)/8 and by N.L, as in three.js.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from notabug.adapters.base import Declaration, Found, Quality, Render, UnsupportedError
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import environment_python, probed, version_in
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.zbuffer import grid, rasterised
from notabug.scenes_usd.scene import Scene

UNIT = 1024.0  # a power of two, by which float32 numbers are multiplied without rounding
_DRIVER = "apt install mesa-vulkan-drivers libvulkan1"
_SCRIPT = "pygfx_child.py"


@dataclass(frozen=True, slots=True)
class Pygfx:
    """pygfx: pixel centres by default, a regular grid for more samples; no shadows.

    Attributes
    ----------
    unit : by what the scene is drawn larger. At 1 light does not grow within a tenth of a unit of a point light.
    python : the interpreter that has pygfx; by default that of ``notabug install pygfx``, else this one.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before pygfx reads it; a fault to be detected, for tests.
    """

    name: str = "pygfx"
    unit: float = UNIT
    python: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "phong", "blinn", "cosine_weighted"}
    )
    install: str = f"notabug install pygfx; {_DRIVER}"

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            rasterised(quality),
            depth="float32",
            coincident="unknown",
            lobe="blinn",
            normalised="n2over8",
            highlight="cosine",
            gouraud_shadows="none",
            texture_filter="bilinear",
        )

    def find(self) -> Found:
        python = self._python()
        version = version_in(python, "pygfx", where=self.name, install="notabug install pygfx")
        device = probed(python, _SCRIPT, where=self.name, what="no device that draws in float32", driver=_DRIVER)
        return Found(f"{version} ({device})", python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        _check_highlights(self.name, scene)
        self.find()
        threads = {"LP_NUM_THREADS": str(quality.threads)} if quality.threads else {}
        script = Script(self.name, self._python(), _SCRIPT, threads, self.keep_jobs, self.edit, served=True)
        settings = {"grid": grid(quality), "unit": self.unit}
        return script.render(scene, out, quality, settings, "pygfx", samples=grid(quality) ** 2)

    def _python(self) -> str:
        return self.python or environment_python("pygfx")


def _check_highlights(name: str, scene: Scene) -> None:
    """Raise UnsupportedError for a highlight brighter than its lobe: pygfx's strength ends at 1."""
    for index in {shape.material for shape in scene.objects}:
        material = scene.materials[index]
        if max(material.specular) > 1.0:
            raise UnsupportedError(
                "a highlight of more than all light",
                where=material.path,
                expected="specular colours up to 1",
                got=f"{max(material.specular):g}",
                do=f"choose another renderer than {name} for this scene",
            )


register(Pygfx())
