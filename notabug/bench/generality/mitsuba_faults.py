"""Faults of Mitsuba's job: lights, camera, surfaces and meshes as its child gets them, written without our models.

Each fault edits the job's document and arrays in place, and does nothing where the scene has nothing for it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from notabug.adapters.job_types import Arrays, MitsubaLook, MitsubaTexture
from notabug.bench.generality.povray_faults import MISSING, MOVED, SEEN_ELSEWHERE

Job = dict[str, Any]
Numbers = npt.NDArray[np.floating]
Edit = Callable[[Job, Arrays], None]


@dataclass(frozen=True, slots=True)
class JobFault:
    """``edit`` makes the fault; a finding with one of the names ``right`` has found it."""

    edit: Edit
    right: tuple[str, ...]


def _lights(factors: tuple[float, float, float]) -> Edit:
    def edit(job: Job, _: Arrays) -> None:
        for light in job["lights"]:
            power = light["intensity" if light["type"] == "point" else "irradiance"]
            power["value"] = [a * b for a, b in zip(power["value"], factors, strict=True)]

    return edit


def _moved_light(job: Job, _: Arrays) -> None:
    for light in job["lights"]:
        if light["type"] == "point":
            x, y, z = light["position"]
            light["position"] = [1.15 * x, y, 0.85 * z]


def _turned_light(job: Job, _: Arrays) -> None:
    for light in job["lights"]:
        if light["type"] == "directional":
            x, y, z = light["direction"]
            light["direction"] = [x, z, y]


def _first_light_lost(job: Job, _: Arrays) -> None:
    if len(job["lights"]) > 1:
        del job["lights"][0]


def _wider(job: Job, _: Arrays) -> None:
    job["camera"]["lens"]["fov"] *= 1.03


def _camera_aside(job: Job, _: Arrays) -> None:
    matrix = np.array(job["camera"]["to_world"])
    matrix[:3, 3] -= 0.02 * float(np.linalg.norm(matrix[:3, 3])) * matrix[:3, 0]
    job["camera"]["to_world"] = matrix.tolist()


def _near_plane(job: Job, _: Arrays) -> None:
    """The near clipping plane cuts into what is seen."""
    job["camera"]["near"] *= 60.0


def _looks(change: Callable[[MitsubaLook], None]) -> Edit:
    def edit(job: Job, _: Arrays) -> None:
        for look in job["looks"].values():
            change(look)

    return edit


def _exponent(look: MitsubaLook) -> None:
    look["exponent"] *= 1.6


def _lobe(look: MitsubaLook) -> None:
    look["lobe"] = "blinn" if look["lobe"] == "phong" else "phong"


def _without_highlight(look: MitsubaLook) -> None:
    look["specular"] = [0.0, 0.0, 0.0]


def _brighter_mirror(look: MitsubaLook) -> None:
    look["mirror"] = [1.3 * each for each in look["mirror"]]


def _denser(look: MitsubaLook) -> None:
    look["ior"] = 1.1 * look["ior"] if any(look["transmission"]) else look["ior"]


def _opaque(look: MitsubaLook) -> None:
    look["opacity"] = 1.0


def _other_albedo(job: Job, _: Arrays) -> None:
    """The first surface without a texture is a quarter darker."""
    for look in job["looks"].values():
        if look["texture"] < 0 and any(look["diffuse"]):
            look["diffuse"] = [0.75 * each for each in look["diffuse"]]
            return


def _exchanged(job: Job, _: Arrays) -> None:
    """The first two surfaces without a texture, which takes uv that the other has not."""
    looks = job["looks"]
    plain = [name for name, look in looks.items() if look["texture"] < 0 and any(look["diffuse"])]
    if len(plain) > 1:
        first, second = plain[:2]
        looks[first], looks[second] = looks[second], looks[first]


def _object_lost(job: Job, _: Arrays) -> None:
    if len(job["objects"]) > 1:
        del job["objects"][0]


def _parts(kind: str, change: Callable[[Numbers], Numbers]) -> Edit:
    def edit(job: Job, arrays: Arrays) -> None:
        for each in job["objects"]:
            if kind in each:
                arrays[each[kind]] = np.ascontiguousarray(change(arrays[each[kind]]), np.float32)

    return edit


def _no_normals(job: Job, _: Arrays) -> None:
    for each in job["objects"]:
        each.pop("normals", None)


def _triangles_lost(job: Job, arrays: Arrays) -> None:
    """Every fifth triangle is lost, and a small mesh's last one."""
    for each in job["objects"]:
        if each["kind"] != "mesh":
            continue
        count = len(arrays[each["points"]]) // 3
        kept = np.arange(count) % 5 != 4 if count > 5 else np.arange(count) < max(1, count - 1)
        for part in ("points", "normals", "uv"):
            if part in each:
                arrays[each[part]] = np.ascontiguousarray(arrays[each[part]][np.repeat(kept, 3)])


