"""A value of another type than its schema's, and what rounding does to values that must be exact, wherever read."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.reader import read_scene

Write = Callable[..., Path]

OWN = (
    "# grey",
    'token outputs:notabug:surface.connect = </Scene/Grey/Own.outputs:out>\ndef Shader "Own"\n{\n'
    'uniform token info:id = "notabug:Reflection"\nfloat inputs:exponent = 3\nfloat inputs:ior = 1\n'
    "color3f inputs:specularColor = (1, 1, 1)\ncolor3f inputs:mirror = (0, 0, 0)\n"
    'token inputs:lobe = "phong"\nbool inputs:cosineWeighted = 1\ntoken outputs:out\n}',
)
MORE = (
    OWN,
    (
        "# scene",
        'def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])\n{\nrel material:binding = </Scene/Grey>\n'
        'double radius = 1\ntoken visibility = "inherited"\n}\n'
        'def DistantLight "Sun"\n{\nfloat inputs:angle = 0\nfloat inputs:exposure = 0\n'
        "color3f inputs:color = (1, 1, 1)\nbool inputs:enableColorTemperature = 0\n}",
    ),
    ("# texture", "float4 inputs:scale = (1, 1, 1, 1)\n"),
    (
        "# settings",
        "uniform float pixelAspectRatio = 1\nuniform float4 dataWindowNDC = (0, 0, 1, 1)\n"
        'uniform token aspectRatioConformPolicy = "expandAperture"\n',
    ),
    ("# square", 'int[] primvars:st:indices = [0, 1, 2, 3]\nuniform token orientation = "rightHanded"\n'),
    ("# group", 'float3 xformOp:rotateXYZ = (0, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:rotateXYZ"]\n'),
)
# One that the text format takes for each, where the schema has another: USD hands it on as it is.
MISTYPED = ("inf", "3", "(1, 2)", '"word"', "[(1, 2, 3)]", "</Scene>", "None", "[nan]", "@gone.png@")
_ATTRIBUTE = re.compile(r"^(\s*)((?:uniform )?)([\w\[\]]+) ([\w:]+) = (.*?)( \()?$")


def attributes(text: str) -> list[int]:
    return [k for k, line in enumerate(text.split("\n")) if _ATTRIBUTE.match(line) and "string c" not in line]


def refusal(path: Path) -> SceneError | None:
    """The fault that the scene at ``path`` is refused for."""
    try:
        read_scene(path)
    except SceneError as error:
        return error
    return None


@pytest.mark.parametrize("value", MISTYPED)
@pytest.mark.parametrize("authored", ["as the schema says", "opaque", "double[]"])
@pytest.mark.sweep_except(
    "as the schema says-</Scene>",
    "as the schema says-None",
    "as the schema says-[nan",
    "opaque-(1, 2)",
    'opaque-"word"',
    "opaque-[(1, 2, 3)",
    "double[]-inf",
    "double[]-3",
    "double[]-@gone.png@",
)
def test_any_value_anywhere_is_read_or_refused_by_name(value: str, authored: str, write: Write, tmp_path: Path) -> None:
    """Never an error of Python, and never the file alone: the prim and the attribute, which is what is to be mended."""
    text = write(*MORE).read_text()
    lines = text.split("\n")
    found = attributes(text)
    assert len(found) > 40
    for number in found:
        match = _ATTRIBUTE.match(lines[number])
        assert match
        indent, uniform, kind, name, _, opens = match.groups()
        kind = kind if authored.startswith("as") else authored
        path = tmp_path / "changed.usda"
        path.write_text(
            "\n".join([*lines[:number], f"{indent}{uniform}{kind} {name} = {value}{opens or ''}", *lines[number + 1 :]])
        )
        error = refusal(path)
        if error and error.what != "cannot be opened as a USD stage":
            assert error.where.startswith("/"), f"{name}: {error}"
            assert not error.where.startswith(str(tmp_path)), f"{name}: {error}"


BINDING = "rel material:binding = </Scene/Picture>"


@pytest.mark.parametrize(
    ("old", "new", "where", "fragment"),
    [
        ("asset inputs:file = @./picture.png@", 'string inputs:file = "a"', ".inputs:file", "the path of a file"),
        ("asset inputs:file = @./picture.png@", "asset[] inputs:file = [@a@]", ".inputs:file", "the path of a file"),
        ('token inputs:wrapS = "clamp"', "float inputs:wrapS = 1", ".inputs:wrapS", "a word, got 1.0"),
        ('string inputs:varname = "st"', "int inputs:varname = 3", ".inputs:varname", "a word, got 3"),
        ("focalLength = 20", "focalLength = </Scene>", "/Scene/Camera.focalLength", "a number"),
        ("float focalLength = 20", "float[] focalLength = [1, 2]", "/Scene/Camera.focalLength", "a number"),
        ("int[] faceVertexCounts = [4]", "float[] faceVertexCounts = [4]", ".faceVertexCounts", "whole numbers"),
        ("bool treatAsPoint = 1", 'token treatAsPoint = "yes"', "/Scene/Light.treatAsPoint", "true or false"),
        ("uniform int2 resolution = (32, 32)", "uniform float2 resolution = (32.5, 32)", ".resolution", "whole"),
        (
            'uniform token subdivisionScheme = "none"',
            "uniform int subdivisionScheme = 0",
            ".subdivisionScheme",
            "a word",
        ),
        (
            "point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]",
            "float2[] points = [(0, 0), (2, 0), (2, 1), (0, 1)]",
            "/Scene/Group/Square.points",
            "3-vectors",
        ),
        (
            "double3 xformOp:translate = (1, 2, 3)",
            "double3 xformOp:translate = </Scene>",
            ".xformOpOrder",
            "refuses it",
        ),
        (BINDING, BINDING.replace("rel", "token"), "/Scene/Group/Square.material:binding", "not a relationship"),
    ],
)
def test_mistyped(old: str, new: str, where: str, fragment: str, write: Write) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(write((old, new)))
    assert caught.value.where.endswith(where)
    assert fragment in str(caught.value)


ALMOST = "0.9999999999999998"


def look_at(last: str) -> str:
    rows = f"((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 1e-17), (0, 0, 5, {last}))"
    return f'matrix4d xformOp:transform = {rows}\nuniform token[] xformOpOrder = ["xformOp:transform"]'


CAMERA = (
    'double3 xformOp:translate = (0, 0, 5)\n        uniform token[] xformOpOrder = ["xformOp:translate"]\n    }\n\n'
    '    def SphereLight "Light"'
)


@pytest.mark.parametrize("last", [ALMOST, "1.0000000000000002", "1"])
def test_a_camera_whose_matrix_was_inverted(last: str, write: Write) -> None:
    """``Gf.Matrix4d.SetLookAt().GetInverse()`` leaves such a corner."""
    scene = read_scene(write((CAMERA, look_at(last) + '\n    }\n\n    def SphereLight "Light"')))
    assert scene.camera.to_world.tolist() == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 5, 1]]


def test_every_look_at_of_openusd_is_read(write: Write) -> None:
    from pxr import Gf

    for k in range(24):
        eye = Gf.Vec3d(3.1 * (k % 5) - 6, 2.7 + k / 7, 5.3 - k)
        matrix = Gf.Matrix4d().SetLookAt(eye, Gf.Vec3d(0.1 * k, 0, 0.3), Gf.Vec3d(0, 1, 0)).GetInverse()
        rows = ", ".join(f"({', '.join(repr(float(x)) for x in row)})" for row in matrix)
        text = f'matrix4d xformOp:transform = ({rows})\nuniform token[] xformOpOrder = ["xformOp:transform"]'
        scene = read_scene(write((CAMERA, text + '\n    }\n\n    def SphereLight "Light"')))
        assert scene.camera.to_world[3, :3] == pytest.approx(tuple(eye), abs=1e-12)


def test_a_camera_that_was_written_with_six_digits(write: Write) -> None:
    """It is the nearest rotation, exactly one; what is sheared by more is refused."""
    import numpy as np

    from notabug.scenes_usd.transform import rotation

    matrix = rotation((1, 2, 3), 37.0)

    def text(digits: int) -> str:
        rows = ", ".join(f"({', '.join(f'{x:.{digits}g}' for x in row)})" for row in matrix)
        return f'matrix4d xformOp:transform = ({rows})\nuniform token[] xformOpOrder = ["xformOp:transform"]'

    end = '\n    }\n\n    def SphereLight "Light"'
    turned = read_scene(write((CAMERA, text(6) + end))).camera.to_world[:3, :3]
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(turned, matrix[:3, :3], atol=2e-6)
    with pytest.raises(SceneError, match="sheared"):
        read_scene(write((CAMERA, text(3) + end)))


@pytest.mark.parametrize("last", ["0.999", "2", "0", "-1"])
def test_a_projective_matrix_is_refused(last: str, write: Write) -> None:
    with pytest.raises(SceneError, match=r"/Scene/Camera\.xformOpOrder: the transform to world space is projective"):
        read_scene(write((CAMERA, look_at(last) + '\n    }\n\n    def SphereLight "Light"')))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# settings", "uniform float pixelAspectRatio = 1.0000001"),
        ("# settings", "uniform float4 dataWindowNDC = (0, 1e-8, 0.99999994, 1)"),
        ("float focalLength", "float horizontalApertureOffset = 1e-9\nfloat focalLength"),
        ("float focalLength", "float fStop = 1e-20\nfloat focalLength"),
        ("verticalAperture = 20", "verticalAperture = 19.999999"),
        ("# scene", 'def DistantLight "Sun"\n{\nfloat inputs:angle = 1e-10\n}'),
        ("bool treatAsPoint", "float inputs:diffuse = 0.99999994\nbool treatAsPoint"),
        ("# texture", "float4 inputs:scale = (1, 0.99999994, 1, 1)"),
        ("(0.5, 0.25, 0.125)", "(1.0000001, 0, -1e-10)"),
        ("# preview", "float inputs:clearcoat = 1e-9"),
        ("# preview", "float inputs:opacity = 1.0000001"),
        ("# group", f"{look_at(ALMOST)}"),
    ],
)
def test_what_is_rounded_has_a_tolerance(old: str, new: str, write: Write) -> None:
    """Values that must be one exact number are that number to a few roundings of float32, in which they are stored."""
    scene = read_scene(write((old, new), (BINDING, BINDING.replace("Picture", "Grey"))))
    (material,) = scene.materials
    assert all(0.0 <= each <= 1.0 for each in (*material.diffuse, material.opacity)), "and is put back into its range"


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("# preview", "float inputs:opacity = 1.001", "/Scene/Grey/Surface.inputs:opacity"),
        ("# preview", "float inputs:clearcoat = 1.001", "/Scene/Grey/Surface.inputs:clearcoat"),
    ],
)
def test_the_tolerance_is_small(old: str, new: str, where: str, write: Write) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(write((old, new), (BINDING, BINDING.replace("Picture", "Grey"))))
    assert caught.value.where == where


def test_animated_and_blocked_values(write: Write) -> None:
    samples = ".timeSamples = {0: @./picture.png@, 1: @./other.png@}"
    with pytest.raises(SceneError, match=r"Texture\.inputs:file: the value is animated"):
        read_scene(write(("asset inputs:file = @./picture.png@", f"asset inputs:file{samples}")))
    with pytest.raises(SceneError, match=r"Square\.visibility: the value is animated"):
        read_scene(write(("# square", 'token visibility.timeSamples = {0: "inherited", 1: "invisible"}')))
    with pytest.raises(SceneError, match=r"Texture\.inputs:file: no such texture file; got no path"):
        read_scene(write(("@./picture.png@", "None")))
    with pytest.raises(SceneError, match=r"Square\.faceVertexCounts: the mesh has no faces"):
        read_scene(write(("int[] faceVertexCounts = [4]", "int[] faceVertexCounts = None")))
    assert read_scene(write(("focalLength = 20", "focalLength = None"))).camera.tan_x == pytest.approx(10 / 50)
