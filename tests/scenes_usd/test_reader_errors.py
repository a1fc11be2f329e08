"""Everything the contract cannot say is refused, and the message names the prim and the attribute."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Sdf

from notabug.scenes_usd.card import read_card
from notabug.scenes_usd.errors import SceneError, SelectionError
from notabug.scenes_usd.reader import read_scene, survey_scene

SQUARE = "/Scene/Group/Square"
PREVIEW = "/Scene/Grey/Surface"
TEXTURE = "/Scene/Picture/Texture"
POINTS = "point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]"
UV = "[(0, 0), (1, 0), (1, 1), (0, 1)]"
NORMALS = "[(0, 0, 1), (0, 0, 1), (0, 0, 2), (0, 1, 1)]"
BOUND_PICTURE = "rel material:binding = </Scene/Picture>"
GREY = (BOUND_PICTURE, "rel material:binding = </Scene/Grey>")


def points(text: str) -> tuple[str, str]:
    return POINTS, f"point3f[] points = {text}"


def preview(text: str) -> tuple[tuple[str, str], ...]:
    return GREY, ("# preview", text)


def reflection(text: str) -> tuple[tuple[str, str], ...]:
    shader = 'def Shader "Own"\n{\nuniform token info:id = "notabug:Reflection"\n' + text + "\ntoken outputs:out\n}"
    return GREY, ("# grey", f"token outputs:notabug:surface.connect = </Scene/Grey/Own.outputs:out>\n{shader}")


CASES: dict[str, tuple[tuple[tuple[str, str], ...], str, str]] = {
    # the stage and its card
    "no claim": ((('string claim = "A square shows its texture."', ""),), "/Scene.customData:notabug:claim", "missing"),
    "class": ((('"texture"', '"textures"'),), "/Scene.customData:notabug:class", "acne, terminator"),
    "card key": (
        (("string claim", 'string klass = ""\nstring claim'),),
        "/Scene.customData:notabug:klass",
        "unknown key 'klass'",
    ),
    "card type": ((("string claim", "int figure = 3\nstring claim"),), "/Scene.customData:notabug:figure", "got 3"),
    "requires": (
        (("string claim", 'string requires = "mesh"\nstring claim'),),
        "/Scene.customData:notabug:requires",
        "string[]",
    ),
    "reference": (
        (('def Xform "Group"', 'def "Gone" (references = @./gone.usda@)\n{\n}\ndef Xform "Group"'),),
        "/Scene/Gone",
        "gone.usda",
    ),
    "variant without default": ((('string size = "one"', ""),), "/Scene.variants", "one, two"),
    # camera and settings
    "camera target": ((("= </Scene/Camera>", "= </Scene/Light>"),), "/Render/Settings.camera", "no camera"),
    "resolution": ((("(32, 32)", "(32, 0)"),), "/Render/Settings.resolution", "(32, 0)"),
    "pixel aspect": (
        (("# settings", "uniform float pixelAspectRatio = 0"),),
        "/Render/Settings.pixelAspectRatio",
        "got 0",
    ),
    "crop": (
        (("# settings", "uniform float4 dataWindowNDC = (0, 0, 0.5, 1)"),),
        "/Render/Settings.dataWindowNDC",
        "0.5",
    ),
    "conform": (
        (
            ("(32, 32)", "(64, 32)"),
            ("# settings", 'uniform token aspectRatioConformPolicy = "stretchAperture"'),
        ),
        "/Render/Settings.aspectRatioConformPolicy",
        "stretchAperture",
    ),
    "focal length": ((("focalLength = 20", "focalLength = 0"),), "/Scene/Camera.focalLength", "above 0"),
    "clipping": ((("(0.1, 100)", "(1, 1)"),), "/Scene/Camera.clippingRange", "0 < near < far"),
    "camera scale": (
        (
            (
                '(0, 0, 5)\n        uniform token[] xformOpOrder = ["xformOp:translate"]',
                '(0, 0, 5)\ndouble3 xformOp:scale = (1, 2, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]',
            ),
        ),
        "/Scene/Camera.xformOpOrder",
        "unevenly",
    ),
    # lights
    "no light": ((("bool treatAsPoint = 1", 'token visibility = "invisible"'),), "/Scene", "no visible light"),
    "unshadowed light": (
        (("bool treatAsPoint", "bool inputs:shadow:enable = 0\nbool treatAsPoint"),),
        "/Scene/Light.inputs:shadow:enable",
        "not supported",
    ),
    "negative light": ((("inputs:intensity = 4", "inputs:intensity = -4"),), "/Scene/Light.inputs:intensity", "-4"),
    "infinite light": ((("inputs:intensity = 4", "inputs:intensity = inf"),), "/Scene/Light.inputs:intensity", "inf"),
    "overexposed": (
        (("bool treatAsPoint", "float inputs:exposure = 900\nbool treatAsPoint"),),
        "/Scene/Light.inputs:exposure",
        "too bright",
    ),
    "light colour": (
        (("bool treatAsPoint", "color3f inputs:color = (1, -1, 1)\nbool treatAsPoint"),),
        "/Scene/Light.inputs:color",
        "-1",
    ),
    "light profile": (
        (
            ('SphereLight "Light"', 'SphereLight "Light" (prepend apiSchemas = ["ShapingAPI"])'),
            ("bool treatAsPoint", "asset inputs:shaping:ies:file = @lamp.ies@\nbool treatAsPoint"),
        ),
        "/Scene/Light.inputs:shaping:ies:file",
        "profiles",
    ),
    "light filters": (
        (("bool treatAsPoint", "rel light:filters = </Scene/Group>\nbool treatAsPoint"),),
        "/Scene/Light.light:filters",
        "filters",
    ),
    "light linking by a pattern": (
        (
            (
                "bool treatAsPoint",
                'pathExpression collection:lightLink:membershipExpression = "//Group"\n'
                "uniform bool collection:lightLink:includeRoot = 0\nbool treatAsPoint",
            ),
        ),
        "/Scene/Light.collection:lightLink:membershipExpression",
        "patterns of light linking",
    ),
    "distant spot": (
        (
            (
                "# scene",
                'def DistantLight "Sun" (prepend apiSchemas = ["ShapingAPI"])\n'
                "{\nfloat inputs:shaping:cone:angle = 30\n}",
            ),
        ),
        "/Scene/Sun.inputs:shaping:cone:angle",
        "no beam",
    ),
    "light without an area": (
        (("# scene", 'def DiskLight "Disk"\n{\nfloat inputs:radius = 0\n}'),),
        "/Scene/Disk",
        "without an area",
    ),
    "negative width": (
        (("# scene", 'def RectLight "Rect"\n{\nfloat inputs:width = -1\n}'),),
        "/Scene/Rect.inputs:width",
        "-1",
    ),
    "scaled light": (
        (
            ("bool inputs:normalize = 1", "double3 xformOp:scale = (2, 2, 2)"),
            (
                '(1, 2, 3)\n        uniform token[] xformOpOrder = ["xformOp:translate"]',
                '(1, 2, 3)\nuniform token[] xformOpOrder = ["xformOp:scale"]',
            ),
        ),
        "/Scene/Light.xformOpOrder",
        "area",
    ),
    # schemas
    "geometry light": (
        (("# scene", 'def GeometryLight "Odd"\n{\n}'),),
        "/Scene/Odd",
        "unsupported schema GeometryLight",
    ),
    "dome with a texture": (
        (("# scene", 'def DomeLight "Sky"\n{\nasset inputs:texture:file = @sky.exr@\n}'),),
        "/Scene/Sky.inputs:texture:file",
        "no such texture file",
    ),
    "dome with a cube map": (
        (
            (
                "# scene",
                'def DomeLight "Sky"\n{\nasset inputs:texture:file = @sky.exr@\n'
                'token inputs:texture:format = "cubeMapVerticalCross"\n}',
            ),
        ),
        "/Scene/Sky.inputs:texture:format",
        "this parameterization is not supported",
    ),
    "rectangle with a texture": (
        (("# scene", 'def RectLight "Area"\n{\nasset inputs:texture:file = @sky.exr@\n}'),),
        "/Scene/Area.inputs:texture:file",
        "a texture on a rect light",
    ),
    "nothing drawn": ((("# square", 'token visibility = "invisible"'),), "/Scene", "nothing to draw"),
    # geometry
    "no faces": ((("[4]", "[]"),), f"{SQUARE}.faceVertexCounts", "no faces"),
    "two corners": ((("[4]", "[4, 2]"),), f"{SQUARE}.faceVertexCounts", "face 1 has 2 corners"),
    "counts": ((("[4]", "[3]"),), f"{SQUARE}.faceVertexIndices", "expected 3 indices, got 4"),
    "index": ((("[0, 1, 2, 3]", "[0, 1, 2, 4]"),), f"{SQUARE}.faceVertexIndices", "expected 0 to 3, got 4"),
    "negative index": ((("[0, 1, 2, 3]", "[0, 1, -2, 3]"),), f"{SQUARE}.faceVertexIndices", "element 2"),
    "nan point": (
        (points("[(0, 0, 0), (2, nan, 0), (2, 1, 0), (0, 1, 0)]"),),
        f"{SQUARE}.points",
        "element 1 is not finite",
    ),
    "inf normal": ((("(0, 0, 2)", "(0, 0, -inf)"),), f"{SQUARE}.normals", "element 2 is not finite"),
    "nan uv": ((("(1, 0), (1, 1)", "(1, 0), (nan, 1)"),), f"{SQUARE}.primvars:st", "element 2 is not finite"),
    "far away": (
        (points("[(0, 0, 0), (2e31, 0, 0), (2e31, 1e31, 0), (0, 1e31, 0)]"),),
        f"{SQUARE}.points",
        "at most 1e+12, got 2e+31",
    ),
    "zero normal": ((("(0, 0, 2)", "(0, 0, 0)"),), f"{SQUARE}.normals", "corner 2 has no length"),
    "normal count": (((", (0, 1, 1)]", "]"),), f"{SQUARE}.normals", "expected 4, got 3"),
    "uv count": ((("[(0, 0), (1, 0),", "[(1, 0),"),), f"{SQUARE}.primvars:st", "interpolation vertex"),
    "uv indices": (
        (("# square", "int[] primvars:st:indices = [0, 1, 2, 4]"),),
        f"{SQUARE}.primvars:st:indices",
        "expected 0 to 3, got 4",
    ),
    "no uv": ((("primvars:st", "primvars:uv"),), f"{SQUARE}.primvars:st", "picture.png"),
    "animated": (
        ((POINTS, "point3f[] points.timeSamples = {0: [(0, 0, 0)], 1: [(1, 1, 1)]}"),),
        f"{SQUARE}.points",
        "animated",
    ),
    "animated transform": (
        (
            (
                "# group",
                'float xformOp:rotateX.timeSamples = {0: 1, 1: 2}\nuniform token[] xformOpOrder = ["xformOp:rotateX"]',
            ),
        ),
        "/Scene/Group.xformOpOrder",
        "animated",
    ),
    "singular": (
        (("# group", 'float3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'),),
        f"{SQUARE}.xformOpOrder",
        "singular",
    ),
    "nan transform": (
        (("# group", 'double3 xformOp:translate = (nan, 0, 1)\nuniform token[] xformOpOrder = ["xformOp:translate"]'),),
        f"{SQUARE}.xformOpOrder",
        "not finite",
    ),
    "sphere radius": (
        (("# scene", 'def Sphere "Ball"\n{\nrel material:binding = </Scene/Grey>\ndouble radius = 0\n}'),),
        "/Scene/Ball.radius",
        "above 0",
    ),
    # materials
    "bound to nothing": (
        ((BOUND_PICTURE, "rel material:binding = </Scene/Gone>"),),
        f"{SQUARE}.material:binding",
        "/Scene/Gone",
    ),
    "no surface": (
        (GREY, ("token outputs:surface.connect = </Scene/Grey/Surface.outputs:surface>", "")),
        "/Scene/Grey.outputs:surface",
        "not connected",
    ),
    "other shader": (
        (
            ("rel material:binding = </Scene/Picture>", "rel material:binding = </Scene/Grey>"),
            (
                "# grey",
                "token outputs:notabug:surface.connect = </Scene/Grey/Surface.outputs:surface>",
            ),
        ),
        "/Scene/Grey.outputs:notabug:surface",
        "expected notabug:Reflection, got UsdPreviewSurface",
    ),
    "emissive": (preview("color3f inputs:emissiveColor = (-1, 0, 0)"), f"{PREVIEW}.inputs:emissiveColor", "at least 0"),
    "clearcoat": (preview("float inputs:clearcoat = 1.5"), f"{PREVIEW}.inputs:clearcoat", "0 to 1"),
    "roughness": (
        preview("color3f inputs:specularColor = (1, 1, 1)\nfloat inputs:roughness = 2"),
        f"{PREVIEW}.inputs:roughness",
        "0 to 1",
    ),
    "specular": (preview("color3f inputs:specularColor = (1, 1, 2)"), f"{PREVIEW}.inputs:specularColor", "0 to 1"),
    "clear and glossy": (
        preview("color3f inputs:specularColor = (1, 1, 1)\nfloat inputs:opacity = 0.5"),
        f"{PREVIEW}.inputs:opacity",
        "presence",
    ),
    "displacement": (preview("float inputs:displacement = 1"), f"{PREVIEW}.inputs:displacement", "expected 0"),
    "clearcoat map": (
        preview("float inputs:clearcoat.connect = </Scene/Picture/Texture.outputs:rgb>"),
        f"{PREVIEW}.inputs:clearcoat",
        "may not be textured",
    ),
    "constant normal": (preview("normal3f inputs:normal = (0, 1, 0)"), f"{PREVIEW}.inputs:normal", "only a map"),
    "opacity": (preview("float inputs:opacity = 1.5"), f"{PREVIEW}.inputs:opacity", "0 to 1"),
    "workflow": (
        (
            GREY,
            (
                "(0.5, 0.25, 0.125)\n            int inputs:useSpecularWorkflow = 1",
                "(0.5, 0.25, 0.125)\n            int inputs:useSpecularWorkflow = 2",
            ),
        ),
        f"{PREVIEW}.inputs:useSpecularWorkflow",
        "0 to 1",
    ),
    "albedo": ((GREY, ("(0.5, 0.25, 0.125)", "(0.5, 1.25, 0.125)")), f"{PREVIEW}.inputs:diffuseColor", "1.25"),
    "lobe": (reflection('token inputs:lobe = "ward"'), "/Scene/Grey/Own.inputs:lobe", "phong or blinn"),
    "reflection input": (reflection("float inputs:gloss = 1"), "/Scene/Grey/Own.inputs:gloss", "unknown input"),
    "exponent": (reflection("float inputs:exponent = -1"), "/Scene/Grey/Own.inputs:exponent", "0 to 1e+12"),
    "sharper than doubles": (reflection("float inputs:exponent = 1e20"), "/Scene/Grey/Own.inputs:exponent", "1e+12"),
    "mirror": (reflection("color3f inputs:mirror = (2, 0, 0)"), "/Scene/Grey/Own.inputs:mirror", "0 to 1"),
    "ior": (reflection("float inputs:ior = 0"), "/Scene/Grey/Own.inputs:ior", "out of range"),
    # textures
    "missing file": ((("@./picture.png@", "@./gone.png@"),), f"{TEXTURE}.inputs:file", "gone.png"),
    "scale": (
        (("# texture", "float4 inputs:scale = (200, 200, 200, 1)"),),
        f"{TEXTURE}.inputs:scale",
        "expected 0 to 1",
    ),
    "bias": ((("# texture", "float4 inputs:bias = (0, 0, 1, 0)"),), f"{TEXTURE}.inputs:bias", "out of range"),
    "wrap": ((('wrapT = "repeat"', 'wrapT = "tile"'),), f"{TEXTURE}.inputs:wrapT", "repeat, clamp, mirror"),
    "colour space": ((('"raw"', '"ACEScg"'),), f"{TEXTURE}.inputs:sourceColorSpace", "ACEScg"),
    "channel": (
        (("/Texture.outputs:rgb>", "/Texture.outputs:r>"), ("float3 outputs:rgb", "float outputs:r")),
        "/Scene/Picture/Surface.inputs:diffuseColor",
        "outputs:rgb",
    ),
    "other primvar": ((('"st"', '"map1"'),), f"{SQUARE}.primvars:map1", "picture.png"),
    "tiles": ((("@./picture.png@", "@./picture.<UDIM>.png@"),), f"{TEXTURE}.inputs:file", "UDIM"),
    "subdivision scheme": (
        (('subdivisionScheme = "none"', 'subdivisionScheme = "butterfly"'),),
        f"{SQUARE}.subdivisionScheme",
        "got butterfly",
    ),
    "hole index": ((("# square", "int[] holeIndices = [1]"),), f"{SQUARE}.holeIndices", "expected 0 to 0, got 1"),
    "every face a hole": ((("# square", "int[] holeIndices = [0]"),), "/Scene", "nothing to draw"),
    "subset index": (
        (("# square", 'def GeomSubset "Half" {\nuniform token familyName = "materialBind"\nint[] indices = [3]\n}'),),
        f"{SQUARE}/Half.indices",
        "expected 0 to 0, got 3",
    ),
    "instances without prototypes": (
        (("# scene", 'def PointInstancer "Many"\n{\nint[] protoIndices = [0]\npoint3f[] positions = [(0, 0, 0)]\n}'),),
        "/Scene/Many.protoIndices",
        "out of range",
    ),
    "two cameras": (
        (("# scene", 'def Camera "Second"\n{\n}'), ("rel camera = </Scene/Camera>", "")),
        "/Render/Settings.camera",
        "/Scene/Second",
    ),
    "two settings": (
        (("# scene", 'def RenderSettings "Second"\n{\n}'), ('renderSettingsPrimPath = "/Render/Settings"', "")),
        "/.renderSettingsPrimPath",
        "2 RenderSettings",
    ),
    "no coordinates": (
        (("float2 inputs:st.connect = </Scene/Picture/Coordinates.outputs:result>", ""),),
        f"{TEXTURE}.inputs:st",
        "UsdPrimvarReader_float2",
    ),
    # intent
    "intent missing": (
        (("string claim", 'string intent = "/Scene/None"\nstring claim'),),
        "/Scene.customData:notabug:intent",
        "/Scene/None",
    ),
    "intent drawn": (
        (("string claim", 'string intent = "/Scene/Group/Square"\nstring claim'),),
        "/Scene.customData:notabug:intent",
        "guide",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_refused(case: str, write: Callable[..., Path]) -> None:
    changes, where, fragment = CASES[case]
    with pytest.raises(SceneError) as caught:
        read_scene(write(*changes))
    assert caught.value.where == where, str(caught.value)
    assert str(caught.value).startswith(where)
    assert fragment in str(caught.value)


def test_unchanged_stage_is_accepted(write: Callable[..., Path]) -> None:
    """The cases above change one thing in a stage that reads without them."""
    scene = read_scene(write())
    assert (scene.id, scene.variant, len(scene.objects), len(scene.lights)) == ("square", "size=one", 1, 1)


@pytest.mark.parametrize("case", ["no surface", "opacity", "lobe"])
def test_grey_is_accepted(case: str, write: Callable[..., Path]) -> None:
    changes = CASES[case][0][:1]
    assert read_scene(write(*changes)).materials[0].path == "/Scene/Grey"


def test_texture_damaged(write: Callable[..., Path], tmp_path: Path, png: Callable[..., bytes]) -> None:
    path = write()
    for data, fragment in (
        (b"", "empty"),
        (b"plain text", "not a picture"),
        (png(bytes(range(12)), 2, 2)[:50], "damaged"),
    ):
        (tmp_path / "picture.png").write_bytes(data)
        with pytest.raises(SceneError) as caught:
            read_scene(path)
        assert caught.value.where == f"{TEXTURE}.inputs:file"
        assert fragment in str(caught.value)


def test_not_a_stage(tmp_path: Path) -> None:
    path = tmp_path / "bad.usda"
    path.write_text("#usda 1.0\ndef Xform {")
    with pytest.raises(SceneError, match=r"bad\.usda: cannot be opened as a USD stage"):
        read_scene(path)
    path.write_bytes(b"")
    with pytest.raises(SceneError, match=r"bad\.usda"):
        read_scene(path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            'def Xform "A"\n{\n    def RectLight "B" { float inputs:intensity = 30 }\n}\n',
            "line 4, column 25: Expected }",
        ),
        ('def Xform "A"\n{\n    int a = "b"\n}\n', "Failed to parse value"),
        ('def Xform "A"\n{\n', "line 4, column"),
    ],
)
def test_a_mistake_in_the_file_is_told_by_line_and_without_usds_own_source(
    tmp_path: Path, text: str, told: str
) -> None:
    path = tmp_path / "bad.usda"
    path.write_text(f"#usda 1.0\n{text}")
    with pytest.raises(SceneError) as caught:
        read_scene(path)
    message = str(caught.value)
    assert told in message
    assert "in file /" not in message
    assert "Error in '" not in message
    assert message.count(str(path)) == 1
    with pytest.raises(SceneError, match="no such file"):
        read_scene(tmp_path / "gone.usda")


@pytest.mark.parametrize("source", ["terminator/none", "none", "../scenes_usd/terminator/sphere", "terminator"])
def test_unknown_scene(source: str) -> None:
    with pytest.raises(SelectionError, match=r"terminator/\w+|notabug list scenes"):
        read_scene(source)


def test_unknown_variant(write: Callable[..., Path]) -> None:
    path = write()
    with pytest.raises(SelectionError, match=r"no variant 'three' in the set 'size'; expected one of one, two"):
        read_scene(path, {"size": "three"})
    with pytest.raises(SelectionError, match=r"no variant set 'colour'; expected one of size"):
        read_scene(path, {"colour": "red"})


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (("# preview", "float inputs:specular = 0.5"), f"{PREVIEW}.inputs:specular"),
        (("# texture", "float inputs:gain = 1"), f"{TEXTURE}.inputs:gain"),
        (("# scene", 'def Points "Dust"\n{\n}'), "/Scene/Dust"),
        (("# scene", 'def BasisCurves "Hair"\n{\n}'), "/Scene/Hair"),
        (("# scene", 'def Teapot "Tea"\n{\n}'), "/Scene/Tea"),
    ],
)
def test_not_read_is_told_and_refuses_nothing(change: tuple[str, str], where: str, write: Callable[..., Path]) -> None:
    """Blender writes inputs:specular on every UsdPreviewSurface; a verdict's notes say what the scene lacks."""
    path = write(change, *((GREY,) if where.startswith(PREVIEW) else ()))
    remarks = survey_scene(path).remarks
    assert [(each.kind, each.where) for each in remarks] == [("not read", where)]
    notes = read_scene(path).notes
    assert [where in note for note in notes] == ([] if ".inputs:" in where else [True])


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ((("float focalLength", "float fStop = 8\nfloat focalLength"),), "/Scene/Camera.fStop"),
        (((BOUND_PICTURE, ""),), f"{SQUARE}.material:binding"),
        ((('defaultPrim = "Scene"', ""),), "/"),
        ((('"/Render/Settings"', '"/Render/None"'), ("def RenderSettings", "def Scope")), "/"),
        ((("rel camera = </Scene/Camera>", ""),), "/Scene/Camera"),
    ],
)
def test_what_is_assumed_is_told(changes: tuple[tuple[str, str], ...], where: str, write: Callable[..., Path]) -> None:
    remarks = survey_scene(write(*changes)).remarks
    assert where in [each.where for each in remarks if each.kind == "approximated"]
    assert not [each for each in remarks if each.kind == "out of the contract"]


def test_the_card_of_the_hint_can_be_pasted(tmp_path: Path) -> None:
    """What the error says to write is valid USD, in the place that it names, and is a card."""
    with pytest.raises(SceneError) as refused:
        read_card({"notabug": {"class": "texture"}}, "/Scene")
    pasted = str(refused.value).partition("write ")[2].partition(" on the default prim")[0]
    path = tmp_path / "pasted.usda"
    path.write_text(f'#usda 1.0\n(defaultPrim = "Scene")\ndef Xform "Scene" (\n    {pasted}\n)\n{{\n}}\n')
    layer = Sdf.Layer.FindOrOpen(str(path))
    assert read_card(dict(layer.GetPrimAtPath("/Scene").customData), "/Scene").claim == "..."
