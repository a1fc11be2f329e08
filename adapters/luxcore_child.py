"""The process that LuxCore runs in: ``python -P luxcore_child.py FOLDER``; see ``child_job.py`` for what is in it.

``picture.npy`` is (seeds, h, w, 3). Each light is drawn alone, and the pictures are added: LuxCore chooses one light at
random for each sample, which is noise that says nothing of any artifact.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np  # before pyluxcore, whose allocator would be given memory that numpy's libraries got from another

if TYPE_CHECKING:
    from types import ModuleType

    import numpy.typing as npt
    import pyluxcore

    from notabug.adapters.job_types import Arrays, Job, LightSaid, MaterialSaid, ShapeSaid

    Properties = dict[str, object]

_HIGHEST_SEED = 1 << 31
_PAUSE = 0.005  # seconds between two looks at a session
_ALL = 64  # paths are never ended by chance within so many bounces
_FARTHEST = 10.0  # times the camera's far distance: beyond it nothing is looked for


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    import pyluxcore

    pyluxcore.Init(_tell)
    print(f"LuxCore {pyluxcore.Version()}")
    scene = pyluxcore.Scene()
    described = _named("camera", _camera(job))
    for index, texture in enumerate(job["textures"]):
        pixels = np.ascontiguousarray(arrays[texture["pixels"]], np.float32)
        scene.DefineImageMap(f"image{index}", pixels, 1.0, 3, pixels.shape[1], pixels.shape[0])
    brightest = _brightest(job, arrays)
    for index, material in _used(job).items():
        described |= _look(index, material, brightest)
    for index, shape in enumerate(job["objects"]):
        _mesh(scene, index, shape, arrays)
        described |= _named(f"objects.o{index}", {"shape": f"mesh{index}", "material": f"m{shape['material']}"})
    scene.Parse(_properties(pyluxcore, _named("scene", described)))
    pictures = np.zeros((len(job["seeds"]), job["height"], job["width"], 3))
    for place, light in enumerate(job["lights"]):
        if not any(light["intensity"]):
            continue
        told = _named("scene.lights.light", _light(light, brightest))  # in the place of the one before
        scene.Parse(_properties(pyluxcore, told))
        for number, seed in enumerate(job["seeds"]):
            settings = _settings(job, 1 + (seed * 7919 + place) % (_HIGHEST_SEED - 1))
            pictures[number] += _render(pyluxcore, scene, settings, job["width"], job["height"])
    np.save(folder / "picture.npy", pictures.astype(np.float32))


def _tell(line: str) -> None:
    """What LuxCore reports: warnings and errors are kept, the rest is a page for every picture."""
    if "warning" in line.lower() or "error" in line.lower():
        print(line)


def _properties(pyluxcore: ModuleType, values: Properties) -> pyluxcore.Properties:
    made = pyluxcore.Properties()
    for name, value in values.items():
        made.Set(pyluxcore.Property(name, value if isinstance(value, list) else [value]))
    return made


def _render(
    pyluxcore: ModuleType, scene: pyluxcore.Scene, settings: Properties, width: int, height: int
) -> npt.NDArray[np.float32]:
    """One picture (h, w, 3), top row first: the radiance on LuxCore's film."""
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(_properties(pyluxcore, settings), scene))
    session.Start()
    while not session.HasDone():
        session.UpdateStats()
        time.sleep(_PAUSE)
    session.Stop()
    film = session.GetFilm()
    counts, pixels = np.zeros(width * height, np.uint32), np.zeros(width * height * 3, np.float32)
    film.GetOutputUInt(pyluxcore.FilmOutputType.SAMPLECOUNT, counts, 0)
    film.GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels, 0)
    if not counts.all():
        sys.exit(f"LuxCore gave {(counts == 0).sum()} pixels no sample")
    return pixels.reshape(height, width, 3)[::-1]


def _settings(job: Job, seed: int) -> Properties:
    """Direct light alone, seen directly or in mirrors, neither filtered, clamped nor denoised.

    A path's last surface is lit only where it is its first too. So where there are mirrors a path may meet one diffuse
    surface more, which is not lit then; and what a diffuse surface throws on to others is never seen.
    """
    materials = _used(job).values()
    mirrors = job["bounces"] if any(any(material["mirror"]) for material in materials) else 0
    chance = any(material["opacity"] < 1.0 or 0.0 < _mirror_share(material) < 1.0 for material in materials)
    settings = {
        "renderengine.type": "PATHCPU",
        "renderengine.seed": seed,
        "sampler.type": "RANDOM" if chance else "SOBOL",  # whose choices are noisier than random ones
        "sampler.random.adaptive.strength": 0.0,
        "sampler.sobol.adaptive.strength": 0.0,
        "path.pathdepth.total": mirrors + 2 if mirrors else 1,
        "path.pathdepth.diffuse": 2 if mirrors else 1,
        "path.pathdepth.glossy": 1,
        "path.pathdepth.specular": mirrors + 1,
        "path.russianroulette.depth": _ALL,
        "path.clamping.variance.maxvalue": 0.0,
        "path.forceblackbackground.enable": True,
        "path.hybridbackforward.enable": False,
        "lightstrategy.type": "UNIFORM",
        "batch.haltspp": job["samples"] + 1,  # it halts at a mean, when some pixels have one sample less
        "film.width": job["width"],
        "film.height": job["height"],
        "film.filter.type": "NONE",
        "film.noiseestimation.warmup": 0,
        "film.imagepipelines.0.0.type": "NOP",
        "film.outputs.0.type": "RGB",
        "film.outputs.0.filename": "rgb.exr",
        "film.outputs.1.type": "SAMPLECOUNT",
        "film.outputs.1.filename": "samples.exr",
    }
    return settings | ({"native.threads.count": job["threads"]} if job["threads"] else {})


