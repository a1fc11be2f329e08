"""A Scene as a job for the Mitsuba child: a JSON document, and arrays that it names.

What Mitsuba does, measured with 3.9.1, and what is written for it:

- Camera: the USD matrix as column vectors with columns 0 and 2 negated; ``fov`` = 2 atan(tan_x) along x; pixels are
  square. An orthographic one sees -1 to 1 across; ``principal_point_offset`` is added to a place on the film.
- Light: ``point`` takes the radiant intensity I, ``directional`` the irradiance at normal incidence; no factor.
- Lights with a size: see ``mitsuba_lights.py``.
- A mesh gets one vertex per face corner, so that normals and uv may differ between faces; v is flipped.
- Lambert surfaces are Mitsuba's own ``diffuse`` under ``direct``. Whatever else there is needs the BSDF of
  ``mitsuba_bsdf.py``; where rays go on, all surfaces get it, since a ``diffuse`` one would send rays on as well.
- Rays that go on: ``path`` follows them; eight bounces are its depth 10. Shadow rays take every surface for opaque,
  glass too. Where there is opacity, ``volpath`` does the same, lets 1 - opacity of a shadow ray's light through each
  crossing, and does not count a straight passage as a bounce (nine sheets in a row show what is behind them).
- ``mask`` opacity, not used: ``direct`` and ``path`` are wrong (a sheet of opacity 0.5 hides what is behind it, and its
  shadow is opaque). ``path`` also squares the opacity where nothing is behind the sheet: a sample that passes the sheet
  and leaves the scene counts as having met nothing, and the light that the sheet sent is thrown away with it.
  ``volpath`` of depth 2 is right, but which rays pass is random: rms noise 1.0e-3 where the BSDF here has 4.1e-4, all
  of it from edges in the pixel.
- Reflected, refracted and shadow rays start about 9e-5 (1 + |p|) off the surface at p. So the image in a plane mirror
  is shifted, by 2.5e-4 at |p| = 2: 4e-4 of white on a ball's flank, and 1.7e-3 behind a ball of glass.
- A UsdPreviewSurface that is all metal is ``roughconductor`` without a material, which reflects all of the light, times
  the diffuse colour; any other one is the BSDF of ``mitsuba_bsdf.py``, with Mitsuba's own GGX. Its ``principled`` has
  Disney's diffuse lobe, Fresnel's exact factors and F90 = 1 for metal, and cannot say it.
- A normal map is Mitsuba's ``normalmap`` round that BSDF, without its function against bumps' hard terminators, which
  darkens ``preview/normal_bumps`` by half a per cent and the ridges of ``normal_maps/mirrored_uv`` by a third. It takes
  N x T for the second tangent, whatever side the texture's v grows on, so faces with mirrored coordinates are a shape
  of their own, with a map whose green is turned. Mapped normals that face away from the viewer are turned.
- A map of opacity is a bitmap that the BSDF looks up, and compares with the threshold if there is one: whether a sample
  goes on straight is then no chance, but follows from where it meets the surface.
- What surfaces emit is their albedo in a picture of its own (``mitsuba_bsdf.emitting``), which is added.
- A ``sphere`` has a centre and a radius: only rotated, moved and uniformly scaled ones can be said.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import cast

import numpy as np
import numpy.typing as npt

from notabug.adapters.base import Quality, UnsupportedError
from notabug.adapters.job_types import (
    Arrays,
    MitsubaCamera,
    MitsubaJob,
    MitsubaLook,
    MitsubaPreview,
    MitsubaShape,
    MitsubaTexture,
    PlugIn,
)
from notabug.adapters.mitsuba_lights import check_lights, with_size
from notabug.adapters.spheres import centre_and_radius
from notabug.adapters.textures import Grown, check_alone, clear, grow, is_plain, plain_wraps, shown_uv
from notabug.scenes_usd.scene import Camera, Light, Material, Preview, Scene, Sphere, Texture
from notabug.scenes_usd.triangulate import triangulate

DEFAULT_SAMPLES = 16
BOUNCES = 8  # a path of depth d meets d - 1 surfaces
MIRRORED = "m"  # what is of faces with mirrored coordinates: at the end of a name
_SIMILAR = 1e-6  # relative deviation from a similarity, or from square pixels, that float32 cannot show


def job(scene: Scene, quality: Quality, *, mask: bool = False, sided: bool = True) -> tuple[MitsubaJob, Arrays]:
    """The job's JSON document and its arrays; ``quality.samples`` is already the adapter's own choice.

    ``mask`` says opacity with Mitsuba's own plug-in, under ``path``. ``sided``: faces with mirrored coordinates have a
    normal map of their own.
    """
    scene = plain_wraps(scene, _draws)
    arrays: Arrays = {}
    shown = {each.material: scene.materials[each.material] for each in scene.objects}
    transparent = any(each.is_clear for each in shown.values())
    sends_on = any(any(each.mirror) or any(each.transmission) for each in shown.values())
    follows = sends_on or (transparent and not mask)
    centres = quality.samples == 1
    if centres:
        for each in shown.values():
            _check_one_way(each)
    glows = any(_glows(each.preview) for each in shown.values())
    for each in shown.values():
        _check_opaque(each, follows=follows, glows=glows)
        _check_map(each, mask=mask)
    check_lights(scene, centres=centres, mirrors=sends_on)
    looks = {str(index): _look(each, follows) for index, each in shown.items()}
    objects = [part for index in range(len(scene.objects)) for part in _object(scene, index, arrays, sided=sided)]
    looks |= _mirrored_looks(scene, looks, objects)
    return {
        "width": scene.width,
        "height": scene.height,
        "samples": quality.samples,
        "seeds": [0] if centres else list(quality.seeds),
        "threads": quality.threads,
        "integrator": "path" if mask or (sends_on and not transparent) else "volpath" if transparent else "direct",
        "max_depth": 3 if mask else BOUNCES + 2,  # a straight passage counts as a bounce under ``path``
        "normal_maps": {"use_shadowing_function": False, "flip_invalid_normals": True},
        "looks": looks,
        "camera": _camera(scene.camera, scene.width / scene.height),
        "glows": glows,
        "lights": [_light(each, scene, arrays) for each in scene.lights],
        "textures": _textures(scene, arrays),
        "objects": objects,
    }, arrays


def write_job(document: MitsubaJob, arrays: Arrays, folder: Path, variant: str) -> Path:
    """The job in ``folder`` as ``mitsuba_child`` reads it, to be drawn by the Mitsuba ``variant``."""
    np.savez(folder / "arrays.npz", allow_pickle=False, **arrays)
    target = folder / "job.json"
    target.write_text(json.dumps({**document, "variant": variant}), "utf-8")
    return target


def _check_one_way(material: Material) -> None:
    """Raise UnsupportedError where a ray that meets ``material`` would go on along one of several at random."""
    if any(material.mirror) + any(material.transmission) + material.is_clear > 1:
        raise UnsupportedError(
            "Mitsuba chooses at random which way a ray goes on from this material",
            where=material.path,
            expected="more than 1 sample per pixel for a material with several of mirror, transmission and opacity",
            got="1",
            do="raise the samples",
        )


def _glows(preview: Preview | None) -> bool:
    return preview is not None and (any(preview.emission) or preview.emission_map >= 0)


def _check_opaque(material: Material, *, follows: bool, glows: bool) -> None:
    """Raise UnsupportedError where what surfaces emit would be seen in others, or a normal map lets light through."""
    mapped = material.preview is not None and material.preview.normal_map >= 0
    if follows and glows:
        what = "what surfaces emit is drawn where they are seen directly"
        raise UnsupportedError(what, where=material.path, expected="no mirror, transmission or opacity in the scene")
    if mapped and material.is_clear:
        raise UnsupportedError("Mitsuba's normalmap lets no light through", where=material.path, expected="opacity 1")


def _check_map(material: Material, *, mask: bool) -> None:
    """Raise UnsupportedError where a map of opacity is beside rays that go on, or ``mask`` would have to cut by it."""
    if material.opacity_map >= 0 and (any(material.mirror) or any(material.transmission)):
        what = "a map of opacity on a surface that mirrors or is of glass"
        raise UnsupportedError(what, where=material.path, expected="no mirror or transmission")
    if mask and material.cutoff:
        what = "Mitsuba's mask has no threshold"
        raise UnsupportedError(what, where=material.path, expected="no opacityThreshold", do="leave opacity=mask out")


def _look(material: Material, follows: bool) -> MitsubaLook:
    """A material as the child gets it; ``scripted`` where it takes the BSDF of ``mitsuba_bsdf.py``."""
    preview = material.preview
    return {
        **clear(material),
        "scripted": follows or any(material.specular) or (preview is not None and not _is_metal(preview)),
        "preview": None if preview is None else cast(MitsubaPreview, asdict(preview)),
        "diffuse": list(material.diffuse),
        "texture": material.texture,
        "specular": list(material.specular),
        "exponent": material.exponent,
        "lobe": material.lobe,
        "cosine_weighted": material.cosine_weighted,
        "mirror": list(material.mirror),
        "transmission": list(material.transmission),
        "ior": material.ior,
        "opacity": material.opacity,
    }


def _is_metal(surface: Preview) -> bool:
    """Whether Mitsuba's own ``roughconductor`` is all of the surface: F0 and F90 are the diffuse colour."""
    constant = surface.metallic_map < 0 and surface.roughness_map < 0 and surface.normal_map < 0
    return constant and surface.metallic == 1.0 and not surface.specular_workflow and not surface.clearcoat


