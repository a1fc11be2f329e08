"""Camera, lights, materials, textures, variants, intent: what a well-formed stage comes out as."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.srgb import decode_srgb

Write = Callable[..., Path]
GREY = ("rel material:binding = </Scene/Picture>", "rel material:binding = </Scene/Grey>")


def test_import_is_light() -> None:
    """The command line starts without OpenUSD."""
    code = "import sys, notabug.scenes_usd.reader, notabug.scenes_usd.catalogue; sys.exit('pxr' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_camera(write: Write) -> None:
    scene = read_scene(write())
    camera = scene.camera
    assert (camera.path, scene.width, scene.height) == ("/Scene/Camera", 32, 32)
    assert (camera.tan_x, camera.tan_y) == (0.5, 0.5)
    assert (camera.near, camera.far) == (pytest.approx(0.1, rel=1e-7), 100)
    assert camera.to_world.tolist() == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 5, 1]]


def test_default_resolution(write: Write) -> None:
    scene = read_scene(write(("uniform int2 resolution = (32, 32)", "")))
    assert (scene.width, scene.height) == (256, 256)


@pytest.mark.parametrize(
    ("policy", "size", "tangents"),
    [
        ("", (64, 32), (1.0, 0.5)),
        ("expandAperture", (64, 32), (1.0, 0.5)),
        ("expandAperture", (32, 64), (0.5, 1.0)),
        ("cropAperture", (64, 32), (0.5, 0.25)),
        ("cropAperture", (32, 64), (0.25, 0.5)),
        ("adjustApertureWidth", (64, 32), (1.0, 0.5)),
        ("adjustApertureHeight", (64, 32), (0.5, 0.25)),
        ("adjustPixelAspectRatio", (64, 64), (0.5, 0.5)),
    ],
)
def test_conform_policy(policy: str, size: tuple[int, int], tangents: tuple[float, float], write: Write) -> None:
    line = f'uniform token aspectRatioConformPolicy = "{policy}"' if policy else ""
    camera = read_scene(write(("(32, 32)", str(size)), ("# settings", line))).camera
    assert (camera.tan_x, camera.tan_y) == tangents


def test_uniform_camera_scale_is_taken_out(write: Write) -> None:
    scaled = (
        '(0, 0, 5)\n        uniform token[] xformOpOrder = ["xformOp:translate"]',
        "(0, 0, 5)\nfloat3 xformOp:rotateXYZ = (10, 20, 30)\ndouble3 xformOp:scale = (2, 2, 2)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]',
    )
    camera = read_scene(write(scaled)).camera
    linear = camera.to_world[:3, :3]
    np.testing.assert_allclose(linear @ linear.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(linear) == pytest.approx(1)
    assert camera.to_world[3, :3].tolist() == [0, 0, 5]
    assert (camera.near, camera.far) == (pytest.approx(0.2), pytest.approx(200))
    assert (camera.tan_x, camera.tan_y) == (0.5, 0.5)


def test_point_light(write: Write) -> None:
    (light,) = read_scene(write(("bool treatAsPoint", "float inputs:exposure = 3\nbool treatAsPoint"))).lights
    assert (light.kind, light.position, light.intensity) == ("point", (1, 2, 3), (8, 8, 8))


def test_point_light_by_radiance(write: Write) -> None:
    """L = 4 on a sphere of radius 1/2: I = L pi r^2 = pi; with normalize the same I needs intensity 4 pi."""
    change = ("bool inputs:normalize = 1", "float inputs:radius = 0.5\ncolor3f inputs:color = (1, 0.5, 0)")
    (light,) = read_scene(write(change)).lights
    assert light.intensity == pytest.approx((math.pi, math.pi / 2, 0))


def test_distant_light(write: Write) -> None:
    sun = (
        'def DistantLight "Sun"\n{\nfloat inputs:angle = 0\nfloat inputs:intensity = 3\nfloat inputs:exposure = -1\n'
        'float xformOp:rotateX = -90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]\n}'
    )
    light = read_scene(write(("# scene", sun))).lights[1]
    assert (light.path, light.kind) == ("/Scene/Sun", "distant")
    assert light.direction == pytest.approx((0, -1, 0))
    assert light.intensity == (1.5, 1.5, 1.5)


def test_lambert(write: Write) -> None:
    (material,) = read_scene(write(GREY, ("# preview", "float inputs:opacity = 0.5"))).materials
    assert (material.path, material.diffuse, material.texture) == ("/Scene/Grey", (0.5, 0.25, 0.125), -1)
    assert material.opacity == 0.5


def test_interface_inputs(write: Write) -> None:
    """A value authored on the material and connected down into the shader."""
    changes = (
        (
            "color3f inputs:diffuseColor = (0.5, 0.25, 0.125)",
            "color3f inputs:diffuseColor.connect = </Scene/Grey.inputs:c>",
        ),
        ("# grey", "color3f inputs:c = (0.25, 0.5, 0.75)"),
    )
    assert read_scene(write(GREY, *changes)).materials[0].diffuse == (0.25, 0.5, 0.75)


def test_reflection_shader_wins(write: Write) -> None:
    shader = """token outputs:notabug:surface.connect = </Scene/Grey/Own.outputs:out>
        def Shader "Own"
        {
            uniform token info:id = "notabug:Reflection"
            color3f inputs:diffuseColor.connect = </Scene/Picture/Texture.outputs:rgb>
            color3f inputs:specularColor = (2, 2, 2)
            float inputs:exponent = 32
            token inputs:lobe = "blinn"
            bool inputs:cosineWeighted = 1
            color3f inputs:mirror = (0.5, 0.5, 0.5)
            color3f inputs:transmission = (0.25, 0.25, 0.25)
            float inputs:ior = 1.5
            token outputs:out
        }"""
    fallback = ("# preview", "color3f inputs:emissiveColor = (1, 1, 1)")  # not asked
    scene = read_scene(write(GREY, ("# grey", shader), fallback))
    (material,) = scene.materials
    assert (material.texture, material.specular, material.exponent, material.lobe) == (0, (2, 2, 2), 32, "blinn")
    assert (material.cosine_weighted, material.mirror, material.ior) == (True, (0.5,) * 3, 1.5)
    assert material.transmission == (0.25,) * 3
    assert scene.textures[0].path.name == "picture.png"


@pytest.mark.parametrize(("space", "stored"), [("raw", "raw"), ("sRGB", "sRGB"), ("auto", "sRGB")])
def test_texture(space: str, stored: str, write: Write) -> None:
    scene = read_scene(write(('"raw"', f'"{space}"')))
    (texture,) = scene.textures
    values = np.arange(12).reshape(2, 2, 3) / 255
    np.testing.assert_array_equal(texture.pixels, values if stored == "raw" else decode_srgb(values))
    assert (texture.wrap_s, texture.wrap_t, texture.colour_space) == ("clamp", "repeat", stored)
    assert scene.materials[scene.objects[0].material].texture == 0


def test_grey_texture_in_auto_is_linear(write: Write, tmp_path: Path, png: Callable[..., bytes]) -> None:
    path = write(('"raw"', '"auto"'))
    (tmp_path / "picture.png").write_bytes(png(bytes([0, 51, 102, 255]), 2, 2, kind=0))
    (texture,) = read_scene(path).textures
    np.testing.assert_array_equal(texture.pixels[:, :, 1], [[0, 0.2], [0.4, 1]])
    assert texture.colour_space == "raw"


def test_srgb_decoding() -> None:
    """IEC 61966-2-1 at its ends, at the joint and at one half."""
    np.testing.assert_allclose(decode_srgb(np.array([0, 0.04045, 0.5, 1])), [0, 0.0031308, 0.214041, 1], rtol=1e-5)


def test_one_texture_for_two_materials(write: Write) -> None:
    changes = (
        (
            "color3f inputs:diffuseColor = (0.5, 0.25, 0.125)",
            "color3f inputs:diffuseColor.connect = </Scene/Picture/Texture.outputs:rgb>",
        ),
        ("# scene", 'def Sphere "Ball"\n{\nrel material:binding = </Scene/Grey>\n}'),
    )
    scene = read_scene(write(*changes))
    assert [each.texture for each in scene.materials] == [0, 0]
    assert len(scene.textures) == 1


def test_usdz(write: Write, tmp_path: Path) -> None:
    from pxr import Sdf, UsdUtils

    path = write()
    package = tmp_path / "square.usdz"
    assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(path)), str(package))
    path.unlink()
    (tmp_path / "picture.png").unlink()
    np.testing.assert_array_equal(read_scene(package).textures[0].pixels, np.arange(12).reshape(2, 2, 3) / 255)


def test_crate(write: Write, tmp_path: Path) -> None:
    from pxr import Usd

    path = write()
    stage = Usd.Stage.Open(str(path))
    stage.GetRootLayer().Export(str(tmp_path / "square.usdc"))
    assert read_scene(tmp_path / "square.usdc").digest() == read_scene(path).digest()


def test_variants(write: Write) -> None:
    path = write()
    before = path.read_bytes()
    one, two = read_scene(path), read_scene(path, {"size": "two"})
    assert (one.variants, two.variants) == ({"size": "one"}, {"size": "two"})
    np.testing.assert_array_equal(next(two.meshes).points, 2 * next(one.meshes).points)
    assert one.digest() != two.digest()
    assert path.read_bytes() == before
    assert read_scene(path).variants == {"size": "one"}, "the choice does not stick"


def test_card(write: Write) -> None:
    card = (
        "string claim",
        'string[] requires = ["uv", "mesh"]\nstring figure = "7"\nstring cites = "someone"\nstring claim',
    )
    found = read_scene(write(card)).card
    assert (found.artifact_class, found.claim) == ("texture", "A square shows its texture.")
    assert (found.requires, found.figure, found.cites, found.intent) == ({"uv", "mesh"}, "7", "someone", "")


@pytest.mark.parametrize("split", ["split02", "split13", "grid15"])
def test_intent(split: str) -> None:
    """The triangles' intent is the quad, and in its place they are the quad's own scene."""
    drawn = read_scene("texture/uneven_quad", {"split": split})
    whole = read_scene("texture/uneven_quad")
    assert whole.intent is None
    assert drawn.intent is not None
    assert not any(each.has_ngons for each in drawn.meshes)
    intended = drawn.as_intended()
    assert [each.path for each in intended.objects] == ["/Scene/Quad/Intent"]
    (meant,), (quad,) = intended.meshes, whole.meshes
    np.testing.assert_array_equal(meant.points, quad.points)
    assert meant.uv is not None
    assert quad.uv is not None
    np.testing.assert_array_equal(meant.uv, quad.uv)
    assert intended.materials[meant.material].texture == 0


def test_an_opaque_rgba_texture_is_one_without_alpha(write: Write, tmp_path: Path, png: Callable[..., bytes]) -> None:
    path = write(('sourceColorSpace = "raw"', 'sourceColorSpace = "auto"'))
    texels = np.arange(12, dtype=np.uint8).reshape(4, 3) * 20
    rgba = np.concatenate([texels, np.full((4, 1), 255, np.uint8)], axis=1)
    (tmp_path / "picture.png").write_bytes(png(rgba.tobytes(), 2, 2, kind=6))
    (texture,) = read_scene(path).textures
    np.testing.assert_array_equal(texture.pixels, decode_srgb(texels.reshape(2, 2, 3) / 255))
    assert texture.colour_space == "sRGB", "UsdPreviewSurface: eight bits of three or four channels"


def test_a_texture_fills_the_display_window_of_its_file(write: Write, tmp_path: Path) -> None:
    """As in OpenImageIO's texture system: what the data window leaves out is black, what goes beyond is not shown."""
    import OpenImageIO

    path = write(("picture.png", "picture.exr"))
    texels = np.arange(1, 13, dtype=np.float32).reshape(2, 2, 3) / 16
    for left, shown in ((1, [[0, 1], [0, 3]]), (-1, [[2, 0], [4, 0]])):
        spec = OpenImageIO.ImageSpec(2, 2, 3, OpenImageIO.FLOAT)
        spec.x, spec.full_width, spec.full_height = left, 2, 2
        target = OpenImageIO.ImageOutput.create(str(tmp_path / "picture.exr"))
        assert target.open(str(tmp_path / "picture.exr"), spec)
        assert target.write_image(texels)
        assert target.close()
        (texture,) = read_scene(path).textures
        by_number = np.concatenate([np.zeros((1, 3)), texels.reshape(4, 3)])
        np.testing.assert_array_equal(texture.pixels, by_number[np.array(shown)])
