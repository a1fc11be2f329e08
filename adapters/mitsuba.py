"""Mitsuba 3: a float32 Monte Carlo renderer, always in a child process.

``llvm_ad_rgb`` where an LLVM >= 19 is installed, else ``scalar_rgb``: on a Lambert floor both are within 2.6e-6 of
float64, and take 1.2 s and 6.2 s for four seeds of 64 samples at 256 x 256, process start included. Where the LLVM
child aborts the job is drawn again with ``scalar_rgb``. All seeds are drawn in one child, since its start takes
longer (1.1 s) than a picture.
"""

from __future__ import annotations

import importlib.metadata
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from notabug.adapters.base import Declaration, Found, Quality, Render, RendererMissingError
from notabug.adapters.job_folder import job_folder, picture_path
from notabug.adapters.job_types import Arrays, MitsubaJob
from notabug.adapters.llvm import LEAST, VARIABLE, find_library
from notabug.adapters.mitsuba_job import DEFAULT_SAMPLES, job, write_job
from notabug.adapters.process import Ended, failure, made_picture, run_child
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene

_LLVM, _SCALAR = "llvm_ad_rgb", "scalar_rgb"

# Mitsuba computes hit points from barycentric coordinates, so they do not get worse as the ray gets longer as those of
# float32 arithmetic do. On acne/sphere from 10 to 1e5 no pixel is dark by acne (the in-house tracer in float32, which
# adds t D to O: 1, 5, 47, 351, 2190), 28 are from 1e6 and 891 from 1e7, which a sixteenth of a roundoff covers; dots on
# acne/grazing_plane from 1e3 need .6 of one. On exact spheres LLVM does add t D to O, and is off by .65 of one at most.
HIT_ERROR = 2.0**-24


