"""A Scene as a job for the Mitsuba child: a JSON document, and arrays that it names.

What Mitsuba does, measured with 3.9.1, and what is written for it:

- Camera: the USD matrix as column vectors with columns 0 and 2 negated; ``fov`` = 2 atan(tan_x) along x; pixels are
  square.
- Light: ``point`` takes the radiant intensity I, ``directional`` the irradiance at normal incidence; no factor.
- A mesh gets one vertex per face corner, so that normals and uv may differ between faces; v is flipped.
- ``mask`` opacity: ``direct`` and ``path`` are wrong (a sheet of opacity 0.5 hides what is behind it, and its shadow is
  opaque; in the scalar variants ``path`` also squares the opacity). ``volpath`` of depth 2 composites right, attenuates
  shadows, and adds no interreflection; with depth 4 it adds 2 %.
- A ``sphere`` has a centre and a radius: only rotated, moved and uniformly scaled ones can be said.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.textures import Grown, grow, shown_uv
from notabug.scenes_usd.scene import Camera, Light, Scene, Sphere
from notabug.scenes_usd.triangulate import triangulate

Arrays = dict[str, npt.NDArray[Any]]
_SIMILAR = 1e-6  # relative deviation from a similarity, or from square pixels, that float32 cannot show


def job(scene: Scene, quality: Quality) -> tuple[dict[str, Any], Arrays]:
    """The job's JSON document and its arrays; ``quality.samples`` is already the adapter's own choice."""
    arrays: Arrays = {}
    transparent = any(scene.materials[each.material].opacity < 1.0 for each in scene.objects)
    if transparent and quality.samples == 1:
        raise UnsupportedError(
            "Mitsuba chooses at random whether a ray passes a transparent surface",
            where="adapter 'mitsuba'",
            expected="more than 1 sample per pixel for a scene with opacity below 1",
            got="1",
            do="raise the samples",
        )
    return {
        "width": scene.width,
        "height": scene.height,
        "samples": quality.samples,
        "seeds": [0] if quality.samples == 1 else list(quality.seeds),
        "threads": quality.threads,
        "integrator": "volpath" if transparent else "direct",
        "camera": _camera(scene.camera, scene.width / scene.height),
        "lights": [_light(each) for each in scene.lights],
        "textures": _textures(scene, arrays),
        "objects": [_object(scene, index, arrays) for index in range(len(scene.objects))],
    }, arrays


def _camera(camera: Camera, aspect: float) -> dict[str, Any]:
    if abs(camera.tan_y * aspect / camera.tan_x - 1.0) > _SIMILAR:
        raise UnsupportedError(
            "Mitsuba's pixels are square",
            where=camera.path,
            expected=f"an aperture {aspect:g} times as wide as high",
            got=f"{camera.tan_x / camera.tan_y:g}",
        )
    to_world = camera.to_world.T * np.array([-1.0, 1.0, -1.0, 1.0])
    fov = math.degrees(2.0 * math.atan(camera.tan_x))
    return {"to_world": to_world.tolist(), "fov": fov, "near": camera.near, "far": camera.far}


def _light(light: Light) -> dict[str, Any]:
    power = {"type": "rgb", "value": list(light.intensity)}
    if light.kind == "point":
        return {"type": "point", "position": list(light.position), "intensity": power}
    return {"type": "directional", "direction": list(light.direction), "irradiance": power}


def _wrapping(scene: Scene, index: int) -> tuple[str, Grown | None]:
    """The wrap mode of the texture ``index``, the same for both axes; where they differ, ``repeat`` on a grown one."""
    texture = scene.textures[index]
    uv = shown_uv(scene, index)
    if texture.wrap_s == texture.wrap_t:
        return texture.wrap_s, None
    return "repeat", grow(texture, uv)


def _textures(scene: Scene, arrays: Arrays) -> dict[str, dict[str, Any]]:
    found = {}
    for index in sorted({scene.materials[each.material].texture for each in scene.objects} - {-1}):
        wrap, grown = _wrapping(scene, index)
        arrays[f"texture{index}"] = (grown.pixels if grown else scene.textures[index].pixels).astype(np.float32)
        found[str(index)] = {"pixels": f"texture{index}", "wrap": wrap}
    return found


def _object(scene: Scene, index: int, arrays: Arrays) -> dict[str, Any]:
    each = scene.objects[index]
    material = scene.materials[each.material]
    look = {"diffuse": list(material.diffuse), "texture": material.texture, "opacity": material.opacity}
    if isinstance(each, Sphere):
        return {"kind": "sphere", "look": look, **_sphere(each)}
    said: dict[str, Any] = {"kind": "mesh", "look": look}
    corner = triangulate(each, "02").corner.ravel()
    parts: Arrays = {"points": each.points[each.corners[corner]]}
    if each.normals is not None:
        parts["normals"] = each.normals[corner]
    if each.uv is not None and material.texture >= 0:
        grown = _wrapping(scene, material.texture)[1]
        uv = (each.uv * grown.a + grown.b if grown else each.uv)[corner]
        parts["uv"] = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)
    for part, array in parts.items():
        said[part] = f"{part}{index}"
        arrays[said[part]] = np.ascontiguousarray(array, np.float32)
    return said


def _sphere(sphere: Sphere) -> dict[str, Any]:
    linear = sphere.to_world[:3, :3]
    square = linear @ linear.T
    scale = float(np.trace(square)) / 3.0
    if np.abs(square - scale * np.eye(3)).max() > _SIMILAR * scale:
        raise UnsupportedError(
            "a sphere that is scaled unevenly or sheared",
            where=sphere.path,
            expected="rotation, translation and uniform scale",
            do="use a renderer with ellipsoids (povray), or a mesh",
        )
    return {"centre": sphere.to_world[3, :3].tolist(), "radius": sphere.radius * math.sqrt(scale)}
