"""The features of UsdPreviewSurface and of textures: what is said of the surface and its shaders, and what it means."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.scenes_usd.authoring.usda import block, quote

SURFACE = "UsdPreviewSurface specification 2.6"
LOOK = "/Scene/Materials/Look"

GLOSSY = "color3f inputs:diffuseColor = (0.18, 0.32, 0.5)"
METAL = "color3f inputs:diffuseColor = (0.9, 0.6, 0.3)"
GREY = "color3f inputs:diffuseColor = (0.6, 0.5, 0.4)"
MATT = f"{GREY}\nint inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0, 0, 0)"
THIRD = "0.32941177"  # 84 of 255: a texture can say it
LEVEL = "(-1.0039216, -1.0039216, -1, 0)"  # the bias that makes 128 of 255 nought
UNLIT = MATT.replace("0.6, 0.5, 0.4", "0, 0, 0")


@dataclass(frozen=True, slots=True)
class Feature:
    """One scene: what is said of the surface, of further shaders of its material, and of lights."""

    name: str
    claim: str
    surface: str = GLOSSY
    shaders: tuple[str, ...] = ()
    lights: tuple[str, ...] = ()
    tile: tuple[str, ...] = ()
    cites: str = SURFACE


def texture(
    file: str, *, space: str = "raw", wrap: str = "clamp", lines: str = "", name: str = "Texture", st: str = "Reader"
) -> str:
    """A UsdUVTexture of the picture ``file`` that is looked up by the shader ``st``."""
    body = (
        'uniform token info:id = "UsdUVTexture"',
        f"asset inputs:file = @./textures/{file}.png@",
        f"token inputs:sourceColorSpace = {quote(space)}",
        f"float2 inputs:st.connect = <{LOOK}/{st}.outputs:result>",
        f"token inputs:wrapS = {quote(wrap)}",
        f"token inputs:wrapT = {quote(wrap)}",
        *([lines] if lines else []),
        *(f"float outputs:{channel}" for channel in "rgba"),
        "float3 outputs:rgb",
    )
    return block(f'def Shader "{name}"', "\n".join(body))


def reader(varname: str = "st", kind: str = "float2", name: str = "Reader") -> str:
    """A UsdPrimvarReader."""
    body = (
        f'uniform token info:id = "UsdPrimvarReader_{kind}"',
        f"string inputs:varname = {quote(varname)}",
        f"{kind} outputs:result",
    )
    return block(f'def Shader "{name}"', "\n".join(body))


def transform(**inputs: str) -> str:
    """A UsdTransform2d between the reader and the texture."""
    kinds = {"rotation": "float", "scale": "float2", "translation": "float2"}
    body = (
        'uniform token info:id = "UsdTransform2d"',
        f"float2 inputs:in.connect = <{LOOK}/Reader.outputs:result>",
        *(f"{kinds[name]} inputs:{name} = {value}" for name, value in inputs.items()),
        "float2 outputs:result",
    )
    return block('def Shader "Move"', "\n".join(body))


def connected(kind: str, name: str, output: str, to: str = "Texture") -> str:
    """The surface's input ``name`` from an output of the shader ``to``."""
    return f"{kind} inputs:{name}.connect = <{LOOK}/{to}.outputs:{output}>"


def painted(file: str = "checks", moved: str = "", **options: str) -> dict[str, object]:
    """A matt surface with the texture as its diffuse colour."""
    shaders = (texture(file, st="Move" if moved else "Reader", **options), reader(), *([moved] if moved else []))
    matt = MATT.replace(GREY, connected("color3f", "diffuseColor", "rgb"))
    return {"surface": matt, "shaders": shaders}


def mapped(kind: str, name: str, output: str, file: str, base: str = GLOSSY, **options: str) -> dict[str, object]:
    """A surface with the texture as its input ``name``."""
    return {"surface": f"{base}\n{connected(kind, name, output)}", "shaders": (texture(file, **options), reader())}


def cut() -> dict[str, object]:
    """A matt surface with a texture as its diffuse colour, that its alpha cuts."""
    shown = painted("leaf", space="sRGB")
    more = f"{connected('float', 'opacity', 'a')}\nfloat inputs:opacityThreshold = 0.5"
    return {**shown, "surface": f"{shown['surface']}\n{more}"}


def _normals(file: str, bias: str = "(-1, -1, -1, 0)") -> dict[str, object]:
    lines = f"float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = {bias}"
    return mapped("normal3f", "normal", "rgb", file, f"{GLOSSY}\nfloat inputs:roughness = 0.4", lines=lines)


