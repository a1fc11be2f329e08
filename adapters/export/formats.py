"""``export``: a scene in one of the formats, in a folder, with ``scene.json`` beside it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.export.description import describe, sky_name, texture_name
from notabug.adapters.textures import plain_wraps
from notabug.scenes_usd.picture import write_png
from notabug.scenes_usd.scene import Floats, Scene

_EVERY_WRAP = ("usd", "mitsuba")  # formats in which textures are mirrored, and end in black, by themselves
_POINTS = ("gltf", "pbrt", "povray")  # formats in which lights are written as points and directions alone


def export(scene: Scene, kind: str, folder: Path, quality: Quality | None = None) -> Path:
    """Write ``scene`` as ``kind`` (a key of FORMATS) into ``folder``, which exists; the file that a renderer opens.

    Beside it lie ``scene.json`` and the textures as 16-bit PNG and as PFM, both linear; they repeat or are clamped.
    ``quality`` enters only where the format holds samples and seeds (``mitsuba``).
    """
    odd = next((each for each in scene.lights if not each.is_plain), None)
    if odd is not None and kind in _POINTS:
        raise UnsupportedError(
            f"a {odd.kind} light with a size, a beam, multipliers or links has no place in this format here",
            where=odd.path,
            expected="point and distant lights",
            do="choose usd, json or mitsuba, or make the light a point (treatAsPoint)",
        )
    asked, scene = scene, plain_wraps(scene)
    for index, texture in enumerate(scene.textures):
        write_png(folder / texture_name(index, ".png"), texture.pixels)
        write_pfm(folder / texture_name(index, ".pfm"), texture.pixels)
    for number, light in enumerate(scene.lights):
        if light.emitter is not None and light.emitter.texture is not None:
            write_pfm(folder / sky_name(number), light.emitter.texture.pixels)
    (folder / "scene.json").write_text(json.dumps(describe(scene), allow_nan=False), "utf-8")
    return FORMATS[kind](asked if kind in _EVERY_WRAP else scene, folder, quality or Quality())


def write_pfm(path: Path, pixels: Floats) -> None:
    """(h, w, 3) as a portable float map: little-endian float32, the lowest row first."""
    height, width = pixels.shape[:2]
    path.write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + np.asarray(pixels[::-1], "<f4").tobytes())


def _json(_scene: Scene, folder: Path, _quality: Quality) -> Path:
    return folder / "scene.json"


def _usd(scene: Scene, folder: Path, _quality: Quality) -> Path:
    """One layer without variants, references or payloads; asset paths are absolute."""
    from notabug.scenes_usd.own import as_usd

    target = folder / "scene.usda"
    target.write_text(as_usd(scene), "utf-8")
    return target


def _obj(scene: Scene, folder: Path, _quality: Quality) -> Path:
    from notabug.adapters.export.obj import write_obj

    return write_obj(scene, folder)


def _gltf(scene: Scene, folder: Path, _quality: Quality) -> Path:
    from notabug.adapters.export.gltf import write_gltf

    return write_gltf(scene, folder)


def _pbrt(scene: Scene, folder: Path, _quality: Quality) -> Path:
    from notabug.adapters.export.pbrt import write_pbrt

    return write_pbrt(scene, folder)


def _povray(scene: Scene, folder: Path, _quality: Quality) -> Path:
    """What the adapter gives to POV-Ray; ``povray +Iscene.pov +FN16 File_Gamma=1.0 -A`` draws it."""
    from notabug.adapters.povray_scene import write_scene

    return write_scene(scene, folder)


def _mitsuba(scene: Scene, folder: Path, quality: Quality) -> Path:
    """What the adapter gives to its child; ``python -m notabug.adapters.mitsuba_child FOLDER`` draws it."""
    from dataclasses import replace

    from notabug.adapters.mitsuba_job import DEFAULT_SAMPLES, job, write_job

    return write_job(*job(scene, replace(quality, samples=quality.samples or DEFAULT_SAMPLES)), folder, "scalar_rgb")


FORMATS: dict[str, Callable[[Scene, Path, Quality], Path]] = {
    "json": _json,
    "usd": _usd,
    "obj": _obj,
    "gltf": _gltf,
    "pbrt": _pbrt,
    "povray": _povray,
    "mitsuba": _mitsuba,
}