def _camera(job: Job) -> Properties:
    """The window on the plane at distance 1, in units of the field of view's half, which is the smaller of the two.

    LuxCore draws what belongs into a row one row below it: its window is moved by ``raised`` rows.
    """
    said = job["camera"]
    _, up, back, eye = np.array(said["to_world"])[:, :3]
    least = min(said["tan_x"], said["tan_y"])
    wide, high = said["tan_x"] / least, said["tan_y"] / least
    moved = -2.0 * high * job["raised"] / job["height"]
    away = max(1.0, float(np.linalg.norm(eye)))  # so far off the target's rounding to float32 does not turn the camera
    return {
        "type": "perspective",
        "lookat.orig": eye.tolist(),
        "lookat.target": (eye - away * back).tolist(),
        "up": up.tolist(),
        "fieldofview": 2.0 * math.degrees(math.atan(least)),
        "screenwindow": [-wide, wide, moved - high, moved + high],
        "cliphither": said["near"],
        "clipyon": _FARTHEST * said["far"],
        "lensradius": 0.0,
        "autofocus.enable": False,
    }


def _light(said: LightSaid, gain: float) -> Properties:
    """A point's gain is its power, 4 pi times its intensity; a distant light's its irradiance."""
    strength, white = gain * np.array(said["intensity"]), {"color": [1.0, 1.0, 1.0]}
    if said["kind"] == "distant":
        return white | {"type": "sharpdistant", "direction": said["place"], "gain": strength.tolist()}
    unscaled = {"power": 0.0, "efficency": 0.0}  # LuxCore's spelling
    point = {"type": "point", "position": said["place"], "gain": (4.0 * math.pi * strength).tolist()}
    return white | unscaled | point


def _used(job: Job) -> dict[int, MaterialSaid]:
    """The materials of objects, by their numbers."""
    return {index: job["materials"][index] for index in sorted({shape["material"] for shape in job["objects"]})}


def _mirror_share(said: MaterialSaid) -> float:
    """The share of a mixture that is its mirror: LuxCore clamps the colours of its parts to 1."""
    return 1.0 if any(said["mirror"]) and _black(said) else float(max(said["mirror"]))


def _black(said: MaterialSaid) -> bool:
    return said["texture"] < 0 and not any(said["diffuse"])


def _brightest(job: Job, arrays: Arrays) -> float:
    """The largest diffuse colour that a part of any material would have, if it is above 1.

    LuxCore clamps those colours to 1, too. All are divided by it, and lights are made as much brighter: what is seen
    has met one diffuse surface, no more and no less.
    """
    most = 1.0
    for said in _used(job).values():
        if not _black(said):
            texture = said["texture"]
            colours = said["diffuse"] if texture < 0 else arrays[job["textures"][texture]["pixels"]]
            most = max(most, float(np.max(colours)) / (1.0 - _mirror_share(said)))
    return most


def _look(index: int, said: MaterialSaid, brightest: float) -> Properties:
    """The material ``m<index>``: a Lambert surface, a mirror, or a mixture of the two, which weights its parts."""
    share = _mirror_share(said)
    gain = 1.0 / (brightest * (1.0 - share)) if share < 1.0 else 0.0
    matte: Properties = {"type": "matte", "kd": [part * gain for part in said["diffuse"]]}
    mirror: Properties = {"type": "mirror", "kr": [part / share for part in said["mirror"]]} if share else {}
    look: Properties = {}
    if said["texture"] >= 0:
        matte["kd"] = f"t{index}"
        image = {"type": "imagemap", "file": f"image{said['texture']}", "gamma": 1.0, "gain": gain}
        look |= _named(f"textures.t{index}", image | {"mapping.type": "uvmapping2d"})
    shown = matte if share == 0.0 else mirror
    if 0.0 < share < 1.0:
        look |= _named(f"materials.matte{index}", matte) | _named(f"materials.mirror{index}", mirror)
        shown = {"type": "mix", "material1": f"matte{index}", "material2": f"mirror{index}", "amount": share}
    if said["opacity"] < 1.0:
        shown["transparency"] = said["opacity"]
    return look | _named(f"materials.m{index}", shown)


def _named(name: str, values: Properties) -> Properties:
    return {f"{name}.{part}": value for part, value in values.items()}


def _mesh(scene: pyluxcore.Scene, index: int, shape: ShapeSaid, arrays: Arrays) -> None:
    """One vertex for each corner of the triangles, since normals and uv belong to corners. LuxCore's v grows down."""
    corners = arrays[shape["triangles"]].ravel()
    points = _rows(arrays[shape["points"]][arrays[shape["corners"]][corners]])
    faces = _rows(np.arange(len(corners)).reshape(-1, 3))
    normals = _rows(arrays[shape["normals"]][corners]) if "normals" in shape else None
    uv = _rows(arrays[shape["uv"]][corners] * [1.0, -1.0] + [0.0, 1.0]) if "uv" in shape else None
    scene.DefineMesh(f"mesh{index}", points, faces, normals, uv, None, None)


def _rows(values: npt.NDArray[np.floating] | npt.NDArray[np.integer]) -> list[tuple[float, ...]]:
    return [tuple(row) for row in values.tolist()]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # LuxCore may crash when Python takes it down, after the picture has been written
