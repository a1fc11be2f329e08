"""The features of UsdLux: what is said of lights, and what that means."""

from __future__ import annotations

from notabug.scenes_usd.authoring.preview_features import MATT, feature
from notabug.scenes_usd.authoring.stage import looking, mesh, over, placed
from notabug.scenes_usd.authoring.usda import block

LUX = "UsdLux schema"


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


LIGHTS = (
    feature(
        "light_point",
        "A sphere light that is treated as a point falls off with the square of the distance.",
        surface=MATT,
        lights=(over("Fill", 'token visibility = "invisible"'),),
        cites=LUX,
    ),
    feature(
        "light_distant",
        "A distant light without an angle is parallel and falls off not at all.",
        surface=MATT,
        lights=(over("Key", 'token visibility = "invisible"'),),
        cites=LUX,
    ),
    feature(
        "light_exposure",
        "Exposure e multiplies by two to the power of e.",
        surface=MATT,
        lights=light("float inputs:exposure = -1.5"),
        cites=LUX,
    ),
    feature(
        "light_colour",
        "The light's colour multiplies its intensity.",
        surface=MATT,
        lights=light("color3f inputs:color = (1, 0.4, 0.1)"),
        cites=LUX,
    ),
    feature(
        "light_temperature",
        "A colour temperature multiplies by the colour of a black body of the same luminance.",
        surface=MATT,
        lights=light("bool inputs:enableColorTemperature = 1\nfloat inputs:colorTemperature = 3000"),
        cites=LUX,
    ),
    feature(
        "light_temperature_off",
        "A colour temperature that is not enabled changes nothing.",
        surface=MATT,
        lights=light("float inputs:colorTemperature = 3000"),
        cites=LUX,
    ),
    feature(
        "light_radius",
        "A normalised light that is treated as a point is as bright at every radius.",
        surface=MATT,
        lights=light("float inputs:radius = 3"),
        cites=LUX,
    ),
    feature(
        "light_sphere",
        "A sphere light has the radiance that its intensity says, and penumbras as its radius makes them.",
        **soft("Sphere", "float inputs:intensity = 30\nfloat inputs:radius = 0.4"),
    ),
    feature(
        "light_sphere_normalised",
        "Normalize divides by the area: the radius sets how soft the light is, not how bright.",
        **soft("Sphere", "float inputs:intensity = 60\nfloat inputs:radius = 0.4\nbool inputs:normalize = 1"),
    ),
    feature(
        "light_rect",
        "A rect light shines from one side, along its -z.",
        **soft("Rect", "float inputs:intensity = 25\nfloat inputs:width = 1.2\nfloat inputs:height = 0.5"),
    ),
    feature(
        "light_rect_normalised",
        "Normalize divides by width times height.",
        **soft(
            "Rect",
            "float inputs:intensity = 16\nfloat inputs:width = 1.2\nfloat inputs:height = 0.5\n"
            "bool inputs:normalize = 1",
        ),
    ),
    feature(
        "light_disk",
        "A disk light shines from one side, along its -z.",
        **soft("Disk", "float inputs:intensity = 30\nfloat inputs:radius = 0.4"),
    ),
    feature(
        "light_cylinder",
        "A cylinder light shines from its side, along its x axis.",
        **soft("Cylinder", "float inputs:intensity = 30\nfloat inputs:length = 1.2\nfloat inputs:radius = 0.12"),
    ),
    feature(
        "light_angle",
        "A distant light's angle is the full width of the sun that it stands for.",
        **soft("Distant", "float inputs:intensity = 2.5\nfloat inputs:angle = 20\nbool inputs:normalize = 1"),
    ),
    feature(
        "light_angle_unnormalised",
        "Without normalize a distant light's intensity is radiance: its angle sets how bright it is.",
        **soft("Distant", "float inputs:intensity = 26\nfloat inputs:angle = 20"),
    ),
    feature(
        "light_dome",
        "A dome light shines from every side alike: a surface that sees all of it reflects pi times its radiance.",
        **soft("Dome", "float inputs:intensity = 0.8"),
    ),
    feature(
        "light_dome_picture",
        "A dome's picture has its upper row at +Y, its middle at +Z, and a quarter from the left +X.",
        **soft("Dome", "float inputs:intensity = 1.2\nasset inputs:texture:file = @./textures/sky.png@"),
    ),
    feature("light_cone", "A cone cuts a light at its angle.", **beam("float inputs:shaping:cone:angle = 16")),
    feature(
        "light_cone_softness",
        "A cone's softness is the share of the angle over which its edge fades.",
        **beam("float inputs:shaping:cone:angle = 24\nfloat inputs:shaping:cone:softness = 0.6"),
    ),
    feature("light_focus", "Focus multiplies by the cosine to its power.", **beam("float inputs:shaping:focus = 30")),
    feature(
        "light_link",
        "A light does not light what its lightLink excludes, and is still blocked by it.",
        surface=MATT,
        lights=(*light("rel collection:lightLink:excludes = </Scene/Card>"), CARD),
        cites=LUX,
    ),
    feature(
        "light_shadow_link",
        "What a light's shadowLink excludes casts no shadow of it, and is still lit.",
        surface=MATT,
        lights=(*light("rel collection:shadowLink:excludes = </Scene/Card>"), CARD),
        cites=LUX,
    ),
    feature(
        "light_diffuse",
        "The diffuse multiplier leaves the highlight as it is.",
        lights=light("float inputs:diffuse = 0.3"),
        cites=LUX,
    ),
    feature(
        "light_specular",
        "The specular multiplier leaves the diffuse part as it is.",
        lights=light("float inputs:specular = 4"),
        cites=LUX,
    ),
)
