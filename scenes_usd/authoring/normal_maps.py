"""What all scenes of normal maps have: a surface whose normals come from a picture, and the pictures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring.shapes import cells
from notabug.scenes_usd.authoring.stage import Row, as_float32, mesh
from notabug.scenes_usd.authoring.usda import block, vector

Floats = npt.NDArray[np.float64]

SIZE = (128, 128)
CITES = (
    "UsdPreviewSurface specification 2.6: normal; Peercy, Airey and Cabral 1997, Efficient bump mapping hardware; "
    "Schuessler et al. 2017, Microfacet-based normal mapping for robust Monte Carlo path tracing; "
    "Estevez, Lecocq and Stein 2019, A microfacet-based shadowing function to solve the bump terminator problem"
)
SPECIFIED = (-1.0, -1.0, -1.0, 0.0)  # the bias that the specification asks for, with scale 2
LEVEL = (-1.0039215686, -1.0039215686, -1.0, 0.0)  # the one that makes 128 of 255 nought


def mapped(name: str, file: str, colour: Row, *, roughness: float, bias: Row = SPECIFIED) -> str:
    """A glossy UsdPreviewSurface with the normal map ``file``, scale 2 and ``bias``, repeated along ``st``.

    Without a file the variants of the scene say one.
    """
    path = f"/Scene/Materials/{name}"
    texture = block(
        'def Shader "Normals"',
        'uniform token info:id = "UsdUVTexture"',
        f"float4 inputs:bias = {vector(bias)}",
        *([f"asset inputs:file = @{file}@"] if file else []),
        "float4 inputs:scale = (2, 2, 2, 1)",
        'token inputs:sourceColorSpace = "raw"',
        f"float2 inputs:st.connect = <{path}/Coordinates.outputs:result>",
        'token inputs:wrapS = "repeat"',
        'token inputs:wrapT = "repeat"',
        "float3 outputs:rgb",
    )
    coordinates = block(
        'def Shader "Coordinates"',
        'uniform token info:id = "UsdPrimvarReader_float2"',
        'string inputs:varname = "st"',
        "float2 outputs:result",
    )
    normals = f"normal3f inputs:normal.connect = <{path}/Normals.outputs:rgb>"
    return block(f'def Material "{name}"', _surface(path), glossy(colour, roughness, normals), texture, coordinates)


def unmapped(name: str, colour: Row, *, roughness: float) -> str:
    """The same surface without a map."""
    return block(f'def Material "{name}"', _surface(f"/Scene/Materials/{name}"), glossy(colour, roughness))


def glossy(colour: Row, roughness: float, *lines: str) -> str:
    """The shader of a dielectric UsdPreviewSurface."""
    return block(
        'def Shader "Surface"',
        'uniform token info:id = "UsdPreviewSurface"',
        f"color3f inputs:diffuseColor = {vector(colour)}",
        *lines,
        f"float inputs:roughness = {roughness:g}",
        "token outputs:surface",
    )


def _surface(path: str) -> str:
    return f"token outputs:surface.connect = <{path}/Surface.outputs:surface>"


def tile(name: str, material: str, *, rise: float, mirrored: bool, repeats: float = 1.0, cut: int = 24) -> str:
    """The part of a paraboloid over the square from -1 to 1, ``rise`` high, facing +z; u grows along x, v along y.

    ``mirrored``: u grows from the middle to both sides instead. Corners in the middle are of both halves.
    """
    points: list[Row] = []
    normals: list[Row] = []
    uv: list[Row] = []
    for j in range(cut + 1):
        for i in range(cut + 1):
            x, y = (2.0 * k / cut - 1.0 for k in (i, j))
            points.append((x, y, rise * (1.0 - 0.5 * (x * x + y * y))))
            normal = np.array([rise * x, rise * y, 1.0])
            normals.append(tuple((normal / np.linalg.norm(normal)).tolist()))
            u = 0.5 * abs(x) if mirrored else 0.5 * (x + 1.0)
            uv.append((repeats * u, repeats * 0.5 * (y + 1.0)))
    faces = [face for a, b, c, d in cells(cut, cut) for face in ((a, b, c), (a, c, d))]
    return mesh(name, as_float32(points), faces, material=material, normals=as_float32(normals), uv=as_float32(uv))


def encoded(vectors: Floats) -> npt.NDArray[np.uint8]:
    """Unit vectors (h, w, 3), row 0 at the top, as bytes: 127.5 (n + 1), rounded."""
    size = np.linalg.norm(vectors, axis=2, keepdims=True)
    return np.ascontiguousarray(np.round((vectors / size + 1.0) * 127.5).astype(np.uint8))


def places(size: int) -> tuple[Floats, Floats]:
    """u and v (size, size) of the texels of a picture, row 0 at the top."""
    row, column = np.mgrid[0:size, 0:size] + 0.5
    return column / size, 1.0 - row / size
