"""A Scene as a USD file that reads back as the same Scene: for scenes that were edited in memory, or shrunk."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, Vt

from notabug.scenes_usd.emitters import area
from notabug.scenes_usd.lens import write_lens
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader_inputs import PREVIEW
from notabug.scenes_usd.reader_shading import CONTEXT, REFLECTION
from notabug.scenes_usd.scene import Emitter, Floats, Light, Material, Mesh, Object, Preview, Scene, Sphere, Texture

_EXACT = 1e-14  # of the largest coordinate: two roundings of the way into the frame and back


def write_scene(scene: Scene, path: Path, *, metres_per_unit: float = 1.0, up: str = "Y") -> Path:
    """Write ``scene`` to ``path`` (.usda or .usdc) and its textures to ``textures/`` beside it; returns ``path``.

    Variants are gone: the file holds the one choice that the scene is. Points, uv and normals are float32 in USD, as
    are intensities and the lens; what was read from a file comes back bit by bit. Points are written in the frame of
    their mesh, so a scene far from the origin keeps them. A texture's file is copied where there is one.
    """
    stage = Usd.Stage.CreateInMemory()
    stage.SetMetadata("metersPerUnit", metres_per_unit)
    stage.SetMetadata("upAxis", up)
    root = scene.camera.path.split("/")[1]
    prim = UsdGeom.Xform.Define(stage, f"/{root}").GetPrim()
    stage.SetDefaultPrim(prim)
    card = scene.card
    words = {"class": card.artifact_class, "claim": card.claim, "figure": card.figure, "cites": card.cites}
    words["intent"] = card.intent if scene.intent is not None else ""
    custom: dict[str, Any] = {key: text for key, text in words.items() if text}
    if card.requires:
        custom["requires"] = Vt.StringArray(sorted(card.requires))
    prim.SetCustomData({"notabug": custom})
    _camera(stage, scene)
    for number, light in enumerate(scene.lights):
        _light(stage, light)
        if light.emitter is not None and light.emitter.texture is not None:
            _sky(stage, light, *_file(light.emitter.texture, path.parent, f"sky{number}"))
    files = _textures(scene, path.parent)
    for material in scene.materials:
        _material(stage, material, files)
    for each in scene.objects:
        _object(stage, each, scene.materials)
    if scene.intent is not None:
        UsdGeom.Imageable(_mesh(stage, scene.intent, scene.materials)).CreatePurposeAttr(UsdGeom.Tokens.guide)
    path.parent.mkdir(parents=True, exist_ok=True)
    stage.GetRootLayer().Export(str(path))
    return path


def _textures(scene: Scene, folder: Path) -> list[tuple[str, Texture]]:
    """The scene's textures as files below ``folder``: their paths relative to it."""
    return [_file(texture, folder, str(index)) for index, texture in enumerate(scene.textures)]


def _file(texture: Texture, folder: Path, word: str) -> tuple[str, Texture]:
    """The file of ``texture`` below ``folder``, called after ``word``: its relative path, and what it holds."""
    copied = texture.path.is_file()
    name = f"textures/{word}-{texture.path.name}" if copied else f"textures/{word}.exr"
    (folder / "textures").mkdir(parents=True, exist_ok=True)
    if copied:
        shutil.copyfile(texture.path, folder / name)
        return name, texture
    write_exr(folder / name, texture.pixels)
    return name, replace(texture, colour_space="raw")


def _sky(stage: Usd.Stage, light: Light, file: str, texture: Texture) -> None:
    """The picture of the dome ``light``."""
    dome = UsdLux.DomeLight(stage.GetPrimAtPath(light.path))
    dome.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
    made = dome.CreateTextureFileAttr(Sdf.AssetPath(f"./{file}"))
    made.SetColorSpace(texture.colour_space)


def _camera(stage: Usd.Stage, scene: Scene) -> None:
    camera = scene.camera
    made = UsdGeom.Camera.Define(stage, camera.path)
    made.CreateClippingRangeAttr(Gf.Vec2f(camera.near, camera.far))
    write_lens(made, camera)
    _place(made, camera.to_world)
    settings = UsdRender.Settings.Define(stage, "/Render/Settings")
    settings.CreateResolutionAttr(Gf.Vec2i(scene.width, scene.height))
    settings.CreateCameraRel().SetTargets([Sdf.Path(camera.path)])
    stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")


