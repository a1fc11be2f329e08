"""The features of preview/*: what is said of the surface, of its shaders and of lights, and what that means."""

from __future__ import annotations

from dataclasses import dataclass

from notabug.scenes_usd.authoring.stage import looking, mesh, over, placed
from notabug.scenes_usd.authoring.usda import block, quote

SURFACE = "UsdPreviewSurface specification 2.6"
LUX = "UsdLux schema"
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


def _normals(file: str, bias: str = "(-1, -1, -1, 0)") -> dict[str, object]:
    lines = f"float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = {bias}"
    return mapped("normal3f", "normal", "rgb", file, f"{GLOSSY}\nfloat inputs:roughness = 0.4", lines=lines)


def _f(name: str, claim: str, **what: object) -> Feature:
    return Feature(name, claim, **what)  # type: ignore[arg-type]


def light(lines: str) -> tuple[str, ...]:
    """What is said of the key light beside what the base says."""
    return (over("Key", *lines.splitlines()),)


PLACE = (-0.9, 1.1, 1.8)  # of a light with a size; what it lights is about the origin
HIDDEN = tuple(over(name, 'token visibility = "invisible"') for name in ("Key", "Fill"))
CARD = mesh(
    "Card",
    [(-0.35, -0.3, 0.8), (0.1, -0.3, 0.8), (0.1, 0.15, 0.8), (-0.35, 0.15, 0.8)],
    [(0, 1, 2, 3)],
    material="Back",
)


def soft(kind: str, lines: str, more: tuple[str, ...] = (CARD,), api: str = "") -> dict[str, object]:
    """A matt tile, a card before it and one light of another ``kind`` in the place of the others."""
    towards = placed(PLACE, looking(tuple(-part for part in PLACE)))
    made = block(f'def {kind}Light "Soft"{api}', f"{lines}\n{towards}")
    return {"surface": MATT, "lights": (*HIDDEN, made, *more), "cites": LUX}


def beam(lines: str) -> dict[str, object]:
    """A point light with a cone."""
    point = "float inputs:intensity = 60\nbool inputs:normalize = 1\nbool treatAsPoint = 1"
    return soft("Sphere", f"{point}\n{lines}", (), ' (\n    prepend apiSchemas = ["ShapingAPI"]\n)')


def rough(value: str, base: str = GLOSSY) -> str:
    """``base`` with a roughness."""
    return f"{base}\nfloat inputs:roughness = {value}"


SPECULAR = f"{GLOSSY}\nint inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.3, 0.12, 0.05)"

