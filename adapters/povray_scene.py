"""A Scene as POV-Ray's scene text.

What POV-Ray does, measured with 3.7.0.10, and what is written for it:

- Camera: ``location E direction -Z right X*2*tan_x up Y*2*tan_y``, without ``look_at``; with +x as ``right`` the space
  is right-handed. Pixel centres agree to 0.001 px. There is no near or far plane: those of the camera are ignored.
- There is no 1/pi: radiance = pigment * diffuse * light colour * N.L, so colours of lights are E / pi.
- Point light: ``fade_power 2 fade_distance fd`` gives colour * 2 / (1 + (d / fd)^2), so the colour I / (2 pi fd^2) is
  inverse square but for the factor 1 - (fd / d)^2. fd is 1e-6 of the distance to the farthest corner of the scene's
  bounds: 1e-6 relative error at a thousandth of that distance. Below 1e-10 POV-Ray takes fd for 0, no fall-off.
- Rectangular light: ``area_light`` with ``area_illumination on``, without ``adaptive`` and ``jitter``: n x n point
  lights that share the colour, the outermost at the ends of its axes. So the axes are (n - 1) / n of the light's, and
  the points in the middles of n x n equal parts. ``spotlight`` with ``radius 90 falloff 90 tightness 1`` is the
  cosine at each of them and nothing behind; ``fade_distance`` is of each, too. Without shadows that is the sum over n
  x n points to 3e-5. In a penumbra it is this sum times the share of the points that are seen, to the output's step:
  whichever they are. POV-Ray counts them by quarters of quarters, so that they weigh alike where n is a power of two.
- Distant light: ``parallel`` from outside the bounds is exact to the output's step.
- Highlights: ``phong p phong_size n`` is p * max(R.L, 0)^n, ``specular s roughness 1/n`` is s * max(N.H, 0)^n, both cut
  where N.L < 0, neither times N.L, and right to the output's step up to n = 1e5. ``transmit`` leaves them alone, so
  they are scaled by the opacity here. p and s are scalars: coloured ones take a picture for each channel.
- Mirrors: ``reflection { rgb m }``, constant, whatever the opacity. ``max_trace_level 9`` gives eight bounces; straight
  passage through a surface is none.
- Glass: ``filter 1`` and the transmission as the pigment; with a diffuse colour too, see ``_pigment``. The interior's
  ``ior`` refracts, without Fresnel's factors. Images in mirrors and in glass are right to the output's step. A shadow
  ray goes straight through glass and keeps the transmission at each crossing. Where glass reflects totally, the mirror
  ray has the weight 1, whatever the transmission and the mirror: 1.25 times the contract's for a transmission of 0.8.
- The medium that a ray is in is the last one whose surface it met and did not leave, and it starts in none. So a single
  sheet is entered from either side, a camera inside glass sees through its wall as if from outside, and refraction
  between nested media is relative: a sheet of opacity 0.5 inside glass bends rays as if it were filled with air.
- Shadow rays pass blockers nearer than 0.001, in the scene's own units.
- ``interpolate 2`` is bilinear with texel centres at +0.5 and wraps at the border: 7.7e-6 (half a step of the output)
  from a float64 lookup. It cannot clamp; a clamped texture is written with its border repeated as far as the uv reach.
- A triangle whose three normals are within 1e-5 of one another is drawn flat, with the normal of its plane, whatever
  the normals are. Where they are not the plane's, one is tilted by 4e-5 to have them honoured.

Only numbers go into the text: names, paths and strings of a stage never do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import UnsupportedError
from notabug.adapters.textures import grow, shown_uv
from notabug.scenes_usd.emitters import area, side
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.picture import write_png
from notabug.scenes_usd.scene import Camera, Floats, Light, Material, Mesh, Scene, Sphere
from notabug.scenes_usd.triangulate import triangulate

MAX_TRACE_LEVEL = 9  # eight bounces and the camera's ray
LIGHT_GRID = 4  # points along each side of a rectangular light, as many scenes of POV-Ray's users have
LIGHT_GRIDS = (2, 4, 8, 16)
_REACH = 1e-6  # fade_distance over the distance to the scene's farthest corner
_ALIKE = 1e-5  # normals closer than this are one to POV-Ray
_LEAST_EXPONENT = 1e-20  # as ``roughness`` it has no 0; any cosine of a double to the power of this is 1
_LEAST_FADE = 1e-9  # POV-Ray ignores a fade_distance below 1e-10


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """A texture as POV-Ray gets it: ``pixels`` (h, w, 3) in 0..1, to be multiplied by ``scale``; uv' = uv * a + b."""

    pixels: Floats
    scale: float
    a: Floats
    b: Floats


