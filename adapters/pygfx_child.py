"""The process that pygfx runs in: ``python -P pygfx_child.py FOLDER``; see ``child_job.py`` for what is in it.

``--probe`` in the place of the folder prints the device that would draw. pygfx's own shaders are used as they are. The
picture is pygfx's own, before it is shown; it has 8 bits and is made float32 here, by the table in which pygfx keeps
the formats of its textures.
"""

from __future__ import annotations

import json
import os
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from types import ModuleType

    import numpy.typing as npt
    import pygfx
    import wgpu

    from notabug.adapters.job_types import Arrays, CameraSaid, Job, LightSaid, MaterialSaid, ShapeSaid

_FORMAT, _FEATURE = "rgba32float", "float32-blendable"
_BYTES = 16  # of a pixel in that format


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    adapter = _adapter()
    grid, width, height = job["grid"], job["width"], job["height"]
    largest = adapter.limits["max-texture-dimension-2d"]
    if max(width, height) * grid > largest:
        sys.exit(f"{grid} x {grid} samples a pixel make the picture larger than {largest}, the device's limit")
    samples = _picture(adapter, job, arrays, width * grid, height * grid)
    pixels = samples.reshape(height, grid, width, grid, 3).mean(axis=(1, 3), dtype=np.float64)
    np.save(folder / "picture.npy", pixels.astype(np.float32))


@cache
def _adapter() -> wgpu.GPUAdapter:
    """The first device that draws into float32; a graphics card comes before a processor."""
    import wgpu

    able = [adapter for adapter in wgpu.gpu.enumerate_adapters_sync() if _FEATURE in adapter.features]
    if not able:
        sys.exit(f"no Vulkan, Metal or Direct3D 12 device has the feature {_FEATURE}")
    return min(able, key=lambda adapter: adapter.info["adapter_type"] == "CPU")


def _picture(adapter: wgpu.GPUAdapter, job: Job, arrays: Arrays, width: int, height: int) -> npt.NDArray[np.float32]:
    """The samples (h, w, 3), top row first."""
    import pygfx
    from pygfx.renderers.wgpu import get_shared

    _select(adapter)
    film = pygfx.Texture(dim=2, size=(width, height, 1), format="rgba8unorm")  # where the picture would be shown
    renderer = pygfx.WgpuRenderer(film, pixel_ratio=1, pixel_filter="nearest", ppaa="none")
    scene = pygfx.Scene()
    for shape in job["objects"]:
        scene.add(_mesh(pygfx, job, shape, arrays))
    for light in job["lights"]:
        if any(light["intensity"]):
            scene.add(_light(pygfx, light, job["unit"]))
    renderer.render(scene, _camera(pygfx, job["camera"], job["unit"]))
    texture = renderer._blender.get_texture("color")
    if texture.format != _FORMAT or texture.size[:2] != (width, height):
        sys.exit(f"pygfx's picture is {texture.size} in {texture.format}, not {width} x {height} in {_FORMAT}")
    data = get_shared().device.queue.read_texture(
        {"texture": texture, "mip_level": 0, "origin": (0, 0, 0)},
        {"offset": 0, "bytes_per_row": _BYTES * width, "rows_per_image": height},
        texture.size,
    )
    print(adapter.info["device"], adapter.info["description"])
    return np.frombuffer(data, np.float32).reshape(height, width, 4)[..., :3]


@cache
def _select(adapter: wgpu.GPUAdapter) -> None:
    """Have pygfx draw on ``adapter`` in float32, which can be said once, before its first picture."""
    from pygfx.renderers.wgpu import enable_wgpu_features, select_adapter
    from pygfx.renderers.wgpu.engine import blender

    select_adapter(adapter)
    enable_wgpu_features(_FEATURE)
    blender.default_targets["color"] = (_FORMAT, blender.default_targets["color"][1])


def _mesh(pygfx: ModuleType, job: Job, shape: ShapeSaid, arrays: Arrays) -> pygfx.Mesh:
    """One vertex for each corner of the triangles, since normals and uv belong to corners. pygfx's v grows down."""
    corners = arrays[shape["triangles"]].ravel()
    uv = arrays[shape["uv"]][corners] if "uv" in shape else np.zeros((len(corners), 2))
    parts = {
        "positions": arrays[shape["points"]][arrays[shape["corners"]][corners]] * job["unit"],
        "texcoords": uv * [1.0, -1.0] + [0.0, 1.0],
    }
    if "normals" in shape:
        parts["normals"] = arrays[shape["normals"]][corners]
    geometry = pygfx.Geometry(
        indices=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        **{name: np.ascontiguousarray(part, np.float32) for name, part in parts.items()},
    )
    return pygfx.Mesh(geometry, _look(pygfx, job, job["materials"][shape["material"]], arrays, "normals" not in shape))


def _look(pygfx: ModuleType, job: Job, said: MaterialSaid, arrays: Arrays, flat: bool) -> pygfx.Material:
    """Highlights are as strong as a map says; the specular colour is white, for which Schlick's Fresnel term is 1."""
    look = pygfx.MeshPhongMaterial(
        color=pygfx.Color.from_physical(*said["diffuse"]) if said["texture"] < 0 else (1.0, 1.0, 1.0),
        specular=(1.0, 1.0, 1.0),
        specular_map=_map(pygfx, np.full((1, 1, 3), max(said["specular"]))),
        shininess=said["exponent"],
        emissive=(0.0, 0.0, 0.0),
        flat_shading=flat,
        side="both",
    )
    if said["texture"] >= 0:
        texture = job["textures"][said["texture"]]
        look.map = _map(pygfx, arrays[texture["pixels"]], texture["wrap"])
    return look


def _map(
    pygfx: ModuleType, pixels: npt.NDArray[np.floating], wrap: tuple[str, str] = ("repeat", "repeat")
) -> pygfx.TextureMap:
    whole = np.ones((*pixels.shape[:2], 4), np.float32)
    whole[..., :3] = pixels
    texture = pygfx.Texture(whole, dim=2, colorspace="physical")
    return pygfx.TextureMap(texture, filter="linear", wrap_s=wrap[0], wrap_t=wrap[1])


def _light(pygfx: ModuleType, said: LightSaid, unit: float) -> pygfx.Light:
    """A point's intensity is the light's, in a larger scene as much larger; a distant light's is its irradiance."""
    most = max(said["intensity"])
    colour = pygfx.Color.from_physical(*(part / most for part in said["intensity"]))
    if said["kind"] == "point":
        light = pygfx.PointLight(colour, most * unit**2, distance=0, decay=2)
        light.local.position = [part * unit for part in said["place"]]
    else:
        light = pygfx.DirectionalLight(colour, most)
        light.local.position = [-part for part in said["place"]]
        light.target.local.position = (0.0, 0.0, 0.0)
    return light


def _camera(pygfx: ModuleType, said: CameraSaid, unit: float) -> pygfx.Camera:
    """pygfx's field of view is that of the mean of width and height, and half a degree at least; a zoom has no end."""
    camera = pygfx.PerspectiveCamera(
        90.0,
        said["tan_x"] / said["tan_y"],
        zoom=2.0 / (said["tan_x"] + said["tan_y"]),
        maintain_aspect=False,
        depth_range=(said["near"] * unit, said["far"] * unit),
    )
    place = np.array(said["to_world"]).T
    place[:3, 3] *= unit
    camera.local.matrix = place
    return camera


if __name__ == "__main__":
    if sys.argv[1] == "--probe":
        found = _adapter()
        print(found.info["device"], found.info["description"])
    else:
        main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # taking the device down may crash after the picture has been written
