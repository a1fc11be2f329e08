"""The process that Cycles runs in: ``python -P cycles_child.py FOLDER``; see ``child_job.py`` for what is in it.

Blender (bpy, GPL) is imported here and nowhere else, in a process and an environment of its own, which knows of notabug
nothing but the files beside this one. ``picture.npy`` is (seeds, h, w, 3). Each light is drawn alone, and the pictures
are added: Cycles chooses one light at random for each sample, which is noise that says nothing of any artifact.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager
    from types import ModuleType

    import numpy.typing as npt
    from bpy.types import Image, Mesh, Object, PointCloud, Scene

    from notabug.adapters.job_types import Arrays, CameraSaid, Job, ShapeSaid


def _beside(name: str) -> ModuleType:
    """The module ``name`` beside this file, which this environment does not know as a package's."""
    place = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert place is not None
    assert place.loader is not None
    module = importlib.util.module_from_spec(place)
    sys.modules[name] = module  # dataclasses and enumerations look here for where they are
    place.loader.exec_module(module)
    return module


if TYPE_CHECKING:
    from notabug.adapters import cycles_lights, cycles_nodes, cycles_surfaces
else:
    cycles_nodes, cycles_surfaces, cycles_lights = map(_beside, ("cycles_nodes", "cycles_surfaces", "cycles_lights"))

_SENSOR = 36.0  # Blender's, in millimetres; only its ratio to the focal length counts
_CROSSED = 64  # surfaces of some opacity behind one another


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _settings(scene, job)
    bodies = [_body(bpy, scene, index, shape, arrays, job) for index, shape in enumerate(job["objects"])]
    _camera(bpy, scene, job["camera"])
    pictures = np.zeros((len(job["seeds"]), job["height"], job["width"], 3))
    for place, (weight, drawn) in enumerate(_drawn(bpy, job, arrays, bodies)):
        with drawn:
            for number, seed in enumerate(job["seeds"]):
                scene.cycles.seed = (seed * 7919 + place) % (1 << 31)
                pictures[number] += weight * _render(bpy, scene, folder / "frame.exr", job)
    # one picture less another of the same light is negative where there is next to none, by the noise of both
    np.save(folder / "picture.npy", np.maximum(pictures, 0.0).astype(np.float32))


def _drawn(
    bpy: ModuleType, job: Job, arrays: Arrays, bodies: list[Object]
) -> Iterator[tuple[float, AbstractContextManager[None]]]:
    """Each picture that the whole is the sum of: its weight, and what puts up its light and its materials."""
    surfaces = cycles_surfaces.Surfaces(bpy, cycles_nodes, job, arrays)
    images: list[Image] = []

    def image(pixels: npt.NDArray[np.float32]) -> Image:
        images.append(cycles_surfaces.image(bpy, f"sky{len(images)}", pixels))
        return images[-1]

    lights = cycles_lights.Lights(bpy, cycles_nodes, job, arrays, _reach(job, arrays), image)
    places: dict[str, list[Object]] = {}
    for shape, body in zip(job["objects"], bodies, strict=True):
        places.setdefault(shape["path"], []).append(body)
    Part = cycles_surfaces.Part

    @contextmanager
    def put_up(part: cycles_surfaces.Part, index: int) -> Iterator[None]:
        said = job["lights"][index] if index >= 0 else None
        weighted = part in (Part.TAKEN, Part.TINTED)
        at_surface = weighted and said is not None and said["kind"] in ("point", "distant")
        looks = surfaces.of(part, said if at_surface else None)
        for shape, body in zip(job["objects"], bodies, strict=True):
            body.data.materials.clear()
            body.data.materials.append(looks[shape["material"]])
        lit = [] if said is None else lights.lit(index, fresnel=weighted and not at_surface, bodies=places)
        yield
        lights.put_out(lit)

    for index, light in enumerate(job["lights"]):
        diffuse, specular = light.get("diffuse", 1.0), light.get("specular", 1.0)
        if diffuse == specular:
            yield diffuse, put_up(Part.WHOLE, index)
        else:
            yield diffuse, put_up(Part.DIFFUSE, index)
            yield specular, put_up(Part.GLOSS, index)
        if surfaces.takes():
            yield -diffuse, put_up(Part.TAKEN, index)
        if surfaces.tints():
            yield specular, put_up(Part.TINTED, index)
    if surfaces.glows():
        yield 1.0, put_up(Part.GLOW, -1)


