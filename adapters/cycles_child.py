"""The process that Cycles runs in: ``python -P cycles_child.py FOLDER``; see ``child_job.py`` for what is in it.

Blender (bpy, GPL) is imported here and nowhere else, in a process and an environment of its own. ``picture.npy`` is
(seeds, h, w, 3). Each light is drawn alone, and the pictures are added: Cycles chooses one light at random for each
sample, which is noise that says nothing of any artifact.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from types import ModuleType

    import bpy
    import numpy.typing as npt

    from notabug.adapters.job_types import Arrays, CameraSaid, Job, LightSaid, ShapeSaid

_SENSOR = 36.0  # Blender's, in millimetres; only its ratio to the focal length counts
_CROSSED = 64  # surfaces of some opacity behind one another


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _settings(bpy, scene, job)
    looks = [_look(bpy, job, index, arrays) for index in range(len(job["materials"]))]
    for index, shape in enumerate(job["objects"]):
        _mesh(bpy, scene, index, shape, arrays, looks, job["terminator_offset"])
    lights = [_light(bpy, scene, index, light) for index, light in enumerate(job["lights"])]
    _camera(bpy, scene, job["camera"])
    pictures = np.zeros((len(job["seeds"]), job["height"], job["width"], 3))
    for number, seed in enumerate(job["seeds"]):
        for place, light in enumerate(lights):
            for other in lights:
                other.hide_render = other is not light
            scene.cycles.seed = (seed * 7919 + place) % (1 << 31)
            pictures[number] += _render(bpy, scene, folder / "frame.exr", job)
    np.save(folder / "picture.npy", pictures.astype(np.float32))


def _render(bpy: ModuleType, scene: bpy.types.Scene, path: Path, job: Job) -> npt.NDArray[np.float32]:
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


def _settings(bpy: ModuleType, scene: bpy.types.Scene, job: Job) -> None:
    """Direct light only, neither filtered, denoised nor graded, into a float32 EXR."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    # The first sample of a pixel is its centre, whatever the seed and the filter. Alone it is what one sample is to be;
    # of several it would make seeds alike, and is left out.
    cycles.samples = job["samples"]
    if job["samples"] > 1:
        cycles.samples += 1
        cycles.use_sample_subset, cycles.sample_offset, cycles.sample_subset_length = True, 1, job["samples"]
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
    scene.world = bpy.data.worlds.new("world")
    if scene.world.node_tree is not None:
        for node in scene.world.node_tree.nodes:
            if node.type == "BACKGROUND":
                node.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
                node.inputs["Strength"].default_value = 0.0
    else:
        scene.world.color = (0.0, 0.0, 0.0)


def _look(bpy: ModuleType, job: Job, index: int, arrays: Arrays) -> bpy.types.Material:
    """A Lambert surface, and where it has an opacity a mixture of it and nothing."""
    said = job["materials"][index]
    look = bpy.data.materials.new(f"material{index}")
    if look.node_tree is None:
        look.use_nodes = True
    tree = look.node_tree
    tree.nodes.clear()
    out, surface = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Roughness"].default_value = 0.0
    surface.inputs["Color"].default_value = (*said["diffuse"], 1.0)
    if said["texture"] >= 0:
        texture = job["textures"][said["texture"]]
        node, uv = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeUVMap")
        node.image = _image(bpy, f"texture{index}", arrays[texture["pixels"]])
        node.interpolation = "Linear"
        node.extension = "EXTEND" if texture["wrap"][0] == "clamp" else "REPEAT"
        uv.uv_map = "uv"
        tree.links.new(uv.outputs[0], node.inputs[0])
        tree.links.new(node.outputs[0], surface.inputs["Color"])
    shown = surface.outputs[0]
    if said["opacity"] < 1.0:
        nothing, mixture = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
        mixture.inputs[0].default_value = said["opacity"]
        tree.links.new(nothing.outputs[0], mixture.inputs[1])
        tree.links.new(shown, mixture.inputs[2])
        shown = mixture.outputs[0]
    tree.links.new(shown, out.inputs[0])
    return look


