"""The process that Mitsuba runs in: ``python -m notabug.adapters.mitsuba_child FOLDER``.

It reads ``job.json`` and ``arrays.npz`` from the folder, and writes ``seed<n>.npy``, (h, w, 3) float32, for each seed.
Mitsuba is imported here and nowhere else: its LLVM back end can abort the process that it lives in.
"""

from __future__ import annotations

import itertools
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from types import ModuleType

    import mitsuba

    from notabug.adapters.job_types import Arrays, MitsubaJob, MitsubaLook, MitsubaShape, MitsubaTexture, PlugIn

_LANES = 1 << 25  # samples drawn at once: the LLVM back end keeps every one of them in memory
ON_A_LIGHT = 32  # places on a light with a size that each sample of a pixel looks at
_ANOTHER = 1_000_003  # from the seed of one render to that of the next


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    import drjit
    import mitsuba

    mitsuba.set_variant(job["variant"])
    mitsuba.set_log_level(mitsuba.LogLevel.Warn)
    if job["threads"]:
        drjit.set_thread_count(job["threads"])
    bsdfs = {name: _bsdf(mitsuba, look, job, arrays) for name, look in job["looks"].items()}
    scenes = [_scene(mitsuba, job, arrays, bsdfs, light) for light in job["lights"]]
    if job["glows"]:
        scenes.append(_glowing(mitsuba, job, arrays))
    for seed in job["seeds"]:
        np.save(folder / f"seed{seed}.npy", _picture(mitsuba, job, scenes, seed))


