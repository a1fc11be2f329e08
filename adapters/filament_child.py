"""The process that Filament runs in, through filly: ``python -P filament_child.py --serve``; ``kept.py`` says how.

``--probe`` prints what would draw. Each scene is told to filly as a binary glTF of its own: glTF is where a material
says that it has no highlight. filly gives back 8 bits, so a scene is drawn under many exposures and each value lies
where all pictures say that it does. What they show was a half float before that, and is judged as one.
"""

from __future__ import annotations

import base64
import json
import math
import os
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import filly
    import numpy.typing as npt

    from notabug.adapters.job_types import Arrays, CameraSaid, Job, LightSaid, ShapeSaid

_LARGEST = 16384  # samples along an edge of the picture: Mesa's largest framebuffer
_STEPS = 255.0  # of filly's pictures between 0 and 1
_FINER = 12  # exposures from one brightness to twice that: an interval is 1/12 of a step of 8 bits, or narrower
_OCTAVES = 4  # of exposures above the one that clips nothing, for what is dark
_FILM = math.log2(1.0 / 1.2)  # the exposure value (EV100) at which Filament's picture is the luminance
_BRIGHTEST, _DIMMEST = 0.98, 2.0**-60  # where the exposure that clips nothing puts the peak, and where it is given up
_REACH = 64.0  # times the size of the scene: how far lamps reach. Filament dims what is near the end of that
_WHITE = base64.b64decode(  # a PNG of one texel, in the place of which a texture in float32 is put
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg=="
)


def draw(renderer: filly.Renderer, folder: Path) -> None:
    """The picture of the job in ``folder``."""
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    grid, width, height = job["grid"], job["width"], job["height"]
    if max(width, height) * grid > _LARGEST:
        raise ValueError(f"{grid} x {grid} samples a pixel make the picture larger than {_LARGEST}, OpenGL's limit")
    target = renderer.create_render_target(width=width * grid, height=height * grid)
    samples = np.zeros((height * grid, width * grid, 3))
    try:
        for lights in _together(job["lights"]):
            samples += _lit(renderer, target, job, arrays, lights)
    finally:
        target.close()
    pixels = samples.reshape(height, grid, width, grid, 3).mean(axis=(1, 3))
    np.save(folder / "picture.npy", pixels.astype(np.float32))


def _together(lights: list[LightSaid]) -> Iterator[list[LightSaid]]:
    """Lights that one picture can have: all points, and one distant light, which is the most of a scene of Filament."""
    points = [light for light in lights if light["kind"] == "point"]
    distant = [light for light in lights if light["kind"] != "point"]
    yield points + distant[:1]
    yield from ([light] for light in distant[1:])


def _lit(
    renderer: filly.Renderer, target: filly.RenderTarget, job: Job, arrays: Arrays, lights: list[LightSaid]
) -> npt.NDArray[np.float64]:
    """The samples (h, w, 3) under ``lights``, top row first."""
    scene, camera = renderer.create_scene(), _camera(renderer, job["camera"], job["unit"])
    textures: list[filly.Texture] = []
    try:
        scene.encoding = scene.tone_mapping = "linear"
        scene.antialiasing, scene.msaa = "none", 1
        scene.dithering = scene.shadows = scene.ssao = scene.bloom = scene.fog = scene.vignette = False
        scene.background = [0.0, 0.0, 0.0, 1.0]
        textures += _objects(renderer, scene, job, arrays)
        reach = _REACH * _size(job, arrays)
        lamps = [_light(scene, light, job["unit"], reach) for light in lights if any(light["intensity"])]
        if not lamps:
            return np.zeros((target.height, target.width, 3))
        scene.camera = camera
        return _bracketed(renderer, scene, target, lamps)
    finally:
        scene.close()
        for each in (camera, *textures):
            each.close()


def _bracketed(
    renderer: filly.Renderer, scene: filly.Scene, target: filly.RenderTarget, lamps: list[filly.Light]
) -> npt.NDArray[np.float64]:
    """The values that all pictures of a series agree with; a step of 8 bits alone is 1/255 of the brightest."""
    bright = [lamp.intensity for lamp in lamps]

    def shoot(gain: float) -> npt.NDArray[np.uint8]:
        for lamp, intensity in zip(lamps, bright, strict=True):
            lamp.intensity = intensity * gain
        renderer.render(scene, target)
        return np.asarray(target.read())[..., :3]

    gain, picture = 1.0, shoot(1.0)
    while picture.max() == _STEPS and gain > _DIMMEST:
        gain /= 8.0
        picture = shoot(gain)
    while picture.max() < _STEPS / 8.0 and gain < 1.0 / _DIMMEST:
        gain *= 8.0
        picture = shoot(gain)
    if not picture.any():
        return np.zeros(picture.shape)
    gain *= _BRIGHTEST * _STEPS / (float(picture.max()) + 0.5)
    low, high = np.zeros(picture.shape), np.full(picture.shape, np.inf)
    for place in range(-_FINER, _FINER * _OCTAVES):
        brighter = gain * 2.0 ** ((place + 1) / _FINER)
        picture = shoot(brighter)
        step = 1.0 / (_STEPS * brighter)
        np.maximum(low, (picture - 0.5) * step, out=low)
        np.minimum(high, np.where(picture < _STEPS, (picture + 0.5) * step, np.inf), out=high)
    return np.where(picture == 0, 0.0, 0.5 * (low + high))