def scene_text(
    scene: Scene,
    *,
    gain: float = 1.0,
    shadows: bool = True,
    images: Mapping[int, Image] = {},
    channel: int | None = None,
    light_grid: int = LIGHT_GRID,
) -> str:
    """The scene with every light multiplied by ``gain``; without ``shadows`` no object casts one.

    ``images`` are those of ``texture_images``, in files ``texture<index>.png`` beside the text. With a ``channel``
    (0, 1, 2) only that one of the picture's will be right: see ``needs_channels``. Rectangular lights are
    ``light_grid`` points along each side.
    """
    lo, hi = bounds(scene)
    parts = [
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1 ambient_light 0 max_trace_level {MAX_TRACE_LEVEL} adc_bailout 0 }}",
        "background { rgb 0 }",
        _camera(scene.camera),
        *(_light(light, gain, lo, hi, light_grid) for light in scene.lights),
    ]
    for shape in scene.objects:
        material = scene.materials[shape.material]
        image = images.get(material.texture)
        look = _texture(material, image, channel) + ("" if shadows else " no_shadow")
        parts.append(_sphere(shape, look) if isinstance(shape, Sphere) else _mesh(shape, look, image))
    return "\n".join(parts) + "\n"


def write_scene(scene: Scene, folder: Path) -> Path:
    """``scene.pov`` and its textures in ``folder``. Where ``needs_channels``, one file for each colour channel."""
    images = texture_images(scene)
    write_textures(images, folder)
    target = folder / "scene.pov"
    target.write_text(scene_text(scene, images=images, channel=0 if needs_channels(scene) else None), "ascii")
    if needs_channels(scene):
        for channel in (1, 2):
            (folder / f"scene{channel}.pov").write_text(scene_text(scene, images=images, channel=channel), "ascii")
    return target


def write_textures(images: Mapping[int, Image], folder: Path) -> None:
    """16-bit PNG of linear values: 8-bit originals exactly, others to 7.7e-6 of the brightest."""
    for index, image in images.items():
        write_png(folder / f"texture{index}.png", image.pixels)


def bounds(scene: Scene) -> tuple[Floats, Floats]:
    """The corners of the box round all objects, world space; the camera's place where there is no object."""
    corners = [scene.camera.to_world[3:, :3]]
    for shape in scene.objects:
        if isinstance(shape, Mesh):
            corners.append(shape.points)
        else:
            reach = shape.radius * np.sqrt((shape.to_world[:3, :3] ** 2).sum(axis=0))
            corners.append(np.stack([shape.to_world[3, :3] - reach, shape.to_world[3, :3] + reach]))
    every = np.concatenate(corners[1:] or corners)
    return every.min(axis=0), every.max(axis=0)


def texture_images(scene: Scene) -> dict[int, Image]:
    """The textures that the scene's objects show, by index."""
    images = {}
    for index in sorted({scene.materials[shape.material].texture for shape in scene.objects} - {-1}):
        grown = grow(scene.textures[index], shown_uv(scene, index))
        scale = max(1.0, float(grown.pixels.max()))
        images[index] = Image(grown.pixels / scale, scale, grown.a, grown.b)
    return images


def _number(value: float) -> str:
    """A number in full. Never ``repr``, which writes ``np.float64(1.0)`` for NumPy's numbers."""
    if not np.isfinite(value):
        raise SceneError("a number that is not finite", where="adapter 'povray'", got=str(value))
    return f"{value:.17g}"


def _vector(value: Floats | tuple[float, ...]) -> str:
    return f"<{','.join(_number(float(each)) for each in value)}>"