def _place(prim: UsdGeom.Xformable, matrix: Floats) -> None:
    if not np.array_equal(matrix, np.eye(4)):
        UsdGeom.Xformable(prim).AddTransformOp().Set(Gf.Matrix4d(*matrix.ravel().tolist()))


def _light(stage: Usd.Stage, light: Light) -> None:
    made = _delta(stage, light) if light.emitter is None else _with_size(stage, light, light.emitter)
    for name in ("diffuse", "specular"):
        if (said := getattr(light, name)) != 1.0:
            UsdLux.LightAPI(made).GetPrim().GetAttribute(f"inputs:{name}").Set(said)
    for collection, left_out in (
        (UsdLux.LightAPI(made).GetLightLinkCollectionAPI(), light.unlit),
        (UsdLux.LightAPI(made).GetShadowLinkCollectionAPI(), light.unshadowing),
    ):
        if left_out:
            collection.CreateExcludesRel().SetTargets([Sdf.Path(path) for path in left_out])
    if light.shaping is not None:
        beam = UsdLux.ShapingAPI.Apply(made.GetPrim())
        beam.CreateShapingConeAngleAttr(light.shaping.cone)
        beam.CreateShapingConeSoftnessAttr(light.shaping.softness)
        beam.CreateShapingFocusAttr(light.shaping.focus)
        beam.CreateShapingFocusTintAttr(Gf.Vec3f(*light.shaping.tint))


def _with_size(
    stage: Usd.Stage, light: Light, emitter: Emitter
) -> UsdLux.BoundableLightBase | UsdLux.NonboundableLightBase:
    """A light with a size: its shape's axes are the matrix, so that every size is 1 there."""
    schema = {"sphere": UsdLux.SphereLight, "rect": UsdLux.RectLight, "disk": UsdLux.DiskLight}
    schema |= {"cylinder": UsdLux.CylinderLight, "sun": UsdLux.DistantLight, "dome": UsdLux.DomeLight}
    made = schema[light.kind].Define(stage, light.path)
    matrix = np.eye(4)
    matrix[:3, :3] = _looking(light) if light.kind == "sun" else emitter.axes
    matrix[3, :3] = light.position
    _place(made, matrix)
    sizes = {"rect": {"width": 2.0, "height": 2.0}, "cylinder": {"length": 2.0, "radius": 1.0}}
    sizes |= {"sphere": {"radius": 1.0}, "disk": {"radius": 1.0}}
    sizes |= {"sun": {"angle": 2.0 * math.degrees(emitter.half_angle)}}
    for name, said in sizes.get(light.kind, {}).items():
        made.GetPrim().GetAttribute(f"inputs:{name}").Set(said)
    factor = (area(light) if emitter.normalized else 1.0) / 2.0**emitter.exposure
    peak = max(light.intensity) or 1.0
    made.CreateIntensityAttr(peak * factor)
    made.CreateNormalizeAttr(emitter.normalized)
    made.CreateExposureAttr(emitter.exposure)
    if len(set(light.intensity)) > 1:
        made.CreateColorAttr(Gf.Vec3f(*(each / peak for each in light.intensity)))
    return made


def _delta(stage: Usd.Stage, light: Light) -> UsdLux.BoundableLightBase | UsdLux.NonboundableLightBase:
    factor = 4.0 if light.kind == "point" else 1.0  # UsdLux: a normalised sphere light has I = intensity / 4
    peak = max(light.intensity) or 1.0
    matrix = np.eye(4)
    if light.kind == "point":
        made: UsdLux.SphereLight | UsdLux.DistantLight = UsdLux.SphereLight.Define(stage, light.path)
        made.CreateNormalizeAttr(True)
        made.CreateTreatAsPointAttr(True)
        if light.shaping is not None:
            matrix[:3, :3] = _looking(light)
        matrix[3, :3] = light.position
    else:
        made = UsdLux.DistantLight.Define(stage, light.path)
        made.CreateAngleAttr(0.0)
        matrix[:3, :3] = _looking(light)
    made.CreateIntensityAttr(peak * factor)
    if len(set(light.intensity)) > 1:
        made.CreateColorAttr(Gf.Vec3f(*(each / peak for each in light.intensity)))
    if light.shadow_map is not None:
        said = light.shadow_map
        for name, kind, value in (
            ("resolution", Sdf.ValueTypeNames.Int, said.resolution),
            ("bias", Sdf.ValueTypeNames.Float, said.bias),
            ("normalBias", Sdf.ValueTypeNames.Float, said.normal_bias),
        ):
            made.GetPrim().CreateAttribute(f"notabug:shadowMap:{name}", kind).Set(value)
    _place(made, matrix)
    return made