def _picture(mi: ModuleType, job: MitsubaJob, scenes: list[mitsuba.Scene], seed: int) -> npt.NDArray[np.float32]:
    """The sum over the lights, (h, w, 3), each drawn alone.

    Together, Mitsuba would choose one light at random for each sample: noise that says nothing of any artifact, and at
    pixel centres, where every random number is 0.5, always the same light.
    """
    film = np.zeros((job["height"], job["width"], 3))
    most = max(1, _LANES // (job["width"] * job["height"]))
    samples: int = job["samples"]
    shares = [most] * (samples // most) + [samples % most] * (samples % most > 0)
    for number, (scene, share) in enumerate(itertools.product(scenes, shares)):
        film += np.array(mi.render(scene, seed=(seed + number * _ANOTHER) % (1 << 32), spp=share)) * (share / samples)
    return film.astype(np.float32)


def _glowing(mi: ModuleType, job: MitsubaJob, arrays: Arrays) -> mitsuba.Scene:
    """The scene that shows what each surface emits, as its albedo."""
    from notabug.adapters.mitsuba_bsdf import emitting

    bsdfs = {}
    for name, look in job["looks"].items():
        preview = look["preview"]
        glow = None if preview is None else _bitmap(mi, preview["emission_map"], job["textures"], arrays)
        bsdfs[name] = emitting(mi, [0.0, 0.0, 0.0] if preview is None else preview["emission"], glow)
    return _scene(mi, {**job, "integrator": "albedo"}, arrays, bsdfs, {"type": "constant", "radiance": 0.0})


def _scene(
    mi: ModuleType, job: MitsubaJob, arrays: Arrays, bsdfs: dict[str, mitsuba.BSDF], light: PlugIn
) -> mitsuba.Scene:
    camera = job["camera"]
    parts: PlugIn = {
        "type": "scene",
        "light": _light(mi, light, arrays),
        "integrator": _integrator(job, light),
        "sensor": {
            **camera["lens"],
            "to_world": mi.ScalarTransform4f(np.array(camera["to_world"])),
            "near_clip": camera["near"],
            "far_clip": camera["far"],
            "film": {
                "type": "hdrfilm",
                "width": job["width"],
                "height": job["height"],
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "stratified", "sample_count": 1, "jitter": False}
            if job["samples"] == 1
            else {"type": "independent", "sample_count": job["samples"]},
        },
    }
    for number, each in enumerate(job["objects"]):
        bsdf = bsdfs[each["look"]]
        if each["kind"] == "sphere":
            parts[f"object{number}"] = {
                "type": "sphere",
                "center": each["centre"],
                "radius": each["radius"],
                "bsdf": bsdf,
            }
        else:
            parts[f"object{number}"] = _mesh(mi, f"object{number}", each, arrays, bsdf)
    made: mitsuba.Scene = mi.load_dict(parts)
    return made


def _light(mi: ModuleType, light: PlugIn, arrays: Arrays) -> PlugIn:
    """The light with Mitsuba's own types of a matrix and a picture."""
    made = dict(light)
    if "to_world" in light:
        made["to_world"] = mi.ScalarTransform4f(np.array(light["to_world"]))
    if "bitmap" in light:
        made["bitmap"] = mi.Bitmap(arrays[str(light["bitmap"])])
    return made


def _integrator(job: MitsubaJob, light: PlugIn) -> PlugIn:
    if job["integrator"] == "albedo":
        return {"type": "aov", "aovs": "shown:albedo"}
    sized = light["type"] not in ("point", "directional")
    hidden = {"hide_emitters": True} if sized else {}
    if job["integrator"] == "direct":  # which counts a light without a size as often as it looks at it
        return {"type": "direct", "emitter_samples": ON_A_LIGHT if sized else 1, "bsdf_samples": 0, **hidden}
    return {"type": job["integrator"], "max_depth": job["max_depth"], "rr_depth": 1 << 20, **hidden}


def _bsdf(mi: ModuleType, look: MitsubaLook, job: MitsubaJob, arrays: Arrays) -> mitsuba.BSDF:
    """Mitsuba's own plug-ins where they can say the material, else the scripted one."""
    textures = job["textures"]
    bitmap = _bitmap(mi, look["texture"], textures, arrays)
    preview = look["preview"]
    if look["scripted"]:
        from notabug.adapters.mitsuba_bsdf import whitted

        numbers = (
            {} if preview is None else {"metallic": preview["metallic_map"], "roughness": preview["roughness_map"]}
        )
        maps = {name: _bitmap(mi, index, textures, arrays) for name, index in numbers.items()}
        normals = None if preview is None else _bitmap(mi, preview["normal_map"], textures, arrays)
        maps["opacity"] = _bitmap(mi, look.get("opacity_map", -1), textures, arrays)
        settings = job["normal_maps"]
        # where mapped normals are turned to the viewer none is seen from behind; else it is black there
        one_sided = normals is not None and not settings["flip_invalid_normals"]
        scripted: mitsuba.BSDF = whitted(mi, look, bitmap, maps, one_sided=one_sided)
        if normals is None:
            return scripted
        mapped = _mapped(mi, normals, scripted, settings)
        return mi.load_dict({"type": "twosided", "bsdf": mapped}) if one_sided else mapped
    reflectance = bitmap or {"type": "rgb", "value": look["diffuse"]}
    shown: PlugIn = {"type": "diffuse", "reflectance": reflectance}
    if preview:
        alpha = preview["roughness"] ** 2
        shown = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": alpha}
        shown["specular_reflectance"] = reflectance
    surface: PlugIn = {"type": "twosided", "bsdf": shown}
    clear = _bitmap(mi, look.get("opacity_map", -1), textures, arrays)
    if clear is not None or look["opacity"] < 1.0:
        surface = {"type": "mask", "opacity": look["opacity"] if clear is None else clear, "nested": surface}
    made: mitsuba.BSDF = mi.load_dict(surface)
    return made


def _mapped(mi: ModuleType, normals: PlugIn, surface: mitsuba.BSDF, settings: dict[str, bool]) -> mitsuba.BSDF:
    """``surface`` with the normal map."""
    told: PlugIn = {"type": "normalmap", "normalmap": normals, "bsdf": surface}
    try:
        made: mitsuba.BSDF = mi.load_dict({**told, **settings})
    except RuntimeError:  # a version that has no such settings
        made = mi.load_dict(told)
    return made


def _bitmap(mi: ModuleType, index: int, textures: dict[str, MitsubaTexture], arrays: Arrays) -> PlugIn | None:
    """The texture ``index`` as a plug-in; None for -1."""
    if index < 0:
        return None
    texture = textures[str(index)]
    return {
        "type": "bitmap",
        "data": mi.TensorXf(arrays[texture["pixels"]]),
        "raw": True,
        "format": "variant",  # not half floats
        "filter_type": texture.get("filter", "bilinear"),
        "wrap_mode": texture["wrap"],
    }


def _mesh(mi: ModuleType, name: str, each: MitsubaShape, arrays: Arrays, bsdf: mitsuba.BSDF) -> mitsuba.Mesh:
    points = arrays[each["points"]]
    properties = mi.Properties()
    properties["bsdf"] = bsdf
    mesh: mitsuba.Mesh = mi.Mesh(
        name,
        len(points),
        len(points) // 3,
        has_vertex_normals="normals" in each,
        has_vertex_texcoords="uv" in each,
        props=properties,
    )
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = points.ravel()
    parameters["faces"] = np.arange(len(points), dtype=np.uint32)
    if "uv" in each:
        parameters["vertex_texcoords"] = arrays[each["uv"]].ravel()
    parameters.update()
    if "normals" in each:  # after the positions, whose update computes normals of its own
        parameters["vertex_normals"] = arrays[each["normals"]].ravel()
        parameters.update()
    return mesh


if __name__ == "__main__":
    main(Path(sys.argv[1]))
