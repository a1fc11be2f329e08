"""A small stage that follows the contract, and a way to change one thing in it."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

STAGE = """#usda 1.0
(
    defaultPrim = "Scene"
    renderSettingsPrimPath = "/Render/Settings"
)

def Xform "Scene" (
    customData = {
        dictionary notabug = {
            string class = "texture"
            string claim = "A square shows its texture."
        }
    }
    variants = {
        string size = "one"
    }
    prepend variantSets = "size"
)
{
    def Camera "Camera"
    {
        float2 clippingRange = (0.1, 100)
        float focalLength = 20
        float horizontalAperture = 20
        float verticalAperture = 20
        double3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def SphereLight "Light"
    {
        float inputs:intensity = 4
        bool inputs:normalize = 1
        bool treatAsPoint = 1
        double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def Material "Grey"
    {
        token outputs:surface.connect = </Scene/Grey/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.5, 0.25, 0.125)
            int inputs:useSpecularWorkflow = 1
            # preview
            token outputs:surface
        }
        # grey
    }

    def Material "Picture"
    {
        token outputs:surface.connect = </Scene/Picture/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Scene/Picture/Texture.outputs:rgb>
            int inputs:useSpecularWorkflow = 1
            token outputs:surface
        }
        def Shader "Texture"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./picture.png@
            token inputs:sourceColorSpace = "raw"
            float2 inputs:st.connect = </Scene/Picture/Coordinates.outputs:result>
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "repeat"
            # texture
            float3 outputs:rgb
        }
        def Shader "Coordinates"
        {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }
    }

    def Xform "Group"
    {
        # group
        def Mesh "Square" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            rel material:binding = </Scene/Picture>
            int[] faceVertexCounts = [4]
            int[] faceVertexIndices = [0, 1, 2, 3]
            normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)] (
                interpolation = "vertex"
            )
            point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]
            texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
                interpolation = "vertex"
            )
            uniform token subdivisionScheme = "none"
            # square
        }
    }

    # scene

    variantSet "size" = {
        "one" {
        }
        "two" {
            over "Group"
            {
                float3 xformOp:scale = (2, 2, 2)
                uniform token[] xformOpOrder = ["xformOp:scale"]
            }
        }
    }
}

def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel camera = </Scene/Camera>
        uniform int2 resolution = (32, 32)
        # settings
    }
}
"""

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """``write((old, new), ...)``: the path of the stage with these replacements, each of which must match once."""
    (tmp_path / "picture.png").write_bytes(_png(bytes(range(12)), 2, 2))

    def replaced(*changes: tuple[str, str], name: str = "square.usda") -> Path:
        text = STAGE
        for old, new in changes:
            assert text.count(old) == 1, f"{old!r} occurs {text.count(old)} times"
            text = text.replace(old, new)
        path = tmp_path / name
        path.write_text(text)
        return path

    return replaced


def _png(data: bytes, width: int, height: int, kind: int = 2) -> bytes:
    """An 8-bit PNG of colour type ``kind``: 0 grey, 2 RGB, 6 RGB with alpha."""
    stride = len(data) // height
    rows = b"".join(b"\0" + data[i * stride : (i + 1) * stride] for i in range(height))

    def chunk(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


@pytest.fixture
def png() -> Callable[..., bytes]:
    return _png