def _looking(light: Light) -> Floats:
    """Axes (3, 3) whose -z is the light's direction."""
    z = -np.asarray(light.direction)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def _material(stage: Usd.Stage, material: Material, files: list[tuple[str, Texture]]) -> None:
    parent = Sdf.Path(material.path).GetParentPath()
    if not stage.GetPrimAtPath(parent):
        UsdGeom.Scope.Define(stage, parent)
    made = UsdShade.Material.Define(stage, material.path)
    shader = UsdShade.Shader.Define(stage, f"{material.path}/Surface")
    reflects = any(material.specular) or any(material.mirror) or any(material.transmission)
    shader.CreateIdAttr(REFLECTION if reflects else PREVIEW)

    def say(name: str, kind: Sdf.ValueTypeName, value: Gf.Vec3f | float | str) -> None:
        shader.CreateInput(name, kind).Set(value)

    types = Sdf.ValueTypeNames
    if material.texture >= 0:
        source = _texture(stage, material.path, *files[material.texture])
        shader.CreateInput("diffuseColor", types.Color3f).ConnectToSource(source)
    else:
        say("diffuseColor", types.Color3f, Gf.Vec3f(*material.diffuse))
    if reflects:
        for name, colour in (("specularColor", material.specular), ("mirror", material.mirror)):
            say(name, types.Color3f, Gf.Vec3f(*colour))
        say("transmission", types.Color3f, Gf.Vec3f(*material.transmission))
        say("exponent", types.Float, material.exponent)
        say("ior", types.Float, material.ior)
        say("lobe", types.Token, material.lobe)
        say("cosineWeighted", types.Bool, material.cosine_weighted)
        made.CreateSurfaceOutput(CONTEXT).ConnectToSource(shader.CreateOutput("surface", types.Token))
        return
    surface = material.preview
    if surface is None:
        say("useSpecularWorkflow", types.Int, 1)
        say("specularColor", types.Color3f, Gf.Vec3f(0.0))
        say("metallic", types.Float, 0.0)
    else:
        _preview(stage, material.path, shader, surface, files)
    if material.opacity_map >= 0:
        source = _texture(stage, material.path, *files[material.opacity_map], name="Opacity", output="r")
        shader.CreateInput("opacity", types.Float).ConnectToSource(source)
        say("opacityThreshold", types.Float, material.cutoff)
    elif material.opacity < 1.0:
        say("opacity", types.Float, material.opacity)
    if material.is_clear and surface is not None:
        say("opacityMode", types.Token, "presence")
    made.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", types.Token))


def _preview(
    stage: Usd.Stage, path: str, shader: UsdShade.Shader, surface: Preview, files: list[tuple[str, Texture]]
) -> None:
    """The inputs of ``shader`` beside its diffuse colour and opacity."""
    types = Sdf.ValueTypeNames
    shader.CreateInput("useSpecularWorkflow", types.Int).Set(int(surface.specular_workflow))
    shader.CreateInput("specularColor", types.Color3f).Set(Gf.Vec3f(*surface.specular))
    shader.CreateInput("ior", types.Float).Set(surface.ior)
    shader.CreateInput("clearcoat", types.Float).Set(surface.clearcoat)
    shader.CreateInput("clearcoatRoughness", types.Float).Set(surface.clearcoat_roughness)
    numbers = (("metallic", surface.metallic), ("roughness", surface.roughness))
    for (name, value), index in zip(numbers, surface.maps[:2], strict=True):
        made = shader.CreateInput(name, types.Float)
        if index < 0:
            made.Set(value)
        else:
            made.ConnectToSource(_texture(stage, path, *files[index], name=name.capitalize(), output="r"))
    colours = (("emissiveColor", types.Color3f, surface.emission), ("normal", types.Normal3f, (0.0, 0.0, 1.0)))
    for (name, kind, colour), index in zip(colours, surface.maps[2:], strict=True):
        made = shader.CreateInput(name, kind)
        if index < 0:
            made.Set(Gf.Vec3f(*colour))
        else:
            made.ConnectToSource(_texture(stage, path, *files[index], name=name.capitalize()))


