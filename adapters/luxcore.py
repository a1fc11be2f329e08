"""LuxCore, the path tracer of LuxCoreRender, through its Python module pyluxcore, always in a child process.

It draws direct light on Lambert surfaces, directly and in mirrors. Its pictures lie one row too low; the adapter moves
the camera's window by as much, and ``raised = 0.0`` shows the defect (docs/defects/luxcore-one-row).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from notabug.adapters.base import Declaration, Found, Quality, Render, UnsupportedError
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import environment_python, version_in
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.textures import repeated
from notabug.scenes_usd.scene import Scene

DEFAULT_SAMPLES = 16
BOUNCES = 8  # the contract's


@dataclass(frozen=True, slots=True)
class LuxCore:
    """LuxCore, by default 16 samples a pixel under a box filter, for each seed; all seeds in one process.

    Attributes
    ----------
    raised : rows by which the camera's window is moved; at 0 the picture is LuxCore's own, one row too low.
    python : the interpreter that has pyluxcore; by default that of ``notabug install luxcore``, else this one.
    keep_jobs : keep the folder with the job of every picture.
    edit : what is done to the job before LuxCore reads it; a fault to be detected, for tests.
    """

    name: str = "luxcore"
    raised: float = 1.0
    python: str = ""
    keep_jobs: bool = False
    edit: Edit | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "mirror", "shadows"}
    )
    install: str = "notabug install luxcore"

    def declaration(self, quality: Quality) -> Declaration:
        return Declaration(
            precision="float32",
            filter="box",
            radius=0.5,
            quantum=2.0**-24,
            relative_quantum=True,
            noisy=True,
            samples=quality.samples or DEFAULT_SAMPLES,
            ngon_split="02",
            silhouette="black",
            behind_facet="black",
            coincident="unknown",
            opacity_shadow="attenuate",
            texture_filter="bilinear",
            bounces=BOUNCES,
            bounces_count="reflections",
            coordinates="float32",
        )

    def find(self) -> Found:
        python = self._python()
        return Found(version_in(python, "pyluxcore", where=self.name, install=self.install), python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        _check_mirrors(self.name, scene)
        self.find()
        samples, seeds = quality.samples or DEFAULT_SAMPLES, quality.seeds or (0,)
        script = Script(self.name, self._python(), "luxcore_child.py", {}, self.keep_jobs, self.edit)
        settings = {
            "threads": quality.threads,
            "raised": self.raised,
            "bounces": BOUNCES,
        }
        return script.render(repeated(scene), out, quality, settings, "LuxCore", samples=samples, seeds=seeds)

    def _python(self) -> str:
        return self.python or environment_python("luxcore")


def _check_mirrors(name: str, scene: Scene) -> None:
    """Raise UnsupportedError for mirrors that reflect more than there is, or all and are not black."""
    for index in {shape.material for shape in scene.objects}:
        material = scene.materials[index]
        most = max(material.mirror)
        black = material.texture < 0 and not any(material.diffuse)
        if most > 1.0 or (most == 1.0 and not black):
            raise UnsupportedError(
                "a mirror of more light than there is",
                where=material.path,
                expected="a mirror below 1, or a black surface and a mirror of 1",
                got=f"a mirror of {most:g} on a surface that {'is' if black else 'is not'} black",
                do=f"choose another renderer than {name} for this scene",
            )


register(LuxCore())
