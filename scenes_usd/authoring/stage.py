"""What every scene of the corpus has: header, render settings, camera, lights, materials, meshes, as .usda text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from notabug.scenes_usd.authoring.usda import block, card, indent, integers, number, quote, vector, vectors

Row = tuple[float, ...]


def stage(
    words: dict[str, str],
    parts: Sequence[str],
    *,
    requires: Sequence[str] = (),
    metadata: str = "",
    size: tuple[int, int] = (256, 256),
    up: str = "Y",
) -> bytes:
    """A stage with default prim /Scene: the card ``words``, the children ``parts``; ``metadata`` more lines for it."""
    header = (
        "#usda 1.0\n(\n"
        '    defaultPrim = "Scene"\n'
        '    doc = "Written by python -m notabug.scenes_usd.authoring; edit the script there, not this file."\n'
        "    metersPerUnit = 1\n"
        '    renderSettingsPrimPath = "/Render/Settings"\n'
        f'    upAxis = "{up}"\n'
        ")\n"
    )
    about = indent("\n".join(each for each in (card(words, requires), metadata) if each))
    root = block(f'def Xform "Scene" (\n{about}\n)', *parts)
    settings = (
        'def RenderSettings "Settings"\n{\n'
        "    rel camera = </Scene/Camera>\n"
        f"    uniform int2 resolution = {vector(size)}\n"
        "}"
    )
    render = block('def Scope "Render"', settings)
    return f"{header}\n{root}\n\n{render}\n".encode()


APERTURE = 20.0


def camera(eye: Row, turn: Row, tangent: float, clip: tuple[float, float], aspect: float = 1.0) -> str:
    """/Scene/Camera at ``eye``, turned from -z by ``turn`` degrees; its picture is 2 ``tangent`` wide at distance 1."""
    return (
        'def Camera "Camera"\n{\n'
        f"    float2 clippingRange = {vector(clip)}\n"
        f"    float focalLength = {number(APERTURE / (2 * tangent))}\n"
        f"    float horizontalAperture = {number(APERTURE)}\n"
        f"    float verticalAperture = {number(APERTURE / aspect)}\n"
        '    token projection = "perspective"\n'
        f"{indent(placed(eye, turn))}"
        "}"
    )


def looking(direction: Row) -> Row:
    """The turn about x, then y, that brings -z into ``direction``: for cameras and distant lights, y up."""
    x, y, z = direction
    pitch = math.degrees(math.asin(y / math.sqrt(x * x + y * y + z * z)))
    return (pitch, math.degrees(math.atan2(-x, -z)), 0.0)


def orbiting_camera(target: Row, turn: Row) -> str:
    """/Scene/Camera about ``target``; how far from it, each variant of ``distances`` says."""
    return (
        'def Camera "Camera"\n{\n'
        f"    float horizontalAperture = {number(APERTURE)}\n"
        f"    float verticalAperture = {number(APERTURE)}\n"
        '    token projection = "perspective"\n'
        f"    double3 xformOp:translate = {vector(target)}\n"
        f"    float3 xformOp:rotateXYZ = {vector(turn)}\n"
        "    uniform token[] xformOpOrder = "
        '["xformOp:translate", "xformOp:rotateXYZ", "xformOp:translate:distance"]\n'
        "}"
    )


def distances(half_width: float, each: Iterable[str]) -> str:
    """The variant set ``camera_distance``: 2 ``half_width`` at the target fill the picture from every distance."""
    return variant_set("camera_distance", {name: over("Camera", *_from(float(name), half_width)) for name in each})


def _from(distance: float, half_width: float) -> tuple[str, ...]:
    return (
        f"float2 clippingRange = {vector((distance / 10, distance * 10))}",
        f"float focalLength = {number(APERTURE / 2 * distance / half_width)}",
        f"double3 xformOp:translate:distance = {vector((0.0, 0.0, distance))}",
    )


def point_light(position: Row, intensity: float) -> str:
    """/Scene/Light, a point: ``intensity`` is UsdLux's, four times the radiant intensity in W/sr."""
    return (
        'def SphereLight "Light"\n{\n'
        f"    float inputs:intensity = {number(intensity)}\n"
        "    bool inputs:normalize = 1\n"
        "    bool treatAsPoint = 1\n"
        f"{indent(placed(position))}"
        "}"
    )


def distant_light(turn: Row, irradiance: float) -> str:
    """/Scene/Light, parallel, shining along -z turned by ``turn`` degrees; ``irradiance`` [W/m^2] face on."""
    return (
        'def DistantLight "Light"\n{\n'
        "    float inputs:angle = 0\n"
        f"    float inputs:intensity = {number(irradiance)}\n"
        f"{indent(placed(turn=turn))}"
        "}"
    )


def placed(where: Row = (), turn: Row = ()) -> str:
    """Lines of transform ops: turned by ``turn`` degrees about x, then y, then z, and moved to ``where``."""
    ops = {"double3 xformOp:translate": where, "float3 xformOp:rotateXYZ": turn}
    lines = [f"{name} = {vector(numbers)}" for name, numbers in ops.items() if numbers]
    order = ", ".join(quote(name.split()[1]) for name, numbers in ops.items() if numbers)
    return "".join(f"{line}\n" for line in [*lines, f"uniform token[] xformOpOrder = [{order}]"] if lines)