def _camera(camera: Camera, aspect: float) -> MitsubaCamera:
    if abs(camera.tan_y * aspect / camera.tan_x - 1.0) > _SIMILAR:
        raise UnsupportedError(
            "Mitsuba's pixels are square",
            where=camera.path,
            expected=f"an aperture {aspect:g} times as wide as high",
            got=f"{camera.tan_x / camera.tan_y:g}",
        )
    to_world = camera.to_world.T * np.array([-1.0, 1.0, -1.0, 1.0])
    if camera.orthographic:  # it sees what lies between -1 and 1 across, about its axis
        beside = camera.shift_x * camera.tan_x * to_world[:, 0] * -1.0 + camera.shift_y * camera.tan_y * to_world[:, 1]
        to_world[:3, 3] += beside[:3]
        to_world[:3, :2] *= camera.tan_x
        orthographic: PlugIn = {"type": "orthographic"}
        return {"near": camera.near, "far": camera.far, "lens": orthographic, "to_world": to_world.tolist()}
    lens: PlugIn = {"type": "perspective", "fov": math.degrees(2.0 * math.atan(camera.tan_x)), "fov_axis": "x"}
    if camera.shift_x or camera.shift_y:  # added to the place on the film, in parts of it, right and down
        lens |= {"principal_point_offset_x": camera.shift_x / 2.0, "principal_point_offset_y": -camera.shift_y / 2.0}
    return {"near": camera.near, "far": camera.far, "lens": lens, "to_world": to_world.tolist()}


