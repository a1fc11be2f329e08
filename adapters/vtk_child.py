"""The process that VTK runs in: ``python -P vtk_child.py FOLDER``; see ``child_job.py`` for what is in the folder.

VTK's own shaders are used as they are. The picture is read from a float32 framebuffer (``vtkFramebufferPass``), which
an application that shows VTK's pictures in a window does not have: there they have 8 bits.
"""

from __future__ import annotations

import json
import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkRenderingCore import vtkActor, vtkLight, vtkRenderer
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLTexture

    from notabug.adapters.job_types import Arrays, Job, LightSaid, ShapeSaid, TextureSaid

_DEPTHS = {"fixed16": "Fixed16", "fixed24": "Fixed24", "float32": "Float32"}
_LARGEST = 16384  # samples along an edge of the picture: Mesa's largest framebuffer


def main(folder: Path) -> None:
    job = json.loads((folder / "job.json").read_text("utf-8"))
    with np.load(folder / "arrays.npz", allow_pickle=False) as stored:
        arrays = dict(stored)
    grid, width, height = job["grid"], job["width"], job["height"]
    if max(width, height) * grid > _LARGEST:
        sys.exit(f"{grid} x {grid} samples a pixel make the picture larger than {_LARGEST}, OpenGL's limit")
    samples = _picture(job, arrays, width * grid, height * grid)
    pixels = samples.reshape(height, grid, width, grid, 3).mean(axis=(1, 3), dtype=np.float64)
    np.save(folder / "picture.npy", pixels.astype(np.float32))


def _picture(job: Job, arrays: Arrays, width: int, height: int) -> npt.NDArray[np.float32]:
    """The samples (h, w, 3), top row first, from a framebuffer in float32."""
    from vtkmodules.vtkCommonCore import VTK_FLOAT
    from vtkmodules.vtkRenderingCore import vtkRenderWindow
    from vtkmodules.vtkRenderingOpenGL2 import vtkFramebufferPass, vtkRenderStepsPass, vtkTextureObject

    renderer = _scene(job, arrays)
    window = vtkRenderWindow()  # VTK takes the first of GLX, EGL and its own Mesa that works
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    film = vtkFramebufferPass()
    film.SetDelegatePass(vtkRenderStepsPass())
    film.SetColorFormat(vtkTextureObject.Float32)
    film.SetDepthFormat(getattr(vtkTextureObject, _DEPTHS[job["depth"]]))
    renderer.SetPass(film)
    window.Render()
    texture = film.GetColorTexture()
    channels = texture.GetComponents()
    pixels = np.zeros(width * height * channels, np.float32)
    if not texture.Download().Download2D(VTK_FLOAT, pixels, [width, height], channels, [0, 0]):
        sys.exit("VTK's framebuffer cannot be read")
    film.ReleaseGraphicsResources(window)
    window.Finalize()
    return pixels.reshape(height, width, channels)[::-1, :, :3]


def _scene(job: Job, arrays: Arrays) -> vtkRenderer:
    """The renderer with objects, lights and camera."""
    from vtkmodules.vtkRenderingCore import vtkRenderer

    renderer = vtkRenderer()
    renderer.SetBackground(0.0, 0.0, 0.0)
    renderer.SetTwoSidedLighting(True)
    renderer.AutomaticLightCreationOff()
    renderer.RemoveAllLights()
    for shape in job["objects"]:
        renderer.AddActor(_actor(job, shape, arrays))
    for light in job["lights"]:
        renderer.AddLight(_light(light))
    place, camera = np.array(job["camera"]["to_world"]), renderer.GetActiveCamera()
    camera.SetPosition(*place[3, :3])
    camera.SetFocalPoint(*(place[3, :3] - place[2, :3]))
    camera.SetViewUp(*place[1, :3])
    camera.SetViewAngle(2.0 * math.degrees(math.atan(job["camera"]["tan_y"])))
    camera.SetExplicitAspectRatio(job["camera"]["tan_x"] / job["camera"]["tan_y"])
    camera.SetUseExplicitAspectRatio(True)
    camera.SetClippingRange(job["camera"]["near"], job["camera"]["far"])
    return renderer


