"""A Scene as the job of a child script: plain numbers that a script can read without notabug.

A renderer may live in an environment of its own, with another Python and without notabug. Its child script is run by
its path as ``python -P SCRIPT FOLDER``, or by ``serve_child.py`` for all jobs of a process. It reads ``job.json`` and
``arrays.npz`` from the folder, with nothing but the standard library, numpy and the renderer, and writes
``picture.npy``, (h, w, 3) linear float32, top row first.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import cast

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Quality, Render
from notabug.adapters.job_folder import job_folder, picture_path
from notabug.adapters.job_types import (
    Arrays,
    BeamSaid,
    CameraBeside,
    Job,
    LightSaid,
    MaterialSaid,
    ShapeSaid,
    TextureSaid,
)
from notabug.adapters.kept import KeptChild, kept_child
from notabug.adapters.process import Ended, failure, made_picture, run_child
from notabug.adapters.textures import clear, plain_wraps
from notabug.scenes_usd.emitters import side
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Camera, Floats, Light, Material, Object, Scene, Sphere
from notabug.scenes_usd.triangulate import triangulate

Edit = Callable[[Job, Arrays], object]

_SERVE = "serve_child.py"
_APART = ("path", "preview", "placing", "opacity_map", "cutoff")  # told otherwise, or only where there is one
_MATERIAL = tuple(field.name for field in fields(Material) if field.name not in _APART)


@dataclass(frozen=True, slots=True)
class Script:
    """How the child script of the adapter ``name`` is run: the interpreter, the script beside this file, settings.

    ``edit`` is done to the job and its arrays before the script reads them: how faults are made. Where there are
    ``stays``, the script stays and does all jobs of this process, as in ``kept.py``: they are the words that follow it.
    One that is ``served`` stays too, and need not know of it.
    """

    name: str
    python: str
    script: str
    environment: Mapping[str, str]
    keep_jobs: bool = False
    edit: Edit | None = None
    stays: tuple[str, ...] = ()
    served: bool = False

    def render(
        self,
        scene: Scene,
        out: Path,
        quality: Quality,
        settings: Mapping[str, object],
        software: str,
        *,
        samples: int,
        seeds: tuple[int, ...] = (),
    ) -> tuple[Render, ...]:
        """The pictures that the script draws of ``scene``, as files in ``out``: for each of ``seeds`` one.

        Without seeds there is one picture, whatever the seed. The script is told ``samples`` and the seeds.
        """
        named = seeds or (quality.seeds or (0,))[:1]
        images = [picture_path(out, self.name, seed) for seed in named]
        told: dict[str, object] = {"samples": samples, "seeds": list(named), **settings}
        pixels, ended = self._draw(scene, out, quality, told, *([len(seeds)] if seeds else []))
        pictures = pixels.reshape(len(named), *pixels.shape[-3:])
        for image, picture in zip(images, pictures, strict=True):
            write_exr(image, picture, metadata={"Software": software})
        share = ended.seconds / len(named)
        return tuple(
            Render(image, seed, samples, share, ended.command, ended.log)
            for image, seed in zip(images, named, strict=True)
        )

    def _draw(
        self, scene: Scene, out: Path, quality: Quality, settings: Mapping[str, object], *pictures: int
    ) -> tuple[Floats, Ended]:
        """The picture (h, w, 3) that the script draws of ``scene``, and how the child ended.

        ``settings`` are added to the job. With a number of ``pictures`` the array is (pictures, h, w, 3). Raises
        RendererError where there is no picture, or one of another size.
        """
        plain, arrays = child_job(scene)
        document = cast(Job, {**plain, **settings})
        if self.edit is not None:
            self.edit(document, arrays)
        with job_folder(out, self.name, keep=self.keep_jobs) as folder:
            (folder / "job.json").write_text(json.dumps(document, allow_nan=False), "utf-8")
            np.savez(folder / "arrays.npz", allow_pickle=False, **arrays)
            ended = self._run(folder, quality.timeout).check(self.name)
            picture = made_picture(folder / "picture.npy", where=self.name, log=ended.log)
            pixels = np.load(picture, allow_pickle=False)
        if pixels.shape != (*pictures, scene.height, scene.width, 3):
            raise failure(f"a picture of shape {pixels.shape}", where=self.name, log=ended.log)
        return pixels, ended

    def child(self) -> KeptChild:
        """The child that stays."""
        words = (str(_beside(self.script)),) if self.served else self.stays
        script = _SERVE if self.served else self.script
        return kept_child((*self._command(script), *words), where=self.name, environment=self.environment)

    def _run(self, folder: Path, timeout: float) -> Ended:
        if self.stays or self.served:
            return self.child().do(folder, timeout=timeout)
        command = [*self._command(self.script), "."]
        return run_child(command, where=self.name, folder=folder, timeout=timeout, environment=self.environment)

    def _command(self, script: str) -> tuple[str, ...]:
        return self.python, "-P", str(_beside(script))


def _beside(script: str) -> Path:
    return Path(__file__).resolve().with_name(script)


def child_job(scene: Scene) -> tuple[Job, Arrays]:
    """The job's JSON document, and the arrays that it names.

    Everything is in world space and float64. Matrices act on row vectors. A mesh has its n-gons (``counts``,
    ``corners``) as they are, and the same cut along 0-2 (``triangles``, (t, 3)): normals and uv belong to face corners,
    so a triangle is three indices into ``corners``, ``normals`` and ``uv``. Textures repeat or are clamped.
    """
    scene = plain_wraps(scene)
    arrays: Arrays = {}
    return {
        "width": scene.width,
        "height": scene.height,
        "camera": {
            "to_world": scene.camera.to_world.tolist(),
            "tan_x": scene.camera.tan_x,
            "tan_y": scene.camera.tan_y,
            "near": scene.camera.near,
            "far": scene.camera.far,
            **_beside_the_axis(scene.camera),
        },
        "lights": [_light(index, light, arrays) for index, light in enumerate(scene.lights)],
        "materials": [_material(material) for material in scene.materials],
        "textures": _textures(scene, arrays),
        "objects": [_object(index, shape, arrays) for index, shape in enumerate(scene.objects)],
    }, arrays


def _material(material: Material) -> MaterialSaid:
    said = {name: getattr(material, name) for name in _MATERIAL}
    if material.preview is not None:
        said["preview"] = asdict(material.preview)
    return cast(MaterialSaid, said | clear(material))


def _beside_the_axis(camera: Camera) -> CameraBeside:
    if not (camera.orthographic or camera.shift_x or camera.shift_y):
        return {}
    return {"orthographic": camera.orthographic, "shift_x": camera.shift_x, "shift_y": camera.shift_y}


def _light(index: int, light: Light, arrays: Arrays) -> LightSaid:
    place = light.position if light.kind == "point" else light.direction
    said: LightSaid = {"kind": light.kind, "place": list(place), "intensity": list(light.intensity)}
    if light.is_plain:
        return said
    said |= {"position": list(light.position), "direction": list(light.direction)}
    said |= {"diffuse": light.diffuse, "specular": light.specular}
    said |= {"unlit": list(light.unlit), "unshadowing": list(light.unshadowing)}
    emitter = light.emitter
    if emitter is not None:
        said |= {"axes": emitter.axes.tolist(), "half_angle": emitter.half_angle}
        if light.kind in ("rect", "disk"):
            said["side"] = side(emitter).tolist()
        if emitter.texture is not None:
            said["sky"] = f"sky{index}"
            arrays[said["sky"]] = emitter.texture.pixels.astype(np.float32)
    if light.shaping is not None:
        said["beam"] = cast(BeamSaid, asdict(light.shaping))
    return said


def _textures(scene: Scene, arrays: Arrays) -> list[TextureSaid]:
    found: list[TextureSaid] = []
    for index, texture in enumerate(scene.textures):
        arrays[f"texture{index}"] = texture.pixels.astype(np.float32)
        found.append({"pixels": f"texture{index}", "wrap": (texture.wrap_s, texture.wrap_t)})
    return found


def _object(index: int, shape: Object, arrays: Arrays) -> ShapeSaid:
    if isinstance(shape, Sphere):
        return {
            "kind": "sphere",
            "path": shape.path,
            "material": shape.material,
            "radius": shape.radius,
            "to_world": shape.to_world.tolist(),
        }
    parts: dict[str, npt.NDArray[np.float64] | npt.NDArray[np.int32] | None] = {
        "points": shape.points,
        "counts": shape.counts,
        "corners": shape.corners,
        "triangles": triangulate(shape, "02").corner,
        "normals": shape.normals,
        "uv": shape.uv,
    }
    named = {part: f"{part}{index}" for part, array in parts.items() if array is not None}
    arrays |= {named[part]: np.ascontiguousarray(array) for part, array in parts.items() if array is not None}
    return cast(ShapeSaid, {"kind": "mesh", "path": shape.path, "material": shape.material, **named})
