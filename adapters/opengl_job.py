"""A Scene as a job for the OpenGL child: a JSON document, and arrays that it names.

The child's programs take what this file says: positions in world space, a view and a projection kept apart (Upchurch
and Desbrun 2012: multiplied together they cost precision), one vertex per triangle corner, all of it float32.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from notabug.adapters.job_types import Arrays, GlJob, GlLight, GlShape, GlTexture
from notabug.scenes_usd.scene import Camera, Light, Mesh, Scene, Wrap
from notabug.scenes_usd.triangulate import triangulate

DepthFormat = Literal["fixed16", "fixed24", "float32", "reversed32"]
Interpolation = Literal["phong", "gouraud", "flat"]


def job(scene: Scene, depth: DepthFormat, grid: int, interpolation: Interpolation = "phong") -> tuple[GlJob, Arrays]:
    """The job's JSON document and its arrays; ``grid`` x ``grid`` samples are drawn for each pixel."""
    if interpolation == "flat":
        scene = replace(scene, objects=tuple(replace(each, normals=None) for each in scene.meshes))
    arrays: Arrays = {}
    used = {shape.material for shape in scene.objects}
    return {
        "width": scene.width,
        "height": scene.height,
        "grid": grid,
        "depth": depth,
        "eye": scene.camera.to_world[3, :3].tolist(),
        "view": np.linalg.inv(scene.camera.to_world).tolist(),
        "projection": projection(scene.camera, reverse=depth == "reversed32").tolist(),
        "transparent": any(scene.materials[each].opacity < 1.0 for each in used),
        "lights": [_light(light) for light in scene.lights],
        "textures": _textures(scene, arrays),
        "objects": [
            _object(scene, index, mesh, arrays, gouraud=interpolation == "gouraud" and mesh.normals is not None)
            for index, mesh in enumerate(scene.meshes)
        ],
    }, arrays


def projection(camera: Camera, *, reverse: bool) -> npt.NDArray[np.float64]:
    """Eye space to clip space, (4, 4) for row vectors: z/w from -1 at near to 1 at far, or reversed from 1 to 0."""
    n, f = camera.near, camera.far
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1], matrix[2, 3] = 1.0 / camera.tan_x, 1.0 / camera.tan_y, -1.0
    matrix[2, 0], matrix[2, 1] = camera.shift_x, camera.shift_y
    if reverse:
        matrix[2, 2], matrix[3, 2] = n / (f - n), n * f / (f - n)
    else:
        matrix[2, 2], matrix[3, 2] = -(f + n) / (f - n), -2.0 * n * f / (f - n)
    return matrix


def _light(light: Light) -> GlLight:
    place = light.position if light.kind == "point" else tuple(-x for x in light.direction)
    return {"distant": light.kind == "distant", "place": list(place), "power": list(light.intensity)}


_WRAPS: dict[Wrap, int] = {"repeat": 0, "clamp": 1, "mirror": 2, "black": 3}  # as the shader has them


def _textures(scene: Scene, arrays: Arrays) -> dict[str, GlTexture]:
    found: dict[str, GlTexture] = {}
    for index in sorted({scene.materials[shape.material].texture for shape in scene.objects} - {-1}):
        texture = scene.textures[index]
        arrays[f"texture{index}"] = texture.pixels.astype(np.float32)
        found[str(index)] = {"pixels": f"texture{index}", "wrap": [_WRAPS[texture.wrap_s], _WRAPS[texture.wrap_t]]}
    return found


def _object(scene: Scene, index: int, mesh: Mesh, arrays: Arrays, *, gouraud: bool) -> GlShape:
    """Vertices (3 t, 8) of the mesh's triangles: position, normal, uv; a mesh without normals gets its facets'."""
    cut = triangulate(mesh, "02")
    corner = cut.corner.ravel()
    if mesh.normals is None:
        facet = np.cross(cut.points[:, 1] - cut.points[:, 0], cut.points[:, 2] - cut.points[:, 0])
        length = np.linalg.norm(facet, axis=1, keepdims=True)
        normals = np.repeat(facet / np.where(length > 0.0, length, 1.0), 3, axis=0)
    else:
        normals = mesh.normals[corner]
    uv = np.zeros((len(corner), 2)) if mesh.uv is None else mesh.uv[corner]
    name = f"vertices{index}"
    arrays[name] = np.hstack([cut.points.reshape(-1, 3), normals, uv]).astype(np.float32)
    material = scene.materials[mesh.material]
    lobe = 0
    if any(material.specular):
        lobe = (1 if material.lobe == "phong" else 2) + 2 * material.cosine_weighted
    return {
        "vertices": name,
        "gouraud": gouraud,
        "diffuse": list(material.diffuse),
        "texture": material.texture,
        "specular": list(material.specular),
        "exponent": material.exponent,
        "lobe": lobe,
        "opacity": material.opacity,
    }
