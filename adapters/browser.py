"""Renderers that are JavaScript, in a Chromium without a window that stays open: three.js and Babylon.js.

``notabug install NAME`` fetches the renderer by npm. At run time neither npm nor Node is needed: a script speaks to the
browser through two pipes, loads the renderer into an empty page and has it draw into a float32 texture.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Literal

from notabug.adapters.base import Found, Quality, Render, RendererMissingError
from notabug.adapters.child_job import Edit, Script
from notabug.adapters.environment import PACKAGES, environment_folder, installed
from notabug.adapters.process import run_child
from notabug.adapters.zbuffer import grid
from notabug.scenes_usd.scene import Scene, ShadowMap

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "microsoft-edge")
GET_BROWSER = "apt install chromium"
SUBPIXEL_BITS = {"swiftshader": 4, "gl-egl": 8}  # as SwiftShader says of itself, and most hardware and Mesa's llvmpipe
DEPTH: dict[str, Literal["float32", "unknown"]] = {"swiftshader": "unknown", "gl-egl": "float32"}
"""How depths are held. The texture is float32; SwiftShader computes them more coarsely than that, llvmpipe does not."""

NONE = ShadowMap(0)

_CHILD = "browser_child.py"
_PROBE_SECONDS = 120.0
_DEVICE = "device: "  # what the probe's answer begins with
_QUOTED = 200  # characters of what the probe printed last


@dataclass(frozen=True, slots=True)
class InBrowser:
    """The npm package ``package`` in a browser: the file of it that is loaded, and our script that draws with it.

    ``name`` is the adapter's, which a configuration file may change, ``recipe`` what ``notabug install`` calls it.

    ``angle`` is what ANGLE, Chromium's OpenGL, draws with: ``swiftshader``, which comes with Chromium, or ``gl-egl``,
    the system's OpenGL.
    """

    name: str
    recipe: str
    package: str
    library: str
    script: str
    browser: str
    angle: str
    keep_jobs: bool = False
    edit: Edit | None = None

    def find(self) -> Found:
        """The versions of package, browser and device; raises RendererMissingError where one is missing."""
        library = self._library()
        version = json.loads((self._package() / "package.json").read_text("utf-8"))["version"]
        program = self._browser()
        device = _device((program, str(library), str(_beside(self.script))), self.angle, self.name)
        return Found(f"{version} ({device})", str(library))

    def render(
        self, scene: Scene, out: Path, quality: Quality, unit: float, shadow_map: ShadowMap = NONE
    ) -> tuple[Render, ...]:
        settings = {"grid": grid(quality), "unit": unit, "shadow_map": asdict(shadow_map)}
        return self._script().render(scene, out, quality, settings, self.package, samples=grid(quality) ** 2)

    def _script(self) -> Script:
        words = self._browser(), str(self._library()), str(_beside(self.script))
        told = {"NOTABUG_ANGLE": self.angle}
        return Script(self.name, sys.executable, _CHILD, told, self.keep_jobs, self.edit, stays=words)

    def _package(self) -> Path:
        return environment_folder(self.recipe) / PACKAGES / self.package

    def _library(self) -> Path:
        library = self._package() / self.library
        if not installed(environment_folder(self.recipe)) or not library.is_file():
            raise RendererMissingError(
                f"the package {self.package} is not installed",
                where=f"adapter {self.name!r}",
                do=f"install it (notabug install {self.recipe})",
            )
        return library

    def _browser(self) -> str:
        names = (self.browser,) if self.browser else BROWSERS
        for name in names:
            if path := shutil.which(name):
                return path
        raise RendererMissingError(
            "no browser on PATH",
            where=f"adapter {self.name!r}",
            expected=" or ".join(names),
            do=f"install Chromium ({GET_BROWSER}), or name yours in the key browser",
        )


def _beside(script: str) -> Path:
    return Path(__file__).resolve().with_name(script)


@cache
def _device(words: tuple[str, ...], angle: str, name: str) -> str:
    """The browser and what draws in it; raises RendererMissingError where it does not draw in float32."""
    command = [sys.executable, "-P", str(_beside(_CHILD)), *words, "--probe"]
    with tempfile.TemporaryDirectory(prefix="notabug-browser-") as folder:
        ended = run_child(
            command,
            where=name,
            folder=Path(folder),
            timeout=_PROBE_SECONDS,
            environment={"NOTABUG_ANGLE": angle},
        )
    lines = [line for line in ended.log.splitlines() if line.strip()]
    found = [line.removeprefix(_DEVICE) for line in lines if line.startswith(_DEVICE)]
    if ended.exit or ended.stopped or not found:
        raise RendererMissingError(
            "the browser cannot draw in float32",
            where=f"adapter {name!r}",
            got=lines[-1][-_QUOTED:] if lines else f"exit code {ended.exit}",
            do=f"try another browser ({GET_BROWSER}) or another value of the key angle",
        )
    return found[0]
