"""glTF 2.0 with KHR_lights_punctual: meshes as triangles in float32, camera, lights, Lambert materials.

Light intensities go in as they are, radiometric where glTF says candela and lux: a renderer that converts must not.
Lambert is a metallic-roughness material without metal whose dielectric highlight KHR_materials_specular turns off.
What glTF cannot say (spheres, Phong's and Blinn's lobes, constant mirrors, clear glass) is in ``scene.json`` only.
Base colours of textures are sRGB-encoded, as glTF demands, in 16-bit PNG.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pygltflib as gltf

from notabug.adapters.base import UnsupportedError
from notabug.adapters.export.description import SPLIT, texture_name
from notabug.scenes_usd.picture import write_png
from notabug.scenes_usd.scene import Camera, Floats, Light, Material, Mesh, Scene, Texture
from notabug.scenes_usd.srgb import encode_srgb
from notabug.scenes_usd.triangulate import triangulate

_WRAP = {"repeat": gltf.REPEAT, "clamp": gltf.CLAMP_TO_EDGE}


def write_gltf(scene: Scene, folder: Path) -> Path:
    """``scene.gltf``, ``scene.bin`` and textures ``image<i>-srgb.png`` in ``folder``."""
    document = gltf.GLTF2(
        asset=gltf.Asset(generator="notabug"),
        scene=0,
        scenes=[gltf.Scene()],
        extensionsUsed=["KHR_lights_punctual", "KHR_materials_specular"],
    )
    blob = bytearray()
    document.extensions["KHR_lights_punctual"] = {"lights": [_light(light) for light in scene.lights]}
    document.cameras = [_camera(scene.camera)]
    document.nodes = [gltf.Node(camera=0, matrix=np.asarray(scene.camera.to_world).ravel().tolist())]
    document.nodes += [_light_node(index, each) for index, each in enumerate(scene.lights)]
    document.materials = [_material(material) for material in scene.materials]
    for index, texture in enumerate(scene.textures):
        _texture(document, index, texture, folder)
    for index, each in enumerate(scene.objects):
        if isinstance(each, Mesh):
            document.nodes.append(gltf.Node(name=f"object{index}", mesh=len(document.meshes)))
            document.meshes.append(gltf.Mesh(primitives=[_primitive(document, blob, each)]))
    document.scenes[0].nodes = list(range(len(document.nodes)))
    if blob:
        document.buffers = [gltf.Buffer(byteLength=len(blob), uri="scene.bin")]
    (folder / "scene.bin").write_bytes(blob)
    target = folder / "scene.gltf"
    target.write_text(document.to_json(), "utf-8")
    return target


def _camera(camera: Camera) -> gltf.Camera:
    if camera.shift_x or camera.shift_y:
        what = "glTF has no offset of a camera's aperture"
        raise UnsupportedError(what, where=camera.path, do="choose another format for this scene")
    if camera.orthographic:
        seen = gltf.Orthographic(xmag=camera.tan_x, ymag=camera.tan_y, znear=camera.near, zfar=camera.far)
        return gltf.Camera(type="orthographic", orthographic=seen)
    perspective = gltf.Perspective(
        yfov=2.0 * math.atan(camera.tan_y),
        aspectRatio=camera.tan_x / camera.tan_y,
        znear=camera.near,
        zfar=camera.far,
    )
    return gltf.Camera(type="perspective", perspective=perspective)


def _light(light: Light) -> dict[str, object]:
    strength = max(light.intensity)
    colour = [each / strength for each in light.intensity] if strength else [0.0, 0.0, 0.0]
    return {"type": {"point": "point", "distant": "directional"}[light.kind], "color": colour, "intensity": strength}


def _light_node(index: int, light: Light) -> gltf.Node:
    node = gltf.Node(extensions={"KHR_lights_punctual": {"light": index}})
    if light.kind == "point":
        node.translation = list(light.position)
    else:
        node.rotation = _turn(np.asarray(light.direction))
    return node


def _turn(direction: Floats) -> list[float]:
    """The quaternion (x, y, z, w) that turns -z, along which a glTF light shines, to the unit ``direction``."""
    x, y, z = direction.tolist()
    if z > 0.999999:  # straight back: half a turn about any axis across
        return [0.0, 1.0, 0.0, 0.0]
    turn = np.array([y, -x, 0.0, 1.0 - z])  # (-z) x direction, and 1 + (-z) . direction
    turned: list[float] = (turn / np.linalg.norm(turn)).tolist()
    return turned


def _material(material: Material) -> gltf.Material:
    surface = gltf.PbrMetallicRoughness(
        baseColorFactor=[*material.diffuse, material.opacity], metallicFactor=0.0, roughnessFactor=1.0
    )
    if material.texture >= 0:
        surface.baseColorFactor = [1.0, 1.0, 1.0, material.opacity]
        surface.baseColorTexture = gltf.TextureInfo(index=material.texture)
    return gltf.Material(
        pbrMetallicRoughness=surface,
        extensions={"KHR_materials_specular": {"specularFactor": 0.0}},
        alphaMode="BLEND" if material.opacity < 1.0 else "OPAQUE",
        alphaCutoff=None,
        doubleSided=True,
    )


def _texture(document: gltf.GLTF2, index: int, texture: Texture, folder: Path) -> None:
    linear = np.clip(texture.pixels, 0.0, 1.0)
    name = texture_name(index, "-srgb.png")
    write_png(folder / name, encode_srgb(linear))
    document.images.append(gltf.Image(uri=name))
    document.samplers.append(
        gltf.Sampler(
            magFilter=gltf.LINEAR, minFilter=gltf.LINEAR, wrapS=_WRAP[texture.wrap_s], wrapT=_WRAP[texture.wrap_t]
        )
    )
    document.textures.append(gltf.Texture(source=index, sampler=index))


def _primitive(document: gltf.GLTF2, blob: bytearray, mesh: Mesh) -> gltf.Primitive:
    """One vertex for each corner of a triangle, in order, since normals and uv belong to corners."""
    corner = triangulate(mesh, SPLIT).corner.ravel()
    attributes = gltf.Attributes(POSITION=_accessor(document, blob, mesh.points[mesh.corners[corner]], bounds=True))
    if mesh.normals is not None:
        attributes.NORMAL = _accessor(document, blob, mesh.normals[corner])
    if mesh.uv is not None:
        s, t = mesh.uv[corner].T
        attributes.TEXCOORD_0 = _accessor(document, blob, np.stack([s, 1.0 - t], axis=1))
    return gltf.Primitive(attributes=attributes, material=mesh.material)


def _accessor(document: gltf.GLTF2, blob: bytearray, rows: npt.NDArray[np.floating], *, bounds: bool = False) -> int:
    data = np.ascontiguousarray(rows, "<f4")
    document.bufferViews.append(
        gltf.BufferView(buffer=0, byteOffset=len(blob), byteLength=data.nbytes, target=gltf.ARRAY_BUFFER)
    )
    blob += data.tobytes()
    made = gltf.Accessor(
        bufferView=len(document.bufferViews) - 1,
        componentType=gltf.FLOAT,
        count=len(data),
        type=f"VEC{data.shape[1]}",
    )
    if bounds:
        made.min, made.max = data.min(axis=0).tolist(), data.max(axis=0).tolist()
    document.accessors.append(made)
    return len(document.accessors) - 1