def materials(*each: str) -> str:
    """/Scene/Materials with the given materials."""
    return block('def Scope "Materials"', *each)


def lambert(name: str, colour: Row, opacity: float = 1.0) -> str:
    """A Lambertian UsdPreviewSurface of constant albedo."""
    lines = [f"color3f inputs:diffuseColor = {vector(colour)}"]
    if opacity < 1.0:
        lines.append(f"float inputs:opacity = {number(opacity)}")
    return block(f'def Material "{name}"', _surface(name), _preview("\n    ".join(lines)))


def textured(name: str, file: str) -> str:
    """A Lambertian UsdPreviewSurface whose albedo is the raw, clamped texture ``file``, looked up by ``st``."""
    path = f"/Scene/Materials/{name}"
    texture = (
        'def Shader "Texture"\n{\n'
        '    uniform token info:id = "UsdUVTexture"\n'
        f"    asset inputs:file = @{file}@\n"
        '    token inputs:sourceColorSpace = "raw"\n'
        f"    float2 inputs:st.connect = <{path}/Coordinates.outputs:result>\n"
        '    token inputs:wrapS = "clamp"\n'
        '    token inputs:wrapT = "clamp"\n'
        "    float3 outputs:rgb\n"
        "}"
    )
    coordinates = (
        'def Shader "Coordinates"\n{\n'
        '    uniform token info:id = "UsdPrimvarReader_float2"\n'
        '    string inputs:varname = "st"\n'
        "    float2 outputs:result\n"
        "}"
    )
    albedo = f"color3f inputs:diffuseColor.connect = <{path}/Texture.outputs:rgb>"
    return block(f'def Material "{name}"', _surface(name), _preview(albedo), texture, coordinates)


def mesh(
    name: str,
    points: Iterable[Row],
    faces: Sequence[Sequence[int]],
    *,
    material: str = "",
    normals: Iterable[Row] = (),
    uv: Iterable[Row] = (),
    lines: Sequence[str] = (),
    how: str = "def Mesh",
) -> str:
    """A polygon mesh; ``normals`` and ``uv`` per point; ``lines`` are further properties, ``how`` its specifier."""
    bound = ' (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)' if material else ""
    body = [f"rel material:binding = </Scene/Materials/{material}>"] if material else []
    body.append(f"int[] faceVertexCounts = {integers(len(face) for face in faces)}")
    body.append(f"int[] faceVertexIndices = {integers(corner for face in faces for corner in face)}")
    if rows := list(normals):
        body.append(f'normal3f[] normals = {vectors(rows)} (\n    interpolation = "vertex"\n)')
    body.append(f"point3f[] points = {vectors(points)}")
    if rows := list(uv):
        body.append(f'texCoord2f[] primvars:st = {vectors(rows)} (\n    interpolation = "vertex"\n)')
    body.append('uniform token subdivisionScheme = "none"')
    text = indent("\n".join([*body, *lines]))
    return f'{how} "{name}"{bound}\n{{\n{text}\n}}'


def variant_set(name: str, variants: Mapping[str, str]) -> str:
    """A variant set; a variant's text is what its braces hold, or, where it ends with one, also what precedes them."""
    body = "\n".join(f"{quote(each)} {_braced(text)}" for each, text in variants.items())
    return f'variantSet "{name}" = {{\n{indent(body)}\n}}'


def _braced(text: str) -> str:
    return text if text.startswith(("{", "(")) else f"{{\n{indent(text)}\n}}"


def over(path: str, *lines: str) -> str:
    """Opinions about the prim at the relative ``path``: ``lines`` inside nested overs."""
    text = "\n".join(lines)
    for name in reversed(path.split("/")):
        text = f"over {quote(name)}\n{{\n{indent(text)}\n}}"
    return text


def selected(**defaults: str) -> str:
    """Metadata of the default prim: its variant sets and the choice that is the default."""
    lines = "\n".join(f"    string {name} = {quote(chosen)}" for name, chosen in defaults.items())
    names = ", ".join(quote(default) for default in defaults)
    sets = f"[{names}]" if len(defaults) > 1 else names
    return f"variants = {{\n{lines}\n}}\nprepend variantSets = {sets}"


def sphere(name: str, radius: float, material: str, lines: str = "") -> str:
    """An analytic sphere; ``lines`` place it."""
    return (
        f'def Sphere "{name}" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)\n{{\n'
        f"    rel material:binding = </Scene/Materials/{material}>\n"
        f"    double radius = {number(radius)}\n"
        f"{indent(lines)}"
        "}"
    )


def as_float32(rows: Iterable[Row]) -> list[Row]:
    """The coordinates a reader will see."""
    return [tuple(float(np.float32(round(x, 8))) for x in row) for row in rows]


def _surface(name: str) -> str:
    return f"token outputs:surface.connect = </Scene/Materials/{name}/Surface.outputs:surface>"


def _preview(albedo: str) -> str:
    return (
        'def Shader "Surface"\n{\n'
        '    uniform token info:id = "UsdPreviewSurface"\n'
        f"    {albedo}\n"
        "    float inputs:metallic = 0\n"
        "    color3f inputs:specularColor = (0, 0, 0)\n"
        "    int inputs:useSpecularWorkflow = 1\n"
        "    token outputs:surface\n"
        "}"
    )
