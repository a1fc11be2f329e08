"""OpenGL: a real z-buffer, through moderngl on EGL, always in a child process.

Without a graphics card Mesa's llvmpipe draws, in float32, at pixel centres; a Lambert floor comes out within 1e-6 of
float64. Depth is fixed-point or floating-point as asked for.
"""

from __future__ import annotations

import importlib.metadata
import json
import sys
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration, Found, Quality, Render, RendererError, RendererMissingError
from notabug.adapters.job_folder import job_folder, picture_path
from notabug.adapters.opengl_job import DepthFormat, Interpolation, job
from notabug.adapters.process import Ended, failure, made_picture, run_child
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.zbuffer import CAPABILITIES, grid, rasterised
from notabug.references.models.phong import with_lobe
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.temporary import temporary_folder

INSTALL = "pip install notabug[opengl]; apt install libegl1 libgl1 libgl1-mesa-dri"
_PROBE_SECONDS = 60.0


@dataclass(frozen=True, slots=True)
class OpenGL:
    """moderngl on EGL: pixel centres by default, a regular grid for more samples; no shadows.

    Attributes
    ----------
    depth : format of the depth buffer; ``reversed32`` is float32 with near at 1 and far at 0.
    interpolation : over smooth meshes: normals, as in every shader today (``phong``), colours, as OpenGL 1 did
        (``gouraud``), or nothing (``flat``).
    lobe : of highlights: as the material has it, or always the one named, at the same or at the matching exponent.
    python : the interpreter that has moderngl; by default this one.
    keep_jobs : keep the folder with the job and the arrays of every job.
    """

    name: str = "opengl"
    depth: DepthFormat = "fixed24"
    interpolation: Interpolation = "phong"
    lobe: Literal["authored", "phong", "blinn", "phong_matched", "blinn_matched"] = "authored"
    python: str = sys.executable
    keep_jobs: bool = False
    capabilities: frozenset[str] = CAPABILITIES
    install: str = INSTALL

    def declaration(self, quality: Quality) -> Declaration:
        return replace(rasterised(quality), depth=self.depth, lobe=self.lobe, interpolation=self.interpolation)

    def find(self) -> Found:
        return Found(f"{self._version()} ({_probe(self.python, self.name)})", self.python)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        self._version()
        seed = quality.seeds[0] if quality.seeds else 0
        image = picture_path(out, self.name, seed)
        pixels, _, ended = self._draw(scene, out, quality)
        write_exr(image, pixels, metadata={"Software": "OpenGL"})
        return (Render(image, seed, grid(quality) ** 2, ended.seconds, ended.command, ended.log),)

    def depth_buffer(self, scene: Scene, out: Path) -> npt.NDArray[np.float64]:
        """The depths (h, w) in [0, 1] that OpenGL stored for the pixel centres, read back."""
        check_supported(self, scene)
        self._version()
        return self._draw(scene, out, Quality(samples=1))[1]

    def _draw(
        self, scene: Scene, out: Path, quality: Quality
    ) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64], Ended]:
        document, arrays = job(with_lobe(scene, self.lobe), self.depth, grid(quality), self.interpolation)
        environment = {"LP_NUM_THREADS": str(quality.threads)} if quality.threads else {}
        with job_folder(out, self.name, keep=self.keep_jobs) as folder:
            (folder / "job.json").write_text(json.dumps(document), "utf-8")
            np.savez(folder / "arrays.npz", allow_pickle=False, **arrays)
            ended = run_child(
                [self.python, "-P", "-m", "notabug.adapters.opengl_child", "."],
                where=self.name,
                folder=folder,
                timeout=quality.timeout,
                environment=environment,
            ).check(self.name)
            pixels = np.load(made_picture(folder / "picture.npy", where=self.name, log=ended.log), allow_pickle=False)
            if pixels.shape != (scene.height, scene.width, 3):
                raise failure(f"a picture of shape {pixels.shape}", where=self.name, log=ended.log)
            depths = folder / "depth.npy"
            return pixels, np.load(depths, allow_pickle=False) if depths.is_file() else np.zeros((0, 0)), ended

    def _version(self) -> str:
        try:
            return f"moderngl {importlib.metadata.version('moderngl')}"
        except importlib.metadata.PackageNotFoundError:
            raise RendererMissingError(
                "the package moderngl is not installed",
                where=f"adapter {self.name!r}",
                do=f"install it ({self.install})",
            ) from None


@cache
def _probe(python: str, name: str) -> str:
    """What a context says of itself; raises RendererMissingError where there is none."""
    command = [python, "-P", "-m", "notabug.adapters.opengl_child", "--probe"]
    try:
        with temporary_folder() as folder:
            ended = run_child(command, where=name, folder=folder, timeout=_PROBE_SECONDS).check(name)
        said = json.loads(ended.log.splitlines()[-1])
        return f"{said['renderer']}, OpenGL {said['version']}"
    except (RendererError, ValueError, IndexError) as error:
        raise RendererMissingError(
            f"no OpenGL context: {error}", where=f"adapter {name!r}", do=f"install a driver ({INSTALL})"
        ) from error


register(OpenGL())
