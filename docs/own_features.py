"""The feature files of docs/own-scenes.md, each as an exporter would write it: docs/own_scenes.py writes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

State = Literal["read", "adapted", "refused"]

POINTS = "(-1,-1,-1), (-1,-1,1), (-1,1,-1), (-1,1,1), (1,-1,-1), (1,-1,1), (1,1,-1), (1,1,1)"
BOX = f"""
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]
    point3f[] points = [{POINTS}]"""
SQUARE = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1,-1,0), (1,-1,0), (1,1,0), (-1,1,0)]"""
GRID = """
    int[] faceVertexCounts = [4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,4,3, 1,2,5,4, 3,4,7,6, 4,5,8,7]
    point3f[] points = [(-1,-1,0), (0,-1,0.4), (1,-1,0), (-1,0,0), (0,0,0.8), (1,0,0), (-1,1,0), (0,1,0.2), (1,1,0)]"""
NONE = '\n    uniform token subdivisionScheme = "none"'
UV = "[(0, 0), (1, 0), (1, 1), (0, 1)]"
BIND = "\n    rel material:binding = </World/Look>"


def mesh(body: str, name: str = "Shape", bind: str = BIND) -> str:
    return f'def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])\n{{{bind}{body}\n}}\n'


def solid(kind: str, body: str = "") -> str:
    return f'def {kind} "Shape" (prepend apiSchemas = ["MaterialBindingAPI"])\n{{{BIND}\n{body}\n}}\n'


def shader(inputs: str, extra: str = "") -> str:
    return f"""def Material "Look"
{{
    token outputs:surface.connect = </World/Look/Surface.outputs:surface>
    def Shader "Surface"
    {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
    {extra}
}}
"""


LAMBERT = "int inputs:useSpecularWorkflow = 1\n        color3f inputs:specularColor = (0, 0, 0)"
GREY = shader(f"color3f inputs:diffuseColor = (0.6, 0.5, 0.4)\n        {LAMBERT}")
TEXTURED = f"color3f inputs:diffuseColor.connect = </World/Look/Texture.outputs:rgb>\n        {LAMBERT}"


def clear_by(channel: str) -> str:
    """Opacity from a channel of the texture."""
    return f"float inputs:opacity.connect = </World/Look/Texture.outputs:{channel}>"


def texture(inputs: str = "", name: str = "st", file: str = "picture.png", between: str = "") -> str:
    source = "Move" if between else "Reader"
    wrap = "" if "wrapS" in inputs else 'token inputs:wrapS = "repeat"\ntoken inputs:wrapT = "repeat"'
    return f"""def Shader "Texture"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./{file}@
        float2 inputs:st.connect = </World/Look/{source}.outputs:result>
        {wrap}
        {inputs}
        float3 outputs:rgb
        float outputs:r
        float outputs:a
    }}
    def Shader "Reader"
    {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "{name}"
        float2 outputs:result
    }}
    {between}"""


def painted(inputs: str = "", name: str = "st", file: str = "picture.png", between: str = "") -> str:
    return shader(TEXTURED, texture(inputs, name, file, between))


def square(name: str = "st", extra: str = "") -> str:
    coordinates = f'\n    texCoord2f[] primvars:{name} = {UV} (interpolation = "vertex")'
    return mesh(SQUARE + NONE + coordinates + extra)