def _textures(change: Callable[[MitsubaTexture, Arrays], None]) -> Edit:
    def edit(job: Job, arrays: Arrays) -> None:
        for each in job["textures"].values():
            change(each, arrays)

    return edit


def _decoded(texture: MitsubaTexture, arrays: Arrays) -> None:
    arrays[texture["pixels"]] = np.power(arrays[texture["pixels"]], 2.2).astype(np.float32)


def _nearest(texture: MitsubaTexture, _: Arrays) -> None:
    texture["filter"] = "nearest"


MITSUBA_FAULTS: Mapping[str, JobFault] = {
    "light brighter": JobFault(_lights((1.25, 1.25, 1.25)), ("light_gain",)),
    "light redder": JobFault(_lights((1.25, 1.0, 1.0)), ("light_colour",)),
    "light moved": JobFault(_moved_light, MOVED),
    "light's y and z exchanged": JobFault(_turned_light, MOVED),
    "light missing": JobFault(_first_light_lost, ("light_missing", "light_gain")),
    "field of view": JobFault(_wider, ("field_of_view",)),
    "camera moved": JobFault(_camera_aside, SEEN_ELSEWHERE),
    "near plane": JobFault(_near_plane, ("object_missing", "face_missing")),
    "exponent": JobFault(_looks(_exponent), ("exponent",)),
    "lobe exchanged": JobFault(_looks(_lobe), ("lobe_exchanged",)),
    "highlight lost": JobFault(_looks(_without_highlight), ("specular_missing",)),
    "mirror brighter": JobFault(_looks(_brighter_mirror), ("mirror_gain",)),
    "glass denser": JobFault(_looks(_denser), ("ior",)),
    "opacity ignored": JobFault(_looks(_opaque), ("opacity_ignored",)),
    "albedo": JobFault(_other_albedo, ("albedo", "light_gain")),
    "materials exchanged": JobFault(_exchanged, ("materials_exchanged",)),
    "object missing": JobFault(_object_lost, ("object_missing",)),
    "normals inward": JobFault(_parts("normals", lambda n: -n), ("normals_flipped",)),
    "normals swapped": JobFault(_parts("normals", lambda n: n[:, [0, 2, 1]]), ("normals_up_axis",)),
    "normals left out": JobFault(_no_normals, ("flat_normals", "normals_lost")),
    "u and v swapped": JobFault(_parts("uv", lambda uv: 1.0 - uv[:, ::-1]), ("swapped_uv",)),
    "v downwards": JobFault(_parts("uv", lambda uv: uv * [1.0, -1.0] + [0.0, 1.0]), ("flipped_v",)),
    "triangles missing": JobFault(_triangles_lost, MISSING),
    "texture decoded": JobFault(_textures(_decoded), ("texture_decoded", "texture_decoded_by_power")),
    "texture nearest": JobFault(_textures(_nearest), ("texture_nearest",)),
}
