"""Environments of renderers: where they are, and which version of a distribution an interpreter has.

A renderer that is a Python package may be installed beside notabug, or by ``notabug install NAME`` into an environment
of its own below the cache, where its versions bother nobody. The latter is taken where it is there. One that is an npm
package has the folder ``node_modules`` there.
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

from notabug.adapters.base import RendererError, RendererMissingError
from notabug.adapters.process import run_child
from notabug.scenes_usd.cache_folder import cache_root
from notabug.scenes_usd.temporary import temporary_folder

COMPLETE = "notabug-environment.json"  # in the environment's folder once all of it is there: what was installed
PACKAGES = "node_modules"  # in the environment's folder, where npm puts packages
_PROBE_SECONDS = 60.0
_QUOTED = 200  # characters of what a probe printed last
_TELL = "import sys, importlib.metadata as m; print(m.version(sys.argv[1]))"


@dataclass(frozen=True, slots=True)
class Recipe:
    """What ``notabug install`` puts into a renderer's environment.

    Attributes
    ----------
    requirements : every distribution that is installed, with its version: no other comes with them.
    megabytes : that the environment takes on disk, measured on Linux.
    licence : of the renderer.
    python : the version of Python that the renderer needs ("3.13"), or "" for any from 3.11 on.
    by : what fetches it. npm is asked to run no script of a package.
    """

    requirements: tuple[str, ...]
    megabytes: int
    licence: str
    python: str = ""
    by: Literal["pip", "npm"] = "pip"


RECIPES: dict[str, Recipe] = {
    "babylon": Recipe(("babylonjs@9.35.0",), megabytes=112, licence="Apache-2.0", by="npm"),
    "cycles": Recipe(
        (
            *("bpy==5.3.0", "numpy==2.5.5", "cython==3.3.1", "zstandard==0.25.0", "requests==2.34.2"),
            *("urllib3==2.8.0", "idna==3.20", "certifi==2026.10.19.post1", "charset-normalizer==3.5.3"),
            *("attrs==26.1.0", "cattrs==26.2.1", "typing_extensions==4.16.0"),
        ),
        megabytes=1050,
        licence="GPL-3.0-or-later",
        python="3.13",
    ),
    "filament": Recipe(("filly==0.2.1", "numpy==2.4.6"), megabytes=104, licence="Apache-2.0"),
    "luxcore": Recipe(("pyluxcore==2.11.2", "numpy==2.4.6"), megabytes=280, licence="Apache-2.0"),
    "panda3d": Recipe(("panda3d==1.10.16", "numpy==2.4.6"), megabytes=270, licence="BSD-3-Clause"),
    "pygfx": Recipe(
        (
            *("pygfx==0.17.0", "wgpu==0.32.0", "rendercanvas==2.7.2", "pylinalg==0.6.8", "numpy==2.4.6"),
            *("hsluv==5.0.5", "freetype-py==2.5.1", "uharfbuzz==0.57.0", "jinja2==3.1.6", "markupsafe==3.0.4"),
            *("cffi==2.1.1", "pycparser==3.12"),
        ),
        megabytes=130,
        licence="BSD-2-Clause",
    ),
    "threejs": Recipe(("three@0.187.0",), megabytes=24, licence="MIT", by="npm"),
    "vtk": Recipe(("vtk==9.7.2", "numpy==2.4.6"), megabytes=660, licence="BSD-3-Clause"),
}
"""By the name of the adapter, in alphabetical order."""


def environment_folder(name: str) -> Path:
    """Where the environment of the renderer ``name`` is, or would be."""
    return cache_root() / "renderers" / name


def environment_python(name: str) -> str:
    """The interpreter of the renderer's own environment where that is complete, else the one that runs notabug."""
    folder = environment_folder(name)
    return str(interpreter(folder)) if installed(folder) else sys.executable


def interpreter(folder: Path) -> Path:
    """The interpreter of the environment in ``folder``."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def installed(folder: Path) -> tuple[str, ...]:
    """The requirements that the environment in ``folder`` was made from; () where it is not complete."""
    if not (interpreter(folder).exists() or (folder / PACKAGES).is_dir()):  # the Python that it was made with is gone
        return ()
    try:
        return tuple(json.loads((folder / COMPLETE).read_text("utf-8"))["requirements"])
    except (OSError, ValueError, KeyError, TypeError):
        return ()


def version_in(python: str, distribution: str, *, where: str, install: str) -> str:
    """The version of ``distribution`` that ``python`` has; raises RendererMissingError where it has none."""
    version = _version_in(python, distribution)
    if not version:
        raise RendererMissingError(
            f"the package {distribution} is not installed for {python}",
            where=f"adapter {where!r}",
            do=f"install it ({install})",
        )
    return version


@cache
def _version_in(python: str, distribution: str) -> str:
    """ "" where ``python`` does not have ``distribution``, or does not run."""
    with temporary_folder() as folder:
        try:
            ended = run_child(
                [python, "-c", _TELL, distribution], where=distribution, folder=folder, timeout=_PROBE_SECONDS
            )
        except RendererError:
            return ""
    return ended.log.strip() if not ended.exit and not ended.stopped else ""


@cache
def probed(python: str, script: str, *, where: str, what: str, driver: str) -> str:
    """The last line that ``script``, one beside this file, prints by ``python`` with ``--probe``: what would draw.

    Raises RendererMissingError, saying ``what`` is missing and how to get a ``driver``, where the script fails.
    """
    command = [python, "-P", str(Path(__file__).with_name(script)), "--probe"]
    with temporary_folder() as folder:
        ended = run_child(command, where=where, folder=folder, timeout=_PROBE_SECONDS)
    said = ended.log.strip().splitlines()[-1:]
    if ended.exit or ended.stopped or not said:
        raise RendererMissingError(
            what,
            where=f"adapter {where!r}",
            got=said[0][-_QUOTED:] if said else f"exit code {ended.exit}",
            do=f"install a driver ({driver})",
        )
    return said[0]