def _objects(renderer: filly.Renderer, scene: filly.Scene, job: Job, arrays: Arrays) -> list[filly.Texture]:
    """Put the meshes into the scene; the textures that they show."""
    shown = []
    for shape in job["objects"]:
        said = job["materials"][shape["material"]]
        textured = said["texture"] >= 0
        model = scene.load(_glb(shape, said["diffuse"], textured, arrays, job["unit"]))
        if textured:
            texture = job["textures"][said["texture"]]
            pixels = arrays[texture["pixels"]]
            whole = np.ones((*pixels.shape[:2], 4), np.float32)
            whole[..., :3] = pixels
            wrap = "clamp" if texture["wrap"][0] == "clamp" else "repeat"
            look = model.nodes[0].material(0)
            shown.append(renderer.create_texture(whole, color_space="linear", wrap=wrap))
            look.base_color_texture = shown[-1]
    return shown


def _glb(shape: ShapeSaid, diffuse: list[float], textured: bool, arrays: Arrays, unit: float) -> bytes:
    """A binary glTF of one mesh, one vertex for each corner of its triangles; ``specularFactor`` 0 makes it matt."""
    corners = arrays[shape["triangles"]].ravel()
    points = arrays[shape["points"]][arrays[shape["corners"]][corners]] * unit
    if "normals" in shape:
        normals = arrays[shape["normals"]][corners]
    else:
        edges = points.reshape(-1, 3, 3)
        across = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
        length = np.linalg.norm(across, axis=1, keepdims=True)
        normals = np.repeat(across / np.where(length > 0.0, length, 1.0), 3, axis=0)
    uv = arrays[shape["uv"]][corners] * [1.0, -1.0] + [0.0, 1.0] if "uv" in shape else np.zeros((len(corners), 2))
    parts = {"POSITION": points, "NORMAL": normals, "TEXCOORD_0": uv}
    packed = {name: np.ascontiguousarray(part, np.float32) for name, part in parts.items()}
    starts = np.cumsum([0, *(part.nbytes for part in packed.values())])
    look: dict[str, Any] = {
        "baseColorFactor": [*((1.0, 1.0, 1.0) if textured else diffuse), 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
    }
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_specular"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {name: i for i, name in enumerate(packed)}, "material": 0}]}],
        "materials": [
            {
                "doubleSided": True,
                "pbrMetallicRoughness": look,
                "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}},
            }
        ],
        "buffers": [{"byteLength": int(starts[-1])}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(start), "byteLength": part.nbytes, "target": 34962}
            for start, part in zip(starts[:-1], packed.values(), strict=True)
        ],
        "accessors": [
            {
                "bufferView": index,
                "componentType": 5126,
                "count": len(corners),
                "type": f"VEC{part.shape[1]}",
                **({"min": part.min(0).tolist(), "max": part.max(0).tolist()} if name == "POSITION" else {}),
            }
            for index, (name, part) in enumerate(packed.items())
        ],
    }
    if textured:
        look["baseColorTexture"] = {"index": 0}
        document["textures"] = [{"source": 0}]
        document["images"] = [{"uri": f"data:image/png;base64,{base64.b64encode(_WHITE).decode()}"}]
    return _chunks(json.dumps(document).encode(), b"".join(part.tobytes() for part in packed.values()))


def _chunks(document: bytes, binary: bytes) -> bytes:
    """The two chunks of a binary glTF 2.0; each is filled up to a multiple of 4 bytes."""
    document += b" " * (-len(document) % 4)
    whole = (
        struct.pack("<II", len(document), 0x4E4F534A) + document + struct.pack("<II", len(binary), 0x004E4942) + binary
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(whole)) + whole


def _size(job: Job, arrays: Arrays) -> float:
    """How far the farthest corner or lamp is from the origin, at least 1, in what is drawn."""
    places = [arrays[shape["points"]] for shape in job["objects"]]
    places += [np.array(light["place"]) for light in job["lights"] if light["kind"] == "point"]
    return job["unit"] * max(1.0, *(float(np.abs(place).max(initial=0.0)) for place in places))


def _light(scene: filly.Scene, said: LightSaid, unit: float, reach: float) -> filly.Light:
    """A point's intensity is the light's, in a larger scene as much larger; a distant light's is its irradiance."""
    most = max(said["intensity"])
    colour = [part / most for part in said["intensity"]]
    if said["kind"] == "point":
        place = [part * unit for part in said["place"]]
        return scene.add_point_light(position=place, intensity=most * unit**2, color=colour, range=reach)
    return scene.add_directional_light(direction=said["place"], intensity=most, color=colour)


def _camera(renderer: filly.Renderer, said: CameraSaid, unit: float) -> filly.Camera:
    camera = renderer.create_camera()
    camera.exposure = _FILM
    place = np.array(said["to_world"]).T
    place[:3, 3] *= unit
    camera.transform = place.astype(np.float32)
    camera.set_perspective(
        fov_y_deg=2.0 * math.degrees(math.atan(said["tan_y"])),
        aspect=said["tan_x"] / said["tan_y"],
        near=said["near"] * unit,
        far=said["far"] * unit,
    )
    return camera


def _answer(said: str) -> None:
    """Begin a new line: what Filament printed may have no end."""
    print(f"\n{os.environ.get('NOTABUG_JOB', '')} {said}", flush=True)


def main() -> None:
    import filly

    renderer = filly.Renderer()
    if sys.argv[1] == "--probe":
        print(f"\nFilament by {renderer.gl_platform}", flush=True)
        return
    _answer("ready")
    for line in sys.stdin:
        try:
            draw(renderer, Path(line.rstrip("\n")))
            _answer("done")
        except Exception as error:  # a scene that cannot be drawn must not end the renderer
            _answer(f"failed {json.dumps(str(error))}")


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # taking the device down may crash after the pictures have been written