def _image(bpy: ModuleType, name: str, pixels: npt.NDArray[np.float32]) -> bpy.types.Image:
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, float_buffer=True, is_data=True)
    whole = np.ones((height, width, 4), np.float32)
    whole[..., :3] = pixels[::-1]
    image.pixels.foreach_set(whole.ravel())
    image.update()
    return image


def _mesh(
    bpy: ModuleType,
    scene: bpy.types.Scene,
    index: int,
    shape: ShapeSaid,
    arrays: Arrays,
    looks: list[bpy.types.Material],
    offset: float,
) -> None:
    corners = arrays[shape["triangles"]].ravel()
    faces = arrays[shape["corners"]][corners].reshape(-1, 3)
    mesh = bpy.data.meshes.new(f"mesh{index}")
    mesh.from_pydata(arrays[shape["points"]].tolist(), [], faces.tolist())
    if len(mesh.polygons) != len(faces):
        sys.exit(f"Blender keeps {len(mesh.polygons)} of {len(faces)} triangles of object {index}")
    if "uv" in shape:
        layer = mesh.uv_layers.new(name="uv")
        layer.data.foreach_set("uv", np.ascontiguousarray(arrays[shape["uv"]][corners], np.float32).ravel())
    mesh.polygons.foreach_set("use_smooth", [("normals" in shape)] * len(mesh.polygons))
    if "normals" in shape:  # as vectors; normals_split_custom_set would round them to 16 bits
        normals = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", np.ascontiguousarray(arrays[shape["normals"]][corners], np.float32).ravel())
    mesh.materials.append(looks[shape["material"]])
    mesh.update()
    body = bpy.data.objects.new(f"object{index}", mesh)
    scene.collection.objects.link(body)
    for owner in (body, body.cycles):
        for name, value in (
            ("shadow_terminator_geometry_offset", offset),
            ("shadow_terminator_normal_offset", 0.0),
            ("shadow_terminator_shading_offset", 0.0),
            ("shadow_terminator_offset", 0.0),
        ):
            if hasattr(owner, name):
                setattr(owner, name, value)


def _light(bpy: ModuleType, scene: bpy.types.Scene, index: int, said: LightSaid) -> bpy.types.Object:
    """A lamp of Blender sends out its energy over 4 pi; a sun's energy is its irradiance."""
    from mathutils import Matrix

    colour = np.array(said["intensity"])
    most = float(colour.max())
    light = bpy.data.lights.new(f"light{index}", "POINT" if said["kind"] == "point" else "SUN")
    light.color = (colour / most).tolist() if most > 0.0 else (0.0, 0.0, 0.0)
    light.cycles.use_multiple_importance_sampling = False
    place = np.eye(4)
    if said["kind"] == "point":
        light.energy = most * 4.0 * math.pi
        light.shadow_soft_size = 0.0
        if hasattr(light, "use_soft_falloff"):
            light.use_soft_falloff = False
        place[:3, 3] = said["place"]
    else:
        light.energy = most
        light.angle = 0.0
        z = -np.array(said["place"])
        x = np.cross((0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (1.0, 0.0, 0.0), z)
        x /= np.linalg.norm(x)
        place[:3, 0], place[:3, 1], place[:3, 2] = x, np.cross(z, x), z
    body = bpy.data.objects.new(f"light{index}", light)
    body.matrix_world = Matrix(place.tolist())
    scene.collection.objects.link(body)
    return body


def _camera(bpy: ModuleType, scene: bpy.types.Scene, said: CameraSaid) -> None:
    from mathutils import Matrix

    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL" if said["tan_x"] >= said["tan_y"] else "VERTICAL"
    camera.sensor_width = camera.sensor_height = _SENSOR
    camera.lens = 0.5 * _SENSOR / max(said["tan_x"], said["tan_y"])
    camera.clip_start, camera.clip_end = said["near"], said["far"]
    body = bpy.data.objects.new("camera", camera)
    body.matrix_world = Matrix(np.array(said["to_world"]).T.tolist())
    scene.collection.objects.link(body)
    scene.camera = body


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # Blender takes seconds to end, and has nothing left to say