def _texture(
    stage: Usd.Stage, path: str, file: str, texture: Texture, *, name: str = "Texture", output: str = "rgb"
) -> UsdShade.Output:
    types = Sdf.ValueTypeNames
    reader = UsdShade.Shader.Define(stage, f"{path}/Coordinates")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", types.String).Set("st")
    shader = UsdShade.Shader.Define(stage, f"{path}/{name}")
    shader.CreateIdAttr("UsdUVTexture")
    shader.CreateInput("file", types.Asset).Set(Sdf.AssetPath(f"./{file}"))
    shader.CreateInput("sourceColorSpace", types.Token).Set(texture.colour_space)
    shader.CreateInput("wrapS", types.Token).Set(texture.wrap_s)
    shader.CreateInput("wrapT", types.Token).Set(texture.wrap_t)
    shader.CreateInput("st", types.Float2).ConnectToSource(reader.CreateOutput("result", types.Float2))
    return shader.CreateOutput(output, types.Float3 if output == "rgb" else types.Float)


def _object(stage: Usd.Stage, each: Object, materials: tuple[Material, ...]) -> None:
    if isinstance(each, Mesh):
        _mesh(stage, each, materials)
        return
    made = UsdGeom.Sphere.Define(stage, each.path)
    made.CreateRadiusAttr(each.radius)
    _place(made, each.to_world)
    _bind(stage, made, each, materials)


def _mesh(stage: Usd.Stage, mesh: Mesh, materials: tuple[Material, ...]) -> UsdGeom.Mesh:
    matrix = _frame(mesh)
    linear = matrix[:3, :3]
    made = UsdGeom.Mesh.Define(stage, mesh.path)
    made.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    made.CreatePointsAttr(_rows(Vt.Vec3fArray, _local(mesh, matrix)))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.counts, np.int32)))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.corners, np.int32)))
    if np.linalg.det(linear) < 0:  # the reader turns a mirrored mesh round, unless it says that it is left-handed
        made.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    if mesh.normals is not None:
        made.CreateNormalsAttr(_rows(Vt.Vec3fArray, mesh.normals @ linear.T))
        made.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    if mesh.uv is not None:
        kind = Sdf.ValueTypeNames.TexCoord2fArray
        made_uv = UsdGeom.PrimvarsAPI(made).CreatePrimvar("st", kind, UsdGeom.Tokens.faceVarying)
        made_uv.Set(_rows(Vt.Vec2fArray, mesh.uv))
    _place(made, matrix)
    _bind(stage, made, mesh, materials)
    return made


def _local(mesh: Mesh, matrix: Floats) -> Floats:
    return np.asarray((mesh.points - matrix[3, :3]) @ np.linalg.inv(matrix[:3, :3]), np.float32).astype(np.float64)


def _frame(mesh: Mesh) -> Floats:
    """The mesh's own frame where its points are float32 in it, else one about the middle of its bounds."""
    again = _local(mesh, mesh.to_world) @ mesh.to_world[:3, :3] + mesh.to_world[3, :3]
    if np.allclose(again, mesh.points, rtol=0.0, atol=_EXACT * np.abs(mesh.points).max()):
        return mesh.to_world
    frame = np.eye(4)
    frame[3, :3] = (mesh.points.min(axis=0) + mesh.points.max(axis=0)) / 2.0
    return frame


def _rows(kind: type[Vt.Vec3fArray] | type[Vt.Vec2fArray], rows: Floats) -> Vt.Vec3fArray | Vt.Vec2fArray:
    return kind.FromNumpy(np.ascontiguousarray(rows, np.float32))


def _bind(stage: Usd.Stage, made: UsdGeom.Gprim, each: Mesh | Sphere, materials: tuple[Material, ...]) -> None:
    material = UsdShade.Material.Get(stage, materials[each.material].path)
    UsdShade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(material)
