"""POV-Ray 3.7: a ray tracer with double-precision arithmetic, driven through its command line.

The picture comes back as a 16-bit PNG with ``File_Gamma=1.0``, the most exact of its formats: on a Lambert floor
under a point light every pixel is within half a step (7.6e-6) of float64, where its half-float EXR is off by 1.8e-4
of the value at the median and ``+FH`` is biased by -0.3 %. It clips at 1, so a picture that reaches 1 is rendered
again with the lights divided by four, until nothing clips, and the clipped values are taken from there: the step is
1/65535 below 1, and at most 4/65535 of the value above. A picture that stays below 1/16 is rendered again with
brighter lights, which makes the step finer. The gains used stand in the EXR's attribute ``notabug:gains``. A run
takes 0.65 s of which it computes 0.02 s: the program sleeps.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Declaration, Found, Quality, Render, RendererMissingError
from notabug.adapters.bracketing import bracketed, bracketed_in_16_bits, subsamples_along
from notabug.adapters.config import ConfigError
from notabug.adapters.job_folder import job_folder, picture_path
from notabug.adapters.povray_scene import (
    LIGHT_GRID,
    LIGHT_GRIDS,
    MAX_TRACE_LEVEL,
    Image,
    needs_channels,
    scene_text,
    texture_images,
    write_textures,
)
from notabug.adapters.process import Ended, failure, made_picture, run_child
from notabug.adapters.registry import register
from notabug.adapters.requirements import check_supported
from notabug.scenes_usd.picture import PictureError, read_picture, write_exr
from notabug.scenes_usd.scene import Scene

_NOT_STARTED = "Timed out waiting for worker thread startup"
_STARTS = 4  # of POV-Ray, until one gets as far as drawing
_OPTIONS = ("-D", "-P", "-V", "-A", "-C", "+FN16", "File_Gamma=1.0", "Dither=off", "Output_Alpha=off")

# Vertices are float32, but the same for every ray, and the arithmetic is float64: on acne/sphere from 10 to 1e6 not one
# pixel is dark by acne; from 1e7 nothing is hit at all, since POV-Ray looks no farther.
HIT_ERROR = 8.0 * 2.0**-53
EPSILON = 1e-3  # in the scene's unit: nearer than this to its start, or to its last crossing, a ray meets nothing


@dataclass(frozen=True, slots=True)
class PovRay:
    """POV-Ray, at pixel centres unless more ``samples`` are asked for.

    ``samples`` = s * s draws the picture s times as wide and high, without anti-aliasing, and averages s x s pixels: a
    box filter, and no randomness. Seeds change nothing.

    Attributes
    ----------
    command : name on PATH, or path, of the program.
    shadows : False draws the scene as if no object cast a shadow; a fault to be detected, for tests.
    light_grid : points along each side of a rectangular light, a power of two up to 16; see ``povray_scene``.
    keep_jobs : keep the folder with the scene text, the textures and the PNG of every job.
    edit : what is done to the scene text before POV-Ray reads it: how the generality bench makes its faults.
    """

    name: str = "povray"
    command: str = "povray"
    shadows: bool = True
    light_grid: int = LIGHT_GRID
    keep_jobs: bool = False
    edit: Callable[[str], str] = str
    capabilities: frozenset[str] = frozenset(
        {"mesh", "sphere", "normals", "uv", "texture", "point_light", "distant_light", "opacity", "phong", "blinn"}
        | {"coloured_highlight", "mirror", "transmission", "shadows", "orthographic", "aperture_offset", "rect_light"}
    )
    install: str = "apt install povray"

    def __post_init__(self) -> None:
        if self.light_grid not in LIGHT_GRIDS:
            raise ConfigError(
                "light_grid",
                where=f"adapter {self.name!r}",
                expected=f"one of {', '.join(map(str, LIGHT_GRIDS))}: POV-Ray quarters a light again and again",
                got=str(self.light_grid),
            )

    def declaration(self, quality: Quality) -> Declaration:
        return replace(
            bracketed_in_16_bits(quality, HIT_ERROR),
            ngon_split="02",
            silhouette="flip",
            behind_facet="lit",
            coincident="unknown",
            opacity_shadow="attenuate",
            glass_shadow="attenuate",
            total_reflection="whole",
            glass_side="counted",
            texture_filter="bilinear",
            bounces=MAX_TRACE_LEVEL - 1,
            bounces_count="reflections",
            crossings="once",
            coordinates="float32",  # of meshes
            epsilon=EPSILON,
            light_grid=self.light_grid,
            light_grid_shadow="share",
            sphere_roots="discriminant",
        )

    def find(self) -> Found:
        program = self._program()
        try:
            told = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=30, check=False)
            log = told.stderr + told.stdout  # it speaks on standard error
        except (OSError, subprocess.TimeoutExpired) as error:
            log = str(error)
        version = re.search(r"POV-Ray (\d+)\.(\d+)\S*", log)
        if version is None or (int(version[1]), int(version[2])) < (3, 7):
            raise RendererMissingError(
                "the program does not answer as POV-Ray 3.7",
                where=f"adapter {self.name!r}",
                got=log.strip().splitlines()[0] if log.strip() else "nothing",
                do=self._advice(),
            )
        return Found(version[0].removeprefix("POV-Ray "), program)

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        check_supported(self, scene)
        program = self._program()
        seed = quality.seeds[0] if quality.seeds else 0
        image = picture_path(out, self.name, seed)
        with job_folder(out, self.name, keep=self.keep_jobs) as folder:
            images = texture_images(scene)
            write_textures(images, folder)
            shots = _Shots(self, program, scene, images, folder, quality)
            if needs_channels(scene):
                pixels = np.concatenate([shots.bracketed(channel) for channel in range(3)], axis=2)
            else:
                pixels = shots.bracketed()
            write_exr(image, pixels, metadata={"Software": "POV-Ray", "notabug:gains": shots.gains})
        samples = subsamples_along(quality) ** 2
        last = shots.ended[-1]
        seconds = sum(each.seconds for each in shots.ended)
        return (Render(image, seed, samples, seconds, last.command, last.log),)

    def _program(self) -> str:
        program = shutil.which(self.command)
        if program is None:
            raise RendererMissingError(
                f"no executable {self.command!r} on PATH", where=f"adapter {self.name!r}", do=self._advice()
            )
        return program

    def _advice(self) -> str:
        return f"install POV-Ray 3.7 ({self.install}) or set renderers.{self.name}.command"


class _Shots:
    """The pictures of one job: the same scene under lights of different gain."""

    def __init__(
        self, adapter: PovRay, program: str, scene: Scene, images: dict[int, Image], folder: Path, quality: Quality
    ) -> None:
        self.adapter, self.program, self.scene, self.images = adapter, program, scene, images
        self.folder, self.quality = folder, quality
        self.ended: list[Ended] = []
        self.gains = ""

    def bracketed(self, channel: int | None = None) -> npt.NDArray[np.float64]:
        """The picture (h, w, 3) with nothing clipped, as if every gain were 1; (h, w, 1) of one ``channel``."""
        side = subsamples_along(self.quality)
        pixels = bracketed(partial(self._shoot, channel=channel), lambda: self.ended[-1].log, self.adapter.name)
        height, width = self.scene.height, self.scene.width
        return np.asarray(pixels.reshape(height, side, width, side, -1).mean(axis=(1, 3)))

    def _shoot(self, gain: float, channel: int | None) -> npt.NDArray[np.float64]:
        """One run of POV-Ray; (h * side, w * side, 3 or 1) values in 0..1, 1 where they clip."""
        number, name = len(self.ended), self.adapter.name
        text, picture = self.folder / f"shot{number}.pov", self.folder / f"shot{number}.png"
        ini = self.folder / "empty.ini"
        ini.touch()
        told = scene_text(
            self.scene,
            gain=gain,
            shadows=self.adapter.shadows,
            images=self.images,
            channel=channel,
            light_grid=self.adapter.light_grid,
        )
        text.write_text(self.adapter.edit(told), "ascii")
        side = subsamples_along(self.quality)
        width, height = self.scene.width * side, self.scene.height * side
        command = [self.program, f"+I{text.name}", f"+O{picture.name}", f"+W{width}", f"+H{height}", *_OPTIONS]
        if self.quality.threads:
            command.append(f"+WT{self.quality.threads}")
        ended = self._started(command, {"POVINI": str(ini)})  # a user's own settings must not change the picture
        self.gains = " ".join(filter(None, [self.gains, f"{gain:.17g}"]))
        made_picture(picture, where=name, log=ended.log)
        try:
            read = read_picture(picture)
        except PictureError as error:
            raise failure(error.what, where=name, log=ended.log) from error
        if read.pixels.shape[:2] != (height, width) or read.quantum != 1 / 65535:
            raise failure(
                f"a picture of {read.pixels.shape[1]} x {read.pixels.shape[0]} came back",
                where=name,
                got=f"steps of {read.quantum:.3g}",
                log=ended.log,
            )
        return read.pixels[..., slice(None) if channel is None else [channel]].astype(np.float64)

    def _started(self, command: list[str], environment: dict[str, str]) -> Ended:
        """What came of ``command``, again where POV-Ray gave up before it drew: it waits for its threads by the clock.

        On a machine that is busy with other work they do not start within the time that is fixed in its source.
        """
        for attempt in range(_STARTS):
            left = self.quality.timeout - sum(each.seconds for each in self.ended)
            ended = run_child(
                command,
                where=self.adapter.name,
                folder=self.folder,
                timeout=max(left, 0.0),
                environment=environment,
            )
            self.ended.append(ended)
            if not ended.exit or _NOT_STARTED not in ended.log or attempt == _STARTS - 1:
                break
        return ended.check(self.adapter.name)


register(PovRay())