@dataclass(frozen=True, slots=True)
class Mitsuba:
    """Mitsuba 3, by default 16 random samples a pixel under a box filter, for each seed.

    With ``samples`` 1 it draws pixel centres, without randomness, once; more are random. A material of which several
    of mirror, transmission and opacity send rays on needs more: which of them a sample follows is random.

    Attributes
    ----------
    variant : of Mitsuba, or "" for the fastest that works here.
    opacity : ``mask`` draws opacity with Mitsuba's own plug-in under ``path``, as its users do; it is then squared
        where nothing lies behind: a defect to be shown. ``scripted``, the BSDF of ``mitsuba_bsdf.py``, has it not.
    normal_maps : ``plain`` is Mitsuba's ``normalmap`` without its function against the hard terminators of bumps;
        ``softened`` has that function, as its users do; ``unflipped`` has neither it nor, as before 3.7.1, mapped
        normals that are turned where they face away from the viewer: the surface is black there.
    tangents : ``sided`` gives faces with mirrored coordinates a map of their own whose green is turned;
        ``right_handed`` gives them none: Mitsuba's second tangent is N x T, a defect to be shown.
    python : the interpreter that has mitsuba; by default this one.
    keep_jobs : keep the folder with the job and the arrays of every job.
    edit : what is done to the job and its arrays before Mitsuba reads them: how the generality bench makes its faults.
    """

    name: str = "mitsuba"
    variant: Literal["", "llvm_ad_rgb", "scalar_rgb"] = ""
    opacity: Literal["scripted", "mask"] = "scripted"
    normal_maps: Literal["plain", "softened", "unflipped"] = "plain"
    tangents: Literal["sided", "right_handed"] = "sided"
    python: str = sys.executable
    keep_jobs: bool = False
    edit: Callable[[dict[str, Any], Arrays], object] | None = None
    capabilities: frozenset[str] = frozenset(
        {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
        | {
            "cosine_weighted",
            "coloured_highlight",
            "mirror",
            "transmission",
            "shadows",
            "orthographic",
            "aperture_offset",
        }
        | {"ggx", "dielectric", "emission", "normal_map", "opacity_map", "cutout"}
        | {"sphere_light", "rect_light", "disk_light", "cylinder_light", "sun_light", "dome_light", "dome_texture"}
    )
    install: str = "pip install notabug[mitsuba]"

    def declaration(self, quality: Quality) -> Declaration:
        point = quality.samples == 1
        return Declaration(
            precision="float32",
            hit_error=HIT_ERROR,
            filter="point" if point else "box",
            radius=0.0 if point else 0.5,
            quantum=2.0**-24,
            relative_quantum=True,
            noisy=not point,
            samples=quality.samples or DEFAULT_SAMPLES,
            ngon_split="02",
            silhouette="flip",
            behind_facet="lit",
            mapped_away="black" if self.normal_maps == "unflipped" else "flip",
            bump_light="softened" if self.normal_maps == "softened" else "cut",
            tangents="triangle",
            normal_level="127.5",
            opacity_shadow="opaque" if self.opacity == "mask" else "attenuate",
            glass_shadow="opaque",
            total_reflection="transmission",
            glass_side="facet",
            texture_filter="bilinear",
            opacity_filter="separate",
            masking="separable",
            bounces_count="reflections",
            crossings="once",
            coordinates="float32",
            sphere_roots="stable",  # at 1e4 radii hits are off by 4.8e-4 of one, 8 roundings of the distance
        )

    def find(self) -> Found:
        version = self._version()
        library = find_library()
        if library.path is None:
            remark = f"{library.remark}: {_SCALAR} is used, which is slower; apt install libllvm{LEAST}"
            return Found(version, self.python, (remark,))
        return Found(version, self.python, (f"{library.remark}{_LLVM} with {library.path}",))

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        self._version()
        quality = replace(quality, samples=quality.samples or DEFAULT_SAMPLES)
        document, arrays = job(scene, quality, mask=self.opacity == "mask", sided=self.tangents == "sided")
        document["normal_maps"] = {
            "use_shadowing_function": self.normal_maps == "softened",
            "flip_invalid_normals": self.normal_maps != "unflipped",
        }
        if self.edit is not None:
            self.edit(cast("dict[str, Any]", document), arrays)
        seeds = document["seeds"]
        images = [picture_path(out, self.name, seed) for seed in seeds]
        with job_folder(out, self.name, keep=self.keep_jobs) as folder:
            ended = self._run(document, arrays, folder, quality.timeout)
            for seed, image in zip(seeds, images, strict=True):
                made = made_picture(folder / f"seed{seed}.npy", where=self.name, log=ended.log)
                pixels = np.load(made, allow_pickle=False)
                if pixels.shape != (scene.height, scene.width, 3):
                    raise failure(f"a picture of shape {pixels.shape}", where=self.name, log=ended.log)
                write_exr(image, pixels, metadata={"Software": "Mitsuba 3"})
        share = ended.seconds / len(seeds)
        return tuple(
            Render(image, seed, quality.samples, share, ended.command, ended.log)
            for seed, image in zip(seeds, images, strict=True)
        )

    def _run(self, document: MitsubaJob, arrays: Arrays, folder: Path, timeout: float) -> Ended:
        """Draw the job, with LLVM where there is one, and without it where that fails."""
        library = find_library()
        if library.path is None or self.variant == _SCALAR:
            return self._child(document, arrays, folder, _SCALAR, {}, timeout).check(self.name)
        ended = self._child(document, arrays, folder, _LLVM, {VARIABLE: str(library.path)}, timeout)
        if not ended.timed_out and (ended.signal or (ended.exit and "LLVM" in ended.log)):
            again = self._child(document, arrays, folder, _SCALAR, {}, max(0.0, timeout - ended.seconds))
            note = f"{_LLVM} with {library.path} ended with {ended.signal or ended.exit}; drawn again with {_SCALAR}\n"
            ended = replace(again, seconds=ended.seconds + again.seconds, log=ended.log + note + again.log)
        return ended.check(self.name)

    def _child(
        self,
        document: MitsubaJob,
        arrays: Arrays,
        folder: Path,
        variant: str,
        environment: dict[str, str],
        timeout: float,
    ) -> Ended:
        write_job(document, arrays, folder, variant)
        command = [self.python, "-P", "-m", "notabug.adapters.mitsuba_child", "."]
        return run_child(command, where=self.name, folder=folder, timeout=timeout, environment=environment)

    def _version(self) -> str:
        try:
            return importlib.metadata.version("mitsuba")
        except importlib.metadata.PackageNotFoundError:
            raise RendererMissingError(
                "the package mitsuba is not installed",
                where=f"adapter {self.name!r}",
                do=f"install it ({self.install}; apt install libllvm{LEAST} makes it faster)",
            ) from None


register(Mitsuba())
