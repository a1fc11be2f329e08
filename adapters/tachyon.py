"""Tachyon 0.99: a ray tracer with double-precision arithmetic, driven through its command line.

The picture comes back as a 16-bit PPM, which clips at 1 and is bracketed as POV-Ray's is. Four things about Tachyon are
met here, so that its pictures can be judged at all; each was measured, and ``docs/renderers/tachyon.md`` shows it.

- Its x axis grows to the left: the picture is mirrored.
- Its rays go through the corners of pixels: a picture of twice the size is drawn, and of each 2 x 2 pixels the one at
  the centre of ours is kept.
- It leaves out a point light where N.L over the attenuation falls below a threshold, before it multiplies by the
  light's colour: attenuation and colour are both made smaller by ``attenuation``, which leaves their product alone.
- Its grid cannot hold triangles that all lie in one plane across an axis; Tachyon ends with a segmentation fault, and
  is then run again without the grid.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import (
    Apart,
    Declaration,
    Found,
    Quality,
    Render,
    RendererMissingError,
)
from notabug.adapters.bracketing import bracketed, bracketed_in_16_bits, subsamples_along
from notabug.adapters.job_folder import job_folder, picture_path
from notabug.adapters.process import Ended, failure, made_picture, run_child
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.adapters.tachyon_scene import scene_text
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Floats, Scene
from notabug.scenes_usd.temporary import temporary_folder

_PROGRAMS = ("tachyon-nox", "tachyon")
_VERSION = re.compile(r"Tachyon .*Ray Tracer\s+Version ([\w.]+)")
_PROBE_SECONDS = 30.0
_HEADER = re.compile(rb"P6\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s+65535\s")
ATTENUATION = 1e-6  # by which a point light's attenuation and colour are multiplied; 1 as a user would write it
_UNATTENUATED = "Tachyon does not attenuate highlights with the distance of a point light"
HIT_ERROR = 8.0 * 2.0**-53


@dataclass(frozen=True, slots=True)
class Tachyon:
    """Tachyon, at pixel centres unless more ``samples`` are asked for: s * s make a box of s x s regular samples.

    Attributes
    ----------
    command : name on PATH, or path, of the program; by default Debian's ``tachyon-nox``, or ``tachyon``.
    attenuation : by what a point light's attenuation and colour are multiplied. At 1 far floors go black.
    shadows : False draws the scene as if no object cast a shadow; a fault to be detected, for tests.
    keep_jobs : keep the folder with the scene text and the PPM of every job.
    edit : what is done to the scene text before Tachyon reads it; a fault to be detected, for tests.
    """

    name: str = "tachyon"
    command: str = ""
    attenuation: float = ATTENUATION
    shadows: bool = True
    keep_jobs: bool = False
    edit: Callable[[str], str] = str
    capabilities: frozenset[str] = frozenset(
        {"mesh", "sphere", "normals", "point_light", "distant_light", "opacity", "phong", "blinn", "shadows"}
    )
    not_together: tuple[Apart, ...] = (
        Apart(frozenset({"phong", "blinn"}), "Tachyon has one lobe for all of a picture"),
        Apart(frozenset({"phong", "point_light"}), _UNATTENUATED),
        Apart(frozenset({"blinn", "point_light"}), _UNATTENUATED),
    )
    install: str = "apt install tachyon-bin-nox"

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            bracketed_in_16_bits(quality, HIT_ERROR),
            ngon_split="02",
            silhouette="keep",
            behind_facet="lit",
            coincident="unknown",
            opacity_shadow="attenuate",
            coordinates="float64",
        )

    def find(self) -> Found:
        program = self._program()
        version = _VERSION.search(_first_words(program))
        if version is None:
            raise RendererMissingError(
                "the program does not answer as Tachyon",
                where=f"adapter {self.name!r}",
                got=_first_words(program).strip()[:200] or "nothing",
                do=self._advice(),
            )
        return Found(version[1], program)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        seed = quality.seeds[0] if quality.seeds else 0
        image = picture_path(out, self.name, seed)
        with job_folder(out, self.name, keep=self.keep_jobs) as folder:
            shots = _Shots(self, self._program(), scene, folder, quality)
            pixels = bracketed(shots.shoot, lambda: shots.ended[-1].log, self.name)
        side = subsamples_along(quality)
        averaged = pixels.reshape(scene.height, side, scene.width, side, 3).mean(axis=(1, 3))
        write_exr(image, averaged, metadata={"Software": "Tachyon", "notabug:gains": shots.gains})
        last, seconds = shots.ended[-1], sum(ended.seconds for ended in shots.ended)
        return (Render(image, seed, side**2, seconds, last.command, last.log),)

    def _program(self) -> str:
        names = (self.command,) if self.command else _PROGRAMS
        found = next(filter(None, map(shutil.which, names)), None)
        if found is None:
            raise RendererMissingError(
                f"no executable {' or '.join(map(repr, names))} on PATH",
                where=f"adapter {self.name!r}",
                do=self._advice(),
            )
        return found

    def _advice(self) -> str:
        return f"install Tachyon ({self.install}) or set renderers.{self.name}.command"


@cache
def _first_words(program: str) -> str:
    """What Tachyon prints before it looks for its scene, which is not there."""
    with temporary_folder() as folder:
        return run_child([program, "none.dat"], where="tachyon", folder=folder, timeout=_PROBE_SECONDS).log


def _lobes(scene: Scene) -> set[str]:
    """The lobes of the highlights that the scene has."""
    materials = (scene.materials[shape.material] for shape in scene.objects)
    return {material.lobe for material in materials if any(material.specular)}


class _Shots:
    """The pictures of one job: the same scene under lights of different gain."""

    def __init__(self, adapter: Tachyon, program: str, scene: Scene, folder: Path, quality: Quality) -> None:
        self.adapter, self.program, self.scene = adapter, program, scene
        self.folder, self.quality = folder, quality
        self.ended: list[Ended] = []
        self.gains = ""
        self.options = ["-shade_blinn" if "blinn" in _lobes(scene) else "-shade_phong", "-format", "PPM48"]
        self.options.append("-fullshade" if adapter.shadows else "-mediumshade")
        if any(scene.materials[shape.material].opacity < 1.0 for shape in scene.objects):
            self.options.append("-trans_vmd")  # else a surface's own light is not multiplied by its opacity

    def shoot(self, gain: float) -> Floats:
        """One run of Tachyon; (h * side, w * side, 3) values in 0..1, 1 where they clip."""
        number, side = len(self.ended), subsamples_along(self.quality)
        width, height = 2 * side * self.scene.width, 2 * side * self.scene.height
        text, picture = self.folder / f"shot{number}.dat", self.folder / f"shot{number}.ppm"
        told = scene_text(self.scene, width, height, gain=gain, attenuation=self.adapter.attenuation)
        text.write_text(self.adapter.edit(told), "ascii")
        command = [self.program, text.name, "-o", picture.name, *self.options]
        if self.quality.threads:
            command += ["-numthreads", str(self.quality.threads)]
        ended = self._run(command)
        if ended.signal == "SIGSEGV":  # of its grid, where all triangles lie in one plane across an axis
            picture.unlink(missing_ok=True)
            ended = self._run([*command, "-nobounding"])
        ended.check(self.adapter.name)
        self.gains = " ".join(filter(None, [self.gains, f"{gain:.17g}"]))
        values = self._read(made_picture(picture, where=self.adapter.name, log=ended.log), (height, width), ended)
        centres = values[1::2, 0::2][:, ::-1].astype(np.float64)
        return np.where(centres == 65535, 1.0, (centres + 0.5 * (centres > 0)) / 65535.0)  # Tachyon rounds down

    def _run(self, command: list[str]) -> Ended:
        left = self.quality.timeout - sum(ended.seconds for ended in self.ended)
        self.ended.append(run_child(command, where=self.adapter.name, folder=self.folder, timeout=max(left, 0.0)))
        return self.ended[-1]

    def _read(self, picture: Path, size: tuple[int, int], ended: Ended) -> npt.NDArray[np.uint16]:
        content = picture.read_bytes()
        header = _HEADER.match(content)
        found = (int(header[2]), int(header[1])) if header else (0, 0)
        if header is None or found != size or len(content) - header.end() < 6 * size[0] * size[1]:
            raise failure(
                f"not a 16-bit PPM of {size[1]} x {size[0]} pixels",
                where=self.adapter.name,
                got=repr(content[:40]),
                log=ended.log,
            )
        values = np.frombuffer(content, ">u2", count=3 * size[0] * size[1], offset=header.end())
        return values.reshape(*size, 3).astype(np.uint16)


register(Tachyon())