def _light(light: Light, scene: Scene, arrays: Arrays) -> dict[str, object]:
    power = {"type": "rgb", "value": list(light.intensity)}
    if light.emitter is not None:
        return with_size(light, scene, arrays)
    if light.kind == "point":
        return {"type": "point", "position": list(light.position), "intensity": power}
    return {"type": "directional", "direction": list(light.direction), "irradiance": power}


def _draws(texture: Texture) -> bool:
    """Whether Mitsuba has the texture's wrap modes: one for both axes, and none that ends in black."""
    return is_plain(texture) or texture.wrap_s == texture.wrap_t == "mirror"


def _wrapping(scene: Scene, index: int) -> tuple[str, Grown | None]:
    """The wrap mode of the texture ``index``, the same for both axes; where they differ, ``repeat`` on a grown one."""
    texture = scene.textures[index]
    uv = shown_uv(scene, index)
    if texture.wrap_s == texture.wrap_t:
        return texture.wrap_s, None
    check_alone(scene, index)
    return "repeat", grow(texture, uv)


def _textures(scene: Scene, arrays: Arrays) -> dict[str, MitsubaTexture]:
    found: dict[str, MitsubaTexture] = {}
    normals = {each.preview.normal_map for each in scene.materials if each.preview is not None}
    for index in sorted(scene.shown_textures):
        wrap, grown = _wrapping(scene, index)
        pixels = grown.pixels if grown else scene.textures[index].pixels
        arrays[f"texture{index}"] = ((pixels + 1.0) / 2.0 if index in normals else pixels).astype(np.float32)
        found[str(index)] = {"pixels": f"texture{index}", "wrap": wrap}
        if index in normals:  # 1 - green: for faces with mirrored coordinates
            other = _mirrored_map(scene, index)
            arrays[f"texture{other}"] = np.abs(arrays[f"texture{index}"] - np.array([0.0, 1.0, 0.0], np.float32))
            found[str(other)] = {"pixels": f"texture{other}", "wrap": wrap}
    return found


