"""The fifth part: whole files as Blender, Houdini and Maya export them, unedited, and five faults planted in each.

``exports/blender.usda`` is Blender's own: ``write_blender.py`` calls its exporter. The others are written in
the style of their programs. A fault is planted by an edit of a copy: the renderer draws the copy, and the judge has the
file as it was exported.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from notabug.adapters.base import Quality, RendererMissingError
from notabug.adapters.registry import adapter
from notabug.bench.generality.examine import Record, guarded, pictures_by, verdict_on
from notabug.bench.generality.jobs import Job, sized
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import read_picture, write_exr
from notabug.scenes_usd.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pxr.Usd import Prim, Stage

EXPORTS = Path(__file__).with_name("exports")
NAMES = ("blender", "houdini", "maya")
RENDERERS = ("mitsuba", "cycles")  # which draw all that the exports have
SIDE = 48  # pixels along the longer side of a picture
LARGER = 2.0  # times the size of a light
QUALITY = Quality()

Edit = Callable[["Stage"], None]


@dataclass(frozen=True, slots=True)
class FileFault:
    """``edit`` makes the fault in an opened copy; a finding with one of the names ``right`` has found it."""

    edit: Edit
    right: tuple[str, ...]


def exported(name: str, within: Path) -> Path:
    """A copy of the export ``name`` and of its textures, in the folder ``within``."""
    within.mkdir(parents=True, exist_ok=True)
    shutil.copytree(EXPORTS / "textures", within / "textures", dirs_exist_ok=True)
    return Path(shutil.copyfile(EXPORTS / f"{name}.usda", within / f"{name}.usda"))


def planted(name: str, fault: str, within: Path) -> Path:
    """A copy of the export ``name`` with ``fault`` in it, in the folder ``within``."""
    from pxr import Usd

    path = exported(name, within)
    stage = Usd.Stage.Open(str(path))
    FAULTS[fault].edit(stage)
    stage.GetRootLayer().Save()
    return path


def taken(path: Path, side: int = SIDE) -> Scene:
    """The scene of the export at ``path``, as ``run`` takes it, in a small picture."""
    return sized(take_scene(path).scene, side)


def export_jobs(who: tuple[str, ...], seed: int, *, naming: bool, side: int) -> list[Job]:
    """Every export by every one of the renderers, as it is and with each fault."""
    return [
        Job("exports", seed, index, (renderer,), naming, side or SIDE, name, fault)
        for index, name in enumerate(NAMES)
        for fault in ("", *FAULTS)
        for renderer in who
    ]


def able(parts: Sequence[str]) -> tuple[str, ...]:
    """The renderers that draw all that the exports have and are installed, where nothing else is among ``parts``."""
    if set(parts) != {"exports"}:
        return ()
    found = []
    for name in RENDERERS:
        try:
            adapter(name).find()
        except RendererMissingError:
            continue
        found.append(name)
    return tuple(found)


def expose_export(job: Job, within: Path) -> list[Record]:
    """The record of one export by one renderer."""
    (renderer,) = job.renderers
    about: Record = {"part": "exports", "seed": job.seed, "index": job.index, "mesh": job.mesh, "renderer": renderer}
    if job.fault:
        right = list(FAULTS[job.fault].right)
        about |= {"fault": job.fault, "right": right, "shows": True, "named": job.naming}

    def work() -> Record:
        meant = taken(exported(job.mesh, within / "as_exported"), job.side)
        about["size"] = [meant.width, meant.height]
        drawn = taken(planted(job.mesh, job.fault, within / "edited"), job.side) if job.fault else meant
        who = adapter(renderer)
        return verdict_on(
            pictures_by(who, drawn, QUALITY), meant, who.declaration(QUALITY), naming=job.naming and bool(job.fault)
        )

    made = guarded(work)
    return [{**about, **made}]


def _surfaces(stage: Stage, kind: str) -> Iterator[Prim]:
    """The shaders of ``stage`` of a ``kind``, such as UsdPreviewSurface."""
    for prim in stage.Traverse():
        if prim.GetTypeName() == "Shader" and prim.GetAttribute("info:id").Get() == kind:
            yield prim


def _read_by(stage: Stage, name: str) -> list[Prim]:
    """The textures that an input ``name`` of a preview surface is connected to."""
    found: dict[str, Prim] = {}
    for surface in _surfaces(stage, "UsdPreviewSurface"):
        for source in surface.GetAttribute(f"inputs:{name}").GetConnections():
            found[str(source.GetPrimPath())] = stage.GetPrimAtPath(source.GetPrimPath())
    return list(found.values())


def _larger_lights(stage: Stage) -> None:
    """Lights with a size are larger, and as strong as before: the exporters write ``normalize``."""
    for prim in stage.Traverse():
        for name in ("radius", "width", "height"):
            size = prim.GetAttribute(f"inputs:{name}")
            if prim.GetTypeName() in ("SphereLight", "RectLight", "DiskLight") and size.HasAuthoredValue():
                size.Set(size.Get() * LARGER)
        if prim.GetTypeName() == "DistantLight":
            angle = prim.GetAttribute("inputs:angle")
            angle.Set(2.0 * math.degrees(math.asin(LARGER * math.sin(math.radians(angle.Get() / 2.0)))))


def _squared_twice(stage: Stage) -> None:
    """The roughness is squared in the file, and once more by the renderer."""
    for surface in _surfaces(stage, "UsdPreviewSurface"):
        roughness = surface.GetAttribute("inputs:roughness")
        if roughness and not roughness.GetConnections():
            roughness.Set(roughness.Get() ** 2)
    for texture in _read_by(stage, "roughness"):
        file = texture.GetAttribute("inputs:file")
        given = Path(stage.GetRootLayer().realPath).parent / file.Get().path
        squared = given.with_name("squared.exr")
        _write_squared(given, squared)
        file.Set(file.Get().path.replace(given.name, squared.name))


def _write_squared(given: Path, target: Path) -> None:

    write_exr(target, np.square(read_picture(given).pixels.astype(np.float64)).astype(np.float32))


def _roughness_as_srgb(stage: Stage) -> None:
    for texture in _read_by(stage, "roughness"):
        texture.GetAttribute("inputs:sourceColorSpace").Set("sRGB")


def _green_flipped(stage: Stage) -> None:
    for texture in _read_by(stage, "normal"):
        for name in ("scale", "bias"):
            said = texture.GetAttribute(f"inputs:{name}")
            r, g, b, a = said.Get()
            said.Set((r, -g, b, a))


def _metallic_ignored(stage: Stage) -> None:
    for surface in _surfaces(stage, "UsdPreviewSurface"):
        metallic = surface.GetAttribute("inputs:metallic")
        if metallic:
            metallic.Set(0.0)


FAULTS: Mapping[str, FileFault] = {
    "light size": FileFault(_larger_lights, ("light_size",)),
    "roughness squared twice": FileFault(_squared_twice, ("roughness_squared_twice",)),
    "sRGB on the roughness map": FileFault(_roughness_as_srgb, ("number_map_as_srgb",)),
    "green of the normal map flipped": FileFault(_green_flipped, ("normal_green_flipped",)),
    "metallic ignored": FileFault(_metallic_ignored, ("metallic_ignored",)),
}


def table(records: Sequence[Record]) -> list[tuple[str, ...]]:
    """A line for each export and fault: what was said of each renderer's picture, and the name of the first bug."""
    renderers = list(dict.fromkeys(record["renderer"] for record in records))
    said: dict[tuple[str, str], dict[str, str]] = {}
    for record in records:
        names: list[str] = record.get("bugs") or record.get("limitations") or []
        told = f"{record['word']}{': ' + names[0].replace('_', ' ') if names else ''}"
        said.setdefault((record["mesh"], record.get("fault", "")), {})[record["renderer"]] = told
    lines = [
        (name, fault or "as it is", *(row.get(who, "") for who in renderers)) for (name, fault), row in said.items()
    ]
    return [("export", "fault", *renderers), *lines]
