"""The process that Panda3D runs in: ``python -P panda3d_child.py FOLDER``; see ``child_job.py`` for what is in it.

Panda3D's fixed-function OpenGL lights vertices, not pixels. The picture is read from a float32 framebuffer, which is
not what a game shows: there it has 8 bits. OpenGL clamps the colours of vertices to 1, so the lights are dimmed until
no vertex reaches that, and the picture is made as bright again.
"""

from __future__ import annotations

import json
import math
import os
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from types import ModuleType

    import numpy.typing as npt
    from panda3d.core import GraphicsEngine, GraphicsPipe, NodePath, Texture

    from notabug.adapters.job_types import Arrays, CameraSaid, Job, LightSaid, ShapeSaid, TextureSaid

_SETTINGS = """
load-display p3headlessgl
window-type offscreen
audio-library-name null
notify-level-display error
textures-power-2 none
textures-auto-power-2 false
framebuffer-srgb false
gl-coordinate-system default
"""
_LARGEST = 16384  # samples along an edge of the picture: Mesa's largest framebuffer
_MOST_LIGHTS = 8  # of fixed-function OpenGL
_HEADROOM = 0.9  # the brightest colour of a vertex, once lights are dimmed


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    grid, width, height = job["grid"], job["width"], job["height"]
    if max(width, height) * grid > _LARGEST:
        sys.exit(f"{grid} x {grid} samples a pixel make the picture larger than {_LARGEST}, OpenGL's limit")
    if len(job["lights"]) > _MOST_LIGHTS:
        sys.exit(f"{len(job['lights'])} lights are more than the {_MOST_LIGHTS} of fixed-function OpenGL")
    samples = _picture(job, arrays, width * grid, height * grid)
    pixels = samples.reshape(height, grid, width, grid, 3).mean(axis=(1, 3), dtype=np.float64)
    np.save(folder / "picture.npy", pixels.astype(np.float32))


def _picture(job: Job, arrays: Arrays, width: int, height: int) -> npt.NDArray[np.float32]:
    """The samples (h, w, 3), top row first, from a framebuffer in float32."""
    from panda3d import core

    engine, pipe = _engine(core)
    plain, size = core.FrameBufferProperties(), core.WindowProperties.size(width, height)
    plain.setRgbaBits(8, 8, 8, 8)
    host = engine.makeOutput(pipe, "host", 0, plain, core.WindowProperties.size(1, 1), core.GraphicsPipe.BFRefuseWindow)
    if host is None:
        sys.exit("Panda3D has no OpenGL context")
    fine = core.FrameBufferProperties()
    fine.setFloatColor(True)
    fine.setRgbaBits(32, 32, 32, 32)
    fine.setDepthBits(24)
    how = core.GraphicsPipe.BFRefuseWindow
    film = engine.makeOutput(pipe, "film", 1, fine, size, how, host.getGsg(), host)
    if film is None:
        sys.exit("Panda3D has no float32 framebuffer")
    texture = core.Texture()
    film.addRenderTexture(texture, core.GraphicsOutput.RTMCopyRam)
    film.setClearColor((0.0, 0.0, 0.0, 1.0))
    gain = _gain(job, arrays)
    root = core.NodePath("root")
    root.setTwoSided(True)
    for shape in job["objects"]:
        _mesh(core, job, shape, arrays, root)
    for light in job["lights"]:
        _light(core, light, gain, root)
    region = film.makeDisplayRegion()
    region.setCamera(_camera(core, job["camera"], root))
    for _ in range(2):  # textures arrive with the second frame
        engine.renderFrame()
    if texture.getComponentType() != core.Texture.TFloat:
        sys.exit(f"Panda3D's framebuffer is not float32: {film.getFbProperties()}")
    pixels = np.frombuffer(bytes(texture.getRamImageAs("RGB")), np.float32).reshape(height, width, 3)
    print(film.getGsg().getDriverRenderer(), film.getGsg().getDriverVersion(), film.getFbProperties())
    engine.removeAllWindows()
    return pixels[::-1] / gain


@cache
def _engine(core: ModuleType) -> tuple[GraphicsEngine, GraphicsPipe]:
    """What all pictures of a process share."""
    core.loadPrcFileData("", _SETTINGS)
    pipe = core.GraphicsPipeSelection.getGlobalPtr().makeDefaultPipe()
    if pipe is None:
        sys.exit("Panda3D has no OpenGL without a window (p3headlessgl)")
    return core.GraphicsEngine.getGlobalPtr(), pipe