def _mirrored_map(scene: Scene, index: int) -> int:
    """The number of the normal map ``index`` with its green turned, among the job's textures."""
    return len(scene.textures) + index


def _object(scene: Scene, index: int, arrays: Arrays, *, sided: bool) -> list[MitsubaShape]:
    """The shapes of an object: two where a normal map is on faces with mirrored coordinates and on others."""
    each = scene.objects[index]
    material = scene.materials[each.material]
    look = str(each.material)
    if isinstance(each, Sphere):
        centre, radius = centre_and_radius(each)
        return [{"kind": "sphere", "look": look, "centre": centre, "radius": radius}]
    corner = triangulate(each, "02").corner
    uv: npt.NDArray[np.float64] | None = None
    if each.uv is not None and material.textures:
        grown = _wrapping(scene, min(material.textures))[1]
        uv = each.uv * grown.a + grown.b if grown else each.uv
    mirrored = np.zeros(len(corner), np.bool_)
    if sided and uv is not None and material.preview is not None and material.preview.normal_map >= 0:
        mirrored = _mirrored(uv[corner])
    made: list[MitsubaShape] = []
    for name, chosen in (("", ~mirrored), (MIRRORED, mirrored)):
        if not chosen.any() and (name or len(corner)):
            continue
        kept = corner[chosen].ravel()
        parts: Arrays = {"points": each.points[each.corners[kept]]}
        if each.normals is not None:
            parts["normals"] = each.normals[kept]
        if uv is not None:
            parts["uv"] = np.stack([uv[kept, 0], 1.0 - uv[kept, 1]], axis=1)
        called = {part: f"{part}{index}{name}" for part in parts}
        arrays |= {called[part]: np.ascontiguousarray(array, np.float32) for part, array in parts.items()}
        made.append(cast(MitsubaShape, {"kind": "mesh", "look": look + name, **called}))
    return made


def _mirrored(uv: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Of each triangle (t, 3, 2) whether texture coordinates run round it the other way than its corners."""
    first, second, third = uv.transpose(1, 0, 2)
    one, other = second - first, third - first
    return np.asarray(one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0])


def _mirrored_looks(scene: Scene, looks: dict[str, MitsubaLook], objects: list[MitsubaShape]) -> dict[str, MitsubaLook]:
    """The looks of faces with mirrored coordinates: those of ``looks`` with a normal map whose green is turned."""
    made: dict[str, MitsubaLook] = {}
    for name in {each["look"] for each in objects if each["look"].endswith(MIRRORED)}:
        look = looks[name.removesuffix(MIRRORED)]
        assert look["preview"] is not None
        turned = _mirrored_map(scene, look["preview"]["normal_map"])
        made[name] = {**look, "preview": {**look["preview"], "normal_map": turned}}
    return made