CAMERA = """def Camera "Camera"
{
    float2 clippingRange = (0.1, 100)
    float focalLength = 40
    float horizontalAperture = 20
    float verticalAperture = 20
    BODY
    double3 xformOp:translate = (0, 0, 8)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
LIGHT = """def SphereLight "Light"
{
    float inputs:intensity = 60
    bool inputs:normalize = 1
    bool treatAsPoint = 1
    BODY
    double3 xformOp:translate = (3, 4, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
SETTINGS = """def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel camera = </World/Camera>
        uniform int2 resolution = (32, 32)
        BODY
    }
}
"""
PLAIN_LIGHT, PLAIN_CAMERA, PLAIN_SETTINGS = (text.replace("BODY", "") for text in (LIGHT, CAMERA, SETTINGS))


def textured(kind: str) -> str:
    return f'def {kind} "More"\n{{\nasset inputs:texture:file = @./picture.png@\n}}\n'


@dataclass(frozen=True, slots=True)
class Feature:
    """A file with one feature: its parts, and whether it reads as it is, once adapted, or not."""

    group: str
    name: str
    state: State
    shape: str = mesh(BOX + NONE)
    look: str = GREY
    light: str = PLAIN_LIGHT
    camera: str = PLAIN_CAMERA
    settings: str = PLAIN_SETTINGS
    head: str = 'defaultPrim = "World"'
    meta: str = ""
    tail: str = ""
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        world = f'def Xform "World"{self.meta}\n{{\n{self.camera}{self.light}{self.look}{self.shape}}}\n'
        head = f'#usda 1.0\n(\n{self.head}\nrenderSettingsPrimPath = "/Render/Settings"\n)\n'
        return f"{head}{world}{self.settings}{self.tail}"


def instancer(body: str) -> str:
    return f"""def PointInstancer "Many"
{{
    rel prototypes = [</World/Many/Box>, </World/Many/Ball>]
    int[] protoIndices = [0, 1, 0]
    point3f[] positions = [(-1, 0, 0), (0, 1, 0), (1, 0, 0)]
    quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0), (0.7071, 0, 0.7071, 0)]
    float3[] scales = [(0.3, 0.3, 0.3), (0.3, 0.3, 0.3), (0.2, 0.4, 0.2)]
    {body}
    {mesh(BOX + NONE, "Box")}
    def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"]) {{{BIND}
    }}
}}
"""


def moved(name: str, x: float, inner: str, meta: str = "") -> str:
    return f"""def Xform "{name}"{meta}
{{
    double3 xformOp:translate = ({x}, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    {inner}
}}
"""


PART = f'#usda 1.0\n(defaultPrim = "Part")\ndef Xform "Part"\n{{\n{mesh(BOX + NONE, bind="")}}}\n'
INSTANCE = " (\n    instanceable = true\n    prepend references = @./part.usda@\n)"
NESTED = f'#usda 1.0\n(defaultPrim = "Part")\ndef Xform "Part"\n{{\ndef "A"{INSTANCE}\n{{\n}}\n}}\n'
MAYA = """
    double3 xformOp:translate = (0.2, 0, 0)
    float3 xformOp:translate:rotatePivot = (0.1, 0.2, 0.3)
    float3 xformOp:rotateXYZ = (10, 20, 30)
    float3 xformOp:scale = (1, 0.5, 1)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:translate:rotatePivot", "xformOp:rotateXYZ",
        "!invert!xformOp:translate:rotatePivot", "xformOp:scale"]"""
ORIENT = """
    quatf xformOp:orient = (0.9239, 0.3827, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:orient"]"""
MIRROR = """
    matrix4d xformOp:transform = ((-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]"""
HALVES = "".join(
    f"""
    def GeomSubset "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])
    {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = {faces}
        rel material:binding = </World/{look}>
    }}"""
    for name, faces, look in (("Sides", "[0, 1, 2]", "Look"), ("Rest", "[3, 4]", "Other"))
)
OTHER = GREY.replace('"Look"', '"Other"').replace("/Look/", "/Other/").replace("0.6, 0.5, 0.4", "0.1, 0.2, 0.7")
COLOUR = "\n    color3f[] primvars:displayColor = [(0.7, 0.3, 0.2)]"
READER = """def Shader "Colour"
    {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "displayColor"
        float3 inputs:fallback = (1, 0, 1)
        float3 outputs:result
    }"""
VERTICES = "[(1,0,0), (0,1,0), (0,0,1), (1,1,0), (1,0,1), (0,1,1), (1,1,1), (0,0,0)]"
FACES = "[(1,0,0), (0,1,0), (1,0,0), (0,1,0), (1,0,0), (0,0,1)]"
MOVING = f"\n    point3f[] points.timeSamples = {{1: [{POINTS}], 2: [{POINTS.replace('(1,1,1)', '(1,1,2)')}]}}"
STILL = f"\n    point3f[] points.timeSamples = {{1: [{POINTS}], 2: [{POINTS}]}}"
UNPOINTED = BOX.replace(f"\n    point3f[] points = [{POINTS}]", "")
MTLX = """token outputs:mtlx:surface.connect = </World/Look/Standard.outputs:out>
    def Shader "Standard"
    {
        uniform token info:id = "ND_standard_surface_surfaceshader"
        color3f inputs:base_color = (0.2, 0.4, 0.6)
        token outputs:out
    }"""
ONLY_MTLX = f'def Material "Look"\n{{\n    {MTLX}\n}}\n'
ARNOLD = MTLX.replace("mtlx", "arnold").replace("ND_standard_surface_surfaceshader", "arnold:standard_surface")
MOVE = """def Shader "Move"
    {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </World/Look/Reader.outputs:result>
        float inputs:rotation = 30
        float2 inputs:scale = (2, 3)
        float2 inputs:translation = (0.1, 0.2)
        float2 outputs:result
    }"""
GRAPH = f"""def NodeGraph "Graph"
    {{
        float3 outputs:colour.connect = </World/Look/Texture.outputs:rgb>
    }}
    {texture()}"""
FACED = "[0,1,2,3, 1,4,5,2, 3,2,6,7, 2,5,8,6]"
SEAMED = (
    GRID
    + "\n    texCoord2f[] primvars:st = [(0,0), (.5,0), (.5,.5), (0,.5), (1,0), (1,.5), (.5,1), (0,1), (1,1)]"
    + f' (interpolation = "faceVarying")\n    int[] primvars:st:indices = {FACED}'
)

FEATURES = (
    Feature("geometry", "mesh with no subdivisionScheme (Catmull-Clark)", "read", mesh(BOX)),
    Feature(
        "geometry",
        "Catmull-Clark with semi-sharp creases",
        "read",
        mesh(
            BOX + "\n    int[] creaseIndices = [0, 1, 3, 2, 0]\n    int[] creaseLengths = [5]\n"
            "    float[] creaseSharpnesses = [2.5]"
        ),
    ),
    Feature(
        "geometry",
        "Catmull-Clark with corners, boundary edgeOnly",
        "read",
        mesh(
            GRID + "\n    int[] cornerIndices = [4]\n    float[] cornerSharpnesses = [10]\n"
            '    uniform token interpolateBoundary = "edgeOnly"'
        ),
    ),
    Feature("geometry", "Catmull-Clark with smooth texture coordinates and seams", "read", mesh(SEAMED), painted()),
    Feature(
        "geometry",
        "Loop",
        "read",
        mesh(
            "\n    int[] faceVertexCounts = [3, 3, 3, 3]\n    int[] faceVertexIndices = [0,2,1, 0,1,3, 1,2,3, 0,3,2]\n"
            "    point3f[] points = [(1,1,1), (-1,-1,1), (-1,1,-1), (1,-1,-1)]\n"
            '    uniform token subdivisionScheme = "loop"'
        ),
    ),
    Feature("geometry", "bilinear", "read", mesh(BOX + '\n    uniform token subdivisionScheme = "bilinear"')),
    Feature("geometry", "holes", "read", mesh(BOX + NONE + "\n    int[] holeIndices = [1, 2]")),
    Feature("geometry", "leftHanded", "read", mesh(BOX + NONE + '\n    uniform token orientation = "leftHanded"')),
    Feature(
        "geometry",
        "faceVarying normals",
        "read",
        mesh(
            SQUARE
            + NONE
            + '\n    normal3f[] normals = [(0,0,1), (0,0,1), (0,.1,1), (.1,0,1)] (interpolation = "faceVarying")'
        ),
    ),
    Feature(
        "geometry",
        "indexed primvars:normals",
        "read",
        mesh(
            SQUARE + NONE + '\n    normal3f[] primvars:normals = [(0,0,1), (0,.1,1)] (interpolation = "vertex")\n'
            "    int[] primvars:normals:indices = [0, 1, 1, 0]"
        ),
    ),
    Feature("geometry", "GeomSubset material bindings", "read", mesh(BOX + NONE + HALVES), GREY + OTHER),
    Feature("geometry", "GeomSubset on a subdivision surface", "read", mesh(BOX + HALVES), GREY + OTHER),
    Feature("geometry", "PointInstancer, one instance hidden", "read", instancer("int64[] invisibleIds = [0]")),
    Feature("geometry", "PointInstancer of a subdivision surface", "read", instancer("").replace(NONE, "")),
    Feature(
        "geometry",
        "scene-graph instances",
        "read",
        moved("A", -1, "", INSTANCE) + moved("B", 1, "", INSTANCE),
        files={"part.usda": PART},
    ),
    Feature(
        "geometry",
        "nested instances",
        "read",
        moved("A", 0, "", INSTANCE.replace("part", "nested")),
        files={"part.usda": PART, "nested.usda": NESTED},
    ),
    *(
        Feature("geometry", kind, "read", solid(kind))
        for kind in ("Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane")
    ),
    Feature("geometry", "displayColor in the place of a material", "read", mesh(BOX + NONE + COLOUR, bind="")),
    Feature(
        "geometry",
        "displayOpacity",
        "read",
        mesh(BOX + NONE + COLOUR + "\n    float[] primvars:displayOpacity = [0.5]", bind=""),
    ),
    Feature(
        "geometry",
        "displayColor per face",
        "read",
        mesh(BOX + NONE + f'\n    color3f[] primvars:displayColor = {FACES} (interpolation = "uniform")', bind=""),
    ),
    Feature(
        "geometry",
        "displayColor per vertex",
        "adapted",
        mesh(BOX + NONE + f'\n    color3f[] primvars:displayColor = {VERTICES} (interpolation = "vertex")', bind=""),
    ),
    Feature(
        "material",
        "a primvar reader of displayColor (Houdini's way)",
        "read",
        mesh(BOX + NONE + COLOUR),
        shader(f"color3f inputs:diffuseColor.connect = </World/Look/Colour.outputs:result>\n        {LAMBERT}", READER),
    ),
    Feature(
        "material",
        "a primvar reader of a number, with a fallback",
        "read",
        look=shader(
            "float inputs:roughness.connect = </World/Look/Colour.outputs:result>",
            READER.replace("_float3", "_float")
            .replace("displayColor", "wear")
            .replace("(1, 0, 1)", "0.3")
            .replace("float3", "float"),
        ),
    ),
    Feature("geometry", "neither material nor displayColor", "read", mesh(BOX + NONE, bind="")),
    Feature(
        "geometry",
        "doubleSided, and an extent that is wrong",
        "read",
        mesh(BOX + NONE + "\n    uniform bool doubleSided = 1\n    float3[] extent = [(0,0,0), (0,0,0)]"),
    ),
    Feature("geometry", "time samples that stand still", "read", mesh(UNPOINTED + NONE + STILL)),
    Feature("geometry", "animated points", "adapted", mesh(UNPOINTED + NONE + MOVING)),
    Feature(
        "geometry",
        "animated transform",
        "adapted",
        mesh(
            BOX + NONE + "\n    float xformOp:rotateY.timeSamples = {1: 0, 24: 90}\n"
            '    uniform token[] xformOpOrder = ["xformOp:rotateY"]'
        ),
    ),
    Feature("geometry", "pivots and inverted ops, as Maya writes them", "read", mesh(BOX + NONE + MAYA)),
    Feature("geometry", "orient by a quaternion", "read", mesh(BOX + NONE + ORIENT)),
    Feature("geometry", "a mirroring matrix", "read", mesh(BOX + NONE + MIRROR)),
    Feature(
        "geometry",
        "a skeleton (drawn at rest)",
        "read",
        mesh(BOX + NONE) + 'def SkelRoot "Rig"\n{\ndef Skeleton "Bones"\n{\n}\n}\n',
    ),
    Feature(
        "geometry",
        "faces without an area",
        "read",
        mesh(
            "\n    int[] faceVertexCounts = [4, 4]\n    int[] faceVertexIndices = [0,1,2,3, 0,0,1,1]\n"
            "    point3f[] points = [(-1,-1,0), (1,-1,0), (1,1,0), (-1,1,0)]" + NONE
        ),
    ),
    *(
        Feature("geometry", f"{kind} (listed, not drawn)", "read", f'{mesh(BOX + NONE)}def {kind} "Rest"\n{{\n}}\n')
        for kind in ("BasisCurves", "Points", "Volume", "NurbsPatch")
    ),
    Feature(
        "geometry",
        "render and proxy purposes",
        "read",
        mesh(BOX + NONE + '\n    uniform token purpose = "render"')
        + mesh(SQUARE + NONE + '\n    uniform token purpose = "proxy"', "Proxy"),
    ),
    Feature(
        "geometry",
        "a mesh that does not fit its indices",
        "adapted",
        mesh(BOX + NONE) + mesh(SQUARE.replace("[4]", "[3]") + NONE, "Broken"),
    ),
    Feature("stage", "no default prim, Z up, centimetres", "read", head='upAxis = "Z"\nmetersPerUnit = 0.01'),
    Feature("stage", "no render settings", "read", settings=""),
    Feature("stage", "no camera", "read", camera="", settings=""),
    Feature(
        "stage",
        "two cameras, none named",
        "adapted",
        camera=PLAIN_CAMERA + PLAIN_CAMERA.replace('"Camera"', '"Side"'),
        settings="",
    ),
    Feature("stage", "no light", "adapted", light=""),
    Feature(
        "stage",
        "variants without a selection",
        "adapted",
        meta=' (prepend variantSets = "kind")',
        shape=mesh(BOX + NONE) + 'variantSet "kind" = {\n"a" {\n}\n"b" {\n}\n}\n',
    ),
    Feature(
        "camera",
        "orthographic",
        "read",
        camera=CAMERA.replace("BODY", 'token projection = "orthographic"').replace("= 20\n", "= 60\n"),
    ),
    Feature("camera", "aperture offset", "read", camera=CAMERA.replace("BODY", "float verticalApertureOffset = 1")),
    Feature("camera", "fStop (not modelled)", "read", camera=CAMERA.replace("BODY", "float fStop = 2.8")),
    Feature(
        "camera",
        "aperture of another shape, cropped",
        "read",
        camera=PLAIN_CAMERA.replace("verticalAperture = 20", "verticalAperture = 10"),
        settings=SETTINGS.replace("BODY", 'uniform token aspectRatioConformPolicy = "cropAperture"'),
    ),
    Feature(
        "camera",
        "pixels that are not square",
        "read",
        settings=SETTINGS.replace("BODY", "uniform float pixelAspectRatio = 2"),
    ),
    Feature(
        "light",
        "point light with exposure and colour temperature",
        "read",
        light=LIGHT.replace(
            "BODY",
            "float inputs:exposure = 1\n    bool inputs:enableColorTemperature = 1\n"
            "    float inputs:colorTemperature = 4000",
        ),
    ),
    Feature(
        "light",
        "sphere light with a radius",
        "read",
        light=PLAIN_LIGHT.replace("bool treatAsPoint = 1", "float inputs:radius = 0.2"),
    ),
    Feature(
        "light",
        "sphere light too small to tell from a point",
        "read",
        light=PLAIN_LIGHT.replace("bool treatAsPoint = 1", "float inputs:radius = 0.0001"),
    ),
    Feature(
        "light",
        "distant light with the sun's angle",
        "read",
        light='def DistantLight "Sun"\n{\nfloat inputs:intensity = 2\nbool inputs:normalize = 1\n}\n',
    ),
    Feature(
        "light",
        "distant light without an angle",
        "read",
        light='def DistantLight "Sun"\n{\nfloat inputs:intensity = 2\nfloat inputs:angle = 0\n}\n',
    ),
    *(
        Feature("light", kind, "read", light=f'{PLAIN_LIGHT}def {kind} "More"\n{{\n}}\n')
        for kind in ("RectLight", "DiskLight", "CylinderLight", "DomeLight")
    ),
    *(
        Feature("light", f"{kind} with a texture", state, light=PLAIN_LIGHT + textured(kind))
        for kind, state in (("RectLight", "adapted"), ("DomeLight", "read"), ("DomeLight_1", "read"))
    ),
    Feature(
        "light",
        "rectangle, scaled and normalised, with its multipliers",
        "read",
        light='def RectLight "Light"\n{\nfloat inputs:intensity = 40\nbool inputs:normalize = 1\n'
        "float inputs:diffuse = 0.8\n"
        "float inputs:specular = 0.5\ndouble3 xformOp:translate = (0, 0, 6)\nfloat3 xformOp:scale = (2, 3, 1)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]\n}\n',
    ),
    Feature(
        "light",
        "spot light",
        "read",
        light=LIGHT.replace('"Light"', '"Light" (prepend apiSchemas = ["ShapingAPI"])').replace(
            "BODY", "float inputs:shaping:cone:angle = 30"
        ),
    ),
    Feature(
        "light",
        "distant light with the shaping schema, as Houdini writes it",
        "read",
        light='def DistantLight "Sun" (prepend apiSchemas = ["ShapingAPI"])\n{\nfloat inputs:intensity = 2\n}\n',
    ),
    Feature(
        "light",
        "light linking",
        "read",
        light=LIGHT.replace("BODY", "rel collection:lightLink:excludes = </World/Shape>"),
    ),
    Feature("material", "UsdPreviewSurface, diffuse", "read"),
    Feature(
        "material",
        "inputs through the material's interface",
        "read",
        look=shader(f"color3f inputs:diffuseColor.connect = </World/Look.inputs:tint>\n        {LAMBERT}").replace(
            '"Look"\n{', '"Look"\n{\n    color3f inputs:tint = (0.3, 0.6, 0.2)'
        ),
    ),
    Feature("material", "opacity", "read", look=shader(f"float inputs:opacity = 0.5\n        {LAMBERT}")),
    Feature(
        "material", "opacityThreshold", "read", look=shader(f"float inputs:opacityThreshold = 0.5\n        {LAMBERT}")
    ),
    Feature(
        "material",
        "metallic workflow with roughness (Blender's default)",
        "read",
        look=shader("float inputs:roughness = 0.5"),
    ),
    Feature(
        "material",
        "metal",
        "read",
        look=shader("color3f inputs:diffuseColor = (0.9, 0.6, 0.3)\n        float inputs:metallic = 1"),
    ),
    Feature(
        "material",
        "specular colour",
        "read",
        look=shader("int inputs:useSpecularWorkflow = 1\n        color3f inputs:specularColor = (1, 1, 1)"),
    ),
    Feature("material", "clearcoat", "read", look=shader(f"float inputs:clearcoat = 1\n        {LAMBERT}")),
    Feature(
        "material", "emission", "read", look=shader(f"color3f inputs:emissiveColor = (1, 0, 0)\n        {LAMBERT}")
    ),
    Feature(
        "material",
        "normal map",
        "read",
        square(),
        look=shader(
            f"normal3f inputs:normal.connect = </World/Look/Texture.outputs:rgb>\n        {LAMBERT}", texture()
        ),
    ),
    Feature(
        "material",
        "roughness and occlusion maps (without effect on a Lambertian)",
        "read",
        square(),
        look=shader(f"float inputs:roughness.connect = </World/Look/Texture.outputs:r>\n        {LAMBERT}", texture()),
    ),
    Feature(
        "material",
        "specular workflow, glossy",
        "read",
        look=shader(
            "int inputs:useSpecularWorkflow = 1\n        color3f inputs:specularColor = (0.2, 0.1, 0.3)\n"
            "        float inputs:roughness = 0.2\n        float inputs:metallic = 1"
        ),
    ),
    Feature(
        "material",
        "roughness and metallic maps, packed",
        "read",
        square(),
        look=shader(
            "float inputs:roughness.connect = </World/Look/Texture.outputs:g>\n"
            "        float inputs:metallic.connect = </World/Look/Texture.outputs:b>",
            texture('token inputs:sourceColorSpace = "raw"\nfloat outputs:g\nfloat outputs:b'),
        ),
    ),
    Feature(
        "material",
        "emission map",
        "read",
        square(),
        look=shader(
            f"color3f inputs:emissiveColor.connect = </World/Look/Texture.outputs:rgb>\n        {LAMBERT}", texture()
        ),
    ),
    Feature(
        "material",
        "normal map with scale and bias",
        "read",
        square(),
        look=shader(
            f"normal3f inputs:normal.connect = </World/Look/Texture.outputs:rgb>\n        {LAMBERT}",
            texture(
                'token inputs:sourceColorSpace = "raw"\nfloat4 inputs:scale = (2, 2, 2, 1)\n'
                "float4 inputs:bias = (-1, -1, -1, 0)"
            ),
        ),
    ),
    Feature(
        "material",
        "maps with coordinates of their own",
        "adapted",
        square(extra=f'\n    texCoord2f[] primvars:other = {UV} (interpolation = "vertex")'),
        look=shader(
            f"{TEXTURED.splitlines()[0]}\n        float inputs:roughness.connect = </World/Look/Other.outputs:r>",
            texture()
            + texture(name="other")
            .replace('"Texture"', '"Other"')
            .replace('"Reader"', '"Second"')
            .replace("/Reader.", "/Second."),
        ),
    ),
    Feature(
        "material",
        "displacement",
        "adapted",
        look=shader("float inputs:displacement = 0.1"),
    ),
    Feature(
        "material",
        "a clear surface with highlights",
        "adapted",
        look=shader("float inputs:opacity = 0.5"),
    ),
    Feature("material", "opacity map", "read", square(), look=shader(f"{clear_by('r')}\n        {LAMBERT}", texture())),
    Feature(
        "material",
        "cutout by the alpha of the diffuse texture",
        "read",
        square(),
        look=shader(
            f"{clear_by('a')}\n        float inputs:opacityThreshold = 0.5\n        {TEXTURED}",
            texture('token inputs:sourceColorSpace = "sRGB"', file="leaf.png"),
        ),
    ),
    Feature(
        "material",
        "cutout of a glossy surface",
        "read",
        square(),
        look=shader(f"{clear_by('a')}\n        float inputs:opacityThreshold = 0.5", texture(file="leaf.png")),
    ),
    Feature("material", "MaterialX beside a preview surface", "read", look=shader(LAMBERT, MTLX)),
    Feature("material", "Arnold's surface beside a preview surface", "read", look=shader(LAMBERT, ARNOLD)),
    Feature("material", "MaterialX alone", "adapted", look=ONLY_MTLX),
    Feature("texture", "alpha that nothing is connected to", "read", square(), painted(file="leaf.png")),
    Feature("texture", "coordinates called UVMap", "read", square("UVMap"), painted(name="UVMap")),
    Feature("texture", "UsdTransform2d", "read", square(), painted(between=MOVE)),
    Feature(
        "texture",
        "through a node graph",
        "read",
        square(),
        shader(TEXTURED.replace("/Texture.outputs:rgb", "/Graph.outputs:colour"), GRAPH),
    ),
    Feature(
        "texture",
        "wrap mirror",
        "read",
        square(),
        painted('token inputs:wrapS = "mirror"\ntoken inputs:wrapT = "mirror"'),
    ),
    Feature(
        "texture", "wrap black", "read", square(), painted('token inputs:wrapS = "black"\ntoken inputs:wrapT = "black"')
    ),
    Feature("texture", "wrap not said (useMetadata)", "read", square(), painted('token inputs:wrapS = "useMetadata"')),
    Feature(
        "texture",
        "scale and bias",
        "read",
        square(),
        painted("float4 inputs:scale = (0.5, 0.5, 0.5, 1)\nfloat4 inputs:bias = (0.2, 0.2, 0.2, 0)"),
    ),
    Feature(
        "texture",
        "missing file with a fallback",
        "read",
        square(),
        painted("float4 inputs:fallback = (0.5, 0.2, 0.1, 1)", file="gone.png"),
    ),
    Feature("texture", "missing file", "adapted", square(), painted(file="gone.png")),
    Feature("texture", "sourceColorSpace sRGB", "read", square(), painted('token inputs:sourceColorSpace = "sRGB"')),
    Feature("texture", "UDIM", "adapted", square(), painted(file="picture.<UDIM>.png")),
    Feature("stage", "a layer that is not there", "refused", meta=" (prepend references = @./gone.usda@)"),
)