def _light(said: LightSaid) -> vtkLight:
    """Lambert's radiance in VTK is colour * light * N.L: the division by pi is the light's."""
    from vtkmodules.vtkRenderingCore import vtkLight

    light = vtkLight()
    light.SetLightTypeToSceneLight()
    light.SetAmbientColor(0.0, 0.0, 0.0)
    place = np.array(said["place"])
    if said["kind"] == "point":
        light.SetPositional(True)
        light.SetConeAngle(180.0)
        light.SetAttenuationValues(0.0, 0.0, 1.0)
        light.SetPosition(*place)
        light.SetFocalPoint(*(place - [0.0, 1.0, 0.0]))
    else:
        light.SetPositional(False)
        light.SetPosition(*-place)
        light.SetFocalPoint(0.0, 0.0, 0.0)
    colour = np.array(said["intensity"]) / math.pi
    most = float(colour.max())
    light.SetIntensity(most)
    shade = colour / most if most > 0.0 else colour
    light.SetDiffuseColor(*shade)
    light.SetSpecularColor(*shade)
    return light


def _actor(job: Job, shape: ShapeSaid, arrays: Arrays) -> vtkActor:
    from vtkmodules.vtkRenderingCore import vtkActor
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLPolyDataMapper

    material = job["materials"][shape["material"]]
    mapper = vtkOpenGLPolyDataMapper()
    mapper.SetInputData(_mesh(shape, arrays))
    mapper.ScalarVisibilityOff()
    mapper.SetResolveCoincidentTopologyToOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    if "normals" in shape and job["interpolation"] == "phong":
        look.SetInterpolationToPhong()
    else:
        look.SetInterpolationToFlat()
    look.SetAmbient(0.0)
    look.SetDiffuse(1.0)
    look.SetDiffuseColor(*(material["diffuse"] if material["texture"] < 0 else (1.0, 1.0, 1.0)))
    look.SetSpecular(1.0 if any(material["specular"]) else 0.0)
    look.SetSpecularColor(*material["specular"])
    look.SetSpecularPower(material["exponent"])
    if material["texture"] >= 0:
        actor.SetTexture(_texture(job["textures"][material["texture"]], arrays))
    return actor


def _mesh(shape: ShapeSaid, arrays: Arrays) -> vtkPolyData:
    """One point for each face corner, since normals and uv belong to them; n-gons are left to VTK."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    corners = arrays[shape["corners"]]
    points, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(arrays[shape["points"]][corners]), deep=True))
    offsets = np.concatenate([[0], np.cumsum(arrays[shape["counts"]], dtype=np.int64)])
    every = np.arange(len(corners), dtype=np.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(every, deep=True))
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    for part, name, put in (
        ("normals", shape.get("normals"), "SetNormals"),
        ("uv", shape.get("uv"), "SetTCoords"),
    ):
        if name is not None:
            data = numpy_to_vtk(arrays[name].astype(np.float32), deep=True)
            data.SetName(part)
            getattr(mesh.GetPointData(), put)(data)
    return mesh


def _texture(said: TextureSaid, arrays: Arrays) -> vtkOpenGLTexture:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLTexture

    pixels = arrays[said["pixels"]]
    image, texture = vtkImageData(), vtkOpenGLTexture()
    image.SetDimensions(pixels.shape[1], pixels.shape[0], 1)
    data = numpy_to_vtk(np.ascontiguousarray(pixels[::-1]).reshape(-1, 3), deep=True)
    data.SetName("texels")
    image.GetPointData().SetScalars(data)
    texture.SetInputData(image)
    texture.SetColorModeToDirectScalars()
    texture.InterpolateOn()
    texture.MipmapOff()
    texture.SetWrap(texture.ClampToEdge if said["wrap"][0] == "clamp" else texture.Repeat)
    return texture


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # taking VTK's window down may crash after the picture has been written