def feature(name: str, claim: str, **what: object) -> Feature:
    """The scene ``name``; ``what`` are further fields of Feature."""
    return Feature(name, claim, **what)  # type: ignore[arg-type]


def rough(value: str, base: str = GLOSSY) -> str:
    """``base`` with a roughness."""
    return f"{base}\nfloat inputs:roughness = {value}"


SPECULAR = f"{GLOSSY}\nint inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.3, 0.12, 0.05)"

FEATURES = (
    feature(
        "diffuse",
        "A surface without specular reflection is Lambertian: the diffuse colour over pi times the irradiance.",
        surface=MATT,
    ),
    feature(
        "default",
        "An input that is not authored has the specification's value: metallic workflow, roughness .5, ior 1.5.",
    ),
    feature("roughness_1", "Roughness 1 gives the widest highlight; alpha is its square.", surface=rough("1")),
    feature("roughness_33", "Roughness .33 as a constant is alpha .11.", surface=rough(THIRD)),
    feature(
        "roughness_33_map",
        "Roughness .33 in a raw texture is the very picture of roughness .33 as a constant.",
        **mapped("float", "roughness", "r", "third"),
    ),
    feature(
        "roughness_15",
        "Roughness .15 gives a highlight that the texture's colour does not tint.",
        surface=rough("0.15"),
    ),
    feature(
        "roughness_map",
        "Roughness varies with the texture's red channel, which is read raw.",
        **mapped("float", "roughness", "r", "ramp"),
    ),
    feature(
        "roughness_green",
        "Roughness is the channel that is connected: here green.",
        **mapped("float", "roughness", "g", "packed"),
    ),
    feature(
        "metallic_1",
        "A metal has no diffuse reflection; its highlight has the diffuse colour.",
        surface=rough("0.4", f"{METAL}\nfloat inputs:metallic = 1"),
    ),
    feature(
        "metallic_half",
        "Metallic .5 is half way between the dielectric and the metal.",
        surface=rough("0.4", f"{METAL}\nfloat inputs:metallic = 0.5"),
    ),
    feature(
        "metallic_map",
        "Metallic varies with the texture's blue channel, which is read raw.",
        **mapped("float", "metallic", "b", "packed", rough("0.4", METAL)),
    ),
    feature(
        "ior_133",
        "The index of refraction sets the reflectance at normal incidence: .02 for 1.33.",
        surface=f"{GLOSSY}\nfloat inputs:ior = 1.33",
    ),
    feature(
        "ior_24",
        "The index of refraction 2.4 reflects .17 at normal incidence.",
        surface=f"{GLOSSY}\nfloat inputs:ior = 2.4",
    ),
    feature(
        "specular",
        "In the specular workflow the specular colour is the reflectance at normal incidence.",
        surface=SPECULAR,
    ),
    feature(
        "specular_metallic",
        "In the specular workflow metallic 1 changes nothing.",
        surface=f"{SPECULAR}\nfloat inputs:metallic = 1",
    ),
    feature(
        "specular_ior",
        "In the specular workflow the index of refraction changes nothing of the base.",
        surface=f"{SPECULAR}\nfloat inputs:ior = 2.4",
    ),
    feature(
        "metallic_specular",
        "In the metallic workflow the specular colour changes nothing.",
        surface=f"{GLOSSY}\ncolor3f inputs:specularColor = (1, 0, 0)",
    ),
    feature(
        "specular_white",
        "A white specular colour reflects everything at every angle; what is left for the diffuse part is nothing.",
        surface=f"{GLOSSY}\nint inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (1, 1, 1)",
    ),
    feature(
        "clearcoat",
        "A clearcoat is a second highlight without colour over the base.",
        surface=f"{MATT}\nfloat inputs:clearcoat = 1\nfloat inputs:clearcoatRoughness = 0.2",
    ),
    feature(
        "clearcoat_half",
        "Clearcoat .5 is half of that highlight.",
        surface=f"{MATT}\nfloat inputs:clearcoat = 0.5\nfloat inputs:clearcoatRoughness = 0.3",
    ),
    feature(
        "clearcoat_glossy",
        "The base keeps its own roughness below the clearcoat.",
        surface=rough("0.6", f"{GLOSSY}\nfloat inputs:clearcoat = 0.7\nfloat inputs:clearcoatRoughness = 0.15"),
    ),
    feature(
        "emission",
        "Emission is added to what the surface reflects, and no light is cast by it.",
        surface=f"{MATT}\ncolor3f inputs:emissiveColor = (0.05, 0.2, 0.4)",
    ),
    feature(
        "emission_map",
        "Emission varies with the texture, which is decoded from sRGB.",
        **mapped("color3f", "emissiveColor", "rgb", "checks", UNLIT, space="sRGB"),
    ),
    feature("normal_flat", "A normal map that says straight up everywhere changes nothing.", **_normals("flat", LEVEL)),
    feature(
        "normal_bumps",
        "A normal map turns the normal in tangent space: red along growing s, green along growing t.",
        **_normals("bumps"),
    ),
    feature(
        "occlusion", "Occlusion changes nothing of direct light.", surface=f"{GLOSSY}\nfloat inputs:occlusion = 0.3"
    ),
    feature(
        "opacity",
        "Opacity .5 of a matt surface shows half of what lies behind it.",
        surface=f"{MATT}\nfloat inputs:opacity = 0.5",
    ),
    feature(
        "opacity_threshold",
        "An opacity below the threshold is no surface at all.",
        surface=f"{MATT}\nfloat inputs:opacity = 0.4\nfloat inputs:opacityThreshold = 0.5",
    ),
    feature(
        "opacity_above",
        "An opacity from the threshold on is a whole surface.",
        surface=f"{MATT}\nfloat inputs:opacity = 0.6\nfloat inputs:opacityThreshold = 0.5",
    ),
    feature(
        "opacity_map",
        "Opacity from a texture's channel is how much of the surface is seen; the rest is what lies behind it.",
        **mapped("float", "opacity", "r", "ramp", MATT),
    ),
    feature(
        "opacity_alpha",
        "With a threshold a texture's alpha, which is not decoded, cuts the surface where it is less, with its shadow.",
        **cut(),
    ),
    feature(
        "opacity_equal",
        "An opacity from a texture that is as large as the threshold, or larger, is a whole surface.",
        **mapped("float", "opacity", "r", "half", f"{MATT}\nfloat inputs:opacityThreshold = 0.5019608"),
    ),
    feature("texture_raw", "A raw texture is not decoded.", **painted()),
    feature(
        "texture_srgb",
        "An sRGB texture is decoded by the curve of IEC 61966-2-1, before it is filtered.",
        **painted(space="sRGB"),
    ),
    feature(
        "texture_alpha",
        "A texture's colours are straight: an alpha that nothing is connected to changes nothing.",
        **painted("leaf", space="sRGB"),
    ),
    feature("texture_auto", "Of an 8-bit picture with three channels auto means sRGB.", **painted(space="auto")),
    feature(
        "texture_origin", "The texture coordinate (0, 0) is the lower left corner of the picture.", **painted("corners")
    ),
    feature(
        "texture_scale_bias",
        "Scale and bias are applied to what is read, in this order.",
        **painted(lines="float4 inputs:scale = (0.5, 0.25, 1, 1)\nfloat4 inputs:bias = (0.1, 0.2, 0, 0)"),
    ),
    feature(
        "texture_repeat",
        "Repeat: the coordinate's fraction is looked up.",
        **painted("corners", transform(scale="(2, 3)"), wrap="repeat"),
    ),
    feature(
        "texture_clamp",
        "Clamp: beyond the border the border is seen.",
        **painted("corners", transform(scale="(2, 3)", translation="(-0.5, -1)")),
    ),
    feature(
        "texture_mirror",
        "Mirror: every other copy is turned round.",
        **painted("corners", transform(scale="(2, 3)"), wrap="mirror"),
    ),
    feature(
        "texture_black",
        "Black: beyond the border there is black.",
        **painted("corners", transform(scale="(2, 3)", translation="(-0.5, -1)"), wrap="black"),
    ),
    feature(
        "texture_rotation",
        "UsdTransform2d scales first, then turns counter-clockwise, then moves.",
        **painted("corners", transform(rotation="30", scale="(0.7, 0.9)", translation="(0.3, 0.05)")),
    ),
    feature(
        "texture_set",
        "The texture coordinates are those whose name the reader gives.",
        surface=painted()["surface"],
        shaders=(texture("corners"), reader("other")),
    ),
    feature(
        "display_colour",
        "A primvar reader takes the colour that the mesh has.",
        surface=MATT.replace(GREY, connected("color3f", "diffuseColor", "result", "Colour")),
        shaders=(reader("displayColor", "float3", "Colour"),),
        tile=("color3f[] primvars:displayColor = [(0.2, 0.5, 0.3)]",),
    ),
)