def _list(name: str, rows: npt.NDArray[np.floating] | npt.NDArray[np.integer]) -> str:
    """``name { n, <..>,<..> }`` of the (n, k) array ``rows``, integer or float."""
    if not np.isfinite(rows).all():
        raise SceneError(f"numbers that are not finite among {name}", where="adapter 'povray'")
    form = "%d" if rows.dtype.kind == "i" else "%.17g"
    row = f"<{','.join([form] * rows.shape[1])}>"
    return f"{name} {{ {len(rows)}, {','.join([row] * len(rows)) % tuple(rows.ravel().tolist())} }}"


def _camera(camera: Camera) -> str:
    x, y, z, origin = (camera.to_world[row, :3] for row in range(4))
    beside = camera.shift_x * camera.tan_x * x + camera.shift_y * camera.tan_y * y
    place, direction = (origin + beside, -z) if camera.orthographic else (origin, beside - z)
    return (
        f"camera {{ {'orthographic' if camera.orthographic else 'perspective'} location {_vector(place)} "
        f"direction {_vector(direction)} "
        f"right {_vector(2.0 * camera.tan_x * x)} up {_vector(2.0 * camera.tan_y * y)} }}"
    )


def _light(light: Light, gain: float, lo: Floats, hi: Floats, points: int) -> str:
    power = np.asarray(light.intensity) * gain * (area(light) if light.kind == "rect" else 1.0)
    if light.kind == "distant":
        centre, size = (lo + hi) / 2.0, float(np.linalg.norm(hi - lo)) or 1.0
        far = centre - 4.0 * size * np.asarray(light.direction)
        return f"light_source {{ {_vector(far)} rgb {_vector(power / np.pi)} parallel point_at {_vector(centre)} }}"
    position = np.asarray(light.position)
    reach = float(np.linalg.norm(np.maximum(np.abs(position - lo), np.abs(position - hi))))
    fade = max(_REACH * reach, _LEAST_FADE)
    return (
        f"light_source {{ {_vector(position)} rgb {_vector(power / (2.0 * np.pi * fade**2))} "
        f"{_points_of(light, points)}fade_power 2 fade_distance {_number(fade)} }}"
    )


def _points_of(light: Light, points: int) -> str:
    """What makes ``points`` x ``points`` spot lights of a rectangle; "" of a point light."""
    if light.kind != "rect" or light.emitter is None:
        return ""
    ahead = np.asarray(light.position) + side(light.emitter)
    across, up = (2.0 * (points - 1) / points * light.emitter.axes[row] for row in (0, 1))
    return (
        f"spotlight point_at {_vector(ahead)} radius 90 falloff 90 tightness 1 "
        f"area_light {_vector(across)} {_vector(up)} {points} {points} area_illumination on "
    )


def needs_channels(scene: Scene) -> bool:
    """Whether ``scene`` holds what POV-Ray can only say of one colour channel at a time."""
    return any(_is_split(scene.materials[index]) for index in {shape.material for shape in scene.objects})


def _is_split(material: Material) -> bool:
    """A coloured highlight, or glass with a diffuse colour: but for clear grey glass it takes two colours."""
    if len(set(material.specular)) > 1:
        return True
    if not any(material.transmission) or not _is_painted(material):
        return False
    return len(set(material.transmission)) > 1 or material.transmission[0] >= 1.0


def _is_painted(material: Material) -> bool:
    return material.texture >= 0 or any(material.diffuse)


def _texture(material: Material, image: Image | None, channel: int | None) -> str:
    pigment, diffuse = _pigment(material, image, channel)
    finish = f"ambient 0 diffuse {_number(diffuse)}"
    strength = material.specular[channel or 0] * material.opacity
    if strength and material.lobe == "phong":
        finish += f" phong {_number(strength)} phong_size {_number(material.exponent)}"
    elif strength:
        finish += f" specular {_number(strength)} roughness {_number(1.0 / max(material.exponent, _LEAST_EXPONENT))}"
    if any(material.mirror):
        finish += f" reflection {{ rgb {_vector(material.mirror)} }}"
    interior = f" interior {{ ior {_number(material.ior)} }}" if any(material.transmission) else ""
    return f"texture {{ pigment {{ {pigment} }} finish {{ {finish} }} }}{interior}"


