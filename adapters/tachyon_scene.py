"""A Scene as the text of a Tachyon scene file. Only numbers go into it, never a name from the scene."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from notabug.adapters.base import UnsupportedError
from notabug.adapters.spheres import centre_and_radius
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Camera, Light, Material, Mesh, Scene, Sphere
from notabug.scenes_usd.triangulate import triangulate

_SQUARE = 1e-6  # relative deviation from square pixels: one that 16 bits cannot show
RAY_DEPTH = 64  # surfaces of some opacity behind one another


def scene_text(scene: Scene, width: int, height: int, *, gain: float, attenuation: float) -> str:
    """The scene in a picture of ``width`` x ``height``, with every light multiplied by ``gain``.

    The attenuation of point lights is multiplied by ``attenuation``, and so is their colour.
    """
    parts = ["begin_scene", f"resolution {width} {height}", *_camera(scene.camera, width / height), "background 0 0 0"]
    parts += [_light(light, gain, attenuation) for light in scene.lights]
    for shape in scene.objects:
        look = _look(scene.materials[shape.material])
        if isinstance(shape, Sphere):
            centre, radius = centre_and_radius(shape)
            parts.append(f"sphere center {_numbers(centre)} rad {_numbers([radius])} {look}")
        else:
            parts += _mesh(shape, look)
    return "\n".join([*parts, "end_scene", ""])


def _camera(camera: Camera, aspect: float) -> Iterator[str]:
    """Tachyon's image plane is 1 high at the distance of the zoom, and its pixels are square."""
    if abs(camera.tan_y * aspect / camera.tan_x - 1.0) > _SQUARE:
        raise UnsupportedError(
            "Tachyon's pixels are square",
            where=camera.path,
            expected=f"an aperture {aspect:g} times as wide as high",
            got=f"{camera.tan_x / camera.tan_y:g}",
        )
    yield "camera"
    yield "projection perspective"
    yield f"zoom {_numbers([0.5 / camera.tan_y])}"
    yield "aspectratio 1.0"
    yield "antialiasing 0"
    yield f"raydepth {RAY_DEPTH}"
    yield f"center {_numbers(camera.to_world[3, :3])}"
    yield f"viewdir {_numbers(-camera.to_world[2, :3])}"
    yield f"updir {_numbers(camera.to_world[1, :3])}"
    yield "end_camera"


def _light(light: Light, gain: float, attenuation: float) -> str:
    """Lambert's radiance in Tachyon is colour * light * N.L: the division by pi is the light's.

    A light is a ball that can be seen, and one round the eye would hide the scene: its radius is 0.
    """
    colour = np.array(light.intensity) * gain / np.pi
    if light.kind == "distant":
        return f"directional_light direction {_numbers(light.direction)} color {_numbers(colour)}"
    return (
        f"light center {_numbers(light.position)} rad 0.0 attenuation constant 0.0 linear 0.0 "
        f"quadratic {_numbers([attenuation])} color {_numbers(colour * attenuation)}"
    )


def _look(material: Material) -> str:
    parts = [f"texture ambient 0 diffuse 1 specular 0 opacity {_numbers([material.opacity])}"]
    if any(material.specular):
        parts.append(f"phong plastic {_numbers([max(material.specular)])} phong_size {_numbers([material.exponent])}")
    return " ".join([*parts, f"color {_numbers(material.diffuse)} texfunc 0"])


def _mesh(mesh: Mesh, look: str) -> Iterator[str]:
    cut = triangulate(mesh, "02")
    normals = None if mesh.normals is None else mesh.normals[cut.corner]
    for index, corners in enumerate(cut.points):
        places = " ".join(f"v{k} {_numbers(corner)}" for k, corner in enumerate(corners))
        if normals is None:
            yield f"tri {places} {look}"
        else:
            turned = " ".join(f"n{k} {_numbers(normal)}" for k, normal in enumerate(normals[index]))
            yield f"stri {places} {turned} {look}"


def _numbers(values: Iterable[float]) -> str:
    """Numbers in full. Never ``repr``, which writes ``np.float64(1.0)`` for NumPy's numbers."""
    told = [float(value) for value in values]
    if not np.isfinite(told).all():
        raise SceneError("a number that is not finite", where="adapter 'tachyon'", got=str(told))
    return " ".join(f"{value:.17g}" for value in told)
