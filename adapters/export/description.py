"""``scene.json``: a scene in plain numbers, for a renderer that has no reader for anything else.

Everything is in world space; matrices act on row vectors (p_world = p_local @ matrix) and are listed row by row.
A mesh lists its n-gons (``counts``, ``corners``) as they are, and the same cut into triangles (``triangles``): normals
and uv belong to face corners, so a triangle is three indices into ``corners``, ``normals`` and ``uv``. Texture files
hold linear values, row 0 at v = 1. The shading that is meant is written out in ``docs/your-renderer.md``.
"""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import Literal

import numpy as np

from notabug.scenes_usd.scene import Camera, Light, Material, Mesh, Object, Scene, Texture
from notabug.scenes_usd.triangulate import triangulate

VERSION = 1
SPLIT: Literal["02"] = "02"  # the diagonal by which n-gons are cut where a format has only triangles


_APART = ("path", "preview", "placing", "opacity_map", "cutoff")  # told otherwise, or only where there is one
_MATERIAL = tuple(each.name for each in fields(Material) if each.name not in _APART)


def describe(scene: Scene) -> dict[str, object]:
    """The scene as JSON's own types."""
    return {
        "notabug_scene": VERSION,
        "scene": scene.id,
        "variant": scene.variant,
        "width": scene.width,
        "height": scene.height,
        "camera": _camera(scene.camera),
        "lights": [{**_light(light, number), **_links(light, scene)} for number, light in enumerate(scene.lights)],
        "materials": [_material(material) for material in scene.materials],
        "textures": [_texture(index, each) for index, each in enumerate(scene.textures)],
        "objects": [_object(shape) for shape in scene.objects],
    }


def texture_name(index: int, suffix: str) -> str:
    """The file of a texture beside ``scene.json``; names of the original files never go into an export."""
    return f"image{index}{suffix}"


def _camera(camera: Camera) -> dict[str, object]:
    x, y, z, origin = camera.to_world[:, :3].tolist()
    return {
        "position": origin,
        "right": x,
        "up": y,
        "back": z,
        "tan_x": camera.tan_x,
        "tan_y": camera.tan_y,
        "near": camera.near,
        "far": camera.far,
        "shift_x": camera.shift_x,
        "shift_y": camera.shift_y,
        "orthographic": camera.orthographic,
    }


def sky_name(number: int) -> str:
    """The file of the picture of the dome with that number among the lights."""
    return f"sky{number}.pfm"


def _light(light: Light, number: int) -> dict[str, object]:
    said: dict[str, object] = {} if light.shadow_map is None else {"shadow_map": asdict(light.shadow_map)}
    said |= {name: factor for name in ("diffuse", "specular") if (factor := getattr(light, name)) != 1.0}
    if light.shaping is not None:
        said["beam"] = {"direction": list(light.direction), **asdict(light.shaping)}
    if light.emitter is not None:
        placed = {"position": list(light.position), "direction": list(light.direction)}
        shape = {"axes": light.emitter.axes.tolist(), "half_angle": light.emitter.half_angle}
        if light.emitter.texture is not None:
            said["picture"] = sky_name(number)
        return {"kind": light.kind, **placed, **shape, "radiance": list(light.intensity), **said}
    if light.kind == "point":
        return {"kind": "point", "position": list(light.position), "intensity": list(light.intensity), **said}
    return {"kind": "distant", "direction": list(light.direction), "irradiance": list(light.intensity), **said}


def _links(light: Light, scene: Scene) -> dict[str, object]:
    """The objects, by their places, that the light does not reach, and those that cast no shadow of it."""
    said = {"unlit": light.unlit, "unshadowing": light.unshadowing}
    return {
        name: [number for number, shape in enumerate(scene.objects) if shape.path in paths]
        for name, paths in said.items()
        if paths
    }


def _material(material: Material) -> dict[str, object]:
    said = {name: getattr(material, name) for name in _MATERIAL}
    if material.opacity_map >= 0:
        said |= {"opacity_map": material.opacity_map, "cutoff": material.cutoff}
    return said if material.preview is None else {**said, "preview": asdict(material.preview)}


def _texture(index: int, texture: Texture) -> dict[str, object]:
    height, width = texture.pixels.shape[:2]
    return {
        "pfm": texture_name(index, ".pfm"),
        "png": texture_name(index, ".png"),
        "width": width,
        "height": height,
        "wrap_s": texture.wrap_s,
        "wrap_t": texture.wrap_t,
    }


def _object(each: Object) -> dict[str, object]:
    if not isinstance(each, Mesh):
        return {
            "kind": "sphere",
            "material": each.material,
            "radius": each.radius,
            "to_world": np.asarray(each.to_world).tolist(),
        }
    said: dict[str, object] = {
        "kind": "mesh",
        "material": each.material,
        "points": each.points.tolist(),
        "counts": each.counts.tolist(),
        "corners": each.corners.tolist(),
        "triangles": triangulate(each, SPLIT).corner.tolist(),
    }
    if each.normals is not None:
        said["normals"] = each.normals.tolist()
    if each.uv is not None:
        said["uv"] = each.uv.tolist()
    return said