def _gain(job: Job, arrays: Arrays) -> float:
    """By what the lights are multiplied, so that no vertex may be brighter than ``_HEADROOM``; at most 1."""
    brightest = 0.0
    for shape in job["objects"]:
        material = job["materials"][shape["material"]]
        diffuse = np.array(material["diffuse"] if material["texture"] < 0 else (1.0, 1.0, 1.0))
        irradiance = np.zeros(3)
        points = arrays[shape["points"]]
        for light in job["lights"]:
            square = 1.0
            if light["kind"] == "point":
                nearest = float(((points - light["place"]) ** 2).sum(axis=1).min())
                square = max(nearest, float(np.finfo(np.float32).tiny))
            irradiance = irradiance + np.array(light["intensity"]) / square
        brightest = max(brightest, float((irradiance / math.pi * (diffuse + material["specular"])).max()))
    return min(1.0, _HEADROOM / brightest) if brightest > 0.0 else 1.0


def _mesh(core: ModuleType, job: Job, shape: ShapeSaid, arrays: Arrays, root: NodePath) -> None:
    """One vertex for each corner of the triangles; a mesh without normals gets those of its triangles."""
    corners = arrays[shape["triangles"]].ravel()
    points = arrays[shape["points"]][arrays[shape["corners"]][corners]]
    if "normals" in shape:
        normals = arrays[shape["normals"]][corners]
    else:
        edges = points.reshape(-1, 3, 3)
        facet = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
        normals = np.repeat(facet / np.linalg.norm(facet, axis=1, keepdims=True), 3, axis=0)
    uv = arrays[shape["uv"]][corners] if "uv" in shape else np.zeros((len(corners), 2))
    vertices = core.GeomVertexData("vertices", core.GeomVertexFormat.getV3n3t2(), core.Geom.UHStatic)
    vertices.uncleanSetNumRows(len(corners))
    packed = np.ascontiguousarray(np.hstack([points, normals, uv]), np.float32)
    memoryview(vertices.modifyArray(0)).cast("B")[:] = packed.tobytes()
    triangles = core.GeomTriangles(core.Geom.UHStatic)
    triangles.addConsecutiveVertices(0, len(corners))
    triangles.closePrimitive()
    geometry = core.Geom(vertices)
    geometry.addPrimitive(triangles)
    node = core.GeomNode("mesh")
    node.addGeom(geometry)
    place = root.attachNewNode(node)
    said = job["materials"][shape["material"]]
    look = core.Material()
    look.setAmbient((0.0, 0.0, 0.0, 1.0))
    look.setEmission((0.0, 0.0, 0.0, 1.0))
    look.setDiffuse((*(said["diffuse"] if said["texture"] < 0 else (1.0, 1.0, 1.0)), 1.0))
    look.setSpecular((*said["specular"], 1.0))
    look.setShininess(said["exponent"])
    look.setLocal(job["local_viewer"])
    look.setTwoside(True)
    place.setMaterial(look)
    if said["texture"] >= 0:
        place.setTexture(_texture(core, job["textures"][said["texture"]], arrays))


def _texture(core: ModuleType, said: TextureSaid, arrays: Arrays) -> Texture:
    pixels = arrays[said["pixels"]]
    texture = core.Texture()
    texture.setup2dTexture(pixels.shape[1], pixels.shape[0], core.Texture.TFloat, core.Texture.FRgb32)
    texture.setRamImage(np.ascontiguousarray(pixels[::-1, :, ::-1]).tobytes())  # Panda3D's channels are B, G, R
    texture.setMagfilter(core.SamplerState.FTLinear)
    texture.setMinfilter(core.SamplerState.FTLinear)
    wraps = [core.SamplerState.WMClamp if wrap == "clamp" else core.SamplerState.WMRepeat for wrap in said["wrap"]]
    texture.setWrapU(wraps[0])
    texture.setWrapV(wraps[1])
    return texture


def _light(core: ModuleType, said: LightSaid, gain: float, root: NodePath) -> None:
    """Lambert's radiance in OpenGL is colour * light * N.L: the division by pi is the light's."""
    if said["kind"] == "point":
        light = core.PointLight("light")
        light.setAttenuation((0.0, 0.0, 1.0))
    else:
        light = core.DirectionalLight("light")
        light.setDirection(core.LVector3(*said["place"]))
    light.setColor((*(np.array(said["intensity"]) * gain / math.pi).tolist(), 1.0))
    place = root.attachNewNode(light)
    if said["kind"] == "point":
        place.setPos(*said["place"])
    root.setLight(place)


def _camera(core: ModuleType, said: CameraSaid, root: NodePath) -> NodePath:
    lens = core.PerspectiveLens()
    lens.setCoordinateSystem(core.CSYupRight)
    lens.setFov(*(2.0 * math.degrees(math.atan(side)) for side in (said["tan_x"], said["tan_y"])))
    lens.setNearFar(said["near"], said["far"])
    camera = core.Camera("camera", lens)
    camera.setScene(root)
    place = root.attachNewNode(camera)
    place.setMat(core.LMatrix4(*np.array(said["to_world"]).ravel().tolist()))
    return place


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # taking Panda3D's context down may crash after the picture has been written