FEATURES = (
    _f(
        "diffuse",
        "A surface without specular reflection is Lambertian: the diffuse colour over pi times the irradiance.",
        surface=MATT,
    ),
    _f(
        "default",
        "An input that is not authored has the specification's value: metallic workflow, roughness .5, ior 1.5.",
    ),
    _f("roughness_1", "Roughness 1 gives the widest highlight; alpha is its square.", surface=rough("1")),
    _f("roughness_33", "Roughness .33 as a constant is alpha .11.", surface=rough(THIRD)),
    _f(
        "roughness_33_map",
        "Roughness .33 in a raw texture is the very picture of roughness .33 as a constant.",
        **mapped("float", "roughness", "r", "third"),
    ),
    _f(
        "roughness_15",
        "Roughness .15 gives a highlight that the texture's colour does not tint.",
        surface=rough("0.15"),
    ),
    _f(
        "roughness_map",
        "Roughness varies with the texture's red channel, which is read raw.",
        **mapped("float", "roughness", "r", "ramp"),
    ),
    _f(
        "roughness_green",
        "Roughness is the channel that is connected: here green.",
        **mapped("float", "roughness", "g", "packed"),
    ),
    _f(
        "metallic_1",
        "A metal has no diffuse reflection; its highlight has the diffuse colour.",
        surface=rough("0.4", f"{METAL}\nfloat inputs:metallic = 1"),
    ),
    _f(
        "metallic_half",
        "Metallic .5 is half way between the dielectric and the metal.",
        surface=rough("0.4", f"{METAL}\nfloat inputs:metallic = 0.5"),
    ),
    _f(
        "metallic_map",
        "Metallic varies with the texture's blue channel, which is read raw.",
        **mapped("float", "metallic", "b", "packed", rough("0.4", METAL)),
    ),
    _f(
        "ior_133",
        "The index of refraction sets the reflectance at normal incidence: .02 for 1.33.",
        surface=f"{GLOSSY}\nfloat inputs:ior = 1.33",
    ),
    _f(
        "ior_24",
        "The index of refraction 2.4 reflects .17 at normal incidence.",
        surface=f"{GLOSSY}\nfloat inputs:ior = 2.4",
    ),
    _f(
        "specular",
        "In the specular workflow the specular colour is the reflectance at normal incidence.",
        surface=SPECULAR,
    ),
    _f(
        "specular_metallic",
        "In the specular workflow metallic 1 changes nothing.",
        surface=f"{SPECULAR}\nfloat inputs:metallic = 1",
    ),
    _f(
        "specular_ior",
        "In the specular workflow the index of refraction changes nothing of the base.",
        surface=f"{SPECULAR}\nfloat inputs:ior = 2.4",
    ),
    _f(
        "metallic_specular",
        "In the metallic workflow the specular colour changes nothing.",
        surface=f"{GLOSSY}\ncolor3f inputs:specularColor = (1, 0, 0)",
    ),
    _f(
        "specular_white",
        "A white specular colour reflects everything at every angle; what is left for the diffuse part is nothing.",
        surface=f"{GLOSSY}\nint inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (1, 1, 1)",
    ),
    _f(
        "clearcoat",
        "A clearcoat is a second highlight without colour over the base.",
        surface=f"{MATT}\nfloat inputs:clearcoat = 1\nfloat inputs:clearcoatRoughness = 0.2",
    ),
    _f(
        "clearcoat_half",
        "Clearcoat .5 is half of that highlight.",
        surface=f"{MATT}\nfloat inputs:clearcoat = 0.5\nfloat inputs:clearcoatRoughness = 0.3",
    ),
    _f(
        "clearcoat_glossy",
        "The base keeps its own roughness below the clearcoat.",
        surface=rough("0.6", f"{GLOSSY}\nfloat inputs:clearcoat = 0.7\nfloat inputs:clearcoatRoughness = 0.15"),
    ),
    _f(
        "emission",
        "Emission is added to what the surface reflects, and no light is cast by it.",
        surface=f"{MATT}\ncolor3f inputs:emissiveColor = (0.05, 0.2, 0.4)",
    ),
    _f(
        "emission_map",
        "Emission varies with the texture, which is decoded from sRGB.",
        **mapped("color3f", "emissiveColor", "rgb", "checks", UNLIT, space="sRGB"),
    ),
    _f("normal_flat", "A normal map that says straight up everywhere changes nothing.", **_normals("flat", LEVEL)),
    _f(
        "normal_bumps",
        "A normal map turns the normal in tangent space: red along growing s, green along growing t.",
        **_normals("bumps"),
    ),
    _f("occlusion", "Occlusion changes nothing under direct light.", surface=f"{GLOSSY}\nfloat inputs:occlusion = 0.3"),
    _f(
        "opacity",
        "Opacity .5 of a matt surface shows half of what lies behind it.",
        surface=f"{MATT}\nfloat inputs:opacity = 0.5",
    ),
    _f(
        "opacity_threshold",
        "An opacity below the threshold is no surface at all.",
        surface=f"{MATT}\nfloat inputs:opacity = 0.4\nfloat inputs:opacityThreshold = 0.5",
    ),
    _f(
        "opacity_above",
        "An opacity from the threshold on is a whole surface.",
        surface=f"{MATT}\nfloat inputs:opacity = 0.6\nfloat inputs:opacityThreshold = 0.5",
    ),
    _f("texture_raw", "A raw texture is not decoded.", **painted()),
    _f(
        "texture_srgb",
        "An sRGB texture is decoded by the curve of IEC 61966-2-1, before it is filtered.",
        **painted(space="sRGB"),
    ),
    _f("texture_auto", "Of an 8-bit picture with three channels auto means sRGB.", **painted(space="auto")),
    _f(
        "texture_origin", "The texture coordinate (0, 0) is the lower left corner of the picture.", **painted("corners")
    ),
    _f(
        "texture_scale_bias",
        "Scale and bias are applied to what is read, in this order.",
        **painted(lines="float4 inputs:scale = (0.5, 0.25, 1, 1)\nfloat4 inputs:bias = (0.1, 0.2, 0, 0)"),
    ),
    _f(
        "texture_repeat",
        "Repeat: the coordinate's fraction is looked up.",
        **painted("corners", transform(scale="(2, 3)"), wrap="repeat"),
    ),
    _f(
        "texture_clamp",
        "Clamp: beyond the border the border is seen.",
        **painted("corners", transform(scale="(2, 3)", translation="(-0.5, -1)")),
    ),
    _f(
        "texture_mirror",
        "Mirror: every other copy is turned round.",
        **painted("corners", transform(scale="(2, 3)"), wrap="mirror"),
    ),
    _f(
        "texture_black",
        "Black: beyond the border there is black.",
        **painted("corners", transform(scale="(2, 3)", translation="(-0.5, -1)"), wrap="black"),
    ),
    _f(
        "texture_rotation",
        "UsdTransform2d scales first, then turns counter-clockwise, then moves.",
        **painted("corners", transform(rotation="30", scale="(0.7, 0.9)", translation="(0.3, 0.05)")),
    ),
    _f(
        "texture_set",
        "The texture coordinates are those whose name the reader gives.",
        surface=painted()["surface"],
        shaders=(texture("corners"), reader("other")),
    ),
    _f(
        "display_colour",
        "A primvar reader takes the colour that the mesh has.",
        surface=MATT.replace(GREY, connected("color3f", "diffuseColor", "result", "Colour")),
        shaders=(reader("displayColor", "float3", "Colour"),),
        tile=("color3f[] primvars:displayColor = [(0.2, 0.5, 0.3)]",),
    ),
    _f(
        "light_point",
        "A sphere light that is treated as a point falls off with the square of the distance.",
        surface=MATT,
        lights=(over("Fill", 'token visibility = "invisible"'),),
        cites=LUX,
    ),
    _f(
        "light_distant",
        "A distant light without an angle is parallel and falls off not at all.",
        surface=MATT,
        lights=(over("Key", 'token visibility = "invisible"'),),
        cites=LUX,
    ),
    _f(
        "light_exposure",
        "Exposure e multiplies by two to the power of e.",
        surface=MATT,
        lights=light("float inputs:exposure = -1.5"),
        cites=LUX,
    ),
    _f(
        "light_colour",
        "The light's colour multiplies its intensity.",
        surface=MATT,
        lights=light("color3f inputs:color = (1, 0.4, 0.1)"),
        cites=LUX,
    ),
    _f(
        "light_temperature",
        "A colour temperature multiplies by the colour of a black body of the same luminance.",
        surface=MATT,
        lights=light("bool inputs:enableColorTemperature = 1\nfloat inputs:colorTemperature = 3000"),
        cites=LUX,
    ),
    _f(
        "light_temperature_off",
        "A colour temperature that is not enabled changes nothing.",
        surface=MATT,
        lights=light("float inputs:colorTemperature = 3000"),
        cites=LUX,
    ),
    _f(
        "light_radius",
        "A normalised light that is treated as a point is as bright at every radius.",
        surface=MATT,
        lights=light("float inputs:radius = 3"),
        cites=LUX,
    ),
    _f(
        "light_sphere",
        "A sphere light has the radiance that its intensity says, and penumbras as its radius makes them.",
        **soft("Sphere", "float inputs:intensity = 30\nfloat inputs:radius = 0.4"),
    ),
    _f(
        "light_sphere_normalised",
        "Normalize divides by the area: the radius sets how soft the light is, not how bright.",
        **soft("Sphere", "float inputs:intensity = 60\nfloat inputs:radius = 0.4\nbool inputs:normalize = 1"),
    ),
    _f(
        "light_rect",
        "A rect light shines from one side, along its -z.",
        **soft("Rect", "float inputs:intensity = 25\nfloat inputs:width = 1.2\nfloat inputs:height = 0.5"),
    ),
    _f(
        "light_rect_normalised",
        "Normalize divides by width times height.",
        **soft(
            "Rect",
            "float inputs:intensity = 16\nfloat inputs:width = 1.2\nfloat inputs:height = 0.5\n"
            "bool inputs:normalize = 1",
        ),
    ),
    _f(
        "light_disk",
        "A disk light shines from one side, along its -z.",
        **soft("Disk", "float inputs:intensity = 30\nfloat inputs:radius = 0.4"),
    ),
    _f(
        "light_cylinder",
        "A cylinder light shines from its side, along its x axis.",
        **soft("Cylinder", "float inputs:intensity = 30\nfloat inputs:length = 1.2\nfloat inputs:radius = 0.12"),
    ),
    _f(
        "light_angle",
        "A distant light's angle is the full width of the sun that it stands for.",
        **soft("Distant", "float inputs:intensity = 2.5\nfloat inputs:angle = 20\nbool inputs:normalize = 1"),
    ),
    _f(
        "light_angle_unnormalised",
        "Without normalize a distant light's intensity is radiance: its angle sets how bright it is.",
        **soft("Distant", "float inputs:intensity = 26\nfloat inputs:angle = 20"),
    ),
    _f(
        "light_dome",
        "A dome light shines from every side alike: a surface that sees all of it reflects pi times its radiance.",
        **soft("Dome", "float inputs:intensity = 0.8"),
    ),
    _f("light_cone", "A cone cuts what a light sends at its angle.", **beam("float inputs:shaping:cone:angle = 16")),
    _f(
        "light_cone_softness",
        "A cone's softness is the share of the angle over which its edge fades.",
        **beam("float inputs:shaping:cone:angle = 24\nfloat inputs:shaping:cone:softness = 0.6"),
    ),
    _f("light_focus", "Focus multiplies by the cosine to its power.", **beam("float inputs:shaping:focus = 30")),
    _f(
        "light_diffuse",
        "The diffuse multiplier leaves the highlight as it is.",
        lights=light("float inputs:diffuse = 0.3"),
        cites=LUX,
    ),
    _f(
        "light_specular",
        "The specular multiplier leaves the diffuse part as it is.",
        lights=light("float inputs:specular = 4"),
        cites=LUX,
    ),
)