def _pigment(material: Material, image: Image | None, channel: int | None) -> tuple[str, float]:
    """A pigment p and a ``diffuse`` d such that d p (1 - f - t) is the diffuse colour and p f + t what goes through.

    f and t, ``filter`` and ``transmit``, are scalars, and so is d.
    """
    through, diffuse = 1.0 - material.opacity, 1.0
    if any(material.transmission):
        if material.opacity < 1.0:
            raise UnsupportedError(
                "POV-Ray sends one ray through a surface, refracted or straight",
                where=material.path,
                expected="either transmission or an opacity below 1",
                do="choose another renderer for this scene",
            )
        if not _is_painted(material):
            return f"rgbf {_vector((*material.transmission, 1.0))}", 0.0
        through = material.transmission[channel or 0]
        if through < 1.0:
            diffuse = 1.0 / (1.0 - through)
        elif image is None:
            return f"rgbf {_vector((*(2.0 * through,) * 3, 0.5))}", material.diffuse[channel or 0] / through
        else:
            raise UnsupportedError(
                "POV-Ray shows no texture on a surface that lets all light through",
                where=material.path,
                expected="a transmission below 1 for a textured material",
                do="choose another renderer for this scene",
            )
    if image is None:
        return f"rgbt {_vector((*material.diffuse, through))}", diffuse
    clear = f" transmit all {_number(through)}" if through else ""
    name = f"texture{material.texture}.png"
    return f'uv_mapping image_map {{ png "{name}" gamma 1.0 interpolate 2{clear} }}', diffuse * image.scale


def _sphere(sphere: Sphere, look: str) -> str:
    rows = sphere.to_world[:, :3].ravel()  # POV-Ray's matrices act on row vectors, as USD's do
    return f"sphere {{ <0,0,0>, {_number(sphere.radius)} {look} matrix {_vector(rows)} }}"


def _mesh(mesh: Mesh, look: str, image: Image | None) -> str:
    cut = triangulate(mesh, "02")
    parts = [_list("vertex_vectors", mesh.points)]
    indices = [_list("face_indices", cut.point)]
    if mesh.normals is not None:
        parts.append(_list("normal_vectors", _honoured(mesh, mesh.normals)))
        indices.append(_list("normal_indices", cut.corner))
    if mesh.uv is not None and image is not None:
        parts.append(_list("uv_vectors", mesh.uv * image.a + image.b))
        indices.append(_list("uv_indices", cut.corner))
    return f"mesh2 {{ {' '.join(parts + indices)} {look} }}"


def _honoured(mesh: Mesh, normals: Floats) -> Floats:
    """``normals`` (c, 3), one of each face tilted where POV-Ray would take the plane's in their stead."""
    first = np.concatenate([[0], np.cumsum(mesh.counts)[:-1]]).astype(np.intp)
    face = np.repeat(np.arange(len(first)), mesh.counts)
    spread = np.maximum.reduceat(np.linalg.norm(normals - normals[first][face], axis=1), first)
    reach = mesh.points[mesh.corners] - mesh.points[mesh.corners[first]][face]
    after = np.arange(1, len(face) + 1)
    after[first + mesh.counts - 1] = first
    plane = np.add.reduceat(np.cross(reach, reach[after]), first)  # twice the area along the normal, after Newell
    length = np.linalg.norm(plane, axis=1, keepdims=True)
    plane = np.where(length > 0.0, plane / np.where(length > 0.0, length, 1.0), normals[first])  # none: it is not drawn
    off = np.linalg.norm(normals[first] - plane, axis=1) > _ALIKE
    tilted = first[off & (spread < 2.0 * _ALIKE)]
    kept = normals.copy()
    axis = np.eye(3)[np.abs(kept[tilted]).argmin(axis=1)]
    aside = np.cross(kept[tilted], axis)
    kept[tilted] += 4.0 * _ALIKE * aside / np.linalg.norm(aside, axis=1)[:, None]
    return kept
