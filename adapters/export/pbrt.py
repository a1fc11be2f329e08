"""pbrt-v4 scene text: camera, lights, spheres, triangles, ``diffuse`` materials. Written by its manual, not yet run.

Lobes, constant mirrors and glass without Fresnel's factors are not in pbrt: they are in ``scene.json`` only. Textures
are PFM, linear. Only numbers go into the text: names and paths of a stage never do.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.export.description import SPLIT, texture_name
from notabug.scenes_usd.scene import Camera, Light, Material, Mesh, Scene, Sphere
from notabug.scenes_usd.triangulate import triangulate


def write_pbrt(scene: Scene, folder: Path) -> Path:
    """``scene.pbrt`` in ``folder``; the textures' PFM files are expected beside it."""
    parts = [
        *_camera(scene.camera, scene.width, scene.height),
        'PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5',
        'Sampler "independent" "integer pixelsamples" 16',
        'Integrator "path" "integer maxdepth" 1',
        "WorldBegin",
        *(_light(light) for light in scene.lights),
        *(
            f'Texture "texture{index}" "spectrum" "imagemap" "string filename" "{texture_name(index, ".pfm")}" '
            f'"string encoding" "linear" "string filter" "bilinear" "string wrap" "{each.wrap_s}"'
            for index, each in enumerate(scene.textures)
        ),
        *(_material(index, each) for index, each in enumerate(scene.materials)),
    ]
    for each in scene.objects:
        shape = _mesh(each) if isinstance(each, Mesh) else _sphere(each)
        parts += ["AttributeBegin", f'NamedMaterial "material{each.material}"', *shape, "AttributeEnd"]
    target = folder / "scene.pbrt"
    target.write_text("\n".join(parts) + "\n", "ascii")
    return target


def _camera(camera: Camera, width: int, height: int) -> list[str]:
    """pbrt looks along +z with x to the right: a left-handed space, so the matrix mirrors. ``fov`` is the shorter
    side's.
    """
    axes = camera.to_world[:3, :3] * np.array([[1.0], [1.0], [-1.0]])
    to_camera = np.eye(4)
    to_camera[:3, :3] = axes.T
    to_camera[3, :3] = -camera.to_world[3, :3] @ axes.T
    x, y = camera.tan_x, camera.tan_y
    short = min(x, y)
    fov = math.degrees(2.0 * math.atan(short))
    right, up = x * camera.shift_x, y * camera.shift_y
    seen = np.array([right - x, right + x, up - y, up + y])
    lens = f'"perspective" "float fov" {fov!r} "float screenwindow" {_numbers(seen / short)}'
    if camera.orthographic:
        lens = f'"orthographic" "float screenwindow" {_numbers(seen)}'
    return [
        f"Transform {_numbers(to_camera)}",
        f"Camera {lens}",
        f'Film "rgb" "string filename" "picture.exr" "integer xresolution" {width} "integer yresolution" {height}',
    ]


def _light(light: Light) -> str:
    power = _numbers(np.asarray(light.intensity))
    if light.kind == "point":
        return f'LightSource "point" "rgb I" {power} "point3 from" {_numbers(np.asarray(light.position))}'
    start = _numbers(-np.asarray(light.direction))
    return f'LightSource "distant" "rgb L" {power} "point3 from" {start} "point3 to" [ 0 0 0 ]'


def _material(index: int, material: Material) -> str:
    colour = (
        f'"texture reflectance" "texture{material.texture}"'
        if material.texture >= 0
        else f'"rgb reflectance" {_numbers(np.asarray(material.diffuse))}'
    )
    return f'MakeNamedMaterial "material{index}" "string type" "diffuse" {colour}'


def _sphere(sphere: Sphere) -> list[str]:
    return [f"ConcatTransform {_numbers(sphere.to_world)}", f'Shape "sphere" "float radius" {float(sphere.radius)!r}']


def _mesh(mesh: Mesh) -> list[str]:
    corner = triangulate(mesh, SPLIT).corner.ravel()
    parts = [f'Shape "trianglemesh" "integer indices" {_numbers(np.arange(len(corner)))}']
    parts.append(f'"point3 P" {_numbers(mesh.points[mesh.corners[corner]])}')
    if mesh.normals is not None:
        parts.append(f'"normal N" {_numbers(mesh.normals[corner])}')
    if mesh.uv is not None:
        parts.append(f'"point2 uv" {_numbers(mesh.uv[corner])}')
    return parts


def _numbers(values: npt.NDArray[np.generic]) -> str:
    return f"[ {' '.join(map(repr, np.asarray(values).ravel().tolist()))} ]"
