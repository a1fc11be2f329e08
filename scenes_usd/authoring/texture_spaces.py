"""What all scenes of texture space have: a picture that no mistake leaves as it is, and a material that shows it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from notabug.scenes_usd.authoring.usda import block, indent

SIZE = (96, 96)
REQUIRES = ("mesh", "texture", "uv", "distant_light")
PICTURE = "textures/letters.png"
CITES = (
    "UsdUVTexture: wrapS, wrapT, sourceColorSpace; Heckbert 1990, What are the coordinates of a pixel?, in Graphics "
    "Gems; OpenGL 4.6 specification, sections 8.14.2 and 8.14.3"
)


def picture() -> npt.NDArray[np.uint8]:
    """(4, 5, 3): five texels across and four down, dark and bright by turns and no two alike, so that no turn, flip,
    shift or exchange of channels looks the same.
    """
    rows = [
        [(214, 40, 36), (20, 24, 30), (240, 196, 60), (36, 60, 40), (90, 150, 235)],
        [(16, 30, 60), (225, 225, 215), (70, 20, 60), (120, 220, 90), (44, 22, 12)],
        [(250, 130, 30), (30, 14, 40), (60, 190, 190), (20, 36, 20), (200, 70, 170)],
        [(28, 50, 24), (150, 100, 240), (40, 34, 10), (235, 235, 130), (12, 30, 44)],
    ]
    return np.array(rows, np.uint8)


def wraps(along_s: str, along_t: str) -> tuple[str, str]:
    """A texture's wrap modes."""
    return f'token inputs:wrapS = "{along_s}"', f'token inputs:wrapT = "{along_t}"'


def space(name: str) -> str:
    """The colour space of a texture's file."""
    return f'token inputs:sourceColorSpace = "{name}"'


def looked_up(material: str, node: str) -> str:
    """A texture's coordinates: what the shader ``node`` of its material gives."""
    return f"float2 inputs:st.connect = </Scene/Materials/{material}/{node}.outputs:result>"


def painted(name: str, *lines: str, file: str = PICTURE, alpha: bool = False) -> str:
    """A Lambertian whose albedo is the texture ``file``; ``lines`` are further properties of the texture.

    With ``alpha`` the file's alpha is the surface's opacity.

    What a variant says of the texture must not be among them: what a layer says itself is stronger.
    """
    path = f"/Scene/Materials/{name}"
    opacity = f"    float inputs:opacity.connect = <{path}/Texture.outputs:a>\n" if alpha else ""
    output = "    float outputs:a\n" if alpha else ""
    return block(
        f'def Material "{name}"',
        f"token outputs:surface.connect = <{path}/Surface.outputs:surface>",
        'def Shader "Surface"\n{\n'
        '    uniform token info:id = "UsdPreviewSurface"\n'
        f"    color3f inputs:diffuseColor.connect = <{path}/Texture.outputs:rgb>\n"
        "    float inputs:metallic = 0\n"
        f"{opacity}"
        "    color3f inputs:specularColor = (0, 0, 0)\n"
        "    int inputs:useSpecularWorkflow = 1\n"
        "    token outputs:surface\n"
        "}",
        'def Shader "Texture"\n{\n'
        '    uniform token info:id = "UsdUVTexture"\n'
        f"    asset inputs:file = @./{file}@\n"
        f"{output}"
        "    float3 outputs:rgb\n"
        f"{indent(chr(10).join(lines))}\n"
        "}",
        'def Shader "Coordinates"\n{\n'
        '    uniform token info:id = "UsdPrimvarReader_float2"\n'
        '    string inputs:varname = "st"\n'
        "    float2 outputs:result\n"
        "}",
    )