def _reach(job: Job, arrays: Arrays) -> tuple[float, float, float, float]:
    """The middle and the radius of a ball that holds every object and the camera."""
    points = [np.array([job["camera"]["to_world"][3][:3]])]
    for shape in job["objects"]:
        if shape["kind"] == "mesh":
            points.append(arrays[shape["points"]])
        else:
            middle, radius = _ball(shape)
            points += [middle + radius * np.eye(3), middle - radius * np.eye(3)]
    every = np.concatenate(points)
    low, high = every.min(axis=0), every.max(axis=0)
    x, y, z = ((low + high) / 2.0).tolist()
    return x, y, z, max(float(np.linalg.norm(high - low)) / 2.0, 1e-30)


def _render(bpy: ModuleType, scene: Scene, path: Path, job: Job) -> npt.NDArray[np.float32]:
    """One picture (h, w, 3), top row first, by way of a float32 EXR: Blender gives its result to nobody else."""
    scene.render.filepath = str(path.resolve())
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path.resolve()))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(job["width"] * job["height"] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    channels = image.channels
    bpy.data.images.remove(image)
    path.unlink()
    return pixels.reshape(job["height"], job["width"], channels)[::-1, :, :3]


def _settings(scene: Scene, job: Job) -> None:
    """Direct light only, neither filtered, denoised nor graded, into a float32 EXR."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    # The first sample of a pixel is its centre, whatever the seed and the filter. Alone it is what one sample is to be;
    # of several it would make seeds alike, and is left out.
    cycles.samples = samples = job["samples"] * job["on_a_light"]
    if samples > 1:
        cycles.samples += 1
        cycles.use_sample_subset, cycles.sample_offset, cycles.sample_subset_length = True, 1, samples
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_light_tree = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
    cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.transparent_max_bounces = _CROSSED
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    render = scene.render
    if job["threads"]:
        render.threads_mode, render.threads = "FIXED", job["threads"]
    render.resolution_x, render.resolution_y, render.resolution_percentage = job["width"], job["height"], 100
    render.dither_intensity = 0.0
    scene.view_settings.view_transform = "Raw"
    form = render.image_settings
    form.file_format, form.color_depth, form.color_mode, form.exr_codec = "OPEN_EXR", "32", "RGB", "ZIP"
    scene.world = None


def _body(bpy: ModuleType, scene: Scene, index: int, shape: ShapeSaid, arrays: Arrays, job: Job) -> Object:
    data = _points(bpy, shape) if shape["kind"] == "sphere" else _mesh(bpy, index, shape, arrays)
    body = bpy.data.objects.new(f"object{index}", data)
    scene.collection.objects.link(body)
    for owner in (body, body.cycles):
        for name, value in (
            ("shadow_terminator_geometry_offset", job["terminator_offset"]),
            ("shadow_terminator_normal_offset", 0.0),
            ("shadow_terminator_shading_offset", 0.0),
            ("shadow_terminator_offset", 0.0),
        ):
            if hasattr(owner, name):
                setattr(owner, name, value)
    return body


def _ball(shape: ShapeSaid) -> tuple[npt.NDArray[np.float64], float]:
    """The centre and the radius of a sphere, under a similarity."""
    matrix = np.array(shape["to_world"])
    return matrix[3, :3], shape["radius"] * float(np.linalg.norm(matrix[0, :3]))


def _points(bpy: ModuleType, shape: ShapeSaid) -> PointCloud:
    """A sphere as a cloud of one point: Cycles meets its rays with the sphere itself."""
    middle, radius = _ball(shape)
    cloud = bpy.data.pointclouds.new("sphere")
    cloud.resize(1)
    cloud.points[0].co = middle.tolist()
    cloud.points[0].radius = radius
    return cloud


def _mesh(bpy: ModuleType, index: int, shape: ShapeSaid, arrays: Arrays) -> Mesh:
    triangles = arrays[shape["triangles"]]
    corners = triangles.ravel()
    faces = arrays[shape["corners"]][corners].reshape(-1, 3)
    mesh = bpy.data.meshes.new(f"mesh{index}")
    mesh.from_pydata(arrays[shape["points"]].tolist(), [], faces.tolist())
    if len(mesh.polygons) != len(faces):
        sys.exit(f"Blender keeps {len(mesh.polygons)} of {len(faces)} triangles of object {index}")
    if "uv" in shape:
        uv = arrays[shape["uv"]][corners]
        layer = mesh.uv_layers.new(name="uv")
        layer.data.foreach_set("uv", np.ascontiguousarray(uv, np.float32).ravel())
        for name, vectors in _tangents(arrays[shape["points"]][faces], uv.reshape(-1, 3, 2)).items():
            tangents = mesh.attributes.new(name, "FLOAT_VECTOR", "FACE")
            tangents.data.foreach_set("vector", np.ascontiguousarray(vectors, np.float32).ravel())
    mesh.polygons.foreach_set("use_smooth", [("normals" in shape)] * len(mesh.polygons))
    if "normals" in shape:  # as vectors; normals_split_custom_set would round them to 16 bits
        normals = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", np.ascontiguousarray(arrays[shape["normals"]][corners], np.float32).ravel())
    mesh.update()
    return mesh


def _tangents(points: npt.NDArray[np.float64], uv: npt.NDArray[np.float64]) -> dict[str, npt.NDArray[np.float64]]:
    """The directions (n, 3) of dP/du and dP/dv on triangles of ``points`` (n, 3, 3) and ``uv`` (n, 3, 2)."""
    e1, e2 = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    (u1, v1), (u2, v2) = (uv[:, 1] - uv[:, 0]).T, (uv[:, 2] - uv[:, 0]).T
    sign = np.where(u1 * v2 < u2 * v1, -1.0, 1.0)[:, None]
    made = {
        "along": sign * (v2[:, None] * e1 - v1[:, None] * e2),
        "up": sign * (u1[:, None] * e2 - u2[:, None] * e1),
    }
    return {
        name: vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
        for name, vectors in made.items()
    }


def _camera(bpy: ModuleType, scene: Scene, said: CameraSaid) -> None:
    from mathutils import Matrix

    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL" if said["tan_x"] >= said["tan_y"] else "VERTICAL"
    camera.sensor_width = camera.sensor_height = _SENSOR
    camera.lens = 0.5 * _SENSOR / max(said["tan_x"], said["tan_y"])
    if said.get("orthographic"):
        camera.type, camera.ortho_scale = "ORTHO", 2.0 * max(said["tan_x"], said["tan_y"])
    # in parts of the longer side
    longer = max(said["tan_x"], said["tan_y"])
    camera.shift_x = 0.5 * said.get("shift_x", 0.0) * said["tan_x"] / longer
    camera.shift_y = 0.5 * said.get("shift_y", 0.0) * said["tan_y"] / longer
    camera.clip_start, camera.clip_end = said["near"], said["far"]
    body = bpy.data.objects.new("camera", camera)
    body.matrix_world = Matrix(np.array(said["to_world"]).T.tolist())
    scene.collection.objects.link(body)
    scene.camera = body


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # Blender takes seconds to end, and has nothing left to say
